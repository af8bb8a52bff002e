//! Section, key or name that is meant by one that is not known.

use crate::text::units::{NamedUnit, UNITS, without_unit};
use bristle::model::parameters::{PARAMETERS, Parameter};

use crate::input::units::setting;

/// Returns `true` if this is the name of a section of settings.
pub(super) fn is_section(name: &str) -> bool {
    PARAMETERS
        .iter()
        .any(|parameter| parameter.section() == name)
}

/// Least similarity (Jaro and Winkler, 0 to 1) at which a name may be a misspelling of another.
const MIN_SIMILARITY: f64 = 0.85;

/// Returns a hint at the name that is most similar to `written`. Empty if none is close.
pub(super) fn did_you_mean<'c>(written: &str, names: impl Iterator<Item = &'c str>) -> String {
    names
        .map(|name| (strsim::jaro_winkler(written, name), name))
        .max_by(|(left, _), (right, _)| left.total_cmp(right))
        .filter(|(similarity, name)| *similarity >= MIN_SIMILARITY && *name != written)
        .map_or_else(String::new, |(_, name)| format!("did you mean `{name}`?"))
}

/// Returns a hint at the setting whose key is most similar to the last part of `written`, or that
/// people call by this name. Empty if none is close. Keys in the wrong section are found, too.
pub fn setting_meant(written: &str) -> String {
    /// Similarity that a key of another section must have in addition.
    const OWN_SECTION: f64 = 0.1;
    let whole = written;
    let (section, written) = written.rsplit_once('.').unwrap_or(("", written));
    // Some settings have no symbol.
    if written.trim().is_empty() {
        return String::new();
    }
    // The name of a section is not a misspelling: the quotes around a dotted path are missing.
    if is_section(written) {
        return format!("a dotted path needs quotes, as in \"{written}.…\"");
    }
    let lower = written.to_lowercase();
    let called = |parameter: &Parameter| {
        let names = [Some(lower.as_str()), without_unit(&lower)];
        parameter.symbol == written
            || parameter.key() == lower
            || names
                .into_iter()
                .flatten()
                .any(|name| parameter.also.contains(&name))
    };
    let similarity = |parameter: &Parameter| {
        let similarity = if called(parameter) {
            1.0
        } else {
            strsim::jaro_winkler(&lower, parameter.key())
        };
        (similarity >= MIN_SIMILARITY).then(|| {
            similarity
                + if parameter.section() == section {
                    OWN_SECTION
                } else {
                    0.0
                }
        })
    };
    let close = PARAMETERS
        .iter()
        .filter_map(|parameter| Some((similarity(parameter)?, parameter)));
    // The first of equally similar settings.
    let meant = close
        .rev()
        .max_by(|(left, _), (right, _)| left.total_cmp(right));
    let Some((_, meant)) = meant.filter(|(_, meant)| meant.path != whole) else {
        return String::new();
    };
    // In the unit that was written, if the setting can be stated in it.
    let in_unit = |unit: &NamedUnit| {
        lower
            .ends_with(unit.suffix)
            .then(|| unit.key_of(meant.path))
            .flatten()
    };
    let is_meant =
        |path: &String| setting(path).is_some_and(|(found, _)| std::ptr::eq(found, meant));
    let path = UNITS
        .iter()
        .filter_map(in_unit)
        .find(is_meant)
        .unwrap_or_else(|| meant.path.to_owned());
    format!("did you mean `{path}`?")
}
