//! Values of arguments that commands share.

use bristle::model::parameters::Parameter;

/// Parses a whole number within the range of the setting at `path`.
pub fn parse_count(text: &str, path: &str) -> Result<usize, String> {
    let parameter = Parameter::find(path).ok_or("no such setting")?;
    let allowed = || format!("must be {}", parameter.allowed());
    let count: usize = text.parse().map_err(|_| allowed())?;
    parameter.check(count as f64).map_err(|_| allowed())?;
    Ok(count)
}
