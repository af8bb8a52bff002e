//! Warnings about measured points that do not fit a study, mostly because of a wrong unit.

use super::{compared_slices, points_of, weights};
use crate::insight::slices::{Slice, Varied};
use bristle_study::grid::Study;
use bristle_study::input::measured::{Measurement, Quantity, Speed};
use bristle_study::input::plausibility::Unusual;
use bristle_study::text::number::short;

/// Factor beyond which values are far outside of a study.
const FAR_FACTOR: f64 = 10.0;

/// Maximum relative difference between two consistent speeds of one point. One of them is often
/// rounded.
const MAX_SPEED_DIFFERENCE: f64 = 0.05;

/// Finds unusual measured points in view of a study: forces of the wrong sign, contradictory
/// speeds, speeds or depths far outside of it, or no point within.
#[must_use]
pub fn unusual_points(study: &Study, measured: &[Measurement]) -> Vec<Unusual> {
    let slices = compared_slices(study, measured);
    let Some(slice) = slices.first() else {
        return Vec::new();
    };
    let mut unusual = Vec::from_iter(wrong_sign(measured));
    unusual.extend(contradiction(study, &slices, measured));
    let depths: Vec<f64> = measured
        .iter()
        .map(|point| point.penetration_depth_m)
        .collect();
    let speeds: Vec<f64> = measured
        .iter()
        .map(|point| slice.at_speed(study, point.speed))
        .collect();
    let speed = measured[0].speed.quantity();
    let from_slice = speeds[0] / measured[0].speed.value();
    let far = [
        far_values(Quantity::Depth, &depths, &slice.y, 1.0),
        far_values(speed, &speeds, &slice.x, from_slice),
    ];
    let far: Vec<Unusual> = far.into_iter().flatten().collect();
    let inside = |side: &Varied, at: f64| weights(side, at).is_some();
    let has_point = |slice: &Slice| {
        points_of(study, slice, measured).any(|point| {
            inside(&slice.y, point.penetration_depth_m)
                && inside(&slice.x, slice.at_speed(study, point.speed))
        })
    };
    if far.is_empty() && !slices.iter().any(has_point) {
        let statement = format!(
            "None of the {} measured points lies within the study, so that none can be compared. The study has {} and {}; forces \
             between its cases are interpolated, and never extrapolated.",
            measured.len(),
            range(&slice.x),
            range(&slice.y)
        );
        unusual.push(Unusual {
            path: "measured.file",
            statement,
        });
    }
    unusual.extend(far);
    unusual
}

/// Returns the hint that the axis of the dynamometer may point the other way.
fn wrong_sign(measured: &[Measurement]) -> Option<Unusual> {
    let are_negative = measured.iter().all(|point| point.force_n < 0.0);
    are_negative.then(|| Unusual {
        path: "measured.file",
        statement: "All measured normal forces are negative. A force that presses on the workpiece counts positive: change the sign in \
             the table."
            .to_owned(),
    })
}

/// Reports points with a rotational speed that none of their possible tools has at their velocity.
fn contradiction(study: &Study, slices: &[Slice], measured: &[Measurement]) -> Option<Unusual> {
    let contradicts =
        |slice: &Slice, point: &Measurement| match (point.speed, point.second_speed_rpm) {
            (Speed::Velocity(velocity), Some(speed)) => {
                let own = point
                    .speed
                    .stated_by(Quantity::RotationalSpeed, &study.settings(slice.case(0, 0)))
                    .value();
                ((speed - own).abs() > MAX_SPEED_DIFFERENCE * own).then_some((velocity, speed, own))
            }
            _ => None,
        };
    let mut contradicting = measured.iter().filter_map(|point| {
        let of_point = |slice: &&Slice| {
            points_of(study, slice, std::slice::from_ref(point))
                .next()
                .is_some()
        };
        let all: Option<Vec<_>> = slices
            .iter()
            .filter(of_point)
            .map(|slice| contradicts(slice, point))
            .collect();
        all?.first().copied()
    });
    let (velocity, speed, own) = contradicting.next()?;
    let statement = format!(
        "{} of {} measured points have a velocity and a rotational speed that contradict each other, the first {} m/s and {} rpm; the \
         tool of the study turns at {} rpm then. The velocities are compared. Correct the table or the radius of the tool, or name the \
         right column alone, as in columns.rotational_speed_rpm = \"rotational_speed_rpm\".",
        1 + contradicting.count(),
        measured.len(),
        short(velocity),
        short(speed),
        short(own)
    );
    Some(Unusual {
        path: "measured.file",
        statement,
    })
}

/// Reports a quantity whose `values` are far outside of the values of a side. `factor` converts
/// from the unit of the quantity's key to the unit of the side.
fn far_values(quantity: Quantity, values: &[f64], side: &Varied, factor: f64) -> Option<Unusual> {
    let (least, largest) = (side.values[0], side.values[side.values.len() - 1]);
    let is_far = |value: &f64| *value > FAR_FACTOR * largest || *value < least / FAR_FACTOR;
    let far: Vec<f64> = values.iter().copied().filter(is_far).collect();
    let first = *far.first()?;
    let [least, largest] = [least, largest].map(|end| end / factor);
    let key = quantity.key();
    let slip = match quantity.unit_between(first / factor, [least / 2.0, 2.0 * largest]) {
        Some(unit) => format!(
            "State it, as in columns.{key} = {{ column = \"…\", unit = \"{}\" }}.",
            unit.name()
        ),
        None => {
            "State it under columns, or decimal = \".\" if commas separate thousands.".to_owned()
        }
    };
    let rotational = match quantity {
        Quantity::Velocity => ", or a column of rotational speeds, which is `rotational_speed_rpm`",
        _ => "",
    };
    let own = quantity.unit_names().next().unwrap_or_default();
    let statement = format!(
        "{} of {} measured values of `{key}` are far outside of the study, the first with {} {own}; the study has {}{own}. A likely slip: the \
         unit of the column{rotational}. {slip}",
        far.len(),
        values.len(),
        short(first / factor),
        if side.varies() {
            format!("{} to {} ", short(least), short(largest))
        } else {
            format!("{} ", short(least))
        }
    );
    Some(Unusual {
        path: "measured.file",
        statement,
    })
}

/// Returns the values of a side in words.
fn range(side: &Varied) -> String {
    let [least, largest] = [side.values[0], side.values[side.values.len() - 1]].map(short);
    // In the unit of the key, as in the table.
    let (symbol, unit) = (
        side.setting.symbol(),
        side.setting
            .parameter()
            .map_or("", |parameter| parameter.unit),
    );
    if side.varies() {
        format!("{symbol} = {least} to {largest} {unit}")
    } else {
        format!("{symbol} = {least} {unit}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insight::measured::tests::{point, study};

    #[test]
    fn points_far_outside_of_a_study_are_told_with_their_unit() {
        let at = |speed: f64, depth: f64| point(speed, depth, 1.0, None);
        let rotational = |speed: f64| Measurement {
            speed: Speed::Rotational(speed),
            ..at(0.0, 1e-3)
        };
        // At 15 m/s a tip radius of 0.18 m turns at 796 rpm.
        let both = |speed| Measurement {
            second_speed_rpm: Some(speed),
            ..at(15.0, 1.5e-3)
        };
        let table: [(&[Measurement], &[&str]); 9] = [
            (&[], &[]),
            (&[at(15.0, 1.5e-3), at(30.0, 1e-3)], &[]),
            (
                &[at(15.0, 1.5e-3), at(15.0, 2.0)],
                &[
                    "1 of 2 measured values of `penetration_depth_m`",
                    "first with 2 m; the study has 0.001 to 0.004 m",
                    "unit = \"mm\"",
                ],
            ),
            (
                &[at(900.0, 1e-3)],
                &["unit = \"m/min\"", "rotational_speed_rpm"],
            ),
            (&[rotational(12.0)], &["first with 12 rpm", "unit = \"Hz\""]),
            (&[both(796.0), both(800.0)], &[]),
            (
                &[
                    point(15.0, 1.5e-3, -5.0, None),
                    point(15.0, 2e-3, -7.0, None),
                ],
                &["All measured normal forces are negative"],
            ),
            (
                &[both(800.0), both(1023.0)],
                &[
                    "1 of 2 measured points have a velocity and a rotational speed that",
                    "the first 15 m/s and 1023 rpm; the tool of the study turns at 79",
                ],
            ),
            (
                &[at(30.0, 1e-3)],
                &["None of the 1 measured points", "v_b = 10 to 20 m/s"],
            ),
        ];
        for (points, expected) in table {
            let told = unusual_points(&study(), points);
            assert_eq!(told.len(), usize::from(!expected.is_empty()), "{told:?}");
            for (told, part) in told
                .iter()
                .flat_map(|told| expected.iter().map(move |part| (told, part)))
            {
                assert!(told.statement.contains(part), "{told:?}");
            }
        }
    }
}
