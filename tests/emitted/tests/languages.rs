//! Is it right in every language? The emitted sources are run by their compilers and interpreters,
//! and agree with Rust.
//!
//! C and Rust on `f64` are always run on Unix. Octave and Python are run where the environment
//! variables `BRISTLE_TEST_OCTAVE` and `BRISTLE_TEST_PYTHON` name their programs; Python needs
//! NumPy and SymPy.

use std::collections::HashMap;
use std::env;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

use bristle::model::filament;
use bristle::model::settings::{FilamentSettings, Settings};
use bristle::tool::radial_clamp;
use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::kernel::{Kernel, Output, OutputShape};
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::lagrange::whole_equations;
use bristle_emitted::catalogue::{self, COVERAGE};
use bristle_emitted::chains::{self, CHAINS};
use bristle_emitted::{emitted, whole};
use bristle_equations::evaluation::{RoundToolState, evaluate, symbol_values};
use bristle_equations::languages::{SourceFile, c, matlab, numpy, rust, sympy};
use fastrand::Rng;
use tempfile::TempDir;

#[path = "languages/names.rs"]
mod names;

const ORIGIN: Origin<'_> = Origin {
    title: "A test.",
    maker: "a test",
    again: "cargo test",
};

/// Number of states at which each set of functions is compared, and number for SymPy, which
/// evaluates without compiling.
const STATES: usize = 1000;
const STATES_OF_SYMPY: usize = 3;

/// Largest deviation from Rust, relative to the largest value of the same function at the same
/// state. Sines differ in their last bits.
const TOLERANCE: f64 = 1e-12;

/// Prefix and numbers of segments of the chains that `bristle evaluate` evaluates, number of
/// states, and largest deviation, relative as above.
const EVALUATE: &str = "evaluate ";
const EVALUATED: [usize; 3] = [1, 3, 7];
const STATES_OF_EVALUATE: usize = 100;
const TOLERANCE_OF_EVALUATE: f64 = 1e-13;

/// Functions with the same inputs, the states at which they are compared, and their values there.
struct FunctionSamples {
    name: String,
    kernels: Vec<Kernel>,
    /// The names of the elements of a state.
    symbols: Vec<String>,
    tolerance: f64,
    states: Vec<Vec<f64>>,
    values: Vec<Vec<f64>>,
}

impl FunctionSamples {
    fn new(name: &str, kernels: Vec<Kernel>, values: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        let mut rng = Rng::with_seed(21);
        let states: Vec<Vec<f64>> = (0..STATES)
            .map(|_| chains::state(&kernels[0], &mut rng))
            .collect();
        let values = states.iter().map(|state| values(state)).collect();
        Self {
            name: name.into(),
            symbols: elements(&kernels[0]),
            kernels,
            tolerance: TOLERANCE,
            states,
            values,
        }
    }

    /// A chain in space, with the numbers of `bristle evaluate`.
    fn evaluated(segments: usize) -> Self {
        let kernels = chains::kernels(segments, Motion::Spatial);
        let symbols = elements(&kernels[0]);
        let (settings, whole) = (
            Settings::paper(10.0, 1e-3),
            whole_equations(segments, Motion::Spatial),
        );
        let filament = FilamentSettings {
            segments,
            ..settings.filament
        };
        let radius = 0.1;
        let mut rng = Rng::with_seed(22);
        let mut between = |start: f64, end: f64| start + rng.f64() * (end - start);
        let (mut states, mut values) = (Vec::new(), Vec::new());
        for _ in 0..STATES_OF_EVALUATE {
            let [base_angle, base_rate] = [between(-2.0, -1.0), between(50.0, 150.0)];
            let (mut q, mut v) = (Vec::new(), Vec::new());
            for _ in 0..segments {
                q.push([between(1.2, 1.9), base_angle + between(-0.3, 0.3)]);
                v.push([between(-50.0, 50.0), base_rate + between(-50.0, 50.0)]);
            }
            let state = RoundToolState {
                base_angle,
                base_rate,
                base_acceleration: between(-100.0, 100.0),
                gravity: [0.0, -9.81, 0.0],
                q: q.as_flattened().to_vec(),
                v: v.as_flattened().to_vec(),
            };
            let chain = filament::chain(&filament, state.gravity);
            let clamp = radial_clamp(radius, base_angle, base_rate, state.base_acceleration);
            let point = symbol_values(&whole, &chain, &clamp, &q, &v);
            let named: HashMap<&str, f64> = (whole.graph.symbols().iter())
                .map(|symbol| symbol.name.as_str())
                .zip(point.iter().copied())
                .collect();
            states.push(symbols.iter().map(|name| named[name.as_str()]).collect());
            let evaluation = evaluate(&filament, radius, &state).expect("the state is regular");
            let product = |row: &Vec<f64>| {
                let terms = row.iter().zip(&evaluation.accelerations);
                terms.map(|(a, b)| a * b).sum::<f64>()
            };
            let gravity = whole.graph.evaluate(&point)[whole.gravity_energy.index()];
            let mut numbers = evaluation.mass_matrix.concat();
            numbers.extend(evaluation.mass_matrix.iter().map(product));
            numbers.extend([
                evaluation.kinetic_energy_j,
                evaluation.potential_energy_j - gravity,
                gravity,
                evaluation.dissipation_w,
            ]);
            values.push(numbers);
        }
        Self {
            name: format!("{EVALUATE}{segments}"),
            kernels,
            symbols,
            tolerance: TOLERANCE_OF_EVALUATE,
            states,
            values,
        }
    }

    /// Chains, every operator, and names that `emit` could take for its own.
    fn all(emit: impl Fn(&[Kernel]) -> Result<Vec<SourceFile>, String>) -> Vec<Self> {
        let chains = CHAINS.into_iter().zip(whole::VALUES);
        let mut samples: Vec<Self> = chains
            .map(|((name, segments, motion), values)| {
                Self::new(name, chains::kernels(segments, motion), values)
            })
            .collect();
        let operators = catalogue::kernels()
            .into_iter()
            .filter(|kernel| kernel.name.starts_with("covered_"))
            .collect();
        samples.push(Self::new("operators", operators, |state| {
            emitted::COVERED
                .iter()
                .flat_map(|function| function(state[0], state[1]))
                .collect()
        }));
        assert_eq!(samples[CHAINS.len()].kernels.len(), COVERAGE.len());
        samples.extend(EVALUATED.map(Self::evaluated));
        samples.push(names::sample(emit));
        samples
    }

    /// Writes a directory with the sources, the driver `driver` and the first `count` states.
    fn directory(&self, files: &[SourceFile], driver: SourceFile, count: usize) -> TempDir {
        let directory = TempDir::new().expect("a temporary directory");
        let mut states = String::new();
        for state in self.states.iter().take(count) {
            let numbers: Vec<String> = state.iter().map(f64::to_string).collect();
            writeln!(states, "{}", numbers.join(" ")).expect("a string takes text");
        }
        let states = SourceFile {
            name: "states.txt".into(),
            text: states,
        };
        for SourceFile { name, text } in files.iter().chain([&driver, &states]) {
            fs::write(directory.path().join(name), text).expect("the file can be written");
        }
        directory
    }

    /// Compares the values in the file `values.txt`, in the order of states, functions and
    /// elements.
    fn check(&self, language: &str, directory: &Path, count: usize) {
        let name = &self.name;
        let text =
            fs::read_to_string(directory.join("values.txt")).expect("the driver has written it");
        let mut numbers = text
            .split_whitespace()
            .map(|number| number.parse::<f64>().expect("a number"));
        for (k, values) in self.values.iter().take(count).enumerate() {
            let mut rest = &values[..];
            for kernel in &self.kernels {
                for output in &kernel.outputs {
                    let (expected, others) = rest.split_at(output.nodes.len());
                    rest = others;
                    let scale = expected
                        .iter()
                        .fold(0.0, |largest: f64, value| largest.max(value.abs()));
                    for (i, expected) in expected.iter().enumerate() {
                        let value = numbers.next().expect("a value for each");
                        let is_close = (value - expected).abs()
                            <= self.tolerance * scale.max(f64::MIN_POSITIVE);
                        assert!(
                            is_close,
                            "{language}, {name}, {}, state {k}, {}[{i}]: {value:e} instead of {expected:e}",
                            kernel.name, output.name
                        );
                    }
                }
            }
            assert!(rest.is_empty());
        }
        assert_eq!(numbers.next(), None);
    }

    /// Writes the arguments of a call from pieces of the state: `scalar` and `array` write them,
    /// given start and end.
    fn arguments(&self, scalar: fn(usize) -> String, array: fn(usize, usize) -> String) -> String {
        let mut start = 0;
        let mut arguments = Vec::new();
        for input in &self.kernels[0].inputs {
            let length = input.elements.len();
            arguments.push(if length == 1 {
                scalar(start)
            } else {
                array(start, start + length)
            });
            start += length;
        }
        arguments.join(", ")
    }
}

/// The names of the elements of all inputs.
fn elements(kernel: &Kernel) -> Vec<String> {
    let elements = kernel.inputs.iter().flat_map(|input| &input.elements);
    elements.map(|(name, _)| name.clone()).collect()
}

/// The only file of a language.
fn single(name: &str, text: String) -> Vec<SourceFile> {
    vec![SourceFile {
        name: name.into(),
        text,
    }]
}

/// Runs a program in a directory, with success.
fn run(directory: &Path, program: &str, arguments: &[&str]) {
    let output = Command::new(program)
        .args(arguments)
        .current_dir(directory)
        .output()
        .expect(program);
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(
        output.status.success(),
        "{program} {arguments:?}:\n{stdout}{stderr}"
    );
}

/// The program that an environment variable names.
fn program(variable: &str) -> Option<String> {
    let program = env::var(variable).ok();
    if program.is_none() {
        println!("skipped: {variable} does not name a program");
    }
    program
}

#[cfg_attr(not(unix), ignore = "`cc` and `sh` are programs of Unix")]
#[test]
fn c_agrees() {
    let emit = |kernels: &[Kernel]| c::emit(kernels, ORIGIN);
    for sample in FunctionSamples::all(emit) {
        let files = emit(&sample.kernels).expect("the kernels can be emitted");
        let arguments = sample.arguments(
            |start| format!("x[{start}]"),
            |start, _| format!("x + {start}"),
        );
        let mut calls = String::new();
        for kernel in &sample.kernels {
            let name = &kernel.name;
            let call = match &kernel.outputs[..] {
                [
                    Output {
                        shape: OutputShape::Scalar,
                        ..
                    },
                ] => {
                    format!("double r; bristle_{name}({arguments}, &r); print(&r, 1);")
                }
                [
                    Output {
                        shape: OutputShape::Vector(length),
                        ..
                    },
                ] => {
                    format!(
                        "double r[{length}]; bristle_{name}({arguments}, r); print(r, {length});"
                    )
                }
                [
                    Output {
                        shape: OutputShape::Matrix(rows, columns),
                        ..
                    },
                ] => format!(
                    "double r[{rows}][{columns}]; bristle_{name}({arguments}, r); print(&r[0][0], {});",
                    rows * columns
                ),
                outputs => {
                    let printed: String = outputs
                        .iter()
                        .map(|output| match output.shape {
                            OutputShape::Vector(length) => {
                                format!(" print(r.{}, {length});", output.name)
                            }
                            _ => format!(" print(&r.{}, 1);", output.name),
                        })
                        .collect();
                    format!("struct bristle_{name} r; bristle_{name}({arguments}, &r);{printed}")
                }
            };
            writeln!(calls, "        {{ {call} }}").expect("a string takes text");
        }
        let size = sample.states[0].len();
        let text = format!(
            "#include <stdio.h>\n#include \"bristle_chain.h\"\n\n\
             static void print(const double *values, int count) {{\n    \
             for (int i = 0; i < count; i++) printf(\"%.17g\\n\", values[i]);\n}}\n\n\
             int main(void) {{\n    double x[{size}];\n    for (;;) {{\n        \
             for (int i = 0; i < {size}; i++) if (scanf(\"%lf\", &x[i]) != 1) return 0;\n{calls}    }}\n}}\n"
        );
        let directory = sample.directory(
            &files,
            SourceFile {
                name: "driver.c".into(),
                text,
            },
            STATES,
        );
        let warnings = ["-std=c11", "-pedantic", "-Wall", "-Wextra", "-Werror"];
        let sources = ["-o", "driver", "driver.c", "bristle_chain.c", "-lm"];
        run(directory.path(), "cc", &[&warnings[..], &sources].concat());
        run(
            directory.path(),
            "sh",
            &["-c", "./driver < states.txt > values.txt"],
        );
        sample.check("C", directory.path(), STATES);
    }
}

const RUST_DRIVER: &str = r#"
mod bristle_chain;
use bristle_chain as chain;

fn print(values: &[f64]) {
    for value in values {
        println!("{value:e}");
    }
}

fn main() {
    for line in std::io::stdin().lines() {
        let line = line.unwrap();
        let x: Vec<f64> = line.split(' ').map(|number| number.parse().unwrap()).collect();
@CALLS@    }
}
"#;

#[cfg_attr(not(unix), ignore = "`sh` is a program of Unix")]
#[test]
fn rust_on_f64_agrees() {
    let emit = |kernels: &[Kernel]| {
        rust::emit(kernels, ORIGIN).map(|text| single("bristle_chain.rs", text))
    };
    // Words of the source, which serve as names, may have capitals.
    let compile = [
        "--edition=2024",
        "-Dwarnings",
        "-Anon-snake-case",
        "-Copt-level=1",
    ];
    for sample in FunctionSamples::all(emit) {
        let files = emit(&sample.kernels).expect("the kernels can be emitted");
        let arguments = sample.arguments(
            |start| format!("x[{start}]"),
            |start, end| format!("x[{start}..{end}].try_into().unwrap()"),
        );
        let mut calls = String::new();
        for kernel in &sample.kernels {
            writeln!(
                calls,
                "        let r = chain::{}({arguments});",
                kernel.name
            )
            .expect("a string takes text");
            for Output { name, shape, .. } in &kernel.outputs {
                let value = match shape {
                    OutputShape::Scalar => format!("&[r.{name}]"),
                    OutputShape::Vector(_) => format!("&r.{name}"),
                    OutputShape::Matrix(..) => format!("r.{name}.as_flattened()"),
                };
                writeln!(calls, "        print({value});").expect("a string takes text");
            }
        }
        let driver = SourceFile {
            name: "driver.rs".into(),
            text: RUST_DRIVER.replace("@CALLS@", &calls),
        };
        let directory = sample.directory(&files, driver, STATES);
        let path = directory.path();
        run(path, "rustc", &[&compile[..], &["driver.rs"]].concat());
        run(path, "sh", &["-c", "./driver < states.txt > values.txt"]);
        sample.check("Rust", path, STATES);

        // A program that calls none of the functions.
        fs::write(
            path.join("unused.rs"),
            "mod bristle_chain;\n\nfn main() {}\n",
        )
        .expect("the file can be written");
        run(path, "rustc", &[&compile[..], &["unused.rs"]].concat());
    }
}

#[test]
fn octave_agrees() {
    let Some(octave) = program("BRISTLE_TEST_OCTAVE") else {
        return;
    };
    let emit = |kernels: &[Kernel]| matlab::emit(kernels, ORIGIN);
    for sample in FunctionSamples::all(emit) {
        let files = emit(&sample.kernels).expect("the kernels can be emitted");
        let arguments = sample.arguments(
            |start| format!("x({})", start + 1),
            |start, end| format!("x({}:{end})", start + 1),
        );
        let mut calls = String::new();
        for kernel in &sample.kernels {
            let values = match &kernel.outputs[..] {
                [_] => "r.'".to_owned(),
                outputs => {
                    let fields: Vec<String> = outputs
                        .iter()
                        .map(|output| format!("r.{}.'", output.name))
                        .collect();
                    format!("[{}]", fields.join(", "))
                }
            };
            writeln!(
                calls,
                "  r = {}({arguments});\n  fprintf(out, '%.17g\\n', {values});",
                kernel.name
            )
            .expect("a string takes text");
        }
        let text = format!(
            "states = load('states.txt');\nout = fopen('values.txt', 'w');\n\
             for k = 1:size(states, 1)\n  x = states(k, :)';\n{calls}end\nfclose(out);\n"
        );
        let directory = sample.directory(
            &files,
            SourceFile {
                name: "driver.m".into(),
                text,
            },
            STATES,
        );
        run(
            directory.path(),
            &octave,
            &["--no-gui", "--quiet", "--norc", "driver.m"],
        );
        sample.check("Octave", directory.path(), STATES);
    }
}

#[test]
fn numpy_agrees() {
    let Some(python) = program("BRISTLE_TEST_PYTHON") else {
        return;
    };
    let emit = |kernels: &[Kernel]| {
        numpy::emit(kernels, ORIGIN).map(|text| single("bristle_chain.py", text))
    };
    for sample in FunctionSamples::all(emit) {
        let files = emit(&sample.kernels).expect("the kernels can be emitted");
        let arguments = sample.arguments(
            |start| format!("x[:, {start}]"),
            |start, end| format!("x[:, {start}:{end}]"),
        );
        let mut calls = String::new();
        for kernel in &sample.kernels {
            writeln!(calls, "r = chain.{}({arguments})", kernel.name).expect("a string takes text");
            for output in &kernel.outputs {
                let value = if kernel.outputs.len() == 1 {
                    "r".into()
                } else {
                    format!("r.{}", output.name)
                };
                let shape = match output.shape {
                    OutputShape::Scalar => "()".to_owned(),
                    OutputShape::Vector(length) => format!("({length},)"),
                    OutputShape::Matrix(rows, columns) => format!("({rows}, {columns})"),
                };
                writeln!(calls, "columns.append(np.broadcast_to({value}, (len(x),) + {shape}).reshape(len(x), -1))")
                    .expect("a string takes text");
            }
        }
        let text = format!(
            "import numpy as np\nimport bristle_chain as chain\n\nx = np.loadtxt('states.txt')\ncolumns = []\n{calls}\
             np.savetxt('values.txt', np.hstack(columns), '%.17g')\n"
        );
        let directory = sample.directory(
            &files,
            SourceFile {
                name: "driver.py".into(),
                text,
            },
            STATES,
        );
        run(directory.path(), &python, &["driver.py"]);
        sample.check("NumPy", directory.path(), STATES);
    }
}

const SYMPY_DRIVER: &str = r#"
import sympy
import bristle_chain_sympy as chain

symbols = [sympy.Symbol(name, real=True) for name in [@NAMES@]]
results = []
@CALLS@
with open('states.txt') as states, open('values.txt', 'w') as out:
    for line in states:
        values = dict(zip(symbols, map(sympy.Float, line.split())))
        for result in results:
            for element in result if isinstance(result, sympy.MatrixBase) else [result]:
                number = sympy.N(element.subs(values), 20)
                assert number.is_number, (element, number)
                print(float(number), file=out)
"#;

#[test]
fn sympy_agrees() {
    let Some(python) = program("BRISTLE_TEST_PYTHON") else {
        return;
    };
    let emit = |kernels: &[Kernel]| {
        sympy::emit(kernels, ORIGIN).map(|text| single("bristle_chain_sympy.py", text))
    };
    // SymPy expands the expressions of long chains for minutes.
    let samples = FunctionSamples::all(emit).into_iter();
    for sample in samples.filter(|sample| !sample.name.starts_with(EVALUATE)) {
        let files = emit(&sample.kernels).expect("the kernels can be emitted");
        let names: Vec<String> = sample
            .symbols
            .iter()
            .map(|name| format!("\"{name}\""))
            .collect();
        let mut calls = String::new();
        for kernel in &sample.kernels {
            let function = &kernel.name;
            for output in &kernel.outputs {
                let value = match kernel.outputs.len() {
                    1 => format!("chain.{function}()"),
                    _ => format!("chain.{function}()[\"{}\"]", output.name),
                };
                writeln!(calls, "results.append({value})").expect("a string takes text");
            }
        }
        let text = SYMPY_DRIVER
            .replace("@NAMES@", &names.join(", "))
            .replace("@CALLS@", &calls);
        let directory = sample.directory(
            &files,
            SourceFile {
                name: "driver.py".into(),
                text,
            },
            STATES_OF_SYMPY,
        );
        run(directory.path(), &python, &["driver.py"]);
        sample.check("SymPy", directory.path(), STATES_OF_SYMPY);
    }
}
