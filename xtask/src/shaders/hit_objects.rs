//! Hit objects are not copied. The compiler, which does not optimise, passes one on by loading it and storing it in a variable
//! of its own; SPIR-V gives a copy of an `OpTypeHitObjectNV` no meaning, and a driver was seen to crash over it. Where a
//! variable only ever holds such a copy, what it was copied from stands in its place.

use super::strip::{HEADER, instructions, opcode};
use std::collections::{HashMap, HashSet};

const TYPE_HIT_OBJECT: u32 = 5281;
const TYPE_POINTER: u32 = 32;
const VARIABLE: u32 = 59;
const LOAD: u32 = 61;
const STORE: u32 = 62;
/// The instructions on hit objects and their neighbours in the grammar: those that take a pointer to one.
const ON_HIT_OBJECTS: std::ops::RangeInclusive<u32> = 5249..=5290;

/// The module without copies.
pub fn alias(module: &[u32]) -> Result<Vec<u32>, String> {
    let all: Vec<&[u32]> = instructions(module).collect::<Result<_, _>>()?;
    let is = |instruction: &[u32], op: u32, words: usize| opcode(instruction[0]) == op && instruction.len() >= words;
    let types: HashSet<u32> = all.iter().filter(|i| is(i, TYPE_HIT_OBJECT, 2)).map(|i| i[1]).collect();
    if types.is_empty() {
        return Ok(module.to_vec());
    }
    let pointers: HashSet<u32> =
        all.iter().filter(|i| is(i, TYPE_POINTER, 4) && types.contains(&i[3])).map(|i| i[1]).collect();
    let mut loaded: HashMap<u32, u32> = HashMap::new();
    let mut copies: HashMap<u32, u32> = HashMap::new();
    for i in &all {
        if is(i, LOAD, 4) && types.contains(&i[1]) {
            loaded.insert(i[2], *copies.get(&i[3]).unwrap_or(&i[3]));
        } else if is(i, STORE, 3)
            && let Some(&from) = loaded.get(&i[2])
            && copies.insert(i[1], from).is_some_and(|before| before != from)
        {
            return Err(format!("the variable %{} holds copies of two hit objects", i[1]));
        }
    }
    let mut out = module[..HEADER].to_vec();
    for i in &all {
        let goes = is(i, LOAD, 4) && types.contains(&i[1])
            || is(i, STORE, 3) && loaded.contains_key(&i[2])
            || is(i, VARIABLE, 4) && pointers.contains(&i[1]) && copies.contains_key(&i[2]);
        if goes {
            continue;
        }
        out.push(i[0]);
        let on_hit_objects = ON_HIT_OBJECTS.contains(&opcode(i[0]));
        out.extend(i[1..].iter().map(|word| if on_hit_objects { *copies.get(word).unwrap_or(word) } else { *word }));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instruction(opcode: u32, operands: &[u32]) -> Vec<u32> {
        [&[(operands.len() as u32 + 1) << 16 | opcode], operands].concat()
    }

    fn module(instructions: &[Vec<u32>]) -> Vec<u32> {
        [vec![0x0723_0203, 0x0001_0500, 0, 10, 0], instructions.concat()].concat()
    }

    #[test]
    fn a_copied_hit_object_is_the_one_that_it_was_copied_from() {
        let (object, pointer, [traced, sorted]) = (1, 2, [3, 4]);
        let types = [instruction(TYPE_HIT_OBJECT, &[object]), instruction(TYPE_POINTER, &[pointer, 7, object])];
        let variable = |id: u32| instruction(VARIABLE, &[pointer, id, 7]);
        let trace = instruction(5260, &[traced, 9]);
        let copy = [instruction(LOAD, &[object, 5, traced]), instruction(STORE, &[sorted, 5])];
        let before =
            [&types[..], &[variable(traced), variable(sorted), trace.clone()], &copy, &[instruction(5279, &[sorted])]];
        let after = [&types[..], &[variable(traced), trace, instruction(5279, &[traced])]];
        assert_eq!(alias(&module(&before.concat())), Ok(module(&after.concat())));
        let none = module(&[instruction(LOAD, &[object, 5, traced])]);
        assert_eq!(alias(&none), Ok(none.clone()), "a module without hit objects is left alone");
    }
}
