//! Which rows of a buffer have changed, and the writes that bring a copy up to date.

use orthant_resident::batch::{RowRange, RowWrites};

/// Of the rows that a range holds, at most this part may be unchanged: one range costs more than a few rows.
const MOST_WASTE: f64 = 0.2;

/// Changed rows of one buffer: a bitset, and the rows in the order in which they were marked.
#[derive(Clone, Debug, Default)]
pub struct DirtyRows {
    bits: Vec<u64>,
    rows: Vec<u32>,
}

impl DirtyRows {
    /// Marks a row.
    pub fn mark(&mut self, row: u32) {
        let (word, bit) = (row as usize / 64, 1u64 << (row % 64));
        if word >= self.bits.len() {
            self.bits.resize((word + 1).next_power_of_two(), 0);
        }
        if self.bits[word] & bit == 0 {
            self.bits[word] |= bit;
            self.rows.push(row);
        }
    }

    /// Whether a row is marked.
    pub fn is_marked(&self, row: u32) -> bool {
        self.bits.get(row as usize / 64).is_some_and(|word| word & 1 << (row % 64) != 0)
    }

    /// The rows that are marked, in the order in which they were.
    pub fn marked(&self) -> &[u32] {
        &self.rows
    }

    /// How many rows are marked.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether none is marked.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The rows, ascending; none is marked afterwards.
    fn take(&mut self) -> Vec<u32> {
        let mut rows = std::mem::take(&mut self.rows);
        for &row in &rows {
            self.bits[row as usize / 64] = 0;
        }
        rows.sort_unstable();
        rows
    }

    /// The writes for a copy of `rows` that has `resident` rows. Ranges join where that adds at most a quarter of what has
    /// changed; a buffer of which more than half has changed is written whole.
    pub fn writes<T: bytemuck::Pod>(&mut self, rows: &[T], resident: u32) -> RowWrites<T> {
        for new in resident..rows.len() as u32 {
            self.mark(new);
        }
        let changed = self.take();
        let len = rows.len() as u32;
        let changed: Vec<u32> = changed.into_iter().filter(|&row| row < len).collect();
        if changed.len() * 2 > rows.len() {
            return RowWrites::whole(rows.to_vec());
        }
        let mut ranges: Vec<(u32, u32, u32)> = Vec::new();
        for row in changed {
            match ranges.last_mut() {
                Some((first, end, count)) if fits(*first, row + 1, *count + 1) => {
                    (*end, *count) = (row + 1, *count + 1)
                }
                _ => ranges.push((row, row + 1, 1)),
            }
        }
        let range =
            |(first, end, _): (u32, u32, u32)| RowRange { first, rows: rows[first as usize..end as usize].to_vec() };
        RowWrites { len, ranges: ranges.into_iter().map(range).collect() }
    }
}

/// Whether two rows are the same bytes. That is what is resident; -0 and 0 are equal numbers, and not the same.
pub fn same_bytes<T: bytemuck::Pod>(a: &T, b: &T) -> bool {
    bytemuck::bytes_of(a) == bytemuck::bytes_of(b)
}

fn fits(first: u32, end: u32, changed: u32) -> bool {
    let all = f64::from(end - first);
    (all - f64::from(changed)) <= MOST_WASTE * all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn writes(rows: usize, changed: &[u32]) -> Vec<(u32, usize)> {
        let rows: Vec<u32> = (0..rows as u32).collect();
        let mut dirty = DirtyRows::default();
        changed.iter().for_each(|&row| dirty.mark(row));
        let writes = dirty.writes(&rows, rows.len() as u32);
        assert!(dirty.is_empty() && dirty.bits.iter().all(|&word| word == 0));
        for range in &writes.ranges {
            assert!(range.rows.iter().enumerate().all(|(i, &row)| row == range.first + i as u32));
        }
        writes.ranges.iter().map(|range| (range.first, range.rows.len())).collect()
    }

    #[test]
    fn one_row_is_one_row() {
        assert_eq!(writes(1000, &[7]), [(7, 1)]);
        assert_eq!(writes(1000, &[]), []);
    }

    #[test]
    fn near_rows_join_where_little_is_wasted() {
        assert_eq!(writes(1000, &[12, 10, 11, 13, 15, 10]), [(10, 6)]);
        assert_eq!(writes(1000, &[10, 12]), [(10, 1), (12, 1)]);
        let scattered: Vec<u32> = (0..100).map(|i| i * 9).collect();
        assert_eq!(writes(1000, &scattered).len(), 100);
        // Never more than a quarter of what has changed.
        for seed in 0..50u32 {
            let changed: Vec<u32> = (0..40).map(|i| (i * i * 7 + i * seed * 13) % 300).collect();
            let distinct = changed.iter().collect::<std::collections::HashSet<_>>().len();
            let written: usize = writes(1000, &changed).iter().map(|range| range.1).sum();
            assert!(written * 4 <= distinct * 5, "{written} rows for {distinct}");
        }
    }

    #[test]
    fn a_buffer_that_is_mostly_new_is_written_whole() {
        assert_eq!(writes(10, &[0, 2, 4, 6, 8, 9]), [(0, 10)]);
        let mut dirty = DirtyRows::default();
        let grown = dirty.writes(&[1u32, 2, 3, 4, 5], 4);
        assert_eq!((grown.len, grown.ranges.len(), grown.ranges[0].first), (5, 1, 4));
    }
}
