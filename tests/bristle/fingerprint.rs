//! The hash by which a journal recognises results of another build covers every file that can
//! change a result.

use std::fs;
use std::path::{Path, PathBuf};

use bristle::equations::VERSION;
use bristle::simulation::SOLVER_FINGERPRINT;
use bristle_codegen::fingerprint::{digest, locked, sources};

/// Inputs of the hash besides the generated code: sources, and packages whose versions count.
const SOURCES: &str = "src";
const PACKAGES: [&str; 3] = ["fastrand", "pulp", "spec_math"];
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
    fs::read_dir(path)
        .expect("a directory")
        .flat_map(|entry| files(&entry.expect("an entry").path()))
        .collect()
}

#[test]
fn every_source_of_the_core_changes_the_hash_of_the_solver() {
    // Paths are hashed as given, so they are relative, as in the build step. Tests run in the
    // directory of the package.
    let packages = locked(Path::new("Cargo.lock"), &PACKAGES).expect("the lock");
    assert_eq!(packages.matches("version = ").count(), PACKAGES.len());
    let hash_of_tree = sources(&[SOURCES]).expect("the sources");
    assert_eq!(
        digest(
            [KERNELS, SERIES, &packages, &hash_of_tree]
                .concat()
                .as_bytes()
        ),
        SOLVER_FINGERPRINT
    );

    let directory = tempfile::tempdir().expect("a temporary directory");
    let copied = directory.path().join(SOURCES);
    copy(Path::new(SOURCES), &copied);
    let hash = || sources(&[&copied]).expect("the copies");
    let unchanged = hash();
    let all = files(&copied);
    assert!(all.len() > 50, "{}", all.len());
    for file in all {
        let content = fs::read(&file).expect("a file");
        fs::write(&file, [&content, "\n".as_bytes()].concat()).expect("room for a line");
        assert_ne!(hash(), unchanged, "{} does not count", file.display());
        fs::write(&file, content).expect("room for the file");
    }
    assert_eq!(hash(), unchanged);
    fs::rename(copied.join("lib.rs"), copied.join("elsewhere.rs")).expect("a new name");
    assert_ne!(hash(), unchanged, "names count");
}

#[test]
fn the_version_names_the_derivation_of_the_kernels() {
    let made_by = KERNELS.lines().nth(1).expect("a header");
    let engine = if made_by.contains("CasADi") {
        "CasADi"
    } else {
        "built-in"
    };
    assert!(
        VERSION.ends_with(&format!(" ({engine} derivation)")),
        "{VERSION}"
    );
}
