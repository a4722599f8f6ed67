//! A diffusion profile from a file.

use std::io::ErrorKind;
use std::path::Path;

use kinran_bake::skin_lut::Profile;
use kinran_image::Files;
use kinran_shading::skin::profile::Gaussian;
use serde::Deserialize;

use crate::Error;
use crate::error::InputFault;

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
pub(crate) fn read(files: &dyn Files, path: &Path) -> Result<Profile, Error> {
    let io = |e| Error::from(kinran_image::Error::io(path, e));
    let refused = |fault| Err(Error::Input { path: path.into(), fault });
    if files.size(path).is_some_and(|bytes| bytes > BYTES_MAX) {
        return refused(InputFault::LargeProfile);
    }
    let is = |extension: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension));
    let text = String::from_utf8(files.read(path).map_err(io)?);
    let text = text
        .map_err(|_| io(std::io::Error::new(ErrorKind::InvalidData, "stream did not contain valid UTF-8")))?;
    if is("json") {
        let sum: Sum = match serde_json::from_str(&text) {
            Ok(sum) => sum,
            Err(error) => return refused(InputFault::NoGaussians(error.to_string())),
        };
        let sum = sum.gaussians.iter().map(|g| Gaussian { variance: g.variance, weight: g.weight });
        return Ok(Profile::Gaussians(sum.collect()));
    }
    if !is("csv") {
        return refused(InputFault::NoProfile);
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
                return refused(InputFault::NoRow { line: i + 1, text: line.into() });
            }
        }
    }
    Ok(Profile::Table(rows))
}
