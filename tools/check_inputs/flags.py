"""Flags that do not act on an input are refused by name; one that says what is so anyway changes no byte."""

from common import flat, png, relief, stored
from models import document

N8 = stored(relief(32, 32))

MODEL = [
    ["--edges", "clamp"],
    ["--roughness-is-gloss"],
    ["--roughness", "0.1"],
    ["--anisotropy", "0.9"],
    ["--direction-span", "180"],
    ["--map", "normal=nothing.png"],
    ["--ignore", "nothing.png"],
    ["--force-normal"],
    ["--normal-blue"],
    ["--exr-layer", "nothing.exr=x"],
    ["--jobs", "2"],
    ["--prune"],
]
FOLDER = [
    ["--skin", "all"],
    ["--curvature", "all"],
    ["--curvature-method", "fit"],
    ["--curvature-range", "0.5"],
    ["--curvature-blur", "8,2"],
    ["--unit-mm", "5"],
    ["--estimate-normals"],
    ["--all-textures"],
    ["--separate-specular"],
    ["--curvature-dump", "json"],
    ["--allow-outside", "."],
    ["--map", "normal=nothing.png"],
    ["--ignore", "nothing.png"],
    ["--exr-layer", "nothing.exr=x"],
    ["--jobs", "2"],
    ["--prune"],
]


def written(baked):
    """Bytes of textures and models by name; reports hold flags."""
    return {file.name: file.read_bytes() for file in baked.folder.iterdir() if file.suffix != ".json"}


def check(kind):
    material = {
        "name": "a",
        "normalTexture": {"index": 0},
        "pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 1}},
    }
    model = document([png(N8), png(flat(90, 90, 90))], [material])
    path = kind.inputs("model", {"model.glb": model.bytes()}) / "model.glb"
    folder = kind.inputs("folder", {"mat_normal.png": png(N8), "mat_roughness.png": png(flat(90))})
    for input, flags in [(path, MODEL), (folder, FOLDER)]:
        for flag in flags:
            code, says = kind.run("bake", input, "-o", kind.folder / "refused", *flag)
            kind.equal(input, f"exit code with {flag[0]}", 2, code)
            error = says.get("error", {})
            named = error.get("flag", "").split(" ")[0]
            kind.equal(input, "flag of the error", flag[0], named, error.get("message", ""))
        kind.equal(input, "files written", False, (kind.folder / "refused").exists())
        plain = kind.bake(input)
        first = written(plain) if plain else {}
        flagged = kind.bake(input, "--y-up", "--force")
        second = written(flagged) if flagged else {}
        kind.equal(input, "files with --y-up", sorted(first), sorted(second))
        changed = [name for name in first if first[name] != second.get(name)]
        kind.equal(input, "files changed by --y-up", [], changed)
