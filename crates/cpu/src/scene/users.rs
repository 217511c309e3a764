//! Which rows show a RenderPrimitive: lists that are linked through the rows, so that a change costs O(1).

use orthant_resident::rows::{NodeFlags, RenderNodeRow};

/// No row.
const NONE: u32 = u32::MAX;

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct PrimitiveUsers {
    /// By RenderPrimitive: its first row.
    first: Vec<u32>,
    /// By row: its neighbours in the list that it is in, the one before first.
    links: Vec<[u32; 2]>,
}

impl PrimitiveUsers {
    /// Makes room for rows.
    pub fn reserve(&mut self, rows: usize) {
        self.links.reserve(rows.saturating_sub(self.links.len()));
    }

    /// Puts a row, which is in no list, into the list of a RenderPrimitive.
    pub fn link(&mut self, row: u32, primitive: u32) {
        if self.first.len() <= primitive as usize {
            self.first.resize(primitive as usize + 1, NONE);
        }
        if self.links.len() <= row as usize {
            self.links.resize(row as usize + 1, [NONE; 2]);
        }
        let next = std::mem::replace(&mut self.first[primitive as usize], row);
        self.links[row as usize] = [NONE, next];
        if next != NONE {
            self.links[next as usize][0] = row;
        }
    }

    /// Takes a row out of the list of the RenderPrimitive that it shows.
    pub fn unlink(&mut self, row: u32, primitive: u32) {
        let [before, next] = std::mem::replace(&mut self.links[row as usize], [NONE; 2]);
        if next != NONE {
            self.links[next as usize][0] = before;
        }
        if before != NONE {
            self.links[before as usize][1] = next;
        } else {
            self.first[primitive as usize] = next;
        }
    }

    /// The rows that show a RenderPrimitive.
    pub fn of(&self, primitive: u32) -> impl Iterator<Item = u32> + '_ {
        let some = |row: u32| (row != NONE).then_some(row);
        let first = self.first.get(primitive as usize).copied().and_then(some);
        std::iter::successors(first, move |&row| some(self.links[row as usize][1]))
    }

    /// Checks that each list has the rows that show its RenderPrimitive, each once, and no others. Looks at everything.
    ///
    /// # Errors
    /// What is wrong, and where.
    pub fn validate(&self, rows: &[RenderNodeRow]) -> Result<(), String> {
        let shows = |row: &RenderNodeRow| row.flags & NodeFlags::OCCUPIED != 0;
        let mut listed = 0;
        for primitive in 0..self.first.len() as u32 {
            let mut before = NONE;
            for row in self.of(primitive) {
                listed += 1;
                let is_user = rows.get(row as usize).is_some_and(|r| shows(r) && r.primitive == primitive);
                if !is_user || self.links[row as usize][0] != before || listed > rows.len() {
                    return Err(format!("the users of RenderPrimitive {primitive}: row {row} does not belong there"));
                }
                before = row;
            }
        }
        let expected = rows.iter().filter(|row| shows(row)).count();
        if listed == expected { Ok(()) } else { Err(format!("{listed} rows are listed as users, of {expected}")) }
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        (4 * self.first.len() + 8 * self.links.len()) as u64
    }
}
