//! Default settings: those of `specs/estimators/default.ron`, which is in the binary.

use super::removed;
use super::surfel::FineSurfelSpec;
use super::{
    ClockSpec, EstimatorSpec, ExtrinsicsSpec, InertialSpec, MatchingSpec, PlacesSpec, RegistrationSpec, SolveSpec,
    SurfelSpec, ViewSpec,
};
use crate::EstimationError;
use std::sync::LazyLock;
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, Tree, built_in, parse_over};

/// The text of the default settings.
static TREE: LazyLock<Result<Tree, SpecError>> = LazyLock::new(|| {
    let missing = || SpecError::plain("default.ron", "is not in the binary");
    Tree::read(&built_in(Kind::Estimator, "default.ron").ok_or_else(missing)?)
});

/// The default settings.
#[expect(clippy::expect_used, reason = "a test reads the text, which is in the binary")]
static SPEC: LazyLock<EstimatorSpec> =
    LazyLock::new(|| tree().and_then(Tree::to).expect("the built-in settings of the estimator"));

/// The default settings as a tree.
///
/// # Errors
/// If the text in the binary is not RON.
fn tree() -> Result<&'static Tree, SpecError> {
    TREE.as_ref().map_err(SpecError::clone)
}

impl NamedSpec for EstimatorSpec {
    const KIND: Kind = Kind::Estimator;
    type Error = SpecError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        parse_over(source, Some(tree()?)).map_err(removed::explained)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        match self.check() {
            Ok(()) => Ok(Vec::new()),
            Err(EstimationError::Setting { key, message }) => Err(SpecError::about(source, key, message)),
            Err(error) => Err(SpecError::plain(&source.name, error.to_string())),
        }
    }
}

impl Default for EstimatorSpec {
    fn default() -> Self {
        SPEC.clone()
    }
}

/// The default of each group of settings is its part of the default settings.
macro_rules! parts {
    ($($part:ty: $($key:ident).+;)*) => {$(
        impl Default for $part {
            fn default() -> Self {
                SPEC.$($key).+.clone()
            }
        }
    )*};
}

parts! {
    SurfelSpec: surfels;
    FineSurfelSpec: surfels.fine;
    MatchingSpec: matching;
    SolveSpec: solve;
    InertialSpec: inertial;
    ClockSpec: clock;
    ExtrinsicsSpec: extrinsics;
    ViewSpec: views;
    RegistrationSpec: registration;
    PlacesSpec: registration.places;
}
