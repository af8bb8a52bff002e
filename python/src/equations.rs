//! The equations of motion: accelerations of many states, all terms at one state, and their text.

use std::collections::BTreeMap;

use bristle::model::filament;
use bristle::model::parameters::Parameter;
use bristle::model::settings::FilamentSettings;
use bristle::simulation::Stop;
use bristle::tool::radial_clamp;
use bristle_equations::batch::{Batch, BatchError, Member};
use bristle_equations::derive::{
    ARTICLE_WIDTH_MM, DeriveFormat, Derived, Equations, Motion, RelaxedShape, derive as derived,
    derive_fragment,
};
use bristle_equations::evaluation;
use bristle_equations::state::parse_state;
use bristle_study::grid::tentative;
use numpy::{
    PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::error::{of_input, of_value};
use crate::input::InputFile;
use crate::interrupt::{Watch, unseen};

/// Number of states computed at a time: few enough that their clamps stay in a cache.
const STATES_PER_CHUNK: usize = 256;

/// Returns `q̈` in rad/s² of the states `q` (rad) and `v` (rad/s), both `(k, n, 2)`. Each state has
/// its own angle (rad), rate (rad/s) and acceleration (rad/s²) of the base.
#[pyfunction]
pub fn accelerations<'py>(
    py: Python<'py>,
    input: &InputFile,
    q: PyReadonlyArray3<'py, f64>,
    v: PyReadonlyArray3<'py, f64>,
    base: [PyReadonlyArray1<'py, f64>; 3],
    gravity: [f64; 3],
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let settings = input.settings()?;
    let &[count, segments, blocks] = q.shape() else {
        return Err(of_value("q has three dimensions"));
    };
    if blocks != 2
        || segments == 0
        || v.shape() != q.shape()
        || base.iter().any(|values| values.len() != count)
    {
        return Err(of_value(
            "q and v need the shape (k, n, 2), with at least one segment",
        ));
    }
    let filament = FilamentSettings {
        segments,
        ..settings.filament.clone()
    };
    let (chain, radius) = (
        filament::chain(&filament, gravity),
        settings.tool.body_radius_m,
    );
    let (q, v) = (
        q.as_slice().map_err(of_value)?,
        v.as_slice().map_err(of_value)?,
    );
    let (q, v) = (q.as_chunks::<2>().0, v.as_chunks::<2>().0);
    let [angle, rate, acceleration] = [base[0].as_slice(), base[1].as_slice(), base[2].as_slice()];
    let (angle, rate, acceleration) = (
        angle.map_err(of_value)?,
        rate.map_err(of_value)?,
        acceleration.map_err(of_value)?,
    );
    let stop = Stop::default();
    let mut watch = Watch::new(&stop, None);
    let result = py.detach(|| {
        let mut batch = Batch::new(segments);
        let mut result = vec![[0.0; 2]; q.len()];
        for (chunk, results) in result.chunks_mut(STATES_PER_CHUNK * segments).enumerate() {
            let first = chunk * STATES_PER_CHUNK;
            let states = first..first + results.len() / segments;
            let clamps: Vec<_> = states
                .clone()
                .map(|state| radial_clamp(radius, angle[state], rate[state], acceleration[state]))
                .collect();
            let member = |(state, clamp)| {
                let blocks = state * segments..(state + 1) * segments;
                Member {
                    chain: &chain,
                    clamp,
                    q: &q[blocks.clone()],
                    v: &v[blocks],
                }
            };
            let members: Vec<Member<'_>> = states.zip(&clamps).map(member).collect();
            batch
                .accelerations(&members, results)
                .map_err(|mut error| {
                    error.member += first;
                    error
                })?;
            watch.look(first as f64 / count as f64);
            if stop.is_requested() {
                break;
            }
        }
        Ok(result.into_flattened())
    });
    watch.end()?;
    let result: Vec<f64> = result.map_err(|error: BatchError| of_value(error))?;
    PyArray1::from_vec(py, result).reshape([count, segments, 2])
}

/// Returns the output of `bristle evaluate` for the `state`, both as JSON.
#[pyfunction]
pub fn evaluate(py: Python<'_>, input: &InputFile, state: String) -> PyResult<String> {
    let settings = input.settings()?.clone();
    let state = parse_state(&state).map_err(of_value)?;
    let body_radius = settings.tool.body_radius_m;
    let evaluation = unseen(py, move || {
        evaluation::evaluate(&settings.filament, body_radius, &state)
    })?;
    serde_json::to_string(&evaluation.map_err(of_value)?).map_err(of_value)
}

/// Derives the equations of the filament that an input states, or of a number of segments, or the
/// kernels without either. Returns one text, or several files by their names, as `bristle derive`
/// writes them.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "the switches of the program")]
pub fn derive(
    py: Python<'_>,
    input: Option<&InputFile>,
    segments: Option<usize>,
    planar: bool,
    uniform: bool,
    straight: bool,
    format: &str,
    fragment: bool,
    width_mm: Option<f64>,
) -> PyResult<(Option<String>, BTreeMap<String, String>)> {
    let format = DeriveFormat::find(format).ok_or_else(|| {
        let names = DeriveFormat::ALL
            .iter()
            .map(|known| format!("{:?}", known.name()))
            .collect::<Vec<_>>();
        of_value(format!("the format must be one of {}", names.join(", ")))
    })?;
    if fragment && format != DeriveFormat::Latex {
        return Err(of_value(
            "a fragment is a part of a LaTeX document: choose the format \"latex\"",
        ));
    }
    if width_mm.is_some() && !fragment {
        return Err(of_value("width_mm is that of a fragment"));
    }
    let equations = match (input, segments) {
        (Some(input), _) => {
            let settings = input.document()?.first_settings().map_err(of_input)?;
            Equations::of(&tentative(settings))
        }
        (None, Some(segments)) => of_segments(segments)?,
        (None, None) => Equations::Kernels,
    };
    let shape = RelaxedShape {
        is_straight: straight,
        is_cylinder: uniform,
    };
    let equations = equations.of_shape(shape, format).map_err(of_value)?;
    let equations = if planar {
        equations.in_plane()
    } else {
        equations
    };
    unseen(py, move || {
        let written = if fragment {
            derive_fragment(equations, width_mm.unwrap_or(ARTICLE_WIDTH_MM))
        } else {
            derived(equations, format)
        };
        Ok(match written.map_err(of_value)? {
            Derived::Text(text) => {
                let mut written = Vec::new();
                text.write(&mut written)?;
                (
                    Some(String::from_utf8(written).map_err(of_value)?),
                    BTreeMap::new(),
                )
            }
            Derived::Files(files) => (
                None,
                files
                    .into_iter()
                    .map(|file| (file.name, file.text))
                    .collect(),
            ),
        })
    })?
}

/// Derives the whole equations in space for this many segments.
fn of_segments(segments: usize) -> PyResult<Equations> {
    let parameter = Parameter::find("filament.segments").ok_or_else(|| of_value("no segments"))?;
    parameter
        .check(segments as f64)
        .map_err(|_| of_value(format!("segments must be {}", parameter.allowed())))?;
    Ok(Equations::Whole {
        segments,
        motion: Motion::Spatial,
        shape: RelaxedShape::default(),
    })
}
