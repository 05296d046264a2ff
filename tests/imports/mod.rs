//! Imports between the files of `src/`, and the circles among them.
//!
//! A file imports the files that define the names that it uses, also if it takes a name over a re-export. The declaration
//! of a submodule and a re-export that the file itself does not use are no imports. Test modules do not count.

use super::code;
use std::collections::{BTreeMap, BTreeSet};

/// Path of a module from the crate's root, by names.
type ModulePath = Vec<String>;

/// What a module declares and uses.
struct Module {
    /// The file, relative to `src/`.
    file: String,
    /// Items defined at the top level.
    items: BTreeSet<String>,
    /// Names that `use` binds, with the paths that they stand for.
    bound: BTreeMap<String, Vec<String>>,
    /// Names among `bound` that the file re-exports without using them.
    only_reexported: BTreeSet<String>,
    /// Every path of the code that has more than one segment.
    paths: Vec<Vec<String>>,
}

/// The modules of the crate by their paths.
pub struct Modules(BTreeMap<ModulePath, Module>);

impl Modules {
    /// Reads the modules from the texts of the files; the keys are relative to `src/`.
    pub fn of(files: &BTreeMap<String, String>) -> Self {
        let modules = files.iter().filter(|(file, _)| *file != "main.rs");
        Self(modules.map(|(file, text)| (module_path(file), Module::of(file, &code(text)))).collect())
    }

    /// Files that import each other in a circle: one sorted list for each group of files that reach each other.
    pub fn circles(&self) -> Vec<Vec<String>> {
        circles_among(&self.imports())
    }

    /// Modules of the same parent, files or folders, that import each other in a circle.
    pub fn circles_of_siblings(&self) -> Vec<Vec<String>> {
        let mut siblings: BTreeMap<String, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
        for (file, imported) in self.imports() {
            for other in imported {
                let Some((parent, a, b)) = siblings_above(&file, &other) else { continue };
                let among = siblings.entry(parent).or_default();
                among.entry(b.clone()).or_default();
                among.entry(a).or_default().insert(b);
            }
        }
        siblings.values().flat_map(circles_among).collect()
    }

    /// The files that each file imports.
    fn imports(&self) -> BTreeMap<String, BTreeSet<String>> {
        let of_module = |path: &ModulePath, module: &Module| {
            let bound = module.bound.iter().filter(|(name, _)| !module.only_reexported.contains(*name));
            let used = module.paths.iter().chain(bound.map(|(_, path)| path));
            let files = used.filter_map(|used| self.file_of(path, used, 0));
            (module.file.clone(), files.filter(|file| *file != module.file).collect())
        };
        self.0.iter().map(|(path, module)| of_module(path, module)).collect()
    }

    /// The file that defines what `used` names in the module `at`; `None` for other crates and for modules.
    fn file_of(&self, at: &ModulePath, used: &[String], depth: usize) -> Option<String> {
        let (mut at, mut rooted) = (at.clone(), depth > 0);
        for (i, name) in used.iter().enumerate() {
            match name.as_str() {
                "crate" => at.clear(),
                "super" => drop(at.pop()),
                "self" => {}
                _ => {
                    let module = self.0.get(&at)?;
                    let is_last = i + 1 == used.len();
                    if self.0.contains_key(&child(&at, name)) && !(is_last && module.defines_or_binds(name)) {
                        at.push(name.clone());
                    } else if module.items.contains(name) {
                        return Some(module.file.clone());
                    } else if let Some(bound) = module.bound.get(name).filter(|b| depth < 9 && b.as_slice() != used) {
                        return self.file_of(&at, &[bound, &used[i + 1..]].concat(), depth + 1);
                    } else {
                        return (rooted && i > 0).then(|| module.file.clone());
                    }
                }
            }
            rooted = true;
        }
        None
    }
}

impl Module {
    fn of(file: &str, code: &str) -> Self {
        let (uses, rest) = split_uses(&without_tests(code));
        let (mut bound, mut reexported) = (BTreeMap::new(), BTreeMap::new());
        for (is_reexport, tree) in &uses {
            bind(&[], tree, if *is_reexport { &mut reexported } else { &mut bound });
        }
        let words: BTreeSet<&str> = rest.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
        let only_reexported = reexported.keys().filter(|name| !words.contains(name.as_str())).cloned().collect();
        bound.extend(reexported);
        Self {
            file: file.to_owned(),
            items: rest.lines().filter_map(definition).map(str::to_owned).collect(),
            paths: paths(&rest),
            bound,
            only_reexported,
        }
    }

    fn defines_or_binds(&self, name: &str) -> bool {
        self.items.contains(name) || self.bound.contains_key(name)
    }
}

fn module_path(file: &str) -> ModulePath {
    let names = file.trim_end_matches(".rs").split('/').map(str::to_owned);
    let is_module = |name: &String| name != "mod" && name != "lib";
    names.filter(is_module).collect()
}

fn child(path: &ModulePath, name: &str) -> ModulePath {
    path.iter().cloned().chain([name.to_owned()]).collect()
}

/// Groups of names that reach each other, each as a sorted list.
fn circles_among(imports: &BTreeMap<String, BTreeSet<String>>) -> Vec<Vec<String>> {
    let reach: BTreeMap<&str, BTreeSet<&str>> = imports.keys().map(|f| (f.as_str(), reached(imports, f))).collect();
    let among = |f: &str| -> Vec<String> {
        let mutual = reach[f].iter().filter(|g| reach.get(*g).is_some_and(|back| back.contains(f)));
        mutual.map(|g| (*g).to_owned()).collect()
    };
    let circles: BTreeSet<Vec<String>> = imports.keys().map(|f| among(f)).filter(|c| !c.is_empty()).collect();
    circles.into_iter().collect()
}

/// The innermost module that contains both files, and the paths of its two modules that contain one each.
///
/// `None` for a module and its parent, which may use each other's names.
fn siblings_above(file: &str, other: &str) -> Option<(String, String, String)> {
    let (a, b) = (module_path(file), module_path(other));
    let shared = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
    let through = |path: &ModulePath| path.get(..=shared).map(|path| path.join("/"));
    Some((a[..shared].join("/"), through(&a)?, through(&b)?))
}

/// The files that `from` imports, directly or over other files.
fn reached<'a>(imports: &'a BTreeMap<String, BTreeSet<String>>, from: &'a str) -> BTreeSet<&'a str> {
    let (mut found, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(file) = open.pop() {
        let next = imports.get(file).into_iter().flatten().map(String::as_str);
        open.extend(next.filter(|next| found.insert(*next)));
    }
    found
}

/// The code without the items marked `#[cfg(test)]`; relies on the format of `rustfmt`.
fn without_tests(code: &str) -> String {
    let mut parts = code.split("#[cfg(test)]");
    let mut rest = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = match (part.find(';'), part.find('{')) {
            (Some(end), Some(brace)) if end < brace => Some(end + 1),
            (Some(end), None) => Some(end + 1),
            _ => part.find("\n}").map(|end| end + 2),
        };
        rest.push_str(end.map_or("", |end| &part[end..]));
    }
    rest
}

/// The trees of the `use` statements, with whether they are re-exports, and the other code.
fn split_uses(code: &str) -> (Vec<(bool, String)>, String) {
    let (mut uses, mut rest, mut open) = (Vec::new(), String::new(), None::<(bool, String)>);
    for line in code.lines() {
        let is_reexport = line.trim_start().starts_with("pub");
        match (open.take(), without_visibility(line.trim_start()).strip_prefix("use ")) {
            (Some((is_reexport, begun)), _) => open = Some((is_reexport, begun + line)),
            (None, Some(tree)) => open = Some((is_reexport, tree.to_owned())),
            (None, None) => rest.extend([line, "\n"]),
        }
        if let Some((is_reexport, tree)) = open.take_if(|(_, tree)| tree.ends_with(';')) {
            uses.push((is_reexport, tree.trim_end_matches(';').to_owned()));
        }
    }
    (uses, rest)
}

/// The line without `pub`, `pub(super)` and the like.
fn without_visibility(line: &str) -> &str {
    match line.strip_prefix("pub(") {
        Some(rest) => rest.split_once(") ").map_or(line, |(_, rest)| rest),
        None => line.strip_prefix("pub ").unwrap_or(line),
    }
}

/// Adds the names that a tree of a `use` statement binds below `root`; `*` is left out.
fn bind(root: &[String], tree: &str, bound: &mut BTreeMap<String, Vec<String>>) {
    let (path, group) = tree.split_once('{').map_or((tree, None), |(path, group)| (path, Some(group)));
    let (path, alias) = path.split_once(" as ").map_or((path, None), |(path, alias)| (path, Some(alias.trim())));
    let names = path.split("::").map(|name| name.trim().to_owned()).filter(|name| !name.is_empty());
    let full: Vec<String> = root.iter().cloned().chain(names).collect();
    if let Some(group) = group {
        let inner = group.rsplit_once('}').map_or(group, |(inner, _)| inner);
        entries(inner).into_iter().for_each(|entry| bind(&full, entry, bound));
        return;
    }
    let full: Vec<String> = full.strip_suffix(&["self".to_owned()]).map(<[String]>::to_vec).unwrap_or(full);
    match (alias, full.last()) {
        (Some(alias), _) => drop(bound.insert(alias.to_owned(), full)),
        (None, Some(name)) if name != "*" => drop(bound.insert(name.clone(), full)),
        _ => {}
    }
}

/// The entries of a group, separated by the commas outside inner groups.
fn entries(group: &str) -> Vec<&str> {
    let mut depth = 0_i32;
    let split = group.split(|c: char| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ',' && depth == 0
    });
    split.map(str::trim).filter(|entry| !entry.is_empty()).collect()
}

/// Name of the item that a line at the top level defines.
fn definition(line: &str) -> Option<&str> {
    let line = without_visibility(line);
    let line = line.strip_prefix("const fn ").map_or(line, |_| &line["const ".len()..]);
    let (kind, rest) = line.split_once(' ')?;
    let kinds = ["fn", "struct", "enum", "trait", "type", "const", "static", "macro_rules!"];
    let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()?;
    kinds.contains(&kind).then_some(name)
}

/// The paths of more than one segment in `code`.
fn paths(code: &str) -> Vec<Vec<String>> {
    let words = code.split(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
    let segments = |word: &str| word.split("::").filter(|s| !s.is_empty()).map(str::to_owned).collect::<Vec<_>>();
    words.filter(|word| word.contains("::")).map(segments).filter(|path| path.len() > 1).collect()
}
