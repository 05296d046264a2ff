use zsim_base::spec::{Source, SpecError};

/// Why a world cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WorldError {
    /// The scene cannot be found or parsed, or the content is invalid.
    #[error(transparent)]
    Scene(#[from] SpecError),
    /// A mesh of the scene is invalid; the error points to the name in the scene.
    #[error(transparent)]
    Mesh(SpecError),
}

/// An error about a name that the scene does not define; lists the names that it defines.
pub(super) fn unknown_name<'a>(
    source: &Source,
    what: &str,
    name: &str,
    known: impl Iterator<Item = &'a String>,
) -> SpecError {
    let known: Vec<&str> = known.map(String::as_str).collect();
    SpecError::about(source, name, format!("the scene has no {what} `{name}`"))
        .with_help(format!("it has: {}", if known.is_empty() { "none".to_owned() } else { known.join(", ") }))
}
