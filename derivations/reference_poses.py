"""Filaments of a rotary tool of any kind and pose over a plane, with friction, by CVODES and SciPy.

What enters: nothing; the cases are those of `cases()` below.
What leaves: a JSON file with what the filament of each case does, or the mean filament of a trim;
with shapes of filaments that turn and touch nothing; and with forces of cups that are pressed flat.

Chain and friction are those of `reference_space.py`, windows those of `cvodes.py`. Stated here, in the
frame of the workpiece:

1. The clamp: root at R_y(σ) R_x(τ) (r_g ρ̂ + s t), direction R_y(σ) R_x(τ) (sin γ ρ̂ + cos γ z), body
   rate ω along the tool's axis. Segments have polar angles from z and azimuths: filaments that touch
   a plane below point away from z.
2. The start: the minimum of V = E_spring − ½ ω² Σ ∫ρ² dm, by SciPy's trust-region method with CasADi's
   derivatives. For radial filaments it is straight.
3. The plane at y = −max_s [R(s) |cos τ| + (l_f cos γ + s sin γ) sin τ] + a_e. Where the tip is below it
   during the whole turn, it comes up within the turn before the first.
4. A trim: filaments at Gauss's points of s, weighted in proportion to their root radius.
5. A cup that is pressed flat without friction turns rigidly: V and ½ k_c δ² of its nodes are least.

Each case is computed at two tolerances; the file gives the larger difference as its own error.

SI units, angles in radians: y normal to the plane of the workpiece.

Run from the repository root:

    python derivations/reference_poses.py
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import casadi
import cvodes
import numpy as np
from cases import (
    BODY_RADIUS_M,
    CONTACT_STIFFNESS_N_M,
    DATA,
    DIAMETER_M,
    LEAD_ANGLE_RAD,
    LENGTH_M,
    TAIL_ANGLE_RAD,
    WIDTH_M,
    entries_of,
    parser_of,
    rounded,
    write_cases,
)
from cvodes import RATE_UNIT_RAD_S, velocity_of
from reference_row import MASS_PER_LENGTH
from reference_space import chain, friction
from scipy.optimize import minimize

INTEGRALS = (
    "contact_normal_impulse_n_s",
    "contact_impulse_x_n_s",
    "contact_impulse_y_n_s",
    "contact_impulse_z_n_s",
    "contact_angular_impulse_n_m_s",
    "friction_work_j",
)
TOLERANCE, LOOSER = 1e-11, 1e-10
FILAMENT_COUNT = 10_500
# Successive turns whose impulses differ by less, relatively, are the same.
STEADY = 1e-3
MOST_TURNS = 50
# A plane that is out of reach.
FAR_M = -1.0
RIGHT = math.pi / 2


@dataclass(frozen=True)
class Case:
    """A pass, or turns in which the filament touches all the time."""

    name: str
    filament_angle_rad: float
    tilt_rad: float
    skew_rad: float
    brushing_velocity_m_s: float
    penetration_depth_m: float
    friction_coefficient: float
    # Number of filaments along the trim, or the one in its middle.
    positions: int = 1
    length_m: float = LENGTH_M
    segments: int = 5
    place_m: float = 0.0

    @property
    def pose(self) -> np.ndarray:
        """From the tool's frame to that of the workpiece: R_y(σ) R_x(τ)."""
        c, s = math.cos(self.tilt_rad), math.sin(self.tilt_rad)
        about_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
        c, s = math.cos(self.skew_rad), math.sin(self.skew_rad)
        return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ about_x

    @property
    def rate_rad_s(self) -> float:
        """ω = v_b / R(0)."""
        middle = BODY_RADIUS_M + self.length_m * math.sin(self.filament_angle_rad)
        return self.brushing_velocity_m_s / middle

    @property
    def turn_s(self) -> float:
        """Time of a turn."""
        return 2 * math.pi / self.rate_rad_s

    def root(self, place_m: float) -> tuple[float, float]:
        """Distance from the axis, and the coordinate along it, of the root at a place."""
        sin, cos = math.sin(self.filament_angle_rad), math.cos(self.filament_angle_rad)
        return BODY_RADIUS_M - place_m * cos, place_m * sin

    def across_and_along(self, place_m: float) -> tuple[float, float]:
        """How deep the undeformed tip at a place turns about, and lies along, the tilted axis."""
        radius, along = self.root(place_m)
        radius += self.length_m * math.sin(self.filament_angle_rad)
        along += self.length_m * math.cos(self.filament_angle_rad)
        return radius * abs(math.cos(self.tilt_rad)), along * math.sin(self.tilt_rad)

    @property
    def height_m(self) -> float:
        """Where the plane lies."""
        ends = [0.0] if self.positions == 1 else [-WIDTH_M / 2, WIDTH_M / 2]
        return self.penetration_depth_m - max(sum(self.across_and_along(s)) for s in ends)

    @property
    def half_angle_rad(self) -> float:
        """Half of the angle over which the undeformed tip is below the plane; π if always."""
        across, along = self.across_and_along(self.place_m)
        depth = self.height_m + across + along
        return math.pi if depth >= 2 * across else math.acos(1 - depth / across)

    @property
    def is_all_round(self) -> bool:
        """Whether the undeformed tip is below the plane during the whole turn."""
        return self.half_angle_rad == math.pi

    @property
    def lowest_rad(self) -> float:
        """The angle of the body at which the tip is lowest."""
        return -math.copysign(RIGHT, math.cos(self.tilt_rad))

    @property
    def of_trim(self) -> list[tuple[float, "Case"]]:
        """The filaments of the trim, and which part of all they stand for."""
        points, weights = np.polynomial.legendre.leggauss(self.positions)
        filaments = [replace(self, place_m=float(s) * WIDTH_M / 2) for s in points]
        weights = weights * [each.root(each.place_m)[0] for each in filaments]
        return list(zip(weights / np.sum(weights), filaments, strict=True))

    def inputs(self) -> dict[str, dict[str, object]]:
        """The case in the keys of the input file."""
        kinds = {0.0: "cup", RIGHT: "round"}
        return {
            "tool": {
                "kind": kinds.get(self.filament_angle_rad, "cone"),
                "body_radius_m": BODY_RADIUS_M,
                "width_m": WIDTH_M,
                "filament_count": FILAMENT_COUNT,
                "filament_angle_rad": self.filament_angle_rad,
                "tilt_rad": self.tilt_rad,
                "skew_rad": self.skew_rad,
                "positions": self.positions,
            },
            "filament": {
                "segments": self.segments,
                "length_m": self.length_m,
                "diameter_m": DIAMETER_M,
            },
            "contact": {"friction_coefficient": self.friction_coefficient},
            "process": {
                "brushing_velocity_m_s": self.brushing_velocity_m_s,
                "penetration_depth_m": self.penetration_depth_m,
            },
        }


class Equations(cvodes.Equations):
    """The equations of motion of one filament; coordinates (φ_1, θ_1, …, φ_n, θ_n)."""

    def __init__(self, case: Case, start_angle_rad: float) -> None:
        self.case, count = case, 2 * case.segments
        self._angles = casadi.SX.sym("q", count)
        self._instant = [casadi.SX.sym("t"), self._angles, casadi.SX.sym("v", count)]
        self._axis = casadi.SX(case.pose[:, 2])
        body = start_angle_rad + case.rate_rad_s * self._instant[0]
        radial = casadi.vertcat(casadi.cos(body), casadi.sin(body), 0.0)
        (radius, along), gamma = case.root(case.place_m), case.filament_angle_rad
        toward = casadi.SX([0.0, 0.0, 1.0])
        root = case.pose @ (radius * radial + along * toward)
        clamp = case.pose @ (math.sin(gamma) * radial + math.cos(gamma) * toward)
        self.clamp = np.array(casadi.evalf(casadi.substitute(clamp, self._instant[0], 0))).ravel()
        *energies, self._nodes, self._directions = chain(
            self._instant, self._angles, (root, clamp), case.rate_rad_s * self._axis, case.length_m
        )
        self._energies, places = energies, casadi.horzcat(*self._nodes)
        self.places = casadi.Function("places", self._instant[:2], [places])
        self._set_statics(energies[1])
        height = case.height_m
        if case.is_all_round:
            u = casadi.fmin(self._instant[0] / case.turn_s, 1)
            height += case.penetration_depth_m * (u**3 * (10 - 15 * u + 6 * u**2) - 1)
        self._gaps = casadi.Function("gaps", self._instant[:2], [places[1, 1:].T - height])

    def set_motion(self) -> None:
        """Lagrange's equations."""
        kinetic, springs, dissipation = self._energies
        below = casadi.SX.sym("below", self.case.segments)
        on_plane, integrands = self._workpiece(below)
        energies = kinetic, kinetic - springs, dissipation
        self.derive(self._instant, below, energies, [on_plane], integrands)

    def _set_statics(self, springs: casadi.SX) -> None:
        """V in J at t = 0, with what is stored in the contact with a plane, and its derivatives."""
        case, h = self.case, self.case.length_m / self.case.segments

        def from_axis(vector: casadi.SX) -> casadi.SX:
            return casadi.sumsqr(vector) - casadi.dot(vector, self._axis) ** 2

        centrifugal, stored, height = 0, 0, casadi.SX.sym("height")
        for inner, direction in zip(self._nodes, self._directions, strict=False):
            spread = from_axis(inner + h / 2 * direction) + h**2 / 12 * from_axis(direction)
            centrifugal += MASS_PER_LENGTH * h / 2 * case.rate_rad_s**2 * spread
            depth = casadi.fmax(0, height - (inner + h * direction)[1])
            stored += CONTACT_STIFFNESS_N_M / 2 * depth**2
        total = casadi.substitute(springs - centrifugal + stored, self._instant[0], 0)
        hessian, gradient = casadi.hessian(total, self._angles)
        self._statics = casadi.Function(
            "statics", [self._angles, height], [total, gradient, hessian]
        )

    def _workpiece(self, below: casadi.SX) -> tuple[casadi.SX, casadi.SX]:
        """Generalised forces of the plane, and the rates of the integrals."""
        case, gaps = self.case, self._gaps(*self._instant[:2])
        torques, sums = casadi.SX.zeros(2 * case.segments), casadi.SX.zeros(len(INTEGRALS))
        for k, node in enumerate(self._nodes[1:]):
            pressure = -CONTACT_STIFFNESS_N_M * gaps[k] * below[k]
            velocity = velocity_of(node, self._instant)
            sliding = casadi.vertcat(velocity[0], 0.0, velocity[2])
            rubbing = friction(case.friction_coefficient, pressure, sliding)
            force = rubbing + casadi.vertcat(0.0, pressure, 0.0)
            torques += casadi.jtimes(node, self._angles, force, True)
            moment = casadi.dot(self._axis, casadi.cross(node, force))
            sums += casadi.vertcat(pressure, force, moment, -casadi.dot(rubbing, sliding))
        return torques, sums

    def gaps(self, times: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Heights of the nodes above the plane, as rows, for coordinates as columns."""
        return np.array(self._gaps.map(len(times))(times.reshape(1, -1), angles)).T

    def at_rest(self, height_m: float = FAR_M) -> np.ndarray:
        """Coordinates of a filament that turns rigidly over a plane at a height."""
        x, y, z = self.clamp
        straight = np.tile([math.acos(z), math.atan2(y, x)], self.case.segments)
        # Energies are some 1e-4 J, angles 1 rad.
        scale = 1e4
        found = minimize(
            lambda q: scale * float(self._statics(q, height_m)[0]),
            straight,
            method="trust-exact",
            jac=lambda q: scale * np.array(self._statics(q, height_m)[1]).ravel(),
            hess=lambda q: scale * np.array(self._statics(q, height_m)[2]),
            options={"gtol": 1e-9, "maxiter": 10_000},
        )
        q = found.x
        # What is left is less than energies resolve.
        for _ in range(3):
            _, gradient, hessian = (np.array(each) for each in self._statics(q, height_m))
            q = q - np.linalg.solve(hessian, gradient.ravel())
        if np.min(np.linalg.eigvalsh(hessian)) <= 0.0:
            raise RuntimeError(f"{self.case.name}: no minimum")
        return q

    def rigid_rates(self, q: np.ndarray) -> np.ndarray:
        """Rates of coordinates that turn with the body."""
        omega, rates = self.case.rate_rad_s * self.case.pose[:, 2], []
        for polar, azimuth in q.reshape(-1, 2):
            # Of e = (sin φ cos θ, sin φ sin θ, cos φ), along the directions of growing φ and θ.
            (sin, cos), (s, c) = (np.sin(polar), np.cos(polar)), (np.sin(azimuth), np.cos(azimuth))
            rate = np.cross(omega, [sin * c, sin * s, cos])
            rates += [rate @ np.array([cos * c, cos * s, -sin]), rate @ np.array([-s, c, 0]) / sin]
        return np.array(rates)


class Motion(cvodes.Motion):
    """A pass, or turns until they are steady."""

    def __init__(self, case: Case, relative_tolerance: float) -> None:
        self._ahead_rad, equations, self._q = self._free_start(case)
        equations.set_motion()
        super().__init__(case, equations, relative_tolerance)
        if case.is_all_round:
            # It hardly changes.
            self.longest_window_s = 1e-3

    @staticmethod
    def _free_start(case: Case) -> tuple[float, Equations, np.ndarray]:
        """How far before the lowest place the filament starts, and its coordinates there."""
        for i in range(100):
            # A bent filament may touch before an undeformed one.
            ahead = 0.0 if case.is_all_round else case.half_angle_rad + LEAD_ANGLE_RAD + 0.02 * i
            equations = Equations(case, case.lowest_rad - ahead)
            q = equations.at_rest()
            if np.all(equations.gaps(np.zeros(1), q) > 0.0):
                return ahead, equations, q
        raise RuntimeError(f"{case.name}: touches everywhere")

    @property
    def ends_of_turns_s(self) -> list[float]:
        """Of all turns, the first of which is that in which the plane comes up."""
        if self.case.is_all_round:
            return [self.case.turn_s * turn for turn in range(1, MOST_TURNS + 2)]
        return [(2 * self._ahead_rad + TAIL_ANGLE_RAD) / self.case.rate_rad_s]

    def start(self) -> np.ndarray:
        """Turning with the body."""
        rates = self.equations.rigid_rates(self._q) / RATE_UNIT_RAD_S
        return np.concatenate([self._q, rates, np.zeros(self.equations.integral_count)])

    def touches(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Which nodes are below the plane."""
        return (self.equations.gaps(times, states[: self.equations.count]) < 0).astype(int)

    def parameters(self, touch: np.ndarray) -> np.ndarray:
        """The touch as the equations take it."""
        return touch.astype(float)


def turns(case: Case, tolerance: float) -> tuple[list[np.ndarray], float]:
    """Integrals of each turn until they are steady, and the time in contact of all."""
    motion, of_turns, before, time = Motion(case, tolerance), [], 0.0, 0.0
    for window in motion.windows():
        if np.any(window.touch):
            time += window.times[-1] - window.times[0]
        if not window.ends_turn:
            continue
        integrals = motion.integrals(window, -1)
        of_turns.append(integrals - before)
        before = integrals
        # In the first one the plane comes up.
        if len(of_turns) > 2 and abs(of_turns[-1][0] / of_turns[-2][0] - 1) < STEADY:
            break
    return of_turns, time


def metrics(case: Case, tolerance: float) -> dict[str, float]:
    """Of the mean filament of the trim, from a run at one tolerance."""
    sums = dict.fromkeys((*INTEGRALS, "nominal_contact_time_s", "contact_time_s"), 0.0)
    for weight, filament in case.of_trim:
        of_turns, time = turns(filament, tolerance)
        if filament.is_all_round:
            time = filament.turn_s
        nominal = 2 * filament.half_angle_rad / filament.rate_rad_s
        for name, value in zip(sums, (*of_turns[-1], nominal, time), strict=True):
            sums[name] += float(weight * value)
    return sums


def result(case: Case) -> dict[str, object]:
    """The entry of a case in the file."""
    values, others = metrics(case, TOLERANCE), metrics(case, LOOSER)
    scale = values[INTEGRALS[0]]
    error = max(abs(values[key] - others[key]) for key in INTEGRALS[:4]) / scale
    # Angles are inputs: a rounded one is another tool.
    entry = {"name": case.name, "input": case.inputs()}
    return entry | rounded(values) | {"own_error": float(f"{error:.1g}")}


def cases() -> list[Case]:
    """The cases of the file."""
    poses = (
        ("radial, tilted by 0.1", RIGHT, 0.1, 0.3, 10.0, 1e-3),
        ("radial, tilted by 0.4", RIGHT, 0.4, 0.3, 8.0, 2e-3),
        ("cone of 0.9", 0.9, RIGHT - 0.9, 0.0, 10.0, 1e-3),
        ("cone of 1.2", 1.2, 0.2, -0.2, 8.0, 1.5e-3),
        ("cup, nearly flat", 0.0, RIGHT - 0.12, 0.0, 6.0, 1.5e-3),
        ("cup, flat", 0.0, RIGHT, 0.0, 5.0, 1e-3),
    )
    rough = (
        # Bent outwards by 4 mm.
        ("cup, fast and leaning over", 0.0, RIGHT + 0.15, 0.5, 20.0, 3e-3, 0.3),
        # Deeper on one side, but in contact on both.
        ("cup, tilted in contact", 0.0, RIGHT - 3e-3, 0.0, 5.0, 2e-3, 0.2),
        ("cone, with a trim", 0.9, RIGHT - 0.95, 0.2, 10.0, 2e-3, 0.2, 3),
        ("radial, with a trim", RIGHT, 0.05, 0.0, 10.0, 1.5e-3, 0.2, 3),
    )
    smooth_and_rough = [
        Case(f"{name}, friction {coefficient:g}", *pose, coefficient)
        for (name, *pose), coefficient in product(poses, (0.0, 0.2))
    ]
    return smooth_and_rough + [Case(*each) for each in rough]


def cup(velocity_m_s: float, depth_m: float, segments: int, length_m: float = LENGTH_M) -> Case:
    """A cup whose axis points into the plane."""
    process = velocity_m_s, depth_m, 0.0
    return Case("cup", 0.0, RIGHT, 0.0, *process, segments=segments, length_m=length_m)


def free_cups() -> list[dict[str, float]]:
    """Distance from the axis and height over the roots of tips that touch nothing."""
    entries, keys = [], ("length_m", "brushing_velocity_m_s", "segments")
    for length, velocity, n in product((0.020, 0.040, 0.080), (5.0, 10.0, 30.0), (5, 25)):
        case = cup(velocity, 0.0, n, length)
        equations = Equations(case, 0.0)
        x, y, z = case.pose.T @ np.array(equations.places(0, equations.at_rest()))[:, -1]
        inputs = dict(zip(keys, (length, velocity, n), strict=True))
        entries.append({**inputs, "radius_m": math.hypot(x, y), "height_m": float(z)})
    return entries


def flat_cups() -> list[dict[str, float]]:
    """Forces on the filaments of cups that are pressed flat, without friction."""
    entries, keys = [], ("brushing_velocity_m_s", "penetration_depth_m", "segments")
    for inputs in product((2.0, 5.0, 10.0), (0.5e-3, 1e-3, 3e-3), (5, 25)):
        case = cup(*inputs)
        equations = Equations(case, 0.0)
        q = equations.at_rest(case.height_m)
        gaps = np.array(equations.places(0, q))[1, 1:] - case.height_m
        force = CONTACT_STIFFNESS_N_M * float(np.sum(np.maximum(0.0, -gaps)))
        entries.append({**dict(zip(keys, inputs, strict=True)), "force_n": force})
    return entries


def listed(entries: Sequence[dict[str, float]]) -> str:
    """A list of JSON with a line per entry."""
    return "[\n" + ",\n".join(json.dumps(rounded(each)) for each in entries) + "\n]"


def main() -> None:
    """Command line."""
    parser = parser_of("Write passes of tools of any kind and pose.", DATA / "reference_poses.json")
    arguments = parser.parse_args()
    entries = entries_of(result, cases(), arguments)
    if arguments.only is None:
        command = cvodes.command("reference_poses.py", TOLERANCE)
        sections = {"free_cups": listed(free_cups()), "flat_cups": listed(flat_cups())}
        write_cases(arguments.output, command, entries, **sections)


if __name__ == "__main__":
    main()
