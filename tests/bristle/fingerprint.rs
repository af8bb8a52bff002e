//! The hash by which a journal recognises results of another build covers every file that can change a result.

use std::fs;
use std::path::{Path, PathBuf};

use bristle::simulation::SOLVER_FINGERPRINT;
use bristle_codegen::fingerprint::{digest, sources};

/// The sources that the build step hashes, in addition to the generated code.
const SOURCES: [&str; 4] = ["Cargo.lock", "build.rs", "codegen/src", "src"];
const KERNELS: &str = include_str!(concat!(env!("OUT_DIR"), "/kernels.rs"));
const SERIES: &str = include_str!(concat!(env!("OUT_DIR"), "/series.rs"));

/// Copies a file, or a directory with its contents.
fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).expect("a directory");
        for entry in fs::read_dir(from).expect("a directory") {
            let entry = entry.expect("an entry");
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        fs::create_dir_all(to.parent().expect("a parent")).expect("a directory");
        fs::copy(from, to).expect("a copy");
    }
}

/// All files at and below `path`.
fn files(path: &Path) -> Vec<PathBuf> {
    if !path.is_dir() {
        return vec![path.to_owned()];
    }
    fs::read_dir(path).expect("a directory").flat_map(|entry| files(&entry.expect("an entry").path())).collect()
}

#[test]
fn every_source_of_core_and_engine_changes_the_hash_of_the_solver() {
    // Paths are hashed as given, so they are relative, as in the build step. Tests run in the directory of the package.
    let hash_of_tree = sources(&SOURCES).expect("the sources");
    assert_eq!(digest([KERNELS, SERIES, &hash_of_tree].concat().as_bytes()), SOLVER_FINGERPRINT);

    let directory = tempfile::tempdir().expect("a temporary directory");
    for path in SOURCES {
        copy(Path::new(path), &directory.path().join(path));
    }
    let copies = SOURCES.map(|path| directory.path().join(path));
    let hash = || sources(&copies).expect("the copies");
    let unchanged = hash();
    let all: Vec<PathBuf> = copies.iter().flat_map(|path| files(path)).collect();
    // An earlier list of files had missed this one.
    assert!(all.iter().any(|file| file.ends_with("codegen/src/ir/special.rs")));
    assert!(all.len() > 50, "{}", all.len());
    for file in all {
        let content = fs::read(&file).expect("a file");
        fs::write(&file, [&content, "\n".as_bytes()].concat()).expect("room for a line");
        assert_ne!(hash(), unchanged, "{} does not count", file.display());
        fs::write(&file, content).expect("room for the file");
    }
    assert_eq!(hash(), unchanged);
    let moved = copies[3].join("elsewhere.rs");
    fs::rename(copies[3].join("lib.rs"), &moved).expect("a new name");
    assert_ne!(hash(), unchanged, "names count");
}
