//! What is rendered: files, and what is derived of them for a frame.

use super::{is_world, moment};
use crate::args::{Common, ModeArg, RenderArgs, ShadeArg};
use crate::failure::Failure;
use crate::job::world::warn_of_unknown_blocks;
use crate::job::{LoadOptions, Loaded, LoadedWorld, WorldShot, camera, load, load_world, world_view};
use crate::output::{Named, check_not_read};
use glam::DVec3;
use orthant_render::world::DerivedWorld;
use orthant_resident::world::WorldView;
use orthant_resident::{Camera, Environment};
use orthant_world::Fixed;
use std::time::{Duration, Instant};

/// A scene, a world, or both.
pub struct Content {
    /// The scene.
    pub loaded: Option<Loaded>,
    /// The world.
    pub world: Option<LoadedWorld>,
}

/// What a frame shows of it.
pub struct Shown {
    /// The frame's camera.
    pub camera: Camera,
    /// What is seen of the world.
    pub view: Option<WorldView>,
    /// What is derived of the world.
    pub derived: Option<DerivedWorld>,
    /// The time of that.
    pub derive_time: Duration,
    /// What positions are relative to, of a world alone.
    pub origin: DVec3,
}

impl Content {
    /// Loads the files, and says what is not as they say.
    ///
    /// # Errors
    /// A bad file (bad input), what it does not have (usage), an output that an input is read from (usage).
    pub fn load(args: &RenderArgs, common: &Common, outputs: &[Named<'_>]) -> Result<Self, Failure> {
        let max_memory = common.max_memory();
        let loaded = if is_world(args) {
            None
        } else {
            let options = LoadOptions {
                scene: args.scene,
                variant: args.variant.as_deref(),
                moment: moment(args),
                allow_external_files: args.allow_external_files,
                max_memory,
            };
            let loaded = load(&args.file, &options)?;
            check_not_read(outputs, &loaded.files, &args.file)?;
            Some(loaded)
        };
        let file = if loaded.is_none() { Some(args.file.as_path()) } else { args.world.as_deref() };
        let world = file.map(|file| load_world(file, args.salvage, max_memory)).transpose()?;
        let content = Self { loaded, world };
        if !common.quiet {
            content.warn();
        }
        Ok(content)
    }

    fn warn(&self) {
        if let Some(loaded) = &self.loaded {
            loaded.print_warnings();
            if loaded.derived.bounds().is_none() {
                eprintln!("warning: {}: the scene shows nothing", loaded.path.display());
            }
        }
        if let Some(world) = &self.world {
            let path = world.path.display();
            world.print_warnings();
            warn_of_unknown_blocks(&world.path, &world.world);
            if world.world.region_count() == 0 {
                eprintln!("warning: {path}: the world is empty");
            }
        }
    }

    /// Chooses the view, and derives what it sees of the world.
    ///
    /// # Errors
    /// Options that do not go together, or a world that takes too much memory (usage).
    pub fn show(&self, args: &RenderArgs, environment: &Environment, common: &Common) -> Result<Shown, Failure> {
        let start = Instant::now();
        let (camera, view, origin) = match (&self.loaded, &self.world) {
            (Some(loaded), None) => {
                (camera::select(loaded, args)?.to_camera(loaded.derived.origin), None, loaded.derived.origin)
            }
            (Some(loaded), Some(world)) => {
                let mut placed = camera::select(loaded, args)?;
                let origin = loaded.derived.origin;
                let mut eye = placed.eye;
                let (view, camera) = world_view::beside_scene(&world.world, &args.world_view, &mut eye, |eye| {
                    placed.eye = eye;
                    placed.to_camera(origin)
                })?;
                (camera, Some(view), origin)
            }
            (None, Some(world)) => {
                let (camera, view) = of_world(&world.world, args, environment)?;
                // Positions of a turned slice have axes of their own: they are told relative to the camera.
                let is_turned = view.layers.iter().any(|layer| layer.axes != UNTURNED);
                let [x, y, z, _] = view.anchor.map(|c| Fixed::from_raw(c).to_f64());
                let origin = if is_turned { DVec3::ZERO } else { DVec3::new(x, y, z) };
                (camera, Some(view), origin)
            }
            (None, None) => unreachable!("a file is a scene or a world"),
        };
        let derive =
            |(view, world): (&WorldView, &LoadedWorld)| world_view::derive(&world.world, view, common.max_memory());
        let derived = view.as_ref().zip(self.world.as_ref()).map(derive).transpose()?;
        Ok(Shown { camera, view, derived, derive_time: start.elapsed(), origin })
    }

    /// Whether a world is seen in the preview.
    pub fn is_preview(&self, args: &RenderArgs) -> bool {
        let (None, Some(world)) = (&self.loaded, &self.world) else { return false };
        match (args.world_view.shade, args.world_view.mode) {
            (Some(shade), _) => shade == ShadeArg::Preview,
            (None, Some(mode)) => mode != ModeArg::Slice,
            (None, None) => !world.world.is_three_dimensional(),
        }
    }

    /// Time of the imports.
    pub fn load_time(&self) -> Duration {
        let of_scene = self.loaded.as_ref().map(|loaded| loaded.load_time);
        of_scene.into_iter().chain(self.world.as_ref().map(|world| world.load_time)).sum()
    }

    /// Time of deriving the scene.
    pub fn derive_time(&self) -> Duration {
        self.loaded.as_ref().map_or(Duration::ZERO, |loaded| loaded.derive_time)
    }
}

/// Axes of a layer that are those of the world.
const UNTURNED: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// The camera and the view of a world alone.
fn of_world(
    world: &orthant_world::World,
    args: &RenderArgs,
    environment: &Environment,
) -> Result<(Camera, WorldView), Failure> {
    let aspect = f64::from(args.size.width) / f64::from(args.size.height);
    let shot = WorldShot::select(world, &args.world_view, args.fov, aspect)?;
    let view = shot.view(environment);
    let mut camera = shot.frame_camera(&view);
    if view.layers.len() > 1 && (args.aperture > 0.0 || args.focus_distance.is_some()) {
        let what = "a lens (--aperture, --focus-distance) is for --mode slice";
        return Err(Failure::usage(what).remedy("leave it out, or choose that mode"));
    }
    camera.lens_radius = args.aperture * 0.5;
    camera.focus_distance = args.focus_distance.or_else(|| shot.middle(world)).unwrap_or(1.0);
    Ok((camera, view))
}
