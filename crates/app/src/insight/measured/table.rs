//! Compared forces as a table for people and as CSV.

use std::io::{self, Write};

use bristle_study::grid::Setting;
use bristle_study::input::measured::{Measurement, Quantity, Speed};
use bristle_study::text::layout::{aligned, wrap};
use bristle_study::text::number::short;

use super::{ComparedPoint, ForceComparison, ForceDeviation, Missing, SimulatedForce};

/// Maximum numbers of printed slices, and of printed points in each.
const MAX_PRINTED: (usize, usize) = (4, 40);

/// Width in N below which a band is printed with a decimal.
const NARROW_BAND_N: f64 = 10.0;

/// Force in N from which on forces are printed as powers of ten.
const MAX_PLAIN_FORCE_N: f64 = 1e5;

/// Returns a force with this number of decimals, or as a power of ten if it would not fit into a
/// table.
fn newtons(force: f64, decimals: usize) -> String {
    if force.abs() < MAX_PLAIN_FORCE_N {
        format!("{force:.decimals$}")
    } else {
        format!("{force:.2e}")
    }
}

/// Returns a difference between forces, with its sign.
fn signed(difference: f64) -> String {
    let sign = if difference.is_sign_negative() {
        ""
    } else {
        "+"
    };
    format!("{sign}{}", newtons(difference, 1))
}

/// Returns the deviations as a table for people, with prose in lines of at most `width` columns.
#[must_use]
pub fn comparison_table(comparisons: &[ForceComparison], width: usize) -> String {
    let mut text = String::new();
    for comparison in comparisons.iter().take(MAX_PRINTED.0) {
        let condition = match comparison.condition.as_str() {
            "" => String::new(),
            condition => format!(", {condition}"),
        };
        wrap(
            width,
            &mut text,
            "",
            &format!("F_n,w in N: simulated and measured{condition}"),
        );
        let first = comparison.points.first().map(|point| point.measured);
        let [speed, unit] = match first.map(|first| first.speed) {
            Some(Speed::Rotational(_)) => ["n_w", "rpm"],
            _ => ["v_b", "m/s"],
        };
        let has_std = first.is_some_and(|first| first.std_n.is_some());
        let std = if has_std { "± std" } else { "" };
        let spread = match (comparison.has_bands(), comparison.has_uncertainty()) {
            (true, _) => "95 %",
            (false, true) => "± N_f",
            (false, false) => "",
        };
        let headings = [
            [
                speed,
                "a_e",
                "measured",
                "simulated",
                "difference",
                "within",
            ],
            [unit, "mm", std, spread, "", "std"],
        ]
        .map(|heading| heading.map(str::to_owned));
        let points = comparison
            .points
            .iter()
            .take(MAX_PRINTED.1)
            .map(row_of_point);
        let shown = if has_std {
            headings[0].len()
        } else {
            headings[0].len() - 1
        };
        let rows: Vec<Vec<String>> = headings
            .into_iter()
            .chain(points)
            .map(|row| row[..shown].to_vec())
            .collect();
        aligned(&rows)
            .iter()
            .for_each(|line| text.push_str(&format!("{}\n", line.trim_end())));
        if comparison.points.len() > MAX_PRINTED.1 {
            text.push_str(&format!(
                "  … and {} more points\n",
                comparison.points.len() - MAX_PRINTED.1
            ));
        }
        let verdict = match comparison.deviation() {
            Some(ForceDeviation {
                count,
                bias_n,
                rmse_n,
                within,
            }) => {
                let within = within.map_or_else(String::new, |within| {
                    format!(
                        ", within ± std {within} ({:.0} %)",
                        100.0 * within as f64 / count as f64
                    )
                });
                format!(
                    "{count} of {} points compared: bias {} N, RMSE {} N{within}",
                    comparison.points.len(),
                    signed(bias_n),
                    newtons(rmse_n, 1)
                )
            }
            None => "no point can be compared".to_owned(),
        };
        wrap(width, &mut text, "  ", &verdict);
    }
    if comparisons.len() > MAX_PRINTED.0 {
        text.push_str(&format!(
            "… and {} more comparisons\n",
            comparisons.len() - MAX_PRINTED.0
        ));
    }
    text
}

/// Returns a point as a row of the table: speed, depth, measured and simulated force, difference,
/// and `yes` for a force within the standard deviation.
fn row_of_point(point: &ComparedPoint) -> [String; 6] {
    let Measurement {
        speed,
        penetration_depth_m,
        force_n,
        std_n,
        ..
    } = point.measured;
    let pair = |value: f64, spread: f64| format!("{} ± {}", newtons(value, 1), newtons(spread, 1));
    let measured = std_n.map_or_else(|| newtons(force_n, 1), |std| pair(force_n, std));
    let simulated = match point.simulated {
        Ok(SimulatedForce {
            force_n,
            band_n: Some([lower, upper]),
            ..
        }) => {
            let decimals = usize::from(upper - lower < NARROW_BAND_N);
            format!(
                "{} [{} … {}]",
                newtons(force_n, 1),
                newtons(lower, decimals),
                newtons(upper, decimals)
            )
        }
        Ok(SimulatedForce {
            force_n,
            uncertainty_n: 0.0,
            band_n: None,
        }) => newtons(force_n, 1),
        Ok(SimulatedForce {
            force_n,
            uncertainty_n,
            band_n: None,
        }) => pair(force_n, uncertainty_n),
        Err(missing) => missing.name().to_owned(),
    };
    let difference = point.difference_n().map(signed).unwrap_or_default();
    let within = point
        .is_within()
        .map_or("", |is_within| if is_within { "yes" } else { "no" });
    [
        short(speed.value()),
        short(1e3 * penetration_depth_m),
        measured,
        simulated,
        difference,
        within.to_owned(),
    ]
}

/// Writes `measured_comparison.csv`: a heading, then one row per point.
pub fn write_comparison(out: impl Write, comparisons: &[ForceComparison]) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    let further = comparisons
        .first()
        .map_or(&[][..], |comparison| &comparison.fixed);
    let bands = if comparisons.iter().any(ForceComparison::has_bands) {
        &["simulated_lower_95_n", "simulated_upper_95_n"][..]
    } else {
        &[]
    };
    let first = comparisons
        .first()
        .and_then(|comparison| comparison.points.first());
    let names = [
        first
            .map_or(Quantity::Velocity, |point| point.measured.speed.quantity())
            .key(),
        "penetration_depth_m",
        "measured_force_n",
        "measured_std_n",
        "simulated_force_n",
        "simulated_uncertainty_n",
    ];
    let further = further.iter().map(|(setting, _)| setting.path());
    let verdict = ["difference_n", "within_std", "status"];
    writer.write_record(
        further
            .chain(names)
            .chain(bands.iter().copied())
            .chain(verdict),
    )?;
    for comparison in comparisons {
        for point in &comparison.points {
            let Measurement {
                speed,
                penetration_depth_m,
                force_n,
                std_n,
                ..
            } = point.measured;
            let number = |number: f64| format!("{number:?}");
            let of_axis = |(setting, value): &(Setting, f64)| match setting.names() {
                Some(_) => setting.text(*value),
                None => number(*value),
            };
            let mut row: Vec<String> = comparison.fixed.iter().map(of_axis).collect();
            row.extend([speed.value(), penetration_depth_m, force_n].map(number));
            let simulated = point.simulated.ok();
            let optional = |value: Option<f64>| value.map_or_else(String::new, number);
            row.push(optional(std_n));
            row.push(optional(simulated.map(|simulated| simulated.force_n)));
            row.push(optional(simulated.map(|simulated| simulated.uncertainty_n)));
            let band = simulated.and_then(|simulated| simulated.band_n);
            row.extend((0..bands.len()).map(|end| optional(band.map(|band| band[end]))));
            row.push(optional(point.difference_n()));
            let within = point
                .is_within()
                .map(|within| if within { "yes" } else { "no" });
            row.push(within.unwrap_or_default().to_owned());
            row.push(
                point
                    .simulated
                    .map_or_else(Missing::name, |_| "ok")
                    .to_owned(),
            );
            writer.write_record(&row)?;
        }
    }
    writer.flush()
}
