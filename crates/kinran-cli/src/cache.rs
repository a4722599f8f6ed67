//! `kinran cache`: what is kept of finished work, and room again.

use std::path::PathBuf;

use kinran_bake::cache::{Cache, Listed};
use kinran_bake::manifest::size;
use schemars::JsonSchema;
use serde::Serialize;

use crate::bake::{LibraryArgs, cache_folder};
use crate::outputs::bytes_text;
use crate::table::list;
use crate::values::counted;
use crate::{Console, Error};

/// Shows what `kinran bake kinran.toml` keeps of finished work, and makes room
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran cache
  kinran cache --keep \"2 GiB\"
  kinran cache --clean

Nothing is lost by cleaning but time: what is needed again is baked again.")]
pub struct Args {
    /// The cache [default: KINRAN_CACHE, else the user's cache folder]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,

    /// Removes the entries that were not used for longest until the rest fit
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub keep: Option<u64>,

    /// Removes everything
    #[arg(long, conflicts_with = "keep")]
    pub clean: bool,
}

/// What a cache holds.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CacheReport {
    /// Its folder.
    pub folder: PathBuf,
    /// Bytes of all entries.
    pub bytes: u64,
    /// The entries, the one used last first.
    pub entries: Vec<Listed>,
    /// Entries that were removed now.
    pub removed: usize,
    /// Their bytes.
    pub removed_bytes: u64,
}

/// Runs the command.
///
/// # Errors
/// [`Error::Flag`] or [`Error::File`] where there is no cache, [`Error::Image`] where it cannot be read or changed.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let library = LibraryArgs { cache: args.cache.clone(), ..LibraryArgs::default() };
    let folder = cache_folder(&library, None).ok_or_else(|| {
        Error::flag_error(
            "--cache",
            "is missing, and there is no HOME to look for the cache in; name its folder",
        )
    })?;
    let cache = Cache::open(&folder)?;
    // Whoever looks for a cache in the wrong place should not find an empty one.
    if !Cache::is_cache(&folder) {
        if args.cache.is_some() {
            return Err(Error::file_error(&folder, "is no cache; name another folder"));
        }
        let report =
            CacheReport { folder: folder.clone(), bytes: 0, entries: vec![], removed: 0, removed_bytes: 0 };
        return console.result(&report, &format!("{}: nothing is kept yet\n", folder.display()));
    }
    let busy = console.progress().busy("looking through the cache");
    let limit = if args.clean { Some(0) } else { args.keep };
    let (removed, removed_bytes) = limit.map_or(Ok((0, 0)), |limit| cache.evict(limit))?;
    let entries = cache.list()?;
    drop(busy);
    let bytes = entries.iter().map(|entry| entry.bytes).sum();

    let mut text = list(&entries.iter().map(row).collect::<Vec<_>>());
    if removed > 0 {
        text += &format!("{} removed, {}\n", counted(removed, "entry", "entries"), bytes_text(removed_bytes));
    }
    text += &format!(
        "{}, {}, in {}\n",
        counted(entries.len(), "entry", "entries"),
        bytes_text(bytes),
        folder.display()
    );
    console.result(&CacheReport { folder, bytes, entries, removed, removed_bytes }, &text)
}

fn row(entry: &Listed) -> Vec<String> {
    let days = entry.idle_seconds / 86400;
    let idle = match days {
        0 => "used today".into(),
        1 => "used yesterday".into(),
        days => format!("used {days} days ago"),
    };
    vec![entry.key[..entry.key.len().min(12)].into(), bytes_text(entry.bytes), idle, entry.name.clone()]
}
