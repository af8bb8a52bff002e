//! Does data flow one way? Each module of the engine uses its own layer and those before it, and no imports form a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The top-level modules, each after those that it may use.
const LAYERS: [&str; 6] = ["fingerprint", "ir", "passes", "model", "back", "compare"];

/// The modules that each module imports, by path: `ir::graph`.
type Imports = BTreeMap<String, BTreeSet<String>>;

/// Collects the source files below `directory` by the paths of their modules.
fn sources(directory: &Path, module: &str, found: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(directory).expect("the sources are there") {
        let path = entry.expect("the directory can be read").path();
        let stem = path.file_stem().and_then(|stem| stem.to_str()).expect("the names of sources are text");
        let name = if module.is_empty() { stem.to_owned() } else { format!("{module}::{stem}") };
        if path.is_dir() {
            sources(&path, &name, found);
        } else {
            let name = if stem == "mod" { module.to_owned() } else { name };
            found.insert(name, fs::read_to_string(&path).expect("a source is text"));
        }
    }
}

/// The part of `path` that is a module.
fn module_of<'a>(path: &'a str, modules: &BTreeMap<String, String>) -> Option<&'a str> {
    let ends = path.match_indices("::").map(|(end, _)| end).chain([path.len()]);
    ends.map(|end| &path[..end]).filter(|module| modules.contains_key(*module)).last()
}

/// True if `line` uses the module `child` without a path before it.
fn uses(line: &str, child: &str) -> bool {
    let part_of_path = |before: char| before.is_alphanumeric() || "_:".contains(before);
    line.match_indices(&format!("{child}::")).any(|(start, _)| !line[..start].ends_with(part_of_path))
}

/// The imports of each module, and the lines that hide what they use.
fn imports(modules: &BTreeMap<String, String>) -> (Imports, Vec<String>) {
    let (mut imports, mut faults) = (Imports::new(), Vec::new());
    for (module, source) in modules {
        let imported = imports.entry(module.clone()).or_default();
        let code: Vec<&str> = source.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        for child in code.iter().filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';')) {
            if code.iter().any(|line| uses(line, child)) {
                imported.insert(format!("{module}::{child}"));
            }
        }
        for line in code {
            // An indented line is in a test, which may use what its module uses.
            if line.starts_with("use super::") || line.starts_with("use self::") {
                faults.push(format!("{module}: `{line}` is relative; start at `crate`"));
            }
            for (start, _) in line.match_indices("crate::") {
                let rest = &line[start + "crate::".len()..];
                let end = rest.find(|letter: char| !(letter.is_alphanumeric() || "_:".contains(letter)));
                let path = rest[..end.unwrap_or(rest.len())].trim_end_matches(':');
                match module_of(path, modules) {
                    Some(layer) if LAYERS[1..5].contains(&layer) => {
                        faults.push(format!("{module}: `{line}` names a layer; name the module"));
                    }
                    Some(other) if other != module => {
                        imported.insert(other.to_owned());
                    }
                    Some(_) => {}
                    None => faults.push(format!("{module}: `{line}` names no module")),
                }
            }
        }
    }
    (imports, faults)
}

/// The imports that go against the order of the layers.
fn upward(imports: &Imports) -> Vec<String> {
    let layer = |module: &str| {
        let top = module.split("::").next().unwrap_or_default();
        LAYERS.iter().position(|layer| *layer == top)
    };
    let pairs = imports.iter().flat_map(|(user, used)| used.iter().map(move |used| (user, used)));
    pairs.filter(|(user, used)| layer(user) < layer(used)).map(|(user, used)| format!("{user} uses {used}")).collect()
}

/// The modules that remain after removing, repeatedly, each module that uses none of the remaining ones.
fn circles(imports: &Imports) -> Vec<String> {
    let mut left = imports.clone();
    while let Some(free) = left.iter().find(|(_, used)| used.is_empty()).map(|(module, _)| module.clone()) {
        left.remove(&free);
        left.values_mut().for_each(|used| {
            used.remove(&free);
        });
    }
    left.iter()
        .map(|(module, used)| format!("{module} uses {}", Vec::from_iter(used.iter().cloned()).join(", ")))
        .collect()
}

#[test]
fn data_flows_one_way() {
    let mut modules = BTreeMap::new();
    sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), "", &mut modules);
    let root = modules.remove("lib").expect("there is a root");
    let declared: BTreeSet<&str> =
        root.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    assert_eq!(declared, BTreeSet::from(LAYERS), "every top-level module has its place in the order");
    let (imports, faults) = imports(&modules);
    assert_eq!(faults, [""; 0]);
    assert!(
        imports["back::languages::rust"].contains("ir::kernel") && imports["passes::dimension"].contains("ir::writer")
    );
    assert_eq!(upward(&imports), [""; 0]);
    assert_eq!(circles(&imports), [""; 0]);
}

#[test]
fn wrong_imports_are_found() {
    let modules = |sources: &[(&str, &str)]| -> BTreeMap<String, String> {
        sources.iter().map(|(module, source)| ((*module).to_owned(), (*source).to_owned())).collect()
    };
    let wrong = modules(&[
        ("ir", "pub mod graph;\npub mod unit;"),
        (
            "ir::graph",
            "use crate::ir::unit::Unit;\n/// See [`crate::back::latex`].\nfn f() -> crate::back::latex::Origin {}",
        ),
        ("ir::unit", "use crate::ir::constant::Constant;"),
        ("ir::constant", "mod tests {\n    use super::*;\n    use crate::ir::graph::{Graph, Node};\n}"),
        ("back::print", "mod page;\n\nfn f() {\n    page::write();\n}"),
        ("back::print::page", "use crate::back::print::f;"),
        ("back::latex", "use super::json;\nuse crate::ir;\nuse crate::nowhere::Thing;"),
    ]);
    let (imports, faults) = imports(&wrong);
    assert_eq!(upward(&imports), ["ir::graph uses back::latex"]);
    assert_eq!(
        circles(&imports),
        [
            "back::print uses back::print::page",
            "back::print::page uses back::print",
            "ir::constant uses ir::graph",
            "ir::graph uses ir::unit",
            "ir::unit uses ir::constant",
        ]
    );
    assert_eq!(
        faults,
        [
            "back::latex: `use super::json;` is relative; start at `crate`",
            "back::latex: `use crate::ir;` names a layer; name the module",
            "back::latex: `use crate::nowhere::Thing;` names no module",
        ]
    );
}
