"""Forces of a brush with other constants than the paper's, from which a calibration must find them, by CVODES.

What enters: nothing; the points are those of `cases()` below.
What leaves: a JSON file with the normal and the tangential force of the tool at each point.

The passes are those of `reference_edges.py`, over a plane: F_n,w = p_n N_f ω/(2π), and F_t,w from −∫ F_x dt.
Each case is computed at two tolerances; the file gives the larger difference of the forces as its own
error.

Run from the repository root:

    python derivations/reference_calibration.py
"""

import json
import math

import cvodes
from cases import DATA, entries_of, parser_of, rounded, write_cases
from reference_edges import LOOSER, TOLERANCE, Case, Filament, Motion, Workpiece, metrics

FILAMENT_COUNT = 10_500
# What the calibration is to find, with µ.
FILAMENT = Filament(8, youngs_modulus_pa=2.8e9, damping_ratio=0.03)
FRICTION_COEFFICIENT = 0.15
SPEEDS_M_S = (5.0, 10.0, 20.0, 30.0)
DEPTHS_M = (0.5e-3, 1e-3, 2e-3, 3e-3)


def forces(case: Case, tolerance: float) -> dict[str, float]:
    """Those of the tool in N, from a pass at one tolerance."""
    found = metrics(Motion(case, tolerance))
    rate = FILAMENT_COUNT * case.rate_rad_s / (2 * math.pi)
    return {
        "tool_contact_normal_force_n": rate * found["contact_normal_impulse_n_s"],
        "tool_tangential_force_n": -rate * found["contact_impulse_x_n_s"],
    }


def result(case: Case) -> dict[str, object]:
    """The entry of a point in the file."""
    values, others = forces(case, TOLERANCE), forces(case, LOOSER)
    error = max(abs(values[name] / others[name] - 1) for name in values)
    point = {
        "brushing_velocity_m_s": case.brushing_velocity_m_s,
        "penetration_depth_m": case.penetration_depth_m,
    }
    return point | rounded(values) | {"own_error": float(f"{error:.1g}")}


def cases() -> list[Case]:
    """The points of the file."""
    plane = Workpiece("plane")
    return [
        Case("plane", FILAMENT, plane, speed, depth, FRICTION_COEFFICIENT)
        for speed in SPEEDS_M_S
        for depth in DEPTHS_M
    ]


def main() -> None:
    """Command line."""
    output = DATA / "reference_calibration.json"
    arguments = parser_of("Write forces of a brush.", output).parse_args()
    entries = entries_of(result, cases(), arguments)
    constants = {
        "segments": FILAMENT.segments,
        "youngs_modulus_pa": FILAMENT.youngs_modulus_pa,
        "damping_ratio": FILAMENT.damping_ratio,
        "friction_coefficient": FRICTION_COEFFICIENT,
    }
    if arguments.only is None:
        command = cvodes.command("reference_calibration.py", TOLERANCE)
        write_cases(arguments.output, command, entries, constants=json.dumps(constants))


if __name__ == "__main__":
    main()
