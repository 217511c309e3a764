//! [`SlotTree`]: one value over all rows of a buffer, kept while rows change.
//!
//! Each level joins [`FAN_OUT`] values of the one below; the lowest joins rows, which the owner makes values of when they
//! are asked for, so that a row takes a sixteenth of a value in memory. A changed row costs O(log n). Values are always
//! joined anew and never taken apart: the result is that of the rows as they are, in whatever order they came to be, and
//! sums do not drift.

/// Values that are joined to one.
pub const FAN_OUT: usize = 16;

/// Something that several values can be joined to.
pub trait Join: Copy + PartialEq {
    /// What a hole has: joined with a value it gives that value.
    const NOTHING: Self;

    /// Both together.
    fn join(self, other: Self) -> Self;
}

impl Join for f64 {
    const NOTHING: Self = 0.0;

    fn join(self, other: Self) -> Self {
        self + other
    }
}

/// See the module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SlotTree<T> {
    /// Lowest first. The last one has one value; there is none over no rows.
    levels: Vec<Vec<T>>,
    len: usize,
}

impl<T: Join> SlotTree<T> {
    /// Over a buffer of `len` rows.
    pub fn new(len: usize, value: impl Fn(usize) -> T) -> Self {
        let mut tree = Self { levels: Vec::new(), len: 0 };
        tree.update(len, [], value);
        tree
    }

    /// The value over all rows.
    pub fn total(&self) -> T {
        self.levels.last().map_or(T::NOTHING, |top| top[0])
    }

    /// Takes over that the buffer has `len` rows now and that those of `changed` are others; new rows need not be among
    /// them, and such past the end do not count. Returns how many values were made of rows.
    pub fn update(&mut self, len: usize, changed: impl IntoIterator<Item = u32>, value: impl Fn(usize) -> T) -> usize {
        let old_len = std::mem::replace(&mut self.len, len);
        let mut dirty: Vec<usize> =
            changed.into_iter().map(|row| row as usize).filter(|&row| row < len).map(|row| row / FAN_OUT).collect();
        // The last group of a buffer that grew or shrank has other rows, and groups past it are new.
        if old_len != len {
            dirty.extend(old_len.min(len) / FAN_OUT..len.div_ceil(FAN_OUT));
        }
        dirty.sort_unstable();
        dirty.dedup();

        let mut visited = 0;
        let mut count = len;
        for level in 0.. {
            if count == 0 || level > 0 && count == 1 {
                self.levels.truncate(level);
                break;
            }
            let groups = count.div_ceil(FAN_OUT);
            if level == self.levels.len() {
                // What is below may be old, and has not been joined here yet.
                self.levels.push(Vec::new());
                dirty = (0..groups).collect();
            }
            let (below, here) = self.levels.split_at_mut(level);
            here[0].resize(groups, T::NOTHING);
            dirty.retain(|&group| {
                let rows = group * FAN_OUT..count.min((group + 1) * FAN_OUT);
                let joined = match below.last() {
                    Some(below) => below[rows].iter().fold(T::NOTHING, |all, &one| all.join(one)),
                    None => {
                        visited += rows.len();
                        rows.fold(T::NOTHING, |all, row| all.join(value(row)))
                    }
                };
                std::mem::replace(&mut here[0][group], joined) != joined
            });
            // A level that grew or shrank changes the last group above it, whatever its values are.
            dirty.iter_mut().for_each(|group| *group /= FAN_OUT);
            dirty.dedup();
            let groups_before = count_at(old_len, level + 1);
            if groups_before != groups {
                dirty.retain(|&group| group < groups_before.min(groups) / FAN_OUT);
                dirty.extend(groups_before.min(groups) / FAN_OUT..groups.div_ceil(FAN_OUT));
            }
            count = groups;
        }
        visited
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        self.levels.iter().map(|level| size_of_val(level.as_slice()) as u64).sum()
    }
}

/// Values on a level, of which level 0 is the rows.
fn count_at(len: usize, level: usize) -> usize {
    (0..level).fold(len, |count, _| count.div_ceil(FAN_OUT))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash_mix;

    /// The numbers that are there, as the least and the greatest.
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Range(u32, u32);

    impl Join for Range {
        const NOTHING: Self = Self(u32::MAX, 0);

        fn join(self, other: Self) -> Self {
            Self(self.0.min(other.0), self.1.max(other.1))
        }
    }

    fn range(rows: &[u32]) -> impl Fn(usize) -> Range {
        |row| Range(rows[row], rows[row])
    }

    #[test]
    fn any_change_of_rows_and_of_their_number_is_followed() {
        let mut state = 3u32;
        let mut random = |below: u32| {
            state += 1;
            hash_mix(state) % below
        };
        for most in [3, 20, 300, 5000] {
            let mut rows: Vec<u32> = Vec::new();
            let mut tree = SlotTree::new(0, range(&rows));
            for _ in 0..600 {
                let mut changed = Vec::new();
                if random(4) == 0 {
                    rows.resize_with(random(most) as usize, || random(1_000_000));
                }
                for _ in 0..random(5).min(rows.len() as u32) {
                    let row = random(rows.len() as u32);
                    rows[row as usize] = random(1_000_000);
                    changed.push(row);
                }
                tree.update(rows.len(), changed, range(&rows));
                let expected = rows.iter().fold(Range::NOTHING, |all, &n| all.join(Range(n, n)));
                assert_eq!(tree.total(), expected);
                assert_eq!(
                    tree,
                    SlotTree::new(rows.len(), range(&rows)),
                    "every level is that of the rows as they are"
                );
            }
        }
    }

    #[test]
    fn a_changed_row_costs_its_group_whatever_the_size() {
        for len in [100, 10_000, 1_000_000] {
            let rows: Vec<u32> = (0..len).collect();
            let mut tree = SlotTree::new(rows.len(), range(&rows));
            assert_eq!(tree.update(rows.len(), [len / 2], range(&rows)), FAN_OUT);
            assert_eq!(tree.update(rows.len(), [], range(&rows)), 0);
            assert!(tree.bytes() <= u64::from(len) * 8 / 15 + 64);
        }
    }

    #[test]
    fn a_sum_is_what_the_rows_add_up_to_after_any_number_of_changes() {
        let mut rows = vec![1.0f64; 1000];
        let mut tree = SlotTree::new(rows.len(), |row| rows[row]);
        for step in 0..10_000u32 {
            let row = hash_mix(step) % 1000;
            rows[row as usize] = 10f64.powi((step % 40) as i32 - 20);
            tree.update(rows.len(), [row], |row| rows[row]);
        }
        rows.fill(0.1);
        tree.update(rows.len(), 0..1000, |row| rows[row]);
        assert_eq!(tree, SlotTree::new(rows.len(), |row| rows[row]));
        assert!((tree.total() - 100.0).abs() < 1e-9);
    }
}
