/// Names a material of one [`World`](super::World).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MaterialId(pub(super) u16);

/// What a surface does with a laser's light.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Its name in the scene.
    pub name: String,
    /// Fraction of the light that it scatters back at normal incidence, 0 to 1 (1: a white Lambertian target).
    pub reflectance: f64,
    /// Fraction of the light that goes through, 0 for an opaque one.
    pub transmission: f64,
}

impl Material {
    /// Whether light goes through, so that a caster has to look behind a hit on it.
    pub fn is_transparent(&self) -> bool {
        self.transmission > 0.0
    }
}
