//! A diffusion profile from a file.

use std::path::Path;

use kinran_bake::skin_lut::Profile;
use kinran_shading::skin::profile::Gaussian;
use serde::Deserialize;

use crate::Error;
use crate::outputs::has_extension;

/// Longest file that is read: some 30 000 rows.
const BYTES_MAX: u64 = 1 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sum {
    gaussians: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    variance: f64,
    weight: [f64; 3],
}

/// Reads a `.csv` of distances and densities or a `.json` of Gaussians.
///
/// # Errors
/// Names file, line and what should stand there.
pub(super) fn read(path: &Path) -> Result<Profile, Error> {
    let io = |e| Error::from(kinran_image::Error::io(path, e));
    if std::fs::metadata(path).map_err(io)?.len() > BYTES_MAX {
        return Err(Error::file_error(
            path,
            "is larger than 1 MiB, so no profile; name a .csv or .json of one",
        ));
    }
    let text = std::fs::read_to_string(path).map_err(io)?;
    if has_extension(path, "json") {
        let sum: Sum = serde_json::from_str(&text).map_err(|e| {
            let fix = "write { \"gaussians\": [ { \"variance\": 1, \"weight\": [1, 1, 1] } ] }";
            Error::file_error(path, format!("{e}; {fix}"))
        })?;
        let sum = sum.gaussians.iter().map(|g| Gaussian { variance: g.variance, weight: g.weight });
        return Ok(Profile::Gaussians(sum.collect()));
    }
    if !has_extension(path, "csv") {
        return Err(Error::file_error(path, "a profile's file ends in .csv or .json; rename it"));
    }
    let mut rows = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let numbers: Result<Vec<f64>, _> =
            line.split([',', ';', '\t']).map(|n| n.trim().parse::<f64>()).collect();
        match numbers.as_deref() {
            Ok(&[r, red, green, blue]) => rows.push((r, [red, green, blue])),
            // The first line may name the columns.
            Err(_) if rows.is_empty() && i == 0 => {}
            _ => {
                let reason =
                    format!("line {}: \"{line}\" is no row; write distance in mm, red, green, blue", i + 1);
                return Err(Error::file_error(path, reason));
            }
        }
    }
    Ok(Profile::Table(rows))
}
