//! Does data flow one way? No files of a crate import each other in a circle, nor do its top-level
//! modules. (Cargo sees to the crates.)

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// What each module uses, by path: `ir::graph`; the root is empty.
type Imports = BTreeMap<String, BTreeSet<String>>;

/// Collects the sources below `directory` by the paths of their modules, without their unit tests
/// and comments.
fn sources(directory: &Path, module: &str, found: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(directory).expect("the sources are there") {
        let path = entry.expect("the directory can be read").path();
        let stem = path
            .file_stem()
            .and_then(|stem| stem.to_str())
            .expect("the names of sources are text");
        let name = join(module, stem);
        if path.is_dir() {
            sources(&path, &name, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") && stem != "tests" {
            let text = fs::read_to_string(&path).expect("a source is text");
            let (text, _) = text
                .split_once("#[cfg(test)]\nmod tests {")
                .unwrap_or((&text, ""));
            let lines = text
                .lines()
                .map(|line| line.split_once("//").map_or(line, |(code, _)| code));
            let is_face = matches!(stem, "mod" | "lib" | "main");
            found.insert(
                if is_face { module.to_owned() } else { name },
                lines.collect::<Vec<_>>().join("\n"),
            );
        }
    }
}

fn join(module: &str, name: &str) -> String {
    if module.is_empty() {
        name.to_owned()
    } else {
        format!("{module}::{name}")
    }
}

/// The paths of the tree of a `use`.
fn expanded(tree: &str, prefix: &str, paths: &mut Vec<String>) {
    let Some((start, rest)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or_default().trim();
        if !path.is_empty() {
            paths.push(format!("{prefix}{path}"));
        }
        return;
    };
    let inner = rest.rsplit_once('}').map_or(rest, |(inner, _)| inner);
    let (mut depth, mut from) = (0, 0);
    for (at, letter) in inner.char_indices().chain([(inner.len(), ',')]) {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                expanded(
                    &inner[from..at],
                    &format!("{prefix}{}", start.trim()),
                    paths,
                );
                from = at + 1;
            }
            _ => {}
        }
    }
}

/// The paths that `source` imports, those that it hands on, and those in its code.
fn paths_in(source: &str) -> [Vec<String>; 3] {
    let [mut imported, mut handed_on, mut named] = [const { Vec::new() }; 3];
    let mut code = String::new();
    for statement in source.split_inclusive(';') {
        let head = statement.rfind("use ").filter(|start| {
            let before = statement[..*start].rsplit('\n').next().unwrap_or_default();
            before.trim().is_empty() || before.trim_start().starts_with("pub")
        });
        let Some(start) = head else {
            code.push_str(statement);
            continue;
        };
        let is_handed_on = statement[..start].trim_end().ends_with("pub")
            || statement[..start].trim_end().ends_with(')');
        let tree = statement[start + 4..]
            .trim_end_matches(';')
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        expanded(
            &tree,
            "",
            if is_handed_on {
                &mut handed_on
            } else {
                &mut imported
            },
        );
        code.push_str(&statement[..start]);
    }
    let of_path = |letter: char| letter.is_alphanumeric() || "_:".contains(letter);
    named.extend(
        code.split(|letter| !of_path(letter))
            .filter(|path| path.contains("::"))
            .map(str::to_owned),
    );
    [imported, handed_on, named]
}

/// The module in which `path` begins as `module` sees it, and the names after it; none if it leads
/// out of the crate.
fn resolved<'a>(
    path: &'a str,
    module: &str,
    sources: &BTreeMap<String, String>,
    aliases: &BTreeMap<String, String>,
) -> Option<(String, Vec<&'a str>)> {
    let mut names: Vec<&str> = path.split("::").collect();
    let mut at = match names[0] {
        "crate" => String::new(),
        "super" | "self" => module.to_owned(),
        name => aliases
            .get(name)
            .cloned()
            .or_else(|| Some(join(module, name)).filter(|child| sources.contains_key(child)))?,
    };
    while names.first().is_some_and(|name| *name == "super") {
        names.remove(0);
        at = at
            .rsplit_once("::")
            .map_or_else(String::new, |(parent, _)| parent.to_owned());
    }
    if !path.starts_with("super") {
        names.remove(0);
    }
    while let Some(child) = names
        .first()
        .map(|name| join(&at, name))
        .filter(|child| sources.contains_key(child))
    {
        at = child;
        names.remove(0);
    }
    Some((at, names))
}

/// What each module of a crate uses. A name that a module only hands on is of the module that
/// defines it.
fn imports(sources: &BTreeMap<String, String>) -> Imports {
    let none = BTreeMap::new();
    let paths: BTreeMap<&String, [Vec<String>; 3]> = sources
        .iter()
        .map(|(module, source)| (module, paths_in(source)))
        .collect();
    let mut definitions = BTreeMap::new();
    for (module, [_, handed_on, _]) in &paths {
        for path in handed_on {
            if let Some((at, names)) = resolved(path, module, sources, &none)
                && let Some(name) = names.last()
            {
                definitions.insert(((*module).clone(), (*name).to_owned()), at);
            }
        }
    }
    let mut all = Imports::new();
    for (module, [imported, handed_on, named]) in &paths {
        let used = all.entry((*module).clone()).or_default();
        let mut aliases = BTreeMap::new();
        for path in imported.iter().chain(handed_on) {
            if let Some((at, names)) = resolved(path, module, sources, &none)
                && names.iter().all(|name| *name == "self")
            {
                aliases.insert(at.rsplit("::").next().unwrap_or_default().to_owned(), at);
            }
        }
        for path in imported.iter().chain(named) {
            let Some((mut at, names)) = resolved(path, module, sources, &aliases) else {
                continue;
            };
            let Some(name) = names.first().filter(|name| **name != "self") else {
                continue;
            };
            while let Some(next) = definitions.get(&(at.clone(), (*name).to_owned())) {
                at.clone_from(next);
            }
            if at != **module {
                used.insert(at);
            }
        }
    }
    all
}

/// The modules that remain after removing, repeatedly, each module that uses none of the remaining
/// ones or is used by none.
fn circles(mut left: Imports) -> Vec<String> {
    let free = |left: &Imports| {
        let used: BTreeSet<&String> = left.values().flatten().collect();
        let free = left
            .iter()
            .find(|(module, uses)| uses.is_empty() || !used.contains(module));
        free.map(|(module, _)| module.clone())
    };
    while let Some(module) = free(&left) {
        left.remove(&module);
        left.values_mut().for_each(|used| {
            used.remove(&module);
        });
    }
    left.iter()
        .map(|(module, used)| {
            format!(
                "{module} uses {}",
                Vec::from_iter(used.iter().cloned()).join(", ")
            )
        })
        .collect()
}

/// The same imports between top-level modules.
fn of_top_level(imports: &Imports) -> Imports {
    let top = |module: &str| module.split("::").next().unwrap_or_default().to_owned();
    let mut all = Imports::new();
    for (module, used) in imports.iter().filter(|(module, _)| !module.is_empty()) {
        let used = used
            .iter()
            .map(|used| top(used))
            .filter(|used| !used.is_empty() && *used != top(module));
        all.entry(top(module)).or_default().extend(used);
    }
    all
}

#[test]
fn data_flows_one_way() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let crates = fs::read_dir(root.join("crates"))
        .expect("there are crates")
        .map(|entry| entry.expect("a crate").path());
    let mut directories: Vec<_> = crates
        .chain(["", "codegen", "python"].map(|path| root.join(path)))
        .collect();
    directories.sort();
    assert!(directories.len() > 10);
    for directory in directories {
        let mut found = BTreeMap::new();
        sources(&directory.join("src"), "", &mut found);
        let imports = imports(&found);
        assert_eq!(
            circles(imports.clone()),
            [""; 0],
            "in {}",
            directory.display()
        );
        assert_eq!(
            circles(of_top_level(&imports)),
            [""; 0],
            "between modules of {}",
            directory.display()
        );
        if directory.ends_with("codegen") {
            assert!(imports["back::languages::rust"].contains("ir::kernel"));
        }
    }
}

#[test]
fn circles_are_found() {
    let found = |sources: &[(&str, &str)]| {
        let sources = sources
            .iter()
            .map(|(module, source)| ((*module).to_owned(), (*source).to_owned()))
            .collect();
        let imports = imports(&sources);
        [circles(imports.clone()), circles(of_top_level(&imports))]
    };
    // By a name that a parent hands on, by a module's name, and in code.
    let by_files = found(&[
        (
            "model",
            "mod unit;\npub use unit::Unit;\npub use graph::{self as drawn, Graph};",
        ),
        ("model::unit", "use super::graph;\nfn f() -> graph::Node {}"),
        (
            "model::graph",
            "use crate::{\n    model::{Unit, other::Thing},\n};",
        ),
        ("model::other", "fn f() { crate::deeper::f() }"),
        ("deeper", ""),
    ]);
    assert_eq!(
        by_files,
        [
            vec![
                "model::graph uses model::unit",
                "model::unit uses model::graph"
            ],
            vec![]
        ]
    );
    let by_modules = found(&[
        ("a::one", "use crate::b::Two;"),
        ("b", ""),
        ("b::two", "use crate::a::Three;"),
        ("a", ""),
    ]);
    assert_eq!(by_modules, [vec![], vec!["a uses b", "b uses a"]]);
}
