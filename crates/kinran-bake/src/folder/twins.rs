//! Two files for one thing: if their texels say the same, either will do.

use std::path::{Path, PathBuf};

use kinran_image::{Disk, Files, Image};

use super::evidence::{apart, green_correlation, guess_by_correlation};
use super::load::Images;
use super::{FolderError, Green, GreenGuess, GreenSource, MaterialMaps, Role, file_name};

/// A file that should say what another one says, which is used in its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Twin {
    /// What the file that is used holds.
    pub role: Role,
    /// The file that is used.
    pub used: PathBuf,
    /// What the other holds.
    pub other_role: Role,
    /// The other.
    pub other: PathBuf,
    /// The other holds one minus it.
    pub is_opposite: bool,
}

impl MaterialMaps {
    /// Compares files that should say the same, texel by texel; gives what was found, a sentence each.
    ///
    /// # Errors
    /// [`FolderError::Ambiguous`] where they do not, [`FolderError::Image`] where one cannot be read.
    pub fn compare_twins(&self) -> Result<Vec<String>, FolderError> {
        let mut notes = Vec::new();
        self.settled(&Disk, &mut Images::new(), &mut notes)?;
        Ok(notes)
    }

    /// The maps after a look at the texels of twins, which are read into `images`.
    pub(super) fn settled(
        &self,
        files: &dyn Files,
        images: &mut Images,
        notes: &mut Vec<String>,
    ) -> Result<MaterialMaps, FolderError> {
        let mut maps = self.clone();
        for twin in &self.twins {
            let [used, other] = [&twin.used, &twin.other].map(|file| self.read_once(files, images, file));
            let (used, other) = (used?, other?);
            if twin.role == Role::Normal {
                self.settle_normals(twin, [&used, &other], &mut maps, notes)?;
                continue;
            }
            let channels = if twin.role == Role::Color { 3 } else { 1 };
            let distance = apart(&used, &other, channels, twin.is_opposite);
            let (question, differ) = match twin.is_opposite {
                true => ("there are both roughness and gloss", "one is not the other's opposite"),
                false => ("there are several files for one map", "their texels differ"),
            };
            match distance {
                Some(distance) if !distance.is_far(distance.plain) => {}
                Some(_) => return Err(self.cannot_tell(twin, &format!("{question}, and {differ}"))),
                None => {
                    return Err(self.cannot_tell(twin, &format!("{question}, {}", of_sizes(&used, &other))));
                }
            }
        }
        Ok(maps)
    }

    /// Of two normal maps takes one, and which way its green points from the texels of both: turned over in one, or the
    /// same.
    fn settle_normals(
        &self,
        twin: &Twin,
        [used, other]: [&Image; 2],
        maps: &mut MaterialMaps,
        notes: &mut Vec<String>,
    ) -> Result<(), FolderError> {
        let Some(normal) = &mut maps.normal else { return Ok(()) };
        let Some(distance) = apart(used, other, 0, false) else {
            let question = format!("there are several normal maps, {}", of_sizes(used, other));
            return Err(self.cannot_tell(twin, &question));
        };
        if distance.is_far(distance.plain.min(distance.turned)) {
            return Err(self.cannot_tell(twin, "there are several normal maps, and their texels differ"));
        }
        let turned = distance.turned < distance.plain;
        let correlation = green_correlation(used);
        let seen = match guess_by_correlation(correlation) {
            GreenGuess::Up => Green::Up,
            GreenGuess::Down => Green::Down,
            GreenGuess::Unsure => return Ok(()),
        };
        let by_flag = normal.green_source == GreenSource::Flag;
        if seen == normal.green || (by_flag && !turned) {
            return Ok(());
        }
        // The other one of a pair has what this was taken for.
        let (taken, green) = match turned {
            true => (&twin.other, normal.green),
            false => (&twin.used, seen),
        };
        let sign = |green| if green == Green::Up { "+Y" } else { "-Y" };
        notes.push(format!(
            "{} is {} by its slopes (correlation {correlation:.2}), whatever its name says; {} is taken as {}",
            file_name(&twin.used),
            sign(seen),
            file_name(taken),
            sign(green)
        ));
        for (_, file) in
            maps.files.iter_mut().filter(|(role, file)| *role == Role::Normal && *file == normal.file)
        {
            file.clone_from(taken);
        }
        normal.file.clone_from(taken);
        (normal.green, normal.green_source) = (green, GreenSource::Texels);
        Ok(())
    }

    fn cannot_tell(&self, twin: &Twin, question: &str) -> FolderError {
        let flag = |role: Role, file: &Path| format!("--map {role}={}", file_name(file));
        FolderError::Ambiguous {
            material: self.name.clone(),
            question: question.into(),
            files: [&twin.used, &twin.other].map(|file| file_name(file)).into(),
            fix: format!(
                "say {} or {}, or leave one out with --ignore FILE",
                flag(twin.role, &twin.used),
                flag(twin.other_role, &twin.other)
            ),
        }
    }
}

/// Part of a question about images that cannot be compared.
fn of_sizes(a: &Image, b: &Image) -> String {
    format!(
        "of {}x{} and {}x{} texels, and neither size is a multiple of the other",
        a.width, a.height, b.width, b.height
    )
}
