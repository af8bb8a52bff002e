//! Is the stepping path free of allocations? Passes with many steps and with few steps allocate the
//! same.

use std::f64::consts::FRAC_PI_2;

use crate::common::{case, edge};
use bristle::brush::{Assembly, PressLaw};
use bristle::contact::ContactLaw;
use bristle::equations::Clamp;
use bristle::model::filament::chain;
use bristle::model::settings::{Settings, Side, Turns};
use bristle::simulation::{Filament, Job, simulate, simulate_side_by_side};
use bristle::tool::{ClampMotion, FixedClamp};
use bristle::workpiece::{Part, Plane};

fn allocations(f: impl FnOnce()) -> u64 {
    allocation_counter::measure(f).count_total
}

fn at(relative_tolerance: f64) -> Settings {
    let mut settings = case(10, 10.0, 1e-3);
    settings.solver.relative_tolerance = relative_tolerance;
    settings
}

/// Three turns.
fn in_turns(relative_tolerance: f64) -> Settings {
    let mut settings = at(relative_tolerance);
    settings.process.turns = Some(Turns::Count(3));
    settings
}

/// Settings on an edge, which the filament meets inside segments, with friction.
fn on_edge(relative_tolerance: f64) -> Settings {
    let mut settings = at(relative_tolerance);
    settings.workpiece.kind = edge(Side::Entering, -3e-3, 0.2e-3);
    settings.contact.friction_coefficient = 0.3;
    settings
}

#[test]
fn steps_of_a_pass_do_not_allocate() {
    for settings in [at, on_edge, in_turns] {
        let steps = |tolerance| {
            simulate(&settings(tolerance))
                .expect("the pass ends")
                .statistics
                .steps
        };
        assert!(
            2 * steps(1e-6) > 5 * steps(1e-3),
            "the test could not detect allocations in a step"
        );
        let [few, many] = [1e-3, 1e-6].map(|tolerance| {
            allocations(|| drop(simulate(&settings(tolerance)).expect("the pass ends")))
        });
        assert!(few > 0);
        assert_eq!(few, many);
    }
}

#[test]
fn steps_of_passes_side_by_side_do_not_allocate() {
    for settings in [at, on_edge, in_turns] {
        let [few, many] = [1e-3, 1e-6].map(|tolerance| {
            let mut jobs: Vec<Job> = (0..12)
                .map(|number| Job::new(number, &settings(tolerance)))
                .collect();
            allocations(|| {
                simulate_side_by_side(
                    |_| jobs.pop(),
                    |_, result| drop(result.expect("the pass ends")),
                )
            })
        });
        assert!(few > 0);
        assert_eq!(few, many);
    }
}

/// A clamp at rest, which holds a filament along `x`.
#[derive(Clone, Copy, Debug)]
struct Standing {
    y: f64,
}

impl ClampMotion for Standing {
    fn at(&self, _: f64) -> Clamp<f64> {
        Clamp {
            position: [0.0, self.y, 0.0],
            ..FixedClamp {
                direction: [1.0, 0.0, 0.0],
            }
            .at(0.0)
        }
    }
}

/// Filaments whose contact with each other opens and closes: every other one swings against its
/// neighbours.
#[test]
fn steps_of_filaments_that_touch_do_not_allocate() {
    const COUNT: usize = 10;
    let settings = case(10, 10.0, 1e-3);
    let filaments = (0..COUNT).map(|index| Filament {
        chain: chain(&settings.filament, [0.0; 3]),
        motion: Standing {
            y: 1.3e-3 * index as f64,
        },
        law: ContactLaw::from(&settings.contact),
        workpiece: Part::Plane(Plane::new([0.0, -1e3, 0.0], [0.0, 1.0, 0.0], [0.0; 3])),
    });
    let radii = [0.5 * settings.filament.diameter_m; COUNT];
    let coordinates = |index: usize| {
        let rate = if index.is_multiple_of(2) { 60.0 } else { 0.0 };
        [vec![[FRAC_PI_2, 0.0]; 10], vec![[0.0, rate]; 10]]
    };
    let mut row = Assembly::new(
        filaments.collect(),
        &radii,
        PressLaw::of(&settings),
        4,
        coordinates,
        1e-4,
    );
    let (mut steps, mut changes, mut touching) = (0, 0, 0);
    let mut advance = |row: &mut Assembly<Standing>, end: f64| {
        while row.time() < end {
            row.step(1e-5).expect("a short step");
            let now = row.presses().count();
            (steps, changes, touching) = (steps + 1, changes + usize::from(now != touching), now);
        }
    };
    // Memory grows up to the largest number of contacts at a time.
    advance(&mut row, 8e-3);
    let allocated = allocations(|| advance(&mut row, 16e-3));
    assert!(
        steps > 1500 && changes > 50,
        "{changes} changes of the contacts in {steps} steps"
    );
    assert_eq!(allocated, 0);
}
