//! `kinran demo`, quick.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use kinran_image::read_image;

#[path = "commands/shape.rs"]
mod shape;

const MATERIALS: [&str; 3] = ["brocade", "twill", "brushed_disc"];

/// Every file below `folder` by its path in it.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().replace('\\', "/");
                files.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    files
}

fn demo(folder: &Path, threads: &str, json: bool) -> BTreeMap<String, Vec<u8>> {
    let output = Command::new(env!("CARGO_BIN_EXE_kinran"))
        .args(["demo", "--quick", "--threads", threads, "-o"])
        .arg(folder)
        .args(json.then_some("--json"))
        .output()
        .unwrap();
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {words}", output.status);
    let said = String::from_utf8(output.stdout).unwrap();
    if json {
        let summary: serde_json::Value = serde_json::from_str(&said).unwrap();
        shape::valid("demo", &summary);
        assert_eq!(summary["materials"].as_array().map(Vec::len), Some(MATERIALS.len()), "{summary}");
        assert_eq!(summary["page"], "index.html");
    } else {
        let page = folder.join("index.html").display().to_string();
        assert!(said.contains(&page), "the page's place is not told: {said}");
    }
    contents(folder)
}

/// Mean and standard deviation of a picture's channels, 0 to 1.
fn spread(path: &Path) -> (f32, f32) {
    let image = read_image(path).unwrap();
    let places = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
    let values: Vec<f32> =
        places.flat_map(|(x, y)| image.texel(x, y).into_iter().take(3).collect::<Vec<_>>()).collect();
    let mean = values.iter().sum::<f32>() / values.len() as f32;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / values.len() as f32;
    (mean, variance.sqrt())
}

#[test]
fn everything_is_there_shows_something_and_is_the_same_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let first = demo(&folder.path().join("one"), "1", false);
    let second = demo(&folder.path().join("two"), "2", true);
    assert!(first.keys().eq(second.keys()), "{:?} and {:?}", first.keys(), second.keys());
    for (name, bytes) in &first {
        assert!(*bytes == second[name], "{name} differs between one and two threads");
    }

    // All that the page links to exists.
    let page = String::from_utf8(first["index.html"].clone()).unwrap();
    let links: Vec<&str> = page
        .split("src=\"")
        .chain(page.split("href=\""))
        .filter_map(|rest| rest.split_once('"').map(|(link, _)| link))
        .filter(|link| !link.contains(['<', '\n']))
        .collect();
    assert!(links.len() > 40, "the page has only {} links", links.len());
    for link in links {
        assert!(first.contains_key(link), "the page links to {link}, which is not there");
    }

    for material in MATERIALS {
        for map in ["baseColor", "normal", "glossU", "glossV", "direction", "metallic"] {
            let name = format!("materials/{material}/{material}_{map}.png");
            assert!(first.contains_key(&name), "no {name}");
        }
        for map in ["normal", "aniso", "color"] {
            let name = format!("baked/{material}/{material}_{map}.ktx2");
            assert!(first.contains_key(&name), "no {name}");
        }

        let pictures = [
            format!("{material}.png"),
            format!("compare/{material}/truth_x1.png"),
            format!("compare/{material}/ml_x1.png"),
            format!("compare/{material}/naive_x2.png"),
        ];
        for picture in &pictures {
            let (mean, deviation) = spread(&folder.path().join("one").join(picture));
            assert!((0.05..0.9).contains(&mean) && deviation > 0.05, "{picture}: {mean} ± {deviation}");
        }

        let numbers = &first[&format!("compare/{material}/compare.json")];
        let numbers: serde_json::Value = serde_json::from_slice(numbers).unwrap();
        let rmse = |filter: &str| {
            let method = numbers["methods"].as_array().unwrap().iter().find(|m| m["filter"] == filter);
            method.unwrap()["distances"][0]["rmse"].as_f64().unwrap()
        };
        let (ml, naive) = (rmse("ml"), rmse("naive"));
        assert!(ml > 0.0 && ml <= naive, "{material}: ml is off by {ml}, naive by {naive}");
    }
}

#[test]
fn a_file_in_the_way_is_one_error_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let taken = folder.path().join("taken");
    std::fs::write(&taken, "mine").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_kinran"))
        .args(["demo", "--quick", "-o"])
        .arg(&taken)
        .output()
        .unwrap();
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(words.contains("taken") && words.lines().count() == 1, "{words}");
    assert_eq!(std::fs::read_to_string(&taken).unwrap(), "mine");
}
