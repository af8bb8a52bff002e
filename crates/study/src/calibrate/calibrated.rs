//! Text of `calibrated.toml`: the input file with the fitted values, their standard errors and
//! their correlations.

use crate::text::units::own_keys;
use toml_edit::{Array, DocumentMut, Item, Table, Value};

use crate::calibrate::Calibration;
use crate::calibrate::words::estimate;
use crate::text::number::rounded;

/// Significant digits of errors, correlations and misfit.
const DIGITS: usize = 6;

/// Section and key of the joint uncertainty of fitted settings.
const UNCERTAINTY: &str = "uncertainty";
const CALIBRATION: &str = "calibration";

/// Returns the text of an input file with the values of a calibration and those of the `options` of
/// `--set`. Comments and order stay. `moved` converts a path in the file to one from the place of
/// the new file.
///
/// # Errors
/// If the file or an option cannot be restated.
pub fn calibrated(
    text: &str,
    calibration: &Calibration,
    options: &[String],
    moved: &dyn Fn(&str) -> String,
) -> Result<String, String> {
    let mut document: DocumentMut = text
        .parse()
        .map_err(|error: toml_edit::TomlError| error.to_string())?;
    for option in options {
        restate(&mut document, option)?;
    }
    for (setting, fitted) in calibration.problem.fitted.iter().enumerate() {
        let (section, key) = (fitted.parameter.section(), fitted.parameter.key());
        let mut value = number(rounded_by_error(
            calibration.values[setting],
            calibration.standard_error(setting),
        ));
        value
            .decor_mut()
            .set_suffix(format!("  # {}, fitted", estimate(calibration, setting)));
        let table = section_of(&mut document, section)?;
        let others: Vec<&str> = fitted
            .parameter
            .group()
            .map(|same| same.key())
            .filter(|same| *same != key)
            .collect();
        others.into_iter().for_each(|other| remove(table, other));
        replace(table, key, value);
    }
    for (section, key) in [("measured", "file"), ("workpiece", "control_points_csv")] {
        if let Some(path) = document
            .get_mut(section)
            .and_then(|table| table.get_mut(key))
            && let Some(old) = path.as_str()
        {
            *path = toml_edit::value(moved(old));
        }
    }
    if calibration.problem.radii.is_some() {
        // Other commands take measured forces.
        document.remove("measured");
        return Ok(document.to_string());
    }
    let uncertainty = section_of(&mut document, UNCERTAINTY)?;
    uncertainty.insert(CALIBRATION, Item::Table(joint(calibration)));
    Ok(document.to_string())
}

/// Returns the joint uncertainty of the fitted settings.
fn joint(calibration: &Calibration) -> Table {
    let count = calibration.values.len();
    let numbers = |numbers: Vec<f64>| Value::Array(numbers.into_iter().collect::<Array>());
    let keys: Array = calibration
        .problem
        .fitted
        .iter()
        .map(|fitted| fitted.parameter.path)
        .collect();
    let errors = (0..count)
        .map(|setting| rounded(calibration.standard_error(setting), DIGITS))
        .collect();
    let row = |row: usize| {
        numbers(
            (0..count)
                .map(|column| rounded(calibration.errors.correlation(row, column), DIGITS))
                .collect(),
        )
    };
    let mut table = Table::new();
    table
        .decor_mut()
        .set_prefix("\n# What the measured forces leave open.\n");
    table.insert("settings", toml_edit::value(keys));
    table.insert("standard_errors", toml_edit::value(numbers(errors)));
    table.insert(
        "correlations",
        toml_edit::value((0..count).map(row).collect::<Array>()),
    );
    table.insert(
        "misfit",
        toml_edit::value(rounded(calibration.misfit(), DIGITS)),
    );
    table
}

/// Formats a number, with an exponent if it is small.
fn number(value: f64) -> Value {
    let small = Some(value).filter(|value| value.abs() < 1e-6 && *value != 0.0);
    small
        .and_then(|value| format!("{value:e}").parse().ok())
        .unwrap_or_else(|| Value::from(value))
}

/// Rounds a value to as many digits as its error asks for, and two more.
fn rounded_by_error(value: f64, error: f64) -> f64 {
    let digits = if error > 0.0 && value != 0.0 {
        (value.abs() / error).log10().floor().max(0.0) + 4.0
    } else {
        16.0
    };
    rounded(value, digits.min(16.0) as usize)
}

/// Returns the table of a section, new if there is none.
fn section_of<'a>(
    document: &'a mut DocumentMut,
    section: &str,
) -> Result<&'a mut dyn toml_edit::TableLike, String> {
    let item = document
        .entry(section)
        .or_insert_with(|| Item::Table(Table::new()));
    item.as_table_like_mut()
        .ok_or_else(|| format!("`{section}` is not a section"))
}

/// Removes a setting, in whatever unit it is stated.
fn remove(table: &mut dyn toml_edit::TableLike, key: &str) {
    let is_same = |written: &str| written == key || own_keys(written).any(|(own, _)| own == key);
    let stated: Vec<String> = table
        .iter()
        .map(|(written, _)| written.to_owned())
        .filter(|written| is_same(written))
        .collect();
    stated
        .iter()
        .for_each(|written| drop(table.remove(written)));
}

/// Replaces the value of a setting.
fn replace(table: &mut dyn toml_edit::TableLike, key: &str, value: Value) {
    if let Some(item) = table.get_mut(key) {
        *item = Item::Value(value);
        return;
    }
    remove(table, key);
    table.insert(key, Item::Value(value));
}

/// Puts the setting of an option into the file.
fn restate(document: &mut DocumentMut, option: &str) -> Result<(), String> {
    let refused = || {
        format!(
            "`--set {option}` cannot be restated in calibrated.toml: state it in the input file"
        )
    };
    let (path, value) = option.split_once('=').ok_or_else(refused)?;
    let (section, key) = path.trim().split_once('.').ok_or_else(refused)?;
    let key = key.trim_matches('"');
    if section == "study" && key.starts_with("tools.") {
        return Err(refused());
    }
    let value = value.trim();
    let value = value.parse().unwrap_or_else(|_| Value::from(value));
    let table = section_of(document, section)?;
    let own = own_keys(key)
        .next()
        .map_or_else(|| key.to_owned(), |(own, _)| own);
    remove(table, &own);
    table.insert(key, Item::Value(value));
    Ok(())
}
