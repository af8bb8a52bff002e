//! What centrifugal forces do to the force of cup brushes: simulates cups, and writes docs/cup.md
//! and its figures.
//!
//! ```text
//! cargo run --release -p bristle-benches --example cup                 # docs/cup*
//! cargo run --release -p bristle-benches --example cup -- directory
//! ```
//!
//! `page.md` is the text. The program fills its tables and numbers in, and refuses to write a page
//! whose statements do not hold.

use std::collections::BTreeMap;
use std::error::Error;
use std::f64::consts::PI;

use bristle::equations::linear::{add, scale};
use bristle::model::filament::bending_stiffness;
use bristle::model::settings::{Settings, ToolKind};
use bristle::simulation::Pass;
use bristle::tool::ClampMotion;
use bristle_benches::{fixed, table, write_page};
use bristle_grid::{Study, run_study};
use bristle_report::drawing::Canvas;
use bristle_report::drawing::diagram::{Curve, Diagram, Look};
use bristle_report::drawing::scale::Axis;

const PAGE: &str = include_str!("page.md");
/// Depths that are constant, in mm.
const DEPTHS: [f64; 2] = [1.0, 2.0];

/// Filaments of one length.
struct Cup {
    /// Free length in mm.
    length: f64,
    /// Brushing velocities in m/s, ascending.
    velocities: [f64; 6],
    /// The force in N that is constant.
    force: f64,
}

const CUPS: [Cup; 2] = [
    Cup {
        length: 40.0,
        velocities: [2.5, 5.0, 7.5, 10.0, 12.5, 15.0],
        force: 20.0,
    },
    Cup {
        length: 20.0,
        velocities: [5.0, 10.0, 15.0, 20.0, 30.0, 40.0],
        force: 80.0,
    },
];

impl Cup {
    fn settings(&self, velocity: f64) -> Settings {
        let mut settings = Settings::paper(velocity, 1e-3);
        let (tool, filament) = (&mut settings.tool, &mut settings.filament);
        (tool.kind, tool.body_radius_m, tool.width_m, tool.positions) =
            (ToolKind::Cup, 0.050, 0.010, Some(1));
        (tool.filament_count, tool.filament_count_uncertainty) = (2000.0, 0.0);
        (filament.length_m, filament.diameter_m) = (1e-3 * self.length, 0.6e-3);
        settings
    }

    fn at_depth(&self, velocity: f64, depth: f64) -> Settings {
        self.settings(velocity).at_depth(1e-3 * depth)
    }

    fn at_force(&self, velocity: f64) -> Settings {
        let mut settings = self.settings(velocity);
        settings.set_tool_force_n(self.force);
        settings
    }

    /// How far the tip is lifted and moved outwards in mm as the tool turns freely.
    fn splay(&self, velocity: f64) -> [f64; 2] {
        let pass = Pass::new(&self.settings(velocity));
        let start = pass.start(&mut pass.system(false));
        let segment = self.length / start.q.len() as f64;
        let directions = start.q.iter().zip(&start.charts).map(|(q, chart)| {
            let [direction, ..] = chart.direction([*q, [0.0; 2], [0.0; 2]]);
            scale(segment, direction)
        });
        let root = scale(1e3, pass.tool().at(0.0).position);
        let [from_root, tip] = [[0.0; 3], root].map(|from| directions.clone().fold(from, add));
        [
            self.length - from_root[2],
            tip[0].hypot(tip[1]) - root[0].hypot(root[1]),
        ]
    }

    /// The load in N at which all filaments buckle.
    fn buckling_load(&self) -> f64 {
        let Settings { filament, tool, .. } = &self.settings(1.0);
        let stiffness = bending_stiffness(filament, filament.diameter_m);
        tool.filament_count * PI.powi(2) * stiffness / (4.0 * filament.length_m.powi(2))
    }

    fn last(&self) -> usize {
        self.velocities.len() - 1
    }
}

/// What was simulated of a cup, by velocity.
struct Results {
    /// Lift of the tip, and its way outwards in mm.
    splay: Vec<[f64; 2]>,
    /// The force in N at each of [`DEPTHS`].
    forces: [Vec<f64>; 2],
    /// The depth in mm at the constant force.
    depths: Vec<f64>,
}

impl Results {
    /// Simulates all cups.
    fn all() -> Result<Vec<Self>, Box<dyn Error>> {
        let of_cup = |cup: &Cup| -> Vec<Settings> {
            let at = |depth: f64| cup.velocities.map(|velocity| cup.at_depth(velocity, depth));
            let pressed = cup.velocities.map(|velocity| cup.at_force(velocity));
            [at(DEPTHS[0]), at(DEPTHS[1]), pressed].concat()
        };
        let cases: Vec<Settings> = CUPS.iter().flat_map(of_cup).collect();
        let results = run_study(&Study::of_cases(cases), None, || ())?;
        let metrics = results
            .into_iter()
            .map(|result| Ok(result?.metrics))
            .collect::<Result<Vec<_>, String>>()?;
        let number = CUPS[0].velocities.len();
        let parts: Vec<_> = metrics.chunks(number).collect();
        let force = |part: usize| {
            parts[part]
                .iter()
                .map(|metrics| metrics.tool_contact_normal_force_n)
                .collect()
        };
        let depths = |part: usize| {
            parts[part]
                .iter()
                .map(|metrics| 1e3 * metrics.penetration_depth_m)
                .collect()
        };
        let results = CUPS.iter().enumerate().map(|(index, cup)| Self {
            splay: cup
                .velocities
                .iter()
                .map(|&velocity| cup.splay(velocity))
                .collect(),
            forces: [force(3 * index), force(3 * index + 1)],
            depths: depths(3 * index + 2),
        });
        Ok(results.collect())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let results = Results::all()?;
    let figures = [
        ("forces", forces_figure(&results).svg()),
        ("depths", depths_figure(&results).svg()),
    ];
    write_page("cup", PAGE, &values(&results), figures, claims(&results))
}

/// The values of the places of the page.
fn values(results: &[Results]) -> BTreeMap<&'static str, String> {
    let [long, short] = results else {
        panic!("there are two cups")
    };
    let settings = CUPS[0].settings(1.0);
    let row = |cup: &Cup, at: usize, cells: Vec<String>| {
        [
            vec![format!("{} mm", cup.length), cup.velocities[at].to_string()],
            cells,
        ]
        .concat()
    };
    let rows = |cells: &dyn Fn(&Results, usize) -> Vec<String>| -> Vec<Vec<String>> {
        let of_cup = |(cup, results): (&'static Cup, &Results)| {
            (0..=cup.last())
                .map(|at| row(cup, at, cells(results, at)))
                .collect::<Vec<_>>()
        };
        CUPS.iter().zip(results).flat_map(of_cup).collect()
    };
    let splay = rows(&|results, at| results.splay[at].map(|way| fixed(2, way)).to_vec());
    let forces = rows(&|results, at| {
        results
            .forces
            .iter()
            .map(|forces| fixed(1, forces[at]))
            .collect()
    });
    let depths =
        rows(&|results, at| vec![fixed(3, results.depths[at]), fixed(3, results.splay[at][0])]);
    let heads = |more: [&'static str; 2]| [["l_f", "v_b in m/s"], more].concat();
    let way = |results: &Results| {
        fixed(
            1,
            results.depths[results.depths.len() - 1] - results.depths[0],
        )
    };
    let [of_long, of_short] = common();
    BTreeMap::from([
        ("count", settings.tool.filament_count.to_string()),
        ("diameter", (1e3 * settings.filament.diameter_m).to_string()),
        ("width", (1e3 * settings.tool.width_m).to_string()),
        ("radius", (1e3 * settings.tool.body_radius_m).to_string()),
        ("splay", table(&heads(["lifted", "outwards"]), splay)),
        ("common", CUPS[0].velocities[of_long].to_string()),
        ("lift_long", fixed(1, long.splay[of_long][0])),
        ("lift_short", fixed(2, short.splay[of_short][0])),
        (
            "forces",
            table(&heads(["a_e = 1 mm", "a_e = 2 mm"]), forces),
        ),
        ("buckling_long", fixed(0, CUPS[0].buckling_load())),
        ("buckling_short", fixed(0, CUPS[1].buckling_load())),
        ("force_long", CUPS[0].force.to_string()),
        ("force_short", CUPS[1].force.to_string()),
        (
            "depths",
            table(&heads(["a_e in mm", "lift at rest in mm"]), depths),
        ),
        ("way_long", way(long)),
        ("way_short", way(short)),
    ])
}

/// The place of a velocity that both cups have, the largest, in the list of each.
fn common() -> [usize; 2] {
    let place = |velocity: &f64| {
        CUPS[1]
            .velocities
            .iter()
            .position(|other| other == velocity)
    };
    let mut both = CUPS[0]
        .velocities
        .iter()
        .enumerate()
        .filter_map(|(at, velocity)| Some([at, place(velocity)?]));
    both.next_back().expect("cups have a velocity in common")
}

/// The statements of the page that depend on its numbers, and whether they hold.
fn claims(results: &[Results]) -> Vec<(&'static str, bool)> {
    let all = |holds: &dyn Fn(&Cup, &Results) -> bool| {
        CUPS.iter()
            .zip(results)
            .all(|(cup, results)| holds(cup, results))
    };
    let falls = |forces: &Vec<f64>| {
        forces.is_sorted_by(|slow, fast| slow > fast || *slow == 0.0 && *fast == 0.0)
    };
    let lifted = |results: &Results, depth: usize, at: usize| {
        let lift = results.splay[at][0];
        (lift > DEPTHS[depth]) == (results.forces[depth][at] == 0.0)
    };
    let slow = |results: &Results, depth: usize| results.forces[depth][0];
    vec![
        ("half the length splays far less", {
            let [long, short] = common();
            results[0].splay[long][0] > 10.0 * results[1].splay[short][0]
        }),
        (
            "the force falls with every step of the velocity until it is zero",
            { all(&|_, results| results.forces.iter().all(falls)) },
        ),
        (
            "at 1 and 2 mm it comes to zero",
            all(&|_, results| results.forces.iter().all(|forces| forces.ends_with(&[0.0]))),
        ),
        (
            "it is zero where the lift is larger than the depth, and only there",
            {
                all(&|cup, results| {
                    (0..2).all(|depth| (0..=cup.last()).all(|at| lifted(results, depth, at)))
                })
            },
        ),
        (
            "slow filaments press with nearly their buckling load, at both depths",
            {
                all(&|cup, results| {
                    (0..2)
                        .all(|depth| (slow(results, depth) / cup.buckling_load() - 1.0).abs() < 0.1)
                })
            },
        ),
        ("half the length presses with four times the force", {
            (0..2).all(|depth| {
                (3.8..4.6).contains(&(slow(&results[1], depth) / slow(&results[0], depth)))
            })
        }),
        (
            "the constant force is about a third of the buckling load",
            { all(&|cup, _| (cup.force / cup.buckling_load() - 1.0 / 3.0).abs() < 0.02) },
        ),
        (
            "a constant force needs more depth with every step of the velocity",
            { all(&|_, results| results.depths.is_sorted_by(|slow, fast| slow < fast)) },
        ),
        ("the depth exceeds the lift at rest", {
            all(&|cup, results| {
                (0..=cup.last()).all(|at| results.depths[at] > results.splay[at][0])
            })
        }),
        (
            "at the lowest velocities the depth is some micrometres",
            all(&|_, results| results.depths[0] < 0.05),
        ),
    ]
}

fn over_velocity(cup: &Cup, values: &[f64]) -> Vec<(f64, f64)> {
    cup.velocities
        .into_iter()
        .zip(values.iter().copied())
        .collect()
}

fn forces_figure(results: &[Results]) -> Canvas {
    let curve = |index: usize, depth: usize| {
        let name = format!("{} mm, a_e = {} mm", CUPS[index].length, DEPTHS[depth]);
        let points = over_velocity(&CUPS[index], &results[index].forces[depth]);
        Curve::new(name, Look::Joined, points).with_pen(2 * index + depth)
    };
    Diagram {
        title: "Force of flat cups at constant depth".to_owned(),
        subtitle: "zero where centrifugal forces lift the filaments off the workpiece".to_owned(),
        x: Axis::from_zero("v_b in m/s"),
        y: Axis::from_zero("F_n,w in N"),
        curves: vec![curve(0, 0), curve(0, 1), curve(1, 0), curve(1, 1)],
    }
    .draw()
}

fn depths_figure(results: &[Results]) -> Canvas {
    let of_cup = |index: usize| {
        let (cup, results) = (&CUPS[index], &results[index]);
        let lifts: Vec<f64> = results.splay.iter().map(|[lift, _]| *lift).collect();
        let depth = Curve::new(
            format!("{} mm, a_e at {} N", cup.length, cup.force),
            Look::Joined,
            over_velocity(cup, &results.depths),
        );
        let lift = Curve::new(
            format!("{} mm, lift at rest", cup.length),
            Look::Line,
            over_velocity(cup, &lifts),
        );
        [depth.with_pen(2 * index), lift.with_pen(2 * index + 1)]
    };
    Diagram {
        title: "Depth of flat cups at constant force".to_owned(),
        subtitle: "and how far the tips of filaments are lifted that touch nothing".to_owned(),
        x: Axis::from_zero("v_b in m/s"),
        y: Axis::from_zero("depth or lift in mm"),
        curves: [of_cup(0), of_cup(1)].concat(),
    }
    .draw()
}
