//! Compile time of the emitted source: `cargo bench --bench build_cost`.
//!
//! The functions are compiled for `f64` in a library of their own, optimised, as the solver's build compiles them.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use bristle_codegen::MAKER;
use bristle_codegen::back::rust::emit;
use bristle_codegen::back::source::{Origin, count_operations};
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::kernels::kernels;
use bristle_codegen::model::whole::{Purpose, whole_kernels};

/// A stand-in for the solver's scalar that costs the compiler the same. `S` is a call into the library.
const PRELUDE: &str = "
use std::ops::{Add, Div, Mul, Neg, Sub};
pub trait Real:
    Copy + std::fmt::Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    fn from_f64(value: f64) -> Self;
    fn sqrt(self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn asin(self) -> Self;
    fn less_than(self, other: Self) -> Self;
    fn half_angle_squared<const ORDER: u8>(u: Self) -> Self;
}
impl Real for f64 {
    fn from_f64(value: f64) -> Self { value }
    fn sqrt(self) -> Self { f64::sqrt(self) }
    fn sin(self) -> Self { f64::sin(self) }
    fn cos(self) -> Self { f64::cos(self) }
    fn asin(self) -> Self { f64::asin(self) }
    fn less_than(self, other: Self) -> Self { f64::from(u8::from(self < other)) }
    #[inline(never)]
    fn half_angle_squared<const ORDER: u8>(u: Self) -> Self { f64::acos(1.0 - u) + f64::from(ORDER) }
}
";

fn main() -> Result<(), Box<dyn Error>> {
    println!("{:24} {:>10} {:>9} {:>10}", "emitted source", "operations", "bytes", "compiled");
    report("kernels of the solver", &kernels()?)?;
    for segments in [5, 25] {
        report(
            &format!("whole equations, n = {segments}"),
            &whole_kernels(segments, Motion::Spatial, Purpose::Computing)?,
        )?;
    }
    Ok(())
}

fn report(name: &str, kernels: &[Kernel]) -> Result<(), Box<dyn Error>> {
    let emitted = emit(kernels, Origin { title: "A benchmark.", maker: MAKER, again: "cargo bench" })?;
    let operations: usize = kernels.iter().map(|kernel| count_operations(kernel).total()).sum();
    let seconds = compile(&format!("{PRELUDE}{emitted}{}", instances(kernels)))?;
    println!("{name:24} {operations:10} {:9} {seconds:8.2} s", emitted.len());
    Ok(())
}

/// A function for `f64` per kernel: the generic ones alone would not be compiled.
fn instances(kernels: &[Kernel]) -> String {
    let mut text = String::new();
    for Kernel { name, inputs, .. } in kernels {
        let parameters: Vec<String> = inputs
            .iter()
            .enumerate()
            .map(|(i, input)| match input.elements.len() {
                1 => format!("a{i}: f64"),
                length => format!("a{i}: [f64; {length}]"),
            })
            .collect();
        let arguments: Vec<String> = (0..inputs.len()).map(|i| format!("a{i}")).collect();
        let (parameters, arguments) = (parameters.join(", "), arguments.join(", "));
        writeln!(
            text,
            "#[inline(never)]\npub fn {name}_of_f64({parameters}) -> impl Sized {{ {name}::<f64>({arguments}) }}"
        )
        .expect("a string takes everything");
    }
    text
}

/// Time in s that the compiler takes for `source`.
fn compile(source: &str) -> Result<f64, Box<dyn Error>> {
    let directory = tempfile::tempdir()?;
    let file = directory.path().join("emitted.rs");
    std::fs::write(&file, source)?;
    let compiler = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into());
    let start = Instant::now();
    let output = Command::new(compiler)
        .args(["--edition", "2024", "-O", "--crate-type", "lib", "--out-dir"])
        .args([directory.path(), Path::new(&file)])
        .output()?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into());
    }
    Ok(start.elapsed().as_secs_f64())
}
