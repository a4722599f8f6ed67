"""Compares the pictures that check.mjs took: compare.py FOLDER. Prints the table, writes FOLDER/sheet.png.

Near by: mean absolute difference of display values to the authored model's picture. From afar: root mean square
difference of display values to ground truth, which is the authored model's large picture averaged 8 x 8 in linear light.
"""
import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

ROLES = ("web", "desktop", "engine")
# A picture of nothing has one colour.
MIN_COLOURS = 50
# Display values of 0 to 1 that a baked model may be away near by, on average; chosen by eye, BC1 and JPEG do as much.
NEAR = 0.02


def linear(x):
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def display(x):
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 0) ** (1 / 2.4) - 0.055)


def main():
    folder = Path(sys.argv[1])
    said = json.loads((folder / "said.json").read_text())

    def picture(viewer, role, view):
        path = folder / f"{viewer}_{role}_{view}.png"
        return np.asarray(Image.open(path).convert("RGB"), np.float64) / 255 if path.exists() else None

    wrong, rows, sheet = 0, [], []
    for viewer, version in said["viewers"].items():
        near, far, large = (picture(viewer, "authored", view) for view in ("near", "far", "truth"))
        words = said["said"][f"{viewer} authored"]
        if near is None or len(np.unique(near.reshape(-1, 3), axis=0)) < MIN_COLOURS:
            rows.append((viewer, version, "authored", "not drawn", "", "", "; ".join(words)))
            continue
        truth = display(linear(large).reshape(64, 8, 64, 8, 3).mean((1, 3)))
        rmse = lambda p: float(np.sqrt(((p - truth) ** 2).mean()))
        rows.append((viewer, version, "authored", "", f"{rmse(far):.4f}", "", "; ".join(words)))
        sheet.append((f"{viewer} {version}", [near, far, truth]))
        for role in ROLES:
            mine, mine_far = picture(viewer, role, "near"), picture(viewer, role, "far")
            words = "; ".join(said["said"][f"{viewer} {role}"])
            if mine is None:
                rows.append((viewer, version, role, "not drawn", "", "", words))
                wrong += role == "web" and not words.startswith("not run")
                continue
            off = float(np.abs(mine - near).mean())
            # Only what is baked for the web is looked at from afar: the others have the same levels or none.
            measured = ("", "") if mine_far is None else (f"{rmse(mine_far):.4f}", f"{rmse(far) / rmse(mine_far):.2f}")
            rows.append((viewer, version, role, f"{off:.4f}", *measured, words))
            wrong += role == "web" and off > NEAR
            sheet.append((f"{viewer} {role}", [mine] if mine_far is None else [mine, mine_far]))
    print("| viewer | version | file | near: mean difference to authored | from afar: RMSE to truth | gain | said |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for row in rows:
        print("| " + " | ".join(str(cell).replace("|", "/").replace("\n", " ") for cell in row) + " |")

    width = 260
    picture = Image.new("RGB", (3 * width, len(sheet) * 276), "#202020")
    draw = ImageDraw.Draw(picture)
    for i, (name, pictures) in enumerate(sheet):
        draw.text((4, i * 276 + 2), name, fill="#ffffff")
        for j, array in enumerate(pictures):
            tile = Image.fromarray(np.uint8(np.rint(array * 255))).resize((256, 256), Image.Resampling.NEAREST)
            picture.paste(tile, (j * width, i * 276 + 16))
    picture.save(folder / "sheet.png")
    sys.exit(1 if wrong else 0)


main()
