"""A row of filaments that touch, by MuJoCo.

Input: the constants of paper_case.py and the input of derivations/cases.py.
Output: tests/data/reference_row_mujoco.json in the format of reference_row.json. It has its
own error, measured by refining.

It needs the environment that run.py makes. Run from the repository root:

    target/peers/venv/bin/python benches/peers/trajectories.py
"""

import json
import platform

import mujoco
import numpy as np
from mujoco_row import FILAMENTS, Motion, Row, Touch, contact_points
from paper_case import Case

# isort: split
# From derivations, which paper_case puts on the path.
import cases
from files import DATA, rounded, write

CASE: Case = (10.0, 1e-3)
ROW_SEGMENTS = 5
ROW_COLUMNS = 6
ROW_STEP_S = 5e-8
HERTZ_STIFFNESS_N_M2 = 9e8


def row_input(stiffness_n_m2: float) -> dict[str, dict[str, object]]:
    """Settings of the row, as reference_row.json names them."""
    brush = cases.Brush(ROW_COLUMNS, float(FILAMENTS), stiffness_n_m2, contact_points(ROW_SEGMENTS))
    inputs = cases.Case("", *CASE, filament=cases.Filament(ROW_SEGMENTS), brush=brush).inputs()
    # MuJoCo's row has no friction.
    return {**inputs, "contact": {"stiffness_n_m": cases.CONTACT_STIFFNESS_N_M}}


def main() -> None:
    """Writes the file: motion of each filament, with both shapes of filaments."""
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
        "made_by": f"python benches/peers/trajectories.py (Python {platform.python_version()}, "
        f"mujoco {mujoco.__version__}, numpy {np.__version__})",
        "method": f"MuJoCo, implicitfast, steps of {ROW_STEP_S:g} s, contacts as springs; "
        '"points" is the rule of MODEL.md, "capsules" are the shapes of MuJoCo (mujoco_row.py says '
        "more). own_errors: largest relative difference to twice the step.",
        "cases": entries,
    }
    text = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    write(DATA / "reference_row_mujoco.json", text)


if __name__ == "__main__":
    main()
