use super::MeshoptError;

/// Reads the data between a stream's header and its tail; no read passes the end.
pub(super) struct Reader<'a> {
    data: &'a [u8],
    position: usize,
}

impl<'a> Reader<'a> {
    /// `data` ends where the tail begins, so that positions are offsets into the stream.
    pub(super) fn new(data: &'a [u8], position: usize) -> Self {
        Self { data, position }
    }

    #[inline]
    pub(super) fn byte(&mut self) -> Result<u8, MeshoptError> {
        let byte = *self.data.get(self.position).ok_or_else(|| self.end_of_stream())?;
        self.position += 1;
        Ok(byte)
    }

    #[inline]
    pub(super) fn take(&mut self, n: usize) -> Result<&'a [u8], MeshoptError> {
        let bytes =
            self.data.get(self.position..).and_then(|rest| rest.get(..n)).ok_or_else(|| self.end_of_stream())?;
        self.position += n;
        Ok(bytes)
    }

    /// Unsigned LEB128 of 1 to 5 bytes; bits over the 32nd are dropped, as the specification says.
    #[inline]
    pub(super) fn varint(&mut self) -> Result<u32, MeshoptError> {
        let start = self.position;
        let mut value = 0;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(MeshoptError::Varint { offset: start })
    }

    /// Fails if anything is left before the tail.
    pub(super) fn finish(self) -> Result<(), MeshoptError> {
        if self.position == self.data.len() {
            Ok(())
        } else {
            Err(MeshoptError::TrailingBytes { offset: self.position, end: self.data.len() })
        }
    }

    fn end_of_stream(&self) -> MeshoptError {
        MeshoptError::EndOfStream { offset: self.data.len() }
    }
}

/// A zigzag code to the signed number, in wrapping arithmetic: 0, 1, 2, 3 are 0, -1, 1, -2.
#[inline]
pub(super) fn unzigzag32(v: u32) -> u32 {
    (v >> 1) ^ (v & 1).wrapping_neg()
}
