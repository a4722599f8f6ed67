//! Curvature of a torus of a million triangles, regular and with vertices moved by up to 30 % of a cell.
//!
//! Run with `cargo bench -p kinran-bake --bench curvature`; `KINRAN_TRIANGLES` sets another number. Each row is the fastest
//! of five runs on one thread, welding and normals included. The torus is as large as a head (radii 100 and 40 mm)
//! and vertices lie half a millimetre apart. Errors are in units of the curvature of a torus of radii 1 and 0.4.
#![allow(clippy::print_stdout, reason = "the table is the result")]

#[path = "../tests/shapes/mod.rs"]
mod shapes;

use std::hint::black_box;
use std::time::Instant;

use kinran_bake::curvature::{Mesh, Method, Options, bake_curvature, principal};
use kinran_bake::skin_lut::{Profile, ambient_table, punctual_table};
use kinran_image::untold;
use kinran_shading::skin::profile::RadialProfile;
use shapes::torus;

/// Millimetres of the larger radius.
const SIZE: f64 = 100.0;

fn main() {
    let triangles: usize =
        std::env::var("KINRAN_TRIANGLES").ok().and_then(|s| s.parse().ok()).unwrap_or(1_000_000);
    let rows = ((triangles / 4) as f64).sqrt() as usize;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");

    println!(
        "{:34} {:>8} {:>8} {:>9} {:>9} {:>9} {:>10}",
        "", "s", "Mtri/s", "median", "99 %", "largest", "bytes/vtx"
    );
    for jitter in [0.0, 0.3] {
        let shape = torus((2 * rows, rows), SIZE, 0.4 * SIZE, jitter);
        let given = Some(shape.normals.as_slice());
        let name = if jitter > 0.0 { "irregular" } else { "regular" };
        let blur = kinran_bake::curvature::BLUR.to_vec();
        for (what, normals, method, blur) in [
            ("normals given", given, Method::Normals, Vec::new()),
            ("normals estimated", None, Method::Normals, Vec::new()),
            ("normals given, blurred", given, Method::Normals, blur.clone()),
            ("fit", None, Method::Fit, Vec::new()),
            ("fit, blurred", None, Method::Fit, blur),
        ] {
            let mesh =
                Mesh { positions: &shape.positions, normals, tangents: None, triangles: &shape.triangles };
            let options = Options { method, millimetres: 1.0, clamp: !blur.is_empty(), blur };
            let before = resident("VmRSS:");
            let mut fastest = f64::INFINITY;
            let mut baked = None;
            reset_peak();
            for _ in 0..5 {
                let start = Instant::now();
                baked =
                    Some(pool.install(|| bake_curvature(&mesh, &options, &untold).expect("a sound mesh")));
                fastest = fastest.min(start.elapsed().as_secs_f64());
            }
            let peak = resident("VmHWM:").saturating_sub(before) as f64 / shape.positions.len() as f64;
            let baked = black_box(baked).expect("five runs");
            let mut errors: Vec<f64> = baked
                .tensors
                .iter()
                .zip(&shape.curvatures)
                .map(|(tensor, (t1, t2))| {
                    let (k1, k2, _) = principal(*tensor);
                    SIZE * (f64::from(k1) - t1).abs().max((f64::from(k2) - t2).abs())
                })
                .collect();
            errors.sort_by(f64::total_cmp);
            let at = |q: f64| errors[((errors.len() - 1) as f64 * q) as usize];
            let errors = if options.blur.is_empty() {
                format!("{:9.5} {:9.5} {:9.5}", at(0.5), at(0.99), at(1.0))
            } else {
                format!("{:29}", "")
            };
            println!(
                "{:34} {fastest:8.3} {:8.2} {errors} {peak:10.0}",
                format!("{name}, {what}"),
                shape.triangles.len() as f64 / fastest / 1e6,
            );
        }
    }

    println!("\ntables, 512 x 512 RGB, one thread, ms");
    let skin = RadialProfile::skin();
    let rows = (0..400).map(|i| 19.0 * f64::from(i) / 399.0).map(|r| (r, skin.density(r))).collect();
    for (name, profile) in [
        ("six Gaussians", Profile::default()),
        ("Burley", Profile::Burley([0.9, 0.4, 0.2])),
        ("400 rows", Profile::Table(rows)),
    ] {
        let radial = profile.radial().expect("a profile");
        let mut fastest = f64::INFINITY;
        for _ in 0..5 {
            let start = Instant::now();
            pool.install(|| {
                black_box(punctual_table(radial, 512, 512, 0.5, &untold).expect("not stopped"));
                black_box(ambient_table(radial, 512, 0.5));
            });
            fastest = fastest.min(start.elapsed().as_secs_f64());
        }
        println!("{name:34} {:8.1}", 1e3 * fastest);
    }
}

/// A line of the process's status in bytes; 0 where the system has none.
fn resident(line: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kib =
        status.lines().find_map(|l| l.strip_prefix(line)?.split_whitespace().next()?.parse::<u64>().ok());
    kib.unwrap_or(0) * 1024
}

/// Lets the peak begin anew at what is resident now.
fn reset_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}
