use std::path::PathBuf;

use kinran_bake::manifest::Job;
use kinran_image::{Disk, Encoding, Files, Role};

use crate::bake::{FolderOptions, GltfOptions, folder, folder_plan, gltf, gltf_space, understand};
use crate::detail::{Carrier, SolveOptions, solve, solve_space};
use crate::options::TextureOptions;
use crate::skin::{Plot, TableOptions, tables};
use crate::{Error, Sink, Space, Task};

/// How an entry is baked.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum JobOptions {
    /// A folder of maps.
    Folder(FolderOptions),
    /// A glTF file.
    Model(GltfOptions),
    /// A target of detail maps.
    Detail(SolveOptions),
    /// Tables of skin.
    Skin(TableOptions),
}

/// An entry of a manifest and how it is baked: all that a worker needs to make it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Plan {
    /// The entry.
    pub job: Job,
    /// How it is baked.
    pub how: JobOptions,
}

impl Plan {
    /// An entry with its options; what they name is found from where the program was started.
    pub fn new(job: Job, how: JobOptions) -> Self {
        Plan { job, how }
    }

    /// Bakes the entry from `files` to `out`, where its files have no folder of their own; gives the warnings. `plot` draws
    /// tables of skin.
    ///
    /// # Errors
    /// Those of [`folder()`], [`gltf()`], [`solve()`] and [`tables()`].
    pub fn bake(
        &self,
        files: &dyn Files,
        plot: Option<Plot<'_>>,
        out: &dyn Sink,
        task: Task<'_>,
    ) -> Result<Vec<String>, Error> {
        let input = &self.job.input;
        Ok(match &self.how {
            JobOptions::Folder(how) => {
                let understood = understand(files, input, how)?;
                let reports = folder(files, input, &understood, how, out, task)?;
                reports.into_iter().flat_map(|report| report.warnings).collect()
            }
            JobOptions::Model(how) => gltf(files, input, how, out, task)?.warnings,
            JobOptions::Detail(how) => solve(files, input, how, out, task)?.warnings,
            JobOptions::Skin(how) => {
                tables(files, how, plot, out, task)?;
                Vec::new()
            }
        })
    }

    /// Bytes that its files will take, by the headers of its inputs alone.
    ///
    /// # Errors
    /// An input that cannot be read.
    pub(super) fn space(&self) -> Result<Space, Error> {
        let input = &self.job.input;
        match &self.how {
            JobOptions::Folder(how) => Ok(folder_plan(&Disk, input, &understand(&Disk, input, how)?, how)?.1),
            JobOptions::Model(how) => gltf_space(&Disk, input, how),
            JobOptions::Detail(how) => Ok(solve_space(&Disk, input, how)),
            JobOptions::Skin(how) => Ok(how.plan().1),
        }
    }

    /// Folders outside of a model's own whose files it may name.
    pub(super) fn allowed(&self) -> &[PathBuf] {
        match &self.how {
            JobOptions::Model(how) => &how.allow_outside,
            JobOptions::Detail(SolveOptions {
                carrier: Some(Carrier::Model { allow_outside, .. }), ..
            }) => allow_outside,
            _ => &[],
        }
    }

    /// How textures may be compressed.
    pub(super) fn encodings(&self) -> Vec<Encoding> {
        let of_bake = |how: &TextureOptions| {
            vec![
                how.encoding(Role::Normal, how.normal_format),
                how.encoding(Role::Aniso, how.aniso_format),
                how.encoding(Role::Color, how.color_format),
            ]
        };
        match &self.how {
            JobOptions::Folder(how) => of_bake(&how.textures),
            JobOptions::Model(how) => how.settled().map_or_else(|_| Vec::new(), |how| of_bake(&how.textures)),
            JobOptions::Detail(how) => how.encodings(&self.job.input),
            JobOptions::Skin(_) => Vec::new(),
        }
    }
}
