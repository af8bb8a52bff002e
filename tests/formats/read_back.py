"""Reads Parquet and VTK files with the libraries that others use, and compares them with the CSV files beside them.

    python read_back.py STUDY RESULTS...

STUDY is a directory of `bristle study`, of a build with the feature `parquet`. Each RESULTS is a directory of `bristle simulate
--samples N --vtk=N` of such a build, or of `bristle simulate --vtk` with equal filaments. Prints what agrees, or says what does not and
ends with status 1.
"""

import csv
import json
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

# Columns that count something; the status is text, all others are real numbers.
COUNTS = {
    "segments", "contact_count", "contact_nodes", "laterally_unstable", "turns", "unsteady_turns", "steps", "unresolved_steps", "rejected_steps",
    "newton_iterations", "newton_failures", "factorisations", "contact_events", "failed_samples",
}
# Arrays at the nodes, with their components.
ARRAYS = {
    "arc_length_m": 1, "velocity_m_s": 3, "contact_normal_force_n": 1, "contact_force_n": 3, "gap_m": 1,
    "joint_angle_rad": 1,
}
# Arrays of the filaments of a brush.
OF_FILAMENTS = ["column", "row", "is_counted", "contact_normal_force_n", "press_force_n"]
# Half the distance of two neighbouring numbers of 32 bits below 0.25: coordinates of the nodes of a brush, in m.
SINGLE = 2.0**-27
# Relative error of a sum of forces of 32 bits.
SINGLE_SHARE = 1e-6
# Error of numbers computed in another order: some hundred roundings of lengths up to a metre, in m.
ROUNDING = 1e-13
# Gaps to curved workpieces are compared with those to chords, where nodes are near: within this distance, and up to the height of the
# arcs over their chords.
NEAR = 1e-3
SAG = 2e-6


def check(condition, message):
    if not condition:
        sys.exit(f"error: {message}")


def compare_tables(directory, name, settings):
    """Compares every cell of a Parquet file with the text of the CSV file's cell."""
    path = directory / f"{name}.parquet"
    with open(directory / f"{name}.csv", newline="", encoding="utf-8") as file:
        heading, *rows = csv.reader(file)
    table = pq.read_table(path)
    check(table.column_names == heading, f"{path}: the columns are {table.column_names}, and in the CSV file {heading}")
    check(table.num_rows == len(rows), f"{path}: {table.num_rows} rows, and {len(rows)} in the CSV file")
    metadata = pq.read_metadata(path).metadata
    text = (directory / settings).read_bytes()
    check(metadata.get(settings.encode()) == text, f"{path}: the metadata are not the text of {settings}")
    version = metadata.get(b"bristle_version", b"").decode()
    check(version == json.loads(text)["bristle_version"], f"{path}: made by Bristle {version}")
    empty = 0
    for position, column in enumerate(heading):
        kind, read = {True: (pa.int64(), int), False: (pa.float64(), float)}[column in COUNTS]
        if column == "status":
            kind, read = pa.string(), str
        found = table.schema.field(position).type
        check(found == kind, f"{path}: the type of {column} is {found}")
        for line, (value, row) in enumerate(zip(table.column(position).to_pylist(), rows), start=2):
            expected = None if row[position] == "" else read(row[position])
            check(value == expected, f"{path}: {column} is {value!r}, and {row[position]!r} in line {line} of the CSV file")
            empty += value is None
    print(f"{path}: {len(rows)} rows of {len(heading)} columns, {empty} cells empty, all as in the CSV file")
    return empty


def read_rows(path):
    """The rows of a CSV file of numbers, by the keys of its heading."""
    with open(path, newline="", encoding="utf-8") as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def read_poly_data(path, real=np.float64):
    """Points of this type, cells and arrays of a .vtp file, by VTK."""
    reader = vtkXMLPolyDataReader()
    failures = []
    reader.AddObserver("ErrorEvent", lambda *_: failures.append(path))
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    check(not failures and data.GetNumberOfPoints() > 0, f"{path}: VTK cannot read it")
    points = vtk_to_numpy(data.GetPoints().GetData())
    check(points.dtype == real and np.isfinite(points).all(), f"{path}: the points are not finite {real.__name__} numbers")
    return data, points


def check_lines(data, count, segments, path):
    """Checks that the cells are lines from root to tip, one behind the other."""
    found = data.GetNumberOfCells()
    check(found == data.GetNumberOfLines() == count, f"{path}: {found} cells instead of {count} lines")
    for line in range(count):
        first = line * (segments + 1)
        expected = list(range(first, first + segments + 1))
        check(ids_of_cell(data, line) == expected, f"{path}: line {line} does not go from the root to the tip")


def ids_of_cell(data, cell):
    ids = data.GetCell(cell).GetPointIds()
    return [ids.GetId(k) for k in range(ids.GetNumberOfIds())]


def read_array(arrays, name, components, count, path):
    """Reads an array of the points or the cells, of `count` finite values with their components."""
    array = arrays.GetArray(name)
    check(array is not None, f"{path}: there is no array {name}")
    check(array.GetNumberOfComponents() == components, f"{path}: {name} has {array.GetNumberOfComponents()} components")
    values = vtk_to_numpy(array)
    check(len(values) == count, f"{path}: {name} has {len(values)} values instead of {count}")
    check(np.isfinite(values).all(), f"{path}: {name} is not finite")
    return values


def check_time(data, time, path):
    found = vtk_to_numpy(data.GetFieldData().GetArray("TimeValue")).tolist()
    check(found == [time], f"{path}: its time is {found}, and in the collection {time}")


def read_shape(path, segments, time):
    """The nodes at one time, with their arrays."""
    data, nodes = read_poly_data(path)
    check(len(nodes) == segments + 1, f"{path}: {len(nodes)} points of {segments} segments")
    check_lines(data, 1, segments, path)
    points = data.GetPointData()
    arrays = {name: read_array(points, name, components, len(nodes), path) for name, components in ARRAYS.items()}
    check_time(data, time, path)
    return nodes, arrays


def read_frame(path, count, segments, time):
    """The nodes of so many filaments at one time, their arc lengths, and the arrays of the filaments."""
    data, points = read_poly_data(path, np.float32)
    check(len(points) == count * (segments + 1), f"{path}: {len(points)} points of {count} filaments")
    check_lines(data, count, segments, path)
    arc_lengths = read_array(data.GetPointData(), "arc_length_m", 1, len(points), path).reshape(count, segments + 1)
    arrays = {name: read_array(data.GetCellData(), name, 1, count, path) for name in OF_FILAMENTS}
    check_time(data, time, path)
    return points.astype(np.float64).reshape(count, segments + 1, 3), arc_lengths, arrays


def read_workpiece(path, settings):
    """The outline of the workpiece at z = 0, and the directions along, out of and across it. It is a strip of rectangles."""
    data, points = read_poly_data(path)
    count = len(points) // 2
    check(len(points) == 2 * count and count > 1, f"{path}: it has {len(points)} points")
    check(data.GetNumberOfPolys() == data.GetNumberOfCells() == count - 1, f"{path}: {data.GetNumberOfCells()} cells")
    for cell in range(count - 1):
        found = ids_of_cell(data, cell)
        check(found == [cell, cell + 1, count + cell + 1, count + cell], f"{path}: cell {cell} has the corners {found}")
    near, far = points[:count], points[count:]
    width = settings["tool"]["width_m"]
    check(np.allclose(np.linalg.norm(far - near, axis=1), width, rtol=1e-12), f"{path}: it is not as wide as the tool")
    outline = (near + far) / 2.0
    check(np.abs(outline[:, 2]).max() < ROUNDING, f"{path}: its middle is not at z = 0")
    ways = np.diff(outline, axis=0)
    lengths = np.linalg.norm(ways, axis=1)
    arc_lengths = vtk_to_numpy(data.GetPointData().GetArray("arc_length_m"))
    check((arc_lengths[:count] == arc_lengths[count:]).all(), f"{path}: both sides have other arc lengths")
    rises = np.diff(arc_lengths[:count])
    # A chord is shorter than its arc.
    check((rises > lengths - ROUNDING).all() and (rises < 1.01 * lengths).all(), f"{path}: wrong arc lengths")
    across = (far[0] - near[0]) / width
    tangents = ways / lengths[:, None]
    return outline, tangents, np.cross(across, tangents)


def distances(nodes, outline, tangents, normals):
    """Signed distances of nodes from an outline, and `True` if it is a straight line."""
    if np.ptp(normals, axis=0).max() < 1e-9:
        return (nodes - outline[0]) @ normals[0], True
    offsets = nodes[:, None, :] - outline[None, :-1, :]
    lengths = np.linalg.norm(np.diff(outline, axis=0), axis=1)
    places = np.clip((offsets * tangents).sum(axis=2), 0.0, lengths)
    rest = offsets - places[:, :, None] * tangents
    squares = (rest[:, :, :2] ** 2).sum(axis=2)
    nearest = squares.argmin(axis=1)
    each = np.arange(len(nodes))
    signs = np.sign((rest[each, nearest] * normals[nearest]).sum(axis=1))
    return signs * np.sqrt(squares[each, nearest]), False


def gaps_at(time, nodes, settings, workpiece):
    """Gaps of nodes to the workpiece at a time, and `True` if it is flat."""
    own = nodes - time * np.array([settings["workpiece"]["feed_velocity_m_s"], 0.0, 0.0])
    signed, is_flat = distances(own, *workpiece)
    return signed - settings["contact"]["radius_m"], is_flat


def read_collection(path):
    """Times and names of the files of the filament or the brush, and the name of the workpiece's."""
    parts = {}
    for entry in ElementTree.parse(path).getroot().iter("DataSet"):
        parts.setdefault(entry.get("part"), []).append((float(entry.get("timestep")), entry.get("file")))
    check(sorted(parts) == ["0", "1"], f"{path}: its parts are {sorted(parts)}")
    times = [time for time, _ in parts["0"]]
    check(times == sorted(set(times)), f"{path}: the times do not ascend")
    check([time for time, _ in parts["1"]] == times, f"{path}: the workpiece is not there at all times")
    workpieces = {name for _, name in parts["1"]}
    check(len(workpieces) == 1, f"{path}: there are several workpieces, {workpieces}")
    listed = {name for part in parts.values() for _, name in part}
    present = {file.name for file in path.parent.glob("*.vtp")}
    check(listed == present, f"{path}: it lists {len(listed)} files, and {len(present)} are there")
    return parts["0"], workpieces.pop()


def compare_shapes(directory):
    """Compares the filament at all times with history.csv and the workpiece. Roots, lengths and the start are tested in Rust."""
    settings = json.loads((directory / "case.json").read_text(encoding="utf-8"))["settings"]
    history = read_rows(directory / "history.csv")
    segments = settings["filament"]["segments"]
    radius = settings["tool"]["body_radius_m"]
    collection = directory / "vtk" / "contact.pvd"
    shapes, workpiece = read_collection(collection)
    check([time for time, _ in shapes] == [row["time_s"] for row in history], f"{collection}: other times than in history.csv")

    outline, tangents, normals = read_workpiece(directory / "vtk" / workpiece, settings)
    pressed, motion = 0, []
    for (time, name), row in zip(shapes, history):
        path = directory / "vtk" / name
        nodes, arrays = read_shape(path, segments, time)
        tip = [row["tip_x_m"], row["tip_y_m"], row["tip_z_m"]]
        check(nodes[-1].tolist() == tip, f"{path}: the tip is at {nodes[-1]}, and in history.csv at {tip}")
        gaps, is_flat = gaps_at(time, nodes, settings, (outline, tangents, normals))
        near = gaps < NEAR
        wrong = np.abs(arrays["gap_m"] - gaps)[near]
        check(wrong.max(initial=0.0) < SAG, f"{path}: the gaps are {arrays['gap_m']} instead of {gaps}")
        forces, force = arrays["contact_normal_force_n"], row["contact_normal_force_n"]
        check(np.isclose(forces.sum(), force, rtol=1e-12), f"{path}: normal force {forces.sum()}, in history.csv {force}")
        if is_flat:
            along = arrays["contact_force_n"] @ normals[0]
            check(np.allclose(along, forces), f"{path}: the force is not along the normal")
        else:
            pressing = np.linalg.norm(arrays["contact_force_n"], axis=1)
            check((pressing >= (1.0 - 1e-9) * forces).all(), f"{path}: the force is less than its part along the normal")
        directions = np.vstack([nodes[0] / radius, np.diff(nodes, axis=0)])
        cross = np.linalg.norm(np.cross(directions[:-1], directions[1:]), axis=1)
        angles = np.arctan2(cross, (directions[:-1] * directions[1:]).sum(axis=1))
        check(np.allclose(arrays["joint_angle_rad"][:-1], angles, atol=1e-9), f"{path}: the joint angles are not {angles}")
        motion.append((time, nodes, arrays["velocity_m_s"]))
        pressed += force > 0.0
    check(pressed > 0, f"{collection}: the filament never touches the workpiece")

    # Differences miss impacts, which are shorter than the time between shapes, so not all agree; most do.
    speeds = [
        np.abs((after - before) / (late - early) - velocity).max() / np.abs(velocity).max()
        for (early, before, _), (_, _, velocity), (late, after, _) in zip(motion, motion[1:], motion[2:])
    ]
    check(np.median(speeds) < 0.01, f"{collection}: velocities are off differences of positions by {np.median(speeds):.1e}")

    print(
        f"{collection}: {len(shapes)} shapes of {segments + 1} nodes, {pressed} in contact; tips and forces as in "
        f"history.csv"
    )


def compare_frames(directory):
    """Compares the filaments of a brush at all times with settings, filaments.csv, history.csv and workpiece."""
    settings = json.loads((directory / "brush.json").read_text(encoding="utf-8"))["settings"]
    filaments = {key: np.array(values) for key, values in transposed(read_rows(directory / "filaments.csv")).items()}
    history = {row["time_s"]: row for row in read_rows(directory / "history.csv")}
    count, segments = len(filaments["column"]), settings["filament"]["segments"]
    segment, radius = settings["filament"]["length_m"] / segments, settings["tool"]["body_radius_m"]
    rate = settings["process"]["brushing_velocity_m_s"] / (radius + settings["filament"]["length_m"])
    collection = directory / "vtk" / "brush.pvd"
    frames, workpiece = read_collection(collection)
    workpiece = read_workpiece(directory / "vtk" / workpiece, settings)
    pressed, begin, highest = 0, None, np.zeros(count)
    for time, name in frames:
        path = directory / "vtk" / name
        nodes, arc_lengths, arrays = read_frame(path, count, segments, time)
        check(time in history, f"{path}: its time is not in history.csv")
        row = history[time]
        for key in ("column", "row", "is_counted"):
            check((arrays[key] == filaments[key]).all(), f"{path}: {key} is not as in filaments.csv")
        lengths = np.linalg.norm(np.diff(nodes, axis=1), axis=2)
        # Both ends of a segment are rounded in three directions.
        wrong = np.abs(lengths - segment).max()
        check(wrong < 2.0 * np.sqrt(3.0) * SINGLE, f"{path}: segments are too long or too short, by up to {wrong:.1e} m")
        sums = np.cumsum(lengths, axis=1)
        wrong = np.abs(arc_lengths[:, 1:] - sums).max()
        check(wrong < ROUNDING and (arc_lengths[:, 0] == 0.0).all(), f"{path}: wrong arc lengths")
        # The tool turns evenly, and its filaments with it.
        angles = np.arctan2(nodes[:, 0, 1], nodes[:, 0, 0]) + filaments["root_angle_rad"] - rate * time
        begin = angles[0] if begin is None else begin
        turned = np.angle(np.exp(1j * (angles - begin)))
        check(np.abs(turned).max() * radius < 4.0 * SINGLE, f"{path}: roots are not where the tool has them")
        off = np.abs(np.hypot(nodes[:, 0, 0], nodes[:, 0, 1]) - radius) + np.abs(nodes[:, 0, 2] - filaments["root_z_m"])
        check(off.max() < 4.0 * SINGLE, f"{path}: roots are not on the body, or not in their rows")
        forces, presses = arrays["contact_normal_force_n"], arrays["press_force_n"]
        # Each force between two filaments is one of both.
        for found, key in ((forces.sum(), "contact_normal_force_n"), (0.5 * presses.sum(), "press_force_n")):
            equal = np.isclose(found, row[key], rtol=SINGLE_SHARE, atol=0.0)
            check(equal, f"{path}: {key} is {found}, in history.csv {row[key]}")
        check((forces > 0.0).sum() <= row["touching_filaments"], f"{path}: more filaments touch than in history.csv")
        gaps, _ = gaps_at(time, nodes.reshape(-1, 3), settings, workpiece)
        lowest = gaps.reshape(count, -1).min(axis=1)
        check((lowest[forces > 0.0] < SINGLE).all(), f"{path}: a filament is in contact above the workpiece")
        highest = np.maximum(highest, forces)
        pressed += (forces > 0.0).any()
    peaks = filaments["peak_contact_normal_force_n"]
    check((highest <= peaks * (1.0 + SINGLE_SHARE)).all(), f"{collection}: forces exceed the peaks in filaments.csv")
    check(pressed > 0, f"{collection}: no filament touches the workpiece")
    print(
        f"{collection}: {len(frames)} frames of {count} filaments of {segments + 1} nodes, {pressed} in contact; roots and peaks as in "
        f"filaments.csv, forces as in history.csv"
    )


def transposed(rows):
    """Columns instead of rows."""
    return {key: [row[key] for row in rows] for key in rows[0]}


def main():
    study, *results = map(Path, sys.argv[1:])
    empty = compare_tables(study, "runs", "study.json")
    check(empty > 0, f"{study}: no case has failed, so nothing is seen of empty cells")
    for directory in results:
        if (directory / "brush.json").exists():
            compare_frames(directory)
        else:
            compare_tables(directory, "history", "case.json")
            compare_shapes(directory)


if __name__ == "__main__":
    main()
