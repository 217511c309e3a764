//! The nodes of a large document, found in its text before it is parsed.
//!
//! Documents have up to millions of nodes, and next to them nothing else that is long. So the text is scanned for where
//! each node begins and ends (`scan`); all the rest is parsed as one small document; and the nodes are read, converted and
//! put into their slots by all threads, with a reader (`read`) that knows what most nodes are made of. No list of parsed
//! nodes ever exists.
//!
//! Whatever is not as expected here ends in the general parser, which says what is wrong: this is only a shorter way to
//! the same scene.

mod read;
#[allow(unsafe_code, reason = "instructions of SSE2 are called, which every x86-64 has")]
mod scan;

pub use read::node as read;

use std::ops::Range;

/// Shorter lists of nodes are parsed with the rest of the document.
pub const MIN_BYTES: usize = 1 << 18;

/// Where the nodes of a document are in its text.
pub struct NodeTexts<'a> {
    text: &'a str,
    /// What is between the brackets of `nodes`.
    list: Range<usize>,
    /// Each from `{` to `}`.
    nodes: Vec<Range<u32>>,
}

impl<'a> NodeTexts<'a> {
    /// Finds the nodes, if their texts have `min_bytes` together. `None` also where the text is not what it should be.
    pub fn find(text: &'a str, min_bytes: usize) -> Option<Self> {
        if text.len() < min_bytes || text.len() > u32::MAX as usize {
            return None;
        }
        let (list, nodes) = scan::nodes(text.as_bytes())?;
        (list.len() >= min_bytes).then_some(Self { text, list, nodes })
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// The document with an empty list of nodes.
    pub fn rest(&self) -> String {
        [&self.text[..self.list.start], &self.text[self.list.end..]].concat()
    }

    /// The text of a node; `None` if what is around it is no list.
    pub fn get(&self, i: usize) -> Option<&'a str> {
        let range = |i: usize| self.nodes[i].start as usize..self.nodes[i].end as usize;
        let before = if i == 0 { self.list.start } else { range(i - 1).end };
        let node = range(i);
        let separator = if i == 0 { "" } else { "," };
        let is_list = trim(&self.text[before..node.start]) == separator
            && (i + 1 < self.nodes.len() || trim(&self.text[node.end..self.list.end]).is_empty());
        is_list.then(|| &self.text[node])
    }
}

/// Without white space around it, as JSON has it.
fn trim(text: &str) -> &str {
    text.trim_matches([' ', '\t', '\n', '\r'])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(text: &str) -> Option<Vec<Option<&str>>> {
        let found = NodeTexts::find(text, 0)?;
        Some((0..found.len()).map(|i| found.get(i)).collect())
    }

    #[test]
    fn nodes_are_found_wherever_they_are_and_the_rest_is_the_document_without_them() {
        let text = r#"{"a":[{"nodes":[{}]}], "nodes" : [ {"name":"]}\"{"} , {"extras":{"nodes":[{}]}} ] ,"b":1}"#;
        let found = NodeTexts::find(text, 0).unwrap();
        assert_eq!(texts(text).unwrap(), [Some(r#"{"name":"]}\"{"}"#), Some(r#"{"extras":{"nodes":[{}]}}"#)]);
        assert_eq!(found.rest(), r#"{"a":[{"nodes":[{}]}], "nodes" : [] ,"b":1}"#);
        assert!(NodeTexts::find(text, 1000).is_none());
    }

    #[test]
    fn what_is_no_list_of_objects_is_not_taken_for_one() {
        for text in [
            r#"{"nodes":[{}{}]}"#,
            r#"{"nodes":[{},,{}]}"#,
            r#"{"nodes":[{},]}"#,
            r#"{"nodes":[,{}]}"#,
            r#"{"nodes":[1,{}]}"#,
            r#"{"nodes":[{},{},null]}"#,
        ] {
            assert!(texts(text).is_none_or(|nodes| nodes.contains(&None)), "{text}");
        }
        for text in [r#"{"nodes":{}}"#, r#"{"nodes":[{}"#, r#"{"nodes":[{}],"nodes":[{}]}"#, r#"{"a\"nodes":[{}]}"#, ""]
        {
            assert!(texts(text).is_none(), "{text}");
        }
    }
}
