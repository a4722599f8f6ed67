//! Any numbers are a diffusion profile whose ring gives and takes no light, or an error.

#![no_main]

use kinran_shading::skin::profile::{Gaussian, RadialProfile};
use kinran_shading::skin::sampled::Sample;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: (u8, f64, Vec<(f64, [f64; 3])>)| {
    let (form, curvature, rows) = input;
    // As much as a file may hold would take minutes; a thousand rows go the same ways.
    if rows.len() > 1000 || !curvature.is_finite() {
        return;
    }
    let gaussians: Vec<Gaussian> = rows.iter().map(|&(variance, weight)| Gaussian { variance, weight }).collect();
    let mut samples = [Sample::default(); 512];
    let profile = match form % 3 {
        0 => RadialProfile::gaussians(&gaussians).map(RadialProfile::to_linear),
        1 => RadialProfile::table(&rows).map(|table| table.to_linear().sampled(&mut samples)),
        _ => RadialProfile::burley(rows.first().map_or([1.0; 3], |row| row.1)).map(RadialProfile::to_linear),
    };
    let Ok(profile) = profile else { return };
    // Lengths and curvature as skin has them: a micrometre to a metre, a radius down to a tenth of a millimetre.
    let lengths = |row: &(f64, [f64; 3])| (1e-6..1e6).contains(&row.0) && row.1.iter().all(|&x| x < 1e6);
    if !rows.iter().all(lengths) || form % 3 == 2 && !rows.iter().flat_map(|row| row.1).all(|d| d > 1e-3) {
        return;
    }
    let mut row = [[0.0; 3]; 16];
    profile.ring_row(curvature.abs() % 10.0, &mut row);
    for light in row.as_flattened() {
        assert!((-1e-3..=1.0 + 1e-3).contains(light), "{light} of a light leaves: {row:?}");
    }
});
