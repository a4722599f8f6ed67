//! Polar plots of the phase functions, as the talk shows them.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write;

use glam::{Vec3, vec3};
use kinran_bake::fuzz_fit::FuzzFit;
use kinran_shading::fuzz::{fibre_direction, fibre_phase, fuzz_alpha, velvet_k, velvet_phase};

/// Side of a panel in pixels.
const PANEL: f64 = 260.0;
/// Pixels of the longest curve.
const RADIUS: f64 = 96.0;
/// Curves of a panel, from dark to light.
const COLORS: [&str; 5] = ["#1b1464", "#1f6fb4", "#13a37f", "#e0a11b", "#d94f2a"];

/// What a curve is drawn for; radians.
#[derive(Clone, Copy)]
struct Case {
    spread: f32,
    tilt: f32,
    view: f32,
    azimuth: f32,
}

/// A panel: its title, and each curve's label and case.
type Panel = (&'static str, Vec<(String, Case)>);

/// A phase function for light from `u`, view along `v` and fibres along `t`.
type Phase = dyn Fn(Case, Vec3, Vec3, Vec3) -> f32;

/// Two rows, velvet and fibres, of four panels: what is varied over what is asked for. A curve's distance from the
/// centre is the phase function for light from there, in the plane of normal and fibre, over its largest value
/// in the plane; the view is a line, the fibres a bar.
pub(super) fn phase_plots(fit: &FuzzFit) -> String {
    let base =
        Case { spread: fit.spread, tilt: fit.tilt.to_radians(), view: 30f32.to_radians(), azimuth: 0.0 };
    let degrees = |list: [f32; 5], case: fn(Case, f32) -> Case| -> Vec<(String, Case)> {
        list.into_iter().map(|d| (format!("{d}°"), case(base, d.to_radians()))).collect()
    };
    let spreads = [0.05, 0.2, 0.4, 0.7, 0.95];
    let of_spread = |name: fn(f32) -> String| -> Vec<(String, Case)> {
        spreads.into_iter().map(|spread| (name(spread), Case { spread, ..base })).collect()
    };
    let others = || -> [Panel; 3] {
        [
            ("fibre polar angle", degrees([0.0, 22.5, 45.0, 67.5, 90.0], |c, tilt| Case { tilt, ..c })),
            ("view polar angle", degrees([0.0, 20.0, 40.0, 60.0, 80.0], |c, view| Case { view, ..c })),
            ("view azimuth", degrees([0.0, 45.0, 90.0, 135.0, 180.0], |c, azimuth| Case { azimuth, ..c })),
        ]
    };
    let velvet =
        |c: Case, u: Vec3, v: Vec3, t: Vec3| velvet_phase(u.dot(v), t.dot(u), t.dot(v), velvet_k(c.spread));
    let fibre =
        |c: Case, u: Vec3, v: Vec3, t: Vec3| fibre_phase(u.dot(v), t.dot(u), t.dot(v), fuzz_alpha(c.spread));

    let (width, height) = (4.0 * PANEL, 2.0 * PANEL + 60.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
        font-family=\"sans-serif\" font-size=\"16\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let rows: [(&str, Vec<Panel>, &Phase); 2] = [
        (
            "Velvet (Schlick)",
            [("Schlick k", of_spread(|s| format!("{:.2}", velvet_k(s))))]
                .into_iter()
                .chain(others())
                .collect(),
            &velvet,
        ),
        (
            "SGGX fibres",
            [("alpha", of_spread(|s| format!("{:.2}", fuzz_alpha(s))))].into_iter().chain(others()).collect(),
            &fibre,
        ),
    ];
    for (row, (name, panels, phase)) in rows.into_iter().enumerate() {
        let top = 30.0 + row as f64 * (PANEL + 15.0);
        let subtitle = format!("fibres {}°, spread {}, view 30° unless varied", fit.tilt, fit.spread);
        text(&mut svg, 12.0, top - 10.0, "#000", &format!("{name}: {subtitle}; normalised amplitude"));
        for (column, (title, curves)) in panels.into_iter().enumerate() {
            let centre = (PANEL * (column as f64 + 0.5), top + 12.0 + RADIUS + 12.0);
            text(&mut svg, centre.0 - RADIUS, top + 10.0, "#000", &format!("vary {title}"));
            grid(&mut svg, centre);
            for (i, (label, case)) in curves.iter().enumerate() {
                curve(&mut svg, centre, COLORS[i], |u| {
                    let v = fibre_direction(case.view, case.azimuth);
                    phase(*case, u, v, fibre_direction(case.tilt, 0.0))
                });
                let x = centre.0 - RADIUS - 14.0 + 48.0 * i as f64;
                text(&mut svg, x, top + 12.0 + 2.0 * RADIUS + 32.0, COLORS[i], label);
            }
            marks(&mut svg, centre, &curves);
        }
    }
    svg + "</svg>\n"
}

fn text(svg: &mut String, x: f64, y: f64, color: &str, words: &str) {
    writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"{color}\">{words}</text>").expect("strings grow");
}

fn line(svg: &mut String, from: (f64, f64), to: (f64, f64), style: &str) {
    let ((x1, y1), (x2, y2)) = (from, to);
    writeln!(svg, "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}/>")
        .expect("strings grow");
}

/// Circles, and the horizon.
fn grid(svg: &mut String, (x, y): (f64, f64)) {
    for share in [0.5, 1.0] {
        let r = share * RADIUS;
        writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\" fill=\"none\" stroke=\"#ddd\"/>")
            .expect("strings grow");
    }
    line(svg, (x - RADIUS, y), (x + RADIUS, y), "stroke=\"#bbb\"");
}

/// A point at an angle from the normal towards +x.
fn place((x, y): (f64, f64), angle: f64, r: f64) -> (f64, f64) {
    (x + r * libm::sin(angle), y - r * libm::cos(angle))
}

fn curve(svg: &mut String, centre: (f64, f64), color: &str, phase: impl Fn(Vec3) -> f32) {
    // A degree off the direction opposite to the view, where single precision has no half vector.
    const STEPS: usize = 180;
    let angle = |i: usize| TAU * (i as f64 + 0.5) / STEPS as f64 - PI;
    let values: Vec<f64> = (0..STEPS)
        .map(|i| phase(vec3(libm::sin(angle(i)) as f32, 0.0, libm::cos(angle(i)) as f32)).into())
        .collect();
    let largest = values.iter().fold(0.0, |a: f64, &b| a.max(b));
    let points: Vec<String> = (values.iter().enumerate())
        .map(|(i, value)| place(centre, angle(i), RADIUS * value / largest))
        .map(|(x, y)| format!("{x:.1},{y:.1}"))
        .collect();
    writeln!(
        svg,
        "<polygon points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.4\"/>",
        points.join(" ")
    )
    .expect("strings grow");
}

/// Views as dashed lines and fibres as bars, those that are varied in their curves' colours.
fn marks(svg: &mut String, centre: (f64, f64), curves: &[(String, Case)]) {
    let varies = |f: fn(&Case) -> f32| curves.iter().any(|(_, c)| f(c) != f(&curves[0].1));
    let (views, tilts) = (varies(|c| c.view) || varies(|c| c.azimuth), varies(|c| c.tilt));
    for (i, (_, case)) in curves.iter().enumerate() {
        let first = i == 0;
        if views || first {
            // In the plane only as far as it lies there.
            let x = libm::sin(case.view.into()) * libm::cos(case.azimuth.into());
            let angle = libm::atan2(x, libm::cos(case.view.into()));
            let color = if views { COLORS[i] } else { "#555" };
            let end = place(centre, angle, RADIUS + 8.0);
            line(
                svg,
                centre,
                end,
                &format!("stroke=\"{color}\" stroke-dasharray=\"3 3\" stroke-width=\"0.8\""),
            );
        }
        if tilts || first {
            let color = if tilts { COLORS[i] } else { "#555" };
            let tilt = f64::from(case.tilt).min(FRAC_PI_2);
            let (from, to) = (place(centre, tilt, -12.0), place(centre, tilt, 12.0));
            line(svg, from, to, &format!("stroke=\"{color}\" stroke-width=\"3\" stroke-linecap=\"round\""));
        }
    }
}
