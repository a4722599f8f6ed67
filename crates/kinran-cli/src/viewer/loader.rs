//! Reading, baking and bringing to the device, in threads of their own: the window never waits.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, RwLock};
use std::thread::JoinHandle;
use std::time::Instant;

use glam::Vec3;
use kinran_image::{Cancelled, write_atomically};
use kinran_render::realtime::{GpuLight, GpuScene, Realtime, ShaderSource};
use kinran_render::reference::{RenderScene, SurfaceTextures, Surroundings, TextureFiltering};
use kinran_scene::Scene;

use crate::model::Model;
use crate::surfaces::{Mips, scene_surfaces};
use crate::view::{EnvironmentChoice, View, ViewArgs, environment, file_name};
use crate::{Error, Progress};

/// Textures of every material of a model.
type Surfaces = Vec<Option<SurfaceTextures>>;

/// What the window asks for.
pub(super) enum Job {
    /// A file to show from now on.
    Open(PathBuf, ViewArgs),
    /// The textures of a method.
    Bake(Mips),
    /// Other light from all around: a choice, the layer of its file, and its rotation in degrees.
    Light(EnvironmentChoice, Option<String>, f32),
    /// What the baker made for the model of a number.
    Baked(u64, Mips, Result<Surfaces, Error>),
}

/// What the window gets.
pub(super) enum Event {
    /// A model, to be shown without mips until they are baked.
    Opened(Box<Opened>),
    /// A model with the textures of a method.
    Baked(Mips, Box<GpuScene>),
    /// All that was baked is out of date: the light changed.
    LightChanged,
    /// What is being read; empty when nothing is.
    Busy(String),
    /// What went wrong.
    Failed(Error),
}

/// A model that was just read.
pub(super) struct Opened {
    pub(super) name: String,
    /// What it is drawn with at first.
    pub(super) mips: Mips,
    pub(super) view: View,
    pub(super) material_names: Vec<String>,
    pub(super) scene: RenderScene,
    pub(super) warnings: Vec<String>,
    /// When it was read.
    pub(super) at: Instant,
}

/// What is being baked, and the share of it that is done.
pub(super) type Baking = Option<(String, f32)>;

/// What both threads and the window see.
#[derive(Default)]
struct Common {
    /// The number of the model that is shown: bakes for another one are not begun, or stopped.
    model: AtomicU64,
    /// The window is closing: the device is not touched any more, and what is being read or baked is stopped.
    closing: AtomicBool,
    baking: Mutex<Baking>,
}

impl Common {
    fn set_baking(&self, baking: Baking) {
        *self.baking.lock().expect("no thread panics") = baking;
    }

    /// Whether anybody waits for what is being done.
    ///
    /// # Errors
    /// Where the window is closing.
    fn wanted(&self) -> Result<(), Cancelled> {
        if self.closing.load(Relaxed) { Err(Cancelled) } else { Ok(()) }
    }

    /// Whether anybody waits for a bake.
    ///
    /// # Errors
    /// Where another model is shown, or the window is closing.
    fn bake_wanted(&self, model: u64) -> Result<(), Cancelled> {
        if self.model.load(Relaxed) == model { self.wanted() } else { Err(Cancelled) }
    }
}

/// A thread that reads and brings to the device, and one that bakes.
pub(super) struct Loader {
    jobs: Option<Sender<Job>>,
    events: Receiver<Event>,
    common: Arc<Common>,
    reader: Option<JoinHandle<()>>,
    baker: Option<JoinHandle<()>>,
}

/// A model to be baked: its number, itself, and the method.
type Bake = (u64, Arc<Scene>, Mips);

/// Bakes for as long as somebody waits for it; `wake` is called when the window has a bar to show.
fn bake(common: &Arc<Common>, (number, scene, mips): &Bake, wake: impl FnOnce()) -> Result<Surfaces, Error> {
    common.bake_wanted(*number)?;
    let name = format!("baking {}", mips.name());
    common.set_baking(Some((name.clone(), 0.0)));
    wake();
    let (watching, number) = (common.clone(), *number);
    let progress = Progress::watched(move |_, share| {
        watching.bake_wanted(number)?;
        watching.set_baking(Some((name.clone(), share)));
        Ok(())
    });
    let baked = scene_surfaces(scene, *mips, &progress);
    common.set_baking(None);
    Ok(baked?.0)
}

impl Loader {
    /// Starts them. `wake` is called whenever there is something new.
    pub(super) fn start(
        renderer: Arc<RwLock<Realtime>>,
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) -> Self {
        let (jobs, todo) = channel();
        let (send, events) = channel();
        let (bakes, to_bake) = channel::<Bake>();
        let common = Arc::new(Common::default());

        let (results, shared, waker) = (jobs.clone(), common.clone(), wake.clone());
        let baker = std::thread::spawn(move || {
            while let Ok(wanted) = to_bake.recv() {
                let surfaces = bake(&shared, &wanted, &waker);
                if results.send(Job::Baked(wanted.0, wanted.2, surfaces)).is_err() {
                    return;
                }
            }
        });

        let mut work = Work {
            renderer,
            common: common.clone(),
            bakes,
            model: None,
            only_baked: false,
            surfaces: HashMap::new(),
            light: None,
        };
        let reader = std::thread::spawn(move || {
            let tell = |event| {
                // A window that is gone hears nothing.
                let sent = send.send(event);
                wake();
                sent.is_ok()
            };
            while let Ok(job) = todo.recv() {
                if work.common.closing.load(Relaxed) {
                    return;
                }
                let _ = tell(Event::Busy(work.describe(&job)));
                let heard = match work.run(job) {
                    Ok(events) => events.into_iter().all(tell),
                    Err(error) => tell(Event::Failed(error)),
                };
                if !(heard && tell(Event::Busy(String::new()))) {
                    return;
                }
            }
        });
        Self { jobs: Some(jobs), events, common, reader: Some(reader), baker: Some(baker) }
    }

    /// Asks for something.
    pub(super) fn ask(&self, job: Job) {
        if let Some(jobs) = &self.jobs {
            // The thread ends only with the window.
            let _ = jobs.send(job);
        }
    }

    /// The next event, if there is one.
    pub(super) fn event(&self) -> Option<Event> {
        self.events.try_recv().ok()
    }

    /// What is being baked.
    pub(super) fn baking(&self) -> Baking {
        self.common.baking.lock().expect("no thread panics").clone()
    }

    /// Stops both threads and waits for them.
    pub(super) fn close(&mut self) {
        self.common.closing.store(true, Relaxed);
        // A job that does nothing, in case it waits for one.
        self.ask(Job::Bake(Mips::Level0));
        self.jobs = None;
        // The baker waits for what the reader sends it.
        for thread in [self.reader.take(), self.baker.take()].into_iter().flatten() {
            // It has said what went wrong.
            let _ = thread.join();
        }
    }
}

struct Work {
    renderer: Arc<RwLock<Realtime>>,
    common: Arc<Common>,
    bakes: Sender<Bake>,
    model: Option<(Arc<Scene>, RenderScene)>,
    /// Whether the model is textures alone, so that every method shows the same mips.
    only_baked: bool,
    /// Textures of the model that were baked.
    surfaces: HashMap<Mips, Surfaces>,
    /// The model's light on the device.
    light: Option<GpuLight>,
}

impl Work {
    fn describe(&self, job: &Job) -> String {
        match job {
            Job::Open(path, _) => format!("reading {}", path.display()),
            Job::Light(..) => "filtering the environment".into(),
            Job::Bake(_) | Job::Baked(..) => String::new(),
        }
    }

    fn run(&mut self, job: Job) -> Result<Vec<Event>, Error> {
        match job {
            Job::Open(path, args) => {
                let common = self.common.clone();
                let progress = Progress::watched(move |_, _| common.wanted());
                let Model { path, scene, only_baked } = Model::open(&path, &args.model, &progress)?;
                let view = View::new(&scene, &path.to_string_lossy(), &args)?;
                let plain = vec![None; scene.materials.len()];
                let prepared = view.scene(&scene, plain, &progress)?;
                let idle = args.refuse_idle(&scene, &file_name(&path)).err().map(|idle| idle.to_string());
                let told = scene.warnings.iter().chain(view.environment_notes()).cloned();
                let warnings = told.chain(idle).collect();
                let opened = Opened {
                    name: path.to_string_lossy().into_owned(),
                    mips: Mips::of(&scene),
                    view,
                    material_names: scene.materials.iter().map(|m| m.name.clone()).collect(),
                    scene: prepared.clone(),
                    warnings,
                    at: Instant::now(),
                };
                self.model = Some((Arc::new(scene), prepared));
                self.only_baked = only_baked;
                self.common.model.fetch_add(1, Relaxed);
                self.surfaces.clear();
                self.light = None;
                Ok(vec![Event::Opened(Box::new(opened))])
            }
            Job::Bake(mips) => {
                let Some((scene, _)) = &self.model else { return Ok(Vec::new()) };
                if self.surfaces.contains_key(&mips) {
                    return self.bring(mips);
                }
                let baked = mips == Mips::Baked && Mips::of(scene) == Mips::Baked;
                if mips == Mips::Level0 || baked || self.only_baked {
                    // There is nothing to filter, so this is soon done.
                    let drawn = if self.only_baked { Mips::Baked } else { mips };
                    let (surfaces, _) = scene_surfaces(scene, drawn, &Progress::new(false))?;
                    self.surfaces.insert(mips, surfaces);
                    return self.bring(mips);
                }
                // The baker ends after this thread.
                let _ = self.bakes.send((self.common.model.load(Relaxed), scene.clone(), mips));
                Ok(Vec::new())
            }
            Job::Baked(number, mips, surfaces) => {
                if self.common.model.load(Relaxed) != number {
                    return Ok(Vec::new());
                }
                self.surfaces.insert(mips, surfaces?);
                self.bring(mips)
            }
            Job::Light(choice, layer, rotation) => {
                let surroundings =
                    environment(&choice, layer.as_deref(), rotation)?.map(Surroundings::new).map(Arc::new);
                if let Some((_, prepared)) = &mut self.model {
                    prepared.surroundings = surroundings;
                }
                self.light = None;
                Ok(vec![Event::LightChanged])
            }
        }
    }

    /// The model with the textures of a method, on the device.
    fn bring(&mut self, mips: Mips) -> Result<Vec<Event>, Error> {
        let Some((_, prepared)) = &self.model else { return Ok(Vec::new()) };
        let mut with_mips = prepared.clone();
        for (material, surface) in with_mips.materials.iter_mut().zip(&self.surfaces[&mips]) {
            material.surface.clone_from(surface);
        }
        let filtering = match mips {
            Mips::Level0 => TextureFiltering::Level0,
            _ => TextureFiltering::Mips { max_anisotropy: 16 },
        };
        let renderer = self.renderer.read().map_err(|e| Error::Internal(e.to_string()))?;
        if self.common.closing.load(Relaxed) {
            return Ok(Vec::new());
        }
        let light = self.light.get_or_insert_with(|| renderer.light_of(&with_mips));
        Ok(vec![Event::Baked(mips, Box::new(renderer.load(&with_mips, light, filtering)))])
    }
}

/// Puts the built-in shaders into a folder, as far as they are not there.
///
/// # Errors
/// [`Error::Image`] when it cannot be written.
pub(super) fn fill_shader_folder(folder: &Path) -> Result<(), Error> {
    kinran_image::make_folder(folder)?;
    for (name, text) in ShaderSource::files() {
        let path = folder.join(name);
        if !path.exists() {
            write_atomically(&path, text.as_bytes())?;
        }
    }
    Ok(())
}

/// The middle of what a scene shows.
pub(super) fn middle(scene: &RenderScene) -> Vec3 {
    scene.geometry.bounds().map_or(Vec3::ZERO, |(min, max)| 0.5 * (min + max))
}

#[cfg(test)]
mod tests {
    use glam::Mat3;
    use kinran_bake::aniso::Filter;
    use kinran_image::{Channels, Image, Pixels};
    use kinran_scene::{Material, TextureRef, Wrap};

    use super::*;
    use crate::surfaces::Method;

    /// Who shows another model, or closes the window, would wait for the processor.
    #[test]
    fn a_bake_goes_on_that_nobody_waits_for() {
        let texels = (0..256 * 256).flat_map(|i| [i as u8, 128, 255]).collect();
        let image = Image::new(256, 256, Channels::Rgb, Pixels::U8(texels)).unwrap();
        let normal = TextureRef {
            image: 0,
            runtime: None,
            uv_set: 0,
            transform: Mat3::IDENTITY,
            wrap: [Wrap::Repeat; 2],
        };
        let scene = Scene {
            images: vec![Some(Arc::new(image))],
            materials: vec![Material { normal: Some(normal), ..Material::default() }],
            ..Scene::default()
        };
        let wanted = (0, Arc::new(scene), Mips::Filtered(Method::new(Filter::Linear, true)));
        for closing in [false, true] {
            let name = if closing { "the window closes" } else { "another model is shown" };
            let stop = |common: &Common| {
                common.model.fetch_add(u64::from(!closing), Relaxed);
                common.closing.store(closing, Relaxed);
            };
            let common = Arc::new(Common::default());
            assert!(bake(&common, &wanted, || {}).is_ok_and(|surfaces| surfaces[0].is_some()));
            let stopped = bake(&common, &wanted, || stop(&common));
            assert_eq!(stopped.map_err(|e| e.code()).err(), Some("cancelled"), "{name}");
            assert!(common.baking.lock().unwrap().is_none(), "{name}: the bar stays");
            let late = bake(&common, &wanted, || panic!("{name}: it is begun"));
            assert_eq!(late.map_err(|e| e.code()).err(), Some("cancelled"), "{name}");
        }
    }

    #[test]
    fn filling_a_folder_keeps_what_was_edited() {
        let folder = tempfile::tempdir().unwrap();
        fill_shader_folder(folder.path()).unwrap();
        let edited = folder.path().join("tonemap.wgsl");
        std::fs::write(&edited, "edited").unwrap();
        fill_shader_folder(folder.path()).unwrap();
        assert_eq!(std::fs::read_to_string(edited).unwrap(), "edited");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), ShaderSource::files().count());
    }
}
