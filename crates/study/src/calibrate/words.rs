//! A calibration in a few lines for people.

use crate::grid::DEPTH;
use crate::grid::Setting;
use crate::input::measured::Speed;
use crate::text::layout::wrap;
use crate::text::number::{percent, short, significant, with_error};

use crate::calibrate::{Calibration, Next, SquareRoot};

/// Probability below which more than noise makes the sum of squares as large.
const MIN_PROBABILITY: f64 = 0.01;
/// Relative change of the simulated radius from which on it is reported (MODEL).
const MAX_RADIUS_CHANGE: f64 = 5e-3;
/// Largest Δχ², over the variance, at which a second minimum is reported: noise makes such
/// differences.
const MAX_DELTA_CHI_SQUARED: f64 = 12.0;

/// Returns the result in lines of at most `width` columns: values, doubts about them, and advice.
#[must_use]
pub fn summary(calibration: &Calibration, width: usize) -> String {
    let mut text = String::new();
    lines(calibration)
        .iter()
        .for_each(|line| wrap(width, &mut text, "", line));
    text
}

/// Returns the statements of [`summary`].
#[must_use]
pub fn lines(calibration: &Calibration) -> Vec<String> {
    let mut lines = vec![format!(
        "{}{}; {}",
        values(calibration),
        correlation(calibration),
        fit(calibration)
    )];
    let mut line = |words: String| lines.push(words);
    for group in &calibration.undetermined {
        line(format!("not determined: {}", group.statement));
    }
    for (setting, fitted) in calibration.problem.fitted.iter().enumerate() {
        if let Some(end) = fitted.end(calibration.values[setting])
            && calibration.is_determined(setting)
        {
            line(format!(
                "{} is at the {end} end of its range; --fit {}=LOW..HIGH states another",
                fitted.setting().symbol(),
                fitted.parameter.path
            ));
        }
    }
    if let Some(probability) = calibration
        .probability()
        .filter(|probability| *probability < MIN_PROBABILITY)
    {
        line(format!(
            "noise alone explains such residuals with a probability of {}: look at residuals.csv for what they have in common, or \
             state larger standard deviations; errors are {} times as large as these say",
            if probability < 5e-4 {
                "less than 0.1 %".to_owned()
            } else {
                percent(probability)
            },
            significant((calibration.errors.scale / calibration.variance).sqrt())
        ));
    }
    match (&calibration.square_root, &calibration.problem.radii) {
        (Some(root), Some(radii)) => {
            line(square_root_words(calibration, root));
            if radii.change_when_refined() >= MAX_RADIUS_CHANGE {
                let change = percent(radii.change_when_refined());
                line(format!(
                    "the simulated radius still changes by {change} as more passes are added"
                ));
            }
        }
        _ => line(minima(calibration)),
    }
    if let Some(next) = calibration.next.first() {
        line(format!("measure next at {}", calibration.next_words(next)));
    }
    lines
}

/// Describes the fit of the radii by the square root of time.
#[must_use]
pub fn square_root_words(calibration: &Calibration, root: &SquareRoot) -> String {
    let freedom = calibration.degrees_of_freedom();
    let law = format!(
        "R² = R_0² + c² t with c = {} µm/√s",
        significant(1e6 * root.c_m_per_sqrt_s)
    );
    let how_well = match calibration.probability_of(root.chi_squared) {
        Some(probability) => {
            let chance = if probability < 1e-3 {
                "below 0.1 %".to_owned()
            } else {
                format!("of {}", percent(probability))
            };
            format!(
                "χ² = {:.1} of {freedom}, as large by noise alone with a probability {chance}",
                root.chi_squared
            )
        }
        None => {
            let squares = |radii: &[f64]| {
                let own = calibration.problem.observations.iter().zip(radii);
                own.map(|(own, radius)| (radius / own.value - 1.0).powi(2))
                    .sum::<f64>()
            };
            let error = |radii: &[f64]| percent((squares(radii) / radii.len() as f64).sqrt());
            format!(
                "it is within {} of them, the simulated growth within {}",
                error(&root.radii),
                error(&calibration.forces)
            )
        }
    };
    let trend = match root.trend {
        trend if trend < 0.0 => "early radii are larger than it says, late ones smaller",
        _ => "early radii are smaller than it says, late ones larger",
    };
    match calibration.square_root_fits(root) {
        Some(true) => format!("the square root of time fits the radii: {law}; {how_well}"),
        Some(false) => {
            format!("the square root of time does not fit the radii: {law}; {how_well}; {trend}")
        }
        None => format!(
            "as many settings as radii: whether the square root of time fits cannot be told; {law}"
        ),
    }
}

/// Formats the determined values: `E = 2.62 ± 0.05 GPa, µ = 0.198 ± 0.007`.
fn values(calibration: &Calibration) -> String {
    let determined =
        (0..calibration.values.len()).filter(|&setting| calibration.is_determined(setting));
    let texts: Vec<String> = determined
        .map(|setting| estimate(calibration, setting))
        .collect();
    if texts.is_empty() {
        "nothing is determined".to_owned()
    } else {
        texts.join(", ")
    }
}

/// Formats a setting with its value and its standard error: `E = 2.62 ± 0.05 GPa`.
#[must_use]
pub fn estimate(calibration: &Calibration, setting: usize) -> String {
    let own = calibration.problem.fitted[setting].setting();
    let value = with_error(
        calibration.values[setting] * own.factor(),
        calibration.standard_error(setting) * own.factor(),
    );
    format!("{} = {value} {}", own.symbol(), own.unit())
        .trim_end()
        .to_owned()
}

/// Formats the largest correlation of two settings.
fn correlation(calibration: &Calibration) -> String {
    let determined: Vec<usize> = (0..calibration.values.len())
        .filter(|&setting| calibration.is_determined(setting))
        .collect();
    let pairs = determined
        .iter()
        .flat_map(|&a| determined.iter().map(move |&b| (a, b)))
        .filter(|(a, b)| a < b);
    let largest = pairs.max_by(|a, b| {
        let [a, b] = [a, b].map(|&(a, b)| calibration.errors.correlation(a, b).abs());
        a.total_cmp(&b)
    });
    let Some((a, b)) = largest else {
        return String::new();
    };
    let value = calibration.errors.correlation(a, b);
    if determined.len() == 2 {
        return format!(" (correlation {value:.2})");
    }
    let [a, b] = [a, b].map(|setting| calibration.problem.fitted[setting].setting());
    format!(
        " (largest correlation {value:.2}, of {} and {})",
        a.symbol(),
        b.symbol()
    )
}

/// Describes the fit of the forces.
fn fit(calibration: &Calibration) -> String {
    let (count, freedom) = (
        calibration.problem.observations.len(),
        calibration.degrees_of_freedom(),
    );
    let measured = if count == 1 {
        calibration.problem.measured_once()
    } else {
        calibration.problem.measured()
    };
    if calibration.problem.has_std {
        let deviation = (calibration.chi_squared / count as f64).sqrt();
        return format!(
            "{count} {measured} within {deviation:.1} σ (χ² = {:.1} of {freedom})",
            calibration.chi_squared
        );
    }
    let observations = calibration
        .problem
        .observations
        .iter()
        .zip(&calibration.forces);
    let squares: f64 = observations
        .map(|(own, force)| (force / own.value - 1.0).powi(2))
        .sum();
    format!(
        "{count} {measured} within {} (they have no standard deviations)",
        percent((squares / count as f64).sqrt())
    )
}

/// Describes the minima that the starts found.
#[must_use]
pub fn minima(calibration: &Calibration) -> String {
    let Calibration {
        minima,
        stopped_starts,
        failed_starts,
        ..
    } = calibration;
    let here = minima[0].1;
    let starts =
        minima.iter().map(|(_, starts)| starts).sum::<usize>() + stopped_starts + failed_starts;
    if here == starts {
        let lead = if starts == 1 {
            "one start leads"
        } else {
            "all starts lead"
        };
        return format!("{lead} to this minimum");
    }
    let others = match minima.len() - 1 {
        0 => String::new(),
        1 => format!(", {} to another one", minima[1].1),
        count => format!(
            ", {} to {count} others",
            minima
                .iter()
                .skip(1)
                .map(|(_, starts)| starts)
                .sum::<usize>()
        ),
    };
    let stopped = if *stopped_starts > 0 {
        format!(", {stopped_starts} stopped far above")
    } else {
        String::new()
    };
    let failed = if *failed_starts > 0 {
        format!(", {failed_starts} cannot be simulated")
    } else {
        String::new()
    };
    let most = minima[0].0 + MAX_DELTA_CHI_SQUARED * calibration.errors.scale;
    let rival = minima.get(1).filter(|(squares, _)| *squares < most).map_or_else(
        || "; no other is nearly as low".to_owned(),
        |(squares, _)| {
            format!(
                "; another is nearly as low (χ² = {squares:.1} there): narrow the ranges of what is fitted, as in --fit \
                 KEY=LOW..HIGH"
            )
        },
    );
    let lead = if here == 1 { "leads" } else { "lead" };
    format!("{here} of {starts} starts {lead} to this minimum{others}{stopped}{failed}{rival}")
}

impl Calibration {
    /// Describes a point to measure at, and its benefit.
    #[must_use]
    pub fn next_words(&self, next: &Next) -> String {
        let best = next
            .shrinks
            .iter()
            .enumerate()
            .min_by(|a, b| a.1.total_cmp(b.1));
        let Some((setting, shrinks)) = best else {
            return String::new();
        };
        let of = self.problem.fitted[setting].setting();
        let tool = self
            .tool_name(next.place.tool)
            .map_or_else(String::new, |name| format!("{name}, "));
        format!(
            "{tool}{}: it would shrink the error of {} by {}",
            place(next),
            of.symbol(),
            percent(1.0 - shrinks)
        )
    }
}

/// Formats speed and depth, as they were measured.
fn place(next: &Next) -> String {
    let depth = Setting::Number(
        bristle::model::parameters::Parameter::find(DEPTH).expect("the table has the depth"),
    );
    let speed = match next.place.speed {
        Speed::Velocity(velocity) => format!("{} m/s", short(velocity)),
        Speed::Rotational(speed) => format!("{} rpm", short(speed)),
    };
    format!("{speed}, {}", depth.text(next.place.penetration_depth_m))
}
