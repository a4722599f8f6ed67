//! How much of the tiles a target bears.

use kinran_image::{Error, Tick};

use super::compare::{compressed_errors, solved_errors};
use super::layer::Layer;
use super::map::compress;
use super::solve::{DetailOptions, Target};

/// Halvings of the interval in which the opacity is looked for: steps of 1/32.
const HALVINGS: usize = 5;

/// The most solutions that [`bearable_opacity`] takes: the whole opacity, each halving, and none.
pub const FADE_TRIALS: u64 = HALVINGS as u64 + 2;

/// The largest factor on the opacity of all layers, in steps of 1/32, with which the blended error is not above that of
/// the compressed target, on the two finest levels of `s`. `None` where no factor is small enough.
///
/// A tile that has nothing to do with the target has to be cancelled by `s`, in the bits that should hold the target's
/// own grain: blended error grows with the tile's contrast. At opacity 0 there is no tile left, and `s` is the target
/// in blocks that were chosen by what they look like.
///
/// The two levels are solved at most [`FADE_TRIALS`] times, and `tick` is told of their texels as in
/// [`solve`](fn@super::solve).
///
/// # Errors
/// As [`solve`](fn@super::solve).
pub fn bearable_opacity(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    tick: &Tick<'_>,
) -> Result<Option<f32>, Error> {
    let options = &DetailOptions { measure_all: true, ..*options };
    let finest = options.first_level..target.levels.len().min(options.first_level + 2);
    let alone = compress(&target.levels[finest.clone()], target.kind, options.encoding, &|_| tick(0))?;
    let alone = compressed_errors(target, &alone, options.first_level, tick)?;
    let bears = |factor: f32| -> Result<bool, Error> {
        let layers: Vec<Layer> =
            layers.iter().map(|layer| Layer { opacity: layer.opacity * factor, ..*layer }).collect();
        let errors = solved_errors(target, &layers, options, finest.clone(), tick)?;
        Ok(errors.iter().zip(&alone).all(|(blended, alone)| blended <= alone))
    };
    if bears(1.0)? {
        return Ok(Some(1.0));
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if bears(middle)? {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(if low > 0.0 || bears(0.0)? { Some(low) } else { None })
}
