//! Derives the kernels and writes them as Rust to `OUT_DIR/kernels.rs`, and the power series that
//! they need to `series.rs`.
//!
//! `BRISTLE_DERIVATION` chooses the engine: `built-in` (the default) needs nothing but Rust;
//! `casadi` runs `derivations/segment_chain.py` with the Python of `BRISTLE_PYTHON` (default
//! `python3`).

use std::env::{self, VarError};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use bristle_codegen::MAKER;
use bristle_codegen::back::json;
use bristle_codegen::back::languages::rust::emit;
use bristle_codegen::back::source::Origin;
use bristle_codegen::compare::{Deviation, States, TOLERANCE, compare};
use bristle_codegen::fingerprint::{code, digest, sources};
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::ir::special::{SERIES, SERIES_LIMIT, TERMS};
use bristle_codegen::model::kernels::kernels;

/// Derivation in CasADi.
const SCRIPT: &str = "derivations/segment_chain.py";
/// Python packages that [`SCRIPT`] needs.
const REQUIREMENTS: &str = "derivations/requirements.txt";
/// Files on which its graph depends, except Python itself.
const SOURCES: [&str; 12] = [
    SCRIPT,
    "derivations/casadi_chain/__init__.py",
    "derivations/casadi_chain/energies.py",
    "derivations/casadi_chain/export.py",
    "derivations/casadi_chain/expressions.py",
    "derivations/casadi_chain/joints.py",
    "derivations/casadi_chain/lateral.py",
    "derivations/casadi_chain/operators.py",
    "derivations/casadi_chain/segments.py",
    "derivations/casadi_chain/whole.py",
    "derivations/graph_format.py",
    REQUIREMENTS,
];

fn main() -> ExitCode {
    match generate() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Like Cargo's own errors, without the backtrace of a panic.
            for line in error.to_string().lines() {
                println!("cargo::error={line}");
            }
            ExitCode::FAILURE
        }
    }
}

fn generate() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-env-changed=BRISTLE_DERIVATION");
    let directory = PathBuf::from(env::var("OUT_DIR")?);
    let derivation = variable("BRISTLE_DERIVATION")?.unwrap_or_default();
    let (kernels, maker, again, engine) = match derivation.as_str() {
        "" | "built-in" => (kernels()?, MAKER.into(), "cargo build", "built-in"),
        "casadi" => {
            let (kernels, maker) = casadi_kernels(&directory)?;
            let again = "BRISTLE_DERIVATION=casadi cargo build";
            (kernels, maker, again, "CasADi")
        }
        other => {
            return Err(format!(
                "BRISTLE_DERIVATION is `{other}`; it must be `built-in` or `casadi`"
            )
            .into());
        }
    };
    let source = emit(
        &kernels,
        Origin {
            title: "Kernels of the solver.",
            maker: &maker,
            again,
        },
    )?;
    fs::write(directory.join("kernels.rs"), &source)?;
    let series = series();
    fs::write(directory.join("series.rs"), &series)?;
    // The information in the header, for `bristle::equations`.
    println!(
        "cargo::rustc-env=BRISTLE_FINGERPRINT={}",
        json::fingerprint(&kernels)?
    );
    println!(
        "cargo::rustc-env=BRISTLE_SOLVER={}",
        solver_fingerprint(&[&source, &series])?
    );
    println!("cargo::rustc-env=BRISTLE_ENGINE={engine}");
    println!(
        "cargo::rustc-env=BRISTLE_MAKER={}",
        maker.lines().next().unwrap_or_default()
    );
    Ok(())
}

/// Returns the power series of the spring's energy and its derivatives as Rust constants.
fn series() -> String {
    // `Debug` prints the fewest digits that read back as the same number.
    format!(
        "/// Below this `u` the series is summed; above it the closed form is accurate.\n\
         pub const SERIES_LIMIT: f64 = {SERIES_LIMIT:?};\n\
         /// Terms of each series.\n\
         pub const TERMS: usize = {TERMS};\n\
         /// Power series of `S`, `S′`, `S″`, `S‴`, lowest power first.\n\
         pub const SERIES: [[f64; TERMS]; {}] = {SERIES:?};\n",
        SERIES.len()
    )
}

/// Packages whose versions affect results.
const NUMERICAL_PACKAGES: [&str; 3] = ["fastrand", "pulp", "spec_math"];

/// Returns a hash of the code that turns settings into metrics. The journal of a study uses it to
/// detect results of another build.
///
/// The version alone does not change during development. The engine does not matter: the kernels
/// themselves are hashed.
fn solver_fingerprint(generated: &[&str]) -> Result<String, Box<dyn Error>> {
    let code = code("src", "Cargo.lock", &NUMERICAL_PACKAGES)?;
    Ok(digest((generated.concat() + &code).as_bytes()))
}

/// Number of states at which the kernels are compared with the built-in ones.
const STATES: usize = 20;

/// Returns an environment variable, `None` if it is not set.
fn variable(name: &str) -> Result<Option<String>, String> {
    match env::var(name) {
        Ok(value) => Ok(Some(value)),
        Err(VarError::NotPresent) => Ok(None),
        Err(VarError::NotUnicode(value)) => Err(format!("{name} is {value:?}, which is not text")),
    }
}

/// Returns the kernels that CasADi derives, and the name of their generator.
///
/// The graph is stored under a hash of its inputs, so that an unchanged derivation is not run
/// again.
fn casadi_kernels(directory: &Path) -> Result<(Vec<Kernel>, String), Box<dyn Error>> {
    for input in SOURCES {
        println!("cargo::rerun-if-changed={input}");
    }
    println!("cargo::rerun-if-env-changed=BRISTLE_PYTHON");
    let python = variable("BRISTLE_PYTHON")?
        .filter(|path| !path.is_empty())
        .unwrap_or_else(|| "python3".into());
    let inputs = digest(format!("{python} {}", sources(&SOURCES)?).as_bytes());
    let graph = directory.join(format!("casadi-{inputs}.json"));
    let cached = fs::read_to_string(&graph)
        .ok()
        .and_then(|text| json::from_json(&text).ok());
    let mut file = match cached {
        Some(file) => file,
        None => {
            derive(&python, &graph)?;
            let text = fs::read_to_string(&graph)?;
            json::from_json(&text)
                .map_err(|error| format!("the graph that {SCRIPT} has written: {error}"))?
        }
    };
    let built_in = kernels()?;
    let deviations =
        compare(&built_in, &file.kernels, STATES, States::All, 1).map_err(|error| {
            format!("{SCRIPT} derives other kernels than the solver needs: {error}")
        })?;
    for Deviation {
        kernel,
        output,
        largest,
        ..
    } in deviations
    {
        if largest > TOLERANCE {
            // Not an error: after changing the model in one derivation, you may want to try it
            // first.
            println!(
                "cargo::warning={output} of {kernel} deviates by {largest:.1e} from the built-in derivation"
            );
        }
    }
    // The file does not state which arguments are structures.
    for (kernel, expected) in file.kernels.iter_mut().zip(built_in) {
        for (input, expected) in kernel.inputs.iter_mut().zip(expected.inputs) {
            input.place = expected.place;
        }
    }
    Ok((file.kernels, file.generator))
}

/// Runs the derivation, which writes `graph`.
fn derive(python: &str, graph: &Path) -> Result<(), String> {
    let help = format!(
        "help: install what the derivation needs with\n    \
         {python} -m pip install -r {REQUIREMENTS}\n\
         or set BRISTLE_PYTHON to a Python that has it; \
         without BRISTLE_DERIVATION the built-in derivation is used, which needs no Python"
    );
    let output = Command::new(python)
        .args([SCRIPT, "--kernels", "--out"])
        .arg(graph)
        .output()
        .map_err(|error| {
            format!("cannot run `{python}` for BRISTLE_DERIVATION=casadi: {error}\n{help}")
        })?;
    if output.status.success() {
        return Ok(());
    }
    let message = String::from_utf8_lossy(&output.stderr);
    Err(format!(
        "`{python} {SCRIPT} --kernels` failed ({}):\n{}\n{help}",
        output.status,
        message.trim_end()
    ))
}
