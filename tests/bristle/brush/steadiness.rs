//! Turns and stretches of a row in which impulses no longer change.

use bristle::brush::{BrushError, BrushRun, RunOptions, Stretch, simulate_brush};
use bristle::model::settings::Turns;

use super::{finished, row, simulated};
use crate::common::with;

#[test]
fn steady_turns_of_a_brush_go_on_until_they_are() {
    let mut settings = with(&row(10, 600.0, 1), |brush| brush.tolerance = 3e-4);
    settings.process.brushing_velocity_m_s = 30.0;
    settings.process.turns = Some(Turns::Steady);
    let brush = simulated(&settings);
    let impulses = &brush.turn_contact_normal_impulses_n_s;
    // MODEL, "Turns".
    for (found, expected) in impulses.iter().zip([1.64e-3, 3.04e-3, 3.58e-3, 3.69e-3]) {
        assert!((found - expected).abs() < 6e-6, "{impulses:?}");
    }
    let [.., before, last] = impulses[..] else {
        panic!("{impulses:?}")
    };
    assert!(impulses.len() > 4 && (last / before - 1.0).abs() < 1e-3 && !brush.tool.unsteady_turns);
    assert_eq!(
        (brush.tool.turns, brush.tool.contact_normal_impulse_n_s),
        (impulses.len(), last)
    );
    assert!(
        (brush.interaction_factor - 1.0).abs() < 1e-3,
        "{}",
        brush.interaction_factor
    );
}

#[test]
fn the_steady_stretch_is_where_impulses_no_longer_change() {
    let settings = with(&row(5, 682.0, 20), |brush| brush.steady = true);
    let error = simulate_brush(&settings, 1).expect_err("too few columns");
    let BrushError::TooFewColumns {
        columns: 20,
        needed,
        ..
    } = error
    else {
        panic!("{error}")
    };
    assert!(
        error
            .to_string()
            .contains(&format!("`brush.columns` to {needed}")),
        "{error}"
    );
    // Where no stretch could be long enough, nothing is simulated.
    let error = simulate_brush(&with(&settings, |brush| brush.columns = Some(1)), 1)
        .expect_err("too few columns");
    assert!(
        matches!(
            error,
            BrushError::TooFewColumns {
                columns: 1,
                change: None,
                ..
            }
        ),
        "{error}"
    );
    // The stated number of columns is enough, and so is the default number.
    let stated = simulated(&with(&settings, |brush| brush.columns = Some(needed)));
    let default = simulated(&with(&settings, |brush| brush.columns = None));
    let longer = simulated(&with(&settings, |brush| brush.columns = Some(2 * needed)));
    for result in [stated, default] {
        let [a, b] = [&result, &longer].map(|result| result.tool.contact_normal_impulse_n_s);
        assert!(
            (a / b - 1.0).abs() < 3e-3,
            "{a} {b} {:?} {:?}",
            result.stretch,
            longer.stretch
        );
        assert!(result.stretch.standard_error < 2e-3 && result.stretch.first > 3);
    }
}

#[test]
fn a_row_ends_once_its_stretch_has_settled() {
    let settings = with(&row(5, 682.0, 0), |brush| {
        (brush.columns, brush.steady) = (None, true)
    });
    let options = RunOptions {
        frames: 20,
        ..RunOptions::default()
    };
    let mut run = BrushRun::new(&settings, options).expect("a row");
    let laid_out = run.columns();
    let mut states = vec![run.checkpoint()];
    while run.advance().expect("steps") {
        states.push(run.checkpoint());
    }
    let result = run.finish().expect("results");
    let Stretch {
        first,
        last,
        standard_error,
    } = result.stretch;
    assert!(
        result.columns < laid_out && last < result.columns - 1 && last + 1 - first >= 16,
        "{:?}",
        result.stretch
    );
    assert!(standard_error <= 5e-4 && result.impulse_error_estimate < 5e-3);
    assert_eq!(result.filaments.len(), result.columns);
    assert!(
        result
            .frames
            .iter()
            .all(|frame| frame.nodes_m.len() == result.columns)
    );
    // All that has touched is there, also behind the stretch.
    for frame in &result.frames {
        let sample = result
            .history
            .iter()
            .find(|sample| sample.time_s == frame.time_s)
            .expect("a sample of each frame");
        let sum = |forces: &[f32]| forces.iter().map(|force| f64::from(*force)).sum::<f64>();
        let (contact, press) = (
            sum(&frame.contact_normal_force_n),
            0.5 * sum(&frame.press_force_n),
        );
        assert!(
            (contact - sample.contact_normal_force_n).abs() <= 1e-6 * sample.contact_normal_force_n,
            "{sample:?}"
        );
        assert!(
            (press - sample.press_force_n).abs() <= 1e-6 * sample.press_force_n,
            "{sample:?}"
        );
    }
    assert!(
        result
            .pairs
            .iter()
            .all(|pair| pair.filament[0].max(pair.other[0]) < result.columns)
    );
    // The tolerance is that of the mean impulse.
    let longer = simulated(&with(&settings, |brush| brush.columns = Some(200)));
    let [a, b] = [&result, &longer].map(|result| result.tool.contact_normal_impulse_n_s);
    assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
    // A run resumes from any state, also from a settled one with columns that still sleep.
    for state in [
        &states[1],
        &states[states.len() / 2],
        &states[states.len() - 1],
    ] {
        let resumed = BrushRun::resume(&settings, options, state.clone()).expect("a state");
        assert_eq!(finished(resumed), result);
    }
}
