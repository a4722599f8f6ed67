//! What a `kinran.toml` may say, and how it is told what it may not.

use std::fs;
use std::path::{Path, PathBuf};

use kinran_bake::manifest::{Job, Kind, Manifest, SettingValue, size};

fn refused(text: &str) -> (usize, usize, String, String) {
    match Manifest::parse(Path::new("lib/kinran.toml"), text.into()) {
        Ok(manifest) => panic!("{text:?} was understood: {manifest:?}"),
        Err(e) => (e.line, e.column, e.message, e.snippet),
    }
}

/// A library of three folders and two models, with nothing in them.
fn library() -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    for folder in ["materials/twill", "materials/steel", "materials/.hidden", "materials/wip_felt", "models"]
    {
        fs::create_dir_all(root.path().join(folder)).unwrap();
    }
    for file in ["models/lamp.glb", "models/helmet.gltf", "models/notes.txt"] {
        fs::write(root.path().join(file), "").unwrap();
    }
    root
}

fn jobs(root: &Path, text: &str) -> Vec<Result<Job, String>> {
    let manifest = Manifest::parse(&root.join("kinran.toml"), text.into()).unwrap();
    manifest.jobs(&|_| false).into_iter().map(|job| job.map_err(|e| e.to_string())).collect()
}

fn names(jobs: &[Result<Job, String>]) -> Vec<&str> {
    jobs.iter().map(|job| job.as_ref().unwrap().name.as_str()).collect()
}

#[test]
fn a_mistake_is_told_without_its_place_or_what_was_expected() {
    let mesh = "[[mesh]]\ninput = \"a.glb\"\n";
    for (text, line, column, expected) in [
        ("output = \n", 1, 10, "this is not TOML"),
        ("[[aniso]\n", 1, 9, "this is not TOML"),
        ("ouput = \"x\"\n", 1, 1, "unknown key `ouput`; did you mean `output`? expected output, cache"),
        ("# héllo\noutput = 3\n", 2, 10, "expected a string, found an integer"),
        ("cache-limit = \"much\"\n", 1, 15, "much is no size; write a number and a unit, such as 10 GiB"),
        ("cache-limit = \"20\"\n", 1, 15, "20 is no size; write a number and a unit, such as 10 GiB"),
        ("[aniso]\ninput = \"a\"\n", 1, 1, "expected [[aniso]] with two brackets"),
        ("[[aniso]]\nfilter = \"ml\"\n", 1, 1, "this entry has no `input`; expected a folder of maps"),
        ("[[aniso]]\ninput = [\"a\", 7]\n", 2, 15, "expected a string, found an integer"),
        ("[[aniso]]\ninput = \"\"\n", 2, 9, "this is empty; expected a path"),
        ("[[aniso]]\ninput = \"a\"\noutput = \"../b\"\n", 3, 10, "leads out of the library's output"),
        (
            "[[aniso]]\ninput = \"a\"\nzstd = { level = 3 }\n",
            3,
            8,
            "expected a string, a number, true, false",
        ),
        ("[[aniso]]\ninput = \"a\"\nexclude = \"a[\"\n", 3, 11, "a[ is no pattern"),
        ("defaults = 1\n[[mesh]]\ninput = \"a.glb\"\n", 1, 12, "expected a table, found an integer"),
        ("[tile.a]\nscale = 2\n", 1, 7, "this tile has no `file`"),
        ("[[detail]]\ninput = \"a\"\nlayer = [{ scale = 2 }]\n", 3, 10, "this layer has no `tile`"),
        ("[[detail]]\ninput = \"a\"\nlayer = [{ tile = \"a,b\" }]\n", 3, 19, "a comma cannot stand here"),
        ("[[detail]]\ninput = \"a\"\nlayer = [{ tile = [1] }]\n", 3, 19, "found an array"),
        (
            "[[detail]]\ninput = \"a\"\nlayer = [{ tile = \"steel\" }]\n",
            3,
            10,
            "add [tile.steel] with its `file`",
        ),
        (
            "[tile.iron]\nfile = \"i.png\"\n[[detail]]\ninput = \"a\"\nlayer = [\"steel,scale=2\"]\n",
            5,
            10,
            "or name one that is there: [tile.iron]",
        ),
        ("", 1, 1, "nothing to bake; expected [[aniso]]"),
    ] {
        let (l, c, message, _) = refused(text);
        assert!(message.contains(expected), "wanted {expected:?} for {text:?}, got {message:?}");
        assert_eq!((l, c), (line, column), "of {message:?} in {text:?}");
    }
    assert!(Manifest::parse(Path::new("kinran.toml"), mesh.into()).is_ok());

    // Marks stand under the characters in question, also where a tab or a letter of two bytes comes before.
    let (.., snippet) = refused("[[aniso]]\n\tinput = [\"é\", 12]\n");
    assert_eq!(snippet, "  |\n2 |  input = [\"é\", 12]\n  |                ^^");
}

#[test]
fn patterns_find_what_is_hidden_excluded_or_of_another_kind() {
    let root = library();
    let found = jobs(
        root.path(),
        "[[mesh]]\ninput = \"models/*\"\n[[aniso]]\ninput = \"materials/*\"\nexclude = [\"materials/wip*\"]\n",
    );
    assert_eq!(
        names(&found),
        ["models/helmet.gltf", "models/lamp.glb", "materials/steel", "materials/twill"],
        "in the order of the file, then of names"
    );
    let first = found[0].as_ref().unwrap();
    assert_eq!((first.kind, first.folder.as_path()), (Kind::Mesh, Path::new("helmet")));
    assert_eq!(first.input, root.path().join("models/helmet.gltf"));
}

#[cfg(unix)]
#[test]
fn links_that_lead_back_are_followed_for_ever() {
    use std::os::unix::fs::symlink;
    let root = library();
    let link = |to: &str, at: &str| symlink(root.path().join(to), root.path().join(at)).unwrap();
    // Two in one folder: without a look at where they lead there are 2^40 paths.
    link("models", "models/again");
    link("models", "models/and_again");
    link("", "materials/up");
    link("nowhere", "models/lost");
    let found = jobs(root.path(), "[[mesh]]\ninput = \"**/*.glb\"\n");
    assert_eq!(names(&found), ["models/lamp.glb"]);
    // A link to another folder is followed, once.
    let found = jobs(root.path(), "[[mesh]]\ninput = \"materials/**/*.glb\"\n");
    assert_eq!(names(&found), ["materials/up/models/lamp.glb"]);
    let found = jobs(root.path(), "[[aniso]]\ninput = \"./materials/*\"\nexclude = \"materials/up/\"\n");
    assert_eq!(names(&found), ["materials/steel", "materials/twill", "materials/wip_felt"]);
}

#[test]
fn an_input_that_is_not_there_stops_the_others() {
    let root = library();
    let found = jobs(
        root.path(),
        "[[aniso]]\ninput = [\"materials/silk\", \"materials/twill\", \"models/notes.txt\", \"nowhere/*\"]\n",
    );
    let errors: Vec<&str> = found.iter().filter_map(|job| job.as_ref().err()).map(String::as_str).collect();
    let at = |column: usize| format!("{}:2:{column}: ", root.path().join("kinran.toml").display());
    assert_eq!(
        errors,
        [
            at(10) + "materials/silk does not exist; expected a folder of maps",
            at(47) + "models/notes.txt is not a folder of maps",
            at(67) + "nowhere/* matches nothing; expected a folder of maps",
        ]
    );
    assert_eq!(found[1].as_ref().unwrap().name, "materials/twill");
}

#[test]
fn two_inputs_write_to_one_folder() {
    let root = library();
    fs::create_dir_all(root.path().join("old/Twill")).unwrap();
    let text = "[[aniso]]\ninput = \"materials/twill\"\n[[aniso]]\ninput = \"old/Twill\"\n";
    let found = jobs(root.path(), text);
    let error = found[1].as_ref().unwrap_err();
    let wanted = "kinran.toml:4:9: old/Twill and materials/twill of line 2 would both be baked to Twill; give one \
                  entry another `output`";
    assert!(error.ends_with(wanted), "{error}");
    let apart = jobs(root.path(), &(text.to_owned() + "output = \"old\"\n"));
    assert_eq!(apart[1].as_ref().unwrap().folder, PathBuf::from("old/Twill"));
}

#[test]
fn an_entry_cannot_undo_a_default() {
    let root = library();
    let found = jobs(
        root.path(),
        "[defaults]\nfilter = \"linear\"\nall-textures = true\n[[mesh]]\ninput = \"models/lamp.glb\"\n\
         all-textures = false\nzstd = 0\n",
    );
    let settings: Vec<(&str, SettingValue)> = found[0]
        .as_ref()
        .unwrap()
        .settings
        .iter()
        .map(|setting| {
            let value = match &setting.value {
                SettingValue::Texts(texts) => {
                    SettingValue::Texts(texts.iter().map(|(text, _)| (text.clone(), 0..0)).collect())
                }
                switch => switch.clone(),
            };
            (setting.name.as_str(), value)
        })
        .collect();
    let text = |text: &str| SettingValue::Texts(vec![(text.into(), 0..0)]);
    assert_eq!(
        settings,
        [("all-textures", SettingValue::Switch(false)), ("filter", text("linear")), ("zstd", text("0"))]
    );
}

#[test]
fn sizes_are_misread() {
    for (text, bytes) in [
        ("12 B", 12),
        ("10 GiB", 10 << 30),
        ("1.5kib", 1536),
        ("500 MB", 500_000_000),
        (" 2 TB ", 2_000_000_000_000),
    ] {
        assert_eq!(size(text), Ok(bytes), "{text:?}");
    }
    // A number alone: 20 bytes, or 20 GiB?
    for text in ["", "20", "0", "GiB", "-1", "1 GiBi", "1e3", "nan", "1.2.3 MB"] {
        assert!(size(text).is_err(), "{text:?} became {:?}", size(text));
    }
}
