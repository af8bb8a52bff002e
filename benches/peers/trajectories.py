"""Whole motions by MuJoCo: a pass of the paper's case, and a row of filaments that touch.

What enters: the constants of paper_case.py and the input of derivations/cases.py.
What leaves: trajectories/pass_mujoco.csv, and tests/data/reference_row_mujoco.json in the format of
reference_row.json. Each has its own error, measured by refining.

It needs the environment that run.py makes. Run from the repository root:

    target/peers/venv/bin/python benches/peers/trajectories.py
    target/peers/venv/bin/python benches/peers/trajectories.py --only row
"""

import argparse
import json
import platform
from pathlib import Path

import mujoco
import mujoco_chain
import numpy as np
from mujoco_row import FILAMENTS, Motion, Row, Touch, contact_points
from paper_case import CONTACT_STIFFNESS_N_M, SEGMENTS, Case, Pass
from pass_motion import COLUMNS, PassMotion

# isort: split
# From derivations, which paper_case puts on the path.
import cases
from files import DATA, differences, rounded, table_text, write

FOLDER = Path(__file__).resolve().parent / "trajectories"
CASE: Case = (10.0, 1e-3)
PASS_ROWS = 1001

MUJOCO_STEPS = 1_320_000
ROW_SEGMENTS = 5
ROW_COLUMNS = 6
ROW_STEP_S = 5e-8
HERTZ_STIFFNESS_N_M2 = 9e8


def command(group: str) -> str:
    """How a file was made."""
    return (
        f"python benches/peers/trajectories.py --only {group} (Python "
        f"{platform.python_version()}, mujoco {mujoco.__version__}, numpy {np.__version__})"
    )


def mujoco_pass() -> None:
    """Writes the file of the pass."""

    def motion(steps: int) -> PassMotion:
        step_s = Pass(CASE).end_s / steps
        return mujoco_chain.Contact(CASE, step_s, "one hinge, planar").motion()

    fine, coarse = motion(MUJOCO_STEPS), motion(MUJOCO_STEPS // 2)
    rows, coarse_rows = fine.rows(PASS_ROWS), coarse.rows(PASS_ROWS)
    impulses = [motion.metrics()["contact_normal_impulse_n_s"] for motion in (fine, coarse)]
    error = abs(impulses[1] / impulses[0] - 1)
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


GROUPS = {"pass": mujoco_pass, "row": row}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Write the motions by MuJoCo.")
    parser.add_argument("--only", choices=GROUPS, help="these files")
    arguments = parser.parse_args()
    for name, group in GROUPS.items():
        if arguments.only in (None, name):
            group()


if __name__ == "__main__":
    main()
