//! The page with everything that the demo made.

use super::Shown;
use crate::compare::{Noise, Ranking, footnote, picture_file};
use crate::page;

/// HTML that shows `materials`, by links relative to its own place.
pub(super) fn page(materials: &[Shown]) -> String {
    let sections: String = materials.iter().map(section).collect();
    let body = format!(
        "<h1>Kinran</h1>
<p>Three materials, painted, baked, rendered and compared by <code>kinran demo</code>. Each is drawn with
textures as an engine loads them: BC5 normals and BC7 lobes, every mip level fitted to what lies under it.</p>
{}{sections}",
        gain(&materials[0])
    );
    page::page("Kinran: the demo", &body)
}

/// What filtering colour, metal and lobe together gains: the farthest pictures of what mixes them side by side.
fn gain(shown: &Shown) -> String {
    let last = shown.findings.len() - 1;
    let distance = shown.findings[last].distance;
    let cell = |name: &str, words: &str| {
        let file = shown.comparison.replace("compare.png", &picture_file(name, distance));
        let method = shown.methods.iter().find(|method| method.filter == name);
        let error = method.map_or(String::new(), |m| format!(", RMSE {:.4}", m.distances[last].rmse));
        format!(
            "<figure><a href=\"{file}\"><img class=\"pixels\" src=\"{file}\" alt=\"{words}\"></a>\
             <figcaption>{words}{error}</figcaption></figure>\n"
        )
    };
    let cells = [
        ("naive", "maps averaged as colours"),
        ("ml-apart", "lobes fitted, each map by itself"),
        ("ml", "colour, metal and lobe together"),
        ("truth", "ground truth"),
    ];
    format!(
        "<h2>From {distance} times as far</h2>\n<p>{}, enlarged pixel by pixel: gold keeps its light where its colour, its \
         metal and its lobe are filtered together.</p>\n<div class=\"maps\">\n{}</div>\n",
        shown.subject.title(),
        cells.map(|(name, words)| cell(name, words)).concat()
    )
}

fn section(shown: &Shown) -> String {
    let (title, description) = (shown.subject.title(), shown.subject.description());
    let linked = |file: &str, caption: &str| {
        format!("<a href=\"{file}\"><img src=\"{file}\" alt=\"{title}: {caption}\" loading=\"lazy\"></a>")
    };
    let captioned =
        |shown: &str, caption: &str| format!("<figure>{shown}<figcaption>{caption}</figcaption></figure>\n");
    let figure = |file: &str, caption: &str| captioned(&linked(file, caption), caption);
    let sheet = |file: &str, caption: &str| {
        captioned(&format!("<div class=\"scroll sheet\">{}</div>", linked(file, caption)), caption)
    };
    let file_name = |path: &str| path.rsplit('/').next().unwrap_or(path).to_owned();
    let maps: String = shown.maps.iter().map(|map| figure(map, &file_name(map))).collect();
    let links = |paths: &[String]| {
        let link = |path: &String| format!("<a href=\"{path}\">{}</a>", file_name(path));
        paths.iter().map(link).collect::<Vec<_>>().join(", ")
    };
    format!(
        "<h2 id=\"{}\">{title}</h2>\n<p>{description}</p>\n{}<div class=\"maps\">\n{maps}</div>\n\
         <p>Baked: {}. Model: {}.</p>\n{}{}{}<pre>{}</pre>\n",
        shown.material,
        figure(&shown.picture, "rendered with the baked maps, filter ml"),
        links(&shown.textures),
        links(std::slice::from_ref(&shown.model)),
        sheet(&shown.comparison, "filters beside ground truth"),
        sheet(&shown.distance, "the same from farther and farther away, enlarged"),
        numbers(shown),
        shown.commands.join("\n"),
    )
}

/// Errors of each filter at each distance, those marked that are known to be the least, and what they show.
fn numbers(shown: &Shown) -> String {
    let findings = &shown.findings;
    let headings: String =
        findings.iter().map(|f| format!("<th>RMSE x{0}<th>L2<th>FLIP", f.distance)).collect();
    let cell = |filter: &str, error: f64, ranking: &Ranking| {
        let class = if ranking.best == Some(filter) { " class=\"good\"" } else { "" };
        format!("<td{class}>{error:.4}")
    };
    let rows = shown.methods.iter().map(|method| {
        let cells = method.distances.iter().zip(findings).map(|(d, finding)| {
            let errors = [d.rmse, d.l2, d.flip.into()].into_iter().zip(finding.rankings());
            errors.map(|(error, ranking)| cell(method.filter, error, ranking)).collect::<String>()
        });
        format!("<tr><td>{}{}\n", method.filter, cells.collect::<String>())
    });
    let noise = findings.iter().map(|f| f.noise);
    let noise = noise.map(|Noise { rmse, l2, flip }| format!("<td>{rmse:.4}<td>{l2:.4}<td>{flip:.4}"));
    let budgets = shown.methods.iter().flat_map(|method| &method.budget);
    let says = findings.iter().map(|finding| &finding.says).chain(budgets.map(|budget| &budget.says));
    let says = says.map(|says| format!("<li>{says}\n"));
    format!(
        "<div class=\"scroll\">\n<table>\n<tr><th>filter{headings}\n{}<tr class=\"faint\"><td>noise{}\n</table>\n</div>\n\
         <ul>\n{}</ul>\n<p>{}</p>\n",
        rows.collect::<String>(),
        noise.collect::<String>(),
        says.collect::<String>(),
        footnote(findings)
    )
}
