"""One pass of the paper's case over time, by a planar code that shares nothing with the Rust code.

What enters: brushing velocity and penetration depth (default: 10 m/s and 1 mm), number of rows.
What leaves: a CSV file with the contact force, its impulse and the tip at equally spaced times.

The equations and the solver are those of reference_contacts.py: CVODES, started again wherever a
node closes or opens. Angles between the points that it gives are a piecewise polynomial of order 5;
the impulse is a state of the solver up to the last end of a step, and from there on, for 8 of the
at least 20 000 points of a pass, the integral of the force on this polynomial by Gauss's formula.

Its own error is measured: the largest difference over all rows to a run with ten times the
tolerance, and to SciPy's Radau, which steps in another way.

SI units, angles in radians; origin on the tool axis, y normal to the plane workpiece.

Run from the repository root:

    python derivations/reference_trajectory.py
"""

import argparse
import math
from pathlib import Path

import casadi
import numpy as np
import scipy
from cases import BODY_RADIUS_M, LENGTH_M, TRAJECTORIES, made_by, write
from cvodes import (
    ABSOLUTE_TOLERANCE,
    INTEGRAL_UNIT,
    RATE_UNIT_RAD_S,
    ROWS,
    differences,
    table_text,
)
from reference_contacts import DEFAULT_TOLERANCES, SEGMENTS, SOLVERS, Pass, PlanarFilament
from scipy.integrate import fixed_quad

DEFAULT_OUTPUT = TRAJECTORIES / "pass_casadi_cvodes.csv"
DEFAULT_CASE = (10.0, 1.0e-3)
# Of Gauss's formula within a step of the search: exact for polynomials of order 9.
GAUSS_POINTS = 5
# A run beside it has so many times the tolerance.
LOOSER = 10.0

COLUMNS = (
    "time_s",
    "contact_normal_force_n",
    "contact_normal_impulse_n_s",
    "tip_x_m",
    "tip_y_m",
    "tip_deflection_m",
)


def tip_m(filament: PlanarFilament, time: float, angles: np.ndarray) -> tuple[float, float]:
    """Position of the tip."""
    contact_pass = filament.contact_pass
    body_angle = contact_pass.start_angle_rad + contact_pass.rate_rad_s * time
    h = LENGTH_M / SEGMENTS
    x = BODY_RADIUS_M * math.cos(body_angle) + h * float(np.sum(np.cos(angles)))
    y = BODY_RADIUS_M * math.sin(body_angle) + h * float(np.sum(np.sin(angles)))
    return x, y


def trajectory(
    filament: PlanarFilament, solver: str, relative_tolerance: float, rows: int
) -> tuple[np.ndarray, list[int]]:
    """Rows of the file, and the nodes (1 … n) that touch at one of their times or more."""
    times = np.linspace(0.0, filament.contact_pass.end_s, rows)
    start = filament.start()[:SEGMENTS]
    table = [(0.0, 0.0, 0.0, *tip_m(filament, 0.0, start), 0.0)]
    impulse, touching = 0.0, np.zeros(SEGMENTS, dtype=bool)
    for step in SOLVERS[solver](filament, relative_tolerance):

        def forces(points: np.ndarray, step=step) -> np.ndarray:
            return np.array([filament.contact_force_n(t, step.angles(t)) for t in points])

        while len(table) < rows and times[len(table)] <= step.end_s:
            time = float(times[len(table)])
            angles = step.angles(time)
            since = fixed_quad(forces, step.start_s, time, n=GAUSS_POINTS)[0]
            touching |= filament.gaps_m(time, angles) < 0.0
            table.append(
                (
                    time,
                    filament.contact_force_n(time, angles),
                    impulse + float(since),
                    *tip_m(filament, time, angles),
                    filament.tip_deflection_m(time, angles),
                )
            )
        impulse = step.end_impulse_n_s
    return np.array(table), [int(node) + 1 for node in np.flatnonzero(touching)]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Write a pass of the paper's case over time.")
    parser.add_argument(
        "--case",
        nargs=2,
        type=float,
        default=DEFAULT_CASE,
        metavar=("VELOCITY", "DEPTH"),
        help="brushing velocity in m/s and penetration depth in m",
    )
    parser.add_argument("--rows", type=int, default=ROWS, help="both ends included")
    parser.add_argument("--output", type=Path, default=DEFAULT_OUTPUT, help="CSV file to write")
    arguments = parser.parse_args()

    tolerance = DEFAULT_TOLERANCES["cvodes"]
    filament = PlanarFilament(Pass(*arguments.case))
    table, touching = trajectory(filament, "cvodes", tolerance, arguments.rows)
    looser, _ = trajectory(filament, "cvodes", LOOSER * tolerance, arguments.rows)
    radau, _ = trajectory(filament, "radau", DEFAULT_TOLERANCES["radau"], arguments.rows)

    command = "reference_trajectory.py"
    if tuple(arguments.case) != DEFAULT_CASE:
        command += f" --case {arguments.case[0]} {arguments.case[1]}"
    if arguments.rows != ROWS:
        command += f" --rows {arguments.rows}"
    comments = [
        made_by(command, casadi, np, scipy),
        f"A pass of the paper's case: {SEGMENTS} segments, brushing velocity "
        f"{arguments.case[0]:g} m/s, penetration depth {arguments.case[1]:g} m, no friction, "
        "no gravity.",
        f"Settings: CVODES, relative tolerance {tolerance:g}, absolute "
        f"{ABSOLUTE_TOLERANCE * tolerance:.3g} of 1 rad, {RATE_UNIT_RAD_S:g} rad/s, "
        f"{INTEGRAL_UNIT:g} N s. Nodes that touch, counted from the root: "
        f"{', '.join(str(node) for node in touching) or 'none'}.",
        f"Own error, largest difference to relative tolerance {LOOSER * tolerance:g}: "
        f"{differences(COLUMNS, table, looser)}.",
        f"Largest difference to SciPy's Radau at {DEFAULT_TOLERANCES['radau']:g}: "
        f"{differences(COLUMNS, table, radau)}.",
    ]
    write(arguments.output, table_text(comments, COLUMNS, table))


if __name__ == "__main__":
    main()
