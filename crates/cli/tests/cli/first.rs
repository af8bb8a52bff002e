//! The first steps: a file from a few answers, and the meaning of its keys.

use bristle::model::parameters::PARAMETERS;
use bristle_study::input::friction::{PAIRINGS, Pairing, range_of_all};
use bristle_study::input::materials::{MATERIALS, Spread};
use bristle_study::input::mixture::Mixture;
use bristle_study::text::number::significant;

use crate::program::{Workspace, has, lacks, section};

const ANSWERS: &str = "--body-radius-mm 140 --width-mm 20 --filaments 10500 --length-mm 40 --diameter-mm 1.18 --max-rpm 1200 \
                       --max-depth-mm 4";

#[test]
fn a_first_file_can_be_simulated() {
    let directory = Workspace::new();
    directory.run(&format!("new brush.toml {ANSWERS} --friction 0.3"));
    let text = directory.read("brush.toml");
    assert!(
        text.lines().all(|line| line.chars().count() <= 100),
        "{text}"
    );
    has(
        &text,
        &[
            "[brush]  ",
            "# lateral_tilt_std_rad = 0.005",
            "friction_coefficient = 0.3",
            "# E: Young’s modulus, in Pa",
            "rotational_speed_rpm = [200.0, 400.0",
        ],
    );
    directory.run("simulate brush.toml --out one --strict --no-figures --set filament.segments=4");
    // With distant tips, filaments are alone. Nobody has measured friction.
    let sparse = ANSWERS.replace("10500", "1000");
    directory.run(&format!(
        "new sparse.toml {sparse} --workpiece ceramic --wet"
    ));
    let sparse_text = directory.read("sparse.toml");
    lacks(&sparse_text, &["[brush]"]);
    has(
        &sparse_text,
        &[
            "\nfriction_coefficient = 0.225 ",
            "# The middle of 0.05 to 0.4, a guess for wet ceramic",
            "\nfriction_coefficient_std = 0.0875 ",
            "\nyoungs_modulus_std_pa = 6.6e8 ",
            "(SK-Lab 12 and 13)",
        ],
    );
    assert!(
        sparse_text.lines().all(|line| line.chars().count() <= 100),
        "{sparse_text}"
    );
    let printed = directory.printed("study sparse.toml --out intervals --no-figures");
    has(&printed, &["95 %", "friction "]);
    directory.refuses(
        &format!("new stone.toml {sparse} --workpiece stone"),
        &["must be one of steel, ceramic, wood, aluminium, plastic, other"],
    );
    // A material states density and modulus.
    directory.run(&format!("new nylon.toml {ANSWERS} --material pa6.12"));
    let nylon = directory.read("nylon.toml");
    has(&nylon, &["material = \"PA6.12\""]);
    lacks(&nylon, &["youngs_modulus_pa"]);
    directory.refuses(
        &format!("new wood.toml {ANSWERS} --material wood"),
        &["must be one of PA6, PA6.6, PA6.6 wet"],
    );
    // The file is not replaced.
    directory.refuses(&format!("new brush.toml {ANSWERS}"), &["exists already"]);
    assert_eq!(text, directory.read("brush.toml"));
}

#[test]
fn answers_that_are_missing_or_wrong_are_named() {
    let directory = Workspace::new();
    directory.refuses(
        "new brush.toml --width-mm 20 --max-rpm 1200",
        &["--length-mm, --diameter-mm, --tool-diameter-mm (or --body-diameter-mm, or --body-radius-mm), --filaments"],
    );
    directory.refuses(
        &format!(
            "new brush.toml {}",
            ANSWERS.replace("--length-mm 40", "--length-mm 1")
        ),
        &["`filament.diameter_m`", "brush.toml:"],
    );
    directory.refused(&format!("new absent/brush.toml {ANSWERS}"));
    directory.has_no("brush.toml");
}

#[test]
fn the_documents_state_abrasive_filaments_and_their_friction() {
    let page = include_str!("../../../../docs/input.md");
    for material in MATERIALS {
        let Spread::Mixture(Mixture {
            volume_fraction,
            bounds_pa,
            ..
        }) = material.spread
        else {
            continue;
        };
        let modulus = significant(material.youngs_modulus_pa / 1e9);
        let bounds = bounds_pa.map(|bound| significant(bound / 1e9)).join(" to ");
        let (name, density, share) = (
            material.name,
            material.density_kg_m3,
            100.0 * volume_fraction,
        );
        let row = format!("| `{name:?}` | {share:.1} % | {density} | {modulus} | {bounds} |\n");
        has(page, &[&row]);
    }
    for pairings in PAIRINGS.chunk_by(|one, next| one.workpiece == next.workpiece) {
        let conditions = pairings.iter().map(|pairing| pairing.condition);
        assert!(conditions.eq(["dry", "wet"]));
        let ranges = pairings.iter().map(
            |Pairing {
                 range: [least, largest],
                 ..
             }| format!("{least} to {largest}"),
        );
        let row = format!(
            "| {} | {} | ",
            pairings[0].workpiece,
            ranges.collect::<Vec<_>>().join(" | ")
        );
        has(page, &[&row]);
    }
    let [least, largest] = range_of_all();
    has(
        include_str!("../../../../docs/trust.md"),
        &[&format!("anywhere from {least} to {largest}")],
    );
}

/// Returns the rows of a section of docs/input.md, as cells.
fn rows<'p>(page: &'p str, name: &str) -> Vec<Vec<&'p str>> {
    let rows = section(page, &format!("`[{name}]`"))
        .lines()
        .filter(|line| line.starts_with("| `"));
    rows.map(|row| {
        row.trim_matches('|')
            .split(" | ")
            .map(|cell| cell.trim().trim_matches('|').trim())
            .collect()
    })
    .collect()
}

#[test]
fn the_documents_state_the_table_of_settings() {
    let page = include_str!("../../../../docs/input.md");
    let directory = Workspace::new();
    let schema = directory.printed_json("explain --schema");
    for parameter in PARAMETERS {
        let rows = rows(page, parameter.section());
        let key = format!("`{}`", parameter.key());
        let row = rows
            .iter()
            .find(|row| row[0] == key)
            .unwrap_or_else(|| panic!("no row for {}", parameter.path));
        let said = row.join(" | ");
        let default = row.last().expect("a default");
        if parameter.required && parameter.instead_of.is_empty() {
            assert!(default.starts_with("required"), "{said}");
        }
        let in_schema =
            &schema["properties"][parameter.section()]["properties"][parameter.key()]["default"];
        if let (Ok(told), Some(value)) = (default.parse::<f64>(), in_schema.as_f64()) {
            assert_eq!(told, value, "{said}");
        }
        assert!(
            parameter.symbol.is_empty()
                || parameter.section() == "uncertainty"
                || said.contains(parameter.symbol),
            "{said}"
        );
    }
}
