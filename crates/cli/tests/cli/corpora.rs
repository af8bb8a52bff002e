//! Replays the corpora of `fuzz/` with the bodies of its targets.

use std::fs;
use std::path::Path;

use allocation_counter::measure;
use bristle_codegen::back::json::from_json;

#[path = "../../../../fuzz/src/lib.rs"]
pub mod targets;

/// Maximum memory in bytes at any one time, for an empty file and per byte of a file.
const MAX_MEMORY: u64 = 64 << 20;
const MAX_MEMORY_PER_BYTE: u64 = 200;

/// Calls `replay` with the name and the content of each file of a corpus.
fn each_of(corpus: &str, mut replay: impl FnMut(&str, &[u8])) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let mut paths: Vec<_> = fs::read_dir(root.join(corpus))
        .expect(corpus)
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    for path in paths {
        let name = path.file_name().expect("a name").to_string_lossy();
        replay(&name, &fs::read(&path).expect("a file"));
    }
}

#[test]
fn each_file_is_accepted_or_refused_as_its_name_says() {
    let mut problems = String::new();
    for (corpus, target) in targets::TARGETS {
        // Files to which corpora refer are created once, and not measured.
        let _ = target(b"@runs.csv\n");
        each_of(corpus, |name, bytes| {
            let mut read = Ok(());
            let memory = measure(|| read = target(bytes)).bytes_max;
            let found = read.as_ref().map_or("refused", |()| "accepted");
            if !name.starts_with(found) {
                problems += &format!("{corpus}/{name} is {found}: {read:?}\n");
            }
            if memory > MAX_MEMORY + MAX_MEMORY_PER_BYTE * bytes.len() as u64 {
                problems += &format!("{corpus}/{name} takes {memory} bytes of memory\n");
            }
        });
    }
    assert!(problems.is_empty(), "{problems}");
}

#[test]
fn the_schema_of_graphs_accepts_what_the_reader_accepts() {
    let schema = include_str!("../../../../docs/graph-format.schema.json");
    let schema = serde_json::from_str(schema).expect("the schema is JSON");
    let schema = jsonschema::draft202012::new(&schema).expect("the schema is one");
    each_of("graph", |name, bytes| {
        let text = String::from_utf8_lossy(bytes);
        if from_json(&text).is_ok() {
            let file = serde_json::from_str(&text).expect("what is read is JSON");
            assert!(schema.is_valid(&file), "{name}");
        }
    });
}
