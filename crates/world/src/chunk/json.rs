//! Chunks in JSON: a block for a uniform chunk, otherwise a palette and runs of its indices.

use super::Chunk;
use crate::block::Block;
use crate::space::CHUNK_BLOCKS;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// `{"uniform": block}`, or `{"palette": [block, ...], "runs": [[count, index], ...]}`: by linear index `count` blocks of the
/// palette's entry `index`. The counts add up to 4,096.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Wire {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    uniform: Option<Block>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    palette: Option<Vec<Block>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    runs: Option<Vec<(u16, u16)>>,
}

impl Serialize for Chunk {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let wire = match self.as_uniform() {
            Some(block) => Wire { uniform: Some(block), palette: None, runs: None },
            None => {
                let indices = self.palette_indices();
                let runs = indices.chunk_by(|a, b| a == b).map(|run| (run.len() as u16, run[0])).collect();
                Wire { uniform: None, palette: Some(self.palette().to_vec()), runs: Some(runs) }
            }
        };
        wire.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Chunk {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (palette, runs) = match Wire::deserialize(deserializer)? {
            Wire { uniform: Some(block), palette: None, runs: None } => return Ok(Self::uniform(block)),
            Wire { uniform: None, palette: Some(palette), runs: Some(runs) } => (palette, runs),
            _ => return Err(de::Error::custom("a chunk has either \"uniform\", or \"palette\" and \"runs\"")),
        };
        let mut blocks = Box::new([Block::AIR; CHUNK_BLOCKS]);
        let mut filled = 0;
        for (count, index) in runs {
            let block = palette.get(usize::from(index)).copied().ok_or_else(|| {
                de::Error::custom(format!("index {index} is beyond the chunk's palette of {}", palette.len()))
            })?;
            let end = filled + usize::from(count);
            blocks
                .get_mut(filled..end)
                .ok_or_else(|| de::Error::custom("the runs of a chunk hold more than 4096 blocks"))?
                .fill(block);
            filled = end;
        }
        if filled != CHUNK_BLOCKS {
            return Err(de::Error::custom(format!("the runs of a chunk hold {filled} of 4096 blocks")));
        }
        Ok(Self::from_blocks(&blocks))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_that_do_not_make_a_chunk_are_refused() {
        for bad in [
            r#"{}"#,
            r#"{"uniform":1,"palette":[1],"runs":[[4096,0]]}"#,
            r#"{"palette":[1],"runs":[[4095,0]]}"#,
            r#"{"palette":[1],"runs":[[4096,0],[1,0]]}"#,
            r#"{"palette":[1],"runs":[[4096,1]]}"#,
        ] {
            assert!(serde_json::from_str::<Chunk>(bad).is_err(), "{bad}");
        }
        let uniform: Chunk = serde_json::from_str(r#"{"palette":[7],"runs":[[4096,0]]}"#).unwrap();
        assert_eq!(serde_json::to_string(&uniform).unwrap(), r#"{"uniform":7}"#);
    }
}
