//! Scenes that include other scenes.

use super::build::build;
use super::{ItemSpec, SceneSpec, ShapeSpec, WorldError};
use std::collections::BTreeMap;
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, find_from};

/// Maximum depth of included scenes.
const MAX_INCLUDE_DEPTH: usize = 16;

impl SceneSpec {
    /// This scene merged with all scenes that it includes.
    ///
    /// `source` is the text of this scene. An included scene is searched for in the folder of `source` first, then in
    /// the library. Items of included scenes come first. The name is that of this scene. The default route is that of
    /// this scene, otherwise that of the first included scene that has one.
    ///
    /// # Errors
    /// If an included scene is missing, invalid or includes itself; if two scenes define the same name; or if a scene
    /// with meshes is in another folder than the scene that includes it, from which mesh paths are resolved.
    pub fn with_includes(&self, source: &Source) -> Result<Self, WorldError> {
        flatten(self, &[source])
    }
}

/// `spec` merged with the included scenes. `chain` holds the sources from the outermost scene to `spec`, each included
/// by the one before.
fn flatten(spec: &SceneSpec, chain: &[&Source]) -> Result<SceneSpec, WorldError> {
    let Some(source) = chain.last() else { return Ok(spec.clone()) };
    let own = SceneSpec { include: Vec::new(), ..spec.clone() };
    let mut others: Option<SceneSpec> = None;
    for name in &spec.include {
        let wrong = |what: String| SpecError::about(source, name, format!("the included scene `{name}` {what}"));
        let other = find_from(Kind::Scene, source, name)
            .map_err(|error| wrong(format!("cannot be used: {}", error.message())))?;
        if chain.iter().any(|before| before.text == other.text) {
            return Err(wrong("includes itself, directly or through another".to_owned()).into());
        }
        if chain.len() > MAX_INCLUDE_DEPTH {
            return Err(wrong(format!("is included {} levels deep; {MAX_INCLUDE_DEPTH} at most", chain.len())).into());
        }
        let other_chain: Vec<&Source> = chain.iter().copied().chain([&other]).collect();
        let included = flatten(&SceneSpec::parse(&other)?, &other_chain)?;
        if other.folder != source.folder && has_meshes(&included) {
            return Err(wrong("has meshes: keep it in the folder of the scene that includes it".to_owned()).into());
        }
        // Build it separately, so that errors refer to the included file.
        build(&included, &other)?;
        others = Some(match others {
            None => included,
            Some(before) => merge(before, included, source)?,
        });
    }
    let Some(others) = others else { return Ok(own) };
    let default_route = own.default_route.clone().or_else(|| others.default_route.clone());
    Ok(SceneSpec { name: own.name.clone(), default_route, ..merge(others, own, source)? })
}

fn has_meshes(spec: &SceneSpec) -> bool {
    let is_mesh = |item: &ItemSpec| matches!(item, ItemSpec::Solid { shape: ShapeSpec::Mesh { .. }, .. });
    spec.items.iter().chain(spec.templates.values().flatten()).any(is_mesh)
}

/// Merges two scenes: the parts of `first` come first; the name is that of `first`.
fn merge(mut first: SceneSpec, second: SceneSpec, source: &Source) -> Result<SceneSpec, SpecError> {
    merge_named(&mut first.materials, second.materials, "material", source)?;
    merge_named(&mut first.templates, second.templates, "template", source)?;
    merge_named(&mut first.routes, second.routes, "route", source)?;
    first.items.extend(second.items);
    first.movers.extend(second.movers);
    first.swaying.extend(second.swaying);
    first.canopies.extend(second.canopies);
    first.default_route = first.default_route.or(second.default_route);
    Ok(first)
}

fn merge_named<T>(
    first: &mut BTreeMap<String, T>,
    second: BTreeMap<String, T>,
    what: &str,
    source: &Source,
) -> Result<(), SpecError> {
    for (name, value) in second {
        if first.contains_key(&name) {
            let message = format!(
                "this scene and the scenes that it includes define the {what} `{name}` more than once: rename one"
            );
            return Err(SpecError::about(source, &name, message));
        }
        first.insert(name, value);
    }
    Ok(())
}
