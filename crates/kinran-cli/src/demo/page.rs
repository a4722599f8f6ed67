//! The page with everything that the demo made.

use super::Shown;
use crate::compare::{Ranking, footnote};
use crate::page;

/// HTML that shows `materials`, by links relative to its own place.
pub(super) fn page(materials: &[Shown]) -> String {
    let sections: String = materials.iter().map(section).collect();
    let body = format!(
        "<h1>Kinran</h1>
<p>Three materials, painted, baked, rendered and compared by <code>kinran demo</code>. Each is drawn with
textures as an engine loads them: BC5 normals and BC7 lobes, every mip level fitted to what lies under it.</p>
{sections}"
    );
    page::page("Kinran: the demo", &body)
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
        findings.iter().map(|f| format!("<th>RMSE x{0}<th>FLIP x{0}", f.distance)).collect();
    let cell = |filter: &str, error: f64, ranking: &Ranking| {
        let class = if ranking.best == Some(filter) { " class=\"good\"" } else { "" };
        format!("<td{class}>{error:.4}")
    };
    let rows = shown.methods.iter().map(|method| {
        let cells = method.distances.iter().zip(findings).map(|(d, finding)| {
            cell(method.filter, d.rmse, &finding.rmse) + &cell(method.filter, d.flip.into(), &finding.flip)
        });
        format!("<tr><td>{}{}\n", method.filter, cells.collect::<String>())
    });
    let noise = findings.iter().map(|f| format!("<td>{:.4}<td>{:.4}", f.noise.rmse, f.noise.flip));
    let says = findings.iter().map(|finding| format!("<li>{}\n", finding.says));
    format!(
        "<div class=\"scroll\">\n<table>\n<tr><th>filter{headings}\n{}<tr class=\"faint\"><td>noise{}\n</table>\n</div>\n\
         <ul>\n{}</ul>\n<p>{}</p>\n",
        rows.collect::<String>(),
        noise.collect::<String>(),
        says.collect::<String>(),
        footnote(findings)
    )
}
