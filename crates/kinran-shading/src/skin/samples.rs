//! A linear profile at chosen distances, with its integrals up to them.

/// A linear profile at a distance, RGB. Between samples the density is a straight line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Millimetres.
    pub(super) distance: f64,
    /// Per millimetre.
    pub(super) density: [f64; 3],
    /// The density integrated from distance zero.
    pub(super) mass: [f64; 3],
    /// The density times the distance, integrated likewise.
    pub(super) moment: [f64; 3],
}

/// Weights of the values at 0, 1, 2 and 3 in the cubic through them (Lagrange).
pub(super) fn cubic(x: f64) -> [f64; 4] {
    let (a, b, c) = (x - 1.0, x - 2.0, x - 3.0);
    [a * b * c / -6.0, 0.5 * x * b * c, -0.5 * x * a * c, x * a * b / 6.0]
}

impl Sample {
    /// Mass and moment up to a distance between this sample and the next.
    pub(super) fn integrals(&self, next: &Sample, distance: f64) -> ([f64; 3], [f64; 3]) {
        let x = distance - self.distance;
        let t = x / (next.distance - self.distance);
        let (mut mass, mut moment) = (self.mass, self.moment);
        for c in [0, 1, 2] {
            let rise = t * (next.density[c] - self.density[c]);
            let of_mass = x * (self.density[c] + 0.5 * rise);
            mass[c] += of_mass;
            moment[c] += self.distance * of_mass + x * x * (0.5 * self.density[c] + rise / 3.0);
        }
        (mass, moment)
    }
}

/// Density at a distance in millimetres.
pub(super) fn density(samples: &[Sample], x: f64) -> [f64; 3] {
    let next = samples.partition_point(|sample| sample.distance <= x);
    if next == samples.len() {
        return [0.0; 3];
    }
    let (a, b) = (&samples[next - 1], &samples[next]);
    let t = (x - a.distance) / (b.distance - a.distance);
    core::array::from_fn(|c| a.density[c] + t * (b.density[c] - a.density[c]))
}
