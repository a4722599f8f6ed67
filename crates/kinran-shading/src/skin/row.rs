//! A row of the table of punctual light, by one walk around the ring.

/// n·u at the middle of each of `columns` equal columns from -1 to 1.
pub fn column_n_u(column: usize, columns: usize) -> f64 {
    (2 * column + 1) as f64 / columns as f64 - 1.0
}

/// Integrals over the ring from the light's side up to an angle θ.
#[derive(Clone, Copy, Default)]
pub(super) struct Integrals {
    /// `∫ R dθ`, RGB.
    pub(super) one: [f64; 3],
    /// `∫ R cos θ dθ`.
    pub(super) cos: [f64; 3],
    /// `∫ R sin θ dθ`.
    pub(super) sin: [f64; 3],
}

/// Which of the two angles between 0 and π that have a sine.
#[derive(Clone, Copy)]
pub(super) enum Half {
    /// Up to π/2.
    Near,
    /// From there on.
    Far,
}

/// What integrates a profile along the ring.
pub(super) trait Ring {
    /// Goes on to the angle with this sine, 0 to 1, which is not before the last one. Returns the absolute value of its cosine.
    fn advance(&mut self, sine: f64, half: Half) -> f64;

    /// Up to the angle reached.
    fn integrals(&self) -> Integrals;
}

/// Fills a row, of any numbers, by the sums of A and B that the module [`ring`](super::ring) explains.
pub(super) fn walk(ring: &mut impl Ring, row: &mut [[f64; 3]]) {
    let columns = row.len();
    let lit = columns / 2..columns;
    debug_assert!(columns > 0, "a row has columns");

    // A and B are differences of integrals from 0: those up to π/2 - θ first, then those up to π/2 + θ.
    for i in lit.clone() {
        let x = column_n_u(i, columns).max(0.0);
        let cosine = ring.advance(x, Half::Near);
        let Integrals { cos, sin, .. } = ring.integrals();
        row[i] = core::array::from_fn(|c| x * cos[c] - cosine * sin[c]);
    }
    for i in lit.clone().rev() {
        let x = column_n_u(i, columns).max(0.0);
        let cosine = ring.advance(x, Half::Far);
        let Integrals { cos, sin, .. } = ring.integrals();
        for c in [0, 1, 2] {
            row[i][c] += x * cos[c] + cosine * sin[c];
        }
    }
    ring.advance(0.0, Half::Far);
    let Integrals { one, cos, .. } = ring.integrals();
    debug_assert!(one.iter().all(|&mass| mass > 0.0 && mass.is_finite()), "light leaves somewhere: {one:?}");

    // The clamped cosine is half of cosine and its absolute value; the first turns its sign behind the terminator, where
    // rounding can leave -1e-17.
    for i in lit {
        let x = column_n_u(i, columns);
        for c in [0, 1, 2] {
            row[i][c] /= 2.0 * one[c];
            row[columns - 1 - i][c] = (row[i][c] - x * cos[c] / one[c]).max(0.0);
        }
    }
}
