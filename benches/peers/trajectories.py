"""Whole motions by peers: a pass of the paper's case, a row of filaments, a beam that is spun up.

What enters: the constants of paper_case.py and exudyn_cable.py, the input of
derivations/cases.py, and for one row of the metrics the contacts in tests/data.
What leaves, in benches/peers/trajectories: pass_mujoco.csv, pass_exudyn_ancf.csv, pass_metrics.csv
and spin_up.csv; in tests/data: reference_row_mujoco.json, a row of filaments that touch each other,
in the format of reference_row.json. Each has its own error, measured by refining.

It needs the environment that run.py makes. Run from the repository root:

    target/peers/venv/bin/python benches/peers/trajectories.py
    target/peers/venv/bin/python benches/peers/trajectories.py --only spin_up
"""

import argparse
import csv
import io
import json
import platform
from dataclasses import replace
from pathlib import Path

import exudyn
import exudyn_cable
import mujoco
import mujoco_chain
import numpy as np
from exudyn_cable import SPIN_UP_AXIAL_STIFFNESS_N, Settings
from mujoco_row import FILAMENTS, Motion, Row, Touch, contact_points
from paper_case import CONTACT_STIFFNESS_N_M, SEGMENTS, Case, Pass, reference
from pass_motion import COLUMNS, PassMotion

# isort: split
# From derivations, which paper_case puts on the path.
import cases
from files import DATA, differences, rounded, table_text, write

FOLDER = Path(__file__).resolve().parent / "trajectories"
CASE: Case = (10.0, 1e-3)
PASS_ROWS = 1001
SPIN_UP_ROWS = 201

MUJOCO_STEPS = 1_320_000
ROW_SEGMENTS = 5
ROW_COLUMNS = 6
ROW_STEP_S = 5e-8
HERTZ_STIFFNESS_N_M2 = 9e8

CABLE = Settings(elements=64, steps=132_000, tolerance_n=1e-5)
SPIN_UP = Settings(elements=64, steps=128_000, tolerance_n=1e-3)
# Axial stiffness over that of the filament, and over the published one. Ten times as stiff, the
# rounding of the axial forces is too large for the spin-up.
CABLE_AXIAL_FACTOR = 1000.0
SPIN_UP_AXIAL_FACTOR = 100.0
# The effect of stretching is inversely proportional to the axial stiffness, so a tenth of it shows
# nine times what is left.
SOFTER = 10.0

SPIN_UP_COLUMNS = ("time_s", "tip_along_m", "tip_across_m")
METRICS = (
    "contact_normal_impulse_n_s",
    "contact_time_s",
    "contact_count",
    "peak_contact_normal_force_n",
    "max_tip_deflection_m",
)
METRICS_COLUMNS = ("code", "segments", *METRICS, "impulse_error")

Metrics = dict[str, float | int]


def coarser(settings: Settings, axial_factor: float) -> dict[str, tuple[Settings, float]]:
    """What each run that measures an error has, by what it differs in."""
    softer = replace(settings, tolerance_n=settings.tolerance_n / SOFTER)
    return {
        "half the elements": (replace(settings, elements=settings.elements // 2), axial_factor),
        "twice the step": (replace(settings, steps=settings.steps // 2), axial_factor),
        "ten times Newton's tolerance": (
            replace(settings, tolerance_n=10 * settings.tolerance_n),
            axial_factor,
        ),
        "a tenth of the axial stiffness": (softer, axial_factor / SOFTER),
    }


def unstiffened(settings: Settings, axial_factor: float) -> Settings:
    """For the axial stiffness that the beam really has: the rounding goes with it."""
    return replace(settings, tolerance_n=settings.tolerance_n / axial_factor)


def command(group: str) -> str:
    """How a file was made."""
    return (
        f"python benches/peers/trajectories.py --only {group} (Python "
        f"{platform.python_version()}, exudyn {exudyn.__version__}, mujoco {mujoco.__version__}, "
        f"numpy {np.__version__})"
    )


def change(metrics: Metrics, others: Metrics) -> float:
    """Relative difference of p_n."""
    impulse = "contact_normal_impulse_n_s"
    return abs(others[impulse] / metrics[impulse] - 1)


def mujoco_pass() -> tuple[Metrics, float]:
    """Writes the file; the metrics, and the relative error of p_n."""

    def motion(steps: int) -> PassMotion:
        step_s = Pass(CASE).end_s / steps
        return mujoco_chain.Contact(CASE, step_s, "one hinge, planar").motion()

    fine, coarse = motion(MUJOCO_STEPS), motion(MUJOCO_STEPS // 2)
    rows, coarse_rows = fine.rows(PASS_ROWS), coarse.rows(PASS_ROWS)
    error = change(fine.metrics(), coarse.metrics())
    comments = [
        command("pass"),
        f"A pass of the paper's case by MuJoCo: {SEGMENTS} segments on planar hinges, brushing "
        f"velocity {CASE[0]:g} m/s, penetration depth {CASE[1]:g} m, no friction, no gravity.",
        f"Settings: implicitfast, step {fine.step_s:.6g} s, no error control; the impulse by the "
        "trapezoidal rule over all steps.",
        "Own error, largest difference to twice the step (the method is of first order, so "
        f"that is what is left): {differences(COLUMNS, rows, coarse_rows)}; whole impulse, "
        f"relative, {error:.1g}.",
    ]
    write(FOLDER / "pass_mujoco.csv", table_text(comments, COLUMNS, rows))
    return fine.metrics(), error


def cable_pass() -> tuple[Metrics, float]:
    """Writes the file; the metrics, and the relative error of p_n."""
    motion, beside_tip_m = exudyn_cable.contact_pass(CASE, CABLE, CABLE_AXIAL_FACTOR)
    rows, metrics = motion.rows(PASS_ROWS), motion.metrics()
    comments = [
        command("pass"),
        "A pass of the paper's case by Exudyn, a continuous beam of ObjectANCFCable2D (no "
        f"segments): brushing velocity {CASE[0]:g} m/s, penetration depth {CASE[1]:g} m, no "
        "friction, no gravity.",
        f"Settings: {CABLE.elements} elements, generalised alpha (spectral radius "
        f"{exudyn_cable.SPECTRAL_RADIUS:g}), step {motion.step_s:.6g} s, Newton to "
        f"{CABLE.tolerance_n:g} N, {CABLE_AXIAL_FACTOR:g} times the axial stiffness of the "
        "filament, so that it hardly stretches; the impulse by the trapezoidal rule over all "
        "steps.",
        "The tip alone has contact; the node beside it stays "
        f"{beside_tip_m:.2g} m above the workpiece or more.",
    ]
    changes = {}
    for name, (settings, axial_factor) in coarser(CABLE, CABLE_AXIAL_FACTOR).items():
        other, _ = exudyn_cable.contact_pass(CASE, settings, axial_factor)
        changes[name] = change(metrics, other.metrics())
        comments.append(
            f"Largest difference to {name}: "
            f"{differences(COLUMNS, rows, other.rows(PASS_ROWS))}; whole impulse, relative, "
            f"{changes[name]:.1g}."
        )
    own, _ = exudyn_cable.contact_pass(CASE, unstiffened(CABLE, CABLE_AXIAL_FACTOR), 1.0)
    *refined, stretching = changes.values()
    error = sum(refined) + stretching / (SOFTER - 1)
    comments += [
        "With the axial stiffness of the filament itself, E A, the whole impulse is "
        f"{own.metrics()['contact_normal_impulse_n_s']:.6g} N s, the peak force "
        f"{own.metrics()['peak_contact_normal_force_n']:.4g} N, in "
        f"{own.metrics()['contact_count']} contacts.",
        "Own error of the whole impulse against the inextensible beam, relative, mesh, step, "
        "tolerance and a ninth of the difference by the axial stiffness together: "
        f"{error:.1g}.",
    ]
    write(FOLDER / "pass_exudyn_ancf.csv", table_text(comments, COLUMNS, rows))
    return metrics, error


def passes() -> None:
    """The files of the pass."""
    found = [reference(f"reference_contacts{end}.csv", CASE) for end in ("_cvodes", "")]
    cvodes, radau = ({name: float(row[name]) for name in METRICS} for row in found)
    rows = {
        ("CasADi and CVODES", SEGMENTS): (cvodes, change(cvodes, radau)),
        ("MuJoCo", SEGMENTS): mujoco_pass(),
        ("Exudyn ANCF", ""): cable_pass(),
    }
    text = io.StringIO()
    text.write(
        f"# {command('pass')}\n"
        "# Metrics of the pass in pass_mujoco.csv and pass_exudyn_ancf.csv, whose first lines "
        "tell the settings; and of CasADi and CVODES, copied from "
        "tests/data/reference_contacts_cvodes.csv.\n"
        "# impulse_error: relative, of the code's own p_n: MuJoCo's by twice the step, that of "
        "Exudyn (a beam, not a chain) by mesh, step, tolerance and axial stiffness, that of "
        "CasADi by the difference to SciPy's Radau.\n"
    )
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(METRICS_COLUMNS)
    for (code, segments), (metrics, error) in rows.items():
        values = [f"{metrics[name]:.12g}" for name in METRICS]
        writer.writerow([code, segments, *values, f"{error:.1g}"])
    write(FOLDER / "pass_metrics.csv", text.getvalue())


def row_input(stiffness_n_m2: float) -> dict[str, dict[str, object]]:
    """Settings of the row, as reference_row.json names them."""
    brush = cases.Brush(ROW_COLUMNS, float(FILAMENTS), stiffness_n_m2, contact_points(ROW_SEGMENTS))
    inputs = cases.Case("", *CASE, filament=cases.Filament(ROW_SEGMENTS), brush=brush).inputs()
    # MuJoCo's row has no friction.
    return {**inputs, "contact": {"stiffness_n_m": CONTACT_STIFFNESS_N_M}}


def row() -> None:
    """The file of the row: what each filament does, with both shapes of filaments."""
    entries = []
    for name, touch in (
        ("points", Touch("points")),
        ("points, Hertz's stiffness", Touch("points", stiffness_n_m2=HERTZ_STIFFNESS_N_M2)),
        ("capsules", Touch("capsules")),
    ):

        def motion(step_s: float, touch: Touch = touch) -> Motion:
            return Row(CASE, ROW_SEGMENTS, ROW_COLUMNS, step_s, touch).run()

        fine, coarse = motion(ROW_STEP_S), motion(2 * ROW_STEP_S)
        filaments = [
            {
                "column": column,
                "contact_normal_impulse_n_s": fine.impulses_n_s[column],
                "contact_impulse_x_n_s": 0.0,
                "friction_work_j": 0.0,
                "contact_time_s": fine.contact_times_s[column],
                "max_tip_deflection_m": fine.max_deflections_m[column],
            }
            for column in range(ROW_COLUMNS)
        ]
        errors = {
            "contact_normal_impulse_n_s": coarse.impulses_n_s / fine.impulses_n_s - 1,
            "contact_time_s": coarse.contact_times_s / fine.contact_times_s - 1,
            "max_tip_deflection_m": coarse.max_deflections_m / fine.max_deflections_m - 1,
        }
        entries.append(
            {
                "name": name,
                "input": row_input(touch.stiffness_n_m2),
                "friction_at": None,
                "filaments": rounded(filaments),
                "own_errors": {
                    name: float(f"{np.abs(values).max():.1g}") for name, values in errors.items()
                },
            }
        )
    document = {
        "made_by": command("row"),
        "method": f"MuJoCo, implicitfast, steps of {ROW_STEP_S:g} s, contacts as springs; "
        '"points" is the rule of MODEL.md, "capsules" are the shapes of MuJoCo (mujoco_row.py says '
        "more). own_errors: largest relative difference to twice the step.",
        "cases": entries,
    }
    text = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    write(DATA / "reference_row_mujoco.json", text)


def spin_up() -> None:
    """The file of the spin-up."""

    def run(settings: Settings, axial_factor: float) -> np.ndarray:
        return exudyn_cable.spin_up(settings, axial_factor, SPIN_UP_ROWS)

    rows = run(SPIN_UP, SPIN_UP_AXIAL_FACTOR)
    others = {
        name: run(settings, axial_factor)
        for name, (settings, axial_factor) in coarser(SPIN_UP, SPIN_UP_AXIAL_FACTOR).items()
    }
    own = run(unstiffened(SPIN_UP, SPIN_UP_AXIAL_FACTOR), 1.0)
    others["geometrically exact beam elements, half as many with a node more"] = (
        exudyn_cable.exact_spin_up(
            replace(SPIN_UP, elements=SPIN_UP.elements // 2), SPIN_UP_AXIAL_FACTOR, SPIN_UP_ROWS
        )
    )
    others[f"E A = {SPIN_UP_AXIAL_STIFFNESS_N:g} N, the published one"] = own
    comments = [
        command("spin_up"),
        "The spin-up of Simo and Vu-Quoc (1986, part II) by Exudyn, ObjectANCFCable2D: clamped "
        "at the axis, L = 10 m, E I = 1.4e4 N m^2, 1.2 kg/m, no rotary inertia, no damping, no "
        "gravity; psi = (6/15) (t^2/2 + (15/(2 pi))^2 (cos(2 pi t/15) - 1)) for t < 15 s, then "
        "6 t - 45.",
        "Tip displacement along the clamp direction, which turns with psi, and across it, "
        "positive in the direction of rotation.",
        f"Settings: {SPIN_UP.elements} elements, generalised alpha (spectral radius "
        f"{exudyn_cable.SPECTRAL_RADIUS:g}), {SPIN_UP.steps} steps, Newton to "
        f"{SPIN_UP.tolerance_n:g} N, E A = "
        f"{SPIN_UP_AXIAL_FACTOR * SPIN_UP_AXIAL_STIFFNESS_N:g} N, so that it hardly stretches.",
        "Own error: of the differences by mesh and step a third is left at most, of that by the "
        "axial stiffness a ninth, as stretching goes with 1 / (E A).",
    ]
    comments += [
        f"Largest difference to {name}: {differences(SPIN_UP_COLUMNS, rows, other)}."
        for name, other in others.items()
    ]
    write(FOLDER / "spin_up.csv", table_text(comments, SPIN_UP_COLUMNS, rows))


GROUPS = {"pass": passes, "row": row, "spin_up": spin_up}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Write the motions that peers give.")
    parser.add_argument("--only", choices=GROUPS, help="these files")
    arguments = parser.parse_args()
    exudyn_cable.quiet()
    for name, group in GROUPS.items():
        if arguments.only in (None, name):
            group()


if __name__ == "__main__":
    main()
