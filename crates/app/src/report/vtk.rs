//! The filament of one pass, or the filaments of a brush, for ParaView: one file of points per
//! time, the workpiece, and a collection.
//!
//! Writes shapes in VTK's XML formats: PolyData (`.vtp`) and a collection (`.pvd`). Numbers are in
//! base 64, so that they are read back to the bit. They take two thirds of the bytes of their
//! digits.

use std::fmt::Write;
use std::iter;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use bristle::brush::{FilamentResult, Frame};
use bristle::equations::linear::{add, cross, dot, scale, sub};
use bristle::model::settings::Settings;
use bristle::simulation::{Pass, Shape};
use bristle::tool::{ClampMotion, Pose, Trim};
use bristle::workpiece::{Workpiece, unit_normal};

use crate::report::drawing::ends;
use crate::report::view::{is_upright, sampled_pass};
use crate::store::vtk_files::{BRUSH_COLLECTION, COLLECTION, WORKPIECE};

/// The start of every file. The header of a block of numbers is its length in bytes.
const HEADING: &str = "<?xml version=\"1.0\"?>\n";
const ATTRIBUTES: &str = "version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"";

/// The attribute of numbers at points and cells.
const COMPONENTS: &str = "NumberOfComponents";

/// Margin of the drawn workpiece beyond the reach of the undeformed tips, as a share of this reach.
const MARGIN: f64 = 0.1;

/// Returns the name of the file of the moving points at one time.
fn numbered(moving: &str, number: usize) -> String {
    format!("{moving}_{number:04}.vtp")
}

/// Returns names and texts of the files, the collection last. `shapes` belong to the pass that
/// `settings` state and have loads.
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

/// Returns names and texts of the files of a brush, the collection last. `frames` are those of
/// `filaments`, which `settings` state.
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

/// Returns the text of all filaments at one time: a line through the nodes of each.
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

/// Returns the array with the time of a file, in s.
fn time_value(time: f64) -> String {
    reals("TimeValue", "NumberOfTuples", 1, &[time])
}

/// Returns the text of the filament at one time: a line through its nodes.
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

/// Returns the angle between two directions in rad.
fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let normal = cross(a, b);
    dot(normal, normal).sqrt().atan2(dot(a, b))
}

/// Returns the gap in m between a node at `position` (m) and `time` (s) and the nearest face or
/// edge.
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

/// Returns the part of the workpiece's profile that the filament can reach: a strip of rectangles
/// as wide as the turning trim. Its place is that at time zero, or after the workpiece has come up.
fn workpiece(pass: &Pass, settings: &Settings) -> String {
    let profile = pass
        .outline((1.0 + MARGIN) * settings.tool_radius_m())
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

/// Returns the reach of the undeformed turning trim along a unit vector, to either side of the
/// tool's centre, in m. For upright radial tools it is half the width.
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
    ends(reaches)
}

/// Returns the number of points, and the array of their coordinates in m.
fn places(points: &[[f64; 3]]) -> (usize, String) {
    (
        points.len(),
        reals("Points", COMPONENTS, 3, points.as_flattened()),
    )
}

/// Returns a PolyData file from points ([`places`]), cells of point numbers, data of points and
/// cells, and `fields` of the whole.
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

/// Returns an array of single precision, as that of frames.
fn singles(name: &str, number: usize, values: &[f32]) -> String {
    array(
        "Float32",
        name,
        COMPONENTS,
        number,
        values.iter().flat_map(|value| value.to_le_bytes()),
    )
}

/// Returns an array of numbers in base 64, preceded by their length in bytes. `size` is the
/// attribute with the number of components.
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

/// Returns the collection of all files with their `times` in s. Part 0 moves and is called
/// `moving`; part 1 is the workpiece.
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
    use crate::store::vtk_files::is_file_name;
    use std::f64::consts::FRAC_PI_2;

    use bristle::model::settings::{ToolKind, Turns, WorkpieceKind};
    use bristle::simulation::{Sampling, simulate_with};
    use bristle_study::input::document::Document;

    const SHAPES: usize = 101;

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

    /// Tools of any pose have their nodes, gaps, joints and forces in the frame of the workpiece,
    /// which lies below all that turns. `tests/formats/` reads files of upright tools back.
    #[test]
    fn tilted_tools_are_where_they_are() {
        let text = include_str!("../../../../examples/zirconia.toml");
        let example =
            Document::parse(text, "zirconia.toml").and_then(|document| document.settings());
        let example = example.expect("the example is right");
        for (kind, tilt) in [
            (ToolKind::Round, 0.0),
            (ToolKind::Round, 0.05),
            (ToolKind::Cup, 1.5),
            (ToolKind::Cup, FRAC_PI_2),
        ] {
            let mut settings = example.clone();
            settings.contact.friction_coefficient = 0.2;
            settings.contact.radius_m = 0.05e-3;
            settings.workpiece.kind = WorkpieceKind::default();
            (
                settings.tool.kind,
                settings.tool.tilt_rad,
                settings.tool.positions,
            ) = (kind, Some(tilt), Some(1));
            (settings.filament.segments, settings.process.turns) = (6, Some(Turns::Count(1)));
            let sampling = Sampling {
                shapes: SHAPES,
                samples: SHAPES,
                loads: true,
                ..Sampling::default()
            };
            let simulation = simulate_with(&settings, sampling).expect("the pass ends");
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
                let [x, _, z] = forces.iter().fold([0.0; 3], |sum, &force| add(sum, force));
                // Sums of some terms, each rounded.
                let difference = x.hypot(z) - sample.contact_tangential_force_n;
                assert!(difference.abs() <= 1e-12 * sample.contact_normal_force_n);
                touches |= sample.contact_tangential_force_n > 0.0;
                let joints = numbers(text, "joint_angle_rad");
                // A filament starts straight, or splayed by a little; a wrong frame of the clamp
                // would show a right angle.
                assert!(!first || joints[0] < 0.1, "{joints:?}");
                first = false;
                let over = |k: usize| {
                    let [low, high] = ends(strip.iter().map(|point| point[k]));
                    nodes
                        .iter()
                        .all(|node| node[k] > low - 1e-3 && node[k] < high + 1e-3)
                };
                assert!(over(0) && over(2), "{kind:?} {tilt} at {}", sample.time_s);
            }
            assert!(touches && strip.iter().all(|point| (point[1] - ground).abs() < 1e-15));
        }
    }

    #[test]
    fn files_of_any_run_are_told_by_their_names() {
        let own = [
            "filament_0001.vtp",
            "brush_9999.vtp",
            WORKPIECE,
            COLLECTION,
            BRUSH_COLLECTION,
        ];
        assert!(own.iter().all(|name| is_file_name(name)));
        let others = [
            "filament_00001.vtp",
            "filament_x000.vtp",
            "filament.vtp",
            "brush_1.vtp",
            "own.pvd",
        ];
        assert!(!others.iter().any(|name| is_file_name(name)));
    }
}
