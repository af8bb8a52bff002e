//! Pairs of filaments at rest.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};

use bristle::brush::{Assembly, PressLaw};
use bristle::contact::ContactLaw;
use bristle::equations::linear::{add, scale};
use bristle::equations::{Clamp, PolarAxis};
use bristle::model::filament::{bending_stiffness, chain};
use bristle::model::settings::{ContactSettings, FilamentSettings, Settings};
use bristle::simulation::Filament;
use bristle::tool::ClampMotion;
use bristle::workpiece::{Part, Plane};

use crate::chains::{extrapolated, paper_case, worse};
use crate::exact::held::{Circle, Held};
use crate::exact::pressed::FilamentContactLaw;
use crate::trial::{Failure, Trial, TrialResult};
use crate::{sources, tolerances};

/// A clamp that moves by `way` (m) from time zero to `time` (s), smoothly, and then rests.
#[derive(Clone, Copy, Debug)]
struct Approaching {
    /// Position at rest in m.
    root: [f64; 3],
    direction: [f64; 3],
    way: [f64; 3],
    time: f64,
}

impl Approaching {
    /// A clamp that does not move.
    fn still(root: [f64; 3], direction: [f64; 3]) -> Self {
        Self {
            root,
            direction,
            way: [0.0; 3],
            time: 1.0,
        }
    }
}

impl ClampMotion for Approaching {
    fn at(&self, time: f64) -> Clamp<f64> {
        let t = (time / self.time).clamp(0.0, 1.0);
        // The polynomial of degree five without velocity and acceleration at both ends.
        let left = 1.0 - t.powi(3) * (10.0 - t * (15.0 - 6.0 * t));
        let rate = 30.0 * t * t * (1.0 - t).powi(2) / self.time;
        let change = 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) / (self.time * self.time);
        Clamp {
            position: add(self.root, scale(-left, self.way)),
            velocity: scale(rate, self.way),
            acceleration: scale(change, self.way),
            direction: self.direction,
            direction_rate: [0.0; 3],
            angular_velocity: [0.0; 3],
        }
    }
}

/// One of two filaments: its settings, its clamp, and the direction in which it starts, straight.
struct PairMember {
    filament: FilamentSettings,
    clamp: Approaching,
    start: [f64; 3],
}

impl PairMember {
    /// A filament that starts in the direction of its clamp.
    fn new(filament: FilamentSettings, clamp: Approaching) -> Self {
        Self {
            filament,
            clamp,
            start: clamp.direction,
        }
    }
}

/// Assembles the filaments, which press on each other with the default stiffness, without damping
/// and friction.
fn assembly(members: &[PairMember], points: usize) -> Assembly<Approaching> {
    /// Tolerance in m/s.
    const TOLERANCE: f64 = 1e-7;
    let filaments = members.iter().map(
        |PairMember {
             filament, clamp, ..
         }| Filament {
            chain: chain(filament, [0.0; 3]),
            motion: *clamp,
            law: ContactLaw::from(&ContactSettings::default()),
            workpiece: Part::Plane(Plane::new([0.0, -1e3, 0.0], [0.0, 1.0, 0.0], [0.0; 3])),
        },
    );
    let radii: Vec<f64> = members
        .iter()
        .map(|member| 0.5 * member.filament.diameter_m)
        .collect();
    let law = PressLaw {
        damping: 0.0,
        friction: 0.0,
        ..PressLaw::of(&Settings::paper(10.0, 1e-3))
    };
    let coordinates = |index: usize| {
        let PairMember {
            filament, start, ..
        } = &members[index];
        let [q, v, _] = PolarAxis::Z.coordinates([*start, [0.0; 3], [0.0; 3]]);
        [vec![q; filament.segments], vec![v; filament.segments]]
    };
    Assembly::new(
        filaments.collect(),
        &radii,
        law,
        points,
        coordinates,
        TOLERANCE,
    )
}

/// The paper's filament of `segments` segments.
fn filament(segments: usize) -> Result<FilamentSettings, Failure> {
    Ok(paper_case(segments, 10.0, 1e-3)?.filament)
}

/// Contact law between the paper's filaments.
fn pressing(filament: &FilamentSettings) -> FilamentContactLaw {
    FilamentContactLaw {
        stiffness: PressLaw::of(&Settings::paper(10.0, 1e-3)).stiffness,
        reach: filament.diameter_m,
    }
}

/// The force on filament `index` in N.
fn force_on(assembly: &Assembly<Approaching>, index: usize) -> [f64; 3] {
    assembly
        .presses()
        .fold([0.0; 3], |sum, (filaments, force, _)| {
            let sign = if filaments[0] == index {
                1.0
            } else if filaments[1] == index {
                -1.0
            } else {
                0.0
            };
            add(sum, scale(sign, force))
        })
}

/// Advances to `end` (s) in steps of `step` (s), and shorter ones where Newton's method needs them.
fn advance(assembly: &mut Assembly<Approaching>, end: f64, step: f64) -> Result<(), Failure> {
    let mut length = step;
    while end - assembly.time() > 1e-9 * step {
        match assembly.step(length.min(end - assembly.time())) {
            Ok(()) => length = (2.0 * length).min(step),
            Err(_) if length > 1e-6 * step => length *= 0.5,
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

/// Number of contact points per segment of 1.6 mm.
const POINTS: usize = 128;

/// Straight filaments that come as near as `d − δ`.
///
/// Parallel ones press with `k_l δ` per length, crossed ones with `k_l g [2 d asinh(w/g) − 2 w]/sin
/// α`, `g = d − δ`, `w = √(d² − g²)`. The midpoint rule must resolve the length 2 w. Its error
/// depends on where its points lie, so that the largest error of eight places counts.
pub fn straight(trial: &mut Trial) -> TrialResult {
    const SEGMENTS: usize = 25;
    const OVERLAP: f64 = 1e-5;
    /// Places at which the filaments cross, along a part of the rule.
    const SHIFTS: usize = 8;
    let filament = filament(SEGMENTS)?;
    let (pressing, length) = (pressing(&filament), filament.length_m);
    let height = pressing.reach - OVERLAP;
    let force = |root: [f64; 3], direction: [f64; 3], points: usize| {
        let below = PairMember::new(
            filament.clone(),
            Approaching::still([0.0; 3], [1.0, 0.0, 0.0]),
        );
        let above = PairMember::new(filament.clone(), Approaching::still(root, direction));
        let [_, _, force] = force_on(&assembly(&[below, above], points), 1);
        force
    };
    for (name, angle) in [("90°", FRAC_PI_2), ("30°", FRAC_PI_6)] {
        let (hertz, exact) = (
            pressing.hertz(OVERLAP, angle),
            pressing.crossed(OVERLAP, angle),
        );
        let (sine, cosine) = angle.sin_cos();
        let forces = |points: usize| {
            (0..SHIFTS).map(move |shift| {
                let part = length / (SEGMENTS * points) as f64;
                let middle = 0.5 * length + shift as f64 / SHIFTS as f64 * part;
                force(
                    [middle * (1.0 - cosine), -middle * sine, height],
                    [cosine, sine, 0.0],
                    points,
                )
            })
        };
        let farthest = |points: usize, reference: f64| {
            forces(points).fold(reference, |farthest, force| {
                if (force - reference).abs() > (farthest - reference).abs() {
                    force
                } else {
                    farthest
                }
            })
        };
        let subject = format!("crossed at {name}, N_q = {POINTS}, the farthest of {SHIFTS} places");
        let computed = [hertz, exact].map(|reference| farthest(POINTS, reference));
        trial.check(
            &subject,
            "F in N, δ ≪ d",
            hertz,
            sources::HERTZ_CROSSED,
            computed[0],
            tolerances::PRESSED,
        );
        trial.check(
            subject,
            "F in N",
            exact,
            sources::PRESSED,
            computed[1],
            tolerances::PRESSED_INTEGRAL,
        );
    }
    for points in [1, 3, 32] {
        let computed = force([0.0, 0.0, height], [1.0, 0.0, 0.0], points) / length;
        let (exact, subject) = (
            pressing.stiffness * OVERLAP,
            format!("parallel, N_q = {points}"),
        );
        trial.check(
            subject,
            "F/L in N/m",
            exact,
            sources::PRESSED,
            computed,
            tolerances::PARALLEL,
        );
    }
    const LEAN: f64 = 1e-3;
    let exact = pressing.wedge(OVERLAP, LEAN);
    let leaning = |points: usize| force([0.0, 0.0, height], [LEAN.cos(), 0.0, LEAN.sin()], points);
    let subject = format!("at an angle of {LEAN} in one plane, N_q = {POINTS}");
    trial.check(
        subject,
        "F in N",
        exact,
        sources::PRESSED,
        leaning(POINTS),
        tolerances::PRESSED_INTEGRAL,
    );
    Ok(())
}

/// Distances of the crossing from both clamps in m.
const ARMS: [[f64; 2]; 3] = [[0.016, 0.012], [0.008, 0.006], [0.004, 0.003]];

/// Compliance of the chain to a force across it at the distance `arm` (m) from its root, in m/N.
fn compliance_of_chain(filament: &FilamentSettings, arm: f64) -> f64 {
    let chain = chain(filament, [0.0; 3]);
    let joints = chain.links.iter().enumerate().map(|(k, link)| {
        let lever = (arm - k as f64 * chain.length).max(0.0);
        lever * lever / link.stiffness
    });
    joints.sum()
}

/// Force in N between crossed cantilevers of `segments` segments at rest, whose clamps have
/// approached by `approach` (m) since they first touched. With `swapped`, the other one comes first
/// in memory, and filaments without contact lie between them.
fn pressed_force(
    segments: usize,
    [first, second]: [f64; 2],
    approach: f64,
    swapped: bool,
) -> Result<f64, Failure> {
    /// Length per point in m.
    const PART: f64 = 2.5e-5;
    /// Times in s: of the approach, and until the filaments rest.
    const TIMES: [f64; 2] = [0.01, 0.05];
    let filament = FilamentSettings {
        damping_ratio: 1.0,
        ..filament(segments)?
    };
    let reach = filament.diameter_m;
    let points = (filament.length_m / segments as f64 / PART).round() as usize;
    let below = PairMember::new(
        filament.clone(),
        Approaching::still([0.0; 3], [1.0, 0.0, 0.0]),
    );
    let above = Approaching {
        root: [first, -second, reach - approach],
        direction: [0.0, 1.0, 0.0],
        // It starts a little above.
        way: [0.0, 0.0, -1.1 * approach],
        time: TIMES[0],
    };
    let above = PairMember::new(filament.clone(), above);
    let (members, index) = if swapped {
        let idle = (1..9).map(|i| {
            let clamp = Approaching::still([0.0, 0.0, 0.1 * f64::from(i)], [1.0, 0.0, 0.0]);
            PairMember::new(filament.clone(), clamp)
        });
        (
            std::iter::once(above).chain(idle).chain([below]).collect(),
            0,
        )
    } else {
        (vec![below, above], 1)
    };
    let mut assembly = assembly(&members, points);
    advance(&mut assembly, TIMES[0], 2e-4)?;
    advance(&mut assembly, TIMES[1], 1e-3)?;
    let [_, _, force] = force_on(&assembly, index);
    Ok(force)
}

/// Cantilevers that cross at a right angle, one of which approaches by δ_0 after they touch:
/// `P = δ_0/(a_1³/(3 E I) + a_2³/(3 E I) + 1/k)` with `k = P/δ` and `P = (4/3) k_l √(2 d) δ^(3/2)`.
///
/// A chain itself yields by `Σ (a − k h)²/c_k` over the joints k before the contact.
pub fn cantilevers(trial: &mut Trial) -> TrialResult {
    const SEGMENTS: usize = 25;
    const APPROACHES: [f64; 4] = [1e-5, 2e-5, 5e-5, 1e-4];
    let mut largest = 0.0;
    for arms in ARMS {
        let fine = filament(2 * SEGMENTS)?;
        let (pressing, bending) = (pressing(&fine), bending_stiffness(&fine, fine.diameter_m));
        let of_beams = arms
            .iter()
            .map(|arm| arm.powi(3) / (3.0 * bending))
            .sum::<f64>();
        let of_chains = arms
            .iter()
            .map(|arm| compliance_of_chain(&fine, *arm))
            .sum::<f64>();
        let [a, b] = arms.map(|arm| 1e3 * arm);
        for approach in APPROACHES {
            let coarse = pressed_force(SEGMENTS, arms, approach, false)?;
            let computed = pressed_force(2 * SEGMENTS, arms, approach, false)?;
            let subject = format!("a = {a}, {b} mm, δ_0 = {} µm", 1e6 * approach);
            let (source, tolerance) = (sources::CANTILEVERS, tolerances::PRESSED);
            let exact = pressing.cantilevers(of_beams, approach);
            let limit = extrapolated(coarse, computed);
            trial.check(
                format!("{subject}, n → ∞"),
                "P in N",
                exact,
                source,
                limit,
                tolerance,
            );
            let (exact, subject) = (
                pressing.cantilevers(of_chains, approach),
                format!("{subject}, n = {}", 2 * SEGMENTS),
            );
            trial.check(
                subject,
                "P in N, chains",
                exact,
                source,
                computed,
                tolerance,
            );
            if approach == APPROACHES[0] {
                let swapped = pressed_force(SEGMENTS, arms, approach, true)?;
                largest = worse((swapped / coarse - 1.0).abs(), largest);
            }
        }
    }
    let subject = "upper filament first in memory, in another group of lanes".to_owned();
    trial.check(
        subject,
        "change of P",
        0.0,
        sources::SYMMETRY,
        largest,
        tolerances::PLACE_IN_MEMORY,
    );
    Ok(())
}

/// Distance along `x` at which the filament lies over the other one, in m.
const REACH: f64 = 0.02;

/// Force in N on a filament of `segments` segments that rests over a stiff one, which would hold it
/// at the height `ratio` over the distance by the elastica; also the force of the elastica.
fn held_force(segments: usize, ratio: f64) -> Result<[f64; 2], Failure> {
    /// Length per point in m.
    const PART: f64 = 2.5e-5;
    const STIFFER: f64 = 1e4;
    /// Length of the stiff filament in m.
    const LENGTH: f64 = 0.01;
    /// Distance of the crossing from its root in m.
    const ARM: f64 = 0.003;
    let soft = FilamentSettings {
        damping_ratio: 1.0,
        ..filament(segments)?
    };
    let stiff = FilamentSettings {
        youngs_modulus_pa: STIFFER * soft.youngs_modulus_pa,
        length_m: LENGTH,
        ..soft.clone()
    };
    let pressing = pressing(&soft);
    let held = Held::over_edge(
        Circle {
            centre: [REACH, ratio * REACH],
            radius: 0.0,
            stiffness: f64::INFINITY,
        },
        0.0,
    );
    let expected = held.force * bending_stiffness(&soft, soft.diameter_m);
    let below = pressing.reach - pressing.overlap(expected);
    let (sine, cosine) = held.angle.sin_cos();
    let [x, z] = [REACH + below * sine, ratio * REACH - below * cosine];
    let above = (z + 1.5 * pressing.reach).atan2(x);
    let points = (soft.length_m / segments as f64 / PART).round() as usize;
    let members = [
        PairMember {
            filament: soft,
            clamp: Approaching::still([0.0; 3], [1.0, 0.0, 0.0]),
            start: [above.cos(), 0.0, above.sin()],
        },
        PairMember::new(stiff, Approaching::still([x, -ARM, z], [0.0, 1.0, 0.0])),
    ];
    let mut assembly = assembly(&members, points);
    advance(&mut assembly, 0.08, 2e-4)?;
    let [fx, _, fz] = force_on(&assembly, 0);
    Ok([fx.hypot(fz), expected])
}

/// Filament that rests across one 10⁴ times as stiff: a fixed edge of the radius d, which yields by
/// the δ of crossed filaments. The force is extrapolated from two n.
pub fn over_filament(trial: &mut Trial) -> TrialResult {
    const SEGMENTS: usize = 50;
    for ratio in [0.1, 0.25, 0.5] {
        let ([coarse, expected], [fine, _]) = (
            held_force(SEGMENTS, ratio)?,
            held_force(2 * SEGMENTS, ratio)?,
        );
        let (source, tolerance) = (sources::EDGE_ELASTICA, tolerances::HELD_BY_FILAMENT);
        trial.check(
            format!("y/x = {ratio}, n → ∞"),
            "R in N",
            expected,
            source,
            extrapolated(coarse, fine),
            tolerance,
        );
    }
    Ok(())
}
