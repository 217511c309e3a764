//! NBT, the binary tree of Minecraft's files (Java edition, big-endian).

use crate::import::grid::Budget;
use crate::import::{Fault, ImportFault, content};

/// Levels of lists and compounds; the game itself allows as many.
const MOST_LEVELS: usize = 512;

/// A value. Arrays are left as the bytes of the file.
#[derive(Debug)]
pub enum Tag<'a> {
    /// A whole number of one, two, four or eight bytes.
    Whole(i64),
    /// A floating point number; none of these files says anything by one.
    Float,
    /// Big-endian elements of one, four or eight bytes.
    Array { width: usize, bytes: &'a [u8] },
    /// Modified UTF-8, of which the names of blocks use what is ASCII.
    Text(String),
    /// A list.
    List(Vec<Tag<'a>>),
    /// Named values.
    Compound(Vec<(String, Tag<'a>)>),
}

impl<'a> Tag<'a> {
    /// The first value of a name in a compound.
    pub fn get(&self, name: &str) -> Option<&Self> {
        match self {
            Self::Compound(fields) => fields.iter().find(|(own, _)| own == name).map(|(_, value)| value),
            _ => None,
        }
    }

    pub fn whole(&self) -> Option<i64> {
        match self {
            Self::Whole(value) => Some(*value),
            _ => None,
        }
    }

    pub fn bytes(&self) -> Option<&'a [u8]> {
        match self {
            Self::Array { width: 1, bytes } => Some(bytes),
            _ => None,
        }
    }

    pub fn longs(&self) -> Option<impl Iterator<Item = u64> + use<'a>> {
        match self {
            Self::Array { width: 8, bytes } => {
                let long = |bytes: &[u8]| bytes.iter().fold(0, |long, &byte| long << 8 | u64::from(byte));
                Some(bytes.chunks_exact(8).map(long))
            }
            _ => None,
        }
    }

    pub fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    pub fn list(&self) -> Option<&[Self]> {
        match self {
            Self::List(list) => Some(list),
            _ => None,
        }
    }

    pub fn fields(&self) -> Option<&[(String, Self)]> {
        match self {
            Self::Compound(fields) => Some(fields),
            _ => None,
        }
    }
}

/// The root compound.
pub fn read<'a>(bytes: &'a [u8], budget: &mut Budget) -> Result<Tag<'a>, Fault> {
    let mut reader = Reader { bytes, at: 0, budget };
    if reader.byte()? != 10 {
        return content(0, "this is no NBT file; it does not begin with a compound");
    }
    reader.text()?;
    reader.tag(10, 0)
}

struct Reader<'a, 'b> {
    bytes: &'a [u8],
    at: usize,
    budget: &'b mut Budget,
}

impl<'a> Reader<'a, '_> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let end = self.at.checked_add(count);
        let taken = end.and_then(|end| self.bytes.get(self.at..end));
        let taken = taken.ok_or((Some(self.at as u64), ImportFault::Truncated("an NBT value")))?;
        self.at += count;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, Fault> {
        Ok(self.take(1)?[0])
    }

    fn whole(&mut self, width: usize) -> Result<i64, Fault> {
        let bytes = self.take(width)?;
        let unsigned = bytes.iter().fold(0, |value: u64, &byte| value << 8 | u64::from(byte));
        let shift = 64 - 8 * width as u32;
        Ok((unsigned << shift) as i64 >> shift)
    }

    fn length(&mut self) -> Result<usize, Fault> {
        let at = self.at;
        let length = self.whole(4)?;
        usize::try_from(length).or_else(|_| content(at as u64, format!("an NBT length is {length}")))
    }

    fn text(&mut self) -> Result<String, Fault> {
        let length = self.whole(2)? as u16;
        let text = String::from_utf8_lossy(self.take(usize::from(length))?).into_owned();
        self.budget.charge(text.len() as u64)?;
        Ok(text)
    }

    fn array(&mut self, width: usize) -> Result<Tag<'a>, Fault> {
        let length = self.length()?;
        Ok(Tag::Array { width, bytes: self.take(length.saturating_mul(width))? })
    }

    /// The levels bound the recursion.
    fn tag(&mut self, kind: u8, level: usize) -> Result<Tag<'a>, Fault> {
        if level > MOST_LEVELS {
            return content(self.at as u64, format!("NBT values are nested more than {MOST_LEVELS} levels deep"));
        }
        match kind {
            1 => self.whole(1).map(Tag::Whole),
            2 => self.whole(2).map(Tag::Whole),
            3 => self.whole(4).map(Tag::Whole),
            4 => self.whole(8).map(Tag::Whole),
            5 => self.take(4).map(|_| Tag::Float),
            6 => self.take(8).map(|_| Tag::Float),
            7 => self.array(1),
            8 => self.text().map(Tag::Text),
            9 => {
                let (kind, count) = (self.byte()?, self.whole(4)?);
                let mut list = Vec::new();
                // A list of the kind "end" has no elements, whatever its count.
                for _ in 0..if kind == 0 { 0 } else { count.max(0) } {
                    self.budget.charge(size_of::<Tag>() as u64 * 2)?;
                    list.push(self.tag(kind, level + 1)?);
                }
                Ok(Tag::List(list))
            }
            10 => {
                let mut fields = Vec::new();
                loop {
                    let kind = self.byte()?;
                    if kind == 0 {
                        return Ok(Tag::Compound(fields));
                    }
                    self.budget.charge(size_of::<(String, Tag)>() as u64 * 2)?;
                    let name = self.text()?;
                    fields.push((name, self.tag(kind, level + 1)?));
                }
            }
            11 => self.array(4),
            12 => self.array(8),
            kind => content(self.at as u64, format!("there is no NBT value of kind {kind}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_all(bytes: &[u8]) -> Result<Tag<'_>, Fault> {
        read(bytes, &mut Budget::new(1 << 20))
    }

    #[test]
    fn values_of_all_kinds_are_read() {
        let bytes = b"\x0a\0\0\x01\0\x01a\xff\x02\0\x01b\x80\0\x09\0\x01c\x03\0\0\0\x02\0\0\0\x01\xff\xff\xff\xfe\x07\0\x01d\0\0\0\x02xy\
            \x0c\0\x01e\0\0\0\x01\x80\0\0\0\0\0\0\x05\x08\0\x01f\0\x02hi\x0a\0\x01g\0\0";
        let root = read_all(bytes).unwrap();
        let whole = |name| root.get(name).and_then(Tag::whole);
        assert_eq!((whole("a"), whole("b")), (Some(-1), Some(-32_768)));
        let list: Vec<_> = root.get("c").and_then(Tag::list).unwrap().iter().filter_map(Tag::whole).collect();
        assert_eq!(list, [1, -2]);
        assert_eq!(root.get("d").and_then(Tag::bytes), Some(&b"xy"[..]));
        assert_eq!(root.get("e").and_then(Tag::longs).unwrap().collect::<Vec<_>>(), [0x8000_0000_0000_0005]);
        assert_eq!(root.get("f").and_then(Tag::text), Some("hi"));
        assert!(root.get("g").and_then(Tag::fields).unwrap().is_empty());
        for length in 0..bytes.len() {
            assert!(read_all(&bytes[..length]).is_err());
        }
    }

    #[test]
    fn lengths_and_nesting_are_bounded() {
        let huge_array = b"\x0a\0\0\x07\0\x01a\x7f\xff\xff\xff";
        assert!(read_all(huge_array).is_err());
        let endless_list = b"\x0a\0\0\x09\0\x01a\0\x7f\xff\xff\xff\0";
        assert!(read_all(endless_list).is_ok(), "a list of nothing is empty");
        let mut nested = b"\x0a\0\0\x09\0\x01a".to_vec();
        nested.extend(b"\x09\0\0\0\x01".repeat(100_000));
        assert!(matches!(read_all(&nested), Err((_, ImportFault::Content(_)))));
    }
}
