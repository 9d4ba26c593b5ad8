//! Words of a d3plot: 4 or 8 bytes, little or big endian. The only place where bytes become numbers, and numbers bytes.

/// The size of every word of a family, integers and floats alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Precision {
    /// 4-byte words.
    #[default]
    Single,
    /// 8-byte words.
    Double,
}

/// Which byte of a word comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ByteOrder {
    /// Lowest byte first: what nearly every family of today has.
    #[default]
    Little,
    /// Highest byte first: families of old workstations.
    Big,
}

/// How the words of one family are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Words {
    pub(crate) precision: Precision,
    pub(crate) order: ByteOrder,
}

impl Words {
    /// Every form there is, the most frequent first: in a tie the first wins.
    pub(crate) const ALL: [Words; 4] = [
        Words { precision: Precision::Single, order: ByteOrder::Little },
        Words { precision: Precision::Double, order: ByteOrder::Little },
        Words { precision: Precision::Single, order: ByteOrder::Big },
        Words { precision: Precision::Double, order: ByteOrder::Big },
    ];

    /// Bytes of a word.
    pub(crate) fn size(self) -> u64 {
        match self.precision {
            Precision::Single => 4,
            Precision::Double => 8,
        }
    }

    /// The same byte order with 8-byte words: user numbers of families with INUM > 1000.
    pub(crate) fn wide(self) -> Words {
        Words { precision: Precision::Double, order: self.order }
    }

    /// The integers in `bytes`; a rest shorter than a word is left out.
    pub(crate) fn ints(self, bytes: &[u8]) -> impl Iterator<Item = i64> + '_ {
        bytes.chunks_exact(self.size() as usize).map(move |word| self.int(word))
    }

    /// The floats in `bytes`; a rest shorter than a word is left out.
    pub(crate) fn floats(self, bytes: &[u8]) -> impl Iterator<Item = f64> + '_ {
        bytes.chunks_exact(self.size() as usize).map(move |word| self.float(word))
    }

    fn int(self, word: &[u8]) -> i64 {
        match (self.precision, self.order) {
            (Precision::Single, ByteOrder::Little) => i32::from_le_bytes(array(word)).into(),
            (Precision::Single, ByteOrder::Big) => i32::from_be_bytes(array(word)).into(),
            (Precision::Double, ByteOrder::Little) => i64::from_le_bytes(array(word)),
            (Precision::Double, ByteOrder::Big) => i64::from_be_bytes(array(word)),
        }
    }

    pub(crate) fn float(self, word: &[u8]) -> f64 {
        match (self.precision, self.order) {
            (Precision::Single, ByteOrder::Little) => f32::from_le_bytes(array(word)).into(),
            (Precision::Single, ByteOrder::Big) => f32::from_be_bytes(array(word)).into(),
            (Precision::Double, ByteOrder::Little) => f64::from_le_bytes(array(word)),
            (Precision::Double, ByteOrder::Big) => f64::from_be_bytes(array(word)),
        }
    }
}

impl Words {
    /// Adds an integer; beyond 32 bits a word of 4 bytes keeps the lower ones.
    pub(crate) fn push_int(self, into: &mut Vec<u8>, value: i64) {
        match (self.precision, self.order) {
            (Precision::Single, ByteOrder::Little) => into.extend((value as i32).to_le_bytes()),
            (Precision::Single, ByteOrder::Big) => into.extend((value as i32).to_be_bytes()),
            (Precision::Double, ByteOrder::Little) => into.extend(value.to_le_bytes()),
            (Precision::Double, ByteOrder::Big) => into.extend(value.to_be_bytes()),
        }
    }

    /// Adds floats.
    pub(crate) fn push_floats(self, into: &mut Vec<u8>, values: impl IntoIterator<Item = f64>) {
        for value in values {
            let mut word = [0; 8];
            self.put_float(&mut word, value);
            into.extend(&word[..self.size() as usize]);
        }
    }

    /// Overwrites the first word of `word` with a float.
    pub(crate) fn put_float(self, word: &mut [u8], value: f64) {
        let bytes = match (self.precision, self.order) {
            (Precision::Single, ByteOrder::Little) => &(value as f32).to_le_bytes()[..],
            (Precision::Single, ByteOrder::Big) => &(value as f32).to_be_bytes()[..],
            (Precision::Double, ByteOrder::Little) => &value.to_le_bytes()[..],
            (Precision::Double, ByteOrder::Big) => &value.to_be_bytes()[..],
        };
        for (byte, value) in word.iter_mut().zip(bytes) {
            *byte = *value;
        }
    }
}

/// The first N bytes of `word`, zeros where it is shorter: no way to panic.
fn array<const N: usize>(word: &[u8]) -> [u8; N] {
    word.first_chunk::<N>().copied().unwrap_or([0; N])
}

/// Text of any encoding: UTF-8 if it is valid, else byte by byte as Latin-1, which cannot fail. Blanks and zeros at
/// both ends are left out.
pub(crate) fn decode_text(bytes: &[u8]) -> String {
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    };
    text.trim_matches([' ', '\0']).to_owned()
}

/// `bytes` without the blanks and zeros at its end.
pub(crate) fn trim_end(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|&byte| byte != b' ' && byte != 0).map_or(0, |last| last + 1);
    &bytes[..end]
}
