//! Named tools of a study, and saved studies that are compared as such.

use serde_json::Value;

use crate::program::{Workspace, brush, has};

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

const TOOLS: &str = "\
[study.tools.plain]

[study.tools.fine_2]
filament.diameter_m = 0.6e-3
\"tool.filament_count\" = 30000

[study.tools.\"steel, short\"]
filament = { length_m = 0.030, diameter_m = 0.3e-3, material = \"steel\" }
tool = { body_radius_m = 0.1, fill_factor = 0.2 }
";

/// A study of three tools.
fn file() -> String {
    format!("{HEAD}{SWEEPS}{TOOLS}")
}

/// What a tool states, as settings of a file of its own.
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

/// A directory with a study of three tools in `results`, and what it showed.
fn with_tools() -> (Workspace, String) {
    let workspace = Workspace::with(&file());
    let shown = workspace.printed("study case.toml --out results --figures all,svg");
    (workspace, shown)
}

/// The rows of `runs.csv` without the column `without`, if there is one.
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
    let heading: Vec<&str> = runs.lines().next().expect("a heading").split(',').collect();
    let first = [
        "brushing_velocity_m_s",
        "penetration_depth_m",
        "segments",
        "rotational_speed_rpm",
        "tool",
    ];
    assert_eq!(heading[..5], first);
    let together = rows(&runs, "tool");
    for (position, (name, changes)) in ALONE.into_iter().enumerate() {
        let file = changes.iter().fold(HEAD.to_owned(), |file, (from, to)| {
            assert!(file.contains(from), "{from}");
            file.replacen(from, to, 1)
        });
        workspace.write("alone.toml", format!("{file}{SWEEPS}"));
        workspace.run("study alone.toml --out alone --restart --no-figures");
        // What follows from a fill factor is a column of a study that states it.
        let alone = rows(&workspace.read("alone/runs.csv"), "tool.fill_factor");
        assert_eq!(alone, together[4 * position..][..4], "{name}");
    }
    let table = "  tool                                plain  fine_2  steel, short\n  radius of the brush body r_g in mm    140     140           100\n";
    assert!(shown.starts_with(table), "{shown}");
    let lines: Vec<&str> = shown.lines().collect();
    let first = lines
        .iter()
        .position(|line| line.starts_with("F_n,w in N: "))
        .expect("a table of the force");
    assert_eq!(
        [lines[first + 4], lines[first + 7], lines[first + 10]],
        [" plain", " fine_2", " steel, short"]
    );
    let mut told = lines.iter().take_while(|line| !line.contains("not stated"));
    assert!(told.all(|line| line.chars().count() <= 80), "{shown}");
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
        assert!(
            drawn.iter().any(|drawn| drawn == name),
            "{name} in {drawn:?}"
        );
    }
    let svg = workspace.read(&format!("results/figures/{by_tool}"));
    has(&svg, &["plain", "fine_2", "steel, short", "= 1 mm"]);
    workspace.run("plot results --out again --figures all,svg");
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
fn a_study_of_tools_resumes_and_is_split() {
    let (workspace, _) = with_tools();
    for shard in ["1/2", "2/2"] {
        workspace.run(&format!(
            "study case.toml --out part-{} --shard {shard}",
            &shard[..1]
        ));
    }
    workspace.run("merge case.toml part-1 part-2 --out merged --no-figures");
    for file in ["runs.csv", "study.json", "report.html"] {
        assert!(
            workspace.read(&format!("merged/{file}")) == workspace.read(&format!("results/{file}")),
            "{file}"
        );
    }
    let said = workspace.said("study case.toml --out merged --no-figures");
    assert!(said.contains("12 of 12 cases are in"), "{said}");
    for (from, to, difference) in [
        (
            "0.6e-3",
            "0.7e-3",
            "tool fine_2, filament.diameter_m: 0.0006 there, 0.0007 here",
        ),
        (
            "fill_factor = 0.2",
            "fill_factor = 0.3",
            "tool steel, short, tool.fill_factor: 0.2 there, 0.3 here",
        ),
        (
            "tools.plain",
            "tools.paper",
            "tools: plain, fine_2, steel, short there, paper, fine_2, steel, short here",
        ),
    ] {
        workspace.write("other.toml", file().replacen(from, to, 1));
        workspace.refuses("study other.toml --out merged --no-figures", &[difference]);
    }
    workspace.write("other.toml", format!("{HEAD}{SWEEPS}"));
    workspace.refuses(
        "study other.toml --out merged --no-figures",
        &["tools: plain, fine_2, steel, short there, none here"],
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
    let shown = study("--set study.tools.fine_2.filament.diameter_m=0.7e-3");
    has(
        &shown,
        &["  diameter d in mm                     1.18     0.7           0.3\n"],
    );
    // It replaces the path in quotes, too, and what states the same in another way.
    let shown = study("--set study.tools.fine_2.tool.fill_factor=0.5");
    assert!(
        shown.contains("  number of filaments N_f             10500   31110         35560\n"),
        "{shown}"
    );
    let shown = study("--set study.tools.new.filament.length_m=0.05 --set tool.width_m=0.03");
    has(&shown, &["steel, short    new\n", "53330  10500\n"]);
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

/// The setting of a tool.
const FINE: &str = "filament.diameter_m = 0.6e-3";

/// What stands in place of the setting of a tool, or of its name, and what the message says.
const REFUSED: &[(&str, &str, &[&str])] = &[
    (
        FINE,
        "filament.diametr_m = 0.6e-3",
        &["did you mean `filament.diameter_m`?"],
    ),
    (
        FINE,
        "diameter_m = 0.6e-3",
        &[
            "unknown key `study.tools.fine_2.diameter_m`",
            "did you mean `filament.diameter_m`?",
        ],
    ),
    (
        FINE,
        "filament.diameter_m = -1",
        &["`filament.diameter_m` is -1.0", "greater than 0"],
    ),
    (
        FINE,
        "filament.diameter_m = 0,6",
        &["write a decimal point"],
    ),
    (
        FINE,
        "process.penetration_depth_m = 1e-3",
        &["all tools share it", "[tool], [filament]"],
    ),
    (
        FINE,
        "contact = 3",
        &["state its keys, as in contact.… = …"],
    ),
    (
        FINE,
        "brush = {}",
        &["tool `fine_2` touch each other, those of `plain` do not"],
    ),
    (
        FINE,
        "tool.fill_factor = 0.3",
        &["are both given", "give one of them"],
    ),
    (
        FINE,
        "filament.material = \"stel\"",
        &["did you mean `steel`?"],
    ),
    (
        "[study.tools.fine_2]",
        "[study.tools.PLAIN]",
        &["`PLAIN` and `plain`", "more than capitals and punctuation"],
    ),
    (
        "[study.tools.fine_2]",
        "[study.tools.plain]",
        &["duplicate key", "stands in the file once"],
    ),
    (
        "[study.tools.fine_2]",
        "[study.tools.\"=1+1\"]",
        &["cannot be named `=1+1`", "begins with a letter or digit"],
    ),
    (
        "[study.tools.fine_2]",
        "[study.tools.\"\"]",
        &["cannot be named ``"],
    ),
    (
        "penetration_depth_m = [1e-3, 2e-3]",
        "penetration_depth_m = [1e-3]\n\"filament.diameter_m\" = [1e-3]",
        &[
            "`filament.diameter_m` has no effect, because the study sweeps `filament.diameter_m`",
            "apply to all tools",
        ],
    ),
    (
        "length_m = 0.030",
        "length_m = 0.0015",
        &[
            "(tool steel, short)",
            "less than filament.length_m = 0.0015",
        ],
    ),
];

#[test]
fn mistakes_about_tools_are_named() {
    let workspace = Workspace::new();
    for (right, wrong, parts) in REFUSED {
        let file = file();
        assert!(file.contains(right), "{right}");
        workspace.write("case.toml", file.replacen(right, wrong, 1));
        let message = workspace.refused("study case.toml --out results");
        assert!(
            message.starts_with("error: ") && message.contains("--> case.toml:"),
            "{wrong}\n{message}"
        );
        for part in *parts {
            assert!(message.contains(part), "{wrong}: no `{part}` in\n{message}");
        }
    }
    for (tools, part) in [
        ("tools = []", "tables of settings"),
        ("tools = {}", "tables of settings"),
        ("tools = { a = 1 }", "a table of settings, as in"),
    ] {
        workspace.write("case.toml", format!("{HEAD}{SWEEPS}{tools}\n"));
        let message = workspace.refused("study case.toml --out results");
        assert!(
            message.contains("`study.tools") && message.contains(part),
            "{tools}\n{message}"
        );
    }
    assert!(!workspace.path("results").exists());
}

#[test]
fn advice_compares_the_tools() {
    let (workspace, _) = with_tools();
    let all = workspace.printed("advise results");
    let best = all.find("Best case of each tool").expect("a comparison");
    let places = [
        "Tool steel, short; it",
        "Tool plain; it",
        "Tool fine_2; it",
        "With tool plain",
    ]
    .map(|text| all.find(text));
    assert!(places.is_sorted() && places[0] > Some(best), "{all}");
    let json = workspace.printed_json("advise results --max-force 200 --no-verify --json");
    let within = |tool: &Value| {
        tool["tool_contact_normal_force_n"]
            .as_f64()
            .is_some_and(|force| force <= 200.0)
    };
    assert!(
        json["tools"].as_array().expect("tools").iter().all(within),
        "{}",
        json["tools"]
    );
    let sections = json["sections"].as_array().expect("sections");
    assert!(
        sections
            .iter()
            .map(|section| &section["settings"]["tool"])
            .eq(ALONE.map(|(name, _)| name)),
        "{json}"
    );
    let none = workspace.printed("advise results --max-force 1 --no-verify");
    assert!(
        none.starts_with("Tools without such a case: plain; fine_2; steel, short\n"),
        "{none}"
    );
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

#[test]
fn saved_studies_are_compared_as_tools() {
    let (workspace, _) = with_tools();
    let finer = HEAD.replacen("1.18e-3", "0.8e-3", 1);
    let write = |name: &str, head: &str, sweeps: &str| {
        workspace.write("one.toml", format!("{head}[study]\n{sweeps}\n"));
        workspace.run(&format!("study one.toml --out studies/{name} --no-figures"));
    };
    write(
        "old",
        HEAD,
        "rotational_speed_rpm = [300, 600, 1200]\npenetration_depth_m = [1e-3, 2e-3]",
    );
    write(
        "new",
        &finer,
        "rotational_speed_rpm = [1200, 600]\npenetration_depth_m = [2e-3, 1e-3, 3e-3]",
    );
    let [shown, said] = workspace
        .run("compare-studies studies/old thin=studies/new --out compared --figures all,svg");
    assert!(
        shown.starts_with("  tool               old  thin\n  diameter d in mm  1.18   0.8\n"),
        "{shown}"
    );
    assert!(
        said.contains("note: of old, 2 of 3 values of n_w are compared"),
        "{said}"
    );
    assert!(
        said.contains("note: of thin, 2 of 3 values of a_e are compared"),
        "{said}"
    );
    // Each row is one of the studies'.
    let compared = rows(&workspace.read("compared/runs.csv"), "tool");
    assert_eq!(compared.len(), 8);
    for (rows_of, name) in [(&compared[..4], "old"), (&compared[4..], "new")] {
        let own = rows(&workspace.read(&format!("studies/{name}/runs.csv")), "");
        for row in rows_of {
            assert_eq!(
                own.iter().filter(|own| *own == row).count(),
                1,
                "{name}: {row:?}"
            );
        }
    }
    assert!(
        workspace
            .path("compared/figures/tool_force_over_speed_by_tool_penetration_depth_m_0.002.svg")
            .is_file()
    );
    assert!(
        workspace
            .read("compared/report.html")
            .contains(r#""names":["old","thin"]"#)
    );
    workspace.run("plot compared --figures svg");
    let advice = workspace.printed("advise compared");
    has(&advice, &["Best case of each tool", "With tool thin"]);
    // A study of tools has each of them, and a velocity may be the same speed.
    let shown = workspace.printed("compare-studies results studies/old --out nested --no-figures");
    has(
        &shown,
        &[
            "  results: plain  results: fine_2\n",
            "  results: steel, short    old\n",
        ],
    );
    let velocity = std::f64::consts::TAU * 600.0 / 60.0 * 0.18;
    write(
        "tips",
        HEAD,
        &format!("brushing_velocity_m_s = [{velocity:?}, 3.0]\npenetration_depth_m = [2e-3]"),
    );
    let shown =
        workspace.printed("compare-studies studies/old studies/tips --out same --no-figures");
    assert!(
        shown.starts_with("The tools differ in nothing but their names.\n"),
        "{shown}"
    );

    write(
        "apart",
        HEAD,
        "rotational_speed_rpm = [700]\npenetration_depth_m = [1e-3]",
    );
    write(
        "friction",
        HEAD,
        "rotational_speed_rpm = [600]\npenetration_depth_m = [1e-3]\n\"contact.friction_coefficient\" = [0.1, 0.2]",
    );
    for (studies, parts) in [
        (
            "studies/old studies/apart",
            &[
                "no rotational speed in common: old has 3 values from 300 rpm to 1200 rpm, apart has 700 rpm",
                "[study]",
            ][..],
        ),
        (
            "studies/old studies/friction",
            &[
                "no coefficient of friction in common: old has 0, friction has 2 values from 0.1 to 0.2",
            ],
        ),
        ("studies/old", &["one study alone cannot be compared"]),
        (
            "studies/old studies/old",
            &[
                "the tools `old` and `old`",
                "give a name, as in fine=results/3",
            ],
        ),
        (
            "studies/old =studies/new",
            &["cannot be named ``", "give a name"],
        ),
        ("studies/old studies/none", &["has no study.json"]),
    ] {
        workspace.refuses(&format!("compare-studies {studies} --out refused"), parts);
    }
    assert!(!workspace.path("refused").exists());
    let before = workspace.read("studies/old/study.json");
    let onto_one = "compare-studies studies/old studies/new --out studies/old";
    workspace.refuses(onto_one, &["holds a study of its own"]);
    assert_eq!(workspace.read("studies/old/study.json"), before);
}

#[test]
fn measured_forces_are_compared_with_their_tools() {
    let workspace = Workspace::new();
    let measured =
        "[measured]\nfile = \"forces.csv\"\ncolumns = { tool = \"brush\", force_n = \"F [N]\" }\n";
    workspace.write("case.toml", format!("{HEAD}{SWEEPS}{TOOLS}{measured}"));
    let heading = "brush;rotational_speed_rpm;penetration_depth_m;F [N]\n";
    workspace.write(
        "forces.csv",
        format!("{heading}plain;600;1e-3;180\nplain;1200;1e-3;250\nsteel, short;600;2e-3;300\n"),
    );
    let shown = workspace.printed("study case.toml --out results --figures all,svg");
    has(
        &shown,
        &[
            "simulated and measured, tool plain\n",
            "simulated and measured, tool steel, short\n",
        ],
    );
    assert!(!shown.contains("measured, tool fine_2"), "{shown}");
    assert_eq!(shown.matches(" points compared").count(), 2, "{shown}");
    let table = workspace.read("results/measured_comparison.csv");
    let tools: Vec<String> = rows(&table, "")
        .into_iter()
        .map(|mut row| row.remove(0))
        .collect();
    assert_eq!(tools, ["plain", "plain", "steel, short"]);
    assert!(
        workspace
            .read("results/measured.csv")
            .starts_with("tool,rotational_speed_rpm,")
    );
    assert!(
        workspace
            .path("results/figures/measured_over_speed_tool_plain.svg")
            .is_file()
    );
    assert!(
        !workspace
            .path("results/figures/measured_over_speed_tool_fine_2.svg")
            .exists()
    );
    // Redrawn, and with another study that has no measured forces.
    workspace.run("plot results --figures svg");
    assert_eq!(workspace.read("results/measured_comparison.csv"), table);
    workspace.write("one.toml", format!("{HEAD}{SWEEPS}"));
    workspace.run("study one.toml --out one --no-figures");
    let shown = workspace.printed("compare-studies one results --out compared --figures all,svg");
    has(&shown, &["simulated and measured, tool results: plain\n"]);
    assert!(!shown.contains("tool one\n"), "{shown}");
    workspace.write("forces.csv", format!("{heading}plane;600;1e-3;180\n"));
    workspace.refuses(
        "study case.toml --out results --restart",
        &["`plane` is none of the tools plain, fine_2, steel, short"],
    );
}

#[test]
fn keys_of_tools_are_explained_and_in_the_schema() {
    let workspace = Workspace::new();
    has(
        &workspace.printed("explain filament.diameter_m"),
        &["under [study.tools.NAME]"],
    );
    let text = workspace.printed("explain process.penetration_depth_m");
    assert!(!text.contains("tools"), "{text}");
    for key in ["study", "study.tools", "tools"] {
        let text = workspace.printed(&format!("explain {key}"));
        assert!(
            text.contains("study.tools") && text.lines().all(|line| line.chars().count() <= 80),
            "{text}"
        );
    }
    let schema = workspace.printed_json("schema");
    let tool =
        &schema["properties"]["study"]["properties"]["tools"]["additionalProperties"]["properties"];
    for keys in [
        &tool["filament"]["properties"]["diameter_m"],
        &tool["filament.diameter_m"],
    ] {
        assert_eq!(keys["exclusiveMinimum"].as_f64(), Some(0.0), "{tool}");
    }
    assert!(
        tool["filament"]["required"].is_null() && tool["process"].is_null(),
        "{tool}"
    );
}
