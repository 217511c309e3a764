//! One vertex per distinct combination of position, texture coordinate and normal, numbered in order of first use.

use super::corner::Corner;
use std::collections::HashMap;

/// How many vertices of one position are compared one by one before a hash table takes over: a file may give one
/// position any number of normals, and may not be slow for it.
const LONGEST_CHAIN: usize = 16;

const END: u32 = u32::MAX;

/// Finds the first vertex of a position. A table over all positions is quickest; where a primitive uses few of many, it
/// would cost more than the primitive.
enum Heads {
    /// Vertex plus one, by position; 0 where there is none (memory from the system is zero).
    Dense(Vec<u32>),
    Sparse(HashMap<u32, u32>),
}

/// Builds the vertices and indices of one primitive.
pub struct Welder {
    heads: Heads,
    /// The next vertex of the same position.
    next: Vec<u32>,
    overflow: HashMap<Corner, u32>,
    /// Distinct corners.
    pub vertices: Vec<Corner>,
}

impl Welder {
    /// `positions` are those of the whole file, `corners` an upper bound for what will be added.
    pub fn new(positions: usize, corners: usize) -> Self {
        let heads =
            if corners >= positions / 4 { Heads::Dense(vec![0; positions]) } else { Heads::Sparse(HashMap::new()) };
        Self { heads, next: Vec::new(), overflow: HashMap::new(), vertices: Vec::new() }
    }

    /// The vertex of a corner.
    #[inline]
    pub fn add(&mut self, corner: Corner) -> u32 {
        let new = self.vertices.len() as u32;
        let head = match &mut self.heads {
            Heads::Dense(heads) => &mut heads[corner.v as usize],
            Heads::Sparse(heads) => heads.entry(corner.v).or_insert(0),
        };
        if *head == 0 {
            *head = new + 1;
            return self.append(corner);
        }
        let mut vertex = *head - 1;
        for length in 1..=LONGEST_CHAIN {
            if self.vertices[vertex as usize] == corner {
                return vertex;
            }
            match self.next[vertex as usize] {
                END if length == LONGEST_CHAIN => break,
                END => {
                    self.next[vertex as usize] = new;
                    return self.append(corner);
                }
                next => vertex = next,
            }
        }
        if let Some(&known) = self.overflow.get(&corner) {
            return known;
        }
        self.overflow.insert(corner, new);
        self.append(corner)
    }

    fn append(&mut self, corner: Corner) -> u32 {
        self.vertices.push(corner);
        self.next.push(END);
        self.vertices.len() as u32 - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_corners_are_one_vertex_however_many_share_a_position() {
        for positions in [2, 1_000_000] {
            let mut welder = Welder::new(positions, 300);
            for round in 0..2 {
                for i in 0..100 {
                    let corner = Corner { v: i % 2, t: i, n: 7 };
                    assert_eq!(welder.add(corner), i, "round {round}");
                }
            }
            assert_eq!(welder.vertices.len(), 100);
        }
    }
}
