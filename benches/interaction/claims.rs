//! The statements of the page that depend on its numbers.

use std::error::Error;

use crate::cases::{
    Case, DEPTHS, DIFFERING, FINER, ROUGH, Results, SPARSE, SPATIAL, Scatter, TILTED, TILTS,
    TURNING, VELOCITIES, at, places,
};
use crate::numbers::{
    Tilted, by_column, impulse, impulse_alone, in_the_middle, lifts, standard_error,
};
use crate::tables::{buckled, force_in_space, sparse_factors, tool_forces};

/// A statement, and whether it holds.
type Claim = (&'static str, bool);

/// All statements.
///
/// # Errors
/// If a filament alone cannot be simulated.
pub fn all(results: &Results) -> Result<Vec<Claim>, Box<dyn Error>> {
    Ok([
        of_forces(results),
        of_details(results),
        of_rows(results),
        of_space(results)?,
    ]
    .concat())
}

/// Those on the tool force over velocity and depth.
fn of_forces(results: &Results) -> Vec<Claim> {
    let factor = |velocity, depth| results.row(velocity, depth).interaction_factor;
    let alone = |velocity, depth| impulse_alone(results.row(velocity, depth));
    let together = |velocity, depth| impulse(results.row(velocity, depth));
    let rises =
        |value: &dyn Fn(u32) -> f64| DEPTHS.is_sorted_by(|less, more| value(*less) < value(*more));
    let within = |share: f64, case: Case, other: Case| {
        let [one, other] = [case, other].map(|case| impulse(results.of(case)));
        (one - other).abs() < share * other
    };
    vec![
        (
            "the factor rises with the depth at every velocity",
            VELOCITIES
                .iter()
                .all(|&velocity| rises(&|depth| factor(velocity, depth))),
        ),
        (
            "at 2 m/s interaction adds force at every depth",
            DEPTHS.iter().all(|&depth| factor(2, depth) > 1.0),
        ),
        (
            "at 0.5 mm and from 20 m/s on, more than half of the force is gone",
            factor(20, 500) < 0.5 && factor(30, 500) < 0.5,
        ),
        (
            "at 3 mm it is within 20 % of one at every velocity",
            VELOCITIES
                .iter()
                .all(|&velocity| (factor(velocity, 3000) - 1.0).abs() < 0.205),
        ),
        ("the factor at 1 mm falls with the velocity", {
            VELOCITIES.is_sorted_by(|slow, fast| factor(*slow, 1000) > factor(*fast, 1000))
        }),
        (
            "at 30 m/s the force alone falls with the depth, that of the row rises from 0.5 to 3 mm",
            DEPTHS.is_sorted_by(|less, more| alone(30, *less) > alone(30, *more))
                && together(30, 3000) > 1.5 * together(30, 500),
        ),
        (
            "up to 20 m/s the force of the row rises with every step of the depth",
            [2, 10, 20]
                .iter()
                .all(|&velocity| rises(&|depth| together(velocity, depth))),
        ),
        (
            "25 segments change the forces by less than 1 %",
            FINER
                .iter()
                .all(|&place| within(0.01, Case::Row(place), Case::Finer(place))),
        ),
    ]
}

/// Those on friction, scatter and turns.
fn of_details(results: &Results) -> Vec<Claim> {
    let rough = |place, workpiece, filaments| {
        impulse(results.of(Case::Rough {
            place,
            workpiece,
            filaments,
        }))
    };
    let differing = |scatter, apart| {
        results.of(Case::Differing {
            place: DIFFERING,
            scatter,
            apart,
        })
    };
    let scatter = |kind, apart| differing(kind, apart).stretch.scatter;
    let ratio = |place| {
        let [single, turned] =
            [Case::Row(place), Case::Turning(place)].map(|case| results.of(case));
        [
            impulse_alone(turned) / impulse_alone(single),
            in_the_middle(turned)[0] / impulse(single),
        ]
    };
    let apart_alike = |kind| {
        let [some, none] = [kind, Scatter::Nothing].map(|kind| differing(kind, false));
        (impulse(some) - impulse(none)).abs() < 0.02 * impulse(none)
    };
    vec![
        (
            "friction between filaments adds 3 to 20 % of the force, friction on the workpiece takes more than a third",
            ROUGH.iter().all(|&place| {
                let row = impulse(results.of(Case::Row(place)));
                (1.03..1.2).contains(&(rough(place, false, true) / row))
                    && rough(place, true, false) < 0.67 * row
            }),
        ),
        (
            "with friction on the workpiece, the row loses less than a filament alone",
            ROUGH.iter().all(|&place| {
                let with = results.of(Case::Rough {
                    place,
                    workpiece: true,
                    filaments: false,
                });
                with.interaction_factor > results.of(Case::Row(place)).interaction_factor
            }),
        ),
        (
            "contact makes the impulses of filaments of different length scatter more than ten times as much",
            scatter(Scatter::Length, false) > 10.0 * scatter(Scatter::Length, true),
        ),
        (
            "scatter of diameters or waves changes the force by less than 2 %, that of lengths by less than its standard error",
            [Scatter::Diameter, Scatter::Waviness]
                .into_iter()
                .all(apart_alike)
                && {
                    let [some, none] =
                        [Scatter::Length, Scatter::Nothing].map(|kind| differing(kind, false));
                    (impulse(some) - impulse(none)).abs() < standard_error(some) * impulse(some)
                },
        ),
        (
            "turns change the row by at most 2 %, a filament alone by more than 10 % at 20 m/s and to more than twice at 30 m/s",
            TURNING
                .iter()
                .all(|&place| (ratio(place)[1] - 1.0).abs() < 0.02)
                && ratio(at(20, 1000))[0] > 1.1
                && ratio(at(30, 1000))[0] > 2.0,
        ),
    ]
}

/// Those on filaments one behind the other.
fn of_rows(results: &Results) -> Vec<Claim> {
    let rows = || places([1000, 3000]).map(|place| results.of(Case::Row(place)));
    let first = |row| by_column(row)[0] / impulse(row);
    vec![
        (
            "the first filament of a row presses with 1.7 to 4.7 times the mean",
            rows().all(|row| (1.7..4.7).contains(&first(row))),
        ),
        (
            "the last filament presses with at most 0.8 of the mean",
            rows().all(|row| {
                by_column(row)
                    .last()
                    .is_some_and(|last| *last < 0.8 * impulse(row))
            }),
        ),
        (
            "the first three filaments are pressed down by their neighbours, the last five are lifted in sum",
            rows().all(|row| {
                let lifts = lifts(row);
                lifts[..3].iter().all(|lift| *lift < 0.0)
                    && lifts[lifts.len() - 5..].iter().sum::<f64>() > 0.0
            }),
        ),
        (
            "neighbours of filaments that count lift and press by less than 2 % of p_n in sum",
            rows().all(|row| {
                let middle = usize::midpoint(row.stretch.first, row.stretch.last);
                lifts(row)[middle].abs() < 0.02 * impulse(row)
            }),
        ),
    ]
}

/// Those on brushes in space.
fn of_space(results: &Results) -> Result<Vec<Claim>, Box<dyn Error>> {
    let space = |velocity, depth| results.space(at(velocity, depth));
    let over = |velocity, depth| {
        let [force, planar] = [space(velocity, depth), results.row(velocity, depth)]
            .map(|brush| tool_forces(at(velocity, depth), brush)[0]);
        force / planar
    };
    let slow = Tilted::at(at(2, 1000))?;
    let mut farther = true;
    for place in SPATIAL.into_iter().filter(|place| place.velocity > 2) {
        farther &= buckled(results.space(place))[1] > 1.5 * Tilted::at(place)?.sideways;
    }
    Ok(vec![
        (
            "tilts take force at 2 m/s and at 3 mm, and add much at 30 m/s",
            { over(2, 1000) < 0.95 && over(10, 3000) < 0.95 && over(30, 1000) > 1.1 },
        ),
        (
            "from 1 to 20 mrad the force is the same within its standard error",
            {
                TILTED.iter().all(|&place| {
                    let forces = TILTS
                        .map(|tilt| force_in_space(place, results.of(Case::Space { place, tilt })));
                    forces
                        .iter()
                        .all(|[force, error]| (force - forces[0][0]).abs() < *error)
                })
            },
        ),
        (
            "from 3.5 diameters on, filaments press as they would alone, within 5 %, and no closer",
            {
                let leaves = |around| {
                    let all = VELOCITIES
                        .into_iter()
                        .flat_map(|velocity| sparse_factors(results, around, velocity));
                    all.into_iter().any(|factor| (factor - 1.0).abs() > 0.05)
                };
                let (last, closer) = SPARSE.split_last().expect("brushes");
                !leaves(*last) && closer.iter().all(|around| leaves(*around))
            },
        ),
        ("in space impulses scatter by 15 to 65 %", {
            SPATIAL
                .iter()
                .all(|place| (0.15..0.65).contains(&results.space(*place).stretch.scatter))
        }),
        (
            "at 2 m/s a lone tilted filament buckles, and many of the brush do",
            { slow.sideways > 4e-3 && buckled(space(2, 1000))[0] > 0.25 },
        ),
        (
            "where a lone filament does not buckle, neighbours push filaments farther sideways",
            farther,
        ),
    ])
}
