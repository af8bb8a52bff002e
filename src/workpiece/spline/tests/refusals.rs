//! Control points that are refused.

use super::*;

#[test]
fn bad_points_are_refused() {
    let line = [[0.0, 0.0], [0.1, 0.0], [0.2, 0.0], [0.3, 0.0]];
    let refused = |points: &[ProfilePoint], degree, closed| {
        Spline::new(points, degree, closed).expect_err("it is refused")
    };
    assert_eq!(
        refused(&[[0.0, 0.0], [f64::NAN, 0.0]], 1, false),
        SplineError::NotFinite { point: 2 }
    );
    assert_eq!(
        refused(&[[0.0, 0.0], [0.0, 0.0], [0.0, -2e3]], 1, false),
        SplineError::NotFinite { point: 3 }
    );
    assert_eq!(refused(&line, 0, false), SplineError::Degree { degree: 0 });
    assert_eq!(
        refused(&line, 11, false),
        SplineError::Degree { degree: 11 }
    );
    assert_eq!(
        refused(&line, 4, false),
        SplineError::TooFewPoints {
            given: 4,
            needed: 5,
            degree: 4,
            closed: false
        }
    );
    assert_eq!(
        refused(&line[..2], 1, true),
        SplineError::TooFewPoints {
            given: 2,
            needed: 3,
            degree: 1,
            closed: true
        }
    );
    assert_eq!(
        refused(&[[0.1, 0.2]; 5], 3, false),
        SplineError::Stops {
            position: [0.1, 0.2],
            point: 1
        }
    );
    let stopped = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.0], [0.2, 0.1]];
    assert_eq!(
        refused(&stopped, 1, false),
        SplineError::Stops {
            position: [0.1, 0.0],
            point: 2
        }
    );
    // A clamped end has no direction if two points coincide there, but the curve does not go
    // straight.
    let blunt = [[0.0, 0.0], [0.0, 0.0], [0.1, 0.0], [0.1, 0.1]];
    assert!(matches!(
        refused(&blunt, 3, false),
        SplineError::Stops { point: 1, .. }
    ));
    let back = [[0.0, 0.0], [0.2, 0.0], [0.1, 0.0]];
    assert_eq!(
        refused(&back, 1, false),
        SplineError::TurnsBack {
            position: [0.2, 0.0],
            point: 2
        }
    );
    assert_eq!(
        refused(&back, 1, true),
        SplineError::TurnsBack {
            position: [0.0, 0.0],
            point: 1
        }
    );
    assert!(matches!(
        refused(&back, 2, false),
        SplineError::Stops { .. }
    ));
}

#[test]
fn curves_that_cross_themselves_are_refused() {
    let eight = [[0.0, 0.0], [0.1, 0.1], [0.1, 0.0], [0.0, 0.1]];
    let bow = [
        [0.0, 0.0],
        [0.2, 0.0],
        [0.2, 0.1],
        [0.1, 0.1],
        [0.1, -0.1],
        [0.3, -0.1],
    ];
    for degree in [1, 2, 3] {
        let error = Spline::new(&eight, degree, true).expect_err("it crosses itself");
        let SplineError::Crosses { position: [x, y] } = error else {
            panic!("degree {degree}: {error}")
        };
        assert!(
            (x - 0.05).abs() < 0.02 && (y - 0.05).abs() < 1e-2,
            "degree {degree}: {error}"
        );
        assert!(Spline::new(&bow, degree, false).is_err());
    }
    // A horseshoe: its ends meet if they are continued straight, those of a hook meet its other
    // side.
    let horseshoe = [
        [0.0, 0.0],
        [-0.05, 0.1],
        [0.1, 0.2],
        [0.25, 0.1],
        [0.2, 0.0],
    ];
    let error = Spline::new(&horseshoe, 2, false).expect_err("its continuations meet");
    let SplineError::EndsCross { position: [x, y] } = error else {
        panic!("{error}")
    };
    assert!(
        (x - 0.1).abs() < 1e-15 && (y + 0.2).abs() < 1e-15,
        "{error}"
    );
    let hook = [[0.0, 0.0], [0.0, 0.2], [0.2, 0.2], [0.2, 0.1], [0.1, 0.1]];
    let error = Spline::new(&hook, 1, false).expect_err("its end meets its start");
    let SplineError::EndsCross { position: [x, y] } = error else {
        panic!("{error}")
    };
    assert!(x == 0.0 && (y - 0.1).abs() < 1e-6, "{error}");
    assert!(error.to_string().contains("close it, or move the ends"));
    Spline::new(&hook, 1, true).expect("closed it does not cross");
    // Parts that run close to each other do not touch.
    let narrow = [[0.0, 0.0], [0.1, 0.0], [0.1, 1e-5], [0.0, 1e-5]];
    Spline::new(&narrow, 1, true).expect("it is a slit");
}
