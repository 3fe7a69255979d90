//! Numbers as a `.vtu` file spells them (type, byte order, text) and as a mesh holds them.

use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Items that one thread converts at a time.
const PARALLEL_ITEMS: usize = 1 << 14;

/// Which byte of a number comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::format) enum ByteOrder {
    /// The least significant, as on x86 and ARM; also what an absent `byte_order` means.
    Little,
    /// The most significant.
    Big,
}

/// VTK's numeric types.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::format) enum ScalarType {
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Float32,
    Float64,
}

impl ScalarType {
    /// All of them, by the name that the attribute `type` gives them.
    pub const NAMES: [(&'static str, ScalarType); 10] = [
        ("Int8", ScalarType::Int8),
        ("UInt8", ScalarType::UInt8),
        ("Int16", ScalarType::Int16),
        ("UInt16", ScalarType::UInt16),
        ("Int32", ScalarType::Int32),
        ("UInt32", ScalarType::UInt32),
        ("Int64", ScalarType::Int64),
        ("UInt64", ScalarType::UInt64),
        ("Float32", ScalarType::Float32),
        ("Float64", ScalarType::Float64),
    ];

    /// Bytes a number.
    pub fn size(self) -> usize {
        match self {
            ScalarType::Int8 | ScalarType::UInt8 => 1,
            ScalarType::Int16 | ScalarType::UInt16 => 2,
            ScalarType::Int32 | ScalarType::UInt32 | ScalarType::Float32 => 4,
            ScalarType::Int64 | ScalarType::UInt64 | ScalarType::Float64 => 8,
        }
    }

    /// Whether it is a floating-point type.
    pub fn is_float(self) -> bool {
        matches!(self, ScalarType::Float32 | ScalarType::Float64)
    }

    /// Whether f32 holds each of its values exactly.
    pub fn fits_f32(self) -> bool {
        self.size() < 4 || self == ScalarType::Float32
    }
}

/// A number of any type, without loss.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::format) enum Number {
    Signed(i64),
    Unsigned(u64),
    Float(f64),
}

impl Number {
    /// The nearest f64.
    #[inline(always)]
    fn to_f64(self) -> f64 {
        match self {
            Number::Signed(v) => v as f64,
            Number::Unsigned(v) => v as f64,
            Number::Float(v) => v,
        }
    }

    /// The number as an index; `None` where it is none or too large.
    #[inline(always)]
    fn to_index<T: TryFrom<i64> + TryFrom<u64>>(self) -> Option<T> {
        match self {
            Number::Signed(v) => T::try_from(v).ok(),
            Number::Unsigned(v) => T::try_from(v).ok(),
            Number::Float(_) => None,
        }
    }
}

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Number::Signed(v) => v.fmt(f),
            Number::Unsigned(v) => v.fmt(f),
            Number::Float(v) => v.fmt(f),
        }
    }
}

/// What numbers of a file become: one or several consecutive ones make one item of a mesh.
pub(in crate::format) trait Item: Copy + Default + Send + Sync {
    /// How many numbers make an item.
    const NUMBERS: usize;
    /// What a number must be, for error messages.
    const EXPECTED: &'static str;

    /// The item made of numbers 0 to `NUMBERS` - 1; `None` if one of them does not fit.
    fn from_numbers(number: impl Fn(usize) -> Number) -> Option<Self>;
}

impl Item for f32 {
    const NUMBERS: usize = 1;
    const EXPECTED: &'static str = "a number";

    #[inline(always)]
    fn from_numbers(number: impl Fn(usize) -> Number) -> Option<Self> {
        Some(number(0).to_f64() as f32)
    }
}

impl Item for f64 {
    const NUMBERS: usize = 1;
    const EXPECTED: &'static str = "a number";

    #[inline(always)]
    fn from_numbers(number: impl Fn(usize) -> Number) -> Option<Self> {
        Some(number(0).to_f64())
    }
}

/// A point.
impl Item for DVec3 {
    const NUMBERS: usize = 3;
    const EXPECTED: &'static str = "a number";

    #[inline(always)]
    fn from_numbers(number: impl Fn(usize) -> Number) -> Option<Self> {
        Some(DVec3::new(number(0).to_f64(), number(1).to_f64(), number(2).to_f64()))
    }
}

/// A cell type or ghost bits.
impl Item for u8 {
    const NUMBERS: usize = 1;
    const EXPECTED: &'static str = "an integer from 0 to 255";

    #[inline(always)]
    fn from_numbers(number: impl Fn(usize) -> Number) -> Option<Self> {
        number(0).to_index()
    }
}

macro_rules! integer_item {
    ($($t:ty, $expected:literal;)*) => { $(
        impl Item for $t {
            const NUMBERS: usize = 1;
            const EXPECTED: &'static str = $expected;

            #[inline(always)]
            fn from_numbers(number: impl Fn(usize) -> Number) -> Option<Self> {
                number(0).to_index()
            }
        }
    )* };
}

// Voxels.
integer_item! {
    i8, "an integer of 8 bits";
    i16, "an integer of 16 bits";
    u16, "an integer from 0 to 65535";
    i32, "an integer of 32 bits";
    i64, "an integer of 64 bits";
    u32, "an integer from 0 to 4294967295";
}

/// A place in the connectivity.
impl Item for u64 {
    const NUMBERS: usize = 1;
    const EXPECTED: &'static str = "an integer from 0";

    #[inline(always)]
    fn from_numbers(number: impl Fn(usize) -> Number) -> Option<Self> {
        number(0).to_index()
    }
}

/// A tet.
impl Item for [u32; 4] {
    const NUMBERS: usize = 4;
    const EXPECTED: &'static str = "a point index from 0";

    #[inline(always)]
    fn from_numbers(number: impl Fn(usize) -> Number) -> Option<Self> {
        Some([number(0).to_index()?, number(1).to_index()?, number(2).to_index()?, number(3).to_index()?])
    }
}

/// Appends the items that `bytes`, whole items long, spell. The caller has reserved the room. If a number does not fit, its place in
/// `bytes` (counted in numbers) and what it is.
pub(in crate::format) fn append_binary<I: Item>(
    out: &mut Vec<I>,
    bytes: &[u8],
    scalar: ScalarType,
    order: ByteOrder,
) -> Result<(), (usize, Number)> {
    match order {
        ByteOrder::Little => append_ordered::<I, false>(out, bytes, scalar),
        ByteOrder::Big => append_ordered::<I, true>(out, bytes, scalar),
    }
}

fn append_ordered<I: Item, const BIG: bool>(out: &mut Vec<I>, bytes: &[u8], scalar: ScalarType) -> Result<(), (usize, Number)> {
    use Number::{Float, Signed, Unsigned};
    match scalar {
        ScalarType::Int8 => append_words::<I, 1, BIG>(out, bytes, |b| Signed(i8::from_le_bytes(b).into())),
        ScalarType::UInt8 => append_words::<I, 1, BIG>(out, bytes, |b| Unsigned(u8::from_le_bytes(b).into())),
        ScalarType::Int16 => append_words::<I, 2, BIG>(out, bytes, |b| Signed(i16::from_le_bytes(b).into())),
        ScalarType::UInt16 => append_words::<I, 2, BIG>(out, bytes, |b| Unsigned(u16::from_le_bytes(b).into())),
        ScalarType::Int32 => append_words::<I, 4, BIG>(out, bytes, |b| Signed(i32::from_le_bytes(b).into())),
        ScalarType::UInt32 => append_words::<I, 4, BIG>(out, bytes, |b| Unsigned(u32::from_le_bytes(b).into())),
        ScalarType::Int64 => append_words::<I, 8, BIG>(out, bytes, |b| Signed(i64::from_le_bytes(b))),
        ScalarType::UInt64 => append_words::<I, 8, BIG>(out, bytes, |b| Unsigned(u64::from_le_bytes(b))),
        ScalarType::Float32 => append_words::<I, 4, BIG>(out, bytes, |b| Float(f32::from_le_bytes(b).into())),
        ScalarType::Float64 => append_words::<I, 8, BIG>(out, bytes, |b| Float(f64::from_le_bytes(b))),
    }
}

/// [`append_binary`] for words of `N` bytes, `number` taking them little-endian.
fn append_words<I: Item, const N: usize, const BIG: bool>(
    out: &mut Vec<I>,
    bytes: &[u8],
    number: impl Fn([u8; N]) -> Number + Sync,
) -> Result<(), (usize, Number)> {
    let word = |item: &[u8], k: usize| {
        let mut word = [0; N];
        word.copy_from_slice(&item[k * N..][..N]);
        if BIG {
            word.reverse();
        }
        number(word)
    };
    let item_size = N * I::NUMBERS;
    let start = out.len();
    out.resize(start + bytes.len() / item_size, I::default());
    let misfit = AtomicBool::new(false);
    let convert = |(items, bytes): (&mut [I], &[u8])| {
        for (item, bytes) in items.iter_mut().zip(bytes.chunks_exact(item_size)) {
            match I::from_numbers(|k| word(bytes, k)) {
                Some(made) => *item = made,
                None => misfit.store(true, Relaxed),
            }
        }
    };
    out[start..].par_chunks_mut(PARALLEL_ITEMS).zip(bytes.par_chunks(PARALLEL_ITEMS * item_size)).for_each(convert);
    if !misfit.into_inner() {
        return Ok(());
    }
    // An item that does not fit has no number on its own that fits all of its places.
    let fits = |k: usize| I::from_numbers(|_| word(bytes, k)).is_some();
    let first = (0..bytes.len() / N).find(|&k| !fits(k)).expect("an item failed because of one of its numbers");
    Err((first, word(bytes, first)))
}

/// Appends the numbers that blank-separated `text` spells, the floats of a Float32 array rounded to f32. On text that is no number, how
/// many went before it and the text.
pub(in crate::format) fn append_text(out: &mut Vec<Number>, text: &[u8], scalar: ScalarType) -> Result<(), (usize, String)> {
    for token in text.split(u8::is_ascii_whitespace).filter(|token| !token.is_empty()) {
        match parse(token, scalar) {
            Some(number) => out.push(number),
            None => return Err((out.len(), String::from_utf8_lossy(&token[..token.len().min(40)]).into_owned())),
        }
    }
    Ok(())
}

fn parse(token: &[u8], scalar: ScalarType) -> Option<Number> {
    if !scalar.is_float() {
        let text = std::str::from_utf8(token).ok()?;
        return text.parse().map(Number::Signed).or_else(|_| text.parse().map(Number::Unsigned)).ok();
    }
    let parsed = match scalar {
        ScalarType::Float32 => fast_float2::parse::<f32, _>(token).map(f64::from),
        _ => fast_float2::parse::<f64, _>(token),
    };
    parsed.ok().or_else(|| windows_special(token)).map(Number::Float)
}

/// The ways of Windows' C library to write a number that is not finite, such as `-nan(ind)`, `1.#QNAN` and `-1.#INF`.
fn windows_special(token: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(token).ok()?.to_ascii_lowercase();
    let (sign, text) = text.strip_prefix('-').map_or((1.0, text.as_str()), |rest| (-1.0, rest));
    match text {
        "nan(ind)" | "nan(snan)" => Some(f64::NAN),
        _ => match text.strip_prefix("1.#")? {
            special if special.starts_with("inf") => Some(sign * f64::INFINITY),
            special if ["qnan", "snan", "ind"].iter().any(|name| special.starts_with(name)) => Some(f64::NAN),
            _ => None,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn binary<I: Item>(bytes: &[u8], scalar: ScalarType, order: ByteOrder) -> Result<Vec<I>, (usize, Number)> {
        let mut out = Vec::new();
        append_binary(&mut out, bytes, scalar, order).map(|()| out)
    }

    #[test]
    fn every_type_in_both_byte_orders() {
        macro_rules! check {
            ($($t:ty, $scalar:ident;)*) => { $(
                for value in [<$t>::MIN, <$t>::MAX, 1 as $t, 100 as $t] {
                    let expected = vec![value as f64];
                    assert_eq!(binary::<f64>(&value.to_le_bytes(), ScalarType::$scalar, ByteOrder::Little), Ok(expected.clone()));
                    assert_eq!(binary::<f64>(&value.to_be_bytes(), ScalarType::$scalar, ByteOrder::Big), Ok(expected));
                }
                assert_eq!(ScalarType::$scalar.size(), size_of::<$t>());
            )* };
        }
        check! {
            i8, Int8; u8, UInt8; i16, Int16; u16, UInt16; i32, Int32; u32, UInt32; i64, Int64; u64, UInt64; f32, Float32; f64, Float64;
        }
    }

    #[test]
    fn an_index_that_does_not_fit_is_named_with_its_place() {
        let bytes: Vec<u8> = [0, 1, 2, 3, 4, 5, -6, 7].iter().flat_map(|v: &i64| v.to_be_bytes()).collect();
        assert_eq!(binary::<[u32; 4]>(&bytes, ScalarType::Int64, ByteOrder::Big), Err((6, Number::Signed(-6))));
        assert_eq!(binary::<u8>(&[0, 1, 1, 0], ScalarType::UInt16, ByteOrder::Little), Err((0, Number::Unsigned(256))));
        assert!(binary::<u64>(&1.0_f64.to_le_bytes(), ScalarType::Float64, ByteOrder::Little).is_err());
    }

    #[test]
    fn many_threads_give_what_one_gives() {
        let values: Vec<u32> = (0..100_000).collect();
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let tets = binary::<[u32; 4]>(&bytes, ScalarType::UInt32, ByteOrder::Little).expect("indices");
        assert_eq!(tets.as_flattened(), values);
    }

    #[test]
    fn text_of_every_kind() {
        let numbers = |text: &str, scalar| {
            let mut out = Vec::new();
            append_text(&mut out, text.as_bytes(), scalar).map(|()| out.iter().map(|n| n.to_f64()).collect::<Vec<_>>())
        };
        assert_eq!(numbers(" 1\n-2\t+3\r\n", ScalarType::Int8), Ok(vec![1.0, -2.0, 3.0]));
        assert_eq!(numbers("18446744073709551615", ScalarType::UInt64), Ok(vec![u64::MAX as f64]));
        assert_eq!(numbers("0.1 1e-3 .5 -inf Infinity", ScalarType::Float64), Ok(vec![0.1, 1e-3, 0.5, f64::NEG_INFINITY, f64::INFINITY]));
        assert_eq!(numbers("0.1", ScalarType::Float32), Ok(vec![f64::from(0.1_f32)]));
        assert_eq!(numbers("-1.#INF", ScalarType::Float64), Ok(vec![f64::NEG_INFINITY]));
        let missing = numbers("nan NaN -nan nan(ind) -nan(ind) 1.#QNAN -1.#IND", ScalarType::Float32).expect("not numbers, but legal");
        assert_eq!((missing.len(), missing.iter().all(|v| v.is_nan())), (7, true));
        assert_eq!(numbers("1 2 x3", ScalarType::Int32), Err((2, "x3".into())));
        assert_eq!(numbers("1 2.5", ScalarType::Int32), Err((1, "2.5".into())));
    }
}
