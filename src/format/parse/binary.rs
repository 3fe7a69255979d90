//! Numbers of a binary file.

use super::ParseError;
use crate::format::vtu::number::ByteOrder;

/// Goes through bytes number by number.
#[derive(Debug, Clone)]
pub(in crate::format) struct Binary<'a> {
    bytes: &'a [u8],
    at: usize,
    order: ByteOrder,
}

/// A number as a file stores it.
pub(in crate::format) trait Plain: Copy {
    /// Its size in bytes.
    const SIZE: usize;
    /// From [`Plain::SIZE`] bytes in an order.
    fn from_bytes(bytes: &[u8], order: ByteOrder) -> Self;
}

macro_rules! plain {
    ($($t:ty),*) => { $(
        impl Plain for $t {
            const SIZE: usize = size_of::<$t>();
            fn from_bytes(bytes: &[u8], order: ByteOrder) -> Self {
                let mut own = [0; size_of::<$t>()];
                own.copy_from_slice(bytes);
                match order {
                    ByteOrder::Little => <$t>::from_le_bytes(own),
                    ByteOrder::Big => <$t>::from_be_bytes(own),
                }
            }
        }
    )* };
}
plain!(u8, i8, u16, i16, u32, i32, u64, i64, f32, f64);

impl<'a> Binary<'a> {
    /// From a byte on.
    pub fn new(bytes: &'a [u8], at: usize, order: ByteOrder) -> Self {
        Binary { bytes, at: at.min(bytes.len()), order }
    }

    /// Where it is, for messages: `byte 120`.
    pub fn place(&self) -> String {
        format!("byte {}", self.at)
    }

    /// Bytes from the start.
    pub fn at(&self) -> usize {
        self.at
    }

    /// The order of its numbers' bytes.
    pub fn order(&self) -> ByteOrder {
        self.order
    }

    /// The bytes that are left.
    pub fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The next bytes.
    pub fn take(&mut self, len: usize, what: &str) -> Result<&'a [u8], ParseError> {
        let rest = self.rest();
        let found = rest.get(..len).ok_or_else(|| {
            ParseError::invalid(self.place(), format!("{} bytes up to the end", rest.len()), format!("{len} bytes of {what}"))
        })?;
        self.at += len;
        Ok(found)
    }

    /// The next number.
    pub fn number<T: Plain>(&mut self, what: &str) -> Result<T, ParseError> {
        Ok(T::from_bytes(self.take(T::SIZE, what)?, self.order))
    }

    /// The next numbers.
    pub fn numbers<T: Plain>(&mut self, count: usize, what: &str) -> Result<Vec<T>, ParseError> {
        let len = count.saturating_mul(T::SIZE);
        let order = self.order;
        Ok(self.take(len, what)?.chunks_exact(T::SIZE).map(|bytes| T::from_bytes(bytes, order)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_both_orders_and_no_more_than_there_are() {
        let bytes = [0, 0, 0, 1, 2, 3];
        let mut big = Binary::new(&bytes, 0, ByteOrder::Big);
        assert_eq!((big.number::<u32>("n").ok(), big.numbers::<u8>(2, "n").ok()), (Some(1), Some(vec![2, 3])));
        let error = big.number::<u32>("a count").expect_err("the end").to_string();
        assert_eq!(error, "byte 6: 0 bytes up to the end, expected 4 bytes of a count");
        assert_eq!(Binary::new(&bytes, 0, ByteOrder::Little).number::<u32>("n").ok(), Some(1 << 24));
        assert!(Binary::new(&bytes, 2, ByteOrder::Big).numbers::<f64>(usize::MAX, "n").is_err());
    }
}
