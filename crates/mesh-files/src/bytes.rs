//! The one place where bytes become numbers: a length is checked before anything is read or allocated.

use crate::error::Fault;

/// Byte order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    Little,
    Big,
}

/// A window on untrusted bytes. Invariant: `at <= bytes.len()`.
#[derive(Clone)]
pub(crate) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(bytes: &'a [u8], at: usize) -> Cursor<'a> {
        Cursor { bytes, at: at.min(bytes.len()) }
    }

    pub(crate) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next word of text, empty at the end.
    pub(crate) fn word(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(rest.len());
        let word = rest[start..].split(u8::is_ascii_whitespace).next().unwrap_or_default();
        self.at += start + word.len();
        word
    }

    pub(crate) fn take(&mut self, count: usize, what: &'static str) -> Result<&'a [u8], Fault> {
        let rest = &self.bytes[self.at..];
        let short = Fault::Truncated { what, offset: self.at, need: count, left: rest.len() };
        let (head, _) = rest.split_at_checked(count).ok_or(short)?;
        self.at += count;
        Ok(head)
    }
}

/// Types of numbers in binary files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Kind {
    pub(crate) fn size(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 => 2,
            Kind::I32 | Kind::U32 | Kind::F32 => 4,
            Kind::I64 | Kind::U64 | Kind::F64 => 8,
        }
    }

    /// A number from as many bytes as its size; integers beyond 2⁵³ round.
    pub(crate) fn float(self, bytes: &[u8], order: Order) -> f64 {
        match self {
            Kind::F32 => f64::from(f32::from_bits(self.bits(bytes, order) as u32)),
            Kind::F64 => f64::from_bits(self.bits(bytes, order)),
            Kind::U64 => self.bits(bytes, order) as f64,
            _ => self.integer(bytes, order) as f64,
        }
    }

    /// An integer; −1 where it is a fraction, or beyond the range of i64: an index that no mesh has.
    pub(crate) fn integer(self, bytes: &[u8], order: Order) -> i64 {
        let bits = self.bits(bytes, order);
        match self {
            Kind::I8 => i64::from(bits as i8),
            Kind::I16 => i64::from(bits as i16),
            Kind::I32 => i64::from(bits as i32),
            Kind::U8 | Kind::U16 | Kind::U32 => bits as i64,
            Kind::I64 | Kind::U64 => i64::try_from(bits).unwrap_or(-1),
            Kind::F32 | Kind::F64 => {
                let x = self.float(bytes, order);
                if x.fract() == 0.0 && x.abs() < 1e15 { x as i64 } else { -1 }
            }
        }
    }

    fn bits(self, bytes: &[u8], order: Order) -> u64 {
        let add = |bits: u64, &byte: &u8| bits << 8 | u64::from(byte);
        match order {
            Order::Little => bytes.iter().rev().fold(0, add),
            Order::Big => bytes.iter().fold(0, add),
        }
    }
}
