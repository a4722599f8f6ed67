//! The window, driven as a person drives it: a display without a screen, keys and a pointer.
//!
//! Nothing here waits for a time to pass: each step waits for what it must bring about, so that a slow machine is slow
//! and not wrong. The picture at rest is the same bit by bit, which makes "as before" an exact word. With
//! `KINRAN_PICTURES=DIR` the screen of every step is written there.

#![allow(clippy::print_stderr, reason = "a skipped test says so, and the time to the first picture is told")]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use kinran_image::{Channels, Image, Pixels, read_image, write_png};
use kinran_render::realtime::ShaderSource;
use serde_json::Value;

#[path = "commands/common.rs"]
#[allow(dead_code, reason = "the tests of the commands use all of it")]
mod common;
#[path = "commands/shape.rs"]
mod shape;
use common::{glb, square, text};

/// Of the screen and of the window, which covers it.
const WIDTH: usize = 800;
const HEIGHT: usize = 600;

/// The controls begin here, or a frame's width left of it.
const PANEL: usize = WIDTH - 370;

/// How long anything may take: software rendering on a machine that is busy with other tests.
const PATIENCE: Duration = Duration::from_secs(180);

/// One window at a time: where several are drawn in software, a frame takes longer than a hand holds still.
static ALONE: Mutex<()> = Mutex::new(());

/// A display without a screen.
struct Display {
    _alone: MutexGuard<'static, ()>,
    server: Child,
    name: String,
    /// The server keeps the screen's pixels in a file there.
    folder: tempfile::TempDir,
}

impl Drop for Display {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

impl Display {
    /// `None` after saying so where there is no Xvfb or no xdotool.
    fn start() -> Option<Self> {
        let there = |program: &str, flag: &str| {
            Command::new(program).arg(flag).stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok()
        };
        if !(there("Xvfb", "-help") && there("xdotool", "version")) {
            eprintln!("SKIPPED: there is no Xvfb or no xdotool; apt install xvfb xdotool");
            return None;
        }
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir().unwrap();
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-fbdir", text(folder.path())])
            .args(["-screen", "0", &format!("{WIDTH}x{HEIGHT}x24")])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Some(Display { _alone: alone, server, name: format!(":{}", number.trim()), folder })
    }

    /// The screen's pixels, from the X window dump that the server keeps.
    fn screen(&self) -> Vec<[u8; 3]> {
        let bytes = std::fs::read(self.folder.path().join("Xvfb_screen0")).unwrap();
        let word = |i: usize| u32::from_be_bytes(bytes[4 * i..4 * i + 4].try_into().unwrap()) as usize;
        let (header, width, height, row, colors) = (word(0), word(4), word(5), word(12), word(19));
        assert_eq!((width, height, word(11)), (WIDTH, HEIGHT, 32), "the screen's size and bits");
        let pixels = &bytes[header + 12 * colors..];
        let pixel = |i: usize| {
            let at = i / WIDTH * row + i % WIDTH * 4;
            [pixels[at + 2], pixels[at + 1], pixels[at]]
        };
        (0..WIDTH * HEIGHT).map(pixel).collect()
    }

    fn xdotool(&self, args: &[&str]) -> String {
        let output = Command::new("xdotool").args(args).env("DISPLAY", &self.name).output().unwrap();
        let words = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "xdotool {args:?}: {words}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// Presses keys as fast as can be.
    fn keys(&self, keys: &[&str]) {
        self.xdotool(&[&["key", "--delay", "0"], keys].concat());
    }

    /// Drags a button from one place to another.
    fn drag(&self, button: &str, from: (usize, usize), to: (usize, usize)) {
        let [fx, fy, tx, ty] = [from.0, from.1, to.0, to.1].map(|x| x.to_string());
        // In two steps: a toolkit may take the first one for the trembling of a hand.
        let (mx, my) = (((from.0 + to.0) / 2).to_string(), ((from.1 + to.1) / 2).to_string());
        self.xdotool(&["mousemove", &fx, &fy, "sleep", "0.3", "mousedown", button, "sleep", "0.3"]);
        self.xdotool(&["mousemove", &mx, &my, "sleep", "0.3", "mousemove", &tx, &ty, "sleep", "0.3"]);
        self.xdotool(&["mouseup", button]);
        self.xdotool(&["mousemove", "2", &(HEIGHT - 3).to_string()]);
    }
}

/// A window on a model.
struct Window<'a> {
    display: &'a Display,
    process: Child,
    step: usize,
}

impl Drop for Window<'_> {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl<'a> Window<'a> {
    fn open(display: &'a Display, args: &[&str]) -> Self {
        let process = Command::new(env!("CARGO_BIN_EXE_kinran"))
            // Few frames: the picture is compared with itself.
            .args(["view", "--spp", "8", "--window", &format!("{WIDTH}x{HEIGHT}")])
            .args(args)
            .env("DISPLAY", &display.name)
            .env("WINIT_X11_SCALE_FACTOR", "1")
            .env_remove("WAYLAND_DISPLAY")
            .stdin(Stdio::null())
            .spawn()
            .unwrap();
        let mut window = Window { display, process, step: 0 };
        window.wait("a window", || !display.try_search().is_empty());
        let id = display.try_search();
        display.xdotool(&["mousemove", "2", &(HEIGHT - 3).to_string(), "windowfocus", &id]);
        window
    }

    /// Waits until something holds.
    fn wait(&mut self, what: &str, mut holds: impl FnMut() -> bool) {
        let start = Instant::now();
        while !holds() {
            let ended = self.process.try_wait().unwrap();
            assert!(ended.is_none(), "the window closed ({ended:?}) before there was {what}");
            let elapsed = start.elapsed();
            if elapsed > PATIENCE {
                self.keep(&self.display.screen(), "failed");
                panic!("there was no {what} after {elapsed:?}");
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Waits until the title says that the picture is smooth, and the screen is as `wanted` says and has not changed for
    /// a second; gives it.
    fn settle(&mut self, what: &str, wanted: impl Fn(&[[u8; 3]]) -> bool) -> Vec<[u8; 3]> {
        let display = self.display;
        let (mut last, mut since) = (display.screen(), Instant::now());
        self.wait(what, || {
            let screen = display.screen();
            if screen != last {
                (last, since) = (screen, Instant::now());
            }
            let calm = since.elapsed() > Duration::from_secs(1) && wanted(&last);
            calm && display.title() == "square.glb - Kinran"
        });
        let screen = display.screen();
        self.keep(&screen, what);
        screen
    }

    fn keep(&mut self, screen: &[[u8; 3]], what: &str) {
        self.step += 1;
        let Some(folder) = std::env::var_os("KINRAN_PICTURES").map(PathBuf::from) else { return };
        std::fs::create_dir_all(&folder).unwrap();
        let pixels = Pixels::U8(screen.as_flattened().to_vec());
        let image = Image::new(WIDTH as u32, HEIGHT as u32, Channels::Rgb, pixels).unwrap();
        let name = what.replace(|c: char| !c.is_alphanumeric(), "_");
        write_png(&folder.join(format!("view_{:02}_{name}.png", self.step)), &image).unwrap();
    }

    /// Has the parameters saved, and reads them. The file is new each time.
    fn saved(&mut self, path: &Path) -> Value {
        if path.exists() {
            std::fs::remove_file(path).unwrap();
        }
        self.display.keys(&["ctrl+s"]);
        self.wait("a file of parameters", || path.exists());
        serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
    }
}

impl Display {
    fn title(&self) -> String {
        let output = Command::new("xdotool")
            .args(["getwindowname", &self.try_search()])
            .env("DISPLAY", &self.name)
            .output();
        String::from_utf8_lossy(&output.unwrap().stdout).trim().to_owned()
    }

    /// The window's number, or nothing.
    fn try_search(&self) -> String {
        let search = ["search", "--onlyvisible", "--name", "Kinran"];
        let output = Command::new("xdotool").args(search).env("DISPLAY", &self.name).output().unwrap();
        String::from_utf8(output.stdout).unwrap().lines().next().unwrap_or_default().to_owned()
    }
}

/// The part of a screen left of the controls and below what lies over the picture's top.
fn lower_picture(screen: &[[u8; 3]]) -> Vec<[u8; 3]> {
    let rows = HEIGHT / 2..HEIGHT - 60;
    rows.flat_map(|y| screen[y * WIDTH + 60..y * WIDTH + PANEL - 20].to_vec()).collect()
}

/// Whether a model is seen: brighter than the backdrop somewhere in the middle.
fn shows_a_model(screen: &[[u8; 3]]) -> bool {
    let picture = lower_picture(screen);
    let bright = picture.iter().filter(|p| p.iter().any(|&c| c > 110)).count();
    bright > picture.len() / 20
}

#[test]
fn a_person_can_drive_the_window() {
    let Some(display) = Display::start() else { return };
    let (folder, model) = square();
    let shaders = folder.path().join("shaders");
    let parameters = folder.path().join("square.view.json");
    let mut window = Window::open(&display, &[text(&model), "--shaders", text(&shaders)]);
    let at_rest = window.settle("the model", shows_a_model);

    // Help, and no help.
    display.keys(&["question"]);
    let help = window.settle("help", |screen| screen != at_rest);
    assert!(help.iter().zip(&at_rest).filter(|(a, b)| a != b).count() > 20_000, "help is a window");
    display.keys(&["question"]);
    window.settle("the model without help", |screen| screen == at_rest);

    // Keys that follow each other in one frame all count, and a modifier that is released in it too.
    let before = window.saved(&parameters);
    assert_eq!((&before["split"], &before["channel"]), (&Value::from(false), &Value::from(0)));
    display.keys(&["plus", "plus", "plus", "c", "2", "ctrl+s"]);
    let after = window.saved(&parameters);
    assert_eq!((&after["split"], &after["channel"]), (&Value::from(true), &Value::from(1)), "C and 2");
    let stops = after["exposure"].as_f64().unwrap() - before["exposure"].as_f64().unwrap();
    assert!((stops - 1.0).abs() < 2e-3, "three thirds of a stop, got {stops}");
    // A plane that faces the viewer, nearly: its normals are blue.
    let bluish = |screen: &[[u8; 3]]| {
        let picture = lower_picture(screen);
        let sum = |c: usize| picture.iter().map(|p| u64::from(p[c])).sum::<u64>();
        sum(2) > sum(0) + 10 * picture.len() as u64
    };
    window.settle("normals", bluish);
    display.keys(&["1", "minus", "minus", "minus"]);
    let lit = window.settle("the split line", |screen| shows_a_model(screen) && !bluish(screen));

    // The line can be dragged, and the model turned.
    let middle = PANEL / 2;
    display.drag("1", (middle, 450), (middle + 120, 450));
    let dragged = window.saved(&parameters);
    let share = dragged["split_at"].as_f64().unwrap();
    assert!((share - (0.5 + 120.0 / PANEL as f64)).abs() < 0.02, "the line was dragged to {share}");
    assert_eq!(dragged["orbit"], before["orbit"], "dragging the line turned the model");
    // In the lower corner, through the message that says what was saved.
    let in_corner = |screen: &[[u8; 3]]| -> Vec<[u8; 3]> {
        (HEIGHT - 100..HEIGHT - 80).flat_map(|y| screen[y * WIDTH + 20..y * WIDTH + 80].to_vec()).collect()
    };
    let told = window.settle("what was saved", |screen| in_corner(screen) != in_corner(&at_rest));
    assert_ne!(in_corner(&told), in_corner(&at_rest), "no message stands where the drag begins");
    display.drag("1", (50, HEIGHT - 90), (110, HEIGHT - 120));
    let turned = window.saved(&parameters);
    for what in ["yaw", "pitch"] {
        assert_ne!(turned["orbit"][what], before["orbit"][what], "{what} did not change");
    }
    assert_ne!(lit, at_rest, "the split line was not seen");

    // Nearer, aside, and back to where it began.
    let [x, y] = [middle - 100, 280].map(|x| x.to_string());
    display.xdotool(&["mousemove", &x, &y, "sleep", "0.3", "click", "4", "sleep", "0.3"]);
    let nearer = window.saved(&parameters);
    let distance = |saved: &Value| saved["orbit"]["distance"].as_f64().unwrap();
    assert!(
        distance(&nearer) < distance(&turned),
        "the wheel: {} to {}",
        distance(&turned),
        distance(&nearer)
    );
    display.drag("3", (middle - 100, 300), (middle - 60, 280));
    let aside = window.saved(&parameters);
    assert_ne!(aside["orbit"]["target"], nearer["orbit"]["target"], "the right button moved nothing");
    display.keys(&["f", "c"]);
    display.keys(&["Escape"]);
    let again = window.settle("the model again", shows_a_model);
    assert_eq!(lower_picture(&again), lower_picture(&at_rest), "F and C do not lead back");
    let framed = window.saved(&parameters);
    assert_eq!(framed["orbit"], before["orbit"], "F did not frame the model");
    display.keys(&["Escape"]);

    // The picture without the controls.
    let picture = folder.path().join("square.view.png");
    display.keys(&["p"]);
    window.wait("a saved picture", || picture.exists());
    let image = read_image(&picture).unwrap();
    let Pixels::U8(samples) = &image.pixels else { panic!("the saved picture has not 8 bits") };
    let center = 3 * ((image.height / 2) * image.width + image.width / 2) as usize;
    let (saved, seen) = (&samples[center..center + 3], again[HEIGHT / 2 * WIDTH + image.width as usize / 2]);
    let apart = saved.iter().zip(seen).map(|(a, b)| a.abs_diff(b)).max();
    assert!(apart <= Some(24), "the middle of the picture is {saved:?}, on the screen {seen:?}");
    assert!(image.width as usize <= PANEL + 40, "the saved picture has the controls in it");

    // A mistake in a shader is told, and the picture stays; what compiles is seen; Escape closes the message.
    display.keys(&["Escape"]);
    window.settle("no message", |screen| screen == again);
    let tonemap = shaders.join("tonemap.wgsl");
    let right = std::fs::read_to_string(&tonemap).unwrap();
    let end = "return vec4f(srgb_oetf(shown), 1.0);";
    assert!(right.contains(end), "tonemap.wgsl ends otherwise now");
    std::fs::write(&tonemap, right.replace(end, "return no_such_function(shown);")).unwrap();
    let told = window.settle("the compiler's message", |screen| screen != again);
    assert_eq!(lower_picture(&told), lower_picture(&again), "a mistake changed the picture");
    std::fs::write(&tonemap, right.replace(end, "return vec4f(1.0 - srgb_oetf(shown), 1.0);")).unwrap();
    let of = |screen: &[[u8; 3]]| u32::from(screen[HEIGHT / 2 * WIDTH + PANEL / 2][1]);
    window.settle("the edit", |screen| of(screen).abs_diff(255 - of(&again)) <= 2);
    std::fs::write(&tonemap, &right).unwrap();
    window.settle("the shaders as they were", |screen| screen == again);

    display.keys(&["ctrl+q"]);
    let start = Instant::now();
    let ended = loop {
        if let Some(status) = window.process.try_wait().unwrap() {
            break status;
        }
        assert!(start.elapsed() < PATIENCE, "Ctrl+Q does not close the window");
        std::thread::sleep(Duration::from_millis(50));
    };
    assert!(ended.success(), "the window closed with {ended}");
}

#[test]
fn the_first_picture_is_timed_and_a_window_closes_by_itself() {
    let Some(display) = Display::start() else { return };
    let (folder, model) = square();
    let picture = folder.path().join("window.png");
    for _ in 0..2 {
        let output = Command::new(env!("CARGO_BIN_EXE_kinran"))
            .args(["--json", "view", "--window", "400x300", text(&model), "--screenshot", text(&picture)])
            .env("DISPLAY", &display.name)
            .env("WINIT_X11_SCALE_FACTOR", "1")
            .env_remove("WAYLAND_DISPLAY")
            .output()
            .unwrap();
        assert!(output.status.success(), "{}: {}", output.status, String::from_utf8_lossy(&output.stderr));
        let said: Value = serde_json::from_slice(&output.stdout).unwrap();
        shape::valid("view", &said);
        let seconds = said["first_picture_seconds"].as_f64().unwrap();
        eprintln!("the first picture came {seconds:.2} s after reading");
        assert!(seconds > 0.0, "there was no first picture");
        let image = read_image(&picture).unwrap();
        assert_eq!((image.width, image.height), (400, 300));
        std::fs::remove_file(&picture).unwrap();
    }
}

/// Of a model that says more than is drawn: that is told on standard error and in the result, not over the picture.
#[test]
fn a_message_stands_over_the_picture_of_a_screenshot() {
    let Some(display) = Display::start() else { return };
    let (folder, model) = square();
    let bytes = glb();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let primitives = json["meshes"][0]["primitives"].as_array_mut().unwrap();
    primitives.push(serde_json::json!({ "attributes": { "POSITION": 0 }, "mode": 0 }));
    json["buffers"][0]["uri"] = "square.bin".into();
    std::fs::write(folder.path().join("square.bin"), &bytes[28 + length..]).unwrap();
    let with_points = folder.path().join("square.gltf");
    std::fs::write(&with_points, json.to_string()).unwrap();
    let take = |model: &Path| {
        let picture = folder.path().join("window.png");
        let output = Command::new(env!("CARGO_BIN_EXE_kinran"))
            .args([
                "--json",
                "view",
                "--spp",
                "4",
                "--window",
                "800x500",
                text(model),
                "--screenshot",
                text(&picture),
            ])
            .env("DISPLAY", &display.name)
            .env("WINIT_X11_SCALE_FACTOR", "1")
            .env_remove("WAYLAND_DISPLAY")
            .output()
            .unwrap();
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{}: {words}", output.status);
        let said: Value = serde_json::from_slice(&output.stdout).unwrap();
        shape::valid("view", &said);
        let image = read_image(&picture).unwrap();
        let Pixels::U8(samples) = image.pixels else { panic!("the screenshot has not 8 bits") };
        // Left of the controls, which name the file.
        let rows = samples.chunks(3 * image.width as usize).map(|row| row[..3 * (800 - 380)].to_vec());
        (rows.collect::<Vec<_>>(), said, words)
    };
    let (plain, said, _) = take(&model);
    assert_eq!(said["warnings"], serde_json::json!([]), "{said}");
    let (picture, said, words) = take(&with_points);
    let warning = said["warnings"][0].as_str().unwrap_or_default();
    assert!(warning.contains("points") && words.contains(warning), "{said} {words}");
    let other = plain.iter().zip(&picture).position(|(a, b)| a != b);
    assert_eq!(other, None, "row {other:?} of the picture shows something else");
}

#[test]
fn what_cannot_be_shown_is_refused_before_a_window_opens() {
    let (folder, model) = square();
    let refused = |args: &[&str], part: &str| {
        let said = common::kinran(&[&["view"], args].concat());
        assert!(said.code == Some(2) && said.err.contains(part), "{args:?}: {:?} {}", said.code, said.err);
    };
    refused(&[text(&folder.path().join("missing.glb"))], "missing.glb");
    refused(&[text(&model), "--screenshot", "picture.gif"], "picture.gif");
    let shaders = folder.path().join("shaders");
    std::fs::create_dir(&shaders).unwrap();
    std::fs::write(shaders.join("forwards.wgsl"), "").unwrap();
    refused(&[text(&model), "--shaders", text(&shaders)], "forwards.wgsl");
    assert_eq!(ShaderSource::files().count(), 18, "a new shader file needs its name in docs/realtime.md");
}
