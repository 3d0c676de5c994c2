//! Bytes to tokens, and the fast path for long lists of numbers.

use irradiant_scene::{FileId, Span};
use std::sync::Arc;

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A directive, a number, `true` or `false`.
    Word,
    /// A string in quotes.
    Text,
    /// A string that its line ends before the closing quote.
    Unterminated,
    /// `[`
    Open,
    /// `]`
    Close,
    /// Nothing is left.
    End,
}

/// A piece of the text; offsets include the quotes of strings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Token {
    pub kind: Kind,
    pub start: usize,
    pub end: usize,
}

/// A walk over one text.
#[derive(Clone, Debug)]
pub(crate) struct Lexer {
    text: Arc<[u8]>,
    file: FileId,
    at: usize,
}

/// Why a list of numbers ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ListEnd {
    /// At `]`.
    Closed,
    /// At something that is no such number; it has been consumed.
    Bad(Token),
    /// At the end of the text.
    End,
}

const fn is_space(b: u8) -> bool {
    matches!(b, b' ' | b'\n' | b'\t' | b'\r')
}

const fn ends_word(b: u8) -> bool {
    is_space(b) || matches!(b, b'"' | b'[' | b']')
}

impl Lexer {
    pub fn new(text: Arc<[u8]>, file: FileId) -> Self {
        // A byte-order mark is not part of the scene.
        let at = if text.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { text, file, at }
    }

    /// Where the walk stands.
    pub fn here(&self) -> usize {
        self.at
    }

    pub fn span(&self, token: Token) -> Span {
        Span { file: self.file, start: token.start as u32, end: token.end as u32 }
    }

    pub fn bytes(&self, token: Token) -> &[u8] {
        &self.text[token.start..token.end]
    }

    /// The next token without consuming it.
    pub fn peek(&self) -> Token {
        let mut at = self.at;
        scan(&self.text, &mut at)
    }

    /// Goes back to a token that has been consumed.
    pub fn back_to(&mut self, token: Token) {
        self.at = token.start;
    }

    /// Consumes the next token.
    pub fn next(&mut self) -> Token {
        scan(&self.text, &mut self.at)
    }

    /// The content of a string token, escapes replaced; `Err` with the place of an escape that does not exist.
    pub fn string(&self, token: Token) -> Result<String, Span> {
        let raw = &self.text[token.start + 1..token.end - 1];
        if !raw.contains(&b'\\') {
            return Ok(String::from_utf8_lossy(raw).into_owned());
        }
        let mut out = Vec::with_capacity(raw.len());
        let mut i = 0;
        while i < raw.len() {
            let b = raw[i];
            i += 1;
            if b != b'\\' {
                out.push(b);
                continue;
            }
            // The scanner never ends a string after a lone backslash.
            let escaped = raw.get(i).copied().unwrap_or(b'\\');
            out.push(match escaped {
                b'b' => 8,
                b'f' => 12,
                b'n' => b'\n',
                b'r' => b'\r',
                b't' => b'\t',
                b'\\' | b'\'' | b'"' => escaped,
                _ => {
                    let start = (token.start + i) as u32;
                    return Err(Span { file: self.file, start, end: start + 2 });
                }
            });
            i += 1;
        }
        Ok(String::from_utf8_lossy(&out).into_owned())
    }

    /// Reads numbers up to the `]` that closes their list.
    pub fn floats(&mut self, out: &mut Vec<f32>) -> ListEnd {
        self.list(|bytes| parse_f32(bytes).map(|v| out.push(v)).is_some())
    }

    /// Reads integers up to the `]` that closes their list.
    pub fn integers(&mut self, out: &mut Vec<i32>) -> ListEnd {
        self.list(|bytes| parse_i32(bytes).map(|v| out.push(v)).is_some())
    }

    fn list(&mut self, mut accept: impl FnMut(&[u8]) -> bool) -> ListEnd {
        loop {
            let token = scan(&self.text, &mut self.at);
            match token.kind {
                Kind::Word if accept(&self.text[token.start..token.end]) => {}
                Kind::Close => return ListEnd::Closed,
                Kind::End => return ListEnd::End,
                _ => return ListEnd::Bad(token),
            }
        }
    }
}

#[inline]
fn scan(text: &[u8], at: &mut usize) -> Token {
    let mut i = *at;
    loop {
        match text.get(i) {
            None => {
                *at = i;
                return Token { kind: Kind::End, start: i, end: i };
            }
            Some(&b) if is_space(b) => i += 1,
            Some(b'#') => {
                while i < text.len() && text[i] != b'\n' && text[i] != b'\r' {
                    i += 1;
                }
            }
            Some(_) => break,
        }
    }
    let start = i;
    let kind = match text[i] {
        b'[' => {
            i += 1;
            Kind::Open
        }
        b']' => {
            i += 1;
            Kind::Close
        }
        b'"' => {
            i += 1;
            loop {
                match text.get(i) {
                    None | Some(b'\n') => break Kind::Unterminated,
                    Some(b'\\') if text.get(i + 1).is_some_and(|&b| b != b'\n') => i += 2,
                    Some(b'"') => {
                        i += 1;
                        break Kind::Text;
                    }
                    Some(_) => i += 1,
                }
            }
        }
        _ => {
            while i < text.len() && !ends_word(text[i]) {
                i += 1;
            }
            Kind::Word
        }
    };
    *at = i;
    Token { kind, start, end: i }
}

/// A decimal number, correctly rounded; `None` for anything else, infinities and NaN included.
pub(crate) fn parse_f32(bytes: &[u8]) -> Option<f32> {
    let (negative, digits) = match bytes.first()? {
        b'-' => (true, &bytes[1..]),
        b'+' => (false, &bytes[1..]),
        _ => (false, bytes),
    };
    let mut mantissa = 0u64;
    let mut count = 0;
    let mut exponent = 0i32;
    let mut i = 0;
    while let Some(d) = digits.get(i).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(d));
        count += 1;
        i += 1;
    }
    if digits.get(i) == Some(&b'.') {
        i += 1;
        let first = i;
        while let Some(d) = digits.get(i).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(d));
            i += 1;
        }
        count += i - first;
        exponent -= i32::try_from(i - first).ok()?;
    }
    if count == 0 {
        return None;
    }
    if i < digits.len() {
        if !matches!(digits[i], b'e' | b'E') {
            return None;
        }
        i += 1;
        let minus = digits.get(i) == Some(&b'-');
        i += usize::from(matches!(digits.get(i), Some(b'-' | b'+')));
        let first = i;
        let mut e = 0i32;
        while let Some(d) = digits.get(i).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
            e = e.saturating_mul(10).saturating_add(i32::from(d));
            i += 1;
        }
        if i == first || i < digits.len() {
            return None;
        }
        exponent = exponent.saturating_add(if minus { -e } else { e });
    }
    // With a mantissa below 2^53 and a power of ten up to 22 both operands are exact in f64, so one correctly rounded
    // operation gives the number (Clinger 1990); rounding that to f32 again is safe unless it fell half-way between two.
    if count <= 15 && exponent.unsigned_abs() <= 22 {
        let power = POWERS_OF_TEN[exponent.unsigned_abs() as usize];
        let v = if exponent < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
        let tail = v.to_bits() & 0x1fff_ffff;
        if tail != 0x1000_0000 && (v == 0.0 || (1e-30..1e38).contains(&v)) {
            return Some(if negative { -(v as f32) } else { v as f32 });
        }
    }
    let v: f32 = std::str::from_utf8(bytes).ok()?.parse().ok()?;
    v.is_finite().then_some(v)
}

const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// As [`parse_f32`] in double precision, for transforms.
pub(crate) fn parse_f64(bytes: &[u8]) -> Option<f64> {
    // Only what `parse_f32` takes for a number: Rust also accepts "inf" and "nan".
    bytes.iter().any(u8::is_ascii_digit).then_some(())?;
    if bytes.iter().any(|b| !matches!(b, b'0'..=b'9' | b'+' | b'-' | b'.' | b'e' | b'E')) {
        return None;
    }
    let v: f64 = std::str::from_utf8(bytes).ok()?.parse().ok()?;
    v.is_finite().then_some(v)
}

/// A decimal integer that fits 32 bits.
pub(crate) fn parse_i32(bytes: &[u8]) -> Option<i32> {
    let (negative, digits) = match bytes.first()? {
        b'-' => (true, &bytes[1..]),
        b'+' => (false, &bytes[1..]),
        _ => (false, bytes),
    };
    if digits.is_empty() {
        return None;
    }
    let mut v = 0i64;
    for b in digits {
        let d = b.wrapping_sub(b'0');
        if d > 9 {
            return None;
        }
        v = v * 10 + i64::from(d);
        if v > 1 << 31 {
            return None;
        }
    }
    i32::try_from(if negative { -v } else { v }).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lex(text: &str) -> Vec<(Kind, String)> {
        let mut lexer = Lexer::new(Arc::from(text.as_bytes()), FileId(0));
        let mut out = vec![];
        loop {
            let t = lexer.next();
            if t.kind == Kind::End {
                return out;
            }
            out.push((t.kind, String::from_utf8_lossy(lexer.bytes(t)).into_owned()));
        }
    }

    #[test]
    fn words_strings_and_brackets_need_no_space_between_them() {
        let kinds: Vec<_> = lex("Shape\"a b\"[1 2]# note\r\n3").into_iter().map(|(k, t)| (k, t.len())).collect();
        use Kind::*;
        assert_eq!(kinds, [(Word, 5), (Text, 5), (Open, 1), (Word, 1), (Word, 1), (Close, 1), (Word, 1)]);
    }

    #[test]
    fn a_string_ends_with_its_line() {
        assert_eq!(lex("\"abc\nx")[0].0, Kind::Unterminated);
        assert_eq!(lex("\"abc")[0].0, Kind::Unterminated);
        assert_eq!(lex("\"abc\\")[0].0, Kind::Unterminated);
    }

    #[test]
    fn escapes_are_replaced_and_unknown_ones_located() {
        let lexer = Lexer::new(Arc::from(r#""a\"\\\n" "\q""#.as_bytes()), FileId(0));
        let mut l = lexer.clone();
        let t = l.next();
        assert_eq!(l.string(t).unwrap(), "a\"\\\n");
        let t = l.next();
        assert_eq!(l.string(t).unwrap_err().start, 11);
    }

    #[test]
    fn numbers_are_read_as_std_reads_them() {
        for text in [
            "0",
            "-0",
            "1",
            "+1",
            "1.",
            ".5",
            "-.25",
            "1e3",
            "1E-3",
            "1.5e+2",
            "3.14159265358979",
            "1e-45",
            "1e-38",
            "16777217",
            "123456789.125",
            "0.1",
            "1e22",
            "9007199254740993",
            "3.4028234e38",
            "0000000000000000000001",
            "1.00000005960464477539",
            "7.0064923216240853546186479164495e-46",
        ] {
            let expected: f32 = text.parse().unwrap();
            assert_eq!(parse_f32(text.as_bytes()).map(f32::to_bits), Some(expected.to_bits()), "{text}");
        }
        // Half-way cases and random digits: every value agrees with std bit for bit.
        let mut state = 1u64;
        for _ in 0..200_000 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let digits = 1 + (state >> 59) % 12;
            let text = format!("{}e{}", (state >> 20) % 10u64.pow(digits as u32), (state >> 8) as i64 % 20 - 10);
            assert_eq!(parse_f32(text.as_bytes()), text.parse().ok(), "{text}");
        }
        for text in ["", "-", ".", "e5", "1e", "1e+", "nan", "inf", "0x10", "1f", "1.2.3", "--1", "1e999", "1,5"] {
            assert_eq!(parse_f32(text.as_bytes()), None, "{text}");
            assert_eq!(parse_f64(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn integers_are_whole_and_fit() {
        assert_eq!(parse_i32(b"-2147483648"), Some(i32::MIN));
        assert_eq!(parse_i32(b"+7"), Some(7));
        for text in ["2147483648", "1.0", "1e3", "", "-", "99999999999999999999999"] {
            assert_eq!(parse_i32(text.as_bytes()), None, "{text}");
        }
    }
}
