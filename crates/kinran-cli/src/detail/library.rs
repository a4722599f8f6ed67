//! `kinran detail report`: a whole library of materials, in the manner of the talk's table.

use std::path::PathBuf;

use kinran::detail::{MapKind, StudyOptions, StudyReport, study};
use kinran::options::Format;
use kinran::{Disk, OutputFolder, Sink};

use super::{BLOCK_FORMATS, KINDS, page};
use crate::outputs::{check_folder, named_after, refuse_other_page, tell_place};
use crate::progress::Bars;
use crate::table::table;
use crate::values::{choice, exr_layer};
use crate::{Console, Error};

/// Paints a target over every material of a folder, solves each and reports the errors: report.json and index.html
///
/// FOLDER holds a folder for each material, with maps named as exporters name them. Every target is painted (grime by
/// occlusion and in cavities, rubbed edges, large-scale colour) over its material and a second one in patches, tiled at
/// twice the target's density, and solved three times: "own" against the tiles it was painted over, as in the talk;
/// "other" against the one tile of all other materials that is nearest in its colours, which has nothing to do with the
/// target; "faded" against the same at the largest opacity with which the result is no worse than the compressed target.
/// Numbers are those at half size, as in the talk, and as authored. Aniso maps are made of normals and roughness
/// where a material has none.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran detail report materials/ -o report/
  kinran detail report materials/ -o report/ \\
      --format bc1 --kind color --size 512")]
pub struct LibraryArgs {
    /// A folder of folders of maps
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,

    /// Where the report goes; made if it is not there [default: NAME.report beside the folder]
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// Formats of colour, packed data and aniso maps; may be given again [default: bc1 and bc7]. Normals are BC5, grey
    /// maps BC4
    #[arg(long, value_parser = choice(BLOCK_FORMATS))]
    pub format: Vec<Format>,

    /// Kinds of maps; may be given again [default: all that are there]
    #[arg(long, value_parser = choice(KINDS))]
    pub kind: Vec<MapKind>,

    /// Side of the targets in texels
    #[arg(long, value_name = "TEXELS", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(16..=8192))]
    pub size: u32,

    /// Which layer of an EXR file holds the map, by its path in FOLDER or its name; may be given again
    #[arg(long, value_name = "FILE=LAYER", value_parser = exr_layer)]
    pub exr_layer: Vec<(PathBuf, String)>,

    /// Centre the histograms of the tiles
    #[arg(long)]
    pub center: bool,

    /// No third solution, against the other tile faded until the result is no worse than the compressed target
    #[arg(long)]
    pub no_fade: bool,

    /// No pictures, numbers only
    #[arg(long)]
    pub no_pictures: bool,
}

impl LibraryArgs {
    /// Where the report goes.
    fn output(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| named_after(&self.folder, ".report"))
    }

    /// What the flags say.
    fn options(&self) -> StudyOptions {
        let mut how = StudyOptions::default();
        (how.formats, how.kinds, how.size) = (self.format.clone(), self.kind.clone(), self.size);
        (how.exr_layer, how.center) = (self.exr_layer.clone(), self.center);
        (how.fade, how.pictures) = (!self.no_fade, !self.no_pictures);
        how
    }
}

pub(super) fn run(args: &LibraryArgs, console: &Console) -> Result<(), Error> {
    let output = args.output();
    check_folder(&output)?;
    refuse_other_page(&output.join("index.html"))?;
    let (bars, out) = (Bars::new(console.progress()), OutputFolder::new(&output));
    let report = study(&Disk, &args.folder, &args.options(), &out, bars.task())?;
    out.put("index.html", page::page(&report, !args.no_pictures).as_bytes())?;
    out.finish()?;
    report.warnings.iter().for_each(|warning| console.warn(warning));
    let pages = ["index.html", "report.json"].map(|file| output.join(file).display().to_string());
    console.result(&report, &format!("{}wrote {}\n", text(&report), pages.join(", ")))?;
    tell_place(console, args.output.as_deref(), &output);
    Ok(())
}

fn text(report: &StudyReport) -> String {
    let mut rows = vec![
        [
            "map",
            "format",
            "tiles",
            "opacity",
            "level",
            "count",
            "target",
            "blended",
            "talk",
            "plain overlay",
            "uncompensated",
            "no worse",
            "magnified (talk)",
        ]
        .map(String::from)
        .to_vec(),
    ];
    for mean in &report.means {
        rows.push(page::cells(mean).to_vec());
    }
    table(&rows)
}
