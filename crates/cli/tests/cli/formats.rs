//! The command line's result files for other programs: VTK, and Parquet with the feature of that
//! name.

use std::fs;

use predicates::str::contains;

use crate::program::{Workspace, brush};

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

/// The files that the collection of shapes lists, each once.
fn listed(directory: &Workspace) -> Vec<String> {
    let text = directory.read("one/vtk/contact.pvd");
    let files = text
        .split("file=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap_or_default().to_owned());
    let mut files: Vec<String> = files.collect();
    files.sort();
    files.dedup();
    files
}

#[test]
fn simulate_writes_shapes_for_paraview() {
    let directory = Workspace::with(FILE);
    directory.run("simulate case.toml --out one");
    assert!(
        !directory.path("one/vtk").exists(),
        "shapes were written without --vtk"
    );
    assert!(
        directory
            .said("simulate case.toml --out one --vtk")
            .contains("vtk/contact.pvd")
    );
    let first = directory.bytes("one/vtk/filament_0000.vtp");
    let (files, mut present) = (listed(&directory), directory.names("one/vtk"));
    assert_eq!(present.len(), 202);
    present.retain(|name| name != "contact.pvd");
    assert_eq!(files, present);

    // Fewer shapes now. The user's own file stays.
    directory.write("one/vtk/own.pvsm", "kept");
    directory.run("simulate case.toml --out one --vtk=2");
    let expected = [
        "contact.pvd",
        "filament_0000.vtp",
        "filament_0001.vtp",
        "own.pvsm",
        "workpiece.vtp",
    ];
    assert_eq!(directory.names("one/vtk"), expected);
    assert_eq!(
        listed(&directory),
        ["filament_0000.vtp", "filament_0001.vtp", "workpiece.vtp"]
    );
    assert_eq!(directory.bytes("one/vtk/filament_0000.vtp"), first);

    // Shapes of an earlier run would be mistaken for those of this one; incomplete files are of no
    // use.
    directory.write("one/vtk/.filament_0007.vtp.bristle-killed", "half a shape");
    directory.run("simulate case.toml --out one");
    assert_eq!(directory.names("one/vtk"), ["own.pvsm"]);
}

#[test]
fn shapes_change_no_other_result() {
    let directory = Workspace::with(FILE);
    directory.run("simulate case.toml --out without");
    directory.run("simulate case.toml --out with --vtk=50");
    for name in ["metrics.json", "history.csv"] {
        let [without, with] =
            ["without", "with"].map(|out| directory.bytes(&format!("{out}/{name}")));
        assert!(without == with, "{name}");
    }
}

#[test]
fn shapes_that_cannot_be_written_are_refused_before_anything_is_written() {
    let directory = Workspace::with(FILE);
    for number in ["1", "10001", "many", "-3"] {
        let arguments = format!("simulate case.toml --out one --vtk={number}");
        directory
            .bristle(&arguments)
            .assert()
            .code(2)
            .stderr(contains("--vtk"));
    }
    fs::create_dir(directory.path("one")).expect("a directory can be made");
    directory.write("one/vtk", "a file");
    directory
        .bristle("simulate case.toml --out one --vtk")
        .assert()
        .code(2)
        .stderr(contains("one/vtk"));
    assert_eq!(directory.names("one"), ["vtk"]);
    // Without --vtk that file does not matter.
    directory.run("simulate case.toml --out one");
    fs::create_dir_all(directory.path("two/vtk/contact.pvd")).expect("a directory can be made");
    directory
        .bristle("simulate case.toml --out two --vtk")
        .assert()
        .code(2)
        .stderr(contains("contact.pvd"));
    assert_eq!(directory.names("two"), ["vtk"]);
}

/// Without the feature, tables of an earlier run are removed.
#[test]
fn tables_as_parquet_are_those_of_this_run() {
    let directory = Workspace::with(FILE);
    fs::create_dir(directory.path("results")).expect("a directory can be made");
    for name in ["runs.parquet", "history.parquet"] {
        directory.write(&format!("results/{name}"), "earlier");
    }
    directory.write("results/.runs.parquet.bristle-killed", "half of a table");
    let summary = directory.printed("study case.toml --out results --json");
    directory.run("simulate case.toml --out results");
    for name in ["runs.parquet", "history.parquet"] {
        let path = format!("results/{name}");
        assert_eq!(
            directory.path(&path).exists(),
            cfg!(feature = "parquet"),
            "{name}"
        );
        if cfg!(feature = "parquet") {
            let bytes = directory.bytes(&path);
            assert!(
                bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"),
                "{name}"
            );
        }
    }
    assert_eq!(summary.contains("runs.parquet"), cfg!(feature = "parquet"));
    assert!(
        !directory
            .path("results/.runs.parquet.bristle-killed")
            .exists()
    );
    fs::create_dir_all(directory.path("blocked/runs.parquet")).expect("a directory can be made");
    directory
        .bristle("study case.toml --out blocked")
        .assert()
        .code(2)
        .stderr(contains("runs.parquet"));
}
