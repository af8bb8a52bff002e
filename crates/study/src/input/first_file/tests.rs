//! Tests of first files, and of answers as people type them.

use super::*;

/// Returns the answers to all questions but those about the pose, as a person types them.
fn typed(texts: [&str; 9]) -> Answers {
    let mut answers = [None; 11];
    for ((answer, question), text) in answers.iter_mut().zip(&QUESTIONS).skip(LENGTH).zip(texts) {
        *answer = Some(question.answer(text, 0.04).expect(text));
    }
    answers
}

fn file(answers: Answers, material: Option<&'static Material>) -> FirstFile {
    first_file(
        ToolKind::Round,
        answers,
        material,
        USUAL,
        None,
        "brush.toml",
    )
    .expect("a brush")
}

#[test]
fn answers_become_a_brush() {
    let mut answers = typed([
        "40", "1,18 mm", "3", "20", "36 cm", "10500", "0.3", "25 Hz", "4",
    ]);
    let FirstFile {
        text,
        unusual,
        note,
    } = file(answers, None);
    assert_eq!(note, "");
    assert_eq!(unusual, []);
    let document = Document::parse(&text, "brush.toml").expect("a document");
    let settings = document.settings().expect("settings");
    assert_eq!(
        (settings.tool.body_radius_m, settings.filament.diameter_m),
        (0.14, 1.18e-3)
    );
    assert_eq!(
        (
            settings.tool.filament_count,
            settings.filament.youngs_modulus_pa
        ),
        (10_500.0, 3e9)
    );
    assert!((settings.rotational_speed_rpm() - 750.0).abs() < 1e-9);
    assert_eq!(document.study().expect("a study").case_count(), 24);
    let unstated = document.unstated();
    let unstated: Vec<&str> = unstated.iter().map(|parameter| parameter.key()).collect();
    assert_eq!(
        unstated,
        ["density_kg_m3", "damping_ratio", "stiffness_n_m"],
        "what was not asked is not stated"
    );

    answers[MODULUS] = None;
    answers[7] = Some(0.6);
    let packed = file(answers, None).text;
    assert!(
        packed.contains("\nfill_factor = 0.6 ") && packed.contains("\n# youngs_modulus_pa = "),
        "{packed}"
    );
    let named = file(answers, Material::find("PA6.12")).text;
    assert!(
        named.contains("\nmaterial = \"PA6.12\" ")
            && named.contains("# E = 3.31 GPa, ρ = 1060 kg/m³, dry;"),
        "{named}"
    );
    assert!(
        !named.contains("youngs_modulus_pa") && !named.contains("density_kg_m3"),
        "{named}"
    );
    let document = Document::parse(&named, "brush.toml").expect("a document");
    assert_eq!(
        document
            .settings()
            .expect("settings")
            .filament
            .youngs_modulus_pa,
        3.31e9
    );
    answers[7] = Some(20_000.0);
    let unusual = file(answers, None).unusual;
    assert!(
        unusual
            .iter()
            .any(|unusual| unusual.statement.contains("fit on the body")),
        "{unusual:?}"
    );
    answers[10] = Some(50e-3);
    let wrong = first_file(ToolKind::Round, answers, None, USUAL, None, "brush.toml");
    assert!(
        wrong
            .expect_err("too deep")
            .to_string()
            .contains("`process.penetration_depth_m`")
    );
}

#[test]
fn friction_and_modulus_that_nobody_measured_have_a_standard_deviation() {
    let mut answers = typed(["40", "1,18", "3", "20", "360", "1000", "0.3", "1500", "4"]);
    assert!(!file(answers, None).text.contains("\n[uncertainty]"));
    answers[FRICTION_COEFFICIENT] = None;
    answers[MODULUS] = None;
    let settings = |material, pairing: &Pairing| {
        let text = first_file(
            ToolKind::Round,
            answers,
            material,
            pairing,
            None,
            "brush.toml",
        )
        .expect("a brush")
        .text;
        Document::parse(&text, "brush.toml")
            .and_then(|file| file.settings())
            .expect("settings")
    };
    let nylon = Material::find("PA6.12");
    let dry = settings(nylon, USUAL);
    let [friction, modulus] = [
        dry.uncertainty.friction_coefficient_std,
        dry.uncertainty.youngs_modulus_std_pa,
    ];
    assert_eq!((dry.contact.friction_coefficient, friction), (0.4, 0.1));
    assert_eq!(modulus, 0.7282e9, "22 % of 3.31 GPa");
    let wet = settings(nylon, Pairing::find("other", true).expect("a pairing"));
    assert_eq!(wet.contact.friction_coefficient, 0.325);
    // Moduli of metal wires are known better.
    let wire = settings(Material::find("steel"), USUAL);
    assert_eq!(wire.uncertainty.youngs_modulus_std_pa, 0.0);
    assert!(wire.uncertainty.scatters());
}

#[test]
fn cups_and_cones_are_stated_in_degrees_and_diameters() {
    let texts = ["25", "0,5", "3", "10", "200", "1500", "0.3", "3000", "1"];
    let answers = |kind, angle: Option<f64>| {
        let mut answers = typed(texts);
        let reach = reach_m(kind, angle, [0.025, 0.010]);
        answers[SIZE] = Some(QUESTIONS[SIZE].answer("70", reach).expect("a size"));
        answers[ANGLE] = angle;
        answers
    };
    let read = |text: &str| {
        Document::parse(text, "brush.toml")
            .and_then(|file| file.settings())
            .expect("settings")
    };
    let cup = first_file(
        ToolKind::Cup,
        answers(ToolKind::Cup, None),
        None,
        USUAL,
        None,
        "brush.toml",
    )
    .expect("a cup");
    let settings = read(&cup.text);
    assert_eq!(
        (settings.tool.kind, settings.tool.body_radius_m),
        (ToolKind::Cup, 0.030),
        "35 mm less half of the width"
    );
    let FirstFile { text, note, .. } = cup;
    assert!(
        note.contains("so that there is no section [brush]") && !text.contains("\n[brush]"),
        "{text}"
    );
    assert!(
        text.contains("\n# The tips are 2.242 diameters apart")
            && text.contains("bristle simulate"),
        "{text}"
    );
    assert!(
        text.lines().all(|line| line.chars().count() <= 100),
        "{text}"
    );

    let angle = Some(30_f64.to_radians());
    let mut of_cone = answers(ToolKind::Cone, angle);
    let cone = first_file(ToolKind::Cone, of_cone, None, USUAL, None, "brush.toml")
        .expect("a cone")
        .text;
    assert!(
        cone.contains("\nfilament_angle_deg = 30.0 ") && cone.contains("\nkind = \"cone\" "),
        "{cone}"
    );
    let settings = read(&cone);
    assert!((settings.tool.tilt_rad() - 60_f64.to_radians()).abs() < 1e-12);
    let largest = Trim::of(&settings)
        .ends()
        .map(|s| Trim::of(&settings).tip(s)[0])
        .into_iter()
        .fold(0.0, f64::max);
    assert!((largest - 0.035).abs() < 1e-9, "{largest}");
    of_cone[ANGLE] = None;
    let missing = first_file(ToolKind::Cone, of_cone, None, USUAL, None, "brush.toml")
        .expect_err("no angle")
        .to_string();
    assert!(
        missing.contains("`tool.filament_angle_rad` is left out"),
        "{missing}"
    );

    // Rows of a tilted round brush differ.
    let mut tilted = typed(["40", "1,18", "3", "20", "360", "10500", "0.3", "1500", "4"]);
    tilted[TILT] = Some(0.1);
    let text = file(tilted, None).text;
    assert!(
        text.contains("\n[brush] ") && text.contains("\nends = \"free\" "),
        "{text}"
    );
}

#[test]
fn answers_are_read_as_people_type_them() {
    let question = |option: &str| {
        let mut questions = QUESTIONS.iter();
        questions
            .find(|question| question.option.starts_with(option))
            .expect(option)
    };
    for (option, text, expected) in [
        ("--diameter-mm", " 1,18 ", 1.18e-3),
        ("--diameter-mm", "600µm", 0.6e-3),
        ("--length-mm", "4 cm", 0.04),
        ("--youngs-modulus-gpa", "3310 N/mm²", 3.31e9),
        ("--filaments", "60 %", 0.6),
        ("--tool-diameter", "360", 0.14),
        ("--tool-diameter", "Diameter 280,5 mm", 0.10025),
        ("--tool-diameter", "body 280", 0.14),
        ("--tool-diameter", "Radius 14 cm", 0.14),
        ("--max-rpm", "20 Hz", 1200.0),
        ("--filament-angle", "90", std::f64::consts::FRAC_PI_2),
        ("--tilt-deg", "-90 °", -std::f64::consts::FRAC_PI_2),
    ] {
        assert_eq!(question(option).answer(text, 0.04), Ok(expected), "{text}");
    }
    for (option, text, part) in [
        (
            "--length-mm",
            "long",
            "is not a number: please type one, such as 4.5 or 4,5 mm",
        ),
        ("--length-mm", "1.2,3", "is not a number"),
        (
            "--length-mm",
            "4 in",
            "has another unit: please use m, mm, cm, µm",
        ),
        (
            "--length-mm",
            "-4",
            "`filament.length_m` is -0.004, but must be",
        ),
        (
            "--filaments",
            "10,500",
            "may separate decimals or thousands: write 10500 or 10.5",
        ),
        (
            "--filaments",
            "100 %",
            "has another unit: please use no unit, or below 100 %",
        ),
        (
            "--tool-diameter",
            "60",
            "`tool.body_radius_m` is -0.01, but must be",
        ),
        (
            "--tool-diameter",
            "60",
            "half the diameter over the filaments, less what they reach beyond the body",
        ),
        ("--tool-diameter", "", "is not a number"),
    ] {
        let problem = question(option).answer(text, 0.04).expect_err(text);
        assert!(problem.contains(part), "{text}: {problem}");
    }
    let slip = question("--diameter-mm").unusual(0.6).expect("unusual");
    assert!(
        slip.statement
            .contains("`filament.diameter_m` is 0.6 m; usually it is from 2e-5 to 0.005 m"),
        "{slip:?}"
    );
    assert_eq!(question("--filaments").unusual(0.6), None);
}
