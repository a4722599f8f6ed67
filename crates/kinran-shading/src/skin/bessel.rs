//! Modified Bessel functions, in double precision.
//!
//! Abramowitz, Stegun. Handbook of Mathematical Functions. 1964, chapter 9.

use libm::{exp, log, sqrt};

/// `exp(-x) I_order(x)` for `x` ≥ 0 and order 0 or 1, to 1e-14.
fn scaled_i(order: u32, x: f64) -> f64 {
    let nu = f64::from(order);
    if x < 20.0 {
        // Power series (9.6.10); all terms are positive.
        let quarter = 0.25 * x * x;
        let mut term = if order == 0 { 1.0 } else { 0.5 * x };
        let mut sum = term;
        let mut k = 1.0;
        while term > 1e-17 * sum {
            term *= quarter / (k * (k + nu));
            sum += term;
            k += 1.0;
        }
        return sum * exp(-x);
    }
    // Hankel's expansion (9.7.1): at 20 its terms shrink down to 1e-17 before they grow.
    let mu = 4.0 * nu * nu;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..40 {
        let odd = f64::from(2 * k - 1);
        let next = -term * (mu - odd * odd) / (f64::from(k) * 8.0 * x);
        if next.abs() >= term.abs() || next.abs() < 1e-17 {
            break;
        }
        term = next;
        sum += term;
    }
    sum / sqrt(2.0 * core::f64::consts::PI * x)
}

/// `exp(-x) I0(x)` for `x` ≥ 0.
pub(crate) fn scaled_i0(x: f64) -> f64 {
    scaled_i(0, x)
}

/// `exp(-x) I1(x)` for `x` ≥ 0.
pub(crate) fn scaled_i1(x: f64) -> f64 {
    scaled_i(1, x)
}

/// `K0(x)` for `x` > 0, to 2e-7 of itself (9.8.5, 9.8.6).
pub(crate) fn k0(x: f64) -> f64 {
    let polynomial = |y: f64, c: [f64; 7]| c.iter().rev().fold(0.0, |sum, c| sum * y + c);
    if x <= 2.0 {
        let i0 = scaled_i0(x) * exp(x);
        let c = [
            -0.577_215_66,
            0.422_784_20,
            0.230_697_56,
            0.034_885_90,
            0.002_626_98,
            0.000_107_50,
            0.000_007_40,
        ];
        -log(0.5 * x) * i0 + polynomial(0.25 * x * x, c)
    } else {
        let c = [
            1.253_314_14,
            -0.078_323_58,
            0.021_895_68,
            -0.010_624_46,
            0.005_878_72,
            -0.002_515_40,
            0.000_532_08,
        ];
        exp(-x) / sqrt(x) * polynomial(2.0 / x, c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `∫ exp(x (cos t - 1)) cos(order t) dt / π` over [0, π] (9.6.19); the trapezoid rule converges
    /// exponentially for periodic functions.
    fn i_by_quadrature(order: u32, x: f64) -> f64 {
        const N: usize = 4000;
        let f = |t: f64| (x * (t.cos() - 1.0)).exp() * (f64::from(order) * t).cos();
        let inner: f64 = (1..N).map(|i| f(core::f64::consts::PI * i as f64 / N as f64)).sum();
        (inner + 0.5 * (f(0.0) + f(core::f64::consts::PI))) / N as f64
    }

    #[test]
    fn i0_and_i1_meet_their_integrals_on_both_sides_of_the_seam() {
        for x in [0.0, 1e-9, 0.3, 2.0, 10.0, 19.999, 20.0, 20.001, 60.0, 1e3, 1e5] {
            for order in [0, 1] {
                let (want, got) = (i_by_quadrature(order, x), scaled_i(order, x));
                assert!(
                    (want - got).abs() <= 2e-14 + 1e-13 * want,
                    "I{order}({x}): wanted {want}, got {got}"
                );
            }
        }
    }

    /// `∫ exp(-x cosh t) dt` over [0, ∞) (9.6.24), where the trapezoid rule converges exponentially too.
    #[test]
    fn k0_meets_its_integral() {
        for x in [1e-6, 1e-3, 0.1, 1.0, 1.999, 2.0, 2.001, 5.0, 30.0] {
            let f = |t: f64| (-x * t.cosh()).exp();
            let want = 0.01 * (0.5 * f(0.0) + (1..4000).map(|i| f(0.01 * f64::from(i))).sum::<f64>());
            let got = k0(x);
            assert!((want - got).abs() <= 3e-7 * want, "K0({x}): wanted {want}, got {got}");
        }
    }
}
