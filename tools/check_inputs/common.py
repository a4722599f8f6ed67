"""What all kinds share: running kinran, texels of what it wrote, comparisons, a relief, and glTF to put it in."""

import io
import json
import struct
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from PIL import Image

# Texels of 8 bits are rounded twice, as input and as output: half a step each.
STEP = 1 / 255 + 1e-4


class Kind:
    """Checks of one kind, counted, with those that failed."""

    def __init__(self, title, kinran, folder):
        self.title, self.kinran, self.folder = title, kinran, folder
        self.count, self.failures, self.command = 0, [], ""

    def inputs(self, name, files):
        """A folder of the files {name: bytes, or a function that writes to a path}, made anew."""
        folder = self.folder / name
        folder.mkdir(parents=True)
        for file, content in files.items():
            content(folder / file) if callable(content) else (folder / file).write_bytes(content)
        return folder

    def run(self, *args):
        """Exit code and JSON document of a command."""
        words = [str(word) for word in args]
        self.command = " ".join(["kinran", *words])
        done = subprocess.run([self.kinran, *words, "--json"], capture_output=True, text=True, timeout=300)
        try:
            return done.returncode, json.loads(done.stdout)
        except json.JSONDecodeError:
            return done.returncode, {"error": {"message": done.stdout + done.stderr}}

    def bake(self, path, *flags):
        """`Baked` of a folder or a model; where it fails, a failure is noted and None comes back."""
        out = path.parent / f"{path.stem}.baked"
        code, document = self.run("bake", path, "-o", out, "--container", "dds", *flags)
        if self.equal(path, "exit code", 0, code, document.get("error", {}).get("message", "")):
            return Baked(out, document)

    def refused(self, path, name, *words, command=("bake",)):
        """The command must fail, name the file and say the words."""
        out = ["-o", path.parent / f"{path.stem}.baked"] if command[0] == "bake" else []
        code, document = self.run(command[0], path, *out, *command[1:])
        error = document.get("error", {})
        message = error.get("message", "")
        self.equal(path, "exit code", 2, code, message)
        self.equal(path, "file of the error", name, Path(error.get("file", "")).name, message)
        self.says(path, message, *words)

    def equal(self, path, what, wanted, got, why=""):
        return self._note(wanted == got, path, what, wanted, f"{got} {why}".rstrip())

    def near(self, path, what, wanted, got, within):
        """Numbers or arrays that differ by no more."""
        wanted, got = np.asarray(wanted, float), np.asarray(got, float)
        if wanted.ndim and wanted.shape != got.shape:
            return self._note(False, path, what, f"shape {wanted.shape}", f"shape {got.shape}")
        off = np.abs(got - wanted)
        worst = np.unravel_index(np.argmax(off), off.shape)
        where = f"at {[int(i) for i in worst]} of {list(off.shape)}, " if off.ndim else ""
        full = np.broadcast_to(wanted, off.shape)
        return self._note(
            bool(off.max() <= within), path, what, f"{full[worst]:.5f} within {within:.5f}", f"{where}{got[worst]:.5f}"
        )

    def says(self, path, text, *words):
        """Texts that hold all words."""
        text = text if isinstance(text, str) else "\n".join(text)
        for word in words:
            self._note(word in text, path, "words", word, text or "nothing")

    def silent(self, path, baked):
        self.equal(path, "warnings", [], baked.warnings)

    def _note(self, right, path, what, wanted, got):
        self.count += 1
        if not right:
            self.failures.append(f"WRONG {path}: {what}\n  wanted {wanted}\n  got    {got}\n  by     {self.command}")
        return right

    def report(self):
        """Prints; whether anything failed."""
        for failure in self.failures:
            print(failure)
        right = self.count - len(self.failures)
        print(f"{'WRONG' if self.failures else 'ok   '} {self.title}: {right} of {self.count}")
        return bool(self.failures)


class Baked:
    """What a bake wrote and said."""

    def __init__(self, folder, document):
        self.folder, self.document, self.warnings = folder, document, document["warnings"]

    def texels(self, map, surface=0):
        """Level 0 of a map, as stored, 0 to 1."""
        for output in self.document["surfaces"][surface]["outputs"]:
            if output["map"] == map:
                return read_texels(self.folder / output["file"], output)
        raise KeyError(f"no {map} map in {self.document['surfaces'][surface]['outputs']}")

    def model(self):
        """JSON and binary chunk of the model."""
        return read_glb(next(self.folder.glob("*.glb")))


def read_texels(path, says):
    if says["format"] == "rgba16f":
        # OpenImageIO does not know this format of DDS. Magic number and headers are 148 bytes.
        shape = says["height"], says["width"], 4
        return np.fromfile(path, np.float16, np.prod(shape), offset=148).reshape(shape).astype(float)
    file = oiio.ImageInput.open(str(path))
    if not file:
        raise SystemExit(f"WRONG {path}: OpenImageIO: {oiio.geterror()}")
    return file.read_image(0, 0, 0, file.spec().nchannels, "float")


def relief(width, height):
    """Unit normals, +Y up, of waves that no mirror or turn takes into themselves."""
    y, x = np.mgrid[0:height, 0:width] + 0.5
    u, v = 2 * np.pi * x / width, 2 * np.pi * y / height
    both = 0.2 * np.cos(2 * u + v + 1)
    # Slopes of one height field, so that green up and down can be told apart.
    along, down = 0.4 * np.cos(2 * u) + both, (-0.5 * np.sin(3 * v) + both / 2) * width / height
    return unit(np.dstack([-along, down, np.ones_like(along)]))


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def stored(normals, bits=8):
    """Normals as integers of so many bits."""
    top = 2**bits - 1
    return np.rint((normals * 0.5 + 0.5) * top).astype(np.uint8 if bits == 8 else np.uint16)


def png(pixels, **options):
    file = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(file, "PNG", **options)
    return file.getvalue()


def flat(*color, size=32):
    """One colour of 8 bits everywhere, or a grey without an axis of channels."""
    shape = (size, size, len(color)) if len(color) > 1 else (size, size)
    return np.full(shape, color, np.uint8)


COMPONENTS = {
    np.dtype("i1"): 5120,
    np.dtype("u1"): 5121,
    np.dtype("i2"): 5122,
    np.dtype("u2"): 5123,
    np.dtype("u4"): 5125,
    np.dtype("f4"): 5126,
}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Gltf:
    """A glTF file in the making; `json` may be changed at will."""

    def __init__(self):
        self.blob = bytearray()
        self.json = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": []}

    def add(self, key, value):
        """Index of what is added to the list `key`."""
        self.json.setdefault(key, []).append(value)
        return len(self.json[key]) - 1

    def view(self, data, **more):
        self.blob += b"\0" * (-len(self.blob) % 4)
        offset = len(self.blob)
        self.blob += data
        return self.add("bufferViews", {"buffer": 0, "byteOffset": offset, "byteLength": len(data), **more})

    def accessor(self, array, **more):
        """Rows of an array, each padded to four bytes, with their smallest and largest values."""
        array = np.ascontiguousarray(array if array.ndim > 1 else array[:, None])
        count, width = array.shape
        row = array.itemsize * width
        view = {}
        data = array.tobytes()
        if row % 4 and width > 1:
            padded = np.zeros((count, row + -row % 4), np.uint8)
            padded[:, :row] = array.view(np.uint8)
            data, view = padded.tobytes(), {"byteStride": padded.shape[1]}
        return self.add(
            "accessors",
            {
                "bufferView": self.view(data, **view),
                "componentType": COMPONENTS[array.dtype],
                "count": count,
                "type": TYPES[width],
                "min": array.min(0).tolist(),
                "max": array.max(0).tolist(),
                **more,
            },
        )

    def image(self, data, mime="image/png"):
        return self.add("images", {"bufferView": self.view(data), "mimeType": mime})

    def scene(self, primitives, nodes=None):
        self.json["meshes"] = [{"primitives": primitives}]
        self.json["nodes"] = nodes or [{"mesh": 0}]
        self.json["scenes"], self.json["scene"] = [{"nodes": [0]}], 0

    def bytes(self):
        self.json["buffers"] = [{"byteLength": len(self.blob)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        blob = bytes(self.blob) + b"\0" * (-len(self.blob) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def read_glb(path):
    """JSON and binary chunk."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]
