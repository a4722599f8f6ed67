//! Every shader function against its Rust twin, on a real Vulkan device (Mesa's lavapipe will do).
//!
//! Each function is called with ten thousand inputs: all combinations of the edges of its arguments first, random ones
//! after. The shader that calls it is written from the function's own signature.

#![allow(clippy::print_stderr, reason = "a skipped test says so, and how near each tolerance is")]

mod cases;
mod device;
mod signature;

use std::collections::BTreeSet;
use std::iter::zip;
use std::path::PathBuf;

use cases::{Case, cases};
use device::Device;
use signature::Signature;

/// Inputs per function.
const INPUTS: usize = 10_000;

/// The device, or `None` after saying so. `KINRAN_REQUIRE_GPU=1` makes its absence a failure.
fn device() -> Option<Device> {
    let device = Device::open();
    if device.is_none() {
        assert!(
            std::env::var_os("KINRAN_REQUIRE_GPU").is_none(),
            "there is no Vulkan device; install mesa-vulkan-drivers"
        );
        eprintln!("SKIPPED: there is no Vulkan device; install mesa-vulkan-drivers");
    }
    device
}

/// The largest difference between shader and twin, as a multiple of what the case allows, and a message about it.
fn worst_difference(case: &Case, inputs: &[Vec<f32>], outputs: &[Vec<f32>]) -> (f32, String) {
    let mut worst = (0.0, String::new());
    for (input, shader) in zip(inputs, outputs) {
        let twin = (case.canonical)(input, &(case.twin)(input));
        let shader = (case.canonical)(input, shader);
        assert_eq!(twin.len(), shader.len(), "{}: the twin returns another shape", case.function);
        for (component, (&want, &got)) in zip(&twin, &shader).enumerate() {
            if want.to_bits() == got.to_bits() && want.is_finite() {
                continue;
            }
            let allowed = case.absolute + case.relative * want.abs();
            let excess = (want - got).abs() / allowed;
            // No number is the worst there is, on both sides too.
            let excess = if excess.is_finite() { excess } else { f32::INFINITY };
            if excess > worst.0 {
                let message = format!(
                    "{}, component {component}: wanted {want:e}, got {got:e}, allowed ±{allowed:e} ({}), input {input:?}",
                    case.function, case.reason
                );
                worst = (excess, message);
            }
        }
    }
    worst
}

#[test]
fn shader_functions_say_what_their_rust_twins_say() {
    let Some(device) = device() else { return };
    let library = kinran_shaders::wgsl::ALL;
    let signatures = Signature::all(library);
    let mut failures = Vec::new();
    for case in cases() {
        let signature = &signatures[case.function];
        let inputs = case.inputs(INPUTS);
        assert_eq!(inputs[0].len(), signature.inputs(), "{}: arguments", case.function);
        let outputs = device.call(library, signature, &inputs);
        let (excess, message) = worst_difference(&case, &inputs, &outputs);
        eprintln!("{:<28} {excess:.3} of the tolerance", case.function);
        if excess > 1.0 {
            failures.push(message);
        }
    }
    assert!(failures.is_empty(), "{} functions differ:\n{}", failures.len(), failures.join("\n"));
}

/// A black or white pixel is what a shader makes of no number. At the ends of the ranges that the docs state are the
/// quotients that have one: the horizon, a density of zero, opposite directions.
#[test]
fn a_function_returns_no_number_at_the_ends_of_its_range() {
    let device = device();
    let library = kinran_shaders::wgsl::ALL;
    let signatures = Signature::all(library);
    let mut failures = Vec::new();
    for case in cases() {
        let corners = case.corners();
        let twin: Vec<_> = corners.iter().map(|input| (case.twin)(input)).collect();
        let shader = device.as_ref().map(|device| device.call(library, &signatures[case.function], &corners));
        for (language, outputs) in [("Rust", Some(twin)), ("WGSL", shader)] {
            let Some(outputs) = outputs else { continue };
            let bad = zip(&corners, &outputs).filter(|(_, output)| output.iter().any(|x| !x.is_finite()));
            if let Some((input, output)) = bad.clone().next() {
                let count = bad.count();
                failures.push(format!(
                    "{} in {language}: wanted numbers, got {output:?} at {input:?}, and at {} more of {} corners",
                    case.function,
                    count - 1,
                    corners.len()
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{} functions are not finite:\n{}", failures.len(), failures.join("\n"));
}

/// A test that finds nothing proves nothing: the same harness must notice one part in ten thousand.
#[test]
fn the_harness_notices_a_twin_that_is_off_by_a_ten_thousandth() {
    let Some(device) = device() else { return };
    let library = kinran_shaders::wgsl::ALL;
    let case = cases().into_iter().find(|case| case.function == "ggx_aniso_d").unwrap();
    let signatures = Signature::all(library);
    let inputs = case.inputs(INPUTS);
    let outputs = device.call(library, &signatures[case.function], &inputs);
    let (excess, message) = worst_difference(&case, &inputs, &outputs);
    assert!(excess <= 1.0, "{message}");
    let off: Vec<Vec<f32>> = outputs.iter().map(|o| o.iter().map(|x| x * 1.0001).collect()).collect();
    let (excess, _) = worst_difference(&case, &inputs, &off);
    assert!(excess > 1.0, "a factor of 1.0001 went unnoticed: {excess} of the tolerance");
}

#[test]
fn no_shader_function_is_without_a_parity_test() {
    let tested: BTreeSet<String> = cases().iter().map(|case| case.function.to_owned()).collect();
    let there: BTreeSet<String> = Signature::all(kinran_shaders::wgsl::ALL).into_keys().collect();
    assert_eq!(there.difference(&tested).collect::<Vec<_>>(), Vec::<&String>::new(), "have no parity test");
    assert_eq!(
        tested.difference(&there).collect::<Vec<_>>(),
        Vec::<&String>::new(),
        "are no shader functions"
    );
}

/// The shader library is the formulas' second language: what is public in one is there in the other.
#[test]
fn no_rust_function_is_without_a_shader_twin() {
    // Only the baker asks for these: quadrature points of the maximum-likelihood fit, and what solves for detail maps,
    // where columns of skin's table stand.
    const BAKER_ONLY: [&str; 11] = [
        "microfacet_basis",
        "overlay_inverse",
        "overlay_slope",
        "smooth_overlay_inverse",
        "smooth_overlay_inverse_start",
        "smooth_overlay_inverse_step",
        "smooth_overlay_inverse_end",
        "smooth_overlay_slope",
        "rnm_inverse",
        "detail_over_inverse",
        "column_n_u",
    ];
    let shaders = Signature::all(kinran_shaders::wgsl::ALL);
    let mut found = 0;
    let mut folders = vec![PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../kinran-shading/src"))];
    while let Some(folder) = folders.pop() {
        for file in std::fs::read_dir(folder).unwrap() {
            let path = file.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            for line in std::fs::read_to_string(&path).unwrap().lines() {
                let Some(rest) = line.strip_prefix("pub fn ") else { continue };
                let name = rest.split('(').next().unwrap();
                found += 1;
                assert!(
                    shaders.contains_key(name) || BAKER_ONLY.contains(&name),
                    "{}: {name} has no shader twin",
                    path.display()
                );
            }
        }
    }
    assert!(found > 95, "only {found} functions were found");
}
