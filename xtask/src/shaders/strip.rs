//! Takes out of a module what no driver needs: sources, strings, lines and most names. Older validation layers refuse the
//! language that `OpSource` names. The names of structs with a layout stay, for the tests that compare these.

use std::collections::HashSet;

/// Words before the instructions.
pub(super) const HEADER: usize = 5;
const MAGIC: u32 = 0x0723_0203;

// Opcodes of the SPIR-V specification, section 3.49.
const SOURCE_CONTINUED: u32 = 2;
const SOURCE: u32 = 3;
const SOURCE_EXTENSION: u32 = 4;
const NAME: u32 = 5;
const MEMBER_NAME: u32 = 6;
const STRING: u32 = 7;
const LINE: u32 = 8;
const MEMBER_DECORATE: u32 = 72;
const NO_LINE: u32 = 317;
const MODULE_PROCESSED: u32 = 330;

/// The decoration `Offset`.
const OFFSET: u32 = 35;

/// The module without them.
pub fn strip(module: &[u32]) -> Result<Vec<u32>, String> {
    if module.len() < HEADER || module[0] != MAGIC {
        return Err("the compiler's output is no SPIR-V module".into());
    }
    let mut laid_out = HashSet::new();
    for instruction in instructions(module) {
        if let [first, target, _, OFFSET, ..] = *instruction?
            && opcode(first) == MEMBER_DECORATE
        {
            laid_out.insert(target);
        }
    }
    let mut stripped = module[..HEADER].to_vec();
    for instruction in instructions(module) {
        let instruction = instruction?;
        let keeps = match opcode(instruction[0]) {
            SOURCE_CONTINUED | SOURCE | SOURCE_EXTENSION | STRING | LINE | NO_LINE | MODULE_PROCESSED => false,
            NAME | MEMBER_NAME => instruction.get(1).is_some_and(|target| laid_out.contains(target)),
            _ => true,
        };
        if keeps {
            stripped.extend_from_slice(instruction);
        }
    }
    Ok(stripped)
}

pub(super) fn opcode(word: u32) -> u32 {
    word & 0xffff
}

/// The instructions in order; an error where one ends past the module.
pub(super) fn instructions(module: &[u32]) -> impl Iterator<Item = Result<&[u32], String>> {
    let mut at = HEADER;
    std::iter::from_fn(move || {
        let first = *module.get(at)?;
        let length = (first >> 16) as usize;
        let instruction = module.get(at..at + length).filter(|_| length > 0);
        let place = at;
        at = if instruction.is_some() { at + length } else { module.len() };
        Some(instruction.ok_or_else(|| format!("the SPIR-V module is cut off at word {place}")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instruction(opcode: u32, operands: &[u32]) -> Vec<u32> {
        [&[(operands.len() as u32 + 1) << 16 | opcode], operands].concat()
    }

    fn module(instructions: &[Vec<u32>]) -> Vec<u32> {
        [vec![MAGIC, 0x0001_0500, 0, 10, 0], instructions.concat()].concat()
    }

    #[test]
    fn only_names_of_laid_out_structs_stay() {
        let offset = instruction(MEMBER_DECORATE, &[7, 0, OFFSET, 0]);
        let kept = [instruction(NAME, &[7, 0x61]), instruction(MEMBER_NAME, &[7, 0, 0x61])];
        let dropped = [
            instruction(SOURCE, &[11, 1]),
            instruction(STRING, &[1, 0x61]),
            instruction(NAME, &[8, 0x61]),
            instruction(LINE, &[1, 2, 3]),
        ];
        let all = module(&[&dropped[..], &kept[..], std::slice::from_ref(&offset)].concat());
        assert_eq!(strip(&all), Ok(module(&[&kept[..], &[offset]].concat())));
    }

    #[test]
    fn a_cut_off_module_is_an_error() {
        let mut cut = module(&[instruction(SOURCE, &[11, 1])]);
        cut.pop();
        assert!(strip(&cut).is_err());
        assert!(strip(&module(&[vec![0]])).is_err());
        assert!(strip(&[1, 2, 3]).is_err());
    }
}
