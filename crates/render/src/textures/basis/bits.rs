/// Reads bits from the lowest of each byte. Behind the end there are zeros; [`Bits::overran`] tells.
#[derive(Clone)]
pub(super) struct Bits<'a> {
    data: &'a [u8],
    buffer: u64,
    available: u32,
    overrun: bool,
}

impl<'a> Bits<'a> {
    pub(super) fn new(data: &'a [u8]) -> Self {
        Self { data, buffer: 0, available: 0, overrun: false }
    }

    /// Up to 32 bits, without taking them.
    #[inline]
    pub(super) fn peek(&mut self, n: u32) -> u32 {
        while self.available < n {
            let Some((&byte, rest)) = self.data.split_first() else { break };
            self.buffer |= u64::from(byte) << self.available;
            self.available += 8;
            self.data = rest;
        }
        (self.buffer & ((1 << n) - 1)) as u32
    }

    /// Drops bits that were peeked.
    #[inline]
    pub(super) fn skip(&mut self, n: u32) {
        if n > self.available {
            self.overrun = true;
            (self.buffer, self.available) = (0, 0);
            return;
        }
        self.buffer >>= n;
        self.available -= n;
    }

    /// Up to 32 bits.
    #[inline]
    pub(super) fn read(&mut self, n: u32) -> u32 {
        let value = self.peek(n);
        self.skip(n);
        value
    }

    /// Whether more bits were taken than there are.
    pub(super) fn overran(&self) -> bool {
        self.overrun
    }
}
