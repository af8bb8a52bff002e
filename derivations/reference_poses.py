"""One filament of a rotary tool of any kind and pose over a plane, with friction, by CVODES.

What enters: nothing; the cases are those of `cases()` below.
What leaves: a JSON file with what the filament of each case does, and with shapes of filaments that
turn and touch nothing.

Stated here, in the inertial frame, with the energies of `reference_space.py` for a clamp that moves
in any way:

1. The clamp: root at R_y(σ) R_x(τ) (r_g ρ̂ + s t), direction R_y(σ) R_x(τ) (sin γ ρ̂ + cos γ z), body
   rate ω along the tool's axis. Segments have polar angles from z and azimuths: filaments that touch
   a plane below point away from z.
2. The start: for γ ≠ π/2 the minimum of V = E_spring − ½ ω² Σ ∫ρ² dm, by Newton's method with
   CasADi's Hessian; radial filaments are straight.
3. The plane at y = −[R cos τ + (l_f cos γ + s sin γ) sin τ] + a_e. Where the tip is below it during
   the whole turn, it comes up within the turn before the first.

Each case is computed at two tolerances; the file gives the larger difference as its own error.

SI units, angles in radians: y normal to the plane of the workpiece.

Run from the repository root:

    python derivations/reference_poses.py
"""

import math
from dataclasses import dataclass

import casadi
import cvodes
import numpy as np
from cases import (
    CONTACT_STIFFNESS_N_M,
    DATA,
    DENSITY_KG_M3,
    DIAMETER_M,
    DAMPING_RATIO,
    FIRST_CANTILEVER_ROOT,
    LENGTH_M,
    REGULARISATION_M_S,
    WIDTH_M,
    YOUNGS_MODULUS_PA,
    entries_of,
    parser_of,
    rounded,
    write_cases,
)
from cvodes import RATE_UNIT_RAD_S, Window, velocity_of

INTEGRALS = (
    "contact_normal_impulse_n_s",
    "contact_impulse_x_n_s",
    "contact_impulse_y_n_s",
    "contact_impulse_z_n_s",
    "contact_angular_impulse_n_m_s",
    "friction_work_j",
)
TOLERANCE, LOOSER = 1e-11, 1e-10
LEAD_RAD, TAIL_RAD = 0.005, 0.15
FILAMENT_COUNT = 10_500
# Successive turns whose impulses differ by less are the same.
STEADY = 1e-3
MOST_TURNS = 50
TERMS = 20

AREA_M2 = math.pi * DIAMETER_M**2 / 4
MASS_PER_LENGTH = DENSITY_KG_M3 * AREA_M2
BENDING_STIFFNESS = YOUNGS_MODULUS_PA * math.pi * DIAMETER_M**4 / 64


def turned(skew: float, tilt: float) -> np.ndarray:
    """R_y(σ) R_x(τ)."""
    c, s = math.cos(tilt), math.sin(tilt)
    about_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    c, s = math.cos(skew), math.sin(skew)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ about_x


@dataclass(frozen=True)
class Case:
    """A pass; γ, τ and σ in rad, v_b in m/s, a_e in m."""

    name: str
    filament_angle_rad: float
    tilt_rad: float
    skew_rad: float
    brushing_velocity_m_s: float
    penetration_depth_m: float
    friction_coefficient: float
    body_radius_m: float = 0.140
    length_m: float = LENGTH_M
    segments: int = 5
    place_m: float = 0.0

    @property
    def pose(self) -> np.ndarray:
        """From the tool's frame to the inertial one."""
        return turned(self.skew_rad, self.tilt_rad)

    @property
    def rate_rad_s(self) -> float:
        """ω = v_b / R(0)."""
        middle = self.body_radius_m + self.length_m * math.sin(self.filament_angle_rad)
        return self.brushing_velocity_m_s / middle

    @property
    def turn_s(self) -> float:
        """Time of a turn."""
        return 2 * math.pi / self.rate_rad_s

    @property
    def tip(self) -> tuple[float, float]:
        """Distance from the axis and height of the tip of the undeformed filament."""
        sin, cos = math.sin(self.filament_angle_rad), math.cos(self.filament_angle_rad)
        radius = self.body_radius_m - self.place_m * cos + self.length_m * sin
        return radius, self.place_m * sin + self.length_m * cos

    @property
    def height_m(self) -> float:
        """Where the plane lies."""
        radius, along = self.tip
        lowest = -(radius * math.cos(self.tilt_rad) + along * math.sin(self.tilt_rad))
        return lowest + self.penetration_depth_m

    @property
    def half_angle_rad(self) -> float:
        """Half of the angle over which the undeformed tip is below the plane; π if always."""
        across = self.tip[0] * math.cos(self.tilt_rad)
        if self.penetration_depth_m >= 2 * across:
            return math.pi
        return math.acos(1 - self.penetration_depth_m / across)

    @property
    def is_all_round(self) -> bool:
        """Whether the filament touches during the whole turn."""
        return self.half_angle_rad == math.pi

    def inputs(self) -> dict[str, dict[str, object]]:
        """The case in the keys of the input file."""
        return {
            "tool": {
                "body_radius_m": self.body_radius_m,
                "width_m": WIDTH_M,
                "filament_count": FILAMENT_COUNT,
                "filament_angle_rad": self.filament_angle_rad,
                "tilt_rad": self.tilt_rad,
                "skew_rad": self.skew_rad,
                "positions": 1,
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


def direction_of(polar: casadi.SX, azimuth: casadi.SX) -> casadi.SX:
    """Of a segment with these angles."""
    sin = casadi.sin(polar)
    return casadi.vertcat(
        sin * casadi.cos(azimuth), sin * casadi.sin(azimuth), casadi.cos(polar)
    )


def angle_squared(chord: casadi.SX) -> casadi.SX:
    """α² = (2 asin(|chord|/2))² = Σ 2 (k−1)!²/(2k)! |chord|^(2k)."""
    square, total = casadi.sumsqr(chord), 0
    for k in range(TERMS, 0, -1):
        total = (total + 2 * math.factorial(k - 1) ** 2 / math.factorial(2 * k)) * square
    return total


class Equations(cvodes.Equations):
    """The equations of motion of one filament; coordinates (φ_1, θ_1, …, φ_n, θ_n)."""

    def __init__(self, case: Case, start_angle_rad: float) -> None:
        self.case, n = case, case.segments
        self._start_angle_rad = start_angle_rad
        self._angles = casadi.SX.sym("q", 2 * n)
        self._rates = casadi.SX.sym("v", 2 * n)
        self._instant = [casadi.SX.sym("t"), self._angles, self._rates]
        below = casadi.SX.sym("below", n)
        kinetic, springs, dissipation = self._chain()
        on_plane, integrands = self._workpiece(below)
        energies = kinetic, kinetic - springs, dissipation
        self.derive(self._instant, below, energies, [on_plane], integrands)

    def _rate_of(self, vector: casadi.SX) -> casadi.SX:
        return velocity_of(vector, self._instant)

    def _chain(self) -> tuple[casadi.SX, casadi.SX, casadi.SX]:
        case, h = self.case, self.case.length_m / self.case.segments
        axis = casadi.SX(case.pose[:, 2])
        body_rate = case.rate_rad_s * axis
        body = self._start_angle_rad + case.rate_rad_s * self._instant[0]
        radial = casadi.vertcat(casadi.cos(body), casadi.sin(body), 0.0)
        sin, cos = math.sin(case.filament_angle_rad), math.cos(case.filament_angle_rad)
        along = casadi.SX([0.0, 0.0, 1.0])
        across = -cos * radial + sin * along
        pose = casadi.SX(case.pose)
        before = pose @ (sin * radial + cos * along)
        nodes = [pose @ (case.body_radius_m * radial + case.place_m * across)]
        damping_s = 2 * DAMPING_RATIO / (
            (FIRST_CANTILEVER_ROOT / case.length_m) ** 2
            * math.sqrt(BENDING_STIFFNESS / MASS_PER_LENGTH)
        )
        mass = MASS_PER_LENGTH * h
        kinetic, springs, dissipation, centrifugal = 0, 0, 0, 0

        def turning(direction: casadi.SX) -> casadi.SX:
            seen = self._rate_of(direction) - casadi.cross(body_rate, direction)
            return casadi.cross(direction, seen)

        def from_axis(vector: casadi.SX) -> casadi.SX:
            return casadi.sumsqr(vector) - casadi.dot(vector, axis) ** 2

        turning_before = turning(before)
        for k in range(case.segments):
            direction = direction_of(self._angles[2 * k], self._angles[2 * k + 1])
            centre = nodes[k] + h / 2 * direction
            kinetic += mass / 2 * casadi.sumsqr(self._rate_of(centre))
            kinetic += mass * h**2 / 24 * casadi.sumsqr(self._rate_of(direction))
            centrifugal += mass / 2 * (from_axis(centre) + h**2 / 12 * from_axis(direction))
            stiffness = (2 if k == 0 else 1) * BENDING_STIFFNESS / h
            springs += stiffness / 2 * angle_squared(direction - before)
            turns = turning(direction)
            dissipation += damping_s * stiffness / 2 * casadi.sumsqr(turns - turning_before)
            nodes.append(nodes[k] + h * direction)
            before, turning_before = direction, turns
        self._nodes = nodes
        potential = springs - case.rate_rad_s**2 * centrifugal
        at = casadi.substitute(potential, self._instant[0], 0)
        hessian, gradient = casadi.hessian(at, self._angles)
        self._statics = casadi.Function("statics", [self._angles], [at, gradient, hessian])
        places = casadi.horzcat(*nodes)
        self.places = casadi.Function("places", [self._instant[0], self._angles], [places])
        clamp = casadi.substitute(pose @ (sin * radial + cos * along), self._instant[0], 0)
        self._clamp = np.array(casadi.Function("clamp", [], [clamp])()["o0"]).ravel()
        return kinetic, springs, dissipation

    def _workpiece(self, below: casadi.SX) -> tuple[casadi.SX, casadi.SX]:
        case, axis = self.case, casadi.SX(self.case.pose[:, 2])
        height = case.height_m
        if case.is_all_round:
            u = casadi.fmin(self._instant[0] / case.turn_s, 1)
            part = u**3 * (10 - 15 * u + 6 * u**2)
            height += case.penetration_depth_m * (part - 1)
        self.height = casadi.Function("height", [self._instant[0]], [casadi.SX(height)])
        places = casadi.horzcat(*self._nodes[1:])[1, :].T - height
        self._above = casadi.Function("above", [self._instant[0], self._angles], [places])
        torques, sums = casadi.SX.zeros(2 * case.segments), casadi.SX.zeros(len(INTEGRALS))
        for k in range(case.segments):
            node = self._nodes[k + 1]
            pressure = CONTACT_STIFFNESS_N_M * (height - node[1]) * below[k]
            velocity = self._rate_of(node)
            sliding = casadi.vertcat(velocity[0], 0.0, velocity[2])
            speed = casadi.sqrt(casadi.sumsqr(sliding) + REGULARISATION_M_S**2)
            rubbing = -case.friction_coefficient * pressure / speed * sliding
            force = rubbing + casadi.vertcat(0.0, pressure, 0.0)
            torques += casadi.jtimes(node, self._angles, force, True)
            moment = casadi.dot(axis, casadi.cross(node, force))
            sums += casadi.vertcat(pressure, force, moment, -casadi.dot(rubbing, sliding))
        return torques, sums

    def heights(self, times: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Heights of the nodes above the plane, as rows, for coordinates as columns."""
        above = self._above.map(len(times))
        return np.array(above(times.reshape(1, -1), angles)).T

    def straight(self) -> np.ndarray:
        """Coordinates along the clamp at t = 0."""
        x, y, z = self._clamp
        return np.tile([math.acos(min(max(z, -1), 1)), math.atan2(y, x)], self.case.segments)

    def equilibrium(self) -> np.ndarray:
        """Coordinates at which V is stationary, by Newton's method that goes down."""
        q = self.straight()
        for _ in range(200):
            value, gradient, hessian = (np.array(each) for each in self._statics(q))
            step = -np.linalg.solve(hessian, gradient).ravel()
            share = 1.0
            while share > 1e-6 and float(self._statics(q + share * step)[0]) > value.item():
                share /= 2
            q = q + share * step
            if np.max(np.abs(step)) < 1e-13:
                break
        return q

    def rigid_rates(self, q: np.ndarray) -> np.ndarray:
        """Rates of coordinates that turn with the body."""
        omega = self.case.rate_rad_s * self.case.pose[:, 2]
        rates = []
        for polar, azimuth in q.reshape(-1, 2):
            e = np.array(direction_of(casadi.DM(polar), casadi.DM(azimuth))).ravel()
            rate = np.cross(omega, e)
            along = [math.cos(polar) * math.cos(azimuth), math.cos(polar) * math.sin(azimuth)]
            rates.append(rate @ np.array([*along, -math.sin(polar)]))
            rates.append(rate @ np.array([-math.sin(azimuth), math.cos(azimuth), 0]) / math.sin(polar))
        return np.array(rates)


class Motion(cvodes.Motion):
    """A pass, or turns until they are steady."""

    def __init__(self, case: Case, relative_tolerance: float) -> None:
        self.start_angle_rad, self.q = self._free_start(case)
        equations = Equations(case, self.start_angle_rad)
        self.entry_s = (-math.pi / 2 - case.half_angle_rad - self.start_angle_rad) / case.rate_rad_s
        super().__init__(case, equations, relative_tolerance)
        if case.is_all_round:
            # It hardly changes.
            self.longest_window_s = 1e-3

    def _free_start(self, case: Case) -> tuple[float, np.ndarray]:
        """The angle at the start, with a filament that touches nothing, and its coordinates."""
        is_radial = case.filament_angle_rad == math.pi / 2
        lead = LEAD_RAD
        while True:
            angle = -math.pi / 2 - (0 if case.is_all_round else case.half_angle_rad + lead)
            equations = Equations(case, angle)
            q = equations.straight() if is_radial else equations.equilibrium()
            lowest = np.min(np.array(equations.places(0, q))[1, 1:])
            if lowest > float(equations.height(0)):
                return angle, q
            lead += 0.02

    @property
    def ends_of_turns_s(self) -> list[float]:
        """The first end of all."""
        case = self.case
        if case.is_all_round:
            return [case.turn_s * turn for turn in range(1, MOST_TURNS + 2)]
        lead = -math.pi / 2 - case.half_angle_rad - self.start_angle_rad
        return [(lead + 2 * case.half_angle_rad + TAIL_RAD + lead) / case.rate_rad_s]

    def start(self) -> np.ndarray:
        """Turning with the body."""
        rates = self.equations.rigid_rates(self.q) / RATE_UNIT_RAD_S
        return np.concatenate([self.q, rates, np.zeros(self.equations.integral_count)])

    def touches(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Which nodes are below the plane."""
        heights = np.array(self.equations.heights(times, states[: self.equations.count]))
        return (heights < 0).astype(int)

    def parameters(self, touch: np.ndarray) -> np.ndarray:
        """The touch as the equations take it."""
        return touch.astype(float)


def metrics(case: Case, tolerance: float) -> dict[str, object]:
    """What the file says about a case, from a run at one tolerance."""
    motion = Motion(case, tolerance)
    # The windows ask the case for the ends of its turns.
    object.__setattr__(case, "ends_of_turns_s", motion.ends_of_turns_s)
    turns, time, nominal, count = [np.zeros(len(INTEGRALS))], 0.0, 0.0, 0
    exit_s = motion.entry_s + 2 * case.half_angle_rad / case.rate_rad_s
    touched, impulses = False, []
    for window in motion.windows():
        begin, end = window.times[0], window.times[-1]
        touching = bool(np.any(window.touch))
        if touching:
            time += end - begin
            nominal += max(0.0, min(end, exit_s) - max(begin, motion.entry_s))
            count += not touched
        touched = touching
        if window.ends_turn:
            turns.append(motion.integrals(window, -1))
            if case.is_all_round:
                if len(turns) > 2:
                    impulses.append(turns[-1][0] - turns[-2][0])
                if len(impulses) > 1 and abs(impulses[-1] - impulses[-2]) < STEADY * impulses[-1]:
                    break
                if len(turns) > 1:
                    time, count, nominal = 0.0, 0, 0.0
    last = turns[-1] - turns[-2]
    entry = dict(zip(INTEGRALS, last, strict=True))
    entry["nominal_contact_time_s"] = 2 * case.half_angle_rad / case.rate_rad_s
    if not case.is_all_round:
        entry["contact_time_s"], entry["contact_count"] = time, count
    else:
        entry["turn_contact_normal_impulses_n_s"] = impulses
    return entry


def result(case: Case) -> dict[str, object]:
    """The entry of a case in the file."""
    values, others = metrics(case, TOLERANCE), metrics(case, LOOSER)
    scale = values["contact_normal_impulse_n_s"]
    error = max(abs(values[key] - others[key]) for key in INTEGRALS[:4]) / scale
    # Angles are inputs: a rounded one is another tool.
    entry = {"name": case.name, "input": case.inputs()}
    return entry | rounded(values) | {"own_error": float(f"{error:.1g}")}


def cases() -> list[Case]:
    """The cases of the file."""
    right = math.pi / 2
    poses = (
        ("radial, tilted by 0.1", right, 0.1, 0.3, 10.0, 1e-3),
        ("radial, tilted by 0.4", right, 0.4, 0.3, 8.0, 2e-3),
        ("cone of 0.9", 0.9, right - 0.9, 0.0, 10.0, 1e-3),
        ("cone of 1.2", 1.2, 0.2, -0.2, 8.0, 1.5e-3),
        ("cup, nearly flat", 0.0, right - 0.12, 0.0, 6.0, 1.5e-3),
        ("cup, flat", 0.0, right, 0.0, 5.0, 1e-3),
    )
    return [
        Case(f"{name}, friction {friction:g}", *pose, friction)
        for name, *pose in poses
        for friction in (0.0, 0.2)
    ]


def equilibria() -> list[dict[str, object]]:
    """Distance from the axis and height of the tips of cups that touch nothing."""
    entries = []
    for length in (0.020, 0.040, 0.080):
        for velocity in (5.0, 10.0, 30.0):
            for segments in (5, 25):
                case = Case("cup", 0.0, 0.0, 0.0, velocity, 1e-3, 0.0, length_m=length, segments=segments)
                x, y, z = _tip(case)
                inputs = {"length_m": length, "brushing_velocity_m_s": velocity, "segments": segments}
                entries.append({**inputs, "radius_m": math.hypot(x, y), "height_m": z})
    return rounded(entries)


def _tip(case: Case) -> np.ndarray:
    """Of a filament that turns and touches nothing; its axis is y, across which coordinates are regular."""
    flat = Case(**{**case.__dict__, "tilt_rad": -math.pi / 2})
    equations = Equations(flat, 0.0)
    tip = np.array(equations.places(0, equations.equilibrium()))[:, -1]
    return flat.pose.T @ tip


def main() -> None:
    """Command line."""
    parser = parser_of("Write passes of tools of any kind and pose.", DATA / "reference_poses.json")
    arguments = parser.parse_args()
    entries = entries_of(result, cases(), arguments)
    if arguments.only is None:
        import json

        shapes = "[\n" + ",\n".join(map(json.dumps, equilibria())) + "\n]"
        write_cases(
            arguments.output, cvodes.command("reference_poses.py", TOLERANCE), entries, equilibria=shapes
        )


if __name__ == "__main__":
    main()
