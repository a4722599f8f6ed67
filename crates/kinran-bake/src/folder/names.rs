//! What a file's name says about the map in it.

use std::fmt;
use std::str::FromStr;

use kinran_image::IMAGE_EXTENSIONS;
use schemars::JsonSchema;
use serde::Serialize;

/// Which way green points in a normal map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Green {
    /// +Y: glTF, OpenGL, Blender, Unity.
    Up,
    /// −Y: DirectX, Unreal.
    Down,
}

/// What a map holds. The kebab-case name, as [`Display`](fmt::Display) writes it, is what `--map ROLE=FILE`
/// takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Tangent-space normals.
    Normal,
    /// Perceptual roughness.
    Roughness,
    /// One minus roughness.
    Gloss,
    /// Gloss along the direction.
    GlossU,
    /// Gloss across the direction.
    GlossV,
    /// Direction of the anisotropy: red and green a vector, or grey an angle.
    Direction,
    /// Direction as a grey angle, a full turn from 0 to 1 (Substance).
    DirectionAngle,
    /// Anisotropy level of the Adobe Standard Material (Substance).
    AnisotropyLevel,
    /// `KHR_materials_anisotropy`: red and green direction, blue strength.
    Anisotropy,
    /// An aniso map as Kinran writes it.
    Aniso,
    /// Base colour.
    Color,
    /// Ambient occlusion.
    Occlusion,
    /// Metalness.
    Metallic,
    /// Occlusion, roughness, metallic in red, green, blue.
    Orm,
    /// Roughness, metallic, occlusion in red, green, blue.
    Rma,
    /// Metallic, roughness, occlusion in red, green, blue.
    Mra,
    /// Occlusion in red, roughness in green.
    OcclusionRoughness,
    /// Roughness in green, metallic in blue (glTF).
    MetallicRoughness,
    /// Metallic in red, gloss in alpha (Unity).
    MetallicSmoothness,
    /// Specular colour in red, green and blue, gloss in alpha (Unity, glTF's specular-glossiness).
    SpecularSmoothness,
    /// Metallic in red, occlusion in green, gloss in alpha (Unity HDRP).
    MaskMap,
    /// Height, displacement or bump.
    Height,
    /// Emitted light.
    Emissive,
    /// Specular level or colour.
    Specular,
    /// Coverage.
    Opacity,
    /// What a baker or a scan leaves beside the maps of a material: curvature, thickness, normals of the object.
    Other,
}

/// Every role, its name in flags and tables, and which channels hold what.
const ROLES: [(Role, &str, &str); 26] = [
    (Role::Normal, "normal", "RG normal"),
    (Role::Roughness, "roughness", "R roughness"),
    (Role::Gloss, "gloss", "R gloss"),
    (Role::GlossU, "gloss-u", "R gloss along"),
    (Role::GlossV, "gloss-v", "R gloss across"),
    (Role::Direction, "direction", "RG vector, or grey angle"),
    (Role::DirectionAngle, "direction-angle", "R angle"),
    (Role::AnisotropyLevel, "anisotropy-level", "R level"),
    (Role::Anisotropy, "anisotropy", "RG direction, B strength"),
    (Role::Aniso, "aniso", "RGB aniso texel"),
    (Role::Color, "color", "RGB color"),
    (Role::Occlusion, "occlusion", "R occlusion"),
    (Role::Metallic, "metallic", "R metallic"),
    (Role::Orm, "orm", "R occlusion, G roughness, B metallic"),
    (Role::Rma, "rma", "R roughness, G metallic, B occlusion"),
    (Role::Mra, "mra", "R metallic, G roughness, B occlusion"),
    (Role::OcclusionRoughness, "occlusion-roughness", "R occlusion, G roughness"),
    (Role::MetallicRoughness, "metallic-roughness", "G roughness, B metallic"),
    (Role::MetallicSmoothness, "metallic-smoothness", "R metallic, A gloss"),
    (Role::SpecularSmoothness, "specular-smoothness", "A gloss"),
    (Role::MaskMap, "mask-map", "R metallic, G occlusion, A gloss"),
    (Role::Height, "height", "-"),
    (Role::Emissive, "emissive", "-"),
    (Role::Specular, "specular", "-"),
    (Role::Opacity, "opacity", "-"),
    (Role::Other, "other", "-"),
];

impl Role {
    fn row(self) -> (Role, &'static str, &'static str) {
        ROLES[self as usize]
    }

    /// Every role.
    pub fn all() -> impl Iterator<Item = Role> {
        ROLES.iter().map(|row| row.0)
    }

    /// Name in flags and tables.
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// Which channels hold what, for people; "-" where nothing of the map is used.
    pub fn channels(self) -> &'static str {
        self.row().2
    }

    /// Whether the baker does something with such a map.
    pub fn is_used(self) -> bool {
        self < Role::Height
    }

    /// Whether one file holds several quantities.
    pub fn is_packed(self) -> bool {
        (Role::Orm..=Role::MaskMap).contains(&self)
    }

    /// The channel of a packed map that holds `quantity`: occlusion, metallic, roughness or gloss.
    pub(super) fn packed_channel(self, quantity: Role) -> Option<usize> {
        use Role::{Gloss, Metallic, Occlusion, Roughness};
        let channels: [Option<Role>; 4] = match self {
            Role::Orm => [Some(Occlusion), Some(Roughness), Some(Metallic), None],
            Role::Rma => [Some(Roughness), Some(Metallic), Some(Occlusion), None],
            Role::Mra => [Some(Metallic), Some(Roughness), Some(Occlusion), None],
            Role::OcclusionRoughness => [Some(Occlusion), Some(Roughness), None, None],
            Role::MetallicRoughness => [None, Some(Roughness), Some(Metallic), None],
            Role::MetallicSmoothness => [Some(Metallic), None, None, Some(Gloss)],
            Role::SpecularSmoothness => [None, None, None, Some(Gloss)],
            Role::MaskMap => [Some(Metallic), Some(Occlusion), None, Some(Gloss)],
            _ => [None; 4],
        };
        channels.iter().position(|q| *q == Some(quantity))
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Role {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        ROLES.iter().find(|r| r.1 == s).map(|r| r.0).ok_or_else(|| {
            let names: Vec<&str> = ROLES.iter().map(|r| r.1).collect();
            format!("\"{s}\" is no kind of map; there are {}", names.join(", "))
        })
    }
}

/// A file name taken apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Name {
    /// What is left of the role: the material's name. The whole name where no role was found; empty for a
    /// file called after its role alone.
    pub(super) stem: String,
    /// The map.
    pub(super) role: Option<Role>,
    /// Words behind the role that are neither a role's nor say how the file was saved; the name is read so only where
    /// other files speak for it.
    pub(super) tail: String,
    /// A side such as 2K stands between the role and the tail.
    pub(super) is_sized: bool,
    /// Which way green points, where the name tells.
    pub(super) green: Option<Green>,
    /// The role is one or two letters, which mean it only in company.
    pub(super) letter: bool,
    /// Begins with Unreal's `T_`.
    pub(super) unreal: bool,
    /// `_spec` may mean gloss as well as the specular colour, `_rough_ao` may hold either first.
    pub(super) unclear: bool,
    /// Says that there are 16 bits.
    pub(super) deep: bool,
    /// The role is several words, the last of which is one by itself.
    pub(super) joined: bool,
    /// Ends in 1024, a side and the number of a UDIM tile.
    pub(super) ends_in_1024: bool,
}

/// A run of letters and digits, at separators and inner capitals.
struct Piece<'a> {
    text: &'a str,
    start: usize,
    /// Begins within a word, at a capital.
    camel: bool,
}

fn digits(word: &str) -> bool {
    !word.is_empty() && word.bytes().all(|b| b.is_ascii_digit())
}

fn is_number(word: &str) -> bool {
    digits(word) && word.len() <= 5
}

/// Words that say how many texels a map has.
fn is_size(word: &str) -> bool {
    let side = |s: &str| is_number(s) && s.parse::<u32>().is_ok_and(|n| n >= 128 && n.is_power_of_two());
    word.strip_suffix('k').is_some_and(is_number)
        || side(word)
        || word.split_once('x').is_some_and(|(w, h)| side(w) && side(h))
}

/// Words that say how a file was saved, not what it holds.
fn is_noise(word: &str) -> bool {
    IMAGE_EXTENSIONS.contains(&word)
        || matches!(
            word,
            "map" | "tex" | "texture" | "srgb" | "linear" | "raw" | "8bit" | "16bit" | "8b" | "16b"
        )
        || word.strip_prefix("lod").is_some_and(is_number)
        || is_size(word)
}

/// Words that behind a role say which copy of a file it is, or in which colour space (Painter's `$colorSpace`).
fn is_noise_behind(words: &[String], at: usize, in_brackets: bool) -> bool {
    let word = words[at].as_str();
    let before = if at > 0 { words[at - 1].as_str() } else { "" };
    let after = words.get(at + 1).map_or("", String::as_str);
    const PAIRS: [(&str, &str); 4] = [("non", "color"), ("non", "colour"), ("rec", "709"), ("ace", "scg")];
    // u1_v1 is a tile (Mudbox).
    let tile = |word: &str, letter| word.strip_prefix(letter).is_some_and(digits);
    matches!(word, "final" | "copy" | "utility" | "acescg" | "aces" | "noncolor" | "rec709" | "output")
        || PAIRS.iter().any(|pair| *pair == (before, word) || *pair == (word, after))
        || (tile(word, 'v') && !tile(before, 'u'))
        || word.strip_prefix("var").is_some_and(digits)
        || (digits(word) && (in_brackets || before == "copy"))
}

/// Whether a word is the number of a UDIM tile.
pub(super) fn is_udim(word: &str) -> bool {
    word.len() == 4 && digits(word) && ("1001"..="1999").contains(&word)
}

/// Words that Poliigon puts behind the role and the size, of all files of a set or of most.
pub(super) const WORKFLOWS: [&str; 3] = ["metalness", "metallic", "specular"];

/// The role of a word in lower case without separators, also with `map` or `16` behind it.
fn role_of(word: &str) -> Option<(Role, Option<Green>)> {
    let shorter = || word.strip_suffix("16").or(word.strip_suffix("map")).and_then(role_of_word);
    role_of_word(word).or_else(shorter)
}

/// What normal maps are called.
const NORMAL_WORDS: [&str; 12] = [
    "normals",
    "normalmap",
    "normalbump",
    "normal",
    "norm",
    "nor",
    "nrml",
    "nrm",
    "nml",
    "nmap",
    "ddn",
    "ddna",
];

/// What stands behind it where green points up, and down.
const UP_WORDS: [&str; 3] = ["gl", "ogl", "opengl"];
const DOWN_WORDS: [&str; 3] = ["dx", "directx", "d3d"];

/// What other maps are called, in lower case without separators.
const WORDS: [(Role, &[&str]); 25] = [
    (Role::Roughness, &["roughness", "rough", "rgh", "specularroughness"]),
    (Role::Gloss, &["gloss", "glossiness", "glossy", "smoothness"]),
    (Role::GlossU, &["glossu", "glossinessu"]),
    (Role::GlossV, &["glossv", "glossinessv"]),
    (
        Role::Direction,
        &["direction", "flow", "flowmap", "anisodirection", "anisotropydirection", "anisotropicdirection"],
    ),
    (Role::DirectionAngle, &["anisotropyangle", "anisoangle"]),
    (Role::AnisotropyLevel, &["anisotropylevel", "anisolevel"]),
    (Role::Anisotropy, &["anisotropy", "anisotropic", "specularanisotropy"]),
    (Role::Aniso, &["aniso"]),
    (
        Role::Color,
        &[
            "albedo",
            "basecolor",
            "basecolour",
            "diffuse",
            "diff",
            "diffusecolor",
            "color",
            "colour",
            "col",
            "basemap",
            "maintex",
            "albedotransparency",
            "diffusetransparency",
        ],
    ),
    (Role::Occlusion, &["ao", "occ", "occlusion", "ambientocclusion", "mixedao"]),
    (Role::Metallic, &["metallic", "metalness", "metal"]),
    (
        Role::Orm,
        &[
            "orm",
            "arm",
            "aorm",
            "occlusionroughnessmetallic",
            "occlusionroughnessmetalness",
            "occlusionroughnessmetal",
        ],
    ),
    (Role::Rma, &["rma", "rmao", "rmo"]),
    (Role::Mra, &["mra", "mrao", "mro"]),
    (
        Role::OcclusionRoughness,
        &["ord", "ordp", "orh", "occlusionroughness", "aorough", "aoroughness", "roughao", "roughnessao"],
    ),
    (Role::MetallicRoughness, &["metallicroughness"]),
    (Role::MetallicSmoothness, &["metallicsmoothness", "metallicgloss", "metallicglossiness"]),
    (Role::SpecularSmoothness, &["specularsmoothness", "specularglossiness", "specgloss"]),
    (Role::MaskMap, &["maskmap"]),
    (Role::Height, &["height", "disp", "displacement", "bump"]),
    (
        Role::Emissive,
        &[
            "emissive",
            "emission",
            "emit",
            "emissivecolor",
            "emissivecolour",
            "emissioncolor",
            "emissioncolour",
        ],
    ),
    (
        Role::Specular,
        &[
            "specular",
            "specularlevel",
            "specularcolor",
            "specularcolour",
            "spec",
            "refl",
            "reflection",
            "reflectivity",
        ],
    ),
    (Role::Opacity, &["opacity", "mask", "alpha", "transparency"]),
    (
        Role::Other,
        &[
            "cavity",
            "curvature",
            "thickness",
            "position",
            "id",
            "translucency",
            "sss",
            "ior",
            "specularior",
            "specularrotation",
            "anisotropicrotation",
            "anisotropyrotation",
            "diffuseroughness",
            "worldspacenormal",
            "worldspacenormals",
            "worldnormal",
            "objectspacenormal",
            "objectspacenormals",
            "objectnormal",
            "normalobject",
            "normalobj",
            "normalsobject",
            "normalsobj",
            "bentnormal",
            "bentnormals",
            "nra",
            "nrao",
        ],
    ),
];

/// Layers beside the base, whose maps are none of the base's: Standard Surface, OpenPBR, Substance, glTF.
const LAYERS: [&str; 9] =
    ["coat", "clearcoat", "sheen", "fuzz", "subsurface", "transmission", "iridescence", "thinfilm", "detail"];

/// What stands behind a layer besides names of normal, roughness, gloss, anisotropy and opacity maps.
const OF_LAYERS: [&str; 11] = [
    "color",
    "colour",
    "tint",
    "weight",
    "factor",
    "intensity",
    "level",
    "ior",
    "rotation",
    "radius",
    "thickness",
];

/// Whether a word names a layer, or a map of one.
fn is_of_layer(word: &str) -> bool {
    use Role::{Anisotropy, AnisotropyLevel, DirectionAngle, Gloss, Normal, Opacity, Roughness};
    let maps = [Normal, Roughness, Gloss, Anisotropy, AnisotropyLevel, DirectionAngle, Opacity];
    let is_map = |what: &str| {
        what.is_empty()
            || OF_LAYERS.contains(&what)
            || role_of_word(what).is_some_and(|(role, _)| maps.contains(&role))
    };
    LAYERS.iter().any(|layer| word.strip_prefix(layer).is_some_and(is_map))
}

fn role_of_word(word: &str) -> Option<(Role, Option<Green>)> {
    for base in NORMAL_WORDS {
        match word.strip_prefix(base) {
            Some("") => return Some((Role::Normal, None)),
            Some(behind) if UP_WORDS.contains(&behind) => return Some((Role::Normal, Some(Green::Up))),
            Some(behind) if DOWN_WORDS.contains(&behind) => return Some((Role::Normal, Some(Green::Down))),
            _ => {}
        }
    }
    let named = WORDS.iter().find(|(_, words)| words.contains(&word)).map(|(role, _)| (*role, None));
    named.or_else(|| is_of_layer(word).then_some((Role::Other, None)))
}

/// The role of Unreal's one and two letters; `a` and `b` are a colour only where the name begins as Unreal's do.
fn role_of_letter(word: &str, unreal: bool) -> Option<Role> {
    Some(match word {
        "n" | "nm" => Role::Normal,
        "r" => Role::Roughness,
        "d" | "bc" => Role::Color,
        "a" | "b" if unreal => Role::Color,
        "m" => Role::Metallic,
        "o" => Role::Occlusion,
        "h" => Role::Height,
        "e" => Role::Emissive,
        "s" => Role::Specular,
        _ => return None,
    })
}

fn pieces(name: &str) -> Vec<Piece<'_>> {
    let chars: Vec<(usize, char)> = name.char_indices().collect();
    let mut out: Vec<Piece> = Vec::new();
    let mut open: Option<(usize, usize, bool)> = None;
    let mut close = |open: &mut Option<(usize, usize, bool)>, end: usize| {
        if let Some((_, start, camel)) = open.take() {
            out.push(Piece { text: &name[start..end], start, camel });
        }
    };
    for (i, &(at, c)) in chars.iter().enumerate() {
        if !c.is_alphanumeric() {
            close(&mut open, at);
            continue;
        }
        match open {
            None => open = Some((i, at, false)),
            Some((first, ..)) => {
                let before = chars[i - 1].1;
                let lower_follows = chars.get(i + 1).is_some_and(|(_, c)| c.is_lowercase());
                // aB, ABc and 1Bc are boundaries; 2K and the s of sRGB are not.
                let capital = c.is_uppercase()
                    && (before.is_lowercase() && i - first > 1 || !before.is_lowercase() && lower_follows);
                if capital {
                    close(&mut open, at);
                    open = Some((i, at, true));
                }
            }
        }
    }
    close(&mut open, name.len());
    out
}

/// Unknown words behind a role that a name may have; chosen by eye: `from Mesh`, `red oak`.
const MOST_UNKNOWN: usize = 3;

/// What a file name without its extension may mean, the likeliest first: the last role in it, and before that those with a
/// `tail`. There is always one, without a role where nothing is known.
pub(super) fn readings(name: &str) -> Vec<Name> {
    if let Some(packed) = packed_by_parts(name) {
        return vec![packed];
    }
    let all = pieces(name);
    let unreal = name.starts_with("T_") || name.starts_with("t_");
    let lower: Vec<String> = all.iter().map(|p| p.text.to_lowercase()).collect();
    let in_brackets = |at: usize| name[..all[at].start].ends_with('(');
    let nothing = Name {
        stem: name.to_owned(),
        role: None,
        tail: String::new(),
        is_sized: false,
        green: None,
        letter: false,
        unreal,
        unclear: false,
        deep: false,
        joined: false,
        ends_in_1024: false,
    };

    let mut found: Vec<Name> = Vec::new();
    let (mut end, mut unknown, mut ends_in_1024) = (all.len(), 0, false);
    // Pieces of the tail, the last first.
    let mut tail: Vec<usize> = Vec::new();
    let mut is_sized = false;
    while end > 0 && unknown <= MOST_UNKNOWN {
        let word = &lower[end - 1];
        if is_noise_behind(&lower, end - 1, in_brackets(end - 1)) {
            end -= 1;
            continue;
        }
        let plain = tail.iter().all(|&at| digits(&lower[at]));
        let Some((begin, role, green, letter)) = role_at(&all, &lower, end, unreal && plain, plain) else {
            if is_noise(word) {
                ends_in_1024 |= word == "1024" && tail.is_empty();
                is_sized |= is_size(word) && !tail.is_empty();
            } else {
                tail.push(end - 1);
                is_sized = false;
                unknown += 1;
            }
            end -= 1;
            continue;
        };
        let behind: Vec<&str> = tail.iter().rev().map(|&at| all[at].text).collect();
        let reading = |begin: usize, role: Role, green: Option<Green>, letter: bool| Name {
            stem: stem_before(name, &all, &lower, begin, unreal),
            role: Some(role),
            tail: behind.join("_"),
            is_sized,
            green,
            letter,
            unclear: lower[begin] == "spec"
                || (role == Role::OcclusionRoughness && lower[begin].starts_with("rough")),
            deep: lower[begin..end].iter().any(|word| word.ends_with("16")),
            ends_in_1024,
            ..nothing.clone()
        };
        let mut whole = reading(begin, role, green, letter);
        // "x_rough_ao" holds both, or is the occlusion of a material called "x_rough"; so with "x_specular_roughness" and
        // "x_coat_roughness".
        let last = (begin + 1 < end && !all[end - 1].camel).then(|| role_of(&lower[end - 1])).flatten();
        let may_be_two = role.is_packed() || matches!(role, Role::Roughness | Role::Other);
        if let Some((last, green)) = last.filter(|_| may_be_two) {
            whole.joined = true;
            found.push(whole);
            found.push(reading(end - 1, last, green, false));
        } else {
            found.push(whole);
        }
        tail.extend((begin..end).rev());
        is_sized = false;
        end = begin;
    }
    // A role of which nothing else is known comes first only if nothing stands behind it.
    if found.first().is_none_or(|first| !first.tail.is_empty()) {
        found.insert(0, nothing);
    }
    found
}

/// The role whose words end at piece `end`: where they begin, what it is, and whether it is a letter, which is asked for by
/// `letters`.
fn role_at(
    all: &[Piece<'_>],
    lower: &[String],
    end: usize,
    unreal: bool,
    letters: bool,
) -> Option<(usize, Role, Option<Green>, bool)> {
    // The longest name has four words: Normal Map Open GL. The longest match wins.
    let found = (end.saturating_sub(4)..end).find_map(|begin| {
        let (role, green) = role_of(&lower[begin..end].concat())?;
        let word = &lower[begin];
        let shouted = all[begin].text.chars().all(char::is_uppercase);
        let camel_unsafe = word.len() <= 3 && !shouted || matches!(word.as_str(), "metal" | "mask");
        let lonely = begin + 1 == end;
        if all[begin].camel && lonely && camel_unsafe {
            return None;
        }
        Some((begin, role, green, false))
    });
    let letter = || {
        let begin = end - 1;
        let role = role_of_letter(&lower[begin], unreal)?;
        (letters && !all[begin].camel && begin > 0).then_some((begin, role, None, true))
    };
    found.or_else(letter)
}

/// The material's name before a role that begins at piece `begin`.
fn stem_before(name: &str, all: &[Piece<'_>], lower: &[String], begin: usize, unreal: bool) -> String {
    let mut last = begin;
    while last > 0 && is_noise(&lower[last - 1]) {
        last -= 1;
    }
    let first = usize::from(unreal && last > 0);
    if last <= first {
        return String::new();
    }
    let piece = &all[last - 1];
    let end = piece.start + piece.text.len();
    // "Wood (1)": the bracket belongs to what is in it.
    let stem = &name[all[first].start..end];
    let is_open = stem.rfind('(').is_some_and(|open| !stem[open..].contains(')'));
    let end = if is_open && name[end..].starts_with(')') { end + 1 } else { end };
    name[all[first].start..end].to_owned()
}

/// Blender's glTF exporter joins the names of what it packs: `wood_metallic-wood_roughness`, in glTF's channels.
fn packed_by_parts(name: &str) -> Option<Name> {
    if !name.contains('-') {
        return None;
    }
    let parts: Vec<Name> = name.split('-').map(|part| readings(part).swap_remove(0)).collect();
    let [first, _, ..] = parts.as_slice() else { return None };
    let same = |part: &Name| part.stem.eq_ignore_ascii_case(&first.stem) && !part.letter;
    if first.stem.is_empty() || !parts.iter().all(same) {
        return None;
    }
    let mut roles: Vec<Role> = parts.iter().map(|part| part.role).collect::<Option<_>>()?;
    roles.sort();
    let role = match roles.as_slice() {
        [Role::Roughness, Role::Metallic] => Role::MetallicRoughness,
        [Role::Roughness, Role::Occlusion] => Role::OcclusionRoughness,
        [Role::Roughness, Role::Occlusion, Role::Metallic] => Role::Orm,
        _ => return None,
    };
    Some(Name { role: Some(role), ..first.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_stand_in_their_table_in_order() {
        for (i, row) in ROLES.iter().enumerate() {
            assert_eq!(row.0 as usize, i, "{row:?}");
            assert_eq!(row.1.parse(), Ok(row.0), "{row:?}");
        }
    }

    #[test]
    fn stem_role_and_green_of_each_exporters_names() {
        use Green::{Down, Up};
        use Role::*;
        let cases: &[(&str, &str, Role, Option<Green>)] = &[
            // ambientCG
            ("Metal009_2K-PNG_NormalGL", "Metal009", Normal, Some(Up)),
            ("Metal009_2K-PNG_NormalDX", "Metal009", Normal, Some(Down)),
            ("Metal009_2K-JPG_Color", "Metal009", Color, None),
            ("Metal009_2K-JPG_Metalness", "Metal009", Metallic, None),
            ("Bark014_1K_AmbientOcclusion", "Bark014", Occlusion, None),
            ("Bark014_1K_Displacement", "Bark014", Height, None),
            ("PaintedMetal004_4K-PNG_Roughness", "PaintedMetal004", Roughness, None),
            // Poly Haven
            ("rock_06_nor_gl_1k", "rock_06", Normal, Some(Up)),
            ("brick_nor_dx_2k", "brick", Normal, Some(Down)),
            ("rusty_metal_02_diff_4k", "rusty_metal_02", Color, None),
            ("rusty_metal_02_metal_4k", "rusty_metal_02", Metallic, None),
            ("rusty_metal_02_arm_4k", "rusty_metal_02", Orm, None),
            ("rock_06_rough_1k", "rock_06", Roughness, None),
            ("rock_06_ao_1k", "rock_06", Occlusion, None),
            ("rock_06_disp_1k", "rock_06", Height, None),
            ("rock_06_spec_1k", "rock_06", Specular, None),
            // Substance
            ("Lamp_Shade_Normal_OpenGL", "Lamp_Shade", Normal, Some(Up)),
            ("Lamp_Shade_Normal_DirectX", "Lamp_Shade", Normal, Some(Down)),
            ("DefaultMaterial_Anisotropy_angle", "DefaultMaterial", DirectionAngle, None),
            ("DefaultMaterial_Anisotropy_level", "DefaultMaterial", AnisotropyLevel, None),
            ("DefaultMaterial_anisotropyangle", "DefaultMaterial", DirectionAngle, None),
            ("DefaultMaterial_anisotropylevel", "DefaultMaterial", AnisotropyLevel, None),
            ("DefaultMaterial_Base_color", "DefaultMaterial", Color, None),
            ("DefaultMaterial_Mixed_AO", "DefaultMaterial", Occlusion, None),
            ("DefaultMaterial_Glossiness", "DefaultMaterial", Gloss, None),
            ("DefaultMaterial_Specular_level", "DefaultMaterial", Specular, None),
            ("foo_OcclusionRoughnessMetallic", "foo", Orm, None),
            ("foo_MetallicSmoothness", "foo", MetallicSmoothness, None),
            ("foo_MaskMap", "foo", MaskMap, None),
            // glTF
            ("wood_metallicRoughness", "wood", MetallicRoughness, None),
            ("wood_occlusionRoughnessMetallic", "wood", Orm, None),
            ("AnisotropyBarnLamp_occlusionroughnessmetal", "AnisotropyBarnLamp", Orm, None),
            ("AnisotropyBarnLamp_anisotropy", "AnisotropyBarnLamp", Anisotropy, None),
            ("wood_baseColor", "wood", Color, None),
            ("wood_emissive", "wood", Emissive, None),
            ("SheenChairFabricNormal", "SheenChairFabric", Normal, None),
            // 3dtextures.me
            ("Leather_008_ambientOcclusion", "Leather_008", Occlusion, None),
            ("Leather_008_basecolor", "Leather_008", Color, None),
            ("Ice_001_COLOR", "Ice_001", Color, None),
            ("Ice_001_NORM", "Ice_001", Normal, None),
            ("Ice_001_OCC", "Ice_001", Occlusion, None),
            // Megascans
            ("vbsjdjbs_4K_Normal_LOD0", "vbsjdjbs", Normal, None),
            ("vbsjdjbs_4K_Gloss", "vbsjdjbs", Gloss, None),
            ("vbsjdjbs_4K_Albedo", "vbsjdjbs", Color, None),
            // Unreal
            ("T_Brick_N", "Brick", Normal, None),
            ("T_Brick_BC", "Brick", Color, None),
            ("T_Brick_ORM", "Brick", Orm, None),
            // Kinran, the talk, Godot
            ("satin_GlossU", "satin", GlossU, None),
            ("satin_gloss_v", "satin", GlossV, None),
            ("satin_aniso_direction", "satin", Direction, None),
            ("satin_aniso", "satin", Aniso, None),
            ("aluminium_flow", "aluminium", Direction, None),
            // Standard Surface
            ("rock_specular_roughness", "rock", Roughness, None),
            ("rock_specularRoughness", "rock", Roughness, None),
            ("rock_specular_anisotropy", "rock", Anisotropy, None),
            ("rock_emission_color", "rock", Emissive, None),
            ("rock_coat_roughness", "rock", Other, None),
            ("rock_coat_normal", "rock", Other, None),
            ("rock_diffuse_roughness", "rock", Other, None),
            ("rock_subsurface_color", "rock", Other, None),
            ("specular_roughness", "", Roughness, None),
            // names alone, other separators, noise behind
            ("normal", "", Normal, None),
            ("Base Color", "", Color, None),
            ("_roughness", "", Roughness, None),
            ("1k_normal", "", Normal, None),
            ("my.fabric.roughness.2k", "my.fabric", Roughness, None),
            ("Wood-Floor-Normal-1024x1024", "Wood-Floor", Normal, None),
            ("WoodNormalMap", "Wood", Normal, None),
            ("WoodAO", "Wood", Occlusion, None),
            ("metallic_roughness", "", MetallicRoughness, None),
            ("Bent_Normal", "", Other, None),
            ("rock_clearcoat_roughness", "rock", Other, None),
            ("rockClearcoatNormal", "rock", Other, None),
            ("rock_sheen_roughness", "rock", Other, None),
            ("rock_Coat_anisotropy_level", "rock", Other, None),
            ("rock_thin_film_thickness", "rock", Other, None),
            ("coat_base_color", "coat", Color, None),
            ("coat_ao", "coat", Occlusion, None),
            ("Fabric_ARM", "Fabric", Orm, None),
            ("My Material (1) Normal", "My Material (1)", Normal, None),
            ("My Material (old)_Roughness", "My Material (old)", Roughness, None),
        ];
        for (name, stem, role, green) in cases {
            let got = readings(name).swap_remove(0);
            assert_eq!(
                (got.stem.as_str(), got.role, got.green),
                (*stem, Some(*role), *green),
                "{name}: {got:?}"
            );
        }
    }

    #[test]
    fn a_name_that_is_read_is_not_on_the_page() {
        let page = include_str!("../../../../docs/folders.md");
        let quoted =
            |cell: &str| -> Vec<String> { cell.split('`').skip(1).step_by(2).map(str::to_owned).collect() };
        for role in Role::all() {
            let start = format!("| `{}` |", role.name());
            let row = page.lines().find(|line| line.starts_with(&start));
            let row = row.unwrap_or_else(|| panic!("docs/folders.md has no row for {role}"));
            let cells: Vec<&str> = row.trim_matches('|').split(" | ").map(str::trim).collect();
            assert_eq!(cells[1], role.channels(), "channels of {role}");
            let mut wanted: Vec<&str> = match role {
                Role::Normal => NORMAL_WORDS.into(),
                _ => WORDS.iter().filter(|row| row.0 == role).flat_map(|row| row.1).copied().collect(),
            };
            let mut got = quoted(cells[2]);
            got.sort();
            wanted.sort_unstable();
            assert_eq!(got, wanted, "names of {role}");
        }
        let line = |start: &str| {
            let line = page.lines().find(|line| line.starts_with(start));
            quoted(line.unwrap_or_else(|| panic!("docs/folders.md has no line \"{start}\"")))
        };
        assert_eq!(line("- +Y"), UP_WORDS);
        assert_eq!(line("- −Y"), DOWN_WORDS);
        let layers = line("- Layers");
        let (before, behind) = layers.split_at(LAYERS.len());
        assert_eq!((before, behind), (&LAYERS.map(String::from)[..], &OF_LAYERS.map(String::from)[..]));
        for letters in line("- Letters").chunks(2) {
            let [letter, role] = letters else { panic!("{letters:?}: a letter without its role") };
            assert_eq!(role_of_letter(letter, true).map(Role::name), Some(role.as_str()), "{letter}");
        }
    }

    #[test]
    fn words_that_merely_end_like_a_map_are_not_one() {
        for name in [
            "Metal009",
            "SwordArm",
            "RustyMetal",
            "gold",
            "world_map",
            "flower",
            "Kanor",
            "",
            "___",
            "n",
            "1k",
        ] {
            let got = readings(name).swap_remove(0);
            assert_eq!(got.role, None, "{name}: {got:?}");
            assert_eq!(got.stem, name);
        }
    }
}
