//! Numbers about the texels of a map.

use glam::{Vec3, Vec4, vec3};
use kinran_shading::{aniso_decode_matrix, normal_from_xy};
use schemars::JsonSchema;
use serde::Serialize;

use crate::content::Content;

/// The smallest, the average and the largest value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Range {
    /// The smallest.
    pub min: f32,
    /// The mean.
    pub mean: f32,
    /// The largest.
    pub max: f32,
}

impl Range {
    /// `None` of no values.
    pub(crate) fn of(values: impl Iterator<Item = f32>) -> Option<Range> {
        let (mut min, mut max, mut sum, mut count) = (f32::INFINITY, f32::NEG_INFINITY, 0.0, 0_u64);
        for v in values {
            (min, max) = (min.min(v), max.max(v));
            sum += f64::from(v);
            count += 1;
        }
        (count > 0).then(|| Range { min, mean: (sum / count as f64) as f32, max })
    }
}

/// What is worth knowing about one level, by what the map holds.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Statistics {
    /// Of tangent-space normals.
    Normal {
        /// Length of the average of all normals, 1 where all are the same.
        average_length: f32,
        /// Angle from (0, 0, 1).
        tilt_degrees: Range,
        /// Share of texels whose x and y are longer than 1.
        outside_share: f32,
    },
    /// Of an aniso map.
    Aniso {
        /// GGX roughness along the direction.
        alpha_t: Range,
        /// GGX roughness across it.
        alpha_b: Range,
        /// Deviation of directions: 0 where all are parallel, 40.5 where there is none in particular.
        direction_spread_degrees: Option<f32>,
    },
    /// Of a roughness map.
    Roughness {
        /// Perceptual roughness.
        roughness: Range,
    },
    /// Of a map for `KHR_materials_anisotropy`.
    Anisotropy {
        /// Strength of anisotropy.
        strength: Range,
        /// As of an aniso map.
        direction_spread_degrees: Option<f32>,
    },
    /// Of any other.
    Channels {
        /// Red.
        red: Range,
        /// Green.
        green: Range,
        /// Blue.
        blue: Range,
        /// Alpha.
        alpha: Range,
    },
}

impl Statistics {
    /// Statistics of decoded texels; `None` of none.
    pub(crate) fn new(role: Content, texels: &[[f32; 4]]) -> Option<Statistics> {
        let channel = |i: usize| Range::of(texels.iter().map(move |t| t[i]));
        Some(match role {
            Content::Normal => {
                let normals = || texels.iter().map(|t| (Vec4::from(*t) * 2.0 - 1.0).truncate());
                let unit = || normals().map(|n| normal_from_xy(n.x, n.y));
                let sum = unit().fold(glam::DVec3::ZERO, |sum, n| sum + n.as_dvec3());
                let tilt = |n: Vec3| n.truncate().length().atan2(n.z).to_degrees();
                // Rounding alone may lift a unit vector by half a step of 8 bits in x and in y.
                let outside = normals().filter(|n| n.truncate().length() > 1.0 + 1.0 / 255.0).count();
                Statistics::Normal {
                    average_length: (sum.length() / texels.len() as f64) as f32,
                    tilt_degrees: Range::of(unit().map(tilt))?,
                    outside_share: outside as f32 / texels.len() as f32,
                }
            }
            Content::Aniso => {
                let eigen = || texels.iter().map(|t| aniso_decode_matrix(vec3(t[0], t[1], t[2])).eigen());
                Statistics::Aniso {
                    alpha_t: Range::of(eigen().map(|(t, _, _)| t.sqrt()))?,
                    alpha_b: Range::of(eigen().map(|(_, b, _)| b.sqrt()))?,
                    direction_spread_degrees: direction_spread(
                        eigen().map(|(t, b, axis)| (axis.to_array(), t.sqrt() - b.sqrt())),
                    ),
                }
            }
            Content::Roughness => Statistics::Roughness { roughness: channel(1)? },
            Content::Anisotropy => Statistics::Anisotropy {
                strength: channel(2)?,
                direction_spread_degrees: direction_spread(
                    texels.iter().map(|t| ([t[0] * 2.0 - 1.0, t[1] * 2.0 - 1.0], t[2])),
                ),
            },
            _ => Statistics::Channels {
                red: channel(0)?,
                green: channel(1)?,
                blue: channel(2)?,
                alpha: channel(3)?,
            },
        })
    }
}

/// Angular deviation of directions and their weights, in degrees: 0 where all are parallel, 40.5 where there
/// is none in particular; `None` where no weight is left. A direction and its opposite are the same, so
/// angles are doubled (Batschelet. Circular Statistics in Biology. 1981, sections 2.3 and 2.6).
fn direction_spread(directions: impl Iterator<Item = ([f32; 2], f32)>) -> Option<f32> {
    let (mut x, mut y, mut total, mut count) = (0.0, 0.0, 0.0, 0_u64);
    for (direction, weight) in directions {
        count += 1;
        let [dx, dy] = direction.map(f64::from);
        let squared = dx * dx + dy * dy;
        if squared > 0.0 {
            x += f64::from(weight) * (dx * dx - dy * dy) / squared;
            y += f64::from(weight) * 2.0 * dx * dy / squared;
            total += f64::from(weight);
        }
    }
    // On average less than an 8-bit step of weight is noise of the encoder.
    let resultant = (x.hypot(y) / total).min(1.0);
    (total * 255.0 > count as f64).then(|| (0.5 * (2.0 * (1.0 - resultant)).sqrt()).to_degrees() as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;
    use kinran_shading::{aniso_encode, aniso_from_alphas};

    fn aniso(alpha_t: f32, alpha_b: f32, degrees: f32) -> [f32; 4] {
        aniso_encode(aniso_from_alphas(alpha_t, alpha_b, Vec2::from_angle(degrees.to_radians())))
            .extend(1.0)
            .to_array()
    }

    #[test]
    fn opposite_directions_are_parallel_and_crossed_ones_are_not() {
        let spread = |degrees: &[f32]| {
            let texels: Vec<_> = degrees.iter().map(|&d| aniso(0.5, 0.1, d)).collect();
            match Statistics::new(Content::Aniso, &texels) {
                Some(Statistics::Aniso { direction_spread_degrees, .. }) => direction_spread_degrees.unwrap(),
                other => panic!("{other:?}"),
            }
        };
        // Crossed: the doubled angles cancel, sqrt(2)/2 radians.
        for (degrees, wanted) in [(&[30.0, 210.0][..], 0.0), (&[20.0, 110.0], 40.514), (&[0.0, 0.0], 0.0)] {
            let got = spread(degrees);
            assert!((got - wanted).abs() < 0.05, "{degrees:?}: wanted {wanted}, got {got}");
        }
    }

    #[test]
    fn roughness_is_read_back_as_it_was_encoded() {
        let texels = [aniso(0.5, 0.1, 10.0), aniso(0.3, 0.2, 70.0)];
        let Some(Statistics::Aniso { alpha_t, alpha_b, .. }) = Statistics::new(Content::Aniso, &texels)
        else {
            panic!("no statistics of an aniso map");
        };
        for (what, got, wanted) in [
            ("alpha_t", alpha_t, Range { min: 0.3, mean: 0.4, max: 0.5 }),
            ("alpha_b", alpha_b, Range { min: 0.1, mean: 0.15, max: 0.2 }),
        ] {
            let off = [got.min - wanted.min, got.mean - wanted.mean, got.max - wanted.max];
            assert!(off.iter().all(|d| d.abs() < 1e-4), "{what}: wanted {wanted:?}, got {got:?}");
        }
    }

    #[test]
    fn tilted_normals_shorten_their_average() {
        // Two normals tilted by 30 degrees to either side: their average has length cos 30.
        let at = |x: f32| [x * 0.5 + 0.5, 0.5, 0.0, 1.0];
        let Some(Statistics::Normal { average_length, tilt_degrees, outside_share }) =
            Statistics::new(Content::Normal, &[at(0.5), at(-0.5)])
        else {
            panic!("no statistics of a normal map");
        };
        assert!((average_length - 0.866_025).abs() < 1e-4, "{average_length}");
        assert!((tilt_degrees.mean - 30.0).abs() < 1e-3 && outside_share == 0.0, "{tilt_degrees:?}");
        let Some(Statistics::Normal { outside_share, .. }) =
            Statistics::new(Content::Normal, &[[1.0, 1.0, 0.5, 1.0], [0.5, 0.5, 1.0, 1.0]])
        else {
            panic!("no statistics of a normal map");
        };
        assert_eq!(outside_share, 0.5);
    }
}
