//! Which time of which animation is shown.

use crate::failure::Failure;
use orthant_scene::Scene;
use orthant_scene::animation::{AnimationError, AnimationWarning, Evaluator, Pose};
use orthant_scene::model::AnimationId;
use std::path::Path;

/// A time of an animation.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// Seconds.
    pub seconds: f64,
    /// The animation, by index or name; the first, if none is asked for.
    pub animation: Option<&'a str>,
}

/// The pose of a moment, and what of it is not shown as the file says.
///
/// # Errors
/// An animation that the file does not have (usage), or that makes no sense (bad input).
pub fn pose(
    scene: &Scene,
    moment: Moment<'_>,
    path: &Path,
    max_bytes: u64,
) -> Result<(Pose, Vec<AnimationWarning>), Failure> {
    let id = find(scene, moment.animation, path)?;
    let evaluator = Evaluator::new(scene, id, max_bytes).map_err(|e| failure(e, path))?;
    Ok((evaluator.pose(moment.seconds), evaluator.warnings().to_vec()))
}

fn find(scene: &Scene, reference: Option<&str>, path: &Path) -> Result<AnimationId, Failure> {
    let animations = scene.animations();
    let Some(reference) = reference else {
        let none = || Failure::usage("--time: the file has no animations").in_file(path).remedy("leave --time out");
        return animations.ids().next().ok_or_else(none);
    };
    let by_index = reference.parse::<usize>().ok().and_then(|index| animations.ids().nth(index));
    let by_name = || animations.iter().find(|(_, a)| a.name.as_deref() == Some(reference)).map(|(id, _)| id);
    by_index.or_else(by_name).ok_or_else(|| {
        let name = |(i, a): (usize, &orthant_scene::model::Animation)| match &a.name {
            Some(name) => format!("{i} ({name})"),
            None => i.to_string(),
        };
        let names: Vec<String> = animations.values().enumerate().map(name).collect();
        let known = if names.is_empty() { "no animations".into() } else { format!("only {}", names.join(", ")) };
        Failure::usage(format!("--animation {reference}: the file has {known}")).in_file(path)
    })
}

/// An animation that cannot be played is bad input.
fn failure(error: AnimationError, path: &Path) -> Failure {
    Failure::bad_input(path, error.what).at(error.place).remedy(error.remedy)
}
