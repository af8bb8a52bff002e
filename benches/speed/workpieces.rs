//! Other workpieces and friction against a plane without friction, measured alternately in one run,
//! in lanes on one thread.

use bristle::model::settings::{ProfileSettings, Settings, WorkpieceKind};
use criterion::Criterion;

use crate::planar::{compare, study};

/// Control points of a cubic spline of 20 pieces.
const POINTS: i32 = 23;

/// Prints the ratio of the times of the paper's 120 contacts on each workpiece and on a plane.
pub fn workpieces(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("workpieces");
    group.sample_size(10);
    let plane = contacts(|_| ());
    let of_kind = |kind: WorkpieceKind| contacts(|settings| settings.workpiece.kind = kind.clone());
    let middle = f64::from(POINTS - 1) / 2.0;
    // The spline is so flat that the motion is that on the plane.
    let spline = (0..POINTS)
        .map(|i| [5e-3 * (f64::from(i) - middle), 1e-6 * f64::from(i % 2)])
        .collect();
    let spline = ProfileSettings {
        control_points_m: spline,
        ..ProfileSettings::default()
    };
    let others = [
        (
            "an edge that filaments leave",
            of_kind(WorkpieceKind::edge(0.2e-3)),
        ),
        ("a cylinder", of_kind(WorkpieceKind::cylinder(0.1))),
        ("a bore", of_kind(WorkpieceKind::bore(0.3))),
        (
            "a spline of 20 pieces",
            of_kind(WorkpieceKind::Profile(spline)),
        ),
        (
            "a plane with friction",
            contacts(|settings| settings.contact.friction_coefficient = 0.3),
        ),
    ];
    for tolerance in [1e-6, 1e-3] {
        let at = |settings: &[Settings]| -> Vec<Settings> {
            let mut settings = settings.to_vec();
            settings
                .iter_mut()
                .for_each(|settings| settings.solver.relative_tolerance = tolerance);
            settings
        };
        let plane = at(&plane);
        for (name, other) in &others {
            let other = at(other);
            let name = format!("120 contacts, tolerance {tolerance:e}: a plane against {name}");
            let on_plane = || study(&plane, std::convert::identity);
            let on_other = || study(&other, std::convert::identity);
            compare(&mut group, &name, 1, &mut { on_plane }, &mut { on_other });
        }
    }
    group.finish();
}

/// The paper's 120 contacts after `change`.
pub fn contacts(change: impl Fn(&mut Settings)) -> Vec<Settings> {
    let velocities = (1..=12).map(|i| 2.5 * f64::from(i));
    let contacts = velocities.flat_map(|velocity| {
        (1..=10).map(move |j| Settings::paper(velocity, 0.5e-3 * f64::from(j)))
    });
    let mut contacts: Vec<Settings> = contacts.collect();
    contacts.iter_mut().for_each(change);
    contacts
}
