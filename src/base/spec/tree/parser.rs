//! The parser of RON: text to nodes. It knows no types and is compiled once.

use super::lexer::{Fault, Lexer, Parsed};
use super::node::{Entry, Kind, Node};

/// Maximum number of brackets inside one another.
///
/// The `ron` crate allows about as many: it counts to 128, by two or three for a bracket.
pub(super) const MAX_DEPTH: usize = 64;

/// A parser of values.
pub(super) struct Parser<'a> {
    pub lexer: Lexer<'a>,
    depth: usize,
}

impl<'a> Parser<'a> {
    /// A parser of `text` from its beginning.
    pub fn new(text: &'a str) -> Self {
        Self { lexer: Lexer { text, at: 0 }, depth: 0 }
    }

    /// Parses the value that is the rest of the text.
    pub fn document(&mut self) -> Parsed<Node> {
        self.lexer.skip_space()?;
        let node = self.value()?;
        self.lexer.skip_space()?;
        if self.lexer.rest().is_empty() {
            Ok(node)
        } else {
            Err(self.lexer.fault("Non-whitespace trailing characters"))
        }
    }

    fn value(&mut self) -> Parsed<Node> {
        let start = self.lexer.at;
        if let Some(name) = self.lexer.identifier()? {
            return self.name(start, name);
        }
        if let Some(kind) = self.lexer.quoted()? {
            return Ok(self.lexer.node(start, kind));
        }
        let kind = match self.lexer.peek() {
            Some('(') => self.group()?,
            Some('[') => Kind::List(self.bracketed("[", "]", Self::value)?),
            Some('{') => Kind::Map(self.bracketed("{", "}", Self::pair)?),
            Some('0'..='9' | '+' | '-' | '.') => self.lexer.number()?,
            Some(c) => return Err(self.lexer.fault(format!("Unexpected char {c:?}"))),
            None => return Err(self.lexer.end_of_text()),
        };
        Ok(self.lexer.node(start, kind))
    }

    /// Parses what follows a name: its fields, if there are any.
    fn name(&mut self, start: usize, name: &str) -> Parsed<Node> {
        let node = self.lexer.node(start, Kind::Name(name.into()));
        self.lexer.skip_space()?;
        let opening = self.lexer.at;
        if self.lexer.peek() != Some('(') {
            return Ok(node);
        }
        let kind = self.group()?;
        let name = Node { kind: Kind::String(name.into()), ..node };
        let fields = self.lexer.node(opening, kind);
        Ok(self.lexer.node(start, Kind::Named(Box::new((name, fields)))))
    }

    /// Parses values or fields in parentheses.
    fn group(&mut self) -> Parsed<Kind> {
        if self.has_keys()? {
            Ok(Kind::Struct(self.bracketed("(", ")", Self::field)?))
        } else {
            Ok(Kind::Tuple(self.bracketed("(", ")", Self::value)?))
        }
    }

    /// Whether the group that is next begins with a key.
    ///
    /// A name that is followed by something unexpected is a key too: a colon is missing.
    fn has_keys(&mut self) -> Parsed<bool> {
        let start = self.lexer.at;
        self.lexer.take("(");
        self.lexer.skip_space()?;
        let has_name = self.lexer.identifier()?.is_some();
        self.lexer.skip_space()?;
        let is_value = matches!(self.lexer.peek(), Some(',' | ')' | '('));
        self.lexer.at = start;
        Ok(has_name && !is_value)
    }

    /// Parses items between brackets, separated by commas.
    fn bracketed<T>(&mut self, opening: &str, closing: &str, item: fn(&mut Self) -> Parsed<T>) -> Parsed<Box<[T]>> {
        if self.depth == MAX_DEPTH {
            return Err(self.too_deep());
        }
        self.depth += 1;
        self.lexer.take(opening);
        let mut items = Vec::new();
        let mut has_comma = true;
        loop {
            self.lexer.skip_space()?;
            if self.lexer.take(closing) {
                break;
            }
            if !has_comma {
                return Err(self.lexer.fault("Expected comma"));
            }
            items.push(item(self)?);
            self.lexer.skip_space()?;
            has_comma = self.lexer.take(",");
        }
        self.depth -= 1;
        Ok(items.into_boxed_slice())
    }

    #[cold]
    fn too_deep(&self) -> Fault {
        self.lexer.fault(format!("Exceeded recursion limit: more than {MAX_DEPTH} brackets inside one another"))
    }

    fn field(&mut self) -> Parsed<Entry> {
        let start = self.lexer.at;
        let Some(name) = self.lexer.identifier()? else {
            return Err(match self.lexer.peek() {
                Some(_) => self.lexer.fault("Expected identifier"),
                None => self.lexer.end_of_text(),
            });
        };
        let key = self.lexer.node(start, Kind::String(name.into()));
        Ok((key, self.value_after_colon()?))
    }

    fn pair(&mut self) -> Parsed<Entry> {
        Ok((self.value()?, self.value_after_colon()?))
    }

    fn value_after_colon(&mut self) -> Parsed<Node> {
        self.lexer.skip_space()?;
        if !self.lexer.take(":") {
            return Err(self.lexer.fault("Expected colon"));
        }
        self.lexer.skip_space()?;
        self.value()
    }
}
