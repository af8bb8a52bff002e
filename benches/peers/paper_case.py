"""The paper's filament and pass as plain numbers, for the peers that are no symbolic engines.

The constants are those of derivations/cases.py. SI units, angles in radians.
"""

import math
from dataclasses import dataclass

SEGMENTS = 25
BODY_RADIUS_M = 0.140
LENGTH_M = 0.040
TOOL_RADIUS_M = BODY_RADIUS_M + LENGTH_M
DIAMETER_M = 1.18e-3
DENSITY_KG_M3 = 1110.0
YOUNGS_MODULUS_PA = 3.0e9
DAMPING_RATIO = 0.05
FIRST_CANTILEVER_ROOT = 1.8751040687
CONTACT_STIFFNESS_N_M = 1e5
LEAD_ANGLE_RAD = 0.005
TAIL_ANGLE_RAD = 0.15

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


@dataclass(frozen=True)
class Pass:
    """One pass of a filament over the workpiece, and what follows from v_b and a_e."""

    case: Case

    @property
    def rate_rad_s(self) -> float:
        """ω = v_b / R."""
        return self.case[0] / TOOL_RADIUS_M

    @property
    def plane_m(self) -> float:
        """y of the workpiece."""
        return -(TOOL_RADIUS_M - self.case[1])

    @property
    def _contact_angle_rad(self) -> float:
        return 2 * math.acos(-self.plane_m / TOOL_RADIUS_M)

    @property
    def start_angle_rad(self) -> float:
        """Body angle at t = 0: the lead angle before nominal entry."""
        return -math.pi / 2 - self._contact_angle_rad / 2 - LEAD_ANGLE_RAD

    @property
    def end_s(self) -> float:
        """End of the simulation: the tail angle past nominal exit."""
        return (LEAD_ANGLE_RAD + self._contact_angle_rad + TAIL_ANGLE_RAD) / self.rate_rad_s


@dataclass(frozen=True)
class State:
    """One instant of a chain, with the names of derivations/reference_aba.py."""

    base_angle: float
    base_rate: float
    q: list[float]
    v: list[float]
    base_acceleration: float = 0.0
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    youngs_modulus_pa: float = YOUNGS_MODULUS_PA


def bent_state(segments: int, bend: float = 0.6) -> State:
    """The bent, turning filament of `cargo bench --bench speed -- accelerations`."""
    rate, angle = 10.0 / TOOL_RADIUS_M, -1.55
    q, v = [], []
    for k in range(segments):
        along = (k + 0.5) / segments
        shape = along**1.5
        q += [math.pi / 2 + 0.02 * shape, angle - bend * shape]
        v += [2.0 * along, rate * (1.0 - 2.0 * along)]
    return State(angle, rate, q, v)
