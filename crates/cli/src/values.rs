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

/// What simulations may use.
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
            memory: self.memory.limit(),
        }
    }
}

/// The memory that brushes may need.
#[derive(Args)]
pub struct MemoryArgs {
    /// Refuse brushes that need more memory than this [default: what is available, if the system
    /// says so]
    #[arg(long = "memory", alias = "memory-mib", value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    memory_mib: Option<u64>,
}

impl MemoryArgs {
    /// Returns the limit in bytes.
    pub fn limit(&self) -> Option<u64> {
        self.memory_mib
            .map(|mebibytes| mebibytes << 20)
            .or_else(available_memory)
    }
}

/// Returns the machine's available memory in bytes, where the system states it: on Linux.
fn available_memory() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let available = text
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
