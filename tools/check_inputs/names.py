"""Names that shops, scanners, engines and painters give the maps of a set, as `bake --dry-run` understands them."""

import io

import numpy as np
from common import flat, png, relief, stored
from PIL import Image

NORMALS = stored(relief(32, 32))
RAMP = (np.arange(1024).reshape(32, 32) // 4).astype(np.uint8)
# What a map of a role looks like; a role that is not here is a grey.
PIXELS = {
    "color": flat(200, 120, 60),
    "normal": NORMALS,
    "occlusion": flat(250),
    "metallic": flat(255),
    "height": RAMP,
    "specular": flat(60),
    "gloss": flat(127),
    "orm": flat(250, 128, 0),
    "rma": flat(250, 128, 0),
    "mra": flat(250, 128, 0),
    "occlusion-roughness": flat(250, 128, 0),
    "metallic-roughness": flat(250, 128, 0),
    "metallic-smoothness": flat(250, 128, 0, 127),
    "mask-map": flat(250, 128, 0, 127),
}
DOWN = np.dstack([NORMALS[..., 0], 255 - NORMALS[..., 1], NORMALS[..., 2]])

# Material, role and what of its note matters, by file. "unused" says that no channel of it is taken, "unknown" that no
# role was found.
SETS = {
    "poliigon_metalness": {
        "BrushedSteel01_COL_2K_METALNESS.png": "BrushedSteel01 color",
        "BrushedSteel01_NRM_2K_METALNESS.png": "BrushedSteel01 normal",
        "BrushedSteel01_ROUGHNESS_2K_METALNESS.png": "BrushedSteel01 roughness",
        "BrushedSteel01_METALNESS_2K_METALNESS.png": "BrushedSteel01 metallic",
        "BrushedSteel01_DISP_2K_METALNESS.png": "BrushedSteel01 height unused",
    },
    "poliigon_specular": {
        "Oak01_COL_VAR1_3K.jpg": "Oak01 color",
        "Oak01_NRM_3K.jpg": "Oak01 normal",
        "Oak01_GLOSS_3K.jpg": "Oak01 gloss",
        "Oak01_REFL_3K.jpg": "Oak01 specular unused",
        "Oak01_DISP_3K.jpg": "Oak01 height unused",
        "Oak01_AO_3K.jpg": "Oak01 occlusion",
    },
    "poliigon_16_bits": {
        "Oak01_NRM_3K.jpg": "Oak01 normal unused",
        "Oak01_NRM16_3K.png": "Oak01 normal",
        "Oak01_GLOSS_3K.jpg": "Oak01 gloss",
        "Oak01_DISP16_3K.png": "Oak01 height unused",
    },
    "poliigon": {
        "Poliigon_WoodOak_2070_Normal.png": "Poliigon_WoodOak_2070 normal",
        "Poliigon_WoodOak_2070_Roughness.jpg": "Poliigon_WoodOak_2070 roughness",
        "Poliigon_WoodOak_2070_BaseColor.jpg": "Poliigon_WoodOak_2070 color",
        "Poliigon_WoodOak_2070_Metallic.jpg": "Poliigon_WoodOak_2070 metallic",
    },
    "textures_com": {
        "TexturesCom_Metal_Brushed_1K_normal.png": "TexturesCom_Metal_Brushed normal",
        "TexturesCom_Metal_Brushed_1K_roughness.png": "TexturesCom_Metal_Brushed roughness",
        "TexturesCom_Metal_Brushed_1K_albedo.png": "TexturesCom_Metal_Brushed color",
        "TexturesCom_Metal_Brushed_1K_height.png": "TexturesCom_Metal_Brushed height unused",
    },
    "freepbr_ogl": {
        "rusted-steel-normal-ogl.png": "rusted-steel normal +Y by name",
        "rusted-steel-roughness.png": "rusted-steel roughness",
        "rusted-steel-albedo.png": "rusted-steel color",
        "rusted-steel-metallic.png": "rusted-steel metallic",
        "rusted-steel-ao.png": "rusted-steel occlusion",
    },
    "freepbr_dx": {
        "rusted-steel_normal-dx.png": "rusted-steel normal -Y by name",
        "rusted-steel_roughness.png": "rusted-steel roughness",
    },
    "poly_haven": {
        "mud_nor_dx_2k.png": "mud normal unused",
        "mud_nor_gl_2k.png": "mud normal +Y by name",
        "mud_arm_2k.png": "mud orm",
    },
    "ambientcg": {
        "Bricks059_1K-JPG_NormalGL.jpg": "Bricks059 normal +Y by name",
        "Bricks059_1K-JPG_NormalDX.jpg": "Bricks059 normal unused",
        "Bricks059_1K-JPG_Roughness.jpg": "Bricks059 roughness",
        "Bricks059_1K-JPG_Color.jpg": "Bricks059 color",
        "Bricks059.png": "unknown",
    },
    "megascans": {
        "vbkm_2K_Normal_LOD0.jpg": "vbkm normal",
        "vbkm_2K_Gloss.jpg": "vbkm gloss unused",
        "vbkm_2K_Roughness.jpg": "vbkm roughness",
        "vbkm_2K_Albedo.jpg": "vbkm color",
        "vbkm_2K_Cavity.jpg": "vbkm other unused",
        "vbkm_2K_Specular.jpg": "vbkm specular unused",
    },
    "fab": {
        "T_rkswd_4K_B.png": "rkswd color",
        "T_rkswd_4K_N.png": "rkswd normal",
        "T_rkswd_4K_ORM.png": "rkswd orm",
    },
    "quixel": {
        "T_rock_sfDgc_2K_D.png": "rock_sfDgc color",
        "T_rock_sfDgc_2K_N.png": "rock_sfDgc normal",
        "T_rock_sfDgc_2K_ORDp.png": "rock_sfDgc occlusion-roughness",
    },
    "cgbookcase": {
        "Fabric01_MR_2K_Normal.png": "Fabric01_MR normal",
        "Fabric01_MR_2K_Roughness.png": "Fabric01_MR roughness",
        "Fabric01_MR_2K_BaseColor.png": "Fabric01_MR color",
    },
    "sharetextures": {
        "wood_1-2K_normal-2K.png": "wood_1 normal",
        "wood_1-2K_roughness-2K.png": "wood_1 roughness",
    },
    "substance_for_unreal": {
        "M_Gun_BaseColor.png": "M_Gun color",
        "M_Gun_Normal.png": "M_Gun normal",
        "M_Gun_OcclusionRoughnessMetallic.png": "M_Gun orm",
    },
    "painter_colour_spaces": {
        "Gun_Normal_Utility - Raw.png": "Gun normal",
        "Gun_Roughness_Utility - Raw.png": "Gun roughness",
        "Gun_BaseColor_Utility - sRGB - Texture.png": "Gun color",
    },
    "unreal": {"T_Gun_D.png": "Gun color", "T_Gun_N.png": "Gun normal", "T_Gun_ORM.png": "Gun orm"},
    "unity": {
        "Gun_AlbedoTransparency.png": "Gun color",
        "Gun_MetallicSmoothness.png": "Gun metallic-smoothness",
        "Gun_Normal.png": "Gun normal",
    },
    "unity_hdrp": {"Gun_BaseMap.png": "Gun color", "Gun_MaskMap.png": "Gun mask-map", "Gun_Normal.png": "Gun normal"},
    "marmoset": {"gun_normals.tga": "gun normal", "gun_gloss.tga": "gun gloss", "gun_albedo.tga": "gun color"},
    "no_separator": {"gunNRM.png": "gun normal", "gunROUGH.png": "gun roughness"},
    "udim_behind_a_dot": {
        "Head_Normal.1001.png": "Head_1001 normal",
        "Head_Normal.1002.png": "Head_1002 normal",
        "Head_Roughness.1001.png": "Head_1001 roughness",
        "Head_Roughness.1002.png": "Head_1002 roughness",
    },
    "udim_behind_a_line": {
        "Head_Normal_1001.png": "Head_1001 normal",
        "Head_Normal_1002.png": "Head_1002 normal",
        "Head_Roughness_1001.png": "Head_1001 roughness",
        "Head_Roughness_1002.png": "Head_1002 roughness",
    },
    "udim_in_the_middle": {
        "Head.1001_Normal.png": "Head.1001 normal",
        "Head.1002_Normal.png": "Head.1002 normal",
        "Head.1001_Roughness.png": "Head.1001 roughness",
        "Head.1002_Roughness.png": "Head.1002 roughness",
    },
    "blender_materials": {
        "Material.001_normal.png": "Material.001 normal",
        "Material.001_roughness.png": "Material.001 roughness",
        "Material.002_normal.png": "Material.002 normal",
        "Material.002_roughness.png": "Material.002 roughness",
    },
    "blanks": {"Cube Normal.png": "Cube normal", "Cube Roughness.png": "Cube roughness"},
    "downloaded_twice": {"steel_normal (1).png": "steel normal", "steel_roughness (1).png": "steel roughness"},
    "versions": {"Wood_Normal_v002.png": "Wood normal", "Wood_Roughness_v002.png": "Wood roughness"},
    "final": {"Wood_Normal_final.png": "Wood normal", "Wood_Roughness_final.png": "Wood roughness"},
    "copy": {"Wood_Normal copy.png": "Wood normal", "Wood_Roughness.png": "Wood roughness"},
    "short_words": {"Gun_NM.png": "Gun normal", "Gun_RGH.png": "Gun roughness"},
    "nml": {"Gun_Nml.png": "Gun normal", "Gun_Rough.png": "Gun roughness"},
    "nmap": {"cloth_NMap.png": "cloth normal", "cloth_RMap.png": "cloth roughness"},
    "called_metallic": {
        "Metallic_Base_Color.png": "Metallic color",
        "Metallic_Metallic.png": "Metallic metallic",
        "Metallic_Normal.png": "Metallic normal",
        "Metallic_Roughness.png": "Metallic roughness",
    },
    "called_rough": {
        "Rough_Wood_Rough.png": "Rough_Wood roughness",
        "Rough_Wood_Normal.png": "Rough_Wood normal",
        "Rough_Wood_Color.png": "Rough_Wood color",
    },
    "called_color": {
        "Color_Tiles_Normal.png": "Color_Tiles normal",
        "Color_Tiles_Roughness.png": "Color_Tiles roughness",
        "Color_Tiles_Color.png": "Color_Tiles color",
    },
    "called_gloss": {"HighGloss_Normal.png": "HighGloss normal", "HighGloss_Roughness.png": "HighGloss roughness"},
    "called_normal": {"NormalWall_Normal.png": "NormalWall normal", "NormalWall_Roughness.png": "NormalWall roughness"},
    "sketchfab": {
        "Scene_-_Root_normal.png": "Scene_-_Root normal",
        "Scene_-_Root_metallicRoughness.png": "Scene_-_Root metallic-roughness",
        "Scene_-_Root_baseColor.jpeg": "Scene_-_Root color",
    },
    "mrao": {"Rock_MRAO.png": "Rock mra", "Rock_Normal.png": "Rock normal"},
    "rmo": {"Rock_RMO.png": "Rock rma", "Rock_Normal.png": "Rock normal"},
    "orh": {"Rock_ORH.png": "Rock occlusion-roughness", "Rock_Normal.png": "Rock normal"},
    "aorm": {"Rock_AORM.png": "Rock orm", "Rock_Normal.png": "Rock normal"},
    "ao_r_m": {"Rock_AO_R_M.png": "Rock orm", "Rock_Normal.png": "Rock normal"},
    "nra": {"Rock_NRA.png": "Rock other unused", "Rock_BC.png": "Rock color"},
    "cryengine": {"brick_diff.png": "brick color", "brick_ddna.png": "brick normal", "brick_rough.png": "brick roughness"},
    "detail_normal": {
        "tin_Normal.png": "tin normal",
        "tin_DetailNormal.png": "tin other unused",
        "tin_Roughness.png": "tin roughness",
    },
    "two_sizes": {
        "Wood_1K_Normal.png": "Wood normal",
        "Wood_2K_Normal.png": "Wood normal unused",
        "Wood_1K_Roughness.png": "Wood roughness",
        "Wood_2K_Roughness.png": "Wood roughness unused",
    },
}
# A map of the set is missing or not understood: what warnings must say.
INCOMPLETE = {
    "variants": (
        {
            "Wood_Normal.png": "Wood normal",
            "Wood_Roughness.png": "Wood roughness",
            "Wood_Color_Red.png": "unknown",
            "Wood_Color_Blue.png": "unknown",
        },
        ["Wood_Color_Red.png is called after it", "--ignore Wood_Color_Blue.png"],
    ),
    "udim_of_two_sizes": (
        {
            "Head_Normal.1001.png": "Head_1001 normal",
            "Head_Roughness.1001.png": "Head_1001 roughness",
            "Head_Roughness.1002.png": "Head_1002 roughness",
        },
        ["Head_1002: no normal map"],
    ),
    "bump_is_no_normal": (
        {"cloth_bump.png": "cloth height unused", "cloth_rough.png": "cloth roughness"},
        ["cloth: no normal map"],
    ),
    "minecraft": (
        {"stone_n.png": "stone normal", "stone_s.png": "stone specular unused", "stone.png": "unknown"},
        ["stone: no roughness map", "not recognised: stone.png"],
    ),
}
# Words of no language or system that is known: the files are named.
UNKNOWN = {
    "arma": ["wall_nohq.png", "wall_as.png"],
    "german": ["Stahl_Normale.png", "Stahl_Rauheit.png"],
}


def picture(name, pixels):
    suffix = name.rsplit(".", 1)[1]
    if suffix == "png":
        return png(pixels)
    file = io.BytesIO()
    options = {"quality": 95, "subsampling": 0} if suffix.startswith("jp") else {}
    Image.fromarray(pixels).save(file, "TGA" if suffix == "tga" else "JPEG", **options)
    return file.getvalue()


def pixels_of(file, wanted):
    role = wanted.split()[1] if wanted != "unknown" else "color"
    down = "-Y" in wanted or any(word in file for word in ("_dx", "NormalDX"))
    # Gloss beside a roughness map is its inverse, as scanners write both.
    return DOWN if role == "normal" and down else PIXELS.get(role, flat(128))


def check_set(kind, name, wanted, words):
    folder = kind.inputs(name, {file: picture(file, pixels_of(file, what)) for file, what in wanted.items()})
    code, says = kind.run("bake", folder, "-o", folder.parent / "out", "--dry-run")
    if not kind.equal(folder, "exit code", 0, code, says.get("error", {}).get("message", "")):
        return
    rows = {row["file"]: row for row in says["files"] if row["file"] in wanted}
    kind.equal(folder, "files told of", sorted(wanted), sorted(rows))
    for file, what in wanted.items():
        row = rows.get(file)
        if not row:
            continue
        got = f"{row['material']} {row['role']}" if row["role"] else "unknown"
        if row["channels"] == "-" and got != "unknown":
            got += " unused"
        note = what.split(" ", 2)[2] if " by name" in what else ""
        if note and note in row["note"]:
            got += f" {note}"
        kind.equal(folder / file, "material and role", what, got, f"({row['note']})" if row["note"] else "")
    kind.says(folder, says["warnings"], *words)
    kind.equal(folder, "warned", bool(words), bool(says["warnings"]), says["warnings"])


def check(kind):
    for name, wanted in SETS.items():
        check_set(kind, name, wanted, [])
    for name, (wanted, words) in INCOMPLETE.items():
        check_set(kind, name, wanted, words)
    for name, files in UNKNOWN.items():
        folder = kind.inputs(name, {file: png(NORMALS) for file in files})
        kind.refused(folder, name, *files, "--map ROLE=FILE", command=("bake", "--dry-run"))
