"""The paper's filament and pass as plain numbers, for the peers that are no symbolic engines.

The constants are those of derivations/cases.py. SI units, angles in radians.
"""

import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "derivations"))

from cases import TOOL_RADIUS_M, YOUNGS_MODULUS_PA, State  # noqa: E402
from cases import Case as PassOfCase  # noqa: E402
from files import DATA, read_table  # noqa: E402

SEGMENTS = 25

# (v_b in m/s, a_e in m)
Case = tuple[float, float]


class Pass(PassOfCase):
    """One pass of a filament over the workpiece, given by v_b and a_e."""

    def __init__(self, case: Case) -> None:
        super().__init__("paper", *case)


def reference_impulse_n_s(case: Case) -> float:
    """Returns p_n of a case by `derivations/passes.py contacts_cvodes`."""
    columns, rows = read_table(DATA / "reference_contacts_cvodes.csv")
    table = dict(zip(columns, rows.T, strict=True))
    inputs = zip(("brushing_velocity_m_s", "penetration_depth_m"), case, strict=True)
    of_case = np.all([table[name] == value for name, value in inputs], axis=0)
    return float(table["contact_normal_impulse_n_s"][of_case].item())


def bent_state(segments: int, bend: float = 0.6) -> State:
    """The bent, turning filament of `cargo bench --bench speed -- accelerations`."""
    rate, angle = 10.0 / TOOL_RADIUS_M, -1.55
    q, v = [], []
    for k in range(segments):
        along = (k + 0.5) / segments
        shape = along**1.5
        q += [math.pi / 2 + 0.02 * shape, angle - bend * shape]
        v += [2.0 * along, rate * (1.0 - 2.0 * along)]
    return State("bent", YOUNGS_MODULUS_PA, angle, rate, 0.0, [0.0, 0.0, 0.0], q, v)
