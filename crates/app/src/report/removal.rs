//! Text of a removal.

use std::f64::consts::PI;

use bristle::model::settings::Settings;
use bristle_study::grid::removal::{Removal, RemovalRow};
use bristle_study::grid::uncertainty::scatters;
use bristle_study::text::layout::{Warning, wrap};
use bristle_study::text::number::significant;

use crate::report::figures::unit_of_time;

/// Returns the result of a removal in at most ten lines of the `width` (columns).
#[must_use]
pub fn removal_text(settings: &Settings, removal: &Removal, width: usize) -> String {
    let mut text = String::new();
    lines(settings, removal)
        .iter()
        .for_each(|line| wrap(width, &mut text, "", line));
    text
}

/// Returns warnings about the numbers of a removal.
#[must_use]
pub fn warnings(settings: &Settings, removal: &Removal) -> Vec<Warning> {
    let ignored = (settings.brush.is_some() && scatters(settings)).then(|| {
        Warning::new("with [brush] radius and time have no interval: [uncertainty] is ignored")
            .with_help("filaments alone have one: leave out [brush]", "")
    });
    let jumps = removal.is_unresolved().then(|| {
        Warning::new(format!(
            "the radius still changes by {:.1} % as more radii are simulated: the work on the edge jumps from radius to radius",
            100.0 * removal.change_when_refined
        ))
    });
    let dips = removal.softest().map(|soft| {
        let least = match removal.dips_through() {
            true => format!(
                "; they dip through smaller ones, which are taken for one of {:.3} mm",
                1e3 * removal.least_radius_m
            ),
            false => String::new(),
        };
        Warning::new(format!(
            "filaments dip {:.0} % of the radius into an edge of {:.3} mm, which is softer than it is sharp{least}",
            100.0 * soft.max_edge_penetration_m / soft.edge_radius_m,
            1e3 * soft.edge_radius_m
        ))
        .with_help("a stiffer contact shows whether that matters", "contact.stiffness_n_m = 1e6")
    });
    ignored.into_iter().chain(jumps).chain(dips).collect()
}

/// Returns the lines of [`removal_text`].
#[must_use]
pub fn lines(settings: &Settings, removal: &Removal) -> Vec<String> {
    let (Some(first), Some(last)) = (removal.rows.first(), removal.rows.last()) else {
        return Vec::new();
    };
    let own = settings.removal_or_default();
    let time = |seconds: f64| {
        let (unit, second) = unit_of_time(seconds);
        format!("{} {unit}", significant(seconds / second))
    };
    let mm = |length: f64| significant(1e3 * length);
    let angles: Vec<String> = removal
        .angles_rad
        .iter()
        .map(|angle| format!("{:.0}°", angle * 180.0 / PI))
        .collect();
    let radii = |row: &RemovalRow| match removal.angles_rad.len() {
        1 => mm(row.edge_radius_m),
        _ => format!(
            "{} and {}",
            mm(row.edge_radius_m),
            mm(row.second_edge_radius_m)
        ),
    };
    let band = match removal.has_band {
        true => format!(
            " [{} … {}]",
            mm(last.edge_radius_lower_95_m),
            mm(last.edge_radius_upper_95_m)
        ),
        false => String::new(),
    };
    let mut lines = vec![
        format!(
            "edge of {}: R = {} mm after {}, from {} mm{}",
            angles.join(" and "),
            format!("{}{band}", radii(last)),
            time(last.time_s),
            radii(first),
            if own.alternate {
                ", turning both ways"
            } else {
                ""
            },
        ),
        format!(
            "{} turns at {} rpm",
            significant(last.turns),
            significant(settings.rotational_speed_rpm())
        ),
    ];
    if let Some(feed) = own.edge_feed_velocity_m_s {
        let time = settings.tool.width_m / feed;
        lines.push(format!(
            "a feed of {} mm/s along the edge has each point under the brush for {} s: {} passes",
            mm(feed),
            significant(time),
            significant(last.time_s / time)
        ));
    }
    let rate = removal.preston_m2_n
        * last.sliding_work_j
        * settings.tool.filament_count
        * settings.angular_velocity_rad_s()
        / (2.0 * PI);
    lines.push(format!(
        "removes {} mm³/min at the end, {} % of it from the edge; {} mm² of the edge's section in all",
        significant(60e9 * rate),
        significant(100.0 * last.edge_sliding_work_j / last.sliding_work_j.max(f64::MIN_POSITIVE)),
        significant(1e6 * last.removed_area_m2)
    ));
    let found = match own.preston_m2_n {
        Some(_) => "as stated",
        None => "from the edge that was observed",
    };
    lines.push(format!(
        "k_P = {} m²/N, {found}",
        significant(removal.preston_m2_n)
    ));
    if let Some(interval) = &removal.observed_interval {
        let [least, most] = interval.preston_m2_n.map(significant);
        lines.push(format!(
            "by its standard deviation, 95 % interval: k_P from {least} to {most} m²/N, R = {} mm after {} to {}",
            mm(last.edge_radius_m.max(last.second_edge_radius_m)),
            time(interval.time_s[0]),
            time(interval.time_s[1])
        ));
    }
    if let Some(wear) = own.filament_wear_m2_n {
        lines.push(format!(
            "filaments lose {} mm of {} mm, and F_n,w goes from {} to {} N; wear ratio {}",
            mm(first.filament_length_m - last.filament_length_m),
            mm(first.filament_length_m),
            significant(first.tool_contact_normal_force_n),
            significant(last.tool_contact_normal_force_n),
            significant(removal.preston_m2_n / wear)
        ));
        lines.push(match removal.life_s {
            Some(life) => format!(
                "F_n,w has fallen by {} % after {}",
                significant(100.0 * own.force_loss),
                time(life)
            ),
            None => format!(
                "F_n,w does not fall by {} % as the filaments wear",
                significant(100.0 * own.force_loss)
            ),
        });
    }
    let mut simulated: Vec<f64> = removal
        .simulated
        .iter()
        .map(|edge| edge.edge_radius_m)
        .collect();
    simulated.dedup();
    lines.push(format!(
        "{} radii simulated; with half of them R changes by {} % at most",
        simulated.len(),
        significant(100.0 * removal.change_when_refined)
    ));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use bristle::model::settings::{BrushSettings, UncertaintySettings};

    #[test]
    fn filaments_that_touch_say_that_deviations_are_ignored() {
        let removal = Removal {
            rows: Vec::new(),
            simulated: Vec::new(),
            preston_m2_n: 1e-14,
            observed_interval: None,
            angles_rad: Vec::new(),
            has_band: false,
            least_radius_m: 0.0,
            change_when_refined: 0.0,
            life_s: None,
        };
        let mut settings = Settings::paper(10.0, 1e-3);
        settings.uncertainty.diameter_std_m = 1e-5;
        assert_eq!(warnings(&settings, &removal), []);
        settings.brush = Some(BrushSettings::default());
        let told = warnings(&settings, &removal);
        let [ignored] = &told[..] else {
            panic!("{told:?}");
        };
        assert!(ignored.plain().contains("[uncertainty] is ignored"));
        settings.uncertainty = UncertaintySettings::default();
        assert_eq!(warnings(&settings, &removal), []);
    }
}
