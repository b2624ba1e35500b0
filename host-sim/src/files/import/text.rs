//! Bytes to text: UTF-8, UTF-16 with or without a mark, else Windows-1252.

use encoding_rs::{UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

/// How the bytes were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// As it should be.
    Utf8,
    /// Two bytes a character.
    Utf16,
    /// One byte a character.
    Windows1252,
}

impl Encoding {
    /// What was assumed, in words.
    #[must_use]
    pub const fn note(self) -> Option<&'static str> {
        match self {
            Self::Utf8 => None,
            Self::Utf16 => Some("the text is UTF-16"),
            Self::Windows1252 => Some("the text is no UTF-8: read as Windows-1252"),
        }
    }
}

/// The text, without a byte order mark.
#[must_use]
pub fn decode(bytes: &[u8]) -> (String, Encoding) {
    let marked = encoding_rs::Encoding::for_bom(bytes).map(|(encoding, _)| encoding);
    // Without a mark: in UTF-16 every other byte of an ASCII text is zero.
    let zeros = |odd: usize| bytes.iter().skip(odd).step_by(2).take(200).filter(|byte| **byte == 0).count();
    let enough = bytes.len().min(400) / 4;
    let encoding = match marked {
        Some(encoding) => encoding,
        None if zeros(1) > enough => UTF_16LE,
        None if zeros(0) > enough => UTF_16BE,
        None if std::str::from_utf8(bytes).is_ok() => UTF_8,
        None => WINDOWS_1252,
    };
    let (text, _) = encoding.decode_with_bom_removal(bytes);
    let how = match encoding {
        e if e == UTF_8 => Encoding::Utf8,
        e if e == WINDOWS_1252 => Encoding::Windows1252,
        _ => Encoding::Utf16,
    };
    (text.into_owned(), how)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_encoding_is_told_from_the_bytes() {
        let big: Vec<u8> = "a;b\n1;2\n".encode_utf16().flat_map(u16::to_be_bytes).collect();
        assert_eq!(decode(&big), ("a;b\n1;2\n".into(), Encoding::Utf16));
        assert_eq!(decode(b"\xb0C"), ("°C".into(), Encoding::Windows1252));
        assert_eq!(decode("\u{feff}°C".as_bytes()), ("°C".into(), Encoding::Utf8));
        assert_eq!(decode(b""), (String::new(), Encoding::Utf8));
    }
}
