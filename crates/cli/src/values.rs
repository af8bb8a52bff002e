//! Values that commands share: arguments, and an exit status.

use std::fs;
use std::num::NonZeroUsize;

use bristle::model::parameters::Parameter;
use bristle_study::grid::Resources;
use bristle_study::input::cells::ambiguous;
use clap::Args;

/// Maximum number of threads.
const MAX_THREADS: u64 = 1024;

/// Exit status if Ctrl-C stopped a simulation. As in shells, it is 128 plus the number of the
/// signal.
pub const INTERRUPTED: u8 = 130;

/// The number of threads.
#[derive(Args)]
pub struct ThreadArgs {
    /// Number of threads [default: one per core]; does not change the results
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_THREADS))]
    threads: Option<u64>,
}

impl ThreadArgs {
    /// Returns the requested number.
    pub fn number(&self) -> Option<NonZeroUsize> {
        self.threads
            .and_then(|threads| NonZeroUsize::new(threads as usize))
    }
}

/// Resources of simulations.
#[derive(Args)]
pub struct ResourceArgs {
    #[command(flatten)]
    pub threads: ThreadArgs,
    #[command(flatten)]
    memory: MemoryArgs,
}

impl ResourceArgs {
    /// Returns threads and memory.
    pub fn resources(&self) -> Resources {
        Resources {
            threads: self.threads.number(),
            memory: Some(self.memory.limit()),
        }
    }
}

/// The memory that brushes may need.
#[derive(Args)]
pub struct MemoryArgs {
    /// Refuse brushes that need more memory than this [default: what is available; 4096 if the
    /// system does not say]
    #[arg(long = "memory", alias = "memory-mib", value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    memory_mib: Option<u64>,
}

impl MemoryArgs {
    /// Returns the limit in bytes.
    pub fn limit(&self) -> u64 {
        self.limit_with(fs::read_to_string("/proc/meminfo").ok().as_deref())
    }

    /// Returns the limit in bytes, from the text of `/proc/meminfo`, which only Linux has.
    fn limit_with(&self, meminfo: Option<&str>) -> u64 {
        self.memory_mib
            .map(|mebibytes| mebibytes << 20)
            .or_else(|| available_memory(meminfo?))
            .unwrap_or(UNKNOWN_MEMORY_MIB << 20)
    }
}

/// Limit where the system does not say how much memory is left: half of what a small machine has.
const UNKNOWN_MEMORY_MIB: u64 = 4096;

/// Returns the machine's available memory in bytes, from the text of `/proc/meminfo`.
fn available_memory(meminfo: &str) -> Option<u64> {
    let available = meminfo
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = available.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1 << 10)
}

/// Parses a number within the range of the setting at `path`.
pub fn parse_setting(text: &str, path: &str) -> Result<f64, String> {
    let parameter = Parameter::find(path).ok_or("no such setting")?;
    parse_if(
        text,
        |number| parameter.check(number).is_ok(),
        &parameter.allowed().to_string(),
    )
}

/// Parses a whole number within the range of the setting at `path`.
pub fn parse_count(text: &str, path: &str) -> Result<usize, String> {
    parse_setting(text, path).map(|count| count as usize)
}

/// Parses a positive number.
pub fn parse_positive(text: &str) -> Result<f64, String> {
    let is_positive = |number: f64| number > 0.0 && number.is_finite();
    parse_if(text, is_positive, "a positive number")
}

/// Parses a number that is `allowed`, in words. Its decimal point must not look like a thousands
/// separator.
pub fn parse_if(
    text: &str,
    is_allowed: impl Fn(f64) -> bool,
    allowed: &str,
) -> Result<f64, String> {
    if let Some(error) = ambiguous(text) {
        return Err(error);
    }
    text.parse()
        .ok()
        .filter(|number| is_allowed(*number))
        .ok_or_else(|| format!("must be {allowed}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_has_a_limit_on_every_system() {
        let limit = |memory_mib, meminfo| MemoryArgs { memory_mib }.limit_with(meminfo);
        let linux = Some("MemTotal: 16000000 kB\nMemAvailable:    8000000 kB\n");
        assert_eq!(limit(None, linux), 8_000_000 << 10);
        assert_eq!(limit(Some(17), linux), 17 << 20);
        // Without `/proc`, and where it has no such line.
        for meminfo in [None, Some(""), Some("MemAvailable: much\n")] {
            assert_eq!(limit(None, meminfo), 4096 << 20);
            assert_eq!(limit(Some(17), meminfo), 17 << 20);
        }
    }
}
