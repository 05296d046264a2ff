//! Imports between the files of `src/`, and the circles among them.
//!
//! A file imports the file that defines the name that it uses: a re-export counts as an import of the re-exported item's
//! file. A module also imports the modules that it declares. Test modules do not count.

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
    /// Modules declared with `mod name;`.
    declared: Vec<String>,
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
        let imports = self.imports();
        let reach: BTreeMap<&str, BTreeSet<&str>> =
            imports.keys().map(|f| (f.as_str(), reached(&imports, f))).collect();
        let among = |f: &str| -> Vec<String> {
            let mutual = reach[f].iter().filter(|g| reach.get(*g).is_some_and(|back| back.contains(f)));
            mutual.map(|g| (*g).to_owned()).collect()
        };
        let circles: BTreeSet<Vec<String>> = imports.keys().map(|f| among(f)).filter(|c| !c.is_empty()).collect();
        circles.into_iter().collect()
    }

    /// The files that each file imports.
    fn imports(&self) -> BTreeMap<String, BTreeSet<String>> {
        let of_module = |path: &ModulePath, module: &Module| {
            let used = module.paths.iter().chain(module.bound.values());
            let declared = module.declared.iter().filter_map(|name| self.0.get(&child(path, name)));
            let files = used.filter_map(|used| self.file_of(path, used, 0)).chain(declared.map(|m| m.file.clone()));
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
        let mut bound = BTreeMap::new();
        uses.iter().for_each(|tree| bind(&[], tree, &mut bound));
        let definitions: Vec<(&str, &str)> = rest.lines().filter_map(definition).collect();
        let (modules, items): (Vec<_>, Vec<_>) = definitions.into_iter().partition(|(kind, _)| *kind == "mod");
        Self {
            file: file.to_owned(),
            items: items.into_iter().map(|(_, name)| name.to_owned()).collect(),
            declared: modules.into_iter().map(|(_, name)| name.to_owned()).collect(),
            paths: paths(&rest),
            bound,
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

/// The trees of the `use` statements, and the other code.
fn split_uses(code: &str) -> (Vec<String>, String) {
    let (mut uses, mut rest, mut open) = (Vec::new(), String::new(), None::<String>);
    for line in code.lines() {
        match (open.take(), without_visibility(line.trim_start()).strip_prefix("use ")) {
            (Some(begun), _) => open = Some(begun + line),
            (None, Some(tree)) => open = Some(tree.to_owned()),
            (None, None) => rest.extend([line, "\n"]),
        }
        if let Some(tree) = open.take_if(|tree| tree.ends_with(';')) {
            uses.push(tree.trim_end_matches(';').to_owned());
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

/// Kind and name of the item that a line at the top level defines; `mod` only for a module in a file of its own.
fn definition(line: &str) -> Option<(&str, &str)> {
    let line = without_visibility(line);
    let line = line.strip_prefix("const fn ").map_or(line, |_| &line["const ".len()..]);
    let (kind, rest) = line.split_once(' ')?;
    let kinds = ["fn", "struct", "enum", "trait", "type", "const", "static", "mod", "macro_rules!"];
    let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()?;
    (kinds.contains(&kind) && (kind != "mod" || rest.ends_with(';'))).then_some((kind, name))
}

/// The paths of more than one segment in `code`.
fn paths(code: &str) -> Vec<Vec<String>> {
    let words = code.split(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
    let segments = |word: &str| word.split("::").filter(|s| !s.is_empty()).map(str::to_owned).collect::<Vec<_>>();
    words.filter(|word| word.contains("::")).map(segments).filter(|path| path.len() > 1).collect()
}
