//! Named tools of a study, and saved studies that are compared as tools.

use serde_json::Value;

use crate::program::{Workspace, brush, has, lacks};

const HEAD: &str = concat!(
    brush!(4),
    "youngs_modulus_pa = 3.0e9

[solver]
relative_tolerance = 1e-4
"
);

const SWEEPS: &str = "\
[study]
rotational_speed_rpm = [600, 1200]
penetration_depth_m = [1e-3, 2e-3]
";

pub const TOOLS: &str = "\
[study.tools.plain]

[study.tools.fine_2]
filament.diameter_m = 0.6e-3
\"tool.filament_count\" = 30000

[study.tools.\"steel, short\"]
filament = { length_m = 0.030, diameter_m = 0.3e-3, material = \"steel\" }
tool = { body_radius_m = 0.1, fill_factor = 0.2 }
";

/// Returns a study of three tools.
pub fn file() -> String {
    format!("{HEAD}{SWEEPS}{TOOLS}")
}

/// Settings of each tool, as in a file without tools.
const ALONE: [(&str, &[(&str, &str)]); 3] = [
    ("plain", &[]),
    (
        "fine_2",
        &[
            ("diameter_m = 1.18e-3", "diameter_m = 0.6e-3"),
            ("= 10500", "= 30000"),
        ],
    ),
    (
        "steel, short",
        &[
            ("length_m = 0.040", "length_m = 0.030\nmaterial = \"steel\""),
            ("diameter_m = 1.18e-3", "diameter_m = 0.3e-3"),
            ("youngs_modulus_pa = 3.0e9\n", ""),
            ("body_radius_m = 0.140", "body_radius_m = 0.1"),
            ("filament_count = 10500", "fill_factor = 0.2"),
        ],
    ),
];

/// Returns a directory with a study of three tools in `results`, and its output.
fn with_tools() -> (Workspace, String) {
    let workspace = Workspace::with(&file());
    let shown = workspace.printed("study case.toml --out results --figures all,svg");
    (workspace, shown)
}

/// Returns the rows of `runs.csv` without the column `without`, if any.
fn rows(text: &str, without: &str) -> Vec<Vec<String>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let left_out = reader
        .headers()
        .expect("a heading")
        .iter()
        .position(|name| name == without);
    let row = |record: csv::StringRecord| {
        let cells = record
            .iter()
            .enumerate()
            .filter(|(column, _)| Some(*column) != left_out);
        cells.map(|(_, cell)| cell.to_owned()).collect()
    };
    reader
        .records()
        .map(|record| row(record.expect("a row")))
        .collect()
}

#[test]
fn each_tool_has_the_results_of_a_study_of_its_own() {
    let (workspace, shown) = with_tools();
    let runs = workspace.read("results/runs.csv");
    let heading = "brushing_velocity_m_s,penetration_depth_m,segments,rotational_speed_rpm,tool,";
    assert!(runs.starts_with(heading), "{runs}");
    let together = rows(&runs, "tool");
    for (position, (name, changes)) in ALONE.into_iter().enumerate() {
        let file = changes.iter().fold(HEAD.to_owned(), |file, (from, to)| {
            assert!(file.contains(from), "{from}");
            file.replacen(from, to, 1)
        });
        workspace.write("alone.toml", format!("{file}{SWEEPS}"));
        workspace.run("study alone.toml --out alone --restart --no-figures");
        // A value derived from a fill factor is a column of a study that states the factor.
        let alone = rows(&workspace.read("alone/runs.csv"), "tool.fill_factor");
        assert_eq!(alone, together[4 * position..][..4], "{name}");
    }
    let table = "  tool                                plain  fine_2  steel, short\n  radius of the brush body r_g in mm    140     140           100\n";
    assert!(shown.starts_with(table), "{shown}");
    let (_, force) = shown.split_once("\nF_n,w in N: ").expect("a table");
    has(force, &["\n plain\n", "\n fine_2\n", "\n steel, short\n"]);
    has(
        &shown,
        &["at tool steel, short, v_b", "filament.material = \"steel\""],
    );

    let drawn = workspace.names("results/figures");
    let by_tool = "tool_force_over_speed_by_tool_penetration_depth_m_0.001.svg";
    for name in [
        by_tool,
        "tool_force_map_tool_fine_2.svg",
        "tool_force_over_speed_tool_steel__short.svg",
    ] {
        workspace.has_file(&format!("results/figures/{name}"));
    }
    let svg = workspace.read(&format!("results/figures/{by_tool}"));
    has(&svg, &["plain", "fine_2", "steel, short", "= 1 mm"]);
    workspace.run("report results --out again --figures all,svg");
    assert_eq!(workspace.names("again/figures"), drawn);
    assert_eq!(workspace.read(&format!("again/figures/{by_tool}")), svg);

    let page = workspace.read("results/report.html");
    has(
        &page,
        &[
            r#""names":["plain","fine_2","steel, short"]"#,
            r#""by_tool":[0.14,0.14,0.1]"#,
        ],
    );
}

#[test]
fn a_study_of_tools_resumes() {
    let (workspace, _) = with_tools();
    let said = workspace.said("study case.toml --out results --no-figures");
    has(&said, &["12 of 12 cases are in"]);
    // One tool of three has another diameter: the cases of the others are still in the journal.
    workspace.write("other.toml", file().replacen("0.6e-3", "0.7e-3", 1));
    let said = workspace.said("study other.toml --out results --no-figures");
    has(
        &said,
        &["8 of 12 cases are in", "are kept in `results/previous`"],
    );
}

#[test]
fn options_state_what_a_tool_has() {
    let workspace = Workspace::with(&file());
    let study = |options: &str| {
        workspace.printed(&format!(
            "study case.toml --out results --restart --no-figures {options}"
        ))
    };
    for (options, table) in [
        (
            "--set study.tools.fine_2.filament.diameter_m=0.7e-3",
            "  diameter d in mm                     1.18     0.7           0.3\n",
        ),
        // It replaces the path in quotes, too, and equivalent settings.
        (
            "--set study.tools.fine_2.tool.fill_factor=0.5",
            "  number of filaments N_f             10500   31110         35560\n",
        ),
        (
            "--set study.tools.new.filament.length_m=0.05 --set tool.width_m=0.03",
            "steel, short    new\n",
        ),
    ] {
        has(&study(options), &[table]);
    }
    workspace.refuses(
        "study case.toml --out x --set study.tools.fine_2.filament.diametr_m=1",
        &["--> --set:1:1", "did you mean `filament.diameter_m`?"],
    );
    let plain = "[study.tools.plain]\n";
    workspace.write(
        "each.toml",
        file().replacen(plain, &format!("{plain}filament.diameter_m = 1e-3\n"), 1),
    );
    workspace.refuses(
        "study each.toml --out x --set filament.diameter_m=1e-3",
        &[
            "each tool of the study states it",
            "--set study.tools.\"plain\".",
        ],
    );
}

#[test]
fn advice_compares_the_tools() {
    let (workspace, _) = with_tools();
    let all = workspace.printed("advise results");
    let places = [
        "Best case of each tool",
        "Tool steel, short; it",
        "Tool plain; it",
        "Tool fine_2; it",
        "With tool plain",
    ]
    .map(|text| all.find(text));
    assert!(places.is_sorted() && places[0].is_some(), "{all}");
    let json = workspace.printed_json("advise results --max-force 200 --no-verify --json");
    let tools = json["tools"].as_array().expect("tools");
    let force = |tool: &Value| tool["tool_contact_normal_force_n"].as_f64();
    assert!(tools.iter().filter_map(force).all(|force| force <= 200.0));
    let sections = json["sections"].as_array().expect("sections");
    let named = sections.iter().map(|section| &section["settings"]["tool"]);
    assert!(named.eq(ALONE.map(|(name, _)| name)), "{json}");
    let none = workspace.printed("advise results --max-force 1 --no-verify");
    let tools = "Tools without such a case: plain; fine_2; steel, short\n";
    assert!(none.starts_with(tools), "{none}");
}

#[test]
fn tools_alone_are_an_axis() {
    let process = "[process]\nrotational_speed_rpm = 600\npenetration_depth_m = 1e-3\n";
    let workspace = Workspace::with(&format!("{HEAD}{process}{TOOLS}"));
    let shown = workspace.printed("study case.toml --out results --figures all,svg");
    has(
        &shown,
        &["\nn_w = 600 rpm in all cases\n", "\n         plain  0."],
    );
    let svg = workspace.read("results/figures/tool_force_over_tool.svg");
    has(&svg, &["plain", "fine_2", "steel, short"]);
    assert_eq!(workspace.read("results/runs.csv").lines().count(), 4);
}

/// More tests are in `bristle_app::insight::joined`.
#[test]
fn saved_studies_are_compared_as_tools() {
    let workspace = Workspace::new();
    let measured = "[measured]\nfile = \"forces.csv\"\n";
    let forces = "rotational_speed_rpm,penetration_depth_m,force_n\n600,1e-3,180\n";
    workspace.write("forces.csv", forces);
    let write = |name: &str, head: &str, sweeps: &str| {
        workspace.write("one.toml", format!("{head}[study]\n{sweeps}\n"));
        workspace.run(&format!("study one.toml --out studies/{name} --no-figures"));
    };
    let (speeds, depths) = (
        "rotational_speed_rpm = [300, 600, 1200]\n",
        "penetration_depth_m = [1e-3, 2e-3]\n",
    );
    write("old", HEAD, &[speeds, depths, measured].concat());
    let finer = HEAD.replacen("1.18e-3", "0.8e-3", 1);
    let speeds = "rotational_speed_rpm = [1200, 600]\n";
    write("new", &finer, &[speeds, depths].concat());
    let [shown, said] =
        workspace.run("report studies/old thin=studies/new --out compared --figures all,svg");
    let table = "  tool               old  thin\n  diameter d in mm  1.18   0.8\n";
    assert!(shown.starts_with(table), "{shown}");
    has(&shown, &["simulated and measured, tool old\n"]);
    lacks(&shown, &["measured, tool thin"]);
    has(&said, &["note: of old, 2 of 3 values of n_w are compared"]);
    assert_eq!(workspace.rows("compared/runs.csv").len(), 8);
    for name in [
        "measured_over_speed_tool_old",
        "tool_force_over_speed_by_tool_penetration_depth_m_0.002",
    ] {
        workspace.has_file(&format!("compared/figures/{name}.svg"));
    }
    let kept = workspace.read("compared/measured.csv");
    assert!(kept.starts_with("tool,rotational_speed_rpm,"), "{kept}");
    has(
        &workspace.read("compared/report.html"),
        &[r#""names":["old","thin"]"#],
    );
    workspace.run("report compared --figures svg");
    let advice = workspace.printed("advise compared");
    has(&advice, &["Best case of each tool", "With tool thin"]);
    // A study of tools contributes each of them.
    let shown = workspace.printed("report compared studies/old --out all --no-figures");
    has(&shown, &["compared: old", "compared: thin"]);
    let shown = workspace.printed("report studies/old same=studies/old --out same --no-figures");
    has(&shown, &["The tools differ in nothing but their names.\n"]);

    for (studies, part) in [
        ("studies/old studies/old", "the tools `old` and `old`"),
        ("studies/old =studies/new", "cannot be named ``"),
        ("studies/old studies/none", "has no study.json"),
    ] {
        workspace.refuses(&format!("report {studies} --out refused"), &[part]);
    }
    workspace.has_no("refused");
    let onto_one = "report studies/old studies/new --out studies/old";
    workspace.refuses(onto_one, &["holds a study of its own"]);
}

#[test]
fn keys_of_tools_are_explained_and_in_the_schema() {
    let workspace = Workspace::new();
    for (key, is_of_tools) in [
        ("filament.diameter_m", true),
        ("process.penetration_depth_m", false),
        ("study", true),
        ("study.tools", true),
        ("tools", true),
    ] {
        let text = workspace.printed(&format!("explain {key}"));
        assert_eq!(text.contains("study.tools"), is_of_tools, "{text}");
    }
    let schema = workspace.printed_json("explain --schema");
    let tool =
        &schema["properties"]["study"]["properties"]["tools"]["additionalProperties"]["properties"];
    for keys in [
        &tool["filament"]["properties"]["diameter_m"],
        &tool["filament.diameter_m"],
    ] {
        assert_eq!(keys["exclusiveMinimum"], 0.0, "{tool}");
    }
    assert!(tool["filament"]["required"].is_null() && tool["process"].is_null());
}
