"""Sliding work of passes over planes, edges, curves and splines, and where edges take it, by CVODES.

What enters: nothing; the cases are those of `cases()` below.
What leaves: a JSON file with the metrics of all cases.

The passes are those of `reference_edges.py` and `reference_profiles.py`. Stated here:

1. The sliding work ∫ F_n |v_t| dt of all contacts and of those on edges, with the tangential velocity of
   the material of the filament at the point of contact.
2. On an edge between two faces, the angle of the normal at the point of contact from the bisector of
   the faces, positive towards the face that filaments meet last: clockwise, as the body turns
   counter-clockwise above the workpiece. Its mean and standard deviation are those by the sliding work.

Each case is computed at two tolerances; the file gives the larger difference as its own error.

Run from the repository root:

    python derivations/reference_sliding.py
"""

import math
from dataclasses import replace
from functools import cache

import casadi
import cvodes
import numpy as np
import reference_edges as edges
import reference_profiles as profiles
from cases import DATA, entries_of, parser_of, rounded, write_cases
from cvodes import velocity_of
from reference_edges import Case, Contact, Filament, Profile, Workpiece
from reference_profiles import SplineEquations, SplineMotion

WORKS = ("sliding_work_j", "edge_sliding_work_j")
ANGLES = ("edge_work_angle_rad", "edge_work_angle_std_rad")
# With the first and the second moment of the angle.
INTEGRALS = (*edges.INTEGRALS, *WORKS, *ANGLES)
# Where nothing touches, a speed of zero has a derivative.
LEAST_SPEED_M_S = 1e-9


class SlidingContact(Contact):
    """The sums over all contacts, with the sliding work and its moments."""

    def __init__(
        self, instant: list[casadi.SX], friction: casadi.SX, bisectors: list[np.ndarray]
    ) -> None:
        super().__init__(instant, friction)
        self._works, self._moments = casadi.SX.zeros(2), casadi.SX.zeros(2)
        # Of the edges that have one, in the order in which they are added.
        self._bisectors = list(bisectors)

    def _pressed(
        self, point: casadi.SX, gap: casadi.SX, normal: casadi.SX, touches: casadi.SX
    ) -> list[casadi.SX]:
        """Also F_n |v_t|, the normal, and whether it touches."""
        pressed = super()._pressed(point, gap, normal, touches)
        velocity = velocity_of(point, self._instant)
        sliding = velocity - casadi.dot(velocity, normal) * normal
        power = pressed[0] * casadi.sqrt(casadi.sumsqr(sliding) + LEAST_SPEED_M_S**2)
        return [*pressed, power, normal, touches]

    def _sum(self, pressed: list[casadi.SX], is_edge: bool) -> None:
        *pressed, power, normal, touches = pressed
        super()._sum(pressed, is_edge)
        self._works += casadi.vertcat(power, power if is_edge else 0)
        if is_edge and self._bisectors:
            x, y = self._bisectors.pop(0)
            # The normal of what does not touch has no direction.
            normal = casadi.if_else(touches > 0, normal, casadi.SX([x, y]))
            angle = casadi.atan2(y * normal[0] - x * normal[1], x * normal[0] + y * normal[1])
            self._moments += power * casadi.vertcat(angle, angle**2)

    @property
    def integrands(self) -> casadi.SX:
        """Rates of INTEGRALS."""
        return casadi.vertcat(super().integrands, self._works, self._moments)


class Equations(edges.Equations):
    """Those of `reference_edges.py` with these integrals."""

    def __init__(self, filament: Filament, profile: Profile) -> None:
        # Each face goes away from the edge; the outward bisector is opposite to both.
        sums = [-np.sum(tangents, axis=0) for tangents in profile.tangents]
        self._bisectors = [each / np.linalg.norm(each) for each in sums]
        super().__init__(filament, profile.circle, profile.arc_count)

    def _contact(self, instant: list[casadi.SX], friction: casadi.SX) -> SlidingContact:
        return SlidingContact(instant, friction, self._bisectors)


class OfSpline(SplineEquations):
    """Those of `reference_profiles.py` with these integrals."""

    def _contact(self, instant: list[casadi.SX], friction: casadi.SX) -> SlidingContact:
        return SlidingContact(instant, friction, [])


class Motion(edges.Motion):
    """A pass over anything but a spline."""

    integral_names = INTEGRALS

    @staticmethod
    def _profile_and_equations(case: Case) -> tuple[Profile, Equations]:
        profile = Profile(case)
        return profile, Equations(case.filament, profile)


class OverSpline(SplineMotion):
    """A pass over a spline."""

    integral_names = INTEGRALS
    equations_of = staticmethod(cache(OfSpline))


def metrics(case: Case, tolerance: float) -> dict[str, object]:
    """What the file says about a case, from a run at one tolerance."""
    kind = OverSpline if case.workpiece.kind == "profile" else Motion
    values = edges.metrics(kind(case, tolerance))
    moments, work = [values[name] for name in ANGLES], values["edge_sliding_work_j"]
    mean, square = (moment / work if work > 0 else 0.0 for moment in moments)
    deviation = math.sqrt(max(0.0, square - mean**2))
    return values | dict(zip(ANGLES, (mean, deviation), strict=True))


def result(case: Case) -> dict[str, object]:
    """The entry of a case in the file."""
    values, others = metrics(case, edges.TOLERANCE), metrics(case, edges.LOOSER)
    entry = edges.entry_of(case, values, others)
    # Angles are those of edges between faces.
    if case.workpiece.kind not in ("edge", "chamfer"):
        for name in ANGLES:
            del entry[name], values[name]
    changes = [abs(values[name] - others[name]) / values[WORKS[0]] for name in WORKS]
    changes += [abs(values[name] - others[name]) for name in ANGLES if name in values]
    return entry | rounded({"own_error_of_sliding": float(f"{max(changes):.1g}")})


def cases() -> list[Case]:
    """The cases of the file."""
    entering = Workpiece("edge", offset_m=-5e-3, side="entering")
    obtuse = Workpiece("edge", -4e-3, math.radians(120), 0.5e-3, "entering")
    of_edges = (
        ("plane", Workpiece("plane"), 0.3),
        ("plane, no friction", Workpiece("plane"), 0.0),
        ("leaving", Workpiece("edge", offset_m=3e-3), 0.3),
        ("entering", entering, 0.3),
        ("entering, no friction", entering, 0.0),
        ("leaving, 60 degrees", Workpiece("edge", 2e-3, math.radians(60), 0.5e-3), 0.3),
        ("entering, 120 degrees", obtuse, 0.3),
    )
    of_profiles = {case.name: case for case in profiles.cases()}
    found = [Case(name, Filament(6), piece, 10.0, 1.5e-3, mu) for name, piece, mu in of_edges]
    for name in (
        "chamfer, entering",
        "chamfer, leaving",
        "cylinder",
        "cylinder, an edge",
        "bore",
        "spline, a bump",
        "spline, entering",
    ):
        case = replace(of_profiles[name], filament=Filament(6))
        found.append(replace(case, brushing_velocity_m_s=10.0, penetration_depth_m=1.5e-3))
    return found


def main() -> None:
    """Command line."""
    parser = parser_of("Write the sliding work of passes.", DATA / "reference_sliding.json")
    arguments = parser.parse_args()
    entries = entries_of(result, cases(), arguments)
    if arguments.only is None:
        command = cvodes.command("reference_sliding.py", edges.TOLERANCE)
        write_cases(arguments.output, command, entries)


if __name__ == "__main__":
    main()
