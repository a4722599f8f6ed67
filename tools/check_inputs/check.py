"""check.py KINRAN FOLDER [KIND...]: runs all kinds of inputs, or those that are named; they are made in FOLDER."""

import shutil
import sys
from pathlib import Path

import curvature
import exr
import flags
import folders
import headers
import images
import models
import names
from common import Kind

KINDS = {
    "exr": ("compressions, channels, layers and colour of EXR", exr.check),
    "images": ("forms of PNG, TGA, TIFF and JPEG", images.check),
    "headers": ("headers of DDS and HDR", headers.check),
    "names": ("names of exporters' sets", names.check),
    "folders": ("files of folders that are not read", folders.check),
    "models": ("textures of glTF: shared, packed, moved, of any length, green down", models.check),
    "flags": ("flags that cannot act", flags.check),
    "curvature": ("curvature of a sphere, stored in many ways", curvature.check),
}


def main():
    kinran, folder = Path(sys.argv[1]), Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)
    failed = False
    for name in sys.argv[3:] or KINDS:
        title, check = KINDS[name]
        kind = Kind(title, kinran, folder / name)
        try:
            check(kind)
        finally:
            failed |= kind.report()
    sys.exit(failed)


main()
