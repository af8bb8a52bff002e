//! Tests of tables of measurements as laboratories write them.

use super::*;
use crate::input::columns::unit_in;
use crate::input::table::MAX_ROWS;

const HEADING: &str = "brushing_velocity_m_s,penetration_depth_m,force_n,std_n\n";

fn read(text: &str) -> Result<Vec<Measurement>, DataError> {
    read_measured(text, "forces.csv", &TableFormat::default())
}

fn refusal(text: &str, format: &TableFormat) -> String {
    read_measured(text, "forces.csv", format)
        .expect_err("refused")
        .to_string()
}

fn point(velocity: f64, penetration_depth_m: f64, force_n: f64, std_n: f64) -> Measurement {
    let speed = Speed::Velocity(velocity);
    Measurement {
        speed,
        second_speed_rpm: None,
        penetration_depth_m,
        force_n,
        std_n: Some(std_n),
        tool: None,
    }
}

/// Returns a format with columns, each by its heading and its unit if one is stated.
fn format(columns: &[(Quantity, &str, Option<&str>)]) -> TableFormat {
    let column = |&(quantity, heading, unit): &(Quantity, &str, Option<&str>)| {
        let unit = unit.map(|name| quantity.unit(name).expect("a unit"));
        (
            quantity,
            ColumnName {
                heading: heading.to_owned(),
                unit,
            },
        )
    };
    TableFormat {
        columns: columns.iter().map(column).collect(),
        ..TableFormat::default()
    }
}

#[test]
fn points_have_the_tools_that_they_were_measured_with() {
    let tools: Vec<String> = ["fine", "steel, short"].map(str::to_owned).into();
    let format = |tool: Option<&str>| TableFormat {
        tools: tools.clone(),
        tool: tool.map(str::to_owned),
        ..TableFormat::default()
    };
    let text = "tool,brushing_velocity_m_s,penetration_depth_m,force_n,std_n\n\
         fine,10.0,0.001,5.0,0.5\n\"steel, short\",10.0,0.001,7.0,\n";
    let points = read_measured(text, "forces.csv", &format(None)).expect("a table");
    let found: Vec<_> = points
        .iter()
        .map(|point| (point.tool, point.std_n))
        .collect();
    assert_eq!(found, [(Some(0), Some(0.5)), (Some(1), None)]);
    assert_eq!(measured_text(&points, &tools), text);
    // Where tools are not compared, the column has no effect, and points are given twice.
    assert!(
        refusal(text, &TableFormat::default()).contains("the same velocity and depth as in line 2")
    );
    let other = text.replace("tool,", "Bürste,");
    assert_eq!(
        read_measured(&other, "forces.csv", &format(Some("Bürste"))),
        Ok(points)
    );
    assert!(refusal(&other, &format(None)).contains("the same velocity and depth"));
    let unknown = refusal(&text.replace("fine,", "coarse,"), &format(None));
    assert!(
        unknown.starts_with(
            "forces.csv:2, column tool: `coarse` is none of the tools fine, steel, short"
        ),
        "{unknown}"
    );
    let twice = refusal(&text.replace("\"steel, short\"", "fine"), &format(None));
    assert!(
        twice.contains("the same tool, velocity and depth as in line 2"),
        "{twice}"
    );
}

#[test]
fn tables_of_laboratories_are_read_in_their_units() {
    use Quantity::{Depth, Force, RotationalSpeed, Std, Velocity};
    let rotational = |speed: f64, depth, force_n, std_n| Measurement {
        speed: Speed::Rotational(speed),
        ..point(0.0, depth, force_n, std_n)
    };
    let named = format(&[
        (RotationalSpeed, "Drehzahl [1/min]", None),
        (Depth, "ae [mm]", None),
        (Force, "Fz [kN]", None),
        (Std, "s [N]", None),
    ]);
    let text = "\u{feff}Nr.;Drehzahl [1/min];ae [mm];Fz [kN];s [N]\r\n1;600;0,5;0,125;4,5\r\n2;1200;1;0,25;3\r\n";
    let expected = vec![
        rotational(600.0, 0.5e-3, 125.0, 4.5),
        rotational(1200.0, 1e-3, 250.0, 3.0),
    ];
    let tabs = text.replace(';', "\t");
    let points = tabs.replace(',', ".").replace('\t', ",");
    for text in [text, &tabs, &points] {
        assert_eq!(
            read_measured(text, "forces.csv", &named).as_ref(),
            Ok(&expected),
            "{text}"
        );
    }
    // Units in the input file, and none for what is not named; without a standard deviation.
    let stated = format(&[
        (Velocity, "v", Some("m/min")),
        (Depth, "ae", Some("µm")),
        (Force, "F", None),
    ]);
    let text = "v\tae\tF\n600\t500\t125\n";
    let expected = Measurement {
        std_n: None,
        ..point(10.0, 0.5e-3, 125.0, 0.0)
    };
    assert_eq!(
        read_measured(text, "forces.csv", &stated),
        Ok(vec![expected])
    );
    // Keys in other units.
    let text = "brushing_velocity_m_min,penetration_depth_um,force_kn\n600,500,0.125\n";
    assert_eq!(read(text), Ok(vec![expected]));
    for heading in ["Fz [N]", "Fz (N)", "Fz / N", "Fz in N"] {
        assert_eq!(unit_in(heading), Some("N"), "{heading}");
    }
    assert_eq!((unit_in("v / m/s"), unit_in("Fz")), (Some("m/s"), None));
}

#[test]
fn the_text_of_points_is_read_to_the_bit() {
    let velocities = vec![
        point(10.0 / 3.0, 1e-3 / 7.0, -1.1, 0.1),
        point(20.0, 1e-3, 2.0, 0.0),
    ];
    let unsure = Measurement {
        speed: Speed::Rotational(600.1),
        std_n: None,
        ..velocities[0]
    };
    for points in [velocities, vec![unsure]] {
        assert_eq!(read(&measured_text(&points, &[])), Ok(points));
    }
}

#[test]
fn lines_are_those_of_the_file() {
    let named = format(&[
        (Quantity::RotationalSpeed, "n [1/min]", None),
        (Quantity::Depth, "ae [mm]", None),
        (Quantity::Force, "Fz [N]", None),
    ]);
    let rows = "n [1/min];ae [mm];Fz [N]\n600;1,0;8,5\n\n;;\n1200;x;16,2\n";
    for (text, line) in [
        (rows.to_owned(), 5),
        (rows.replace('\n', "\r\n"), 5),
        (rows.replace("\n\n;;", ""), 3),
        (rows.replace("\n\n;;", "").replace('\n', "\r\n"), 3),
        (format!("sep=;\r\n{rows}"), 6),
    ] {
        let expected = format!("forces.csv:{line}, column ae [mm]: `x` is not a finite number");
        let message = refusal(&text, &named);
        assert!(message.starts_with(&expected), "{text:?}: {message}");
        // Rows without any cell are no points.
        let points = read_measured(&text.replace('x', "2,0"), "forces.csv", &named);
        let lines: Vec<f64> = points
            .expect("a table")
            .iter()
            .map(|point| point.force_n)
            .collect();
        assert_eq!(lines, [8.5, 16.2], "{text:?}");
    }
    let unit = refusal("sep=;\nn [1/min];ae [mm];Fz [lbf]\n600;1;8\n", &{
        let mut lbf = named.clone();
        lbf.columns[2].1.heading = "Fz [lbf]".to_owned();
        lbf
    });
    assert!(
        unit.starts_with("forces.csv:2, column Fz [lbf]: the unit"),
        "{unit}"
    );
    let short = refusal(&rows.replace("600;1,0;8,5", "600;1,0"), &named);
    assert!(
        short.starts_with("forces.csv:2: 2 cells, but the heading has 3"),
        "{short}"
    );
}

#[test]
fn headings_are_found_as_spreadsheets_write_them() {
    let named = format(&[
        (Quantity::Velocity, "v [m/s]", None),
        (Quantity::Depth, "a e [µm]", None),
        (Quantity::Force, "F", None),
        (Quantity::Std, "s", None),
    ]);
    let expected = vec![Measurement {
        std_n: None,
        ..point(10.0, 5e-4, 5.0, 0.0)
    }];
    for heading in [
        "v [m/s];a e [µm];F;s",
        "v [m/s];a\u{a0}e [\u{3bc}m];F;s",
        "\"v\n[m/s]\";\"a e\r\n[µm]\";F;s",
    ] {
        let text = format!("{heading}\n10;500;5;NaN\n");
        assert_eq!(
            read_measured(&text, "forces.csv", &named).as_ref(),
            Ok(&expected),
            "{text}"
        );
    }
    let refused = |above: &str, below: &str| {
        let text = format!("{above}v [m/s];a e [µm];F;s\n{below}10;500;5;0\n");
        refusal(&text, &named)
    };
    let title = refused("Measurement;7\nOperator;Somebody\n\n", "");
    assert!(
        title.contains("the headings are in line 4, below other lines"),
        "{title}"
    );
    let units = refused("", "m/s;µm;N;N\n");
    assert!(
        units.starts_with("forces.csv:2, column v [m/s]: `m/s` is a unit"),
        "{units}"
    );
}

#[test]
fn decimal_commas_are_recognised_unless_they_may_be_others() {
    let semicolons = HEADING.replace(',', ";");
    assert_eq!(
        read(&format!("{semicolons}10,5;1e-3;1,234;0\n")),
        Ok(vec![point(10.5, 1e-3, 1.234, 0.0)])
    );
    assert_eq!(
        read(&format!("{semicolons}10;1;1,234;0\n")),
        Ok(vec![point(10.0, 1.0, 1.234, 0.0)])
    );
    assert_eq!(
        read(&format!("{HEADING}\"10,5\",1,5,0\n")),
        Ok(vec![point(10.5, 1.0, 5.0, 0.0)])
    );
    let thousands = format!("{HEADING}10,1,\"1,234\",0\n");
    let message = refusal(&thousands, &TableFormat::default());
    assert!(
        message.contains("column force_n: the comma of `1,234` may separate decimals or thousands"),
        "{message}"
    );
    let stated = TableFormat {
        decimal: Some(','),
        ..TableFormat::default()
    };
    assert_eq!(
        read_measured(&thousands, "forces.csv", &stated),
        Ok(vec![point(10.0, 1.0, 1.234, 0.0)])
    );
    // With semicolons between cells, points may separate thousands.
    let thousands = format!("{semicolons}10;1;1.000;0\n20;1;1.250;0\n");
    let message = refusal(&thousands, &TableFormat::default());
    assert!(
        message.starts_with("forces.csv:2, column force_n: the point of `1.000` may separate"),
        "{message}"
    );
    assert!(message.contains("decimal = \",\""), "{message}");
    let point_stated = TableFormat {
        decimal: Some('.'),
        ..TableFormat::default()
    };
    let decimals = vec![point(10.0, 1.0, 1.0, 0.0), point(20.0, 1.0, 1.25, 0.0)];
    assert_eq!(
        read_measured(&thousands, "forces.csv", &point_stated),
        Ok(decimals.clone())
    );
    let message = refusal(&thousands, &stated);
    assert!(
        message.contains("`1.000` is not a finite number with a decimal comma"),
        "{message}"
    );
    // Any number that cannot have thousands settles it, and so do commas between cells.
    let settled = read(&format!("{semicolons}10;1;1.000;0\n20;1;1.25;0\n"));
    assert_eq!(settled, Ok(decimals.clone()));
    assert_eq!(
        read(&format!("{HEADING}10,1,1.000,0\n20,1,1.250,0\n")),
        Ok(decimals)
    );
    let mixed = refusal(
        &format!("{semicolons}10,5;1;1.5;0\n"),
        &TableFormat::default(),
    );
    assert!(mixed.contains("`10,5` is not a finite number\n"), "{mixed}");
    let mixed = refusal(&format!("{semicolons}10,5;1;1.5;0\n"), &stated);
    assert!(
        mixed.contains("`1.5` is not a finite number with a decimal comma\n"),
        "{mixed}"
    );
}

#[test]
fn columns_that_are_missing_or_have_unknown_units_are_refused() {
    let force = |heading: &str| format(&[(Quantity::Force, heading, None)]);
    let text = HEADING.replace("force_n", "Fz [lbf]") + "10,1,1,0\n";
    let twice = HEADING.replace("std_n", "force_kn") + "10,1,1,1\n";
    for (text, format, part) in [
        (
            text.as_str(),
            force("Fz [lbf]"),
            "column Fz [lbf]: the unit `lbf` is none of N, kN, mN\n",
        ),
        (
            &text,
            force("Fz"),
            "there is no column `Fz`; there are `brushing_velocity_m_s`",
        ),
        (
            "v;F\n1;2\n",
            TableFormat::default(),
            "there is no column `brushing_velocity_m_s`; there are `v`, `F`",
        ),
        (
            "v;F\n1;2\n",
            TableFormat::default(),
            "columns.penetration_depth_m = \"…\"",
        ),
        // Headings that tell nothing.
        (
            "a;b\n1;2\n",
            TableFormat::default(),
            "columns.penetration_depth_m = \"ae [mm]\"",
        ),
        (
            &twice,
            TableFormat::default(),
            "the columns `force_n` and `force_kn` state the same",
        ),
    ] {
        let message = refusal(text, &format);
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn equal_points_are_found_wherever_they_are() {
    let table = |rows: &str| read(&format!("{HEADING}{rows}"));
    let error = |rows: &str| table(rows).expect_err("refused").to_string();
    // From cell to cell and across powers of two.
    for number in (-2000..2000).step_by(7) {
        let (velocity, depth) = (f64::from(number) * 0.1137, f64::from(number) * -0.0713);
        let [velocity, depth] = [velocity, depth].map(f64::exp);
        let rows = |relative: f64| {
            let [fast, deep] = [velocity * (1.0 + relative), depth * (1.0 - relative)];
            format!("7,3,0,0\n{velocity:?},{depth:?},1,1\n{fast:?},{deep:?},1,1\n")
        };
        let expected =
            "forces.csv:4, column brushing_velocity_m_s: the same velocity and depth as in line 3";
        assert!(error(&rows(0.9e-9)).starts_with(expected));
        assert!(table(&rows(1.1e-9)).is_ok());
    }
}

/// Reading took a minute when each point was compared with all others.
#[test]
fn points_are_compared_with_few_others() {
    let (mut places, mut points) = (Places::default(), Vec::new());
    for index in 0..20_000_u16 {
        let point = MeasuredPoint {
            speed: Speed::Velocity(f64::from(index % 1000) + 1.5),
            second_speed_rpm: None,
            penetration_depth_m: f64::from(index / 1000 + 1) * 1e-6,
            readings: [None; 4],
            tool: None,
            line: 0,
        };
        assert_eq!(places.take(&points, point), None);
        points.push(point);
    }
    assert!(
        places.0.values().all(|positions| positions.len() == 1),
        "different points share a cell"
    );
}

#[test]
fn long_tables_are_refused() {
    let rows = |count: usize| {
        let row =
            |index: usize| format!("{}.5,{}e-6,1.0,0.1\n", index % 1000 + 1, index / 1000 + 1);
        (0..count).fold(HEADING.to_owned(), |text, index| text + &row(index))
    };
    assert_eq!(read(&rows(20_000)).expect("points").len(), 20_000);
    let error = read(&rows(MAX_ROWS + 1)).expect_err("too many").to_string();
    assert!(
        error.starts_with("forces.csv:1000002: more than 1000000 rows"),
        "{error}"
    );
    let wide = format!("{HEADING}1,1,1,1\n{}", ",".repeat(100_000));
    let error = read(&wide).expect_err("too wide").to_string();
    assert!(
        error.starts_with("forces.csv:3: a line of more than 65536 bytes"),
        "{error}"
    );
}

#[test]
fn forces_beyond_the_limit_are_refused() {
    for force in ["1e101", "-1e308", "1e400", "NaN"] {
        let error = read(&format!("{HEADING}1,1,{force},0\n"))
            .expect_err("too large")
            .to_string();
        assert!(error.starts_with("forces.csv:2, column force_n"), "{error}");
    }
}

#[test]
fn radii_over_time_are_read_as_laboratories_write_them() {
    let radius = |brushed: Brushed, value: f64, std: Option<f64>, line: u64| MeasuredRadius {
        brushed,
        radius: Reading { value, std },
        line,
    };
    use Quantity::{EdgeRadius, EdgeRadiusStd, Time, Turns};
    let named = format(&[
        (Time, "t [min]", None),
        (EdgeRadius, "R [µm]", None),
        (EdgeRadiusStd, "s", Some("mm")),
    ]);
    let text = "Nr.;t [min];R [µm];s\n1;0;20;0,002\n2;1,5;62,5;\n";
    let relative = TableFormat {
        relative_std: Some(0.02),
        ..named.clone()
    };
    let expected = vec![
        radius(Brushed::Time(0.0), 20e-6, Some(2e-6), 2),
        radius(Brushed::Time(90.0), 62.5e-6, Some(0.02 * 62.5e-6), 3),
    ];
    assert_eq!(read_radii(text, "radii.csv", &relative), Ok(expected));
    // Keys, in other units; turns in the place of the time.
    for (heading, brushed) in [
        ("time_s", Brushed::Time(2.0)),
        ("time_h", Brushed::Time(7200.0)),
        ("turns", Brushed::Turns(2.0)),
    ] {
        let text = format!("{heading},edge_radius_mm\n2,0.1\n");
        let expected = vec![radius(brushed, 0.1e-3, None, 2)];
        assert_eq!(
            read_radii(&text, "radii.csv", &TableFormat::default()),
            Ok(expected)
        );
    }
    let turns = format(&[(Turns, "n", None)]);
    assert!(read_radii("n,edge_radius_m\n2,0.1\n", "radii.csv", &turns).is_ok());
    let refused = |text: &str| {
        read_radii(text, "radii.csv", &TableFormat::default())
            .expect_err("refused")
            .to_string()
    };
    let rows = |rows: &str| refused(&format!("time_s,edge_radius_m\n{rows}"));
    assert!(
        rows("2,1e-4\n2,2e-4\n")
            .starts_with("radii.csv:3, column time_s: this is not after the row above")
    );
    assert!(rows("-1,1e-4\n").starts_with("radii.csv:2, column time_s: `-1` must be at least 0"));
    assert!(
        rows("1,0\n").starts_with("radii.csv:2, column edge_radius_m: `0` must be greater than 0")
    );
    assert!(rows("").contains("there is no radius below the heading"));
    let missing = refused("time_s,R\n1,2\n");
    assert!(
        missing.contains("no column `edge_radius_m`") && missing.contains("columns.edge_radius_m"),
        "{missing}"
    );
    // A study has no use for radii.
    let other = read("time_s,edge_radius_m\n1,1e-4\n")
        .expect_err("no forces")
        .to_string();
    assert!(
        other.contains("radii of an edge, not forces") && other.contains("removal.preston_m2_n"),
        "{other}"
    );
}

#[test]
fn columns_of_one_name_are_refused_with_their_numbers() {
    let text = "force_n,brushing_velocity_m_s,date,force_n,penetration_depth_m,std_n,date\n1,1,1,1,1,1,1\n";
    let error = read(text).expect_err("two columns of forces").to_string();
    assert!(
        error.starts_with("forces.csv:1: columns 1 and 4 are both named `force_n`\n"),
        "{error}"
    );
    assert!(
        read(&text.replacen("force_n", "old", 1)).is_ok(),
        "other columns are ignored"
    );
}

#[test]
fn tables_may_have_further_columns_and_a_byte_order_mark() {
    let text = "\u{feff}force_n, std_n, date, penetration_depth_m, brushing_velocity_m_s\r\n1.5,0,now,2e-3,5\r\n";
    assert_eq!(read(text), Ok(vec![point(5.0, 2e-3, 1.5, 0.0)]));
    let both = text
        .replace("date", "rotational_speed_rpm")
        .replace("now", "300");
    let both = read(&both).expect("a table");
    assert_eq!(
        both,
        [Measurement {
            second_speed_rpm: Some(300.0),
            ..point(5.0, 2e-3, 1.5, 0.0)
        }]
    );
    // The velocity counts, and is kept.
    assert_eq!(
        read(&measured_text(&both, &[])),
        Ok(vec![point(5.0, 2e-3, 1.5, 0.0)])
    );
}
