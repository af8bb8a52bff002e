//! The filament of one pass, or the filaments of a brush, for ParaView: one file of points per
//! time, the workpiece, and a list of both.
//!
//! Writes shapes in VTK's XML formats: PolyData (`.vtp`) and a collection (`.pvd`). Numbers are in
//! base 64, so that they are read back to the bit. They take two thirds of the bytes of their
//! digits.

use std::fmt::Write;
use std::iter;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use bristle::brush::{FilamentResult, Frame};
use bristle::equations::linear::{add, dot, scale, sub};
use bristle::model::settings::Settings;
use bristle::simulation::{Pass, Shape};
use bristle::tool::{ClampMotion, Pose, Trim};
use bristle::workpiece::{Workpiece, unit_normal};

use crate::view::{cross, is_upright, sampled_pass};

/// The largest number of shapes in a pass: their numbers in file names have four digits.
pub const MAX_SHAPES: usize = 10_000;

const COLLECTION: &str = "contact.pvd";
const BRUSH_COLLECTION: &str = "brush.pvd";
const WORKPIECE: &str = "workpiece.vtp";

/// The start of every file. The header of a block of numbers is its length in bytes.
const HEADING: &str = "<?xml version=\"1.0\"?>\n";
const ATTRIBUTES: &str = "version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"";

/// The attribute of numbers at points and cells.
const COMPONENTS: &str = "NumberOfComponents";

/// How far the drawn part of the workpiece extends beyond the reach of the undeformed tips, as a
/// part of it.
const MARGIN: f64 = 0.1;

/// Whether a file of this name may belong to a run with any number of shapes or frames.
pub fn is_file_name(name: &str) -> bool {
    let is_numbered = |beginning: &str| {
        let number = name
            .strip_prefix(beginning)
            .and_then(|name| name.strip_suffix(".vtp"));
        number.is_some_and(|number| {
            number.len() == 4 && number.bytes().all(|digit| digit.is_ascii_digit())
        })
    };
    is_numbered("filament_")
        || is_numbered("brush_")
        || [WORKPIECE, COLLECTION, BRUSH_COLLECTION].contains(&name)
}

/// The file of what moves at one time.
fn numbered(moving: &str, number: usize) -> String {
    format!("{moving}_{number:04}.vtp")
}

/// Names and texts of the files, the collection last. `shapes` belong to the pass that `settings`
/// state and have loads.
pub fn files(settings: &Settings, shapes: &[Shape]) -> impl Iterator<Item = (String, String)> {
    let pass = sampled_pass(settings);
    let piece = workpiece(&pass, settings);
    let filament = move |(k, shape)| (numbered("filament", k), filament(&pass, settings, shape));
    let filaments = shapes.iter().enumerate().map(filament);
    filaments
        .chain([(WORKPIECE.to_owned(), piece)])
        .chain(iter::once_with(|| {
            let times = shapes.iter().map(|shape| shape.time_s);
            (COLLECTION.to_owned(), collection("filament", times))
        }))
}

/// Names and texts of the files of a brush, the collection last. `frames` are those of `filaments`,
/// which `settings` state.
pub fn brush_files<'a>(
    settings: &'a Settings,
    filaments: &'a [FilamentResult],
    frames: &'a [Frame],
) -> impl Iterator<Item = (String, String)> + 'a {
    let piece = iter::once_with(|| {
        (
            WORKPIECE.to_owned(),
            workpiece(&Pass::new(settings), settings),
        )
    });
    let list = iter::once_with(|| {
        let times = frames.iter().map(|frame| frame.time_s);
        (BRUSH_COLLECTION.to_owned(), collection("brush", times))
    });
    let frame = |(k, frame)| (numbered("brush", k), brush(filaments, frame));
    frames
        .iter()
        .enumerate()
        .map(frame)
        .chain(piece)
        .chain(list)
}

/// All filaments at one time: a line through the nodes of each.
fn brush(filaments: &[FilamentResult], frame: &Frame) -> String {
    let nodes = frame.nodes_m.concat();
    let points = singles("Points", 3, nodes.as_flattened());
    let mut next = 0;
    let lines: Vec<Vec<i64>> = frame
        .nodes_m
        .iter()
        .map(|nodes| {
            let first = next;
            next += nodes.len() as i64;
            (first..next).collect()
        })
        .collect();
    let arc = |nodes: &Vec<[f32; 3]>| {
        let nodes: Vec<[f64; 3]> = nodes.iter().map(|node| node.map(f64::from)).collect();
        let steps = nodes
            .windows(2)
            .map(|pair| sub(pair[1], pair[0]))
            .map(|step| dot(step, step).sqrt());
        let ends = steps.scan(0.0, |length: &mut f64, step| {
            *length += step;
            Some(*length)
        });
        iter::once(0.0).chain(ends).collect::<Vec<f64>>()
    };
    let arc_lengths: Vec<f64> = frame.nodes_m.iter().flat_map(arc).collect();
    let of_filament =
        |value: fn(&FilamentResult) -> f64| filaments.iter().map(value).collect::<Vec<f64>>();
    let cell_data = [
        reals(
            "column",
            COMPONENTS,
            1,
            &of_filament(|filament| filament.column as f64),
        ),
        reals(
            "row",
            COMPONENTS,
            1,
            &of_filament(|filament| filament.row as f64),
        ),
        reals(
            "is_counted",
            COMPONENTS,
            1,
            &of_filament(|filament| f64::from(u8::from(filament.is_counted))),
        ),
        singles("contact_normal_force_n", 1, &frame.contact_normal_force_n),
        singles("press_force_n", 1, &frame.press_force_n),
    ];
    let data = reals("arc_length_m", COMPONENTS, 1, &arc_lengths);
    poly_data(
        (nodes.len(), points),
        "Lines",
        &lines,
        [&data, &cell_data.concat()],
        &time_value(frame.time_s),
    )
}

/// The time of a file, in s.
fn time_value(time: f64) -> String {
    reals("TimeValue", "NumberOfTuples", 1, &[time])
}

/// The filament at one time: a line through its nodes.
fn filament(pass: &Pass, settings: &Settings, shape: &Shape) -> String {
    let segment = settings.filament.length_m / settings.filament.segments as f64;
    let contact_radius = settings.contact.radius_m;
    let nodes = &shape.nodes_m;
    let arc: Vec<f64> = (0..nodes.len()).map(|k| k as f64 * segment).collect();
    // The pass is in the frame of the tool, shapes are in that of the workpiece.
    let pose = pass.pose();
    let gap =
        |&node: &[f64; 3]| gap(pass.workpiece(), pose.to_tool(node), shape.time_s) - contact_radius;
    let gaps: Vec<f64> = nodes.iter().map(gap).collect();
    let normal_forces: Vec<f64> = shape.forces.iter().map(|load| load.normal).collect();
    let forces: Vec<[f64; 3]> = shape.forces.iter().map(|load| load.force).collect();
    // The joint at the root connects to the clamp. The tip has no joint.
    let clamp = pose.from_tool(pass.tool().at(shape.time_s).direction);
    let directions: Vec<[f64; 3]> = iter::once(clamp)
        .chain(nodes.windows(2).map(|pair| sub(pair[1], pair[0])))
        .collect();
    let angles: Vec<f64> = directions
        .windows(2)
        .map(|pair| angle(pair[0], pair[1]))
        .chain([0.0])
        .collect();
    let data = [
        reals("arc_length_m", COMPONENTS, 1, &arc),
        reals(
            "velocity_m_s",
            COMPONENTS,
            3,
            shape.velocities_m_s.as_flattened(),
        ),
        reals("contact_normal_force_n", COMPONENTS, 1, &normal_forces),
        reals("contact_force_n", COMPONENTS, 3, forces.as_flattened()),
        reals("gap_m", COMPONENTS, 1, &gaps),
        reals("joint_angle_rad", COMPONENTS, 1, &angles),
    ];
    let line: Vec<i64> = (0..nodes.len() as i64).collect();
    poly_data(
        places(nodes),
        "Lines",
        &[line],
        [&data.concat(), ""],
        &time_value(shape.time_s),
    )
}

/// The angle between two directions in rad.
fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let normal = cross(a, b);
    dot(normal, normal).sqrt().atan2(dot(a, b))
}

/// The gap of a node at `position` (m) and `time` (s) to the face or the edge that is nearest to
/// it, in m.
fn gap(workpiece: &impl Workpiece, position: [f64; 3], time: f64) -> f64 {
    let edges = workpiece
        .edges()
        .iter()
        .map(|edge| edge.surface(position, time))
        .filter(|seen| seen.margin > 0.0);
    edges
        .map(|seen| seen.gap)
        .reduce(f64::min)
        .unwrap_or_else(|| workpiece.surface(position, time).gap)
}

/// The part of the workpiece's profile that the filament can reach: a strip of rectangles as wide
/// as the trim turns. It is as it lies at time zero, or where the workpiece has come up to.
fn workpiece(pass: &Pass, settings: &Settings) -> String {
    let profile = pass
        .workpiece()
        .profile((1.0 + MARGIN) * settings.tool_radius_m())
        .unwrap_or_default();
    // Along z, but for a plane that is tilted about its line at z = 0.
    let [x, y, z] = unit_normal(&settings.workpiece);
    let steepness = x.hypot(y);
    let across = [-x * z / steepness, -y * z / steepness, steepness];
    let [low, high] = extent(settings, across);
    let side = |side: f64| {
        profile
            .points()
            .into_iter()
            .map(move |[x, y]| add([x, y, 0.0], scale(side, across)))
    };
    let (near, far): (Vec<_>, Vec<_>) = (side(low).collect(), side(high).collect());
    let count = near.len() as i64;
    let points = [near, far].concat();
    let rectangles: Vec<[i64; 4]> = (1..count)
        .map(|end| [end - 1, end, count + end, count + end - 1])
        .collect();
    let arc_lengths = profile.boundaries().repeat(2);
    poly_data(
        places(&points),
        "Polys",
        &rectangles,
        [&reals("arc_length_m", COMPONENTS, 1, &arc_lengths), ""],
        "",
    )
}

/// How far the undeformed turning trim reaches along a unit vector to either side of the tool's
/// centre, in m: of upright radial tools half their width.
fn extent(settings: &Settings, along: [f64; 3]) -> [f64; 2] {
    let trim = Trim::of(settings);
    if is_upright(settings) {
        return trim.ends();
    }
    let [x, y, z] = Pose::of(&settings.tool).to_tool(along);
    let points = trim
        .ends()
        .into_iter()
        .flat_map(|s| [trim.root(s), trim.tip(s)]);
    let reaches = points.flat_map(|[radius, height]| {
        [-1.0, 1.0].map(|side| side * radius * x.hypot(y) + height * z)
    });
    reaches.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], reach| {
        [low.min(reach), high.max(reach)]
    })
}

/// The number of points, and the array of their coordinates in m.
fn places(points: &[[f64; 3]]) -> (usize, String) {
    (
        points.len(),
        reals("Points", COMPONENTS, 3, points.as_flattened()),
    )
}

/// Points as [`places`] states them, cells of points by their numbers, data at the points and of
/// the cells, and `fields` of the whole.
fn poly_data<C: AsRef<[i64]>>(
    (count, coordinates): (usize, String),
    kind: &str,
    cells: &[C],
    [data, cell_data]: [&str; 2],
    fields: &str,
) -> String {
    let counts: String = ["Verts", "Lines", "Strips", "Polys"]
        .map(|other| {
            format!(
                " NumberOf{other}=\"{}\"",
                if other == kind { cells.len() } else { 0 }
            )
        })
        .concat();
    let cell_data = if cell_data.is_empty() {
        String::new()
    } else {
        format!("<CellData>\n{cell_data}</CellData>\n")
    };
    let numbers = cells
        .iter()
        .flat_map(|cell| cell.as_ref().iter().flat_map(|number| number.to_le_bytes()));
    let connectivity = array("Int64", "connectivity", COMPONENTS, 1, numbers);
    let ends = cells.iter().scan(0, |end, cell| {
        *end += cell.as_ref().len() as i64;
        Some(*end)
    });
    let offsets = array(
        "Int64",
        "offsets",
        COMPONENTS,
        1,
        ends.flat_map(i64::to_le_bytes),
    );
    format!(
        "{HEADING}<VTKFile type=\"PolyData\" {ATTRIBUTES}>\n<PolyData>\n<FieldData>\n{fields}</FieldData>\n\
         <Piece NumberOfPoints=\"{count}\"{counts}>\n<PointData>\n{data}</PointData>\n{cell_data}<Points>\n{coordinates}</Points>\n\
         <{kind}>\n{connectivity}{offsets}</{kind}>\n</Piece>\n</PolyData>\n</VTKFile>\n"
    )
}

fn reals(name: &str, size: &str, number: usize, values: &[f64]) -> String {
    array(
        "Float64",
        name,
        size,
        number,
        values.iter().flat_map(|value| value.to_le_bytes()),
    )
}

/// Numbers of single precision, as those of frames are.
fn singles(name: &str, number: usize, values: &[f32]) -> String {
    array(
        "Float32",
        name,
        COMPONENTS,
        number,
        values.iter().flat_map(|value| value.to_le_bytes()),
    )
}

/// Numbers in base 64, preceded by their length in bytes. `size` is the attribute that states how
/// many belong together.
fn array(
    kind: &str,
    name: &str,
    size: &str,
    number: usize,
    bytes: impl IntoIterator<Item = u8>,
) -> String {
    let bytes: Vec<u8> = bytes.into_iter().collect();
    let block = STANDARD.encode([&(bytes.len() as u64).to_le_bytes(), bytes.as_slice()].concat());
    format!(
        "<DataArray type=\"{kind}\" Name=\"{name}\" {size}=\"{number}\" format=\"binary\">{block}</DataArray>\n"
    )
}

/// All files with their `times` in s: what moves is part 0 and called `moving`, the workpiece is
/// part 1.
fn collection(moving: &str, times: impl Iterator<Item = f64>) -> String {
    let mut text = format!("{HEADING}<VTKFile type=\"Collection\" {ATTRIBUTES}>\n<Collection>\n");
    for (k, time) in times.enumerate() {
        for (part, name, file) in [
            (0, moving, numbered(moving, k)),
            (1, "workpiece", WORKPIECE.to_owned()),
        ] {
            let _ = writeln!(
                text,
                "<DataSet timestep=\"{time:?}\" part=\"{part}\" name=\"{name}\" file=\"{file}\"/>"
            );
        }
    }
    text.push_str("</Collection>\n</VTKFile>\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    use bristle::model::settings::{EdgeSettings, ToolKind, Turns, WorkpieceKind};
    use bristle::simulation::{Sampling, Simulation, simulate_with};
    use bristle_input::document::Document;

    const SHAPES: usize = 101;

    fn contact() -> (Settings, Simulation) {
        let text = include_str!("../../../examples/zirconia.toml");
        let settings =
            Document::parse(text, "zirconia.toml").and_then(|document| document.settings());
        let mut settings = settings.expect("the example is right");
        settings.workpiece.kind = WorkpieceKind::plane([1.0, 2.0, 0.5]);
        settings.contact.friction_coefficient = 0.2;
        settings.contact.radius_m = 0.05e-3;
        let simulation = simulation(&settings);
        (settings, simulation)
    }

    fn simulation(settings: &Settings) -> Simulation {
        let sampling = Sampling {
            shapes: SHAPES,
            samples: SHAPES,
            loads: true,
            ..Sampling::default()
        };
        simulate_with(settings, sampling).expect("the pass ends")
    }

    /// The numbers of an array.
    fn numbers(text: &str, name: &str) -> Vec<f64> {
        let (_, rest) = text.split_once(&format!("Name=\"{name}\"")).expect(name);
        let (_, rest) = rest.split_once('>').expect("the end of a tag");
        let (block, _) = rest.split_once('<').expect("another tag");
        let bytes = STANDARD.decode(block).expect("base 64");
        let (length, bytes) = bytes.split_first_chunk().expect("a header");
        assert_eq!(u64::from_le_bytes(*length), bytes.len() as u64);
        bytes
            .chunks(8)
            .map(|chunk| f64::from_le_bytes(chunk.try_into().expect("eight bytes")))
            .collect()
    }

    fn vectors(text: &str, name: &str) -> Vec<[f64; 3]> {
        numbers(text, name)
            .chunks(3)
            .map(|chunk| chunk.try_into().expect("three components"))
            .collect()
    }

    fn length(vector: [f64; 3]) -> f64 {
        dot(vector, vector).sqrt()
    }

    #[test]
    fn nodes_are_those_of_the_pass() {
        let (settings, simulation) = contact();
        let segment = settings.filament.length_m / settings.filament.segments as f64;
        let normal = Pass::new(&settings)
            .workpiece()
            .surface([0.0; 3], 0.0)
            .normal;
        let mut touches = false;
        for ((_, text), sample) in
            iter::zip(files(&settings, &simulation.shapes), &simulation.history)
        {
            let nodes = vectors(&text, "Points");
            assert_eq!(nodes.len(), settings.filament.segments + 1);
            assert_eq!(numbers(&text, "TimeValue"), [sample.time_s]);
            assert_eq!(
                nodes[nodes.len() - 1],
                [sample.tip_x_m, sample.tip_y_m, sample.tip_z_m]
            );
            let (sin, cos) = sample.base_angle_rad.sin_cos();
            // Rounding of sine and cosine.
            assert!(
                length(sub(
                    nodes[0],
                    scale(settings.tool.body_radius_m, [cos, sin, 0.0])
                )) < 1e-15
            );
            for pair in nodes.windows(2) {
                // Each node is interpolated separately. The error is below the solver's tolerance
                // of 1e-6.
                assert!((length(sub(pair[1], pair[0])) / segment - 1.0).abs() < 1e-6);
            }
            let normal_forces = numbers(&text, "contact_normal_force_n");
            let forces = vectors(&text, "contact_force_n");
            let sum = forces.iter().fold([0.0; 3], |sum, &force| add(sum, force));
            let friction = length(sub(sum, scale(dot(sum, normal), normal)));
            // Sums of some terms, each rounded.
            let near = |found: f64, expected: f64| {
                (found - expected).abs() <= 1e-12 * sample.contact_normal_force_n
            };
            assert!(near(
                normal_forces.iter().sum(),
                sample.contact_normal_force_n
            ));
            assert!(near(dot(sum, normal), sample.contact_normal_force_n));
            assert!(near(friction, sample.contact_tangential_force_n));
            let gaps = numbers(&text, "gap_m");
            assert!(
                iter::zip(&gaps, &normal_forces).all(|(gap, force)| (*gap < 0.0) == (*force > 0.0))
            );
            touches |= sample.contact_tangential_force_n > 0.0;
        }
        assert!(touches, "there is no contact to look at");
    }

    #[test]
    fn the_filament_starts_straight_and_turns_with_the_body() {
        let (settings, simulation) = contact();
        let (_, text) = files(&settings, &simulation.shapes)
            .next()
            .expect("a shape");
        let nodes = vectors(&text, "Points");
        let rate = Pass::new(&settings).tool().rate;
        let [gaps, arc, angles] =
            ["gap_m", "arc_length_m", "joint_angle_rad"].map(|name| numbers(&text, name));
        for (k, (node, velocity)) in iter::zip(&nodes, vectors(&text, "velocity_m_s")).enumerate() {
            let radius = settings.tool.body_radius_m + arc[k];
            // Rounding of lengths of a tenth of a metre, and of speeds of ten m/s.
            assert!(length(sub(*node, scale(radius / length(nodes[0]), nodes[0]))) < 1e-15);
            assert!(length(sub(velocity, scale(rate, [-node[1], node[0], 0.0]))) < 1e-13);
            assert!(angles[k] < 1e-12 && gaps[k] > 0.0);
        }
        assert_eq!(arc[settings.filament.segments], settings.filament.length_m);
    }

    #[test]
    fn the_workpiece_lies_below_the_filament() {
        let (settings, simulation) = contact();
        let pass = Pass::new(&settings);
        let (_, text) = files(&settings, &simulation.shapes)
            .nth(SHAPES)
            .expect("the workpiece");
        let points = vectors(&text, "Points");
        for &point in &points {
            assert!(pass.workpiece().surface(point, 0.0).gap.abs() < 1e-15);
        }
        let (near, far) = points.split_at(points.len() / 2);
        let along = sub(near[near.len() - 1], near[0]);
        for (near, far) in iter::zip(near, far) {
            let width = sub(*far, *near);
            assert!(
                (length(width) / settings.tool.width_m - 1.0).abs() < 1e-12
                    && dot(width, along).abs() < 1e-12
            );
        }
        for node in simulation.shapes.iter().flat_map(|shape| &shape.nodes_m) {
            let place = dot(sub(*node, near[0]), along) / dot(along, along);
            assert!(place > 0.05 && place < 0.95, "{place}");
        }
    }

    /// Tools of any pose have their nodes, gaps, joints and forces in the frame of the workpiece,
    /// which lies below all that turns.
    #[test]
    fn tilted_tools_are_where_they_are() {
        for (kind, tilt) in [
            (ToolKind::Round, 0.05),
            (ToolKind::Cup, 1.5),
            (ToolKind::Cup, FRAC_PI_2),
        ] {
            let (mut settings, _) = contact();
            settings.workpiece.kind = WorkpieceKind::default();
            (
                settings.tool.kind,
                settings.tool.tilt_rad,
                settings.tool.positions,
            ) = (kind, Some(tilt), Some(1));
            (settings.filament.segments, settings.process.turns) = (6, Some(Turns::Count(1)));
            let simulation = simulation(&settings);
            let texts: Vec<(String, String)> = files(&settings, &simulation.shapes).collect();
            let ground = settings.process.penetration_depth_m - settings.reach_m();
            let strip = vectors(&texts[SHAPES].1, "Points");
            // Once the workpiece has come up to filaments that touch it all round.
            let arrived = if tilt == FRAC_PI_2 {
                Pass::new(&settings).turn_time()
            } else {
                0.0
            };
            let (mut first, mut touches) = (true, false);
            for ((_, text), sample) in iter::zip(&texts, &simulation.history) {
                let (nodes, gaps) = (vectors(text, "Points"), numbers(text, "gap_m"));
                assert_eq!(nodes[6], [sample.tip_x_m, sample.tip_y_m, sample.tip_z_m]);
                for (node, gap) in iter::zip(&nodes, &gaps).filter(|_| sample.time_s >= arrived) {
                    let expected = node[1] - ground - settings.contact.radius_m;
                    assert!(
                        (gap - expected).abs() < 1e-12,
                        "{kind:?} {tilt}: {gap} {expected}"
                    );
                }
                let normal_forces = numbers(text, "contact_normal_force_n");
                let forces = vectors(text, "contact_force_n");
                assert!(
                    iter::zip(&normal_forces, &forces)
                        .all(|(normal, force)| (normal - force[1]).abs() < 1e-12)
                );
                touches |= normal_forces.iter().any(|force| *force > 0.0);
                let joints = numbers(text, "joint_angle_rad");
                // A filament starts straight, or splayed by a little; a wrong frame of the clamp
                // would show a right angle.
                assert!(!first || joints[0] < 0.1, "{joints:?}");
                first = false;
                let over = |k: usize| {
                    let ends = strip.iter().map(|point| point[k]);
                    let [low, high] = [
                        ends.clone().fold(f64::INFINITY, f64::min),
                        ends.fold(f64::NEG_INFINITY, f64::max),
                    ];
                    nodes
                        .iter()
                        .all(|node| node[k] > low - 1e-3 && node[k] < high + 1e-3)
                };
                assert!(over(0) && over(2), "{kind:?} {tilt} at {}", sample.time_s);
            }
            assert!(touches && strip.iter().all(|point| (point[1] - ground).abs() < 1e-15));
        }
    }

    /// The outline of an edge, with the gaps and the forces of nodes at it.
    #[test]
    fn an_edge_is_extruded_over_the_width() {
        let (mut settings, _) = contact();
        settings.workpiece.kind = WorkpieceKind::Edge(EdgeSettings {
            edge_radius_m: 1e-3,
            offset_m: 0.005,
            ..EdgeSettings::default()
        });
        let simulation = simulation(&settings);
        let pass = Pass::new(&settings);
        let texts: Vec<(String, String)> = files(&settings, &simulation.shapes).collect();
        let points = vectors(&texts[SHAPES].1, "Points");
        assert!(
            points
                .iter()
                .all(|&point| gap(pass.workpiece(), point, 0.0).abs() < 1e-15)
        );
        let arc_lengths = numbers(&texts[SHAPES].1, "arc_length_m");
        for (point, arc_length) in iter::zip(&points, arc_lengths) {
            let found = pass.workpiece().arc_length(*point, 0.0).expect("a place");
            assert!((found - arc_length).abs() < 1e-12, "{found} {arc_length}");
        }
        let sums = iter::zip(&texts, &simulation.history).map(|((_, text), sample)| {
            let forces = vectors(text, "contact_force_n");
            let sum = forces.iter().fold([0.0; 3], |sum, &force| add(sum, force));
            (
                length(sum),
                sample
                    .contact_normal_force_n
                    .hypot(sample.contact_tangential_force_n),
            )
        });
        let on_edge: Vec<(f64, f64)> = sums.filter(|(_, expected)| *expected > 0.0).collect();
        // Forces of nodes on the face and of the centreline on the edge need not be parallel.
        let agree = on_edge
            .iter()
            .filter(|(sum, expected)| (sum - expected).abs() < 1e-12 * expected);
        assert!(on_edge.len() > 10 && 10 * agree.count() > 9 * on_edge.len());
    }

    #[test]
    fn the_collection_lists_every_file_at_every_time() {
        let (settings, simulation) = contact();
        let (names, texts): (Vec<String>, Vec<String>) =
            files(&settings, &simulation.shapes).unzip();
        let moving = (0..SHAPES).map(|k| numbered("filament", k));
        assert_eq!(
            names,
            moving
                .chain([WORKPIECE.to_owned(), COLLECTION.to_owned()])
                .collect::<Vec<_>>()
        );
        assert!(names.iter().all(|name| is_file_name(name)));
        assert!(
            [
                "filament_00001.vtp",
                "filament_x000.vtp",
                "filament.vtp",
                "brush_1.vtp",
                "own.pvd"
            ]
            .iter()
            .all(|name| !is_file_name(name))
        );
        let entry = |part: usize, name: &str, file: &str, time: f64| {
            format!(
                "<DataSet timestep=\"{time:?}\" part=\"{part}\" name=\"{name}\" file=\"{file}\"/>"
            )
        };
        let expected = iter::zip(&names, &simulation.history).flat_map(|(name, sample)| {
            [
                entry(0, "filament", name, sample.time_s),
                entry(1, "workpiece", "workpiece.vtp", sample.time_s),
            ]
        });
        let listed = texts[SHAPES + 1]
            .lines()
            .filter(|line| line.starts_with("<DataSet"));
        assert!(listed.eq(expected));
    }
}
