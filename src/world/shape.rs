//! Shapes of scenes, as triangles in their own frame.

mod divisions;
mod height_field;
mod prism;
mod wall;

pub use height_field::HeightsSpec;
pub use wall::OpeningSpec;

use super::triangle::{Triangle, parallelogram};
use divisions::check_count;
use serde::{Deserialize, Serialize};
use zsim_base::geometry::Vector;
use zsim_base::spec::checked;

/// A shape in its own frame with z up, on the plane z = 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum ShapeSpec {
    /// A box, centred on the origin in x and y.
    Box {
        /// Extents along x, y, z, m.
        #[serde(with = "checked::LengthArray::<3>")]
        size_m: [f64; 3],
    },
    /// A rectangle in the plane z = 0, centred on the origin, visible from both sides.
    Rectangle {
        /// Extents along x and y, m.
        #[serde(with = "checked::LengthArray::<2>")]
        size_m: [f64; 2],
    },
    /// A wall from the origin along x, centred on y = 0.
    Wall {
        /// Extent along x, m.
        #[serde(with = "checked::Length")]
        length_m: f64,
        /// Extent along z, m.
        #[serde(with = "checked::Length")]
        height_m: f64,
        /// Extent along y, m.
        #[serde(with = "checked::Length")]
        thickness_m: f64,
        /// Doorways and windows in order along x. Default: none.
        #[serde(default)]
        openings: Vec<OpeningSpec>,
    },
    /// An upright cylinder about z: a prism whose corners lie on the circle.
    Cylinder {
        /// Radius, m.
        #[serde(with = "checked::Length")]
        radius_m: f64,
        /// Extent along z, m.
        #[serde(with = "checked::Length")]
        height_m: f64,
        /// Number of sides. Default: 24.
        #[serde(default = "default_sides")]
        sides: usize,
    },
    /// A flight of stairs that climbs along x from the origin, centred in y.
    Stairs {
        /// Number of steps.
        steps: usize,
        /// Extent along y, m.
        #[serde(with = "checked::Length")]
        width_m: f64,
        /// Height of a step, m.
        #[serde(with = "checked::Length")]
        rise_m: f64,
        /// Depth of a step, m.
        #[serde(with = "checked::Length")]
        tread_m: f64,
        /// Thickness below the inner edges of the steps, m, with a sloped soffit. Default: solid down to z = 0.
        #[serde(default, with = "checked::NonNegative")]
        slab_m: f64,
    },
    /// Terrain with a height at each node of a grid, centred on the origin in x and y.
    HeightField {
        /// Extents along x and y, m.
        #[serde(with = "checked::LengthArray::<2>")]
        size_m: [f64; 2],
        /// The heights.
        heights: HeightsSpec,
    },
    /// A mesh from an OBJ, STL, PLY or glTF file, recognised by the extension.
    Mesh {
        /// The file, relative to the folder of the scene.
        file: String,
        /// Metres per unit of the file. Default: 1.
        #[serde(default = "default_scale", with = "checked::Positive")]
        scale: f64,
        /// Unit of length of the file, multiplied by `scale`. Default: metres.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        unit: Option<LengthUnit>,
        /// Axis of the file that points up. Default: y for glTF (by specification), z for other formats.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        up: Option<UpAxis>,
    },
}

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LengthUnit {
    /// Metres.
    M,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
    /// Inches of 25.4 mm.
    Inch,
    /// Feet of 304.8 mm.
    Foot,
}

impl LengthUnit {
    /// Metres per unit.
    pub(super) fn metres(self) -> f64 {
        match self {
            LengthUnit::M => 1.0,
            LengthUnit::Cm => 0.01,
            LengthUnit::Mm => 0.001,
            LengthUnit::Inch => 0.0254,
            LengthUnit::Foot => 0.3048,
        }
    }
}

/// The axis of a mesh that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UpAxis {
    /// y, as in glTF: x is kept, z becomes -y.
    Y,
    /// z, as in scenes.
    Z,
}

fn default_sides() -> usize {
    24
}

fn default_scale() -> f64 {
    1.0
}

impl ShapeSpec {
    /// The triangles of the shape; empty for a mesh, whose triangles are in the file.
    ///
    /// # Errors
    /// The key and a message, if the values are inconsistent.
    pub(super) fn triangles(&self) -> Result<Vec<Triangle>, (&'static str, String)> {
        match self {
            ShapeSpec::Box { size_m: [x, y, z] } => {
                Ok(prism::cuboid(Vector::new(-x / 2.0, -y / 2.0, 0.0), Vector::new(*x, *y, *z)))
            }
            ShapeSpec::Rectangle { size_m: [x, y] } => {
                let corner = Vector::new(-x / 2.0, -y / 2.0, 0.0);
                Ok(parallelogram(corner, Vector::x() * *x, Vector::y() * *y).to_vec())
            }
            ShapeSpec::Wall { length_m, height_m, thickness_m, openings } => {
                let size = Vector::new(*length_m, *thickness_m, *height_m);
                wall::triangles(size, openings).map_err(|sentence| ("openings", sentence))
            }
            ShapeSpec::Cylinder { radius_m, height_m, sides } => {
                check_count("sides", *sides, 3)?;
                Ok(prism::cylinder(*radius_m, *height_m, *sides))
            }
            ShapeSpec::Stairs { steps, width_m, rise_m, tread_m, slab_m } => {
                check_count("steps", *steps, 1)?;
                Ok(prism::stairs(*steps, Vector::new(*tread_m, *width_m, *rise_m), *slab_m))
            }
            ShapeSpec::HeightField { size_m, heights } => height_field::triangles(*size_m, heights),
            ShapeSpec::Mesh { .. } => Ok(Vec::new()),
        }
    }
}

#[cfg(test)]
pub(super) fn area(triangles: &[Triangle]) -> f64 {
    triangles.iter().map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Volume inside a closed surface with outward faces, by the divergence theorem.
    fn volume(triangles: &[Triangle]) -> f64 {
        triangles.iter().map(|[a, b, c]| a.dot(&b.cross(c)) / 6.0).sum()
    }

    fn triangles(shape: &ShapeSpec) -> Vec<Triangle> {
        shape.triangles().unwrap()
    }

    #[test]
    fn a_box_has_the_area_and_volume_of_a_box() {
        let faces = triangles(&ShapeSpec::Box { size_m: [1.0, 2.0, 3.0] });
        assert_eq!(faces.len(), 12);
        assert_relative_eq!(area(&faces), 2.0 * (2.0 + 3.0 + 6.0), epsilon = 1e-12);
        assert_relative_eq!(volume(&faces), 6.0, epsilon = 1e-12);
    }

    #[test]
    fn a_cylinder_is_the_prism_over_a_regular_polygon() {
        // A regular n-gon of circumradius r has the area n r^2 sin(2 pi / n) / 2.
        let faces = triangles(&ShapeSpec::Cylinder { radius_m: 0.5, height_m: 2.0, sides: 7 });
        let polygon = 7.0 * 0.25 * (std::f64::consts::TAU / 7.0).sin() / 2.0;
        assert_relative_eq!(volume(&faces), 2.0 * polygon, epsilon = 1e-12);
    }

    #[test]
    fn a_flight_of_stairs_holds_the_volume_of_its_steps() {
        // Step k of n (from 1) is k rises high: the sum is n (n + 1) / 2 blocks of tread x width x rise.
        // With a slab, each step is a trapezoid: slab + rise high at the front, slab at the back.
        for (slab_m, expected) in [(0.0, 10.0 * 1.2 * 0.18 * 0.27), (0.2, 4.0 * 1.2 * 0.27 * (0.2 + 0.09))] {
            let faces = triangles(&ShapeSpec::Stairs { steps: 4, width_m: 1.2, rise_m: 0.18, tread_m: 0.27, slab_m });
            assert_relative_eq!(volume(&faces), expected, epsilon = 1e-12);
        }
    }

    #[test]
    fn a_wall_with_a_door_and_a_window_loses_their_volume() {
        let openings = vec![
            OpeningSpec { from_m: 1.0, to_m: 2.0, sill_m: 0.0, head_m: 2.0 },
            OpeningSpec { from_m: 3.0, to_m: 4.5, sill_m: 1.0, head_m: 2.0 },
        ];
        let wall = ShapeSpec::Wall { length_m: 5.0, height_m: 2.5, thickness_m: 0.1, openings };
        assert_relative_eq!(volume(&triangles(&wall)), 0.1 * (12.5 - 2.0 - 1.5), epsilon = 1e-12);
    }

    #[test]
    fn numbers_that_do_not_fit_are_refused_with_their_key() {
        let opening = |from_m, to_m, head_m| OpeningSpec { from_m, to_m, sill_m: 0.0, head_m };
        let wall = |openings| ShapeSpec::Wall { length_m: 5.0, height_m: 2.5, thickness_m: 0.1, openings }.triangles();
        for openings in [
            vec![opening(1.0, 0.5, 2.0)],
            vec![opening(4.0, 5.5, 2.0)],
            vec![opening(1.0, 2.0, 3.0)],
            vec![opening(1.0, 2.0, 2.0), opening(1.5, 3.0, 2.0)],
        ] {
            assert_eq!(wall(openings).unwrap_err().0, "openings");
        }
        assert!(ShapeSpec::Cylinder { radius_m: 1.0, height_m: 1.0, sides: 2 }.triangles().is_err());
        let many = ShapeSpec::Stairs { steps: usize::MAX, width_m: 1.0, rise_m: 1.0, tread_m: 1.0, slab_m: 0.0 };
        assert_eq!(many.triangles().unwrap_err().0, "steps");
    }
}
