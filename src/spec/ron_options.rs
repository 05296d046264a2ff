//! Options of the RON parser.

/// Options of RON for specs: `Some` can be omitted around values.
pub(super) fn options() -> ron::Options {
    ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
}
