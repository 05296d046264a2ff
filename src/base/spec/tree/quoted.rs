//! Strings, byte strings and characters in quotes.

use super::lexer::{Fault, Lexer, Parsed};
use super::node::Kind;

const NOT_A_CHARACTER: &str = "Not a valid byte-escaped Unicode character";

/// What an escape means.
enum Escape {
    Byte(u8),
    Char(char),
    /// A line break and the indentation of the next line.
    Continuation,
}

impl Lexer<'_> {
    /// Reads a string, byte string or character; `None` if something else is next.
    pub fn quoted(&mut self) -> Parsed<Option<Kind>> {
        let start = self.at;
        let kind = if self.take("\"") {
            Kind::String(self.string(start)?)
        } else if self.take("b\"") {
            Kind::Bytes(self.escaped(start)?.into())
        } else if self.take("br") {
            Kind::Bytes(self.raw(start)?.as_bytes().into())
        } else if self.take("b'") {
            Kind::Byte(self.byte(start)?)
        } else if self.take("'") {
            Kind::Char(self.character()?)
        } else if self.rest().starts_with('r') {
            self.at += 1;
            Kind::String(self.raw(start)?.into())
        } else {
            return Ok(None);
        };
        Ok(Some(kind))
    }

    fn string(&mut self, start: usize) -> Parsed<Box<str>> {
        let bytes = self.escaped(start)?;
        let text = String::from_utf8(bytes).map_err(|_| Fault { at: start, message: NOT_A_CHARACTER.into() })?;
        Ok(text.into())
    }

    /// Reads the rest of a string with escapes that begins at `start`.
    fn escaped(&mut self, start: usize) -> Parsed<Vec<u8>> {
        let mut bytes = Vec::new();
        loop {
            bytes.extend_from_slice(self.take_while(|c| !matches!(c, '"' | '\\')).as_bytes());
            if self.take("\"") {
                return Ok(bytes);
            }
            if self.rest().is_empty() {
                return Err(Fault { at: start, message: "Expected end of string".into() });
            }
            match self.escape()? {
                Escape::Byte(byte) => bytes.push(byte),
                Escape::Char(c) => bytes.extend_from_slice(c.encode_utf8(&mut [0; 4]).as_bytes()),
                Escape::Continuation => {}
            }
        }
    }

    /// Reads the rest of a raw string that begins at `start`: hashes, and text in quotes.
    fn raw(&mut self, start: usize) -> Parsed<&str> {
        let hashes = self.take_while(|c| c == '#');
        if !self.take("\"") {
            return Err(Fault { at: start, message: "Expected string".into() });
        }
        let ending = format!("\"{hashes}");
        let rest = self.rest();
        let Some(length) = rest.find(&ending) else {
            return Err(Fault { at: start, message: "Expected end of string".into() });
        };
        self.at += length + ending.len();
        Ok(&rest[..length])
    }

    fn byte(&mut self, start: usize) -> Parsed<u8> {
        let byte = match self.peek() {
            Some('\\') => match self.escape()? {
                Escape::Byte(byte) => Some(byte),
                Escape::Char(_) | Escape::Continuation => None,
            },
            _ => u8::try_from(self.next()?).ok().filter(u8::is_ascii),
        };
        let closed = self.take("'");
        byte.filter(|_| closed).ok_or_else(|| Fault { at: start, message: "Expected byte literal".into() })
    }

    fn character(&mut self) -> Parsed<char> {
        let start = self.at;
        let c = match self.peek() {
            Some('\\') => match self.escape()? {
                Escape::Byte(byte) if byte.is_ascii() => char::from(byte),
                Escape::Char(c) => c,
                Escape::Byte(_) => return Err(Fault { at: start, message: NOT_A_CHARACTER.into() }),
                Escape::Continuation => return Err(Fault { at: start, message: "Unknown escape character".into() }),
            },
            _ => self.next()?,
        };
        if self.take("'") { Ok(c) } else { Err(self.fault("Expected char")) }
    }

    /// Reads an escape.
    fn escape(&mut self) -> Parsed<Escape> {
        let start = self.at;
        self.at += 1;
        let byte = match self.next()? {
            c @ ('\'' | '"' | '\\') => c as u8,
            'n' => b'\n',
            'r' => b'\r',
            't' => b'\t',
            '0' => b'\0',
            'x' => return self.hexadecimal_byte(),
            'u' => return self.unicode(start),
            '\n' => return Ok(self.continuation()),
            '\r' if self.take("\n") => return Ok(self.continuation()),
            _ => return Err(Fault { at: start, message: "Unknown escape character".into() }),
        };
        Ok(Escape::Byte(byte))
    }

    fn continuation(&mut self) -> Escape {
        self.take_while(|c| matches!(c, ' ' | '\t' | '\n' | '\r'));
        Escape::Continuation
    }

    fn hexadecimal_byte(&mut self) -> Parsed<Escape> {
        let digits = [self.hexadecimal_digit()?, self.hexadecimal_digit()?];
        Ok(Escape::Byte((16 * digits[0] + digits[1]) as u8))
    }

    fn hexadecimal_digit(&mut self) -> Parsed<u32> {
        let start = self.at;
        self.next()?.to_digit(16).ok_or_else(|| Fault { at: start, message: "Non-hex digit found".into() })
    }

    /// Reads the rest of `\u{...}`.
    fn unicode(&mut self, start: usize) -> Parsed<Escape> {
        if !self.take("{") {
            return Err(self.fault("Missing { in Unicode escape"));
        }
        let (mut code, mut count) = (0, 0);
        while count < 6 && self.peek() != Some('}') {
            code = 16 * code + self.hexadecimal_digit()?;
            count += 1;
        }
        if count == 0 {
            return Err(self.fault("Expected 1-6 digits, got 0 digits in Unicode escape"));
        }
        if !self.take("}") {
            return Err(self.fault("No } at the end of Unicode escape"));
        }
        let c = char::from_u32(code);
        c.map(Escape::Char).ok_or_else(|| Fault { at: start, message: "Not a valid Unicode-escaped character".into() })
    }
}
