//! Result files of the command line for other programs, with the features `vtk` and `parquet`.

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

#[cfg(feature = "vtk")]
#[test]
fn simulate_writes_shapes_for_paraview() {
    let directory = Workspace::with(FILE);
    directory.run("simulate case.toml --out one");
    directory.has_no("one/vtk");
    let metrics = directory.bytes("one/metrics.json");
    let said = directory.said("simulate case.toml --out one --vtk");
    assert!(said.contains("vtk/contact.pvd"), "{said}");
    assert!(directory.bytes("one/metrics.json") == metrics);
    let first = directory.bytes("one/vtk/filament_0000.vtp");
    assert_eq!(directory.names("one/vtk").len(), 202);

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
    assert_eq!(directory.bytes("one/vtk/filament_0000.vtp"), first);

    // Shapes of an earlier run would be mistaken for those of this one; incomplete files are
    // useless.
    directory.write("one/vtk/.filament_0007.vtp.bristle-killed", "half a shape");
    directory.run("simulate case.toml --out one");
    assert_eq!(directory.names("one/vtk"), ["own.pvsm"]);
}

#[cfg(feature = "vtk")]
#[test]
fn shapes_that_cannot_be_written_are_refused_before_anything_is_written() {
    let directory = Workspace::with(FILE);
    directory.make("one");
    directory.write("one/vtk", "a file");
    directory.refuses("simulate case.toml --out one --vtk", &["one/vtk"]);
    assert_eq!(directory.names("one"), ["vtk"]);
    // Without --vtk that file does not matter.
    directory.run("simulate case.toml --out one");
    directory.make("two/vtk/contact.pvd");
    directory.refuses("simulate case.toml --out two --vtk", &["contact.pvd"]);
    assert_eq!(directory.names("two"), ["vtk"]);
}

/// Without the feature, shapes of an earlier run are removed.
#[cfg(not(feature = "vtk"))]
#[test]
fn a_program_without_vtk_says_how_to_build_one_with_it() {
    let directory = Workspace::with(FILE);
    let help = "build it with `--features vtk`";
    directory.refuses("simulate case.toml --out one --vtk", &[help]);
    directory.has_no("one");
    directory.make("one/vtk");
    for name in ["filament_0000.vtp", "own.pvsm"] {
        directory.write(&format!("one/vtk/{name}"), "earlier");
    }
    directory.run("simulate case.toml --out one");
    assert_eq!(directory.names("one/vtk"), ["own.pvsm"]);
}

/// Without the feature, tables of an earlier run are removed.
#[test]
fn tables_as_parquet_are_those_of_this_run() {
    let directory = Workspace::with(FILE);
    directory.make("results");
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
    directory.has_no("results/.runs.parquet.bristle-killed");
    directory.make("blocked/runs.parquet");
    directory.refuses("study case.toml --out blocked", &["runs.parquet"]);
}
