/// Identifies a material of a [`World`](super::World).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MaterialId(pub(super) u16);

impl MaterialId {
    /// Position of the material in the list of the world's materials.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

/// Optical properties of a surface at the laser wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name in the scene.
    pub name: String,
    /// Fraction of light scattered back at normal incidence, 0 to 1 (1: a white Lambertian target).
    pub reflectance: f64,
    /// Fraction of light transmitted; 0 for an opaque material.
    pub transmission: f64,
}

impl Material {
    /// Whether the material transmits light, so that the ray continues behind a hit.
    pub fn is_transparent(&self) -> bool {
        self.transmission > 0.0
    }
}

/// A name as one word, as an OBJ file needs it: without white space, control characters and comments.
pub(super) fn one_word(name: &str) -> String {
    name.chars().map(|c| if c.is_whitespace() || c.is_control() || c == '#' || c == '\\' { '_' } else { c }).collect()
}
