"""Passes of filaments over workpieces, by a code that shares nothing with the Rust code.

Input: the cases of `groups.py`.
Output: files in tests/data and derivations/trajectories; or with `--check` a comparison with the
committed files.

Method:

1. The energies of a chain in space are stated once, in polar angles φ_k from z and azimuths θ_k.
   The planar chain is the same with φ_k = π/2. CasADi differentiates them (`motion.py`).
2. Workpieces are plug-ins (`workpieces.py`). Friction is regularised Coulomb friction.
3. Points of a filament are pressed off the nearest point of a neighbour's polyline, along the
   gradient of the energy E_ab. Friction between filaments acts half-way between the two points.
4. The active set lists the nodes that meet faces, the features that meet edges, and the points that
   meet neighbours. The equations are smooth while the set does not change, and the solver starts
   again where it does. Nothing is smoothed but friction, as MODEL.md says.
5. The integrals of the metrics are states of the solver; contact times are sums of windows.

Each case is computed at two tolerances. The file states the largest difference as its own error.

SI units, angles in radians. Frames and symbols are those of MODEL.md.

Run from the repository root:

    python derivations/passes.py edges
    python derivations/passes.py edges --only "leaving, 5 m/s" --check
"""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import casadi
import files
import motion
import numpy as np
import scipy
from cases import EDGE_ANGLES, NORMAL, SLIDING, Case
from entries import ENTRY_OF, STATICS
from filaments import OBSERVED
from files import relative_differences
from groups import GROUPS, Group
from integration import Pass
from motion import RATE_UNIT_RAD_S

# Tolerance of the second run, as a multiple of the first one's.
LOOSER = 10.0
# The pass that is written over time, by its group and index, and its rows, both ends included.
TRAJECTORY, ROWS = (GROUPS["contacts_cvodes"], 1), 1001
# Its columns, with the errors that the file states.
COLUMNS = {
    "time_s": 1e-13,
    "contact_normal_force_n": 1e-7,
    NORMAL: 2e-12,
    **dict.fromkeys(("tip_x_m", "tip_y_m", "tip_deflection_m"), 4e-11),
}
# Relative differences from committed numbers, beyond three times the error that the file states:
# the new run has an error, too.
CHECK_TOLERANCE, CHECK_FACTOR = 1e-7, 3.0
# Errors of committed cases that tighter tolerances have shown, and that their files do not state.
KNOWN_ERRORS = {"4 turns": 5e-5}
# Penetrations are sampled about every microsecond, committed peaks of rows every quarter of one. No
# error is stated of velocities.
CHECK_TOLERANCES = {
    ("largest_edge_penetration_m",): 0.03,
    ("final_tip_velocity_m_s",): 1e-5,
    ("filaments", "peak_contact_normal_force_n"): 1e-3,
    ("filaments", "max_tip_deflection_m"): 1e-6,
}


def own_errors(entry: dict[str, object], other: dict[str, object]) -> dict[str, object]:
    """Returns the largest differences of two runs, under the names that they have in the files."""
    found = list(relative_differences(entry, other))

    def largest(is_part: Callable[[tuple[str, ...]], bool]) -> float:
        errors = [e for path, e in found if is_part(path) and path not in CHECK_TOLERANCES]
        return float(f"{max(errors, default=0.0):.1g}")

    if "filaments" in entry:
        parts = {
            NORMAL: largest(lambda path: path == ("filaments", NORMAL)),
            "filaments": largest(lambda path: path[0] == "filaments" and path[-1] != NORMAL),
            "neighbours": largest(lambda path: path[0] == "neighbours"),
        }
        return {"own_errors": parts}
    of_sliding = (*SLIDING, *EDGE_ANGLES)
    errors = {"own_error": largest(lambda path: path[-1] not in of_sliding)}
    if SLIDING[0] in entry:
        errors["own_error_of_sliding"] = largest(lambda path: path[-1] in of_sliding)
    return errors


def entry_of(name: str, case: Case, has_error: bool) -> dict[str, object]:
    """Returns the entry of a case of the group `name`, perhaps with its own error."""
    group = GROUPS[name]
    entry = ENTRY_OF[name](case, group, group.relative_tolerance)
    if has_error:
        looser = ENTRY_OF[name](case, group, LOOSER * group.relative_tolerance)
        entry |= own_errors(entry, looser)
    return entry


def command(group_name: str, group: Group) -> str:
    """Returns the command that made a file."""
    tolerance = group.relative_tolerance
    return (
        f"{files.made_by(f'passes.py {group_name}', casadi, np, scipy)}: cvodes, relative "
        f"tolerance {tolerance:g}, absolute {motion.ABSOLUTE_TOLERANCE * tolerance:g} of 1 rad, "
        f"{RATE_UNIT_RAD_S:g} rad/s, {motion.INTEGRAL_UNIT:g} N s"
    )


def path_of(group_name: str) -> Path:
    """Returns the path of the file of a group."""
    return files.DATA / f"reference_{group_name}.{'csv' if 'contacts' in group_name else 'json'}"


def write_group(group_name: str, entries: Sequence[dict[str, object]]) -> None:
    """Writes the file of a group."""
    group, path, sections = GROUPS[group_name], path_of(group_name), {}
    origin = command(group_name, group)
    if path.suffix == ".csv":
        columns = [key for key in entries[0] if key != "own_error"]
        table = np.array([[entry[column] for column in columns] for entry in entries])
        errors = f"Own errors: {', '.join(str(entry['own_error']) for entry in entries)}"
        files.write(path, files.table_text([origin, errors], columns, table))
        return
    if group_name == "poses":
        for name, (entry_of_cup, cups) in STATICS.items():
            lines = ",\n".join(json.dumps(entry_of_cup(case)) for case in cups())
            sections[name] = f"[\n{lines}\n]"
    if group_name == "calibration":
        case = group.cases[0]
        keys = "segments", "youngs_modulus_pa", "damping_ratio"
        constants = {key: getattr(case.filament, key) for key in keys}
        constants["friction_coefficient"] = case.friction_coefficient
        sections["constants"] = json.dumps(constants)
    files.write_cases(path, origin, entries, **sections)


def is_wrong(entry: dict[str, object], committed: dict[str, object], label: str) -> bool:
    """Prints the largest difference from a committed entry, over the allowed one."""
    stated = [committed.get("own_error", 0.0), committed.get("own_error_of_sliding", 0.0)]
    stated.append(KNOWN_ERRORS.get(committed.get("name"), 0.0))
    stated += committed.get("own_errors", {}).values()
    limit = CHECK_TOLERANCE + CHECK_FACTOR * max(stated)
    found = [
        (error / max(limit, CHECK_TOLERANCES.get(path, limit)), error, path)
        for path, error in relative_differences(entry, committed)
    ]
    worst, error, path = max(found)
    print(f"{label}: {error:.1e} in {'/'.join(path)}, {worst:.2f} of what is allowed", flush=True)
    return not worst <= 1.0


def run_group(group_name: str, only: str | None, is_check: bool) -> bool:
    """Writes or checks a group; `True` if a committed number is wrong."""
    all_cases, entries, wrong, committed = GROUPS[group_name].cases, [], False, {}
    if is_check and path_of(group_name).suffix == ".json":
        committed = json.loads(path_of(group_name).read_text(encoding="utf-8"))
    elif is_check:
        columns, table = files.read_table(path_of(group_name))
        committed["cases"] = [dict(zip(columns, row, strict=True)) for row in table.tolist()]
    for i, case in enumerate(all_cases):
        if case.label.startswith(only or ""):
            entries.append(entry_of(group_name, case, not is_check))
            if is_check:
                wrong |= is_wrong(entries[-1], committed["cases"][i], case.label)
            else:
                print(f"{case.label}: done", file=sys.stderr, flush=True)
    if not is_check:
        write_group(group_name, entries)
    for name, (entry_of_cup, cups) in STATICS.items() if group_name == "poses" and is_check else ():
        if name.startswith(only or ""):
            cups = [entry_of_cup(case) for case in cups()]
            wrong |= is_wrong({"cups": cups}, {"cups": committed[name]}, name)
    return wrong


def trajectory(tolerance: float) -> np.ndarray:
    """Returns the rows of the trajectory at a relative tolerance."""
    group, index = TRAJECTORY
    motion, rows = Pass(group.cases[index], group, tolerance), []
    for time, state, window in motion.sampled(ROWS):
        instant = replace(window, times=np.array([time]), states=state[:, None])
        named = dict(zip(OBSERVED, motion.observed(instant)[0, 0], strict=True))
        named |= {"time_s": time, NORMAL: instant.integrals(0)[0]}
        rows.append([named[column] for column in COLUMNS])
    return np.array(rows)


def run_trajectory(is_check: bool) -> bool:
    """Writes or checks the trajectory; `True` if it differs by more than allowed."""
    path = files.TRAJECTORY_FOLDER / "pass_casadi_cvodes.csv"
    group, index = TRAJECTORY
    case, tolerance = group.cases[index], group.relative_tolerance
    columns, rows = list(COLUMNS), trajectory(tolerance)
    if is_check:
        found, committed = files.read_table(path)
        changes = np.max(np.abs(rows - committed), axis=0) / list(COLUMNS.values())
        worst = float(np.max(changes)) / CHECK_FACTOR
        column = columns[int(np.argmax(changes))]
        print(f"trajectory: {worst:.2f} of what is allowed, in {column}", flush=True)
        return found != columns or not worst <= 1.0
    looser = trajectory(LOOSER * tolerance)
    comments = [
        command("trajectory", group),
        f"{case.label}, {case.filament.segments} segments; settings: "
        f"{json.dumps({'workpiece': case.workpiece.inputs(), **case.inputs()})}.",
        f"Own error, largest difference to relative tolerance {LOOSER * tolerance:g}: "
        f"{files.differences(columns, rows, looser)}.",
    ]
    files.write(path, files.table_text(comments, columns, rows, files.LEAST_VALUE))
    return False


def main() -> int:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description="Write or check passes of filaments.")
    parser.add_argument("group", choices=[*GROUPS, "trajectory"], help="names the file")
    parser.add_argument("--only", help="checks cases whose labels begin with this")
    parser.add_argument("--check", action="store_true", help="compare with the committed file")
    arguments = parser.parse_args()
    is_check = arguments.check or arguments.only is not None
    if arguments.group == "trajectory":
        return int(run_trajectory(is_check))
    return int(run_group(arguments.group, arguments.only, is_check))


if __name__ == "__main__":
    sys.exit(main())
