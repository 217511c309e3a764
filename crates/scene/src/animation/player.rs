//! A player: an animation that stays ready while the scene is edited.

use super::track::KeyFrames;
use super::{AnimationError, AnimationWarning, Evaluator, Pose};
use crate::Scene;
use crate::edit::Cursor;
use crate::model::AnimationId;

/// Gives the poses of animations of one scene. The last one that was played is kept ready, and made ready again when an edit
/// has changed it.
#[derive(Clone, Debug)]
pub struct AnimationPlayer {
    max_bytes: u64,
    frames: KeyFrames,
    ready: Option<(Evaluator, Cursor)>,
    evaluators_made: u64,
}

impl AnimationPlayer {
    /// `max_bytes` is what the key frames may take.
    pub fn new(max_bytes: u64) -> Self {
        Self { max_bytes, frames: KeyFrames::default(), ready: None, evaluators_made: 0 }
    }

    /// The pose of an animation at a time, in seconds.
    ///
    /// # Errors
    /// An animation that cannot be played.
    pub fn pose(&mut self, scene: &Scene, animation: AnimationId, seconds: f64) -> Result<Pose, AnimationError> {
        self.prepare(scene, animation).map(|evaluator| evaluator.pose(seconds))
    }

    /// Makes an animation ready, if it is not.
    ///
    /// # Errors
    /// An animation that cannot be played.
    pub fn prepare(&mut self, scene: &Scene, animation: AnimationId) -> Result<&Evaluator, AnimationError> {
        let mut is_ready = false;
        if let Some((evaluator, cursor)) = &mut self.ready {
            let changes = scene.change_log().take(cursor);
            let is_touched = changes.is_none_or(|changes| evaluator.is_touched(&changes));
            is_ready = evaluator.animation() == animation && !is_touched;
        }
        if !is_ready {
            self.ready = None;
            let evaluator = Evaluator::with_frames(scene, animation, &mut self.frames, self.max_bytes);
            self.frames.trim();
            let evaluator = evaluator?;
            self.evaluators_made += 1;
            self.ready = Some((evaluator, scene.change_log().cursor()));
        }
        let (evaluator, _) = self.ready.as_ref().expect("it was ready, or has just been made");
        Ok(evaluator)
    }

    /// Channels of the animation that is ready which are not played as the document says.
    pub fn warnings(&self) -> &[AnimationWarning] {
        self.ready.as_ref().map_or(&[], |(evaluator, _)| evaluator.warnings())
    }

    /// How often an animation was made ready.
    pub fn evaluators_made(&self) -> u64 {
        self.evaluators_made
    }
}
