//! The library's report as a page.

use kinran::detail::{PICTURES, StudyMean, StudyReport, StudyRow, picture_file};
use kinran_bake::detail::ERROR_GAIN;

use crate::page::level_words;

/// A mean as a row of cells.
pub(super) fn cells(mean: &StudyMean) -> [String; 13] {
    [
        mean.map.clone(),
        mean.format.clone(),
        mean.against.name().into(),
        format!("{:.2}", mean.opacity),
        level_words(mean.level as u32),
        mean.count.to_string(),
        format!("{:.3}", mean.target),
        format!("{:.3} ({:+.1} %)", mean.blended, 100.0 * (mean.blended / mean.target - 1.0)),
        format!("{:.3}", mean.talk),
        format!("{:.3}", mean.plain_overlay),
        format!("{:.3}", mean.uncompensated),
        format!("{} of {}", mean.no_worse, mean.count),
        mean.magnified.map_or(String::new(), |[blended, talk]| format!("{blended:.3} ({talk:.3})")),
    ]
}

/// HTML with the means, and for each target its numbers and pictures.
pub(super) fn page(report: &StudyReport, pictures: bool) -> String {
    let head = [
        "map",
        "format",
        "tiles",
        "opacity",
        "level",
        "count",
        "target alone",
        "blended",
        "the talk's",
        "plain overlay",
        "uncompensated",
        "no worse",
        "magnified (the talk's)",
    ];
    let head: String = head.iter().map(|name| format!("<th>{name}")).collect();
    let means: String = report
        .means
        .iter()
        .map(|mean| {
            let class = if mean.blended <= mean.target { "good" } else { "bad" };
            let cells: String = cells(mean)
                .iter()
                .enumerate()
                .map(
                    |(i, cell)| {
                        if i == 7 { format!("<td class=\"{class}\">{cell}") } else { format!("<td>{cell}") }
                    },
                )
                .collect();
            format!("<tr>{cells}\n")
        })
        .collect();
    let map_of = |row: &StudyRow| (row.material.clone(), row.map.clone());
    let sections: String = report
        .rows
        .iter()
        .enumerate()
        .map(|(i, row)| {
            let before = || report.rows[..i].iter().filter(|other| map_of(other) == map_of(row));
            // Pictures are of the first format.
            let pictures = pictures && before().all(|other| other.against != row.against);
            section(row, before().next().is_none(), pictures)
        })
        .collect();
    let size = report.size;
    let body = format!(
        "<h1>Detail maps</h1>
<p>Targets of {size} x {size} texels, painted over tiled materials and solved. Errors are root mean squares in steps of 8
bits, for normals in degrees, at half size and as
authored. \"own\": against the tiles the target was painted over;
\"other\": against the nearest tile of another material; \"faded\": against that at the largest opacity with which the result is
no worse than the compressed target. \"Magnified\": the size as authored drawn twice as large, against the exact solution over the tiles
as authored. Error pictures are {ERROR_GAIN} times enlarged.</p>
<div class=\"scroll\">
<table>
<tr>{head}
{means}</table>
</div>
{sections}"
    );
    crate::page::page("Kinran: detail maps", &body)
}

fn section(row: &StudyRow, first: bool, pictures: bool) -> String {
    let which = row.against.name();
    let heading = if first { format!("<h2>{}, {}</h2>\n", row.material, row.map) } else { String::new() };
    let errors = row.comparison.levels.get(1).unwrap_or(&row.comparison.levels[0]);
    let saved = 100.0 * (1.0 - row.comparison.synthesized_bytes as f64 / row.comparison.unique_bytes as f64);
    let words = format!(
        "<p>{}, {which} tiles ({}): target alone {:.3}, blended {:.3}, the talk's {:.3}, plain overlay {:.3}, uncompensated \
         {:.3}. Synthesized {} bytes + shared {}; a unique map as fine as the tiles {} ({saved:.0} % saved beside the \
         shared).</p>\n",
        row.format,
        row.tiles.join(", "),
        errors.target,
        errors.blended,
        errors.talk,
        errors.plain_overlay,
        errors.uncompensated,
        row.comparison.synthesized_bytes,
        row.comparison.shared_bytes,
        row.comparison.unique_bytes,
    );
    let images: String = if pictures {
        PICTURES
            .iter()
            .map(|name| {
                let file = picture_file(&row.material, &row.map, which, name);
                format!("<figure><img src=\"pictures/{file}\" alt=\"{name}\" loading=\"lazy\"><figcaption>{name}</figcaption></figure>")
            })
            .collect()
    } else {
        String::new()
    };
    format!("{heading}{words}<div class=\"maps\">{images}</div>\n")
}
