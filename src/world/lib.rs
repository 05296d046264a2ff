//! Worlds: surfaces built from the file of a scene, into which rays can be cast.
//!
//! A [`SceneSpec`] (RON, under `scenes/`) lists materials, shapes, templates of furniture, scattered objects, meshes
//! from files, movers, swaying plants, canopies, and routes to walk. [`World::build`] checks it and builds one set of
//! triangles. [`World::cast`] returns the first surface on a ray: distance, normal and material.
//!
//! ```
//! use zsim_base::geometry::Vector;
//! use zsim_world::{Ray, World};
//!
//! let office = World::load("office")?;
//! let route = office.default_route().ok_or("no route")?;
//! let eye = route.points_in_world[0] + Vector::new(0.0, 0.0, 1.0);
//! let down = Ray { origin_in_world: eye, direction_in_world: -Vector::z() };
//! let hit = office.cast(&down, 30.0, 0.0).ok_or("no floor")?;
//! assert!((hit.distance_m - 1.0).abs() < 1e-9);
//! assert_eq!(office.material(hit.material).name, "carpet");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod build;
mod canopy;
mod caster;
mod error;
mod export;
mod import;
mod include;
mod material;
mod meadow;
mod meshes;
mod model;
mod mover;
mod placement;
mod planes;
mod ray;
mod route_check;
mod routes;
mod scatter;
mod section;
mod shape;
mod spec;
mod sway;
mod triangle;
mod usual;

pub use canopy::CanopyCrossing;
pub use error::WorldError;
pub use export::{MeshFormat, stl};
pub use material::{Material, MaterialId};
pub use model::World;
pub use placement::Placement;
pub use planes::{FaceId, PlaneId, PlaneMap};
pub use ray::{Hit, Ray, TimedRay};
pub use section::{SectionPlane, Segment};
pub use shape::{HeightsSpec, LengthUnit, OpeningSpec, ShapeSpec, UpAxis};
pub use spec::{
    CanopySpec, ItemSpec, MaterialKind, MaterialSpec, MoverSpec, RouteSpec, ScatterSpec, SceneSpec, SwaySpec, Turn,
    WaypointSpec,
};
