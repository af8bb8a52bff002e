//! The program under test, and the input that most tests give it.

use std::path::Path;

use assert_cmd::Command;

/// A call of the program in a directory, with arguments separated by spaces. Its lines are made for 80 columns.
pub fn bristle(directory: &Path, arguments: &str) -> Command {
    let mut command = Command::cargo_bin("bristle").expect("the program is built");
    command.env_remove("COLUMNS").current_dir(directory).args(arguments.split_whitespace());
    command
}

/// The sections `[tool]` and `[filament]` of an input file: the paper's brush with a number of segments, and further lines of `[tool]`.
macro_rules! brush {
    ($segments:literal) => {
        brush!($segments, "")
    };
    ($segments:literal, $more:literal) => {
        concat!(
            "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 10500\n",
            $more,
            "\n[filament]\nsegments = ",
            $segments,
            "\nlength_m = 0.040\ndiameter_m = 1.18e-3\n"
        )
    };
}

pub(crate) use brush;

/// The same brush with so few filaments that they do not touch each other.
pub fn sparse(text: &str) -> String {
    let few = text.replace("filament_count = 10500", "filament_count = 1000");
    few.replace("filament_count_uncertainty = 600", "filament_count_uncertainty = 60")
}
