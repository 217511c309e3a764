//! Animations. They are kept for playing and saving; what is odd about one does not keep the scene from being shown.

use super::{Converter, Members, Result, invalid};
use crate::import::gltf::schema;
use crate::model::*;
use crate::place::At;

impl Converter<'_> {
    pub(super) fn animations(&mut self, animations: Vec<schema::Animation<'_>>) -> Result<()> {
        let at = &At::Root.key("animations");
        for (i, a) in animations.into_iter().enumerate() {
            let animation = self.animation(a, &at.index(i))?;
            self.scene.animations.insert_nth(i, animation);
        }
        Ok(())
    }

    fn animation(&mut self, a: schema::Animation<'_>, at: &At<'_>) -> Result<Animation> {
        let samplers_at = &at.key("samplers");
        let mut samplers = Vec::with_capacity(a.samplers.len());
        for (i, s) in a.samplers.into_iter().enumerate() {
            samplers.push(self.animation_sampler(s, &samplers_at.index(i))?);
        }
        let channels_at = &at.key("channels");
        let mut channels = Vec::with_capacity(a.channels.len());
        for (i, c) in a.channels.into_iter().enumerate() {
            channels.extend(self.animation_channel(c, samplers.len(), &channels_at.index(i))?);
        }
        let extra = Members::new(a.extensions, a.rest).finish(a.extras, at)?;
        Ok(Animation { name: a.name, channels, samplers, extra })
    }

    fn animation_sampler(&mut self, s: schema::AnimationSampler<'_>, at: &At<'_>) -> Result<AnimationSampler> {
        let input = self.counts.accessor(s.input, &at.key("input"))?;
        let output = self.counts.accessor(s.output, &at.key("output"))?;
        let mut stated = Stated::default();
        let interpolation = match stated.note(Member::Interpolation, s.interpolation) {
            None | Some(schema::Interpolation::Linear) => Interpolation::Linear,
            Some(schema::Interpolation::Step) => Interpolation::Step,
            Some(schema::Interpolation::CubicSpline) => Interpolation::CubicSpline,
        };
        let (times, values) = (&self.scene.accessors[input], &self.scene.accessors[output]);
        let (is_time, times, values) = (times.element_type == ElementType::Scalar, times.count, values.count);
        if !is_time {
            self.tolerate("the times of an animation are not scalars", &at.key("input"));
        }
        let per_key = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        // Weights have one value per morph target and key.
        if times.checked_mul(per_key).is_none_or(|keys| keys == 0 || values % keys != 0) {
            self.tolerate("an animation has not as many values as times", &at.key("output"));
        }
        let extra = Members::new(s.extensions, s.rest).finish(s.extras, at)?.stating(stated);
        Ok(AnimationSampler { input, interpolation, output, extra })
    }

    fn animation_channel(
        &mut self,
        c: schema::AnimationChannel<'_>,
        samplers: usize,
        at: &At<'_>,
    ) -> Result<Option<AnimationChannel>> {
        if c.sampler.0 >= samplers as u64 {
            let what = format!("there is no sampler {}; the animation has {samplers}", c.sampler.0);
            return invalid(&at.key("sampler"), what);
        }
        let target_at = &at.key("target");
        let node = c.target.node.map(|n| self.counts.node(n, &target_at.key("node"))).transpose()?;
        let path = match c.target.path.as_str() {
            "translation" => AnimationPath::Translation,
            "rotation" => AnimationPath::Rotation,
            "scale" => AnimationPath::Scale,
            "weights" => AnimationPath::Weights,
            "pointer" => AnimationPath::Pointer,
            _ => {
                self.tolerate("an animation channel moves what is not known; it is dropped", &target_at.key("path"));
                return Ok(None);
            }
        };
        Ok(Some(AnimationChannel {
            sampler: c.sampler.0 as usize,
            node,
            path,
            target_extra: Members::new(c.target.extensions, c.target.rest).finish(c.target.extras, target_at)?,
            extra: Members::new(c.extensions, c.rest).finish(c.extras, at)?,
        }))
    }
}
