//! From options to a view of a world: camera, layers, light, and what of the world is derived for it.

use super::camera::DEFAULT_FOV;
use crate::args::{ModeArg, ShadeArg, WorldViewArgs};
use crate::failure::Failure;
use glam::DVec3;
use orthant_render::world::light::preview_light;
use orthant_render::world::view::{Look, Mode, Turns, WorldCamera, position};
use orthant_render::world::{BuildOptions, DerivedWorld, WorldError};
use orthant_resident::world::rows::{LeafRow, WorldNode};
use orthant_resident::world::view::{MAX_DISTANCE, STEP_BUDGET};
use orthant_resident::world::{ArenaLens, Combine, Layer, Shade, WorldView};
use orthant_resident::{Camera, Environment};
use orthant_world::{Aabb4, Fixed, Point4, World};

/// A view of a world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldShot {
    /// Where it is taken from.
    pub camera: WorldCamera,
    /// How it is made of layers.
    pub mode: Mode,
    /// How hits are shaded; [`Shade::Path`] until the light is known.
    pub path: bool,
    /// Nothing farther is seen, in units.
    pub distance: f32,
    /// Width of the edges of blocks.
    pub edges: f32,
    /// Tangent of half the vertical field of view.
    pub tan_half_fov_y: f32,
}

/// How far a view reaches in a world where nothing is.
const EMPTY_DISTANCE: f32 = 1024.0;

/// What surrounds the camera where there is nothing to frame: it stands a little above the origin.
const NOWHERE: [f64; 4] = [0.0, 2.0, 0.0, 0.5];

impl WorldShot {
    /// The view that the options ask for. `aspect` is the image's width over its height.
    ///
    /// # Errors
    /// Options that do not go together (usage).
    pub fn select(world: &World, args: &WorldViewArgs, fov: Option<f32>, aspect: f64) -> Result<Self, Failure> {
        let solid = world.solid_bounds();
        let mode = mode(args, || world.is_three_dimensional())?;
        let half_fov = f64::from(fov.unwrap_or(DEFAULT_FOV)).to_radians() * 0.5;
        let turns = Turns {
            yaw: args.yaw.unwrap_or(0.0),
            xw: args.xw.unwrap_or(0.0),
            zw: args.zw.unwrap_or(0.0),
            pitch: args.pitch.unwrap_or(0.0),
        };
        let camera = match (args.pos, &solid) {
            (Some(pos), _) => WorldCamera::new(pos.0, &turns),
            (None, Some(bounds)) => {
                let looks = args.yaw.is_some() || args.pitch.is_some();
                let default = WorldCamera::DEFAULT_TURNS;
                let turns = if looks { turns } else { Turns { yaw: default.yaw, pitch: default.pitch, ..turns } };
                let camera = WorldCamera::framing(bounds, &turns, half_fov.tan(), aspect);
                let reach = camera.reach(bounds);
                if reach > f64::from(MAX_DISTANCE) && args.distance.is_none() {
                    let what = format!(
                        "the whole world is in view from {reach:.2e} units away, and a frame sees 1e9 units far"
                    );
                    return Err(Failure::usage(what).remedy("give --pos near what is to be seen"));
                }
                camera
            }
            (None, None) => WorldCamera::new(position(NOWHERE).unwrap_or_default(), &turns),
        };
        let distance = args.distance.unwrap_or_else(|| default_distance(camera.position, solid.as_ref()));
        let path = match args.shade {
            Some(shade) => shade == ShadeArg::Path,
            None => mode == Mode::Slice,
        };
        let tan_half_fov_y = half_fov.tan() as f32;
        Ok(Self { camera, mode, path, distance, edges: args.edges.unwrap_or(0.0), tan_half_fov_y })
    }

    /// The view in the light of an environment.
    pub fn view(&self, environment: &Environment) -> WorldView {
        let shade = if self.path { Shade::Path } else { preview_light(environment) };
        self.camera.view(&self.mode, &Look { shade, distance: self.distance, edges: self.edges })
    }

    /// The camera of a frame of that view.
    pub fn frame_camera(&self, view: &WorldView) -> Camera {
        WorldCamera::camera(view, self.tan_half_fov_y)
    }

    /// The distance of the middle of the world along the view, for a lens that is told no other; `None` where that is no distance.
    pub fn middle(&self, world: &World) -> Option<f32> {
        let bounds = world.solid_bounds()?;
        let at = self.camera.position.0.map(Fixed::to_f64);
        let (min, max) = (bounds.min().0.map(Fixed::to_f64), bounds.max().0.map(Fixed::to_f64));
        let way = glam::DVec4::from_array(std::array::from_fn(|a| (min[a] + max[a]) * 0.5 - at[a]));
        Some(way.dot(self.camera.forward()) as f32).filter(|d| *d > 0.0)
    }
}

/// The mode, and whether the options for layers are those of it.
fn mode(args: &WorldViewArgs, is_flat: impl FnOnce() -> bool) -> Result<Mode, Failure> {
    let (mode, is_default) = match args.mode {
        Some(mode) => (mode, false),
        None => (if is_flat() { ModeArg::Slice } else { ModeArg::Integral }, true),
    };
    let of = |name: &str, is_given: bool, modes: &[ModeArg]| {
        if !is_given || modes.contains(&mode) {
            return Ok(());
        }
        let names: Vec<_> = modes.iter().map(|mode| mode.name()).collect();
        let why = if is_default { ", which this world has by default" } else { "" };
        let what = format!("{name} is for --mode {}, and not for {}{why}", names.join(" and "), mode.name());
        Err(Failure::usage(what).remedy("leave it out, or choose that mode"))
    };
    of("--layers", args.layers.is_some(), &[ModeArg::Integral, ModeArg::Thick])?;
    of("--hidden-zoom", args.hidden_zoom.is_some(), &[ModeArg::Integral])?;
    of("--mix", args.mix.is_some(), &[ModeArg::Integral])?;
    of("--thickness", args.thickness.is_some(), &[ModeArg::Thick])?;
    Ok(match mode {
        ModeArg::Slice => Mode::Slice,
        ModeArg::Integral => Mode::Integral {
            layers: args.layers.unwrap_or(128),
            hidden_zoom: args.hidden_zoom.unwrap_or(1.0),
            mix: args.mix.unwrap_or(8.0),
        },
        ModeArg::Thick => {
            let layers = args.layers.unwrap_or(9);
            if layers.is_multiple_of(2) {
                let what =
                    format!("--layers {layers}: a thick slice has as many layers on both sides of the middle one");
                return Err(Failure::usage(what).remedy("give an odd number"));
            }
            let spacing = f64::from(args.thickness.unwrap_or(0.5));
            if spacing * f64::from(layers - 1) > 180.0 {
                let what = "the layers of the thick slice spread over more than 180 degrees";
                return Err(Failure::usage(what).remedy("give less --thickness or fewer --layers"));
            }
            Mode::Thick { each_side: layers / 2, spacing }
        }
    })
}

/// As far as the farthest corner of what is solid, or as a frame can see.
fn default_distance(at: Point4, solid: Option<&Aabb4>) -> f32 {
    let Some(bounds) = solid else { return EMPTY_DISTANCE };
    let reach = WorldCamera::new(at, &Turns::default()).reach(bounds) as f32;
    // The conversion may round down.
    (reach * 1.000_001).clamp(1.0, MAX_DISTANCE)
}

/// The view of a world in a frame that shows a model scene too: the scene's axes are X, Y and Z of the world, at the `w` of `--pos`,
/// and the scene's camera sees both. `eye` is moved to the nearest point that a world has.
///
/// # Errors
/// Options that are of a world alone (usage); an eye beyond the space of a world (usage).
pub fn beside_scene(
    world: &World,
    args: &WorldViewArgs,
    eye: &mut DVec3,
    camera: impl FnOnce(DVec3) -> Camera,
) -> Result<(WorldView, Camera), Failure> {
    for name in args.given() {
        let fits = match name {
            "--pos" | "--distance" | "--edges" => true,
            "--mode" => args.mode == Some(ModeArg::Slice),
            "--shade" => args.shade == Some(ShadeArg::Path),
            _ => false,
        };
        if !fits {
            let what =
                format!("{name}: a scene and a world in one frame are path traced in a slice, from the scene's camera");
            return Err(Failure::usage(what).remedy("leave it out, or render the world alone"));
        }
    }
    let w = args.pos.map_or(Fixed::from_raw(1 << 15), |pos| pos.0.0[3]);
    let mut anchor = position([eye.x, eye.y, eye.z, 0.0])
        .ok_or_else(|| Failure::usage("the camera stands beyond the space of a world, which reaches to 2^45 units"))?;
    anchor.0[3] = w;
    let [x, y, z, _] = anchor.0.map(Fixed::to_f64);
    *eye = DVec3::new(x, y, z);
    let camera = camera(*eye);
    let distance = args.distance.unwrap_or_else(|| default_distance(anchor, world.solid_bounds().as_ref()));
    let layer = Layer {
        axes: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
        right: camera.right,
        up: camera.up,
        forward: camera.forward,
    };
    let view = WorldView {
        anchor: anchor.raw(),
        layers: vec![layer],
        combine: Combine::Mean,
        distance,
        shade: Shade::Path,
        edges: args.edges.unwrap_or(0.0),
        step_budget: STEP_BUDGET,
    };
    Ok((view, camera))
}

/// Derives what a view sees: the content of the box that it reaches. The arenas are held twice, by the planner and by the backend.
///
/// # Errors
/// A world whose arenas take more than `max_memory` bytes (usage).
pub fn derive(world: &World, view: &WorldView, max_memory: u64) -> Result<DerivedWorld, Failure> {
    // Rounded up to a whole unit, and one more for lenses of ordinary size.
    let reach = (f64::from(view.distance).ceil() + 1.0) as i64 * Fixed::ONE.raw();
    let (low, high) = (Aabb4::SPACE.min_raw(), Aabb4::SPACE.max_raw());
    let min = std::array::from_fn(|a| view.anchor[a].saturating_sub(reach).max(low[a]));
    let max = std::array::from_fn(|a| view.anchor[a].saturating_add(reach).min(high[a]));
    let clip = Aabb4::from_raw(min, max).map_err(|e| Failure::usage(format!("the view sees no part of space: {e}")))?;
    build(world, clip, max_memory)
}

/// Derives the content of a box.
///
/// # Errors
/// As [`derive`].
pub fn build(world: &World, clip: Aabb4, max_memory: u64) -> Result<DerivedWorld, Failure> {
    DerivedWorld::build(world, &build_options(clip, max_memory)).map_err(world_failure)
}

/// How the content of a box is derived within a bound on memory.
pub fn build_options(clip: Aabb4, max_memory: u64) -> BuildOptions {
    let most = |share: u64, row: usize| (max_memory / share / row as u64).min((1 << 31) - 1) as u32;
    let max = ArenaLens {
        nodes: most(8, size_of::<WorldNode>()),
        leaves: most(8, size_of::<LeafRow>()),
        payload: most(4, 4),
        palette: (1 << 31) - 1,
    };
    BuildOptions { clip, max, ..BuildOptions::default() }
}

/// A world that cannot be derived takes too much memory; all else is a fault of the program.
pub fn world_failure(error: WorldError) -> Failure {
    match error {
        WorldError::ArenaFull { .. } => {
            Failure::usage(error.to_string()).remedy("give a smaller --distance, or raise --max-memory")
        }
        WorldError::Leaf { .. } => Failure::new(crate::failure::Exit::Internal, error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_world::{Block, BlockId, RegionTree, Scale, WorldPatch};

    fn world(min: [i32; 4], max: [i32; 4]) -> World {
        let mut world = World::new();
        let bounds = Aabb4::from_ints(min, max).expect("a box");
        let tree = RegionTree::uniform(bounds, Block::of(BlockId(1), Scale::UNIT));
        world.apply(&WorldPatch::of_tree(tree)).expect("applied");
        world
    }

    fn select(world: &World, args: &WorldViewArgs) -> Result<WorldShot, Failure> {
        WorldShot::select(world, args, None, 1.5)
    }

    #[test]
    fn a_world_within_one_unit_of_w_is_a_traced_slice_and_any_other_an_integral_in_the_preview() {
        let none = WorldViewArgs::default();
        let flat = select(&world([0; 4], [9, 9, 9, 1]), &none).expect("a view");
        assert_eq!((flat.mode, flat.path), (Mode::Slice, true));
        let deep = select(&world([0; 4], [9, 9, 9, 2]), &none).expect("a view");
        assert_eq!((deep.mode, deep.path), (Mode::Integral { layers: 128, hidden_zoom: 1.0, mix: 8.0 }, false));
        assert_eq!(deep.camera.position.raw()[3], 1 << 15);
        assert_eq!(select(&World::new(), &none).expect("a view").mode, Mode::Slice);
    }

    #[test]
    fn options_of_another_mode_are_refused_by_name() {
        let flat = world([0; 4], [9, 9, 9, 1]);
        let args = |mode| WorldViewArgs { mode, ..WorldViewArgs::default() };
        let cases = [
            (WorldViewArgs { layers: Some(5), ..args(None) }, "--layers"),
            (WorldViewArgs { hidden_zoom: Some(2.0), ..args(Some(ModeArg::Thick)) }, "--hidden-zoom"),
            (WorldViewArgs { mix: Some(2.0), ..args(Some(ModeArg::Slice)) }, "--mix"),
            (WorldViewArgs { thickness: Some(2.0), ..args(Some(ModeArg::Integral)) }, "--thickness"),
            (WorldViewArgs { layers: Some(4), ..args(Some(ModeArg::Thick)) }, "odd"),
            (WorldViewArgs { layers: Some(9), thickness: Some(90.0), ..args(Some(ModeArg::Thick)) }, "180"),
        ];
        for (args, word) in cases {
            let failure = select(&flat, &args).expect_err(word);
            assert!(failure.line().contains(word), "{failure}");
        }
    }

    #[test]
    fn all_that_is_solid_is_near_enough_unless_a_distance_is_given() {
        let world = world([1_000_000, 0, 0, 0], [1_000_100, 10, 10, 300]);
        let shot = select(&world, &WorldViewArgs::default()).expect("a view");
        let reach = shot.camera.reach(&world.solid_bounds().expect("solid"));
        assert!(f64::from(shot.distance) >= reach && f64::from(shot.distance) < reach * 1.01);
        let derived = derive(&world, &shot.view(&Environment::none()), 1 << 30).expect("derived");
        assert_eq!(derived.leaf_count(), 1);
        let near = WorldViewArgs { distance: Some(3.0), ..WorldViewArgs::default() };
        let shot = select(&world, &near).expect("a view");
        assert_eq!(derive(&world, &shot.view(&Environment::none()), 1 << 30).expect("derived").leaf_count(), 0);
    }

    #[test]
    fn a_scene_and_a_world_share_their_axes_and_the_eye() {
        let world = world([0; 4], [9, 9, 9, 1]);
        let mut eye = DVec3::new(0.1, 2.0, -3.0);
        let camera = |eye: DVec3| {
            let view = orthant_render::camera::View::look_at(eye, DVec3::ZERO, DVec3::Y, 1.0).expect("a view");
            view.to_camera(DVec3::new(5.0, 0.0, 0.0))
        };
        let args = WorldViewArgs { pos: Some("7,7,7,2.25".parse().expect("a point")), ..WorldViewArgs::default() };
        let (view, camera) = beside_scene(&world, &args, &mut eye, camera).expect("a view");
        assert_eq!(view.anchor, [6554, 2 << 16, -3 << 16, 9 << 14]);
        assert_eq!(eye.x, 6554.0 / 65_536.0, "both stand at the same point");
        assert_eq!(camera.position[0], (eye.x - 5.0) as f32);
        assert_eq!(view.layers[0].to_world(view.layers[0].forward)[..3], camera.forward);
        let turned = WorldViewArgs { yaw: Some(1.0), ..WorldViewArgs::default() };
        let failure = beside_scene(&world, &turned, &mut eye, |_| camera).expect_err("--yaw");
        assert!(failure.line().contains("--yaw"), "{failure}");
    }
}
