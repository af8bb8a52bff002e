//! Are sweeping filaments more productive than striking ones? Simulates the paper's 120 contacts
//! with friction, and writes docs/productivity.md and its figure.
//!
//! ```text
//! cargo run --release -p bristle-benches --example productivity                 # docs/productivity*
//! cargo run --release -p bristle-benches --example productivity -- directory
//! ```
//!
//! `page.md` is the text. The program fills its tables and numbers in, and refuses to write a page
//! whose statements do not hold.

use std::collections::BTreeMap;
use std::error::Error;

use bristle::model::metrics::{Metrics, tool_force};
use bristle::model::settings::Settings;
use bristle_benches::{fixed, table, write_page};
use bristle_grid::{Study, run_study};
use bristle_report::drawing::diagram::{Curve, Diagram, Look};
use bristle_report::drawing::scale::Axis;

const PAGE: &str = include_str!("page.md");
/// Coefficient of friction.
const FRICTION: f64 = 0.3;
/// Numbers of the paper's velocities and depths, and their steps in m/s and mm.
const VELOCITIES: usize = 12;
const DEPTHS: usize = 10;
const VELOCITY_STEP: f64 = 2.5;
const DEPTH_STEP: f64 = 0.5;
/// Those of the tables, by number.
const SHOWN_VELOCITIES: [usize; 6] = [1, 2, 4, 6, 8, 12];
const SHOWN_DEPTHS: [usize; 5] = [1, 2, 4, 6, 10];
/// A contact time ratio from which on filaments sweep.
const SWEEPS: f64 = 0.5;

/// A contact.
struct Contact {
    velocity: f64,
    depth: f64,
    ratio: f64,
    force: f64,
    /// Sliding work of all filaments per time in W, to which removal and wear are in proportion.
    sliding_power: f64,
    /// The part of the drive's power that goes into sliding.
    share: f64,
}

impl Contact {
    fn new([velocity, depth]: [f64; 2], metrics: &Metrics) -> Self {
        let settings = settings([velocity, depth]);
        let sliding_power = tool_force(
            metrics.sliding_work_j,
            settings.tool.filament_count,
            settings.angular_velocity_rad_s(),
        );
        Self {
            velocity,
            depth,
            ratio: metrics.contact_time_ratio,
            force: metrics.tool_contact_normal_force_n,
            sliding_power,
            share: FRICTION * sliding_power / metrics.tool_power_w,
        }
    }

    fn sweeps(&self) -> bool {
        self.ratio >= SWEEPS
    }
}

/// The paper's brush at a velocity (m/s) and a depth (mm).
fn settings([velocity, depth]: [f64; 2]) -> Settings {
    let mut settings = Settings::paper(velocity, 1e-3 * depth);
    settings.contact.friction_coefficient = FRICTION;
    settings
}

fn main() -> Result<(), Box<dyn Error>> {
    let points: Vec<[f64; 2]> = (1..=DEPTHS)
        .flat_map(|depth| {
            (1..=VELOCITIES)
                .map(move |velocity| [VELOCITY_STEP * velocity as f64, DEPTH_STEP * depth as f64])
        })
        .collect();
    let results = run_study(
        &Study::of_cases(points.iter().copied().map(settings).collect()),
        None,
        || (),
    )?;
    let contacts = points
        .into_iter()
        .zip(results)
        .map(|(point, result)| Ok(Contact::new(point, &result?.metrics)))
        .collect::<Result<Vec<_>, String>>()?;
    let figures = [("share", figure(&contacts).draw().svg())];
    write_page(
        "productivity",
        PAGE,
        &values(&contacts),
        figures,
        claims(&contacts),
    )
}

/// The contact at a velocity and a depth, by their numbers from 1.
fn at(contacts: &[Contact], velocity: usize, depth: usize) -> &Contact {
    &contacts[(depth - 1) * VELOCITIES + velocity - 1]
}

fn mean(contacts: &[Contact], sweeping: bool, value: impl Fn(&Contact) -> f64) -> f64 {
    let values: Vec<f64> = contacts
        .iter()
        .filter(|contact| contact.sweeps() == sweeping)
        .map(value)
        .collect();
    values.iter().sum::<f64>() / values.len() as f64
}

/// Sliding speed under load over that of the tips.
fn slowness(contact: &Contact) -> f64 {
    contact.sliding_power / (contact.force * contact.velocity)
}

fn values(contacts: &[Contact]) -> BTreeMap<&'static str, String> {
    let heads: Vec<String> = SHOWN_DEPTHS
        .map(|depth| format!("{} mm", DEPTH_STEP * depth as f64))
        .to_vec();
    let heads: Vec<&str> = std::iter::once("v_b in m/s")
        .chain(heads.iter().map(String::as_str))
        .collect();
    let rows = |cell: &dyn Fn(&Contact) -> String| {
        let row = |velocity: usize| {
            let cells = SHOWN_DEPTHS
                .iter()
                .map(|depth| cell(at(contacts, velocity, *depth)));
            std::iter::once((VELOCITY_STEP * velocity as f64).to_string())
                .chain(cells)
                .collect()
        };
        table(&heads, SHOWN_VELOCITIES.into_iter().map(row))
    };
    let bold = |contact: &Contact, text: String| {
        if contact.sweeps() {
            format!("**{text}**")
        } else {
            text
        }
    };
    BTreeMap::from([
        (
            "powers",
            rows(&|contact| bold(contact, fixed(0, contact.sliding_power))),
        ),
        (
            "shares",
            rows(&|contact| bold(contact, fixed(0, 100.0 * contact.share))),
        ),
        (
            "sweeping",
            contacts
                .iter()
                .filter(|contact| contact.sweeps())
                .count()
                .to_string(),
        ),
        (
            "share_sweeping",
            fixed(0, 100.0 * mean(contacts, true, |contact| contact.share)),
        ),
        (
            "share_striking",
            fixed(0, 100.0 * mean(contacts, false, |contact| contact.share)),
        ),
        ("slow_sweeping", fixed(2, mean(contacts, true, slowness))),
        ("slow_striking", fixed(2, mean(contacts, false, slowness))),
        ("power_20", fixed(0, at(contacts, 8, 6).sliding_power)),
        ("power_30", fixed(0, at(contacts, 12, 6).sliding_power)),
        ("deep_30", fixed(0, at(contacts, 12, 10).sliding_power)),
    ])
}

/// The statements of the page that depend on its numbers, and whether they hold.
fn claims(contacts: &[Contact]) -> Vec<(&'static str, bool)> {
    let largest = contacts
        .iter()
        .max_by(|a, b| a.sliding_power.total_cmp(&b.sliding_power))
        .expect("120 contacts");
    vec![
        (
            "sweeping filaments put more of the drive's power into sliding",
            {
                mean(contacts, true, |contact| contact.share)
                    > 1.6 * mean(contacts, false, |contact| contact.share)
            },
        ),
        ("at 3 mm the rate falls where filaments begin to strike", {
            let [slow, fast] = [8, 12].map(|velocity| at(contacts, velocity, 6));
            slow.sweeps() && !fast.sweeps() && fast.sliding_power < slow.sliding_power
        }),
        (
            "the largest rate is that of the fastest, deepest contact, which sweeps",
            { largest.sweeps() && largest.velocity == 30.0 && largest.depth == 5.0 },
        ),
        (
            "at each velocity the rate rises with the depth as long as filaments sweep",
            {
                (1..=VELOCITIES).all(|velocity| {
                    (1..DEPTHS).all(|depth| {
                        let [shallow, deep] =
                            [depth, depth + 1].map(|depth| at(contacts, velocity, depth));
                        !shallow.sweeps() || deep.sliding_power > shallow.sliding_power
                    })
                })
            },
        ),
    ]
}

fn figure(contacts: &[Contact]) -> Diagram {
    let points = |sweeping: bool| {
        let own = contacts
            .iter()
            .filter(move |contact| contact.sweeps() == sweeping);
        own.map(|contact| (contact.ratio, 100.0 * contact.share))
    };
    Diagram {
        title: "Part of the drive's power that goes into sliding".to_owned(),
        subtitle: format!(
            "120 contacts of the paper's brush, µ = {FRICTION}; the rest goes into vibration"
        ),
        x: Axis::from_zero("contact time ratio ε_tc"),
        y: Axis::from_zero("µ times sliding work over drive work in %"),
        curves: vec![
            Curve::new("striking", Look::Markers, points(false)).with_pen(1),
            Curve::new("sweeping", Look::Markers, points(true)).with_pen(0),
        ],
    }
}
