use zsim_base::spec::SpecError;

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
