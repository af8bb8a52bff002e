//! Calls the program under test.

use std::path::Path;

use assert_cmd::Command;

/// A call of the program in a directory, with arguments separated by spaces. Its lines are made for 80 columns.
pub fn bristle(directory: &Path, arguments: &str) -> Command {
    let mut command = Command::cargo_bin("bristle").expect("the program is built");
    command.env_remove("COLUMNS").current_dir(directory).args(arguments.split_whitespace());
    command
}
