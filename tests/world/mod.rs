//! Worlds: scenes, meshes, movers, ray casts, and invalid files.

mod casts;
mod exports;
mod includes;
mod limits;
mod mesh_files;
mod meshes;
mod planes;
mod plants;
mod routes;
mod scenes;
mod specs;
mod traffic;
