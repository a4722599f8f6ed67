//! The page about cost, and what has grown.

use serde_json::Value;

use crate::{Error, FAMILIES, harness};

/// Reports every count of instructions in `now` that is above the one in `allowed`, or has none there, and entries of
/// `allowed` that are gone.
pub(crate) fn compare(place: &str, now: &Value, allowed: &Value, over: &mut Vec<String>) {
    let Some(entries) = now.as_object() else { return };
    for (name, value) in entries {
        let place = format!("{place}, {name}");
        if name == "instructions" {
            match (value.as_f64(), allowed[name].as_f64()) {
                (Some(now), Some(allowed)) if now <= allowed => {}
                (Some(now), Some(allowed)) => over.push(format!("{place}: {now}, allowed {allowed}")),
                _ => over.push(format!("{place}: has no budget")),
            }
        } else {
            compare(&place, value, &allowed[name], over);
        }
    }
    for name in allowed.as_object().into_iter().flat_map(|allowed| allowed.keys()) {
        if !entries.contains_key(name) {
            over.push(format!("{place}, {name}: is in the budget and no longer there"));
        }
    }
}

/// A number as it is, without a fraction where it has none.
fn number(value: &Value) -> Result<String, Error> {
    Ok(value.as_f64().ok_or("the budget lacks a number")?.to_string())
}

/// The page.
pub(crate) fn page(budget: &Value) -> Result<String, Error> {
    let mut page = include_str!("page_head.md").to_owned();
    for (family, title, _) in FAMILIES {
        let measured = &budget["families"][family];
        if measured.is_null() {
            page += &format!("\n## {title}\n\nNot measured: its driver was not at hand.\n");
            continue;
        }
        let driver = measured["driver"].as_str().unwrap_or_default();
        page += &format!(
            "\n## {title}\n\n`{family}`, {driver}, waves of {}.\n\n\
            | | instructions a light | cycles a light | instructions a pixel | cycles a pixel | registers |\n\
            | --- | ---: | ---: | ---: | ---: | ---: |\n",
            number(&measured["wave"])?
        );
        for row in harness::rows() {
            let cost = &measured["rows"][row.id];
            let cells = [
                number(&cost["light"]["instructions"])?,
                number(&cost["light"]["cycles"])?,
                number(&cost["pixel"]["instructions"])?,
                number(&cost["pixel"]["cycles"])?,
                number(&cost["vgprs"])?,
            ];
            page += &format!("| {} | {} |\n", row.title, cells.join(" | "));
        }
        let of =
            |row: &str, per: &str| measured["rows"][row][per]["cycles"].as_f64().ok_or("a row is missing");
        let saved = of("aniso_decode", "pixel")? - of("ggx_matrix", "pixel")?;
        let paid = of("ggx_matrix", "light")? - of("aniso_decode", "light")?;
        page += &format!(
            "\nThe matrix form saves {saved} cycles a pixel and pays {paid} a light: it is the cheaper one up to {} lights.\n",
            (saved / paid).floor()
        );
    }

    page += "\n## Functions alone, on GCN\n\n| function | instructions | of them at a quarter of the rate |\n| --- | ---: | ---: |\n";
    for (name, cost) in budget["functions"].as_object().ok_or("the budget has no functions")? {
        let one_round = if cost["loops"] == true { ", one round of its loop" } else { "" };
        page += &format!("| `{name}`{one_round} | {} | {} |\n", cost["instructions"], cost["quarter_rate"]);
    }
    Ok(page)
}
