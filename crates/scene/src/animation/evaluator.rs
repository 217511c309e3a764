//! An animation made ready to be played.

use super::pose::Pose;
use super::target::{Property, Target, Value};
use super::track::{Blend, KeyFrames, Track};
use super::{AnimationError, AnimationWarning};
use crate::Scene;
use crate::edit::ops::decompose;
use crate::edit::{ChangeSet, Facets};
use crate::model::{AnimationId, AnyId, Id, Node, NodeId, Store, Transform};
use std::collections::BTreeMap;

/// An animation of a document as it is now: key frames decoded and checked, targets found. A frame costs its channels.
#[derive(Clone, Debug)]
pub struct Evaluator {
    animation: AnimationId,
    tracks: Vec<Track>,
    /// Ascending by target.
    channels: Vec<Channel>,
    /// Objects whose changes can change what is played, ascending.
    depends_on: Vec<AnyId>,
    warnings: Vec<AnimationWarning>,
}

/// A target and the track that it follows.
#[derive(Clone, Copy, Debug)]
struct Channel {
    target: Target,
    track: usize,
    /// Numbers that the target has.
    width: usize,
}

impl Evaluator {
    /// Makes an animation ready. The key frames may take `max_bytes`.
    ///
    /// # Errors
    /// Data that makes no sense: no keys, times that do not rise, values that are not as many as the target needs or not
    /// finite, a target whose matrix shears.
    pub fn new(scene: &Scene, animation: AnimationId, max_bytes: u64) -> Result<Self, AnimationError> {
        Self::with_frames(scene, animation, &mut KeyFrames::default(), max_bytes)
    }

    /// [`Evaluator::new`], with key frames that are decoded already.
    pub(super) fn with_frames(
        scene: &Scene,
        id: AnimationId,
        frames: &mut KeyFrames,
        max_bytes: u64,
    ) -> Result<Self, AnimationError> {
        let slot = Store::<_, ()>::slot(id);
        let Some(animation) = scene.animations().get(id) else {
            let what = "there is no such animation: it never was, or has been deleted";
            return Err(AnimationError::new(format!("/animations/{slot}"), what, "play another one"));
        };
        let mut tracks = Vec::new();
        let mut track_of: Vec<Option<usize>> = vec![None; animation.samplers.len()];
        let mut channels: BTreeMap<Target, Channel> = BTreeMap::new();
        let mut warnings = Vec::new();
        let mut depends_on = vec![AnyId::from(id)];
        for (i, channel) in animation.channels.iter().enumerate() {
            let place = || format!("/animations/{slot}/channels/{i}/target");
            let mut warn = |what: String| warnings.push(AnimationWarning { place: place(), what });
            let target = match Target::of(channel) {
                Ok(target) => target,
                Err(what) => {
                    warn(what);
                    continue;
                }
            };
            depends_on.push(target.object);
            let width = match Width::of(scene, &target) {
                Ok(width) => width,
                Err(Unplayable::Nothing(what)) => {
                    warn(what);
                    continue;
                }
                Err(Unplayable::Shear) => {
                    let what = "its node has a matrix that shears, which cannot be taken apart to be animated";
                    return Err(AnimationError::new(place(), what, "give the node translation, rotation and scale"));
                }
            };
            if let (Property::Weights | Property::Weight(_), AnyId::Node(node)) = (target.property, target.object) {
                depends_on.extend(scene.nodes().get(node).and_then(|node| node.mesh).map(AnyId::from));
            }
            let track = match track_of.get(channel.sampler).copied().flatten() {
                Some(track) => track,
                None => {
                    tracks.push(Track::read(scene, id, animation, channel.sampler, frames, max_bytes)?);
                    track_of[channel.sampler] = Some(tracks.len() - 1);
                    tracks.len() - 1
                }
            };
            let output = || format!("/animations/{slot}/samplers/{}/output", channel.sampler);
            let found = tracks[track].width();
            if found != width.numbers
                || width.is_whole && !is_element(scene, animation.samplers[channel.sampler].output, found)
            {
                let what = format!("a key holds {found} numbers where {} need {}", width.of_what, width.numbers);
                return Err(AnimationError::new(output(), what, "export the animation anew"));
            }
            if target.property == Property::Visible && !tracks[track].is_stepped() {
                let what = "what is either true or false cannot be interpolated";
                return Err(AnimationError::new(output(), what, "set the sampler's interpolation to STEP"));
            }
            let channel = Channel { target, track, width: width.numbers };
            if channels.insert(target, channel).is_some() {
                warn("another channel moves the same; only this one is played".to_owned());
            }
        }
        depends_on.sort_unstable();
        depends_on.dedup();
        Ok(Self { animation: id, tracks, channels: channels.into_values().collect(), depends_on, warnings })
    }

    /// The animation.
    pub fn animation(&self) -> AnimationId {
        self.animation
    }

    /// The time of the last key, in seconds. The first may be later than 0.
    pub fn duration(&self) -> f64 {
        self.tracks.iter().map(Track::end).fold(0.0, f64::max)
    }

    /// Channels that are not played as the document says, each once.
    pub fn warnings(&self) -> &[AnimationWarning] {
        &self.warnings
    }

    /// The pose at a time, in seconds. Before the first key of a channel it has that one's value, after the last the last
    /// one's.
    pub fn pose(&self, seconds: f64) -> Pose {
        let value = |channel: &Channel| {
            let track = &self.tracks[channel.track];
            let blend = if channel.target.property == Property::Rotation { Blend::Rotation } else { Blend::Numbers };
            let value = match channel.target.property {
                Property::Weights => {
                    let mut weights = vec![0.0; channel.width];
                    track.sample(seconds, blend, &mut weights);
                    Value::Weights(weights.into())
                }
                property => {
                    let mut numbers = [0.0; 4];
                    track.sample(seconds, blend, &mut numbers[..channel.width]);
                    match property {
                        Property::Visible => Value::Flag(numbers[0] != 0.0),
                        _ => Value::Numbers(numbers),
                    }
                }
            };
            (channel.target, value)
        };
        Pose::from_sorted(self.channels.iter().map(value).collect())
    }

    /// Whether edits have touched what decides how it is played, so that it has to be made ready anew.
    pub fn is_touched(&self, changes: &ChangeSet) -> bool {
        let decides = |id: &AnyId, facets: &Facets| match id {
            // A value of a node that is animated is below the pose. What it shows decides how many weights it has.
            AnyId::Node(_) => facets.has(Facets::ADDED | Facets::REMOVED | Facets::SHAPE),
            _ => true,
        };
        changes.objects().iter().any(|(id, facets)| self.depends_on.binary_search(id).is_ok() && decides(id, facets))
    }
}

/// What a target needs of a key.
struct Width {
    numbers: usize,
    of_what: &'static str,
    /// All numbers are one element of the accessor.
    is_whole: bool,
}

/// Why a target cannot be played.
enum Unplayable {
    /// There is nothing of that name: a warning.
    Nothing(String),
    /// A matrix that cannot be taken apart.
    Shear,
}

impl Width {
    fn of(scene: &Scene, target: &Target) -> Result<Self, Unplayable> {
        let whole = |numbers, of_what| Ok(Self { numbers, of_what, is_whole: true });
        let nothing = |what: &str| Err(Unplayable::Nothing(format!("{what}; it is not played")));
        let (object, property) = (target.object, target.property);
        match (object, property) {
            (AnyId::Node(id), Property::Translation | Property::Rotation | Property::Scale) => {
                let Some(node) = scene.nodes().get(id) else { return nothing("its node is gone") };
                if is_sheared(node) {
                    return Err(Unplayable::Shear);
                }
                match property {
                    Property::Rotation => whole(4, "rotations"),
                    _ => whole(3, "translations and scales"),
                }
            }
            (AnyId::Node(_), Property::Visible) => whole(1, "truth values"),
            (_, Property::Weight(index)) => match targets(scene, object) {
                Some(count) if (index as usize) < count => whole(1, "single weights"),
                _ => nothing("its mesh has no such morph target"),
            },
            (_, Property::Weights) => match targets(scene, object) {
                Some(count) if count > 0 => {
                    Ok(Self { numbers: count, of_what: "its mesh's morph targets", is_whole: false })
                }
                _ => nothing("its mesh has no morph targets"),
            },
            (AnyId::Material(id), Property::Material(property)) => {
                let mut material = scene.materials().get(id).cloned();
                match material.as_mut().and_then(|material| property.write(material, &[])) {
                    Some(width) => whole(width, "the property"),
                    None => nothing("its material does not have that property"),
                }
            }
            (AnyId::Light(id), Property::Light(property)) => {
                match scene.lights().get(id).cloned().and_then(|mut light| property.write(&mut light, &[])) {
                    Some(width) => whole(width, "the property"),
                    None => nothing("its light does not have that property"),
                }
            }
            (AnyId::Camera(id), Property::Camera(property)) => {
                match scene.cameras().get(id).cloned().and_then(|mut camera| property.write(&mut camera, &[])) {
                    Some(width) => whole(width, "the property"),
                    None => nothing("its camera does not have that property"),
                }
            }
            _ => nothing("its object does not have that property"),
        }
    }
}

fn is_sheared(node: &Node) -> bool {
    matches!(node.transform, Transform::Matrix(_)) && decompose(&node.transform.to_affine()).is_none()
}

/// The morph targets of a mesh, or of the mesh of a node.
fn targets(scene: &Scene, object: AnyId) -> Option<usize> {
    let mesh = match object {
        AnyId::Mesh(id) => id,
        id => scene.nodes().get(NodeId::from_any(id)?)?.mesh?,
    };
    scene.meshes().get(mesh)?.primitives.iter().map(|primitive| primitive.targets.len()).max()
}

/// Whether an element of an accessor has as many components.
fn is_element(scene: &Scene, accessor: crate::model::AccessorId, components: usize) -> bool {
    scene.accessors().get(accessor).is_some_and(|accessor| accessor.element_type.components() == components)
}
