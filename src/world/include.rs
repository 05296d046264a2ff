//! Scenes that bring other scenes along.

use super::build::build;
use super::{ItemSpec, SceneSpec, ShapeSpec, WorldError};
use crate::spec::{Kind, Source, SpecError, find, parse};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Deepest chain of scenes that include each other.
const MOST_DEEP: usize = 16;

impl SceneSpec {
    /// This scene and those that it includes as one that includes none. `source` is the text it came from: a scene is
    /// looked for beside it, and then as everywhere.
    ///
    /// What is included comes first. The name is this scene's own; so is the default route, if it has one, or else that
    /// of the first included scene that does.
    ///
    /// # Errors
    /// When an included scene is missing, wrong by itself, or includes itself; when two define one name; and when one
    /// has meshes, which are looked for beside the scene that includes it, in another folder.
    pub fn with_includes(&self, source: &Source) -> Result<Self, WorldError> {
        whole(self, &[source])
    }
}

/// `spec`, read from the last of `chain`, each of which is included by the one before it, as a scene that includes
/// none.
fn whole(spec: &SceneSpec, chain: &[&Source]) -> Result<SceneSpec, WorldError> {
    let Some(source) = chain.last() else { return Ok(spec.clone()) };
    let own = SceneSpec { include: Vec::new(), ..spec.clone() };
    let mut others: Option<SceneSpec> = None;
    for name in &spec.include {
        let wrong = |what: String| SpecError::about(source, name, format!("the included scene `{name}` {what}"));
        let other = beside(source, name).map_err(|error| wrong(format!("is missing: {}", error.message())))?;
        if chain.iter().any(|before| before.text == other.text) {
            return Err(wrong("includes itself, directly or through another".to_owned()).into());
        }
        if chain.len() > MOST_DEEP {
            return Err(wrong(format!("is included {} levels deep; {MOST_DEEP} at most", chain.len())).into());
        }
        let other_chain: Vec<&Source> = chain.iter().copied().chain([&other]).collect();
        let included = whole(&parse(&other)?, &other_chain)?;
        if other.folder != source.folder && has_meshes(&included) {
            return Err(wrong("has meshes: keep it in the folder of the scene that includes it".to_owned()).into());
        }
        // What is wrong with it is told where it stands, in its own text.
        build(&included, &other)?;
        others = Some(match others {
            None => included,
            Some(before) => joined(before, included, source)?,
        });
    }
    let Some(others) = others else { return Ok(own) };
    let default_route = own.default_route.clone().or_else(|| others.default_route.clone());
    Ok(SceneSpec { name: own.name.clone(), default_route, ..joined(others, own, source)? })
}

/// The scene called `name` in the folder of `source`, or wherever scenes are.
fn beside(source: &Source, name: &str) -> Result<Source, SpecError> {
    let file = if name.ends_with(".ron") { name.to_owned() } else { format!("{name}.ron") };
    let path: Option<PathBuf> = source.folder.as_ref().map(|folder| folder.join(file));
    match path.filter(|path| path.is_file()) {
        Some(path) => Source::read(&path),
        None => find(Kind::Scene, name),
    }
}

fn has_meshes(spec: &SceneSpec) -> bool {
    let is_mesh = |item: &ItemSpec| matches!(item, ItemSpec::Solid { shape: ShapeSpec::Mesh { .. }, .. });
    spec.items.iter().chain(spec.templates.values().flatten()).any(is_mesh)
}

/// All of two scenes, the first one's first, under its name.
fn joined(mut first: SceneSpec, second: SceneSpec, source: &Source) -> Result<SceneSpec, SpecError> {
    join(&mut first.materials, second.materials, "material", source)?;
    join(&mut first.templates, second.templates, "template", source)?;
    join(&mut first.routes, second.routes, "route", source)?;
    first.items.extend(second.items);
    first.movers.extend(second.movers);
    first.default_route = first.default_route.or(second.default_route);
    Ok(first)
}

fn join<T>(
    first: &mut BTreeMap<String, T>,
    second: BTreeMap<String, T>,
    what: &str,
    source: &Source,
) -> Result<(), SpecError> {
    for (name, value) in second {
        if first.contains_key(&name) {
            let message = format!("two of the scenes that make up this one define the {what} `{name}`: rename one");
            return Err(SpecError::about(source, &name, message));
        }
        first.insert(name, value);
    }
    Ok(())
}
