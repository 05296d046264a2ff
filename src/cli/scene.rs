//! `zsim scene`: a scene as a page, a floor plan, or a mesh.

use super::arguments::{Global, spec_file};
use super::usage::Usage;
use super::{Completion, message, output, quantity};
use clap::{Args, Subcommand};
use serde_json::json;
use std::path::{Path, PathBuf};
use zsim_base::files::{replace_bytes, replace_text};
use zsim_base::spec::Kind;
use zsim_report::scene;
use zsim_world::{MeshFormat, World};

/// Look at a scene, and export it for other programs
#[derive(Args)]
#[command(after_help = "Example:\n  zsim scene view office office.html")]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    View(ViewArguments),
    Plan(PlanArguments),
    Export(ExportArguments),
}

/// Write the scene as a page: surfaces in 3-D, floor plan, materials, routes
#[derive(Args)]
#[command(after_help = "Example:\n  zsim scene view office office.html")]
struct ViewArguments {
    #[command(flatten)]
    files: Files,
}

/// Draw a floor plan and an elevation as SVG
#[derive(Args)]
#[command(after_help = "Example:\n  zsim scene plan stairwell stairwell.svg --height 1.5m")]
struct PlanArguments {
    #[command(flatten)]
    files: Files,
    /// Height of the cut above the floor at the start of the default route
    #[arg(long, value_name = "LENGTH", value_parser = quantity::metres, default_value = "1.2m", allow_hyphen_values = true)]
    height: f64,
}

/// Write the static surfaces as a mesh: .glb (with materials), .obj or .stl
#[derive(Args)]
#[command(after_help = "Example:\n  zsim scene export office office.glb")]
struct ExportArguments {
    #[command(flatten)]
    files: Files,
}

#[derive(Args)]
struct Files {
    /// A scene: a name, or a file
    #[arg(value_name = "SCENE")]
    scene: String,
    /// File for the result; if it exists, a number is added to the name
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Overwrite FILE if it exists
    #[arg(long)]
    force: bool,
}

impl Files {
    /// Checks the ending of the file, builds the scene, and chooses the name of the file.
    fn open(&self, endings: &[&str]) -> anyhow::Result<(World, PathBuf)> {
        let ending = self.file.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        if !endings.iter().any(|known| ending.eq_ignore_ascii_case(known)) {
            let wanted = endings.iter().map(|ending| format!(".{ending}")).collect::<Vec<_>>().join(", ");
            return Err(Usage(format!("the file `{}` must end in {wanted}", self.file.display())).into());
        }
        let world = World::load(&self.scene)?;
        let inputs = world.mesh_files().iter().cloned().chain(spec_file(Kind::Scene, &self.scene));
        output::check_not_inputs(inputs, [&self.file])?;
        world.notes().iter().for_each(|note| message::note(note));
        output::check_file(&self.file, self.force)?;
        Ok((world, self.file.clone()))
    }
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    match &arguments.command {
        Command::View(view) => {
            let (world, out) = view.files.open(&["html"])?;
            replace_text(&out, &scene::page(&world)?)?;
            done(&world, &out, "open it in a browser", global)
        }
        Command::Plan(plan) => {
            let (world, out) = plan.files.open(&["svg"])?;
            let figure = scene::plan(&world, plan.height);
            replace_text(&out, &figure.svg()?)?;
            done(&world, &out, "floor plan and elevation", global)
        }
        Command::Export(export) => {
            let (world, out) = export.files.open(&["glb", "obj", "stl"])?;
            let format =
                MeshFormat::of(&out).ok_or_else(|| Usage(format!("the format of {} is not known", out.display())))?;
            replace_bytes(&out, &world.mesh(format)?)?;
            done(&world, &out, "static surfaces, without movers", global)
        }
    }
}

fn done(world: &World, out: &Path, what: &str, global: &Global) -> anyhow::Result<Completion> {
    let text = format!("{}: {} triangles, {what}\n", world.name(), world.triangle_count());
    let figures = json!({ "scene": world.name(), "triangles": world.triangle_count() });
    output::print_result(global, &text, figures, Some(out))
}
