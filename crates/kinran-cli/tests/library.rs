//! `kinran bake kinran.toml`: libraries of tiny maps, baked, changed, interrupted and shared.

#[allow(dead_code, reason = "shared with the other commands' tests")]
#[path = "commands/common.rs"]
mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use common::{bumps, glb, kinran, text};
use kinran_image::{Channels, Image, Pixels, encode_png};
use serde_json::Value;

/// A library in a folder of its own, with its cache.
struct Library {
    root: tempfile::TempDir,
}

/// A normal map of 8² texels that differs from others by `seed`, 0 to 7.
fn normals(seed: u8) -> Vec<u8> {
    let whole = bumps();
    let samples = (0..64).flat_map(|i| {
        let texel = whole.texel((i % 8 + u32::from(seed) * 3) % 32, (i / 8 + u32::from(seed)) % 32);
        texel.map(|v| (v * 255.0) as u8)[..3].to_vec()
    });
    encode_png(&Image::new(8, 8, Channels::Rgb, Pixels::U8(samples.collect())).unwrap()).unwrap()
}

impl Library {
    /// `count` folders of maps, one model, and a manifest that lists them.
    fn new(count: u8) -> Library {
        let library = Library { root: tempfile::tempdir().unwrap() };
        for seed in 0..count {
            let folder = library.path(&format!("materials/cloth{seed:02}"));
            fs::create_dir_all(&folder).unwrap();
            fs::write(folder.join("normal.png"), normals(seed)).unwrap();
        }
        fs::write(library.path("square.glb"), glb()).unwrap();
        library.describe(
            "[[aniso]]\ninput = \"materials/*\"\n[[mesh]]\ninput = \"*.glb\"\noutput = \"models\"\n",
        );
        library
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root.path().join(name)
    }

    fn describe(&self, entries: &str) {
        fs::write(self.path("kinran.toml"), format!("cache = \"kept\"\n{entries}")).unwrap();
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinran"));
        command.env_remove("KINRAN_CACHE").arg("bake").arg(self.path("kinran.toml")).args(args);
        command
    }

    /// Runs a bake with `--json`; gives the exit code, the report and what was said beside it.
    fn bake(&self, args: &[&str]) -> (Option<i32>, Value, String) {
        let output = self.command(args).arg("--json").output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        let report =
            serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("no JSON ({e}): {said}"));
        (output.status.code(), report, said)
    }

    /// The statuses of a bake that must succeed, by entry.
    fn statuses(&self, args: &[&str]) -> BTreeMap<String, String> {
        let (code, report, said) = self.bake(args);
        assert_eq!(code, Some(0), "{said}");
        statuses(&report)
    }

    /// Every file of the output that is not hidden.
    fn output(&self) -> BTreeMap<String, Vec<u8>> {
        tree(&self.path("baked"))
    }
}

/// A library's environment without a folder for what a user keeps.
fn without_home(command: &mut Command) -> &mut Command {
    ["HOME", "XDG_CACHE_HOME", "LOCALAPPDATA", "KINRAN_CACHE"]
        .into_iter()
        .fold(command, |command, name| command.env_remove(name))
}

/// Writes the square as `square.gltf` with `square.bin` and `square.png` beside it.
fn gltf(folder: &Path) {
    let glb = glb();
    let length = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    let json_length = length(12);
    let mut json: Value = serde_json::from_slice(&glb[20..20 + json_length]).unwrap();
    json["buffers"][0]["uri"] = "square.bin".into();
    json["images"][0] = serde_json::json!({ "uri": "square.png" });
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("square.gltf"), json.to_string()).unwrap();
    fs::write(folder.join("square.bin"), &glb[20 + json_length + 8..]).unwrap();
    fs::write(folder.join("square.png"), encode_png(&bumps()).unwrap()).unwrap();
}

/// Saves a file as editors do: in place, or by a new one that takes its name.
fn save(path: &Path, bytes: &[u8], by_rename: bool) {
    let beside = path.with_extension("saving");
    let to = if by_rename { &beside } else { path };
    fs::write(to, bytes).unwrap();
    if by_rename {
        fs::rename(beside, path).unwrap();
    }
}

fn statuses(report: &Value) -> BTreeMap<String, String> {
    let entries = report["entries"].as_array().unwrap().iter();
    entries.map(|e| (e["name"].as_str().unwrap().into(), e["status"].as_str().unwrap().into())).collect()
}

fn tree(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).into_iter().flatten() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(folder).unwrap().to_str().unwrap().to_owned();
            if name == ".kinran" {
                continue;
            }
            if path.is_dir() {
                folders.push(path)
            } else {
                drop(files.insert(name, fs::read(&path).unwrap()))
            }
        }
    }
    files
}

fn all(statuses: &BTreeMap<String, String>, wanted: &str) -> bool {
    statuses.values().all(|status| status == wanted)
}

#[test]
fn what_has_not_changed_is_baked_again() {
    let library = Library::new(3);
    assert!(all(&library.statuses(&["--dry-run"]), "would-bake"));
    assert!(!library.path("baked").exists() && !library.path("kept").exists(), "a dry run wrote something");

    let first = library.statuses(&[]);
    assert!(first.len() == 4 && all(&first, "baked"), "{first:?}");
    let output = library.output();
    for file in ["cloth00/cloth00_normal.ktx2", "cloth00/cloth00.kinran.json", "models/square/square.glb"] {
        assert!(output.contains_key(file), "{file} is missing from {:?}", output.keys());
    }
    assert!(all(&library.statuses(&[]), "up-to-date"));

    // One input changes, then is saved again as it was.
    let changed = library.path("materials/cloth01/normal.png");
    fs::write(&changed, normals(6)).unwrap();
    let after = library.statuses(&[]);
    assert_eq!(after["materials/cloth01"], "baked", "{after:?}");
    assert_eq!(after.values().filter(|s| *s == "up-to-date").count(), 3, "{after:?}");
    assert_ne!(library.output(), output);
    fs::write(&changed, normals(1)).unwrap();
    assert_eq!(library.statuses(&[])["materials/cloth01"], "restored");
    assert_eq!(library.output(), output);

    // So does a flag, and what it no longer writes goes.
    let entries = "[[aniso]]\ninput = \"materials/*\"\n[[mesh]]\ninput = \"*.glb\"\noutput = \"models\"\n";
    library.describe(&format!("[defaults]\ncontainer = \"dds\"\n{entries}"));
    assert!(all(&library.statuses(&[]), "baked"));
    assert!(!library.output().keys().any(|file| file.ends_with(".ktx2")), "{:?}", library.output().keys());
    library.describe(entries);
    assert!(all(&library.statuses(&[]), "restored"));
    assert_eq!(library.output(), output);
}

#[test]
fn a_note_beside_the_maps_bakes_them_again() {
    let library = Library::new(2);
    // As an archive has them.
    fs::create_dir(library.path("materials/cloth01/textures")).unwrap();
    let inner = library.path("materials/cloth01/textures/normal.png");
    fs::rename(library.path("materials/cloth01/normal.png"), inner).unwrap();
    library.describe("[[aniso]]\ninput = \"materials/*\"\n");
    assert!(all(&library.statuses(&[]), "baked"));
    assert!(
        library.output().keys().any(|file| file.contains("cloth01_normal")),
        "{:?}",
        library.output().keys()
    );
    fs::write(library.path("materials/cloth00/notes.txt"), "mine").unwrap();
    assert!(all(&library.statuses(&[]), "up-to-date"));
}

#[test]
fn lost_files_stay_lost_and_damage_is_copied() {
    let library = Library::new(2);
    library.statuses(&[]);
    let output = library.output();
    fs::remove_file(library.path("baked/cloth00/cloth00_normal.ktx2")).unwrap();
    fs::write(library.path("baked/cloth01/cloth01_normal.ktx2"), "not a texture").unwrap();
    let after = library.statuses(&[]);
    assert_eq!(
        (after["materials/cloth00"].as_str(), after["materials/cloth01"].as_str()),
        ("restored", "restored")
    );
    assert_eq!(library.output(), output);

    // All that was kept is damaged: one byte in every file.
    for entry in fs::read_dir(library.path("kept/entries")).unwrap() {
        let files = entry.unwrap().path().join("files");
        for name in tree(&files).into_keys() {
            let mut bytes = fs::read(files.join(&name)).unwrap();
            bytes[0] ^= 1;
            fs::write(files.join(name), bytes).unwrap();
        }
    }
    fs::remove_dir_all(library.path("baked")).unwrap();
    assert!(all(&library.statuses(&[]), "baked"));
    assert_eq!(library.output(), output);
}

#[test]
fn a_library_holds_other_bytes_than_single_bakes() {
    let library = Library::new(1);
    library.statuses(&["--threads", "3"]);
    let single = library.path("single");
    let folder = library.path("materials/cloth00");
    assert_eq!(kinran(&["bake", text(&folder), "-o", text(&single), "--threads", "1"]).code, Some(0));
    // A sidecar says where the folder is; what a library has baked may lie anywhere.
    let placed = |folder: &Path, source: &str| {
        let mut files = tree(folder);
        let sidecar = files.iter_mut().find(|(name, _)| name.ends_with(".kinran.json")).unwrap().1;
        let text = String::from_utf8(sidecar.clone()).unwrap();
        assert!(text.contains(source), "no {source} in {text}");
        *sidecar = text.replace(source, "").into_bytes();
        files
    };
    let cloth = placed(&single, "  \"source\": \"../materials/cloth00\",\n");
    assert!(
        cloth == placed(&library.path("baked/cloth00"), ""),
        "a library's files are others: {:?}",
        cloth.keys()
    );
    assert_eq!(
        kinran(&["bake", text(&library.path("square.glb")), "-o", text(&library.path("one"))]).code,
        Some(0)
    );
    let model = placed(&library.path("one"), "  \"source\": \"../square.glb\",\n");
    assert!(model == placed(&library.path("baked/models/square"), ""), "others: {:?}", model.keys());
}

#[test]
fn a_failing_entry_stops_the_others() {
    let library = Library::new(3);
    fs::write(library.path("materials/cloth01/normal.png"), "not an image").unwrap();
    library.describe("[[aniso]]\ninput = [\"materials/*\", \"nowhere\"]\n");
    let (code, _, said) = library.bake(&["--dry-run"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("nowhere does not exist") && said.contains("1 of 4 entries failed"), "{said}");
    assert!(!said.contains("are done"), "a plan has done nothing: {said}");
    let (code, report, said) = library.bake(&[]);
    assert_eq!(code, Some(2), "{said}");
    let found = statuses(&report);
    assert_eq!(found["materials/cloth01"], "failed");
    assert_eq!(found["kinran.toml:3:25"], "failed");
    assert_eq!(found.values().filter(|status| *status == "baked").count(), 2, "{found:?}");
    for part in ["materials/cloth01", "normal.png", "nowhere does not exist", "2 of 4 entries failed"] {
        assert!(said.contains(part), "wanted {part:?} in {said}");
    }
    assert!(!library.path("baked/cloth01").exists(), "something of the failed entry was left");

    fs::write(library.path("materials/cloth01/normal.png"), normals(1)).unwrap();
    fs::create_dir(library.path("nowhere")).unwrap();
    fs::write(library.path("nowhere/normal.png"), normals(4)).unwrap();
    let found = library.statuses(&[]);
    assert_eq!(found.values().filter(|status| *status == "baked").count(), 2, "{found:?}");
}

#[test]
fn a_wrong_flag_is_found_while_baking() {
    let library = Library::new(1);
    for (entries, parts) in [
        (
            "[[aniso]]\ninput = \"materials/*\"\nfilter = \"best\"\n",
            ["kinran.toml:4:10: ", "dpd, ml, linear"],
        ),
        ("[[aniso]]\ninput = \"materials/*\"\npreset = 3\n", ["kinran.toml:4:10: ", "fast, normal, best"]),
        (
            "[defaults]\nfilrer = \"ml\"\n[[mesh]]\ninput = \"*.glb\"\n",
            ["kinran.toml:3:1: unknown key `filrer`", "zstd"],
        ),
        ("[[mesh]]\ninput = \"*.glb\"\nall-textures = 1\n", ["kinran.toml:4:1: ", "expected true or false"]),
        (
            "[[mesh]]\ninput = \"*.glb\"\nzstd = true\n",
            ["kinran.toml:4:1: ", "expected a string or a number"],
        ),
        ("[[mesh]]\ninput = \"*.glb\"\nzstd = 99\n", ["kinran.toml:4:8: ", "99 is not from 0 to 22"]),
        (
            "[[mesh]]\ninput = \"*.glb\"\nwatch = true\n",
            ["kinran.toml:4:1: ", "on the command line as --watch"],
        ),
        (
            "[[aniso]]\ninput = \"materials/*\"\ny_down = true\n",
            ["kinran.toml:4:1: unknown key `y_down`", "did you mean `y-down`?"],
        ),
        (
            "[[aniso]]\ninput = \"materials/*\"\n\"--y-down\" = true\n",
            ["kinran.toml:4:1: unknown key `--y-down`", "did you mean `y-down`?"],
        ),
        (
            "[[aniso]]\ninput = \"materials/*\"\ny-up = true\ny-down = true\n",
            ["kinran.toml:3:9: ", "cannot be used with"],
        ),
    ] {
        library.describe(entries);
        let output = library.command(&[]).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{entries:?}: {said}");
        for part in parts.iter().chain(&["error: ", " | ", "^"]) {
            assert!(said.contains(part), "{entries:?}: wanted {part:?} in {said}");
        }
        assert!(!library.path("baked").exists(), "{entries:?}");
    }
    library.describe("[[mesh]]\ninput = \"*.glb\"\n");
    let output = library.command(&["--filter", "linear"]).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("move these flags to its [defaults]"), "{said}");
}

#[test]
fn the_inputs_are_overwritten() {
    let library = Library::new(1);
    let before = tree(&library.path("materials"));
    library.describe("output = \".\"\n[[aniso]]\ninput = \"materials/cloth00\"\noutput = \"materials\"\n");
    // Nothing in the folder is called as what would be written: that is no reason to fail.
    library.statuses(&[]);
    assert!(before.iter().all(|(name, bytes)| tree(&library.path("materials"))[name] == *bytes));

    fs::create_dir(library.path("square")).unwrap();
    fs::rename(library.path("square.glb"), library.path("square/square.glb")).unwrap();
    let model = fs::read(library.path("square/square.glb")).unwrap();
    library.describe("output = \".\"\n[[mesh]]\ninput = \"square/square.glb\"\n");
    let (code, _, said) = library.bake(&[]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("lies among the inputs and would be overwritten"), "{said}");
    assert_eq!(fs::read(library.path("square/square.glb")).unwrap(), model);
}

#[test]
fn a_cache_grows_without_limit() {
    let library = Library::new(4);
    library.statuses(&[]);
    let kept = || fs::read_dir(library.path("kept/entries")).unwrap().count();
    assert_eq!(kept(), 5);
    let cache = library.path("kept");
    let listed = common::kinran_json(&["cache", "--cache", text(&cache)]);
    assert_eq!(listed["entries"].as_array().unwrap().len(), 5);
    let bytes = listed["bytes"].as_u64().unwrap();

    // The limit of the manifest holds after the next run that bakes something.
    let entries = "[[aniso]]\ninput = \"materials/*\"\n[[mesh]]\ninput = \"*.glb\"\noutput = \"models\"\n";
    library.describe(&format!("cache-limit = \"{} B\"\n{entries}", bytes / 2));
    fs::write(library.path("materials/cloth03/normal.png"), normals(7)).unwrap();
    library.statuses(&[]);
    assert!(kept() < 5, "{} entries are kept", kept());
    let newest = common::kinran_json(&["cache", "--cache", text(&cache)]);
    assert_eq!(newest["entries"][0]["name"], "materials/cloth03", "{newest}");
    assert!(newest["bytes"].as_u64().unwrap() <= bytes / 2, "{newest}");
    assert!(all(&library.statuses(&[]), "up-to-date"), "what stands needs no cache");

    let cleaned = common::kinran_json(&["cache", "--cache", text(&cache), "--clean"]);
    assert_eq!((kept(), cleaned["bytes"].as_u64()), (0, Some(0)));
    assert!(cleaned["removed"].as_u64().unwrap() > 0, "{cleaned}");
    assert_eq!(kinran(&["cache", "--cache", text(&library.path("materials"))]).code, Some(2));
}

#[test]
fn processes_that_share_a_library_disturb_each_other() {
    let library = Library::new(6);
    library.statuses(&[]);
    let alone = library.output();
    fs::remove_dir_all(library.path("baked")).unwrap();
    fs::remove_dir_all(library.path("kept")).unwrap();
    let start = || library.command(&["--quiet"]).stderr(Stdio::piped()).spawn().unwrap();
    let together: Vec<Child> = (0..4).map(|_| start()).collect();
    for process in together {
        let output = process.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert_eq!(library.output(), alone);
    assert!(all(&library.statuses(&[]), "up-to-date"));
}

#[test]
fn a_killed_bake_leaves_half_a_file_or_loses_a_whole_one() {
    let library = Library::new(8);
    let started = Instant::now();
    library.statuses(&["--threads", "2"]);
    let undisturbed = started.elapsed();
    let wanted = library.output();
    let wipe = || {
        fs::remove_dir_all(library.path("baked")).unwrap_or_default();
        fs::remove_dir_all(library.path("kept")).unwrap_or_default();
    };
    let finished = || -> Vec<String> {
        let homes = fs::read_dir(library.path("kept/entries")).into_iter().flatten();
        let mut keys: Vec<String> =
            homes.map(|home| home.unwrap().file_name().into_string().unwrap()).collect();
        keys.sort();
        keys
    };

    let (mut state, mut killed, mut between, mut resumed) = (1_u32, 0, 0, 0);
    wipe();
    while killed < 100 {
        let before = finished();
        let mut process =
            library.command(&["--threads", "2"]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        std::thread::sleep(undisturbed.mul_f64(f64::from(state >> 8) / f64::from(1 << 24) * 0.7));
        let done = process.try_wait().unwrap().is_some();
        // SIGKILL, which a process can neither see coming nor survive.
        process.kill().unwrap_or_default();
        process.wait().unwrap();
        killed += u32::from(!done);

        let output = library.output();
        for (name, bytes) in &output {
            assert!(
                wanted.get(name) == Some(bytes),
                "kill {killed}: {name} is not whole or does not belong there"
            );
        }
        let after = finished();
        assert!(before.iter().all(|key| after.contains(key)), "kill {killed}: finished work was lost");
        between += u32::from(!after.is_empty() && after.len() < 9);
        // Now and then go on to the end; what was finished is not baked again.
        if done || after.len() == 9 {
            let last = library.statuses(&[]);
            let baked = last.values().filter(|status| *status == "baked").count();
            assert_eq!(baked, 9 - after.len(), "kill {killed}: {last:?}");
            assert_eq!(library.output(), wanted);
            resumed += 1;
            wipe();
        }
    }
    assert!(between > 10 && resumed > 1, "{between} kills were between entries, {resumed} bakes resumed");

    library.statuses(&[]);
    assert_eq!(library.output(), wanted);
    for folder in ["kept/work", "baked/.kinran/work"] {
        let left: Vec<String> =
            tree(&library.path(folder)).into_keys().filter(|name| name != "gate").collect();
        assert!(left.is_empty(), "{folder} still holds {left:?}");
    }
}

#[test]
fn a_target_is_solved_otherwise_than_by_hand() {
    let library = Library::new(1);
    let image = |name: &str, seed: u8| fs::write(library.path(name), normals(seed)).unwrap();
    fs::create_dir(library.path("tiles")).unwrap();
    for (name, seed) in [("wall.png", 1), ("tiles/brick.png", 2), ("tiles/moss.png", 3), ("mask.png", 4)] {
        image(name, seed);
    }
    library.describe(
        "[defaults]\npreset = \"fast\"\nfilter = \"linear\"\n[tile.brick]\nfile = \"tiles/brick.png\"\nscale = 2\n\
         rotation = 30\n[[detail]]\ninput = \"wall.png\"\noutput = \"walls\"\nkind = \"color\"\nformat = \"bc1\"\nlayer = [\n\
         { tile = \"brick\", rotation = 90 },\n{ tile = \"tiles/moss.png\", mirror = true, mask = \"mask.png\", \
         channel = \"g\" }]\n",
    );
    assert!(all(&library.statuses(&[]), "baked"));
    let by_hand = Command::new(env!("CARGO_BIN_EXE_kinran"))
        .args([
            "detail", "solve", "wall.png", "--kind", "color", "--format", "bc1", "--preset", "fast", "-o",
            "by_hand",
        ])
        .args(["--layer", "tiles/brick.png,scale=2,rotation=90"])
        .args(["--layer", "tiles/moss.png,mirror,mask=mask.png,channel=g"])
        .current_dir(library.root.path())
        .output()
        .unwrap();
    assert!(by_hand.status.success(), "{}", String::from_utf8_lossy(&by_hand.stderr));
    assert_eq!(tree(&library.path("baked/walls/wall")), tree(&library.path("by_hand")));

    assert!(all(&library.statuses(&[]), "up-to-date"));
    image("mask.png", 5);
    assert!(all(&library.statuses(&[]), "baked"));
    image("tiles/brick.png", 6);
    assert!(all(&library.statuses(&[]), "baked"));

    library.describe("[[detail]]\ninput = \"wall.png\"\nlayer = [{ tile = \"a.png\", sclae = 2 }]\n");
    let output = library.command(&[]).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("kinran.toml:4:10: "), "{said}");
    assert!(said.contains("a layer knows no sclae=2"), "{said}");
}

#[test]
fn a_second_run_keeps_doubts_to_itself() {
    let library = Library::new(1);
    for (name, seed) in [("wall_normal.png", 1), ("brick_color.png", 2)] {
        fs::write(library.path(name), normals(seed)).unwrap();
    }
    library.describe("[[detail]]\ninput = \"wall_normal.png\"\nlayer = [{ tile = \"brick_color.png\" }]\n");
    for status in ["baked", "up-to-date"] {
        let (code, report, said) = library.bake(&[]);
        assert_eq!((code, &report["entries"][0]["status"]), (Some(0), &Value::from(status)), "{said}");
        let warnings = &report["entries"][0]["warnings"];
        for part in ["brick_color.png: its name says color", "`kind`"] {
            let told = warnings.as_array().unwrap().iter().any(|w| w.as_str().unwrap().contains(part));
            assert!(told && said.contains(part), "{status}: wanted {part:?} in {warnings} and {said}");
        }
    }
}

#[test]
fn fixes_of_entries_are_words_of_the_command_line_alone() {
    let library = Library::new(1);
    fs::write(library.path("wall.png"), normals(1)).unwrap();
    library.describe("[[detail]]\ninput = \"wall.png\"\nlayer = [{ tile = \"wall.png\" }]\n");
    let (code, report, said) = library.bake(&[]);
    let wanted = "(in the manifest: `kind = \"normal\"` or `kind = \"color\"`)";
    assert!(code == Some(2) && said.contains(wanted), "wanted {wanted} in {said}");
    let message = report["entries"][0]["error"]["message"].as_str().unwrap();
    assert!(message.ends_with(wanted), "wanted {wanted} at the end of {message}");
}

#[test]
fn what_left_the_manifest_stays_unseen_or_takes_changed_files_with_it() {
    let library = Library::new(3);
    assert!(all(&library.statuses(&[]), "baked"));
    fs::remove_dir_all(library.path("materials/cloth01")).unwrap();
    fs::remove_dir_all(library.path("materials/cloth02")).unwrap();
    let names = |report: &Value, key: &str| {
        let folders = report[key].as_array().unwrap().iter();
        folders.map(|folder| folder.as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let (_, report, _) = library.bake(&[]);
    assert_eq!(names(&report, "left_over"), ["cloth01", "cloth02"]);
    let before = library.output();
    let (_, report, _) = library.bake(&["--prune", "--dry-run"]);
    assert_eq!(names(&report, "pruned"), ["cloth01", "cloth02"]);
    assert_eq!(library.output(), before, "--dry-run removed something");

    // What a person changed or added stays.
    let changed = library.path("baked/cloth02/cloth02.kinran.json");
    assert!(changed.exists(), "{:?}", before.keys());
    fs::write(&changed, "mine").unwrap();
    fs::write(library.path("baked/cloth02/notes.txt"), "mine").unwrap();
    let (code, report, said) = library.bake(&["--prune"]);
    assert_eq!(
        (code, names(&report, "pruned")),
        (Some(0), vec!["cloth01".into(), "cloth02".into()]),
        "{said}"
    );
    assert!(!library.path("baked/cloth01").exists());
    let left: Vec<String> = tree(&library.path("baked/cloth02")).into_keys().collect();
    assert_eq!(left, ["cloth02.kinran.json", "notes.txt"]);
    assert!(library.path("baked/cloth00").exists() && library.path("baked/models").exists());
    let (_, report, _) = library.bake(&[]);
    assert!(names(&report, "left_over").is_empty() && names(&report, "pruned").is_empty());

    // While an input is missing, nobody knows which folder is its.
    library.describe("[[aniso]]\ninput = \"materials/cloth09\"\n");
    let (code, report, _) = library.bake(&["--prune"]);
    assert_eq!((code, names(&report, "pruned").len()), (Some(2), 0));
    assert!(library.path("baked/cloth00").exists());
}

#[test]
fn tables_of_skin_differ_from_those_made_by_hand() {
    let library = Library::new(0);
    fs::create_dir(library.path("profiles")).unwrap();
    let profile = r#"{ "gaussians": [ { "variance": 0.2, "weight": [0.5, 0.3, 1] }, { "variance": 1.5, "weight": [0.5, 0.7, 0] } ] }"#;
    fs::write(library.path("profiles/alien.json"), profile).unwrap();
    let manifest = "[defaults]\nsize = \"32x32\"\nfilter = \"linear\"\n[[skin]]\noutput = \"human\"\n\
                    [[skin]]\ninput = \"profiles/*.json\"\nscale = 2\npenumbra = true\n";
    library.describe(manifest);
    assert!(all(&library.statuses(&[]), "baked"));
    let by_hand = |more: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_kinran"))
            .args(["skin-lut", "--size", "32x32", "-o", "by_hand"])
            .args(more)
            .current_dir(library.root.path())
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let files = tree(&library.path("by_hand"));
        fs::remove_dir_all(library.path("by_hand")).unwrap();
        files
    };
    assert_eq!(tree(&library.path("baked/human/skin")), by_hand(&[]));
    let alien = by_hand(&["--profile", "profiles/alien.json", "--scale", "2", "--penumbra"]);
    assert_eq!(tree(&library.path("baked/alien")), alien);

    assert!(all(&library.statuses(&[]), "up-to-date"));
    fs::write(library.path("profiles/alien.json"), profile.replace("1.5", "1.6")).unwrap();
    let statuses = library.statuses(&[]);
    assert_eq!(
        (statuses["skin"].as_str(), statuses["profiles/alien.json"].as_str()),
        ("up-to-date", "baked")
    );
    library.describe("[[skin]]\nburly = \"1,1,1\"\n");
    let said = String::from_utf8(library.command(&[]).output().unwrap().stderr).unwrap();
    assert!(said.contains("kinran.toml:3:1: unknown key `burly`") && said.contains("burley"), "{said}");
}

/// Waits until `done`, at most half a minute.
fn wait(what: &str, done: impl Fn() -> bool) {
    let started = Instant::now();
    while !done() {
        assert!(started.elapsed() < Duration::from_secs(30), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

struct Watching(Child);

impl Drop for Watching {
    fn drop(&mut self) {
        self.0.kill().unwrap_or_default();
        self.0.wait().map(drop).unwrap_or_default();
    }
}

/// What is done there sleeps until an input is saved, and does not wake for its neighbours.
#[cfg(target_os = "linux")]
#[test]
fn a_watch_looks_again_and_again() {
    let library = Library::new(8);
    library.statuses(&[]);
    let watching =
        Watching(library.command(&["--watch"]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    let process = PathBuf::from(format!("/proc/{}", watching.0.id()));
    let each = |folder: &str| -> Vec<String> {
        let entries = fs::read_dir(process.join(folder)).unwrap();
        // What ends meanwhile is no more.
        entries
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter_map(|p| fs::read_to_string(p).ok())
            .collect()
    };
    wait("a watch", || each("fdinfo").iter().any(|text| text.contains("inotify wd")));
    let wakes = || -> u64 {
        let tasks = fs::read_dir(process.join("task")).unwrap();
        let of_task = |path: PathBuf| {
            // The thread that listens hears of neighbours too: other tests make folders in the same one.
            if fs::read_to_string(path.join("comm")).ok()?.starts_with("notify") {
                return None;
            }
            let text = fs::read_to_string(path.join("status")).ok()?;
            let line = text.lines().find(|line| line.starts_with("voluntary_ctxt_switches"))?;
            line.split_whitespace().last()?.parse::<u64>().ok()
        };
        tasks.filter_map(|task| of_task(task.ok()?.path())).sum()
    };
    // Once it has settled, two seconds without a single wake; a look each second would show, and one at each of these.
    wait("rest", || {
        let before = wakes();
        for _ in 0..8 {
            drop(tempfile::tempdir_in(library.root.path().parent().unwrap()).unwrap());
            std::thread::sleep(Duration::from_millis(250));
        }
        wakes() == before
    });
}

#[test]
fn a_saved_input_is_not_noticed() {
    let library = Library::new(1);
    library.statuses(&[]);
    let first = library.output();
    let input = library.path("materials/cloth00/normal.png");
    let told = tempfile::NamedTempFile::new().unwrap();
    let log = told.reopen().unwrap();
    let mut command = library.command(&["--watch"]);
    command.stderr(log.try_clone().unwrap()).stdout(log);
    let _watching = Watching(command.spawn().unwrap());
    let said = || fs::read_to_string(told.path()).unwrap();
    wait("the first look", || said().contains("watching"));
    fs::write(&input, normals(5)).unwrap();
    wait("a changed map", || {
        library.output()["cloth00/cloth00_normal.ktx2"] != first["cloth00/cloth00_normal.ktx2"]
    });
    wait("what was baked, by its name", || {
        said().lines().any(|line| line.contains("cloth00") && line.contains("baked"))
    });
    // A file that is no image for a moment does not end the watch.
    fs::write(&input, "half").unwrap();
    std::thread::sleep(Duration::from_millis(700));
    fs::write(&input, normals(0)).unwrap();
    wait("the old map", || library.output() == first);
    save(&input, &normals(6), true);
    wait("a map that was saved by a rename", || library.output() != first);
    save(&input, &normals(0), true);
    wait("the old map again", || library.output() == first);
    let folder = library.path("materials/cloth01");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("normal.png"), normals(3)).unwrap();
    wait("a new folder", || library.output().contains_key("cloth01/cloth01_normal.ktx2"));
    fs::rename(&folder, library.path("materials/cloth02")).unwrap();
    wait("a renamed folder", || library.output().contains_key("cloth02/cloth02_normal.ktx2"));
    gltf(&library.path("props"));
    let entries = "[[aniso]]\ninput = \"materials/*\"\n[[mesh]]\ninput = \"props/*.gltf\"\n";
    save(&library.path("kinran.toml"), format!("cache = \"kept\"\n{entries}").as_bytes(), true);
    let texture = "square/square_hammered_normal.ktx2";
    wait("a new entry", || library.output().contains_key(texture));
    let before = library.output();
    save(&library.path("props/square.png"), &normals(4), false);
    wait("a model's texture", || library.output()[texture] != before[texture]);
}

/// Inputs are hashed when a run begins and baked when their turn comes, which may be much later.
#[test]
fn a_map_that_is_saved_while_it_waits_is_kept_under_its_old_hash() {
    let library = Library::new(5);
    gltf(&library.path("props"));
    library.describe(
        "[[aniso]]\ninput = \"materials/*\"\n[[mesh]]\ninput = \"props/*.gltf\"\n[[detail]]\ninput = \"wall.png\"\n\
         output = \"walls\"\nkind = \"color\"\nformat = \"bc1\"\nlayer = [{ tile = \"brick.png\", scale = 2 }]\n",
    );
    fs::write(library.path("wall.png"), normals(1)).unwrap();
    let changing = [
        ("materials/cloth04/normal.png", normals(4), normals(7)),
        ("props/square.png", encode_png(&bumps()).unwrap(), normals(3)),
        ("brick.png", normals(2), normals(6)),
    ];
    let all_as_first = || changing.iter().for_each(|(name, a, _)| fs::write(library.path(name), a).unwrap());
    let forget = |folder: &str| fs::remove_dir_all(library.path(folder)).unwrap_or_default();
    all_as_first();
    assert!(all(&library.statuses(&[]), "baked"));
    let wanted = library.output();

    let mut others = 0;
    for round in 0..8 {
        forget("baked");
        forget("kept");
        let mut bake = library.command(&["--jobs", "1", "--quiet"]).stderr(Stdio::null()).spawn().unwrap();
        while bake.try_wait().unwrap().is_none() {
            for second in [true, false] {
                for (name, a, b) in &changing {
                    save(&library.path(name), if second { b } else { a }, round % 2 == 1);
                }
                std::thread::sleep(Duration::from_millis(3));
            }
        }
        others += usize::from(library.output() != wanted);
        all_as_first();
        library.statuses(&[]);
        assert_eq!(library.output(), wanted, "round {round}: the output is not what the inputs say");
        forget("baked");
        library.statuses(&[]);
        assert_eq!(library.output(), wanted, "round {round}: the cache holds something else under a key");
    }
    assert!(others > 0, "no file was ever baked while it was another");
    let left = tree(&library.path("baked/.kinran/work"));
    assert!(left.keys().all(|name| name == "gate"), "copies of inputs were left: {:?}", left.keys());
}

/// Size and time of a file can be set back; the time of its last change of any kind cannot.
#[cfg(unix)]
#[test]
fn an_edit_of_the_same_size_and_time_is_not_noticed() {
    let library = Library::new(0);
    let map = library.path("materials/felt/normal.tga");
    fs::create_dir_all(map.parent().unwrap()).unwrap();
    // Uncompressed, 8 x 8 texels of 24 bits, from the top left.
    let tga = |blue: u8| {
        let header = [0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 8, 0, 8, 0, 24, 0x20];
        [&header[..], &[blue, 128, 128].repeat(64)].concat()
    };
    fs::write(&map, tga(255)).unwrap();
    library.describe("[[aniso]]\ninput = \"materials/*\"\n");
    library.statuses(&[]);
    // Until then nobody trusts the time of a file.
    std::thread::sleep(Duration::from_millis(2100));
    assert!(all(&library.statuses(&[]), "up-to-date"));
    let time = fs::metadata(&map).unwrap().modified().unwrap();
    fs::write(&map, tga(250)).unwrap();
    fs::File::options().write(true).open(&map).unwrap().set_modified(time).unwrap();
    assert!(all(&library.statuses(&[]), "baked"));
}

#[test]
fn cleaning_a_cache_takes_what_is_not_its_own() {
    let library = Library::new(1);
    let put = |name: &str| {
        let path = library.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, "mine").unwrap();
        path
    };
    let key = |digit: &str| digit.repeat(64);
    // Folders that look like a cache from afar.
    let foreign = [
        put("blog/entries/first.md"),
        put(&format!("photos/entries/{}/cat.jpg", key("a"))),
        put("drive/work/gate"),
        put("drive/notes.txt"),
        put("tagged/CACHEDIR.TAG"),
    ];
    for folder in ["blog", "photos", "drive", "tagged"] {
        let path = library.path(folder);
        for args in [vec!["--clean"], vec!["--keep", "1 B"]] {
            let all = [vec!["cache", "--cache", text(&path)], args].concat();
            common::refused(&all, &[folder, "is neither empty nor a cache of kinran"]);
        }
        let output = library.command(&["--cache", text(&path)]).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && said.contains("name another folder"), "{folder}: {said}");
    }
    assert!(foreign.iter().all(|path| path.exists()));

    // A cache into which somebody put other things; and one of an earlier version, which wrote no tag.
    library.statuses(&[]);
    let mine = [
        put("kept/notes.txt"),
        put("kept/entries/notes.txt"),
        put(&format!("kept/entries/{}/cat.jpg", key("b"))),
        put(&format!("kept/entries/{}/entry.json", &key("c")[1..])),
        put("kept/work/mine/half.txt"),
        put("kept/work/kinran-notes/half.txt"),
        put("linked/entry.json"),
    ];
    #[cfg(unix)]
    std::os::unix::fs::symlink(library.path("linked"), library.path(&format!("kept/entries/{}", key("d"))))
        .unwrap();
    let cache = library.path("kept");
    let cleaned = common::kinran_json(&["cache", "--cache", text(&cache), "--clean"]);
    assert_eq!((cleaned["removed"].as_u64(), cleaned["entries"].as_array().unwrap().len()), (Some(2), 0));
    fs::remove_dir_all(library.path("baked")).unwrap();
    library.statuses(&[]);
    assert!(mine.iter().all(|path| path.exists()), "{:?}", mine.iter().find(|path| !path.exists()));

    let earlier = library.path("earlier");
    library.statuses(&["--cache", text(&earlier), "-o", text(&library.path("other"))]);
    fs::remove_file(earlier.join("CACHEDIR.TAG")).unwrap();
    let cleaned = common::kinran_json(&["cache", "--cache", text(&earlier), "--clean"]);
    assert_eq!(cleaned["removed"], 2);
}

#[test]
fn a_library_bakes_its_own_results() {
    let library = Library::new(1);
    let model = fs::read(library.path("square.glb")).unwrap();
    fs::write(library.path("wall.png"), normals(1)).unwrap();
    fs::write(library.path("brick.png"), normals(2)).unwrap();
    let entries = "[[mesh]]\ninput = \"**/*.glb\"\noutput = \"models\"\n[[aniso]]\ninput = \"*/*\"\n\
                   [[detail]]\ninput = \"wall.png\"\nboard = true\nkind = \"color\"\nformat = \"bc1\"\n\
                   layer = [{ tile = \"brick.png\" }]\n";
    library.describe(entries);
    let first = library.statuses(&[]);
    let names: Vec<&str> = first.keys().map(String::as_str).collect();
    assert_eq!(names, ["materials/cloth00", "square.glb", "wall.png"]);
    let output = library.output();
    for run in 0..2 {
        let next = library.statuses(&[]);
        assert!(next.len() == 3 && all(&next, "up-to-date"), "run {run}: {next:?}");
        assert_eq!(library.output(), output, "run {run}");
    }
    // Nor those of another output or cache that lie about, also where nothing tells whose they were.
    let next =
        library.statuses(&["-o", text(&library.path("again")), "--cache", text(&library.path("store"))]);
    assert_eq!(next.len(), 3, "{next:?}");
    fs::remove_dir_all(library.path("baked/.kinran")).unwrap();
    assert_eq!(library.statuses(&[]).len(), 3);
    assert_eq!(fs::read(library.path("square.glb")).unwrap(), model);

    // An output that holds the manifest cannot be left out as a whole.
    let library = Library::new(1);
    library.describe("output = \".\"\n[[mesh]]\ninput = \"**/*.glb\"\n");
    let first = library.statuses(&[]);
    assert!(library.path("square/square.glb").exists());
    assert_eq!(library.statuses(&[]).keys().collect::<Vec<_>>(), first.keys().collect::<Vec<_>>());
}

#[cfg(target_os = "linux")]
#[test]
fn a_cache_that_cannot_be_used_stops_a_bake() {
    let library = Library::new(2);
    library.statuses(&[]);
    let wanted = library.output();
    let entries = "[[aniso]]\ninput = \"materials/*\"\n[[mesh]]\ninput = \"*.glb\"\noutput = \"models\"\n";
    fs::write(library.path("kinran.toml"), entries).unwrap();
    // No home, and a place where nobody can make a folder.
    for args in [&[][..], &["--cache", "/proc/kinran"]] {
        fs::remove_dir_all(library.path("baked")).unwrap();
        let output = without_home(&mut library.command(args)).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{args:?}: {said}");
        let warnings = said.lines().filter(|line| line.contains("kept")).count();
        assert_eq!(warnings, 1, "{args:?}: {said}");
        assert_eq!(library.output(), wanted, "{args:?}");
    }
    let output = without_home(Command::new(env!("CARGO_BIN_EXE_kinran")).arg("cache")).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Another build of the same version has other bytes, and finds what this one has baked.
#[cfg(target_os = "linux")]
#[test]
fn another_build_of_the_program_bakes_everything_again() {
    let library = Library::new(1);
    library.statuses(&[]);
    let mut program = fs::read(env!("CARGO_BIN_EXE_kinran")).unwrap();
    // What follows the program in its file is not read.
    program.extend(b"another build");
    let other = library.path("other_kinran");
    fs::write(&other, program).unwrap();
    fs::set_permissions(&other, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    let bake = || {
        let manifest = library.path("kinran.toml");
        let output = Command::new(&other).args(["bake", text(&manifest), "--json"]).output().unwrap();
        statuses(&serde_json::from_slice(&output.stdout).unwrap())
    };
    assert!(all(&bake(), "up-to-date"));
    fs::remove_dir_all(library.path("baked")).unwrap();
    assert!(all(&bake(), "restored"));
}

/// BLAKE3 of all textures of a small library that the portable encoder makes, for `BYTES_VERSION` 11.
const GOLDEN: &str = "2aee0f0f882a8ac700863921bb63dae9a510e117bfbbe5b49565c818f457ed66";

/// Keys do not hold the program, only its version and `BYTES_VERSION`: other bytes under an old key would come out of
/// old caches as they were.
#[test]
fn the_same_version_bakes_other_bytes_under_the_same_keys() {
    let library = Library::new(2);
    fs::write(library.path("wall.png"), normals(1)).unwrap();
    fs::write(library.path("brick.png"), normals(2)).unwrap();
    library.describe(
        "[[aniso]]\ninput = \"materials/*\"\nencoder = \"portable\"\nform = \"both\"\n[[mesh]]\ninput = \"*.glb\"\n\
         encoder = \"portable\"\n[[detail]]\ninput = \"wall.png\"\nkind = \"color\"\nformat = \"bc1\"\n\
         layer = [{ tile = \"brick.png\" }]\n[[skin]]\nsize = \"32x32\"\n",
    );
    library.statuses(&[]);
    let mut hasher = blake3::Hasher::new();
    for (name, bytes) in library.output() {
        // Degrees in reports may differ in the last digit between systems.
        if name.ends_with(".ktx2") {
            hasher.update(name.as_bytes()).update(&bytes);
        }
    }
    assert_eq!(
        hasher.finalize().to_hex().as_str(),
        GOLDEN,
        "the bytes changed: raise BYTES_VERSION in crates/kinran-cli/src/bake/library/inputs.rs and put the hash on the \
         left here"
    );
}

#[test]
fn a_failure_hides_among_rows_of_success() {
    let library = Library::new(3);
    fs::write(library.path("materials/cloth01/normal.png"), "not an image").unwrap();
    let output = library.command(&[]).output().unwrap();
    let (out, err) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert_eq!(out.lines().count(), 1, "{out}");
    assert!(out.contains("3 baked") && out.contains("1 failed"), "{out}");
    let last: Vec<&str> = err.lines().rev().take(2).collect();
    assert!(
        last[0].contains("1 of 4 entries failed") && last[1].starts_with("error: materials/cloth01: "),
        "{err}"
    );
    // It names the file as the manifest does, not the copy that was baked.
    assert!(last[1].contains("materials/cloth01/normal.png") && !last[1].contains("work"), "{err}");
    fs::remove_dir_all(library.path("baked")).unwrap();
    let output = library.command(&["--verbose"]).output().unwrap();
    let out = String::from_utf8(output.stdout).unwrap();
    assert!(out.contains("materials/cloth02") && out.lines().count() == 4, "{out}");
}

/// Names of temporary files in a folder.
fn temporary(folder: &Path) -> Vec<String> {
    let files = tree(folder).into_keys();
    files.filter(|name| name.contains(".kinran-")).collect()
}

#[cfg(unix)]
#[test]
fn an_interrupted_bake_leaves_temporary_files() {
    let library = Library::new(1);
    let (input, output) = (library.path("square.glb"), library.path("single"));
    let bake = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinran"));
        command.args(["bake", text(&input), "-o", text(&output), "--quiet"]);
        command.stderr(Stdio::null()).spawn().unwrap()
    };
    let started = Instant::now();
    bake().wait().unwrap();
    let undisturbed = started.elapsed();
    let mut interrupted = 0;
    for i in 0..30 {
        fs::remove_dir_all(&output).unwrap_or_default();
        let mut process = bake();
        std::thread::sleep(undisturbed.mul_f64(f64::from(i) / 30.0));
        Command::new("kill").args(["-INT", &process.id().to_string()]).status().unwrap();
        let code = process.wait().unwrap().code();
        // Before it has said what to do at Ctrl-C there is nothing to remove.
        assert!(matches!(code, Some(0 | 130) | None), "{code:?}");
        interrupted += u32::from(code == Some(130));
        let is_empty = |folder: &Path| fs::read_dir(folder).is_ok_and(|mut files| files.next().is_none());
        assert!(!is_empty(&output), "an empty folder after interruption {i}");
        assert_eq!(temporary(&output), Vec::<String>::new(), "after interruption {i}");
    }
    assert!(interrupted > 5, "{interrupted} of 30 were interrupted");

    fs::remove_dir_all(&output).unwrap_or_default();
    bake().wait().unwrap();

    // What a dead process has left goes; what somebody is at work on, or has called so, stays.
    let dead = output.join(".kinran-0123456789abcdef.part");
    let living = output.join(".kinran-fedcba9876543210.part");
    let mine = [".kinran-backup", ".kinran-AbCdEf", ".kinran-mine.part", ".kinran-0123456789abcdef"];
    for path in mine.iter().map(|name| output.join(name)).chain([dead.clone(), living.clone()]) {
        fs::write(path, "").unwrap();
    }
    let lock = fs::File::options().write(true).open(&living).unwrap();
    lock.lock().unwrap();
    bake().wait().unwrap();
    assert!(!dead.exists() && living.exists());
    assert!(mine.iter().all(|name| output.join(name).exists()));
    drop(lock);
    bake().wait().unwrap();
    assert!(!living.exists());
}
