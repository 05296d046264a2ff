//! Attributes before the value of a RON file, such as `#![enable(unwrap_newtypes)]`.

use super::lexer::{Fault, Lexer, Parsed};

/// Extensions of RON that a file enables. `implicit_some` is always enabled.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Extensions {
    /// A struct with one unnamed field is written as the field.
    pub unwrap_newtypes: bool,
    /// The fields of the struct in a variant are written in the brackets of the variant.
    pub unwrap_variant_newtypes: bool,
    /// Each struct has its name.
    pub explicit_struct_names: bool,
}

const EXPECTED_ATTRIBUTE: &str = "Expected an `#![enable(...)]` attribute";
const EXPECTED_END: &str = "Expected closing `)]` after the enable attribute";

impl Lexer<'_> {
    /// Reads all attributes.
    pub fn attributes(&mut self) -> Parsed<Extensions> {
        let mut extensions = Extensions::default();
        self.skip_space()?;
        while self.rest().starts_with('#') {
            self.tokens(&["#", "!", "["], EXPECTED_ATTRIBUTE)?;
            match self.identifier()? {
                Some("enable") => self.enable(&mut extensions)?,
                Some("type" | "schema") => self.description()?,
                _ => return Err(self.fault(EXPECTED_ATTRIBUTE)),
            }
            self.skip_space()?;
        }
        Ok(extensions)
    }

    /// Reads tokens with white space after each.
    fn tokens(&mut self, tokens: &[&str], message: &'static str) -> Parsed<()> {
        for token in tokens {
            if !self.take(token) {
                return Err(self.fault(message));
            }
            self.skip_space()?;
        }
        Ok(())
    }

    fn enable(&mut self, extensions: &mut Extensions) -> Parsed<()> {
        self.skip_space()?;
        self.tokens(&["("], EXPECTED_ATTRIBUTE)?;
        loop {
            let start = self.at;
            match self.identifier()? {
                Some("implicit_some") => {}
                Some("unwrap_newtypes") => extensions.unwrap_newtypes = true,
                Some("unwrap_variant_newtypes") => extensions.unwrap_variant_newtypes = true,
                Some("explicit_struct_names") => extensions.explicit_struct_names = true,
                Some(name) => {
                    return Err(Fault { at: start, message: format!("No RON extension named `{name}`").into() });
                }
                None => return Err(self.fault("Expected identifier")),
            }
            self.skip_space()?;
            let has_comma = self.take(",");
            self.skip_space()?;
            match (has_comma, self.rest().starts_with(')')) {
                (_, true) => return self.tokens(&[")", "]"], EXPECTED_END),
                (true, false) => {}
                (false, false) => return Err(self.fault("Expected comma")),
            }
        }
    }

    /// Reads the rest of an attribute that only describes the file.
    fn description(&mut self) -> Parsed<()> {
        self.skip_space()?;
        self.tokens(&["="], EXPECTED_ATTRIBUTE)?;
        if !self.rest().starts_with(['"', 'r']) {
            return Err(self.fault("Expected string"));
        }
        self.quoted()?;
        self.skip_space()?;
        self.tokens(&["]"], EXPECTED_END)
    }
}
