//! What a material with fuzz costs when it is built, on one core.
//!
//! `cargo bench -p kinran-bake --bench fuzz_fit`: all coefficients for one tilt and spread, and the table of combed fibres.

use divan::{Bencher, black_box};
use kinran_bake::fuzz_fit::{Phase, ambient_texels, fuzz_fit};

fn main() {
    // The talk's forms of G and Q are the same for all fibres and made once.
    fuzz_fit(Phase::Fibre, 0.0, 0.2);
    divan::main();
}

const PHASES: [Phase; 2] = [Phase::Fibre, Phase::Velvet];

#[divan::bench(args = PHASES, sample_size = 1)]
fn coefficients(bencher: Bencher, phase: Phase) {
    bencher.bench_local(|| fuzz_fit(phase, black_box(30f64.to_radians()), black_box(0.2)));
}

#[divan::bench(args = PHASES, sample_size = 1)]
fn table(bencher: Bencher, phase: Phase) {
    bencher.bench_local(|| ambient_texels(phase, black_box(30f64.to_radians()), black_box(0.02)));
}
