//! Values that commands share: of arguments, and an exit status.

use bristle::model::parameters::Parameter;

/// Largest number of threads.
pub const MAX_THREADS: u64 = 1024;

/// Exit status if Ctrl-C stopped a simulation. As in shells, it is 128 plus the number of the signal.
pub const INTERRUPTED: u8 = 130;

/// Parses a whole number within the range of the setting at `path`.
pub fn parse_count(text: &str, path: &str) -> Result<usize, String> {
    let parameter = Parameter::find(path).ok_or("no such setting")?;
    let allowed = || format!("must be {}", parameter.allowed());
    let count: usize = text.parse().map_err(|_| allowed())?;
    parameter.check(count as f64).map_err(|_| allowed())?;
    Ok(count)
}
