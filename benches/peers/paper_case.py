"""The paper's filament and pass as plain numbers, for the peers that are no symbolic engines.

The constants are those of derivations/cases.py. SI units, angles in radians.
"""

import csv
import math
import sys
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "derivations"))

from cases import (  # noqa: E402
    BODY_RADIUS_M as BODY_RADIUS_M,
    CONTACT_STIFFNESS_N_M as CONTACT_STIFFNESS_N_M,
    DAMPING_RATIO,
    DATA,
    DENSITY_KG_M3,
    DIAMETER_M,
    FIRST_CANTILEVER_ROOT,
    LENGTH_M,
    TOOL_RADIUS_M,
    YOUNGS_MODULUS_PA,
    State,
)
from cases import Case as PassOfCase  # noqa: E402

SEGMENTS = 25

AREA_M2 = math.pi * DIAMETER_M**2 / 4
BENDING_STIFFNESS_N_M2 = YOUNGS_MODULUS_PA * math.pi * DIAMETER_M**4 / 64
FIRST_FREQUENCY_RAD_S = FIRST_CANTILEVER_ROOT**2 * math.sqrt(
    BENDING_STIFFNESS_N_M2 / (DENSITY_KG_M3 * AREA_M2 * LENGTH_M**4)
)

# (v_b in m/s, a_e in m)
Case = tuple[float, float]


@dataclass(frozen=True)
class Chain:
    """Constants of the chain of so many segments; the lists run over the joints."""

    segments: int = SEGMENTS

    @property
    def length_m(self) -> float:
        """Of a segment."""
        return LENGTH_M / self.segments

    @property
    def mass_kg(self) -> float:
        """Of a segment."""
        return DENSITY_KG_M3 * AREA_M2 * self.length_m

    @property
    def inertia_kg_m2(self) -> float:
        """Of a segment, about its centre, across its axis."""
        return self.mass_kg * self.length_m**2 / 12

    @property
    def stiffness_n_m(self) -> list[float]:
        """The clamp joint carries only half a segment's compliance."""
        stiffness = BENDING_STIFFNESS_N_M2 / self.length_m
        return [2 * stiffness, *[stiffness] * (self.segments - 1)]

    @property
    def damping_n_m_s(self) -> list[float]:
        """Proportional to the stiffness: the first mode has the damping ratio."""
        return [2 * DAMPING_RATIO / FIRST_FREQUENCY_RAD_S * c for c in self.stiffness_n_m]


class Pass(PassOfCase):
    """One pass of a filament over the workpiece, and what follows from v_b and a_e."""

    def __init__(self, case: Case) -> None:
        super().__init__("paper", *case)


def reference(name: str, case: Case) -> dict[str, str]:
    """The row of a case in a file of `derivations/passes.py contacts`."""
    lines = (DATA / name).read_text(encoding="utf-8").splitlines()
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        if (float(row["brushing_velocity_m_s"]), float(row["penetration_depth_m"])) == case:
            return row
    raise LookupError(f"{name} has no row for {case}")


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
