//! Numbers as cards have them: blanks around them, Fortran's `D`, exponents without a letter (`2.00000-3`).

/// A whole number; one written as a real (`4.`, `1.0E3`) counts when it has no fraction.
pub(crate) fn integer(text: &[u8]) -> Option<i64> {
    let (negative, digits) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        all => (false, all),
    };
    // 18 digits never overflow; longer ones take the way over text.
    if !digits.is_empty() && digits.len() <= 18 && digits.iter().all(u8::is_ascii_digit) {
        let value = digits.iter().fold(0, |value: i64, digit| 10 * value + i64::from(digit - b'0'));
        return Some(if negative { -value } else { value });
    }
    if let Ok(value) = std::str::from_utf8(text).ok()?.parse() {
        return Some(value);
    }
    let value = real(text)?;
    // Above 2^53 a real does not hold every whole number.
    (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i64)
}

/// A finite real number.
pub(crate) fn real(text: &[u8]) -> Option<f64> {
    // The longest field has 20 columns in fixed format; free format may have more, but no number needs 64.
    let mut buffer = [0u8; 64];
    let mut length = 0;
    let mut push = |byte: u8| -> Option<()> {
        *buffer.get_mut(length)? = byte;
        length += 1;
        Some(())
    };
    let mut mantissa = false;
    let mut exponent = false;
    for (at, &byte) in text.iter().enumerate() {
        match byte {
            b'0'..=b'9' => {
                mantissa = true;
                push(byte)?;
            }
            b'.' if !exponent => push(byte)?,
            b'e' | b'E' | b'd' | b'D' if mantissa && !exponent => {
                exponent = true;
                push(b'e')?;
            }
            b'+' | b'-' if at == 0 || matches!(text[at - 1], b'e' | b'E' | b'd' | b'D') => push(byte)?,
            b'+' | b'-' if mantissa && !exponent => {
                exponent = true;
                push(b'e')?;
                push(byte)?;
            }
            _ => return None,
        }
    }
    let value: f64 = std::str::from_utf8(&buffer[..length]).ok()?.parse().ok()?;
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_decks_have_them() {
        for (text, value) in [
            ("1", 1.0),
            ("-500.0", -500.0),
            (".5", 0.5),
            ("1.", 1.0),
            ("2.00000-3", 2e-3),
            ("1.5+2", 150.0),
            ("1.0D+3", 1000.0),
            ("1d3", 1000.0),
            ("-1.08660250E+02", -108.66025),
            ("+7", 7.0),
        ] {
            assert_eq!(real(text.as_bytes()), Some(value), "{text}");
        }
        for text in ["", "nan", "inf", "1e999", "1.2.3", "1e", "e5", "--1", "1 2", "0x10", "1e5e5", "-"] {
            assert_eq!(real(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn whole_numbers() {
        for (text, value) in [("12", 12), ("-3", -3), ("4.", 4), ("1.0E3", 1000), ("9223372036854775807", i64::MAX)] {
            assert_eq!(integer(text.as_bytes()), Some(value), "{text}");
        }
        for text in ["1.5", "1e300", "99999999999999999999", "a", "+"] {
            assert_eq!(integer(text.as_bytes()), None, "{text}");
        }
    }
}
