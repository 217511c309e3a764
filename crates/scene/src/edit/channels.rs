//! Channels of animations that go and come, without a copy of the others.

use super::step::{Execution, Step};
use crate::edit::Facets;
use crate::model::*;
use crate::visit::Owner;

impl Execution<'_> {
    /// Takes channels out, and samplers that only they had. Both by index, ascending.
    pub(super) fn take_channels(&mut self, id: AnimationId, channels: &[usize], samplers: &[usize]) -> Step {
        let mut taken = Animation::default();
        let mut places = (Vec::new(), Vec::new());
        if let Some(animation) = self.scene.animations.get_mut(id) {
            (places.0, taken.channels) = take(&mut animation.channels, channels).into_iter().unzip();
            (places.1, taken.samplers) = take(&mut animation.samplers, samplers).into_iter().unzip();
            if !places.1.is_empty() {
                let before = |sampler: usize| places.1.partition_point(|&gone| gone < sampler);
                animation.channels.iter_mut().for_each(|channel| channel.sampler -= before(channel.sampler));
            }
        }
        self.count_parts(id, &taken, false);
        Step::PutChannels {
            animation: id,
            channels: places.0.into_iter().zip(taken.channels).collect(),
            samplers: places.1.into_iter().zip(taken.samplers).collect(),
        }
    }

    /// Puts channels and samplers where they will be, by index, ascending. The channels name samplers by the numbers that
    /// these have then.
    pub(super) fn put_channels(
        &mut self,
        id: AnimationId,
        channels: Vec<(usize, AnimationChannel)>,
        samplers: Vec<(usize, AnimationSampler)>,
    ) -> Step {
        let (channel_places, new_channels): (Vec<usize>, Vec<AnimationChannel>) = channels.into_iter().unzip();
        let (sampler_places, new_samplers): (Vec<usize>, Vec<AnimationSampler>) = samplers.into_iter().unzip();
        let new = Animation { channels: new_channels, samplers: new_samplers, ..Animation::default() };
        self.count_parts(id, &new, true);
        if let Some(animation) = self.scene.animations.get_mut(id) {
            if !sampler_places.is_empty() {
                // The n-th place that stays free of new ones.
                let moved = |sampler: usize| {
                    sampler_places.iter().fold(sampler, |at, &place| if place <= at { at + 1 } else { at })
                };
                let map: Vec<usize> = (0..animation.samplers.len()).map(moved).collect();
                animation.channels.iter_mut().for_each(|channel| channel.sampler = map[channel.sampler]);
            }
            put(&mut animation.samplers, &sampler_places, new.samplers);
            put(&mut animation.channels, &channel_places, new.channels);
        }
        Step::TakeChannels { animation: id, channels: channel_places, samplers: sampler_places }
    }

    fn count_parts(&mut self, id: AnimationId, parts: &Animation, add: bool) {
        self.visited += (parts.channels.len() + parts.samplers.len()) as u64;
        self.index.count_animation(Owner::Object(id.into()), parts, add);
        self.changes.touch(id, Facets::CONTENT);
    }
}

/// Takes elements out, each with its index.
fn take<T>(all: &mut Vec<T>, indices: &[usize]) -> Vec<(usize, T)> {
    let (mut at, mut next) = (0, indices.iter().peekable());
    let mut is_taken = |_: &mut T| {
        let is = next.next_if(|&&index| index == at).is_some();
        at += 1;
        is
    };
    let taken: Vec<T> = match indices {
        [] => Vec::new(),
        _ => all.extract_if(.., &mut is_taken).collect(),
    };
    indices.iter().copied().zip(taken).collect()
}

/// Puts elements where they will be. O(all).
fn put<T>(all: &mut Vec<T>, places: &[usize], new: Vec<T>) {
    if places.is_empty() {
        return;
    }
    if places.first().is_some_and(|&first| first >= all.len()) {
        all.extend(new);
        return;
    }
    let mut old = std::mem::take(all).into_iter();
    let mut new = places.iter().copied().zip(new).peekable();
    all.reserve(old.len() + places.len());
    loop {
        let element = match new.next_if(|(place, _)| *place == all.len()) {
            Some((_, element)) => Some(element),
            None => old.next(),
        };
        match element.or_else(|| new.next().map(|(_, element)| element)) {
            Some(element) => all.push(element),
            None => break,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_is_put_back_where_it_was() {
        for indices in [&[][..], &[0], &[4], &[0, 1, 4], &[1, 3], &[0, 1, 2, 3, 4]] {
            let mut all: Vec<u32> = (0..5).collect();
            let (places, taken): (Vec<usize>, Vec<u32>) = take(&mut all, indices).into_iter().unzip();
            assert_eq!(all.len() + taken.len(), 5);
            assert!(taken.iter().zip(indices).all(|(&value, &index)| value as usize == index));
            put(&mut all, &places, taken);
            assert_eq!(all, [0, 1, 2, 3, 4], "{indices:?}");
        }
    }
}
