import inspect
import json
import re
import signal
import subprocess
import sys
import threading
import time

import kinran
import numpy as np
import pytest

from conftest import bumps, png


def test_a_model_is_baked_from_bytes_to_bytes_as_from_disk_to_disk(model, tmp_path):
    data, files = model
    report, baked = kinran.bake(data, name="lamp.gltf", files=files, encoder="portable")
    assert "lamp_brass_normal.ktx2" in baked and "lamp.gltf" in baked
    (tmp_path / "lamp.gltf").write_bytes(data)
    (tmp_path / "bumps.png").write_bytes(files["bumps.png"])
    out = tmp_path / "out"
    again = kinran.bake(tmp_path / "lamp.gltf", out, encoder="portable")
    for name, content in baked.items():
        if name.endswith(".ktx2"):
            assert (out / name).read_bytes() == content, name
    assert [s["name"] for s in report["surfaces"]] == [s["name"] for s in again["surfaces"]] == ["brass"]
    assert kinran.check(out / "lamp.gltf")["findings"] == []
    assert kinran.inspect(out / "lamp.gltf")["materials"][0]["name"] == "brass"


def test_a_folder_is_baked_and_read_back(folder, tmp_path, normals):
    told = []
    kinran.bake(folder, tmp_path / "out", normal_format="rgba8", progress=lambda *state: told.append(state))
    assert told and all(len(state) == 3 for state in told)
    texture = kinran.decode_texture(tmp_path / "out" / "tin_normal.ktx2")
    assert texture.format == "rgba8" and texture.keys["KinranMap"] == "normal" and len(texture.levels) == 6
    np.testing.assert_allclose(texture.levels[0][..., :2], normals[..., :2] / 255, atol=1 / 255)


def test_what_is_wrong_is_told_in_python_s_words(folder, tmp_path, model):
    with pytest.raises(TypeError, match="unexpected keyword argument 'all_texture'; did you mean all_textures"):
        kinran.bake(folder, tmp_path / "out", all_texture=True)
    with pytest.raises(kinran.InputError, match="all_textures=True") as caught:
        kinran.bake(folder, tmp_path / "out", all_textures=True)
    assert caught.value.code == "usage" and caught.value.option == "all_textures"
    with pytest.raises(kinran.FileError, match="nope.glb: there is no such file") as caught:
        kinran.bake(tmp_path / "nope.glb", tmp_path / "out")
    assert caught.value.file.endswith("nope.glb") and isinstance(caught.value, OSError)
    with pytest.raises(kinran.InputError):
        kinran.bake(b"not a model", name="x.glb")
    with pytest.raises(kinran.InputError, match="invalid value 'best' for `filter`"):
        kinran.bake(folder, tmp_path / "out", filter="best")
    with pytest.raises(kinran.FileError, match="nope.ktx2: No such file") as caught:
        kinran.decode_texture(tmp_path / "nope.ktx2")
    assert caught.value.code == "io" and caught.value.file.endswith("nope.ktx2")
    with pytest.raises(TypeError, match="needs an output"):
        kinran.bake(folder)
    assert not (tmp_path / "out").exists()


def test_a_file_of_somebody_else_is_lost(folder, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "tin_normal.ktx2").write_bytes(b"mine")
    with pytest.raises(kinran.InputError, match="did not write"):
        kinran.bake(folder, out)
    assert (out / "tin_normal.ktx2").read_bytes() == b"mine"
    kinran.bake(folder, out, force=True)


def test_an_exception_of_the_callback_does_not_stop_the_bake(tmp_path):
    maps = tmp_path / "big"
    maps.mkdir()
    (maps / "big_normal.png").write_bytes(png(np.tile(bumps(), (64, 64, 1))))

    class Enough(Exception):
        pass

    def stop(what, done, total):
        raise Enough(what)

    begin = time.monotonic()
    with pytest.raises(Enough):
        kinran.bake(maps, tmp_path / "out", roughness=0.4, preset="best", progress=stop)
    assert time.monotonic() - begin < 20
    assert not (tmp_path / "out").exists() or not any((tmp_path / "out").iterdir())


def test_ctrl_c_leaves_something_half_written(tmp_path):
    maps = tmp_path / "big"
    maps.mkdir()
    (maps / "big_normal.png").write_bytes(png(np.tile(bumps(), (64, 64, 1))))
    program = (
        "import kinran, sys\n"
        "told = []\n"
        "def tell(*state):\n"
        "    told or print('begun', flush=True)\n"
        "    told.append(state)\n"
        "try:\n    kinran.bake(sys.argv[1], sys.argv[2], roughness=0.4, preset='best', progress=tell)\n"
        "except KeyboardInterrupt:\n    print('stopped')\n"
    )
    child = subprocess.Popen(
        [sys.executable, "-c", program, str(maps), str(tmp_path / "out")], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout.readline() == "begun\n"
    child.send_signal(signal.SIGINT)
    rest, _ = child.communicate(timeout=60)
    assert rest == "stopped\n" and child.returncode == 0
    assert not (tmp_path / "out").exists() or not any((tmp_path / "out").iterdir())


def test_other_threads_wait_for_a_bake(folder, tmp_path):
    ran = []
    done = threading.Event()

    def count():
        while not done.is_set():
            ran.append(1)
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    before = len(ran)
    kinran.bake(folder, tmp_path / "out", preset="best")
    done.set()
    counter.join()
    assert len(ran) > before


def test_two_bakes_at_once_are_not_those_of_one_by_one(model):
    data, files = model
    alone = kinran.bake(data, name="lamp.gltf", files=files)[1]
    both = [None, None]

    def bake(i):
        both[i] = kinran.bake(data, name="lamp.gltf", files=files)[1]

    threads = [threading.Thread(target=bake, args=(i,)) for i in range(2)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert both == [alone, alone]


def test_a_library_is_baked_once(folder, tmp_path):
    manifest = tmp_path / "kinran.toml"
    manifest.write_text('[[aniso]]\ninput = "tin"\n\n[[aniso]]\ninput = "gone"\n')
    cache = tmp_path / "cache"
    first = kinran.bake_library(manifest, cache=cache)
    assert [entry["status"] for entry in first["entries"]] == ["baked", "failed"]
    assert "does not exist" in first["entries"][1]["error"]["message"]
    second = kinran.bake_library(manifest, cache=cache, dry_run=True)
    assert second["entries"][0]["status"] == "up-to-date" and second["dry_run"]
    manifest.write_text('[[aniso]]\ninput = "tin"\nzst = 3\n')
    with pytest.raises(kinran.InputError, match="did you mean `zstd`") as caught:
        kinran.bake_library(manifest, cache=cache)
    assert (caught.value.line, caught.value.column) == (3, 1)


def test_a_detail_map_blends_to_its_target(tmp_path):
    rng = np.random.default_rng(3)
    target, tile = (rng.integers(90, 166, (64, 64, 3)).astype(np.uint8) for _ in range(2))
    files = {"wall_color.png": png(target), "plaster_color.png": png(tile)}
    report, made = kinran.solve_detail("wall_color.png", layer="plaster_color.png,scale=1", files=files, format="rgba8")
    assert report["levels"][0]["error"] < 2 and any("synthesized" in name for name in made)


def test_the_command_line_is_the_same(folder, tmp_path):
    run = [sys.executable, "-m", "kinran"]
    said = subprocess.run([*run, "bake", folder, "-o", tmp_path / "out", "--json"], capture_output=True, text=True)
    assert said.returncode == 0 and json.loads(said.stdout)["surfaces"][0]["name"] == "tin"
    said = subprocess.run([*run, "bake", "nope.glb"], capture_output=True, text=True)
    assert said.returncode == 2 and said.stderr.startswith("error: nope.glb: there is no such file")


def test_help_reads_like_a_manual():
    doc = kinran.bake.__doc__
    assert "all_textures : bool" in doc and "{options}" not in doc
    # Flags are told as options.
    assert not re.search(r"(?<![-\w])--[a-z]", doc)

    parameters = inspect.signature(kinran.bake).parameters
    assert parameters["zstd"].default == "3" and parameters["filter"].default == "ml" and "watch" not in parameters
