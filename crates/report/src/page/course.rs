//! The course of a contact over time, as the page draws it: curves and shapes of the filament.
//!
//! A [`Recorder`] collects courses while a study is simulated. Results that come from a journal
//! have none: cases of them that the page shows are simulated again. Each course is packed at once,
//! with two bytes per number.

use std::collections::BTreeSet;
use std::num::NonZeroUsize;
use std::sync::{Mutex, MutexGuard};
use std::{io, thread};

use serde::Serialize;

use super::packed::{Packed, rounded};
use super::selection::{MAX_COURSES, Selection, spread};
use crate::view::{View, height, is_upright, moved, root, sampled_pass};
use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::{
    Job, Kind, Pass, ProfileCell, Sample, Sampling, Simulation, Stop, sample_side_by_side,
    simulate_places,
};
use bristle::tool::places;
use bristle::workpiece::{ProfileCells, Workpiece, unit_normal};
use bristle_grid::{CaseResult, Study, thread_count};

const UNBROKEN: &str = "nothing panics with the queue in hand";

/// How a single turn is sampled: enough for curves 600 pixels wide and for smooth motion.
const SAMPLING: Sampling = Sampling {
    samples: 301,
    shapes: 141,
    loads: false,
    profile: true,
    alongside: true,
};
/// How several turns are sampled. Contacts are a small part of them; more samples would make the
/// page too large.
const SAMPLING_OF_TURNS: Sampling = Sampling {
    samples: 1201,
    shapes: 281,
    ..SAMPLING
};
/// How far from the axis the outline of the workpiece is drawn, in radii of the tool, and how far
/// off the drawing may be, in m.
const OUTLINE_REACH: f64 = 1.5;
const OUTLINE_ERROR: f64 = 2e-6;
/// Maximum number of points of a shape; longer chains are thinned out.
const MAX_POINTS: usize = 26;

/// The course of one case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Course {
    /// Number of the case in its study, counted from 0.
    #[serde(skip)]
    case: usize,
    /// Duration of the pass, and times of nominal entry and exit in the first turn, in s.
    end: f64,
    entry: f64,
    exit: f64,
    /// Duration of a turn in s, and `p_n` of each turn in N s.
    turn: f64,
    turn_impulses: Vec<f64>,
    /// Radii `r_g` and `R` in m, and height of the tool's axis above the workpiece in m.
    body_radius: f64,
    tool_radius: f64,
    axis_height: f64,
    /// The outline of the workpiece as it lies at time zero, with the material on its right-hand
    /// side, and its velocity along the surface in m/s.
    outline: Outline,
    feed: f64,
    /// Where along the profile the work is done.
    work: Work,
    /// Number of samples of the curves.
    samples: usize,
    /// Between two samples, the mean and the largest of `F_n` in N.
    mean_force: Packed,
    peak_force: Packed,
    /// `s_n` in m.
    deflection: Packed,
    /// Energies in J.
    kinetic: Packed,
    potential: Packed,
    dissipated: Packed,
    /// Number of shapes, and of points in each.
    shapes: usize,
    points: usize,
    /// Points from root to tip, shape by shape: along the surface, and above it, in m.
    along: Packed,
    above: Packed,
    /// Of a tool that is no upright radial one: the views along its axis and from the side, in
    /// place of the one that the numbers above are of, and the heights of tip and root in m.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    posed: Option<Posed>,
}

/// A tool that is no upright radial one.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Posed {
    views: Vec<ViewData>,
    /// Above the workpiece in m.
    tip_height: Packed,
    root_height: Packed,
}

/// A view of such a tool. Places are along the surface and above it, in m.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct ViewData {
    name: &'static str,
    /// Left, right, lower and upper end of what is shown.
    window: [f64; 4],
    outline: Outline,
    /// Outlines of the body and of the undeformed trim.
    body: Vec<Polyline>,
    trim: Vec<Polyline>,
    /// The ends of the cells of the work; none where they cannot be told from each other.
    work: Option<Polyline>,
    /// The points of the shapes, and how far the workpiece has moved with each shape.
    along: Packed,
    above: Packed,
    moved_along: Packed,
    moved_above: Packed,
}

/// Points along and above the surface in m.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Polyline {
    along: Packed,
    above: Packed,
}

impl Polyline {
    fn new(points: &[[f64; 2]]) -> Self {
        let pack = |k: usize| Packed::new(&points.iter().map(|point| point[k]).collect::<Vec<_>>());
        Self {
            along: pack(0),
            above: pack(1),
        }
    }
}

impl Posed {
    /// The views of `shapes`, of which the nodes `drawn` are shown; none of an upright tool.
    fn new(
        settings: &Settings,
        pass: &Pass,
        simulation: &Simulation,
        drawn: &[usize],
        worked: &ProfileCells,
    ) -> Option<Self> {
        if is_upright(settings) {
            return None;
        }
        let Simulation {
            shapes, history, ..
        } = simulation;
        let pack = |value: &dyn Fn(&Sample) -> f64| {
            Packed::new(&history.iter().map(value).collect::<Vec<_>>())
        };
        let above = |point, sample: &Sample| height(settings, pass, point, sample.time_s);
        let views = View::both(settings, pass).into_iter().map(|view| {
            let nodes = shapes
                .iter()
                .flat_map(|shape| drawn.iter().map(|&node| view.place(shape.nodes_m[node])));
            let nodes: Vec<[f64; 2]> = nodes.collect();
            let shifts: Vec<[f64; 2]> = shapes
                .iter()
                .map(|shape| view.shift(moved(pass, shape.time_s)))
                .collect();
            let Polyline {
                along: moved_along,
                above: moved_above,
            } = Polyline::new(&shifts);
            let Polyline { along, above } = Polyline::new(&nodes);
            let lines =
                |lines: &[Vec<[f64; 2]>]| lines.iter().map(|line| Polyline::new(line)).collect();
            let surface = Polyline::new(&view.surface.points);
            let work: Option<Vec<[f64; 2]>> = worked
                .points()
                .into_iter()
                .map(|end| view.on_profile(end))
                .collect();
            ViewData {
                name: view.name,
                window: window(nodes.iter().chain(&view.nearest)),
                outline: Outline {
                    along: surface.along,
                    above: surface.above,
                    solid: view.surface.is_filled,
                },
                body: lines(&view.body),
                trim: lines(&view.trim),
                work: work.as_deref().map(Polyline::new),
                along,
                above,
                moved_along,
                moved_above,
            }
        });
        Some(Self {
            views: views.collect(),
            tip_height: pack(&|sample| {
                above([sample.tip_x_m, sample.tip_y_m, sample.tip_z_m], sample)
            }),
            root_height: pack(&|sample| above(root(pass, sample.base_angle_rad), sample)),
        })
    }
}

/// Left, right, lower and upper end of points.
fn window<'a>(points: impl Iterator<Item = &'a [f64; 2]>) -> [f64; 4] {
    let empty = [
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    points.fold(empty, |[left, right, low, high], &[x, y]| {
        [left.min(x), right.max(x), low.min(y), high.max(y)]
    })
}

/// The view along the tool's axis with the workpiece below: the component of its normal across the
/// axis points up.
#[derive(Clone, Copy, Debug)]
pub(super) struct SideView {
    /// That component.
    up: [f64; 2],
    /// Height of the tool's axis above the workpiece in m.
    pub(super) axis_height: f64,
}

impl SideView {
    pub(super) fn new(settings: &Settings) -> Self {
        let [x, y, _] = unit_normal(&settings.workpiece);
        let across = x.hypot(y);
        let axis_height = (settings.reach_m() - settings.process.penetration_depth_m) / across;
        Self {
            up: [x / across, y / across],
            axis_height,
        }
    }

    /// The place of a point along the surface, in m.
    pub(super) fn along(&self, [r_x, r_y, _]: [f64; 3]) -> f64 {
        let [x, y] = self.up;
        y * r_x - x * r_y
    }

    /// Its height above the surface in m.
    pub(super) fn above(&self, [r_x, r_y, _]: [f64; 3]) -> f64 {
        let [x, y] = self.up;
        x * r_x + y * r_y + self.axis_height
    }

    /// The places and the heights of points in the plane of rotation.
    fn packed(&self, points: &[[f64; 2]]) -> [Packed; 2] {
        let coordinates: [fn(&Self, [f64; 3]) -> f64; 2] = [Self::along, Self::above];
        coordinates.map(|coordinate| {
            Packed::new(
                &points
                    .iter()
                    .map(|&[x, y]| coordinate(self, [x, y, 0.0]))
                    .collect::<Vec<_>>(),
            )
        })
    }
}

/// The outline of a workpiece: points along and above the surface in m.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Outline {
    along: Packed,
    above: Packed,
    /// Whether it goes round the material.
    solid: bool,
}

impl Outline {
    /// The outline as it lies at time zero.
    pub(super) fn new(pass: &Pass, settings: &Settings, view: &SideView) -> Self {
        let outline = pass
            .workpiece()
            .profile(OUTLINE_REACH * settings.tool_radius_m())
            .unwrap_or_default();
        let [along, above] = view.packed(&outline.simplified(OUTLINE_ERROR));
        Self {
            along,
            above,
            solid: outline.is_solid(),
        }
    }
}

/// The work by cells of the profile.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Work {
    /// Number of cells.
    cells: usize,
    /// The ends of the cells: arc lengths, and places along and above the surface, in m. There is
    /// one more than there are cells.
    arc_length: Packed,
    along: Packed,
    above: Packed,
    /// By cell: 1 on an edge, normal impulse in N s/m, and friction work in J/m.
    on_edge: Packed,
    impulse: Packed,
    friction: Packed,
}

impl Course {
    /// Number of the case in its study, counted from 0.
    #[must_use]
    pub fn case(&self) -> usize {
        self.case
    }

    fn new(case: usize, settings: &Settings, simulation: &Simulation) -> Self {
        let pass = sampled_pass(settings);
        let [entry, exit] = pass.nominal_times();
        let view = SideView::new(settings);
        let points = simulation
            .shapes
            .first()
            .map_or(0, |shape| shape.nodes_m.len());
        let drawn: Vec<usize> = spread(points, points.min(MAX_POINTS)).collect();
        // Other tools have views of their own.
        let shapes = if is_upright(settings) {
            &simulation.shapes[..]
        } else {
            &[]
        };
        let (mut along, mut above) = (Vec::new(), Vec::new());
        for shape in shapes {
            for &node in &drawn {
                along.push(view.along(shape.nodes_m[node]));
                above.push(view.above(shape.nodes_m[node]));
            }
        }
        let history = &simulation.history;
        let curve =
            |value: fn(&Sample) -> f64| Packed::new(&history.iter().map(value).collect::<Vec<_>>());
        let [first, last] = worked(&simulation.profile);
        let cells = pass.profile().unwrap_or_default().cells;
        let cells = ProfileCells {
            cells: cells.get(first..last).unwrap_or_default().to_vec(),
            period: None,
        };
        Self {
            case,
            end: simulation.end_time_s,
            entry,
            exit,
            turn: pass.turn_time(),
            turn_impulses: simulation
                .turn_contact_normal_impulses_n_s
                .iter()
                .copied()
                .map(rounded)
                .collect(),
            body_radius: settings.tool.body_radius_m,
            tool_radius: settings.tool_radius_m(),
            axis_height: view.axis_height,
            outline: Outline::new(&pass, settings, &view),
            feed: settings.workpiece.feed_velocity_m_s,
            work: Work::new(
                &cells,
                simulation.profile.get(first..last).unwrap_or_default(),
                &view,
            ),
            samples: history.len(),
            mean_force: Packed::new(&mean_forces(history)),
            peak_force: curve(|sample| sample.peak_contact_normal_force_n),
            deflection: curve(|sample| sample.tip_deflection_m),
            kinetic: curve(|sample| sample.kinetic_energy_j),
            potential: curve(|sample| sample.potential_energy_j),
            dissipated: curve(|sample| sample.dissipated_energy_j),
            shapes: simulation.shapes.len(),
            points: drawn.len(),
            along: Packed::new(&along),
            above: Packed::new(&above),
            posed: Posed::new(settings, &pass, simulation, &drawn, &cells),
        }
    }
}

/// The cells of `profile` from the first that has work to the one after the last.
fn worked(profile: &[ProfileCell]) -> [usize; 2] {
    let has_work = |cell: &ProfileCell| cell.normal_impulse_n_s_m > 0.0;
    let first = profile.iter().position(has_work).unwrap_or(0);
    [
        first,
        profile
            .iter()
            .rposition(has_work)
            .map_or(0, |last| last + 1),
    ]
}

impl Work {
    /// The work that is `shown` of the cells of `profile`.
    fn new(profile: &ProfileCells, shown: &[ProfileCell], view: &SideView) -> Self {
        let [along, above] = view.packed(&profile.points());
        let pack = |value: fn(&ProfileCell) -> f64| {
            Packed::new(&shown.iter().map(value).collect::<Vec<_>>())
        };
        Self {
            cells: profile.cells.len(),
            arc_length: Packed::new(&profile.boundaries()),
            along,
            above,
            on_edge: pack(|cell| f64::from(u8::from(cell.on_edge))),
            impulse: pack(|cell| cell.normal_impulse_n_s_m),
            friction: pack(|cell| cell.friction_work_j_m),
        }
    }
}

/// The mean of `F_n` in N since the previous sample. Unlike values at the samples, it misses no
/// impact, and its integral is `p_n`.
fn mean_forces(history: &[Sample]) -> Vec<f64> {
    let mean = |pair: &[Sample]| {
        let rise = pair[1].contact_normal_impulse_n_s - pair[0].contact_normal_impulse_n_s;
        (rise / (pair[1].time_s - pair[0].time_s)).max(0.0)
    };
    std::iter::once(0.0)
        .chain(history.windows(2).map(mean))
        .collect()
}

/// Records the courses of a study, at most [`MAX_COURSES`], evenly spread over the grid.
#[derive(Debug)]
pub struct Recorder<'a> {
    study: &'a Study,
    courses: Mutex<Vec<Course>>,
    stop: Stop,
}

impl<'a> Recorder<'a> {
    /// A recorder without a course.
    #[must_use]
    pub fn new(study: &'a Study) -> Self {
        Self {
            study,
            courses: Mutex::default(),
            stop: Stop::default(),
        }
    }

    /// The same recorder, which simulates no further case once `stop` is requested.
    #[must_use]
    pub fn until(self, stop: &Stop) -> Self {
        Self {
            stop: stop.clone(),
            ..self
        }
    }

    /// How the passes of the study have to be sampled for [`Recorder::take`]. Not at all if the
    /// study has more passes than the page has courses: simulating a few again is cheaper than
    /// sampling all.
    #[must_use]
    pub fn sampling(&self) -> Sampling {
        let all = self.study.case_count() <= MAX_COURSES && !self.study.scatters();
        if all {
            self.sampling_of_courses()
        } else {
            Sampling::default()
        }
    }

    /// How the passes with courses are sampled.
    fn sampling_of_courses(&self) -> Sampling {
        if self.study.takes_turns() {
            SAMPLING_OF_TURNS
        } else {
            SAMPLING
        }
    }

    /// Records a case, counted from 0, if its pass was sampled.
    ///
    /// # Panics
    /// If the study has no such case.
    pub fn take(&self, case: usize, pass: &Simulation) {
        // The history is empty too if some of its samples were not finite.
        if !pass.history.is_empty() {
            let course = Course::new(case, &self.at_depth(case, &pass.metrics), pass);
            self.courses().push(course);
        }
    }

    /// The settings of a case, at the depth that was found for its force if it states one.
    fn at_depth(&self, case: usize, found: &Metrics) -> Settings {
        let settings = self.study.settings(case);
        if settings.process.tool_force_n.is_some() {
            settings.at_depth(found.penetration_depth_m)
        } else {
            settings
        }
    }

    fn courses(&self) -> MutexGuard<'_, Vec<Course>> {
        self.courses
            .lock()
            .expect("nothing panics with the courses in hand")
    }

    /// Simulates the cases of the page that were not recorded, and returns all courses. Brushes
    /// have none.
    ///
    /// A case that failed, in `results` or now, has no course, nor do those that were under way or
    /// waiting when it was asked to stop. The default number of threads is the number of cores.
    /// Neither the number of threads nor the time of recording changes a course.
    ///
    /// # Errors
    /// If the threads cannot be started.
    pub fn finish(
        self,
        results: &[CaseResult],
        threads: Option<NonZeroUsize>,
    ) -> io::Result<Vec<Course>> {
        let study = self.study;
        if study.has_brush() {
            return Ok(Vec::new());
        }
        let recorded: BTreeSet<usize> = self.courses().iter().map(Course::case).collect();
        let waiting = Selection::with_course(study)
            .cases
            .into_iter()
            .filter(|case| !recorded.contains(case));
        let settings =
            |case: usize| Some(self.at_depth(case, &results[case].as_ref().ok()?.metrics));
        let all = waiting.filter_map(|case| Some((case, settings(case)?)));
        let (trims, alone): (Vec<_>, Vec<_>) =
            all.partition(|(_, settings)| places(settings).len() > 1);
        let trims = Mutex::new(trims);
        let mut queue: Vec<(Kind, f64, usize, Settings)> = alone
            .into_iter()
            .map(|(case, settings)| {
                (
                    Kind::of(&settings),
                    Pass::new(&settings).end_time(),
                    case,
                    settings,
                )
            })
            .collect();
        // Taken from the end: by kind, with the longest passes first, so that all threads finish at
        // about the same time.
        queue.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(b.2.cmp(&a.2)));
        let count = queue.len() + trims.lock().expect(UNBROKEN).len();
        let queue = Mutex::new(queue);
        let work = || {
            let take = |kind: Option<Kind>| {
                if self.stop.is_requested() {
                    return None;
                }
                let mut queue = queue.lock().expect(UNBROKEN);
                let (_, _, number, settings) =
                    queue.pop_if(|(next, ..)| kind.is_none_or(|kind| kind == *next))?;
                Some(Job {
                    number,
                    pass: Pass::new(&settings).until(&self.stop),
                })
            };
            let sampling = self.sampling_of_courses();
            sample_side_by_side(sampling, take, |number, result| {
                if let Ok(simulation) = result {
                    self.take(number, &simulation);
                }
            });
            let next = || trims.lock().expect(UNBROKEN).pop();
            while !self.stop.is_requested()
                && let Some((case, settings)) = next()
            {
                if let Ok(simulation) =
                    simulate_places(&settings, sampling, &self.stop, &mut |_| ())
                {
                    self.take(case, &simulation);
                }
            }
        };
        let threads = thread_count(threads);
        thread::scope(|scope| {
            for _ in 1..threads.min(count) {
                thread::Builder::new().spawn_scoped(scope, work)?;
            }
            work();
            Ok::<_, io::Error>(())
        })?;
        let mut courses = self
            .courses
            .into_inner()
            .expect("nothing panics with the courses in hand");
        courses.sort_unstable_by_key(Course::case);
        Ok(courses)
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use bristle::model::parameters::Parameter;
    use bristle::model::settings::WorkpieceKind;
    use bristle::simulation::{simulate, simulate_with};
    use bristle_grid::{Sweep, VELOCITY, run_study, simulate_cases};
    use bristle_input::document::Document;

    fn settings() -> Settings {
        let text = include_str!("../../../../examples/zirconia.toml");
        Document::parse(text, "zirconia.toml")
            .and_then(|document| document.settings())
            .expect("the example is right")
    }

    /// The example at three velocities.
    fn study() -> Study {
        let velocities = Sweep::list(
            Parameter::find(VELOCITY).expect("it exists"),
            vec![10.0, 30.0, 20.0],
        );
        Study::new(settings(), vec![velocities.expect("the values are right")])
            .expect("the study is right")
    }

    /// In this contact the filament bounces, and samples alone would miss most of it.
    #[test]
    fn forces_of_intervals_miss_nothing() {
        let settings = settings();
        let simulation = simulate_with(&settings, SAMPLING).expect("the pass ends");
        let history = &simulation.history;
        assert_eq!(
            (history.len(), simulation.shapes.len()),
            (SAMPLING.samples, SAMPLING.shapes)
        );
        let impulse: f64 = mean_forces(history)
            .iter()
            .skip(1)
            .zip(history.windows(2))
            .map(|(f, w)| f * (w[1].time_s - w[0].time_s))
            .sum();
        let peak = history
            .iter()
            .map(|sample| sample.peak_contact_normal_force_n)
            .fold(0.0, f64::max);
        let metrics = &simulation.metrics;
        // A sum of 300 terms, each with a difference of two integrals.
        assert!((impulse / metrics.contact_normal_impulse_n_s - 1.0).abs() < 1e-12);
        // The search for maxima resolves a millionth of a step; the force is level there.
        assert!((peak / metrics.peak_contact_normal_force_n - 1.0).abs() < 1e-6);
        let alone = simulate(&settings).expect("the pass ends").metrics;
        assert!(
            (metrics.contact_normal_impulse_n_s / alone.contact_normal_impulse_n_s - 1.0).abs()
                < 1e-6
        );
    }

    #[test]
    fn shapes_hang_on_the_body_and_keep_their_length() {
        let mut settings = settings();
        settings.workpiece.kind = WorkpieceKind::plane([1.0, 2.0, 0.5]);
        let simulation = simulate_with(&settings, SAMPLING).expect("the pass ends");
        for shape in &simulation.shapes {
            let [x, y, z] = shape.nodes_m[0];
            assert!((x.hypot(y) - settings.tool.body_radius_m).abs() < 1e-12 && z == 0.0);
            assert_eq!(shape.nodes_m.len(), settings.filament.segments + 1);
            for pair in shape.nodes_m.windows(2) {
                let length = (0..3)
                    .map(|i| (pair[1][i] - pair[0][i]).powi(2))
                    .sum::<f64>()
                    .sqrt();
                // Nodes are interpolated each for itself, which a step at the default tolerance
                // bends a little.
                assert!((length / (0.040 / 25.0) - 1.0).abs() < 1e-2, "{length}");
            }
        }
        let course = Course::new(0, &settings, &simulation);
        assert_eq!((course.shapes, course.points), (SAMPLING.shapes, 26));
        // Above the workpiece, but for what the contact gives way, and a step of packing.
        assert!(course.above.least() > -1e-3, "{}", course.above.least());
        assert!(course.above.least() < 1e-4, "{}", course.above.least());
    }

    #[test]
    fn courses_are_those_of_the_passes_alone() {
        let study = study();
        let results = run_study(&study, None, || {}).expect("the threads start");
        let courses = Recorder::new(&study)
            .finish(&results, None)
            .expect("the threads start");
        let alone = (0..3).map(|case| {
            let settings = study.settings(case);
            Course::new(
                case,
                &settings,
                &simulate_with(&settings, SAMPLING).expect("the pass ends"),
            )
        });
        assert!(courses == alone.collect::<Vec<_>>());
    }

    /// Sampling must not change results, and what was recorded in a study must be what a page made
    /// later shows.
    #[test]
    fn courses_recorded_in_the_study_change_nothing() {
        let study = study();
        let recorder = Recorder::new(&study);
        let results = run_study(&study, None, || {}).expect("the threads start");
        let take = |case, pass: &Simulation| recorder.take(case, pass);
        let same = |case: usize, result: CaseResult| {
            assert!(
                result == results[case],
                "metrics and statistics have the same bits"
            );
            ControlFlow::Continue(())
        };
        // As after a resume: the first case is not simulated, so its course has to be made later.
        simulate_cases(
            &study,
            &[1, 2],
            None,
            &Stop::default(),
            recorder.sampling(),
            take,
            same,
        )
        .expect("the threads start");
        assert_eq!(recorder.courses().len(), 2);
        let recorded = recorder.finish(&results, None).expect("the threads start");
        assert!(
            recorded
                == Recorder::new(&study)
                    .finish(&results, None)
                    .expect("the threads start")
        );
    }

    /// The dissipated energy that courses integrate less exactly cannot be told from the exact one
    /// in a drawing.
    #[test]
    fn energies_alongside_are_those_of_a_history() {
        let settings = settings();
        let exact = simulate_with(
            &settings,
            Sampling {
                alongside: false,
                ..SAMPLING
            },
        )
        .expect("the pass ends");
        let alongside = simulate_with(&settings, SAMPLING).expect("the pass ends");
        let taken = |simulation: &Simulation| {
            simulation
                .history
                .last()
                .expect("samples")
                .dissipated_energy_j
        };
        for (exact_sample, sample) in exact.history.iter().zip(&alongside.history) {
            let difference = (exact_sample.dissipated_energy_j - sample.dissipated_energy_j).abs();
            assert!(
                difference < 1e-5 * taken(&exact),
                "{difference} J at {} s",
                sample.time_s
            );
        }
        assert_eq!(
            alongside.metrics,
            simulate(&settings).expect("the pass ends").metrics
        );
    }
}
