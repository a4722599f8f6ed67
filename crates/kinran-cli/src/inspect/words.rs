//! What was found in a file, for people.

use kinran::inspect::{
    Factors, ImageReport, LENGTH_TOLERANCE, MapReport, ModelReport, NamedFile, Range, RuntimeReport, State,
    Statistics, TextureReport, WrittenReport,
};

use crate::outputs::bytes_text;
use crate::table::{list, table};
use crate::values::counted;

pub(super) fn texture(report: &TextureReport) -> String {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let mut facts = vec![
        row("file", format!("{}, {}", report.file, bytes_text(report.file_bytes))),
        row(
            "format",
            match report.transfer.as_str() {
                "unsaid" => format!("{}; whether it is sRGB is not said", report.format),
                said => format!("{}, {said}", report.format),
            },
        ),
        row(
            "size",
            format!(
                "{}x{}, {}, {}",
                report.width,
                report.height,
                counted(report.levels.len(), "level", "levels"),
                bytes_text(report.texture_bytes)
            ),
        ),
        row("map", report.role.name().into()),
    ];
    facts.extend(report.metadata.iter().map(|(key, value)| row(key, value.clone())));

    let names =
        ["level", "size", "bytes"].into_iter().chain(headings(&report.levels[0].statistics).iter().copied());
    let mut rows = vec![names.map(str::to_owned).collect()];
    rows.extend(report.levels.iter().enumerate().map(|(i, level)| {
        let mut cells =
            vec![i.to_string(), format!("{}x{}", level.width, level.height), bytes_text(level.bytes)];
        cells.extend(numbers(&level.statistics));
        cells
    }));
    format!("{}\n{}{}", list(&facts), table(&rows), legend(&report.levels[0].statistics))
}

/// Headings of [`numbers`].
fn headings(statistics: &Statistics) -> &'static [&'static str] {
    match statistics {
        Statistics::Normal { .. } => &["length", "tilt min", "mean", "max deg", "outside %"],
        Statistics::Aniso { .. } => {
            &["alpha_t min", "mean", "max", "alpha_b min", "mean", "max", "spread deg"]
        }
        Statistics::Roughness { .. } => &["roughness min", "mean", "max"],
        Statistics::Anisotropy { .. } => &["strength min", "mean", "max", "spread deg"],
        Statistics::Channels { .. } => &[
            "red min",
            "mean",
            "max",
            "green min",
            "mean",
            "max",
            "blue min",
            "mean",
            "max",
            "alpha min",
            "mean",
            "max",
        ],
    }
}

/// What of the headings needs words; empty where they say it.
fn legend(statistics: &Statistics) -> &'static str {
    match statistics {
        Statistics::Normal { .. } => {
            "length: of the mean of all normals, 1 where they are one; tilt: their angle from flat; outside: texels whose \
             x and y alone are longer than 1\n"
        }
        Statistics::Aniso { .. } => {
            "alpha_t, alpha_b: GGX roughness along and across the direction; spread: of directions, 40.5 where there is \
             none in particular\n"
        }
        Statistics::Anisotropy { .. } => "spread: of directions, 40.5 where there is none in particular\n",
        Statistics::Roughness { .. } | Statistics::Channels { .. } => "",
    }
}

/// A level's numbers as text.
fn numbers(statistics: &Statistics) -> Vec<String> {
    let spread = |degrees: Option<f32>| degrees.map_or("-".into(), |d| format!("{d:.2}"));
    match *statistics {
        Statistics::Normal { average_length, tilt_degrees: tilt, outside_share } => vec![
            format!("{average_length:.4}"),
            format!("{:.2}", tilt.min),
            format!("{:.2}", tilt.mean),
            format!("{:.2}", tilt.max),
            format!("{:.2}", outside_share * 100.0),
        ],
        Statistics::Aniso { alpha_t, alpha_b, direction_spread_degrees } => {
            [&cells(alpha_t)[..], &cells(alpha_b), &[spread(direction_spread_degrees)]].concat()
        }
        Statistics::Roughness { roughness } => cells(roughness).to_vec(),
        Statistics::Anisotropy { strength, direction_spread_degrees } => {
            [&cells(strength)[..], &[spread(direction_spread_degrees)]].concat()
        }
        Statistics::Channels { red, green, blue, alpha } => {
            [cells(red), cells(green), cells(blue), cells(alpha)].concat()
        }
    }
}

/// Minimum, mean and maximum as cells.
fn cells(range: Range) -> [String; 3] {
    [range.min, range.mean, range.max].map(|v| format!("{v:.4}"))
}

pub(super) fn model(report: &ModelReport) -> String {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let or_none = |values: &[String]| if values.is_empty() { "none".into() } else { values.join(", ") };
    let mut facts = vec![
        row("file", report.file.clone()),
        row(
            "triangles",
            format!("{} in {}", report.triangles, counted(report.instances, "instance", "instances")),
        ),
        row("extensions", or_none(&report.extensions_used)),
    ];
    if !report.extensions_required.is_empty() {
        facts.push(row("required", or_none(&report.extensions_required)));
    }
    if !report.lights.is_empty() {
        facts.push(row("lights", report.lights.join(", ")));
    }
    facts.extend(report.cameras.iter().enumerate().map(|(i, camera)| {
        let [x, y, z] = camera.position;
        row(&format!("camera {i}"), format!("at {x:.3}, {y:.3}, {z:.3}, {:.1} degrees", camera.yfov_degrees))
    }));
    facts.extend(report.warnings.iter().map(|warning| row("warning", warning.clone())));

    let headings = ["primitive", "triangles", "vertices", "instances", "UV sets", "material"];
    let mut primitives = vec![headings.map(str::to_owned).to_vec()];
    primitives.extend(report.primitives.iter().enumerate().map(|(i, p)| {
        let numbers = [i, p.triangles, p.vertices, p.instances, p.uv_sets].map(|n| n.to_string());
        [&numbers[..], std::slice::from_ref(&p.material)].concat()
    }));

    let mut text = format!("{}\n{}", list(&facts), list(&primitives));
    for m in &report.materials {
        let mut rows = vec![row("  bake", m.bake.clone()), row("  factors", factors(&m.factors))];
        let sides = if m.double_sided { ", double-sided" } else { "" };
        match (m.alpha, m.alpha_cutoff) {
            (alpha, Some(cutoff)) => {
                rows.push(row("  alpha", format!("{alpha} below {}{sides}", short(cutoff))))
            }
            ("opaque", None) if !m.double_sided => {}
            (alpha, None) => rows.push(row("  alpha", format!("{alpha}{sides}"))),
        }
        rows.extend(m.maps.iter().map(|map| {
            let MapReport { slot, width, height, channels, bits, uv_set, runtime } = map;
            let levels = runtime.as_ref().map_or_else(String::new, mips);
            let text = format!("{width}x{height}, {channels} x {bits} bits, UV set {uv_set}{levels}");
            row(&format!("  {slot}"), text)
        }));
        if !m.ignored_extensions.is_empty() {
            rows.push(row("  ignored", m.ignored_extensions.join(", ")));
        }
        text += &format!("\nmaterial {}\n{}", m.name, list(&rows));
    }
    text
}

/// Factors in words; those of normals and emission where they say something.
fn factors(factors: &Factors) -> String {
    let list = |values: &[f32]| values.iter().copied().map(short).collect::<Vec<_>>().join(" ");
    let mut text = format!(
        "base colour {}, metalness {}, roughness {}",
        list(&factors.base_color),
        short(factors.metallic),
        short(factors.roughness)
    );
    if factors.normal_scale != 1.0 {
        text += &format!(", normal scale {}", short(factors.normal_scale));
    }
    if factors.emissive != [0.0; 3] {
        text += &format!(", emission {}", list(&factors.emissive));
    }
    text
}

/// A factor, at most three digits behind the point.
fn short(value: f32) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn mips(runtime: &RuntimeReport) -> String {
    let file = runtime.file.as_deref().unwrap_or("the file");
    let filter = runtime.filter.as_ref().map_or_else(String::new, |filter| format!(", filter {filter}"));
    let levels = counted(runtime.levels, "level", "levels");
    format!("; mips in {file}: {}, {levels}{filter}", runtime.format)
}

pub(super) fn image(report: &ImageReport) -> String {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let kind = if report.float { "floats" } else { "integers" };
    let mut facts = vec![
        row("file", report.file.clone()),
        row("size", format!("{}x{}", report.width, report.height)),
        row(
            "samples",
            format!(
                "{} of {}-bit {kind}",
                counted(report.channels.len(), "channel", "channels"),
                report.bits
            ),
        ),
    ];
    let color = match report.transfer.as_str() {
        "unsaid" => "sRGB, if it is colour",
        "srgb" => "sRGB, as the file says",
        _ => "linear",
    };
    facts.push(row("colour", color.into()));
    facts.extend(report.notes.iter().map(|note| row("note", note.clone())));
    if let Some(normals) = &report.normal_map {
        let percent = |share: f32| format!("{:.2} %", share * 100.0);
        facts.push(row(
            "normals",
            format!(
                "{} of texels are more than {LENGTH_TOLERANCE} off unit length, {} point below the surface",
                percent(normals.not_unit_share),
                percent(normals.below_share)
            ),
        ));
    }
    let mut rows = vec![["channel", "min", "mean", "max"].map(str::to_owned).to_vec()];
    rows.extend(report.channels.iter().map(|channel| {
        let [min, mean, max] = cells(channel.range);
        vec![channel.name.to_owned(), min, mean, max]
    }));
    format!("{}\n{}", list(&facts), table(&rows))
}

pub(super) fn written(report: &WrittenReport) -> String {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let mut facts = vec![
        row("file", report.file.clone()),
        row("kind", format!("{}, by `{}`", report.kind, report.written_by)),
    ];
    facts.extend(report.members.iter().map(|m| row(&m.name.replace('_', " "), m.value.clone())));
    facts.extend(report.warnings.iter().map(|warning| row("warning", warning.clone())));
    let mut text = list(&facts);
    if !report.written.is_empty() {
        let row = |f: &NamedFile, of: &str| {
            vec![f.file.clone(), bytes_text(f.bytes as u64), format!("{}{of}", now(f.state))]
        };
        let written = report.written.iter().map(|f| row(f, ""));
        let kept = report.kept.iter().map(|f| row(f, ", by an earlier run with other flags"));
        text += &format!("\n{}", list(&written.chain(kept).collect::<Vec<_>>()));
    }
    text
}

fn now(state: State) -> &'static str {
    match state {
        State::AsWritten => "as written",
        State::Changed => "changed since",
        State::Missing => "missing",
    }
}
