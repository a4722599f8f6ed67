//! The page with everything that the demo made.

use super::Shown;

/// Colours and lengths are chosen by eye.
const STYLE: &str = "
:root { color-scheme: dark; --paper: #15161a; --ink: #e9e7e1; --faint: #9a9aa2; --gold: #d9b46a; --line: #2b2d34; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 17px/1.6 Georgia, 'Times New Roman', serif; }
main { max-width: 1280px; margin: 0 auto; padding: 3rem 1.5rem 5rem; }
h1 { font-weight: normal; font-size: 2.6rem; letter-spacing: .04em; margin: 0; }
h2 { font-weight: normal; font-size: 1.7rem; letter-spacing: .02em; margin: 5rem 0 .3rem; color: var(--gold); }
p { max-width: 44rem; margin: .4rem 0 1.4rem; color: var(--faint); }
img { display: block; max-width: 100%; height: auto; border-radius: 3px; }
a { color: var(--gold); text-decoration: none; } a:hover { text-decoration: underline; }
figure { margin: 0 0 1.6rem; } figcaption { color: var(--faint); font-size: .9rem; margin-top: .4rem; }
.maps { display: grid; grid-template-columns: repeat(auto-fill, minmax(150px, 1fr)); gap: .8rem; margin: 0 0 1.6rem; }
.maps img { aspect-ratio: 1; object-fit: cover; width: 100%; }
.maps figure { margin: 0; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font: 14px/1.5 ui-monospace, 'DejaVu Sans Mono', monospace; margin: 0 0 1.6rem; }
th, td { text-align: right; padding: .25rem .9rem; border-bottom: 1px solid var(--line); font-weight: normal; }
th { color: var(--faint); } th:first-child, td:first-child { text-align: left; padding-left: 0; }
td.best { color: #7ed38a; }
pre { background: #0e0f12; border: 1px solid var(--line); border-radius: 3px; padding: .9rem 1.1rem; overflow-x: auto;
  font: 13px/1.6 ui-monospace, 'DejaVu Sans Mono', monospace; margin: 0 0 1.6rem; }
";

/// HTML that shows `materials`, by links relative to its own place.
pub(super) fn page(materials: &[Shown]) -> String {
    let sections: String = materials.iter().map(section).collect();
    format!(
        "<!doctype html>
<html lang=\"en\">
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width\">
<title>Kinran: the demo</title>
<style>{STYLE}</style>
<main>
<h1>Kinran</h1>
<p>Three materials, painted, baked, rendered and compared by <code>kinran demo</code>. Each is drawn with
textures as an engine loads them: BC5 normals and BC7 lobes, every mip level fitted to what lies under it.</p>
{sections}</main>
</html>
"
    )
}

fn section(shown: &Shown) -> String {
    let (title, description) = (shown.subject.title(), shown.subject.description());
    let figure = |file: &str, caption: &str| {
        format!(
            "<figure><a href=\"{file}\"><img src=\"{file}\" alt=\"{title}: {caption}\" loading=\"lazy\"></a>\
             <figcaption>{caption}</figcaption></figure>\n"
        )
    };
    let file_name = |path: &str| path.rsplit('/').next().unwrap_or(path).to_owned();
    let maps: String = shown.maps.iter().map(|map| figure(map, &file_name(map))).collect();
    let links = |paths: &[String]| {
        let link = |path: &String| format!("<a href=\"{path}\">{}</a>", file_name(path));
        paths.iter().map(link).collect::<Vec<_>>().join(", ")
    };
    format!(
        "<h2 id=\"{}\">{title}</h2>\n<p>{description}</p>\n{}<div class=\"maps\">\n{maps}</div>\n\
         <p>Baked: {}. Model: {}.</p>\n{}{}<div class=\"scroll\">\n{}</div>\n<pre>{}</pre>\n",
        shown.material,
        figure(&shown.picture, "rendered with the baked maps, filter ml"),
        links(&shown.textures),
        links(std::slice::from_ref(&shown.model)),
        figure(&shown.comparison, "filters beside ground truth"),
        figure(&shown.distance, "the same from farther and farther away, enlarged"),
        numbers(shown),
        shown.commands.join("\n"),
    )
}

/// Errors of each filter at each distance, the least of a column marked.
fn numbers(shown: &Shown) -> String {
    let distances = &shown.methods[0].distances;
    let headings: String =
        distances.iter().map(|d| format!("<th>RMSE x{0}<th>FLIP x{0}", d.distance)).collect();
    let errors = |method: usize, column: usize| {
        let difference = &shown.methods[method].distances[column];
        [difference.rmse, f64::from(difference.flip)]
    };
    let cell = |method: usize, column: usize, kind: usize| {
        let error = errors(method, column)[kind];
        let best = (0..shown.methods.len()).all(|other| error <= errors(other, column)[kind]);
        format!("<td{}>{error:.4}", if best { " class=\"best\"" } else { "" })
    };
    let row = |method: usize| {
        let cells = (0..distances.len()).flat_map(|column| [0, 1].map(|kind| cell(method, column, kind)));
        format!("<tr><td>{}{}\n", shown.methods[method].filter, cells.collect::<String>())
    };
    let rows: String = (0..shown.methods.len()).map(row).collect();
    format!("<table>\n<tr><th>filter{headings}\n{rows}</table>\n")
}
