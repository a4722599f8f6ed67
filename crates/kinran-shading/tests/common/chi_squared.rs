//! Pearson's chi-squared test of a sampler against its density.
//!
//! [1] Subr, Arvo. Statistical Hypothesis Testing for Assessing Monte Carlo Estimators. Pacific Graphics 2007.
//! [2] Šidák. Rectangular Confidence Regions for the Means of Multivariate Normal Distributions. 1967.

use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::fmt::Write;

/// Smallest expected count of a cell that the chi-squared distribution describes well ([1] section 3.2).
const MIN_EXPECTED: f64 = 5.0;

/// Chance that a whole family of tests of a right sampler reports a wrong one. The samples come from a fixed
/// seed, so that a suite which passes once passes always.
const SIGNIFICANCE: f64 = 0.01;

/// Tests the hypothesis that `observed` counts were drawn with the `expected` ones.
///
/// Cells that expect fewer than five samples are pooled, the rarest first. `expected` must sum to the
/// number of samples within 1 ‰ (anything else is a density that does not integrate to one) and is then
/// scaled to it. `family` is the number of tests run together: Šidák's correction ([2]) keeps the chance of
/// any false alarm among them at 1 %.
///
/// Returns the p-value, or a report with the worst cells.
pub(crate) fn chi_squared_test(observed: &[u64], expected: &[f64], family: u32) -> Result<f64, String> {
    assert_eq!(observed.len(), expected.len(), "one expected count for every cell");
    let samples = observed.iter().sum::<u64>() as f64;
    let total = expected.iter().sum::<f64>();
    if (total / samples - 1.0).abs() > 1e-3 {
        return Err(format!("the density integrates to {} instead of 1", total / samples));
    }

    // Pool from the rarest cell on; what is left over at the end joins the last pool.
    let mut order = (0..expected.len()).collect::<Vec<_>>();
    order.sort_by(|&l, &r| expected[l].total_cmp(&expected[r]).then(l.cmp(&r)));
    let mut pools: Vec<Pool> = Vec::new();
    let mut open = Pool::default();
    for cell in order {
        open.cells.push(cell);
        open.observed += observed[cell] as f64;
        open.expected += expected[cell] * samples / total;
        if open.expected >= MIN_EXPECTED {
            pools.push(std::mem::take(&mut open));
        }
    }
    let last = pools.last_mut().ok_or("too few samples: no pool of cells expects five")?;
    last.cells.append(&mut open.cells);
    last.observed += open.observed;
    last.expected += open.expected;
    if pools.len() < 2 {
        return Err("too few samples: all cells fell into one pool".to_owned());
    }

    // Compare with the chi-squared distribution.
    let statistic = pools.iter().map(Pool::contribution).sum::<f64>();
    let freedom = (pools.len() - 1) as f64;
    let p = ChiSquared::new(freedom).expect("at least one degree of freedom").sf(statistic);
    let threshold = 1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / f64::from(family));
    if p >= threshold {
        return Ok(p);
    }

    let mut report = format!(
        "chi² = {statistic:.1} at {freedom} degrees of freedom: p = {p:.3e}, wanted at least {threshold:.3e}\n\
         {samples} samples in {} cells, {} after pooling; the worst:\n\
         {:>12} {:>12} {:>9}  cells\n",
        observed.len(),
        pools.len(),
        "expected",
        "observed",
        "chi²"
    );
    pools.sort_by(|l, r| r.contribution().total_cmp(&l.contribution()));
    for pool in pools.iter().take(16) {
        let shown = &pool.cells[..pool.cells.len().min(8)];
        let more = if shown.len() < pool.cells.len() { "…" } else { "" };
        writeln!(
            report,
            "{:12.2} {:12} {:9.2}  {shown:?}{more}",
            pool.expected,
            pool.observed,
            pool.contribution()
        )
        .expect("a string takes any text");
    }
    Err(report)
}

/// Cells that are counted together.
#[derive(Default)]
struct Pool {
    cells: Vec<usize>,
    observed: f64,
    expected: f64,
}

impl Pool {
    fn contribution(&self) -> f64 {
        (self.observed - self.expected).powi(2) / self.expected
    }
}
