//! The command line's result files for other programs: VTK, and Parquet with the feature of that name.

use std::fs;
use std::path::{Path, PathBuf};

use predicates::str::contains;
use tempfile::TempDir;

use crate::program::{bristle, brush};

/// A small and quick case.
const FILE: &str = concat!(
    brush!(4, "filament_count_uncertainty = 600\n"),
    "
[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3

[solver]
relative_tolerance = 1e-4

[study]
brushing_velocity_m_s = [10.0, 20.0]
"
);

/// A directory with the input file `case.toml`.
fn workspace() -> TempDir {
    let directory = TempDir::new().expect("a temporary directory");
    fs::write(directory.path().join("case.toml"), FILE).expect("the file can be written");
    directory
}

/// Names of the files in a directory.
fn names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).expect("a directory").map(|entry| entry.expect("an entry").file_name());
    let mut names: Vec<String> = entries.map(|name| name.into_string().expect("a name in UTF-8")).collect();
    names.sort();
    names
}

/// The files listed by the collection in a directory, each once.
fn listed(directory: &Path) -> Vec<String> {
    let text = fs::read_to_string(directory.join("contact.pvd")).expect("a collection");
    let files = text.split("file=\"").skip(1).map(|rest| rest.split('"').next().unwrap_or_default().to_owned());
    let mut files: Vec<String> = files.collect();
    files.sort();
    files.dedup();
    files
}

#[test]
fn simulate_writes_shapes_for_paraview() {
    let directory = workspace();
    let vtk = directory.path().join("one/vtk");
    bristle(directory.path(), "simulate case.toml --out one").assert().success();
    assert!(!vtk.exists(), "shapes were written without --vtk");
    bristle(directory.path(), "simulate case.toml --out one --vtk")
        .assert()
        .success()
        .stderr(contains("vtk/contact.pvd"));
    let first = fs::read(vtk.join("filament_0000.vtp")).expect("the first shape");
    let (files, mut present) = (listed(&vtk), names(&vtk));
    assert_eq!(present.len(), 202);
    present.retain(|name| name != "contact.pvd");
    assert_eq!(files, present);

    // Fewer shapes now. The user's own file stays.
    fs::write(vtk.join("own.pvsm"), "kept").expect("the file can be written");
    bristle(directory.path(), "simulate case.toml --out one --vtk=2").assert().success();
    let expected = ["contact.pvd", "filament_0000.vtp", "filament_0001.vtp", "own.pvsm", "workpiece.vtp"];
    assert_eq!(names(&vtk), expected);
    assert_eq!(listed(&vtk), ["filament_0000.vtp", "filament_0001.vtp", "workpiece.vtp"]);
    assert_eq!(fs::read(vtk.join("filament_0000.vtp")).expect("the first shape"), first);

    // Shapes of an earlier run would be mistaken for those of this one; incomplete files are of no use.
    fs::write(vtk.join(".filament_0007.vtp.bristle-killed"), "half a shape").expect("the file can be written");
    bristle(directory.path(), "simulate case.toml --out one").assert().success();
    assert_eq!(names(&vtk), ["own.pvsm"]);
}

#[test]
fn shapes_change_no_other_result() {
    let directory = workspace();
    bristle(directory.path(), "simulate case.toml --out without").assert().success();
    bristle(directory.path(), "simulate case.toml --out with --vtk=50").assert().success();
    for name in ["metrics.json", "history.csv"] {
        let [without, with] =
            ["without", "with"].map(|out| fs::read(directory.path().join(out).join(name)).expect(name));
        assert!(without == with, "{name}");
    }
}

#[test]
fn shapes_that_cannot_be_written_are_refused_before_anything_is_written() {
    let directory = workspace();
    for number in ["1", "10001", "many", "-3"] {
        let arguments = format!("simulate case.toml --out one --vtk={number}");
        bristle(directory.path(), &arguments).assert().code(2).stderr(contains("--vtk"));
    }
    fs::create_dir(directory.path().join("one")).expect("a directory can be made");
    fs::write(directory.path().join("one/vtk"), "a file").expect("a file can be written");
    bristle(directory.path(), "simulate case.toml --out one --vtk").assert().code(2).stderr(contains("one/vtk"));
    assert_eq!(names(&directory.path().join("one")), ["vtk"]);
    // Without --vtk that file does not matter.
    bristle(directory.path(), "simulate case.toml --out one").assert().success();
    fs::create_dir_all(directory.path().join("two/vtk/contact.pvd")).expect("a directory can be made");
    bristle(directory.path(), "simulate case.toml --out two --vtk").assert().code(2).stderr(contains("contact.pvd"));
    assert_eq!(names(&directory.path().join("two")), ["vtk"]);
}

/// Without the feature, tables of an earlier run are removed.
#[test]
fn tables_as_parquet_are_those_of_this_run() {
    let directory = workspace();
    let path = |name: &str| -> PathBuf { directory.path().join("results").join(name) };
    fs::create_dir(path("")).expect("a directory can be made");
    for name in ["runs.parquet", "history.parquet"] {
        fs::write(path(name), "earlier").expect("a file can be written");
    }
    fs::write(path(".runs.parquet.bristle-killed"), "half of a table").expect("a file can be written");
    let study = bristle(directory.path(), "study case.toml --out results --json").assert().success();
    let summary = String::from_utf8_lossy(&study.get_output().stdout).into_owned();
    bristle(directory.path(), "simulate case.toml --out results").assert().success();
    for name in ["runs.parquet", "history.parquet"] {
        assert_eq!(path(name).exists(), cfg!(feature = "parquet"), "{name}");
        if cfg!(feature = "parquet") {
            let bytes = fs::read(path(name)).expect(name);
            assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"), "{name}");
        }
    }
    assert_eq!(summary.contains("runs.parquet"), cfg!(feature = "parquet"));
    assert!(!path(".runs.parquet.bristle-killed").exists());
    fs::create_dir_all(directory.path().join("blocked/runs.parquet")).expect("a directory can be made");
    bristle(directory.path(), "study case.toml --out blocked").assert().code(2).stderr(contains("runs.parquet"));
}
