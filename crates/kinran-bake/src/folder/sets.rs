//! What the names of a folder's files say together: one word common to a whole set is no role, and words behind a role
//! name a variant or a tile.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::names::{Name, WORKFLOWS, is_udim};
use super::{Found, Role, add_note};

/// As many roles under one stem and one tail are a set, and as many make a word that could be a role none; chosen by eye.
const SET: usize = 2;
const SET_OF_A_ROLE: usize = 3;

/// Words behind a role that name a picture of a map, and no map.
const PICTURES_OF: [&str; 6] = ["preview", "thumb", "thumbnail", "icon", "render", "sphere"];

/// Whether one of a name's words is for a picture of a map.
fn names_picture(words: &str) -> bool {
    let mut words = words.split(|c: char| !c.is_alphanumeric());
    words.any(|word| PICTURES_OF.iter().any(|other| word.eq_ignore_ascii_case(other)))
}

/// Whether a file is a picture of a material by its name.
pub(super) fn is_picture_of(file: &Path) -> bool {
    file.file_stem().is_some_and(|stem| names_picture(&stem.to_string_lossy()))
}

/// Chooses among the readings of each file's name by those of the others.
pub(super) fn settle(found: &mut [Found]) {
    let sets = Sets::of(found);
    for (i, file) in found.iter_mut().enumerate() {
        let first = &file.readings[0];
        let chosen = match first.role {
            None => file.readings[1..].iter().find(|name| sets.accepts_unknown(name)),
            Some(_) if first.joined => {
                let is_named =
                    |name: &&Name| sets.has_whole(&name.stem, i) || sets.is_set_of_layers(name, first);
                file.readings.get(1).filter(is_named)
            }
            Some(_) => file.readings[1..].iter().find(|name| sets.accepts_role(name, &first.stem)),
        };
        if let Some(chosen) = chosen.cloned() {
            if is_tile(&chosen.tail) {
                add_note(&mut file.note, &format!("tile {}", chosen.tail));
            } else if chosen.is_workflow() {
                add_note(&mut file.note, &format!("{} is the set's workflow", chosen.tail));
            } else if first.role.is_some() && !chosen.tail.is_empty() {
                add_note(&mut file.note, &format!("{} stands in every name of the set", chosen.tail));
            }
            file.role = chosen.role;
            file.name = Name { stem: sets.stem(&chosen), ..chosen };
        } else if first.role.is_some() && first.ends_in_1024 && sets.has_tiles(&first.stem) {
            file.name.stem += "_1024";
            add_note(&mut file.note, "tile 1024");
        } else if first.role.is_none()
            && let Some(near) = file.readings.get(1).filter(|name| sets.has_whole(&name.stem, i))
            && let Some(role) = near.role.filter(|role| role.is_used())
        {
            let (tail, file_name) = (&near.tail, &file.file);
            file.note = format!(
                "{tail} behind the {role} is not understood; --map {role}={file_name} takes it for one"
            );
        } else if first.role == Some(Role::Other)
            && let Some(role) = file.readings.get(1).filter(|_| first.joined).and_then(|name| name.role)
            && role.is_used()
        {
            let file_name = &file.file;
            file.dropped =
                Some(format!("by its name no {role} of the base; --map {role}={file_name} takes it for one"));
        }
    }
}

/// The variants of a material: their names, and their roles together.
type Variants = (BTreeSet<String>, BTreeSet<Role>);

fn is_map(file: &Found) -> bool {
    file.dropped.is_none() && file.role.is_some_and(Role::is_used)
}

/// Variants by the material's name in lower case, where there are several.
fn variants(found: &[Found]) -> BTreeMap<String, Variants> {
    let mut variants: BTreeMap<String, Variants> = BTreeMap::new();
    for file in found.iter().filter(|file| is_map(file) && !is_tile(&file.name.tail)) {
        let ending = format!("_{}", file.name.tail);
        let Some(stem) = file.name.stem.strip_suffix(&ending).filter(|_| !file.name.tail.is_empty()) else {
            continue;
        };
        let (names, roles) = variants.entry(stem.to_lowercase()).or_default();
        if !names.iter().any(|name| name.eq_ignore_ascii_case(&file.name.stem)) {
            names.insert(file.name.stem.clone());
        }
        roles.extend(file.role);
    }
    variants.retain(|_, (names, _)| names.len() > 1);
    variants
}

/// Whether a material has several variants.
pub(super) fn has_variants(found: &[Found], stem: &str) -> bool {
    variants(found).contains_key(&stem.to_lowercase())
}

/// Gives maps without words behind their role to the variants of their material, where there are several and none has such
/// a map, or a flag names it: Poliigon's two workflows have one occlusion.
pub(super) fn share(found: &mut [Found]) {
    for (stem, (names, roles)) in variants(found) {
        let is_of_it = |file: &Found| is_map(file) && file.name.stem.to_lowercase() == stem;
        let is_twice = |file: &Found| !file.forced && file.role.is_some_and(|role| roles.contains(&role));
        if found.iter().any(|file| is_of_it(file) && is_twice(file)) {
            continue;
        }
        let list: Vec<String> = names.into_iter().collect();
        for file in found.iter_mut().filter(|file| is_of_it(file)) {
            add_note(&mut file.note, &format!("shared by {}", list.join(" and ")));
            file.shared_by.clone_from(&list);
        }
    }
}

/// Whether words behind a role are the number of a tile, as UDIM or as `u1_v1`.
fn is_tile(tail: &str) -> bool {
    let part = |part: &str, letter: char| {
        part.to_lowercase()
            .strip_prefix(letter)
            .is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    is_udim(tail) || tail.split_once('_').is_some_and(|(u, v)| part(u, 'u') && part(v, 'v'))
}

/// A material's name taken apart where it ends in the number of a tile: what is before it, and the tile.
pub(super) fn without_tile(stem: &str) -> Option<(&str, &str)> {
    let cuts = stem.rmatch_indices(|c: char| !c.is_alphanumeric()).take(2);
    cuts.map(|(at, cut)| (&stem[..at], &stem[at + cut.len()..])).find(|(_, tile)| is_tile(tile))
}

impl Name {
    /// Whether the tail is Poliigon's word for a workflow.
    fn is_workflow(&self) -> bool {
        self.is_sized && WORKFLOWS.iter().any(|word| self.tail.eq_ignore_ascii_case(word))
    }
}

/// All readings with a role.
struct Sets {
    /// Roles by stem and tail, in lower case.
    roles: BTreeMap<(String, String), BTreeSet<Role>>,
    /// Stems and roles of names that nothing stands behind, by file.
    whole: Vec<Option<(String, Role)>>,
    /// Tails by stem, those of each file; empty ones too.
    tails: BTreeMap<String, Vec<String>>,
    /// Roles of names such as `x_coat_roughness`, by the stem that they have where a material is called `x_coat`.
    of_layers: BTreeMap<String, BTreeSet<Role>>,
}

impl Sets {
    fn of(found: &[Found]) -> Self {
        let mut sets = Sets {
            roles: BTreeMap::new(),
            whole: Vec::new(),
            tails: BTreeMap::new(),
            of_layers: BTreeMap::new(),
        };
        for file in found {
            let first = &file.readings[0];
            sets.whole.push(first.role.map(|role| (first.stem.to_lowercase(), role)));
            if let Some(second) =
                file.readings.get(1).filter(|_| first.joined && first.role == Some(Role::Other))
            {
                sets.of_layers.entry(second.stem.to_lowercase()).or_default().extend(second.role);
            }
            let mut of_file: BTreeMap<String, String> = BTreeMap::new();
            for name in file.readings.iter().filter(|name| !(name.joined && file.readings.len() > 1)) {
                let Some(role) = name.role else { continue };
                let key = (name.stem.to_lowercase(), name.tail.to_lowercase());
                sets.roles.entry(key.clone()).or_default().insert(role);
                of_file.entry(key.0).or_insert(key.1);
            }
            for (stem, tail) in of_file {
                sets.tails.entry(stem).or_default().push(tail);
            }
        }
        sets
    }

    fn roles(&self, stem: &str, tail: &str) -> usize {
        self.roles.get(&(stem.to_lowercase(), tail.to_lowercase())).map_or(0, BTreeSet::len)
    }

    /// Whether another file than `but` has this stem with nothing behind its role.
    fn has_whole(&self, stem: &str, but: usize) -> bool {
        let stem = stem.to_lowercase();
        let is_it = |whole: &Option<(String, Role)>| whole.as_ref().is_some_and(|(other, _)| *other == stem);
        self.whole.iter().enumerate().any(|(i, whole)| i != but && is_it(whole))
    }

    /// Whether maps that may be a layer's are a material's: a set of them, beside nothing that they could be a layer of.
    fn is_set_of_layers(&self, name: &Name, first: &Name) -> bool {
        let base = first.stem.to_lowercase();
        let of_base = |(stem, role): &(String, Role)| *stem == base && *role != Role::Other;
        self.of_layers.get(&name.stem.to_lowercase()).is_some_and(|roles| roles.len() >= SET_OF_A_ROLE)
            && !self.whole.iter().flatten().any(of_base)
    }

    fn has_tiles(&self, stem: &str) -> bool {
        self.tails.get(&stem.to_lowercase()).is_some_and(|tails| tails.iter().any(|tail| is_tile(tail)))
    }

    /// Whether a name without a role at its end may be read with a tail.
    fn accepts_unknown(&self, name: &Name) -> bool {
        is_tile(&name.tail) || (self.roles(&name.stem, &name.tail) >= SET && !names_picture(&name.tail))
    }

    /// Whether what looks like a role at a name's end, where the material would be called `whole`, is a word of the set.
    fn accepts_role(&self, name: &Name, whole: &str) -> bool {
        let Some(tails) = self.tails.get(&name.stem.to_lowercase()).filter(|_| !name.stem.is_empty()) else {
            return false;
        };
        if name.is_workflow() {
            return self.roles_of_workflows(&name.stem) >= SET && !self.is_material(whole);
        }
        let is_common = tails.iter().all(|tail| *tail == tails[0]);
        is_common && !name.tail.is_empty() && self.roles(&name.stem, &name.tail) >= SET_OF_A_ROLE
    }

    /// How many roles there are of a stem, with a workflow behind them or nothing.
    fn roles_of_workflows(&self, stem: &str) -> usize {
        let tails = WORKFLOWS.iter().chain(&[""]);
        let roles = tails.filter_map(|&tail| self.roles.get(&(stem.to_lowercase(), tail.into())));
        roles.flatten().collect::<BTreeSet<_>>().len()
    }

    /// Whether a map whose role is no workflow is of a material of this name.
    fn is_material(&self, stem: &str) -> bool {
        let stem = stem.to_lowercase();
        let other = |role: Role| !matches!(role, Role::Metallic | Role::Specular);
        self.whole.iter().flatten().any(|(whole, role)| *whole == stem && other(*role))
    }

    /// The material's name: with the tail, unless all files have the same, or those that lack it lack a workflow.
    fn stem(&self, name: &Name) -> String {
        let tails = self.tails.get(&name.stem.to_lowercase());
        let same =
            |tail: &String| name.tail.eq_ignore_ascii_case(tail) || (tail.is_empty() && name.is_workflow());
        let common = tails.is_some_and(|tails| tails.iter().all(same));
        match (name.stem.as_str(), common && !is_tile(&name.tail)) {
            (stem, _) if name.tail.is_empty() => stem.to_owned(),
            ("", _) => name.tail.clone(),
            (stem, true) => stem.to_owned(),
            (stem, false) => format!("{stem}_{}", name.tail),
        }
    }
}
