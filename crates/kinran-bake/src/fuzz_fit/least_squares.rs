//! Linear least squares for a handful of unknowns.

/// The coefficients that minimise `Σ weight (row · c - value)²`. Directions in which nothing is known, as when two
/// terms are the same for upright fibres, get the smallest coefficients.
pub(super) fn least_squares<const N: usize>(
    equations: impl Iterator<Item = ([f64; N], f64, f64)>,
) -> [f64; N] {
    let mut matrix = [[0.0; N]; N];
    let mut right = [0.0; N];
    for (row, value, weight) in equations {
        for i in 0..N {
            for j in 0..=i {
                matrix[i][j] += weight * row[i] * row[j];
            }
            right[i] += weight * row[i] * value;
        }
    }
    let trace: f64 = (0..N).map(|i| matrix[i][i]).sum();
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] += 1e-10 * trace;
    }
    cholesky_solve(matrix, right)
}

/// Solves a symmetric positive definite system given by its lower triangle.
fn cholesky_solve<const N: usize>(mut l: [[f64; N]; N], mut x: [f64; N]) -> [f64; N] {
    for i in 0..N {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            l[i][j] = if i == j { libm::sqrt(l[i][i] - dot) } else { (l[i][j] - dot) / l[j][j] };
        }
        let dot: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
        x[i] = (x[i] - dot) / l[i][i];
    }
    for i in (0..N).rev() {
        let dot: f64 = (i + 1..N).map(|k| l[k][i] * x[k]).sum();
        x[i] = (x[i] - dot) / l[i][i];
    }
    x
}

/// The coefficients of the least worst relative error, nearly: equations are weighted by what they are off
/// by, again and again (Lawson 1961).
pub(super) fn minimax<const N: usize>(equations: &[([f64; N], f64, f64)]) -> [f64; N] {
    let relative: Vec<[f64; N]> = equations.iter().map(|(row, value, _)| row.map(|x| x / value)).collect();
    let mut weights = vec![1.0; relative.len()];
    let mut best = ([0.0; N], f64::INFINITY);
    for _ in 0..60 {
        let c = least_squares(relative.iter().zip(&weights).map(|(&row, &weight)| (row, 1.0, weight)));
        let off: Vec<f64> = (relative.iter())
            .map(|row| (row.iter().zip(&c).map(|(x, c)| x * c).sum::<f64>() - 1.0).abs())
            .collect();
        let worst = off.iter().fold(0.0, |a: f64, &b| a.max(b));
        if worst < best.1 {
            best = (c, worst);
        }
        // Softened, so that no equation is forgotten.
        for (weight, off) in weights.iter_mut().zip(off) {
            *weight *= 0.3 + off / worst.max(1e-12);
        }
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        weights.iter_mut().for_each(|weight| *weight /= mean);
    }
    best.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_points_on_it_is_found_and_an_unknown_term_stays_small() {
        let points = (0..9).map(|i| ([1.0, f64::from(i), f64::from(i)], 3.0 - 0.5 * f64::from(i), 1.0));
        let [a, b, c] = least_squares(points);
        assert!((a - 3.0).abs() < 1e-5 && (b + 0.25).abs() < 1e-5 && (c + 0.25).abs() < 1e-5, "{a} {b} {c}");
    }

    #[test]
    fn the_least_worst_constant_of_one_and_two_is_off_by_a_third_of_both() {
        let [c] = minimax(&[([1.0], 1.0, 1.0), ([1.0], 2.0, 1.0), ([1.0], 1.9, 1.0)]);
        assert!((c - 4.0 / 3.0).abs() < 0.02, "{c}");
    }
}
