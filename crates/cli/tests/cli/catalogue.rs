//! Brushes as catalogues state them: every case of their first study succeeds with the defaults.

use crate::program::Workspace;

/// Tool diameter, filament length and diameter, number of filaments, and width in mm.
const BRUSHES: [&str; 5] = [
    "--tool-diameter-mm 200 --length-mm 30 --diameter-mm 0.6 --filaments 6000 --width-mm 25",
    "--tool-diameter-mm 250 --length-mm 40 --diameter-mm 0.8 --filaments 5000 --width-mm 25",
    "--tool-diameter-mm 200 --length-mm 40 --diameter-mm 1.0 --filaments 2500 --width-mm 25",
    "--tool-diameter-mm 150 --length-mm 25 --diameter-mm 0.5 --filaments 8000 --width-mm 20",
    "--tool-diameter-mm 300 --length-mm 50 --diameter-mm 1.2 --filaments 3500 --width-mm 40",
];

#[test]
#[ignore = "it takes minutes"]
fn every_case_of_five_catalogue_brushes_succeeds() {
    let directory = Workspace::new();
    for (number, brush) in BRUSHES.iter().enumerate() {
        let file = format!("{number}.toml");
        directory.printed(&format!(
            "new {file} {brush} --material PA6.12+30%SiC --max-rpm 2400 --max-depth-mm 3"
        ));
        // Alternately without and with friction.
        let friction = ["0", "0.4"][number % 2];
        let options = format!("--no-figures --set contact.friction_coefficient={friction}");
        directory.printed(&format!("study {file} --out {number} {options}"));
        let runs = directory.read(&format!("{number}/runs.csv"));
        let mut cases = runs.lines().skip(1);
        assert!(
            runs.lines().count() == 25 && cases.all(|case| case.ends_with(",ok")),
            "{brush}, µ = {friction}"
        );
    }
}
