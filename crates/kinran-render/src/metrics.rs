//! How far two pictures are apart.
//!
//! ```
//! use kinran_render::metrics::{flip, rmse_srgb8};
//!
//! let (black, white) = ([[0; 3]; 64], [[255; 3]; 64]);
//! assert_eq!(rmse_srgb8(&black, &white)?, 1.0);
//! assert!(flip(&black, &white, 8, 8)?.mean > 0.9);
//! # Ok::<(), kinran_render::Error>(())
//! ```

use crate::Error;

/// A FLIP comparison of two pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Mean of the map: 0 equal, 1 as different as black and white.
    pub mean: f32,
    /// Error of each pixel, 0 to 1, row by row from the top.
    pub map: Vec<f32>,
}

/// Root mean square difference over all pixels and channels, in the unit of the input. On linear radiance it
/// is dominated by highlights; on display-encoded values ([`rmse_srgb8`]) it weighs shadows as a viewer does.
///
/// # Errors
/// [`Error::SizeMismatch`] when the slices differ in length.
pub fn rmse_linear(a: &[[f32; 3]], b: &[[f32; 3]]) -> Result<f64, Error> {
    rmse(a, b, |x, y| f64::from(x) - f64::from(y))
}

/// The difference from `truth` in linear light, relative to `truth`: both as the roots of sums of squares over all pixels and
/// channels. 1 where `truth` is black and the picture is not.
///
/// # Errors
/// [`Error::SizeMismatch`] when the slices differ in length.
pub fn relative_l2(truth: &[[f32; 3]], picture: &[[f32; 3]]) -> Result<f64, Error> {
    let black = vec![[0.0; 3]; truth.len()];
    let (error, of) = (rmse_linear(truth, picture)?, rmse_linear(truth, &black)?);
    Ok(if of > 0.0 { error / of } else { f64::from(u8::from(error > 0.0)) })
}

/// Root mean square difference of display-encoded 8-bit sRGB values over all pixels and channels, black to
/// white being 1.
///
/// # Errors
/// [`Error::SizeMismatch`] when the slices differ in length.
pub fn rmse_srgb8(a: &[[u8; 3]], b: &[[u8; 3]]) -> Result<f64, Error> {
    rmse(a, b, |x, y| (f64::from(x) - f64::from(y)) / 255.0)
}

fn rmse<T: Copy>(a: &[[T; 3]], b: &[[T; 3]], difference: impl Fn(T, T) -> f64) -> Result<f64, Error> {
    if a.len() != b.len() || a.is_empty() {
        return Err(Error::SizeMismatch { a: a.len(), b: b.len() });
    }
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    let sum: f64 = pairs.map(|(&x, &y)| difference(x, y).powi(2)).sum();
    Ok((sum / (3 * a.len()) as f64).sqrt())
}

/// LDR-FLIP of display-encoded sRGB pictures at 67 pixels per degree, its authors' default: a 0.7 m distance
/// from a 0.7 m wide monitor of 3840 pixels.
///
/// Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild. FLIP: A Difference Evaluator for
/// Alternating Images. HPG 2020.
///
/// # Errors
/// [`Error::SizeMismatch`] when a slice does not hold `width * height` pixels, or none at all.
pub fn flip(reference: &[[u8; 3]], test: &[[u8; 3]], width: u32, height: u32) -> Result<Flip, Error> {
    let pixels = width as usize * height as usize;
    for picture in [reference, test] {
        if pixels == 0 || picture.len() != pixels {
            return Err(Error::SizeMismatch { a: pixels, b: picture.len() });
        }
    }
    let image = |pixels: &[[u8; 3]]| nv_flip::FlipImageRgb8::with_data(width, height, pixels.as_flattened());
    let map = nv_flip::flip(image(reference), image(test), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec();
    let mean = (map.iter().map(|&e| f64::from(e)).sum::<f64>() / pixels as f64) as f32;
    Ok(Flip { mean, map })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_have_no_error_and_black_is_farthest_from_white() {
        let (black, white) = (vec![[0; 3]; 64 * 48], vec![[255; 3]; 64 * 48]);
        assert_eq!(rmse_srgb8(&black, &black), Ok(0.0));
        assert_eq!(rmse_srgb8(&black, &white), Ok(1.0));
        let same = flip(&white, &white, 64, 48).unwrap();
        assert!(same.mean == 0.0 && same.map.len() == 64 * 48, "{same:?}");
        let far = flip(&black, &white, 64, 48).unwrap();
        // `flip-evaluator` 1.7 says the same; the largest error, 1, belongs to green and blue.
        assert!((far.mean - 0.967_392).abs() < 1e-4, "black and white differ by {}", far.mean);
    }

    #[test]
    fn rmse_of_a_known_difference() {
        // One channel of twelve is off by 2: sqrt(4 / 12).
        let a = vec![[1.0; 3]; 4];
        let mut b = a.clone();
        b[2][1] = 3.0;
        let got = rmse_linear(&a, &b).unwrap();
        assert!((got - (4.0f64 / 12.0).sqrt()).abs() < 1e-12, "{got}");
    }

    #[test]
    fn relative_errors_do_not_know_exposure() {
        let truth: Vec<[f32; 3]> = (0..12).map(|i| [i as f32, 1.0, 0.5 * i as f32]).collect();
        for exposure in [1.0, 8.0] {
            let bright = |by: f32| truth.iter().map(|p| p.map(|c| by * exposure * c)).collect::<Vec<_>>();
            let got = relative_l2(&bright(1.0), &bright(1.25)).unwrap();
            assert!((got - 0.25).abs() < 1e-6, "a quarter brighter: {got}");
        }
        assert_eq!(relative_l2(&[[0.0; 3]], &[[0.0; 3]]), Ok(0.0));
        assert_eq!(relative_l2(&[[0.0; 3]], &[[1.0; 3]]), Ok(1.0));
    }

    /// The numbers are those that the PyPI package `flip-evaluator` 1.7 gives for the same pictures:
    /// `evaluate(reference / 255, test / 255, "LDR", applyMagma=False, parameters={"ppd": 67.0})`.
    #[test]
    fn flip_agrees_with_its_authors_own_package() {
        let (width, height) = (64, 48);
        let picture = |f: &dyn Fn(u32, u32) -> [u32; 3]| -> Vec<[u8; 3]> {
            (0..width * height).map(|i| f(i % width, i / width).map(|c| (c % 256) as u8)).collect()
        };
        let reference = picture(&|x, y| [x * 4, y * 5, (x * y) / 12]);
        let test = picture(&|x, y| [x * 4, (y * 5 + x).min(255), if x > 20 { 128 } else { (x * y) / 12 }]);
        let got = flip(&reference, &test, width, height).unwrap();
        let at = |x: u32, y: u32| got.map[(y * width + x) as usize];
        let checks = [
            ("mean", got.mean, 0.524517),
            ("(0, 0)", at(0, 0), 0.011422),
            ("(20, 10)", at(20, 10), 0.457977),
            ("(63, 47)", at(63, 47), 0.965642),
        ];
        for (what, got, wanted) in checks {
            assert!((got - wanted).abs() < 1e-4, "{what}: wanted {wanted}, got {got}");
        }
    }

    #[test]
    fn pictures_of_different_size_are_refused() {
        let (a, b) = (vec![[0u8; 3]; 6], vec![[0u8; 3]; 5]);
        assert_eq!(rmse_srgb8(&a, &b), Err(Error::SizeMismatch { a: 6, b: 5 }));
        assert_eq!(flip(&a, &b, 3, 2), Err(Error::SizeMismatch { a: 6, b: 5 }));
        assert_eq!(flip(&[], &[], 0, 0), Err(Error::SizeMismatch { a: 0, b: 0 }));
    }
}
