//! Settings that are fitted to measured forces.

use crate::program::{Workspace, brush, has, lacks, words};

const FILE: &str = concat!(
    brush!(4),
    "[contact]\nfriction_coefficient = 0.2\n[process]\nbrushing_velocity_m_s = 10.0\n",
    "penetration_depth_m = 1.0e-3\n[measured]\nfile = \"forces.csv\"\nrelative_std = 0.05\n"
);
const FORCES: &str = "brushing_velocity_m_s,penetration_depth_m,force_n
5,1e-3,100
10,1e-3,120
10,2e-3,180
20,1e-3,200
";

#[test]
fn settings_are_fitted_written_and_checked() {
    let workspace = Workspace::with(FILE);
    workspace.write("forces.csv", FORCES);
    let friction = "calibrate case.toml --fit contact.friction_coefficient --no-figures --out";
    let [printed, told] = workspace.run(&format!("{friction} out --check"));
    has(&printed, &["µ = "]);
    has(
        &words(&told),
        &[
            "wrote out/calibrated.toml",
            "warning[B015]: fitted settings are biased",
            "simulated with more precision, what was fitted changes by at most 0.",
        ],
    );
    // Paths start from the directory of their file.
    let moved = "file = \"../forces.csv\"";
    has(
        &workspace.read("out/calibrated.toml"),
        &[moved, ", fitted\n"],
    );
    let told = workspace.told(&format!("{friction} out --ignore B015"));
    lacks(&told, &["B015", "more precision"]);

    let unknown = "calibrate case.toml --fit contact.friction --out nothing";
    workspace.refuses(unknown, &["case.toml: ", "is no scalar setting"]);
    workspace.write("forces.csv", "force_n\n1\n");
    workspace.refuses(&format!("{friction} nothing"), &["forces.csv"]);
    workspace.has_no("nothing");
}
