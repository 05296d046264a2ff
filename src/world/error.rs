use crate::spec::SpecError;

/// Why no world could be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WorldError {
    /// The scene cannot be found, cannot be parsed, or describes what cannot be built.
    #[error(transparent)]
    Scene(#[from] SpecError),
    /// A mesh that the scene names is wrong; the error points at the name in the scene.
    #[error(transparent)]
    Mesh(SpecError),
}
