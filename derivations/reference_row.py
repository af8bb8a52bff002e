"""Rows of filaments that touch each other, by a planar code that shares nothing with the Rust code.

What enters: nothing; the cases are those of `cases()` below.
What leaves: a JSON file with what each filament of each case does, and statics of two filaments;
two trajectories.

How it is done:

1. The filaments of a row stay in the plane of rotation: one azimuth θ_k for each segment. E_kin,
   E_spring, D and the energy E_ab of filaments that touch are written down in these, and CasADi
   differentiates them into M(q) q̈ = f(q, q̇, t) and into the Jacobian of f.
2. The plane of the workpiece presses on nodes. Each of the N_q points of a segment is pressed off
   the nearest point of the neighbour's polyline, which lies inside a segment or at a node. Which
   nodes are below the plane and which part of the neighbour a point touches, if any, is the *touch*
   of a state. The equations take it as parameters and are smooth while it does not change.
3. CVODES of SUNDIALS (BDF of orders 1 to 5, Newton's method), as CasADi ships it, integrates
   windows with a constant touch. Each change of the touch is located and ends a window: no step
   crosses a kink. Nothing is smoothed but friction, as MODEL.md says.
4. Impulses and works are states of the solver; contact times are sums of windows.

Friction and damping of filaments act along and across the normal of E_ab. Friction acts half-way
between the two points, where the surfaces meet, on what slides there: a row that turns rigidly has
no friction, and action and reaction have no moment. `friction_at = "centrelines"` is the other
reading, of forces and velocities at the two points on the centrelines; it has neither property.

Each case is computed at two tolerances; the file gives the larger difference as its own error.

SI units, angles in radians: z along the tool axis, y normal to the plane of the workpiece, which
lies at −(R − a_e). The body turns about +z; column 0 is ahead and meets the workpiece first.

Run from the repository root:

    python derivations/reference_row.py
"""

import argparse
import json
import math
import multiprocessing
import platform
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import casadi
import numpy as np
import scipy
from scipy.interpolate import BPoly
from scipy.optimize import brentq, minimize_scalar

ROOT = Path(__file__).parent.parent
DEFAULT_OUTPUT = ROOT / "tests" / "data" / "reference_row.json"
TRAJECTORIES = Path(__file__).parent / "trajectories"

# The paper's tool and filament, and the defaults for what the paper leaves open.
BODY_RADIUS_M = 0.140
WIDTH_M = 0.020
LENGTH_M = 0.040
TOOL_RADIUS_M = BODY_RADIUS_M + LENGTH_M
DIAMETER_M = 1.18e-3
DENSITY_KG_M3 = 1110.0
YOUNGS_MODULUS_PA = 3.0e9
BENDING_STIFFNESS = YOUNGS_MODULUS_PA * math.pi * DIAMETER_M**4 / 64
MASS_PER_LENGTH = DENSITY_KG_M3 * math.pi * DIAMETER_M**2 / 4
DAMPING_RATIO = 0.05
FIRST_ROOT = 1.8751040687
FIRST_FREQUENCY = FIRST_ROOT**2 * math.sqrt(BENDING_STIFFNESS / (MASS_PER_LENGTH * LENGTH_M**4))
CONTACT_STIFFNESS_N_M = 1e5
REGULARISATION_M_S = 1e-3
LEAD_ANGLE_RAD = 0.005
TAIL_ANGLE_RAD = 0.15
# Of filaments on each other: the default, and Hertz's value E/(4 (1 − ν²)) with ν = 0.4.
LINE_STIFFNESS_N_M2, HERTZ_STIFFNESS_N_M2 = 6e7, 9e8

# Units of the solver's states, so that one absolute tolerance fits all: angles of 1 rad, rates of
# 1000 rad/s, integrals of 1 mN s and 1 mJ.
RATE_UNIT_RAD_S = 1e3
INTEGRAL_UNIT = 1e-3
# The integrals: those of every filament, then those of every pair of neighbours. The force between
# neighbours is that on the column ahead.
OF_FILAMENT = ("contact_normal_impulse_n_s", "contact_impulse_x_n_s", "friction_work_j")
OF_PAIR = (
    "normal_impulse_n_s",
    "impulse_x_n_s",
    "impulse_y_n_s",
    "friction_work_j",
    "damping_work_j",
)
TOLERANCE, LOOSER = 1e-10, 1e-9
# Absolute over relative tolerance, in these units.
ABSOLUTE_TOLERANCE = 0.1
# CVODES is asked for the motion one window after the other, and gives it at so many points in each.
# A window is so many times longer than the touch has lasted, within these limits.
LONGEST_WINDOW_S, SHORTEST_WINDOW_S, WINDOW_GROWTH = 4e-4, 4e-6, 2.0
POINTS = 401
# Below this a number is zero but for rounding, in any of the units.
LEAST_VALUE = 1e-18
# More changes of the touch than this mean that a pass chatters, which this code does not solve.
MOST_CHANGES = 50_000

ROWS = 1001


@dataclass(frozen=True)
class Brush:
    """A row as the input file's [brush] describes it, and the filaments on the tool."""

    columns: int
    filament_count: float = 682.0
    stiffness_n_m2: float = LINE_STIFFNESS_N_M2
    contact_points: int = 3
    damping_s_m: float = 0.0
    friction_coefficient: float = 0.0
    friction_at: str = "surfaces"

    @property
    def pitch_rad(self) -> float:
        """Angle from a column to the next."""
        return 2 * math.pi / self.filament_count


@dataclass(frozen=True)
class Case:
    """A pass of a row over the plane; v_b in m/s, a_e in m."""

    name: str
    brush: Brush
    brushing_velocity_m_s: float
    penetration_depth_m: float
    friction_coefficient: float = 0.0
    segments: int = 5

    @property
    def rate_rad_s(self) -> float:
        """ω = v_b / R."""
        return self.brushing_velocity_m_s / TOOL_RADIUS_M

    @property
    def height_m(self) -> float:
        """Where the plane lies."""
        return self.penetration_depth_m - TOOL_RADIUS_M

    @property
    def contact_angle_rad(self) -> float:
        """Ω_c."""
        return 2 * math.acos(-self.height_m / TOOL_RADIUS_M)

    @property
    def start_angle_rad(self) -> float:
        """Column 0 starts at the lead angle before its nominal entry."""
        return -math.pi / 2 - self.contact_angle_rad / 2 - LEAD_ANGLE_RAD

    @property
    def end_s(self) -> float:
        """The last column ends at the tail angle past its nominal exit."""
        behind = (self.brush.columns - 1) * self.brush.pitch_rad
        angle = LEAD_ANGLE_RAD + self.contact_angle_rad + behind + TAIL_ANGLE_RAD
        return angle / self.rate_rad_s

    def inputs(self) -> dict[str, dict[str, object]]:
        """The case in the keys of the input file."""
        brush = self.brush
        return {
            "tool": {
                "body_radius_m": BODY_RADIUS_M,
                "width_m": WIDTH_M,
                "filament_count": brush.filament_count,
            },
            "filament": {
                "segments": self.segments,
                "length_m": LENGTH_M,
                "diameter_m": DIAMETER_M,
                "density_kg_m3": DENSITY_KG_M3,
                "youngs_modulus_pa": YOUNGS_MODULUS_PA,
                "damping_ratio": DAMPING_RATIO,
            },
            "contact": {
                "stiffness_n_m": CONTACT_STIFFNESS_N_M,
                "friction_coefficient": self.friction_coefficient,
                "friction_regularisation_m_s": REGULARISATION_M_S,
            },
            "brush": {
                "columns": brush.columns,
                "rows": 1,
                "stiffness_n_m2": brush.stiffness_n_m2,
                "contact_points": brush.contact_points,
                "damping_s_m": brush.damping_s_m,
                "friction_coefficient": brush.friction_coefficient,
                "steady": False,
            },
            "process": {
                "brushing_velocity_m_s": self.brushing_velocity_m_s,
                "penetration_depth_m": self.penetration_depth_m,
                "lead_angle_rad": LEAD_ANGLE_RAD,
                "tail_angle_rad": TAIL_ANGLE_RAD,
            },
        }


@dataclass
class Parameters:
    """What the equations take besides time and state; numbers, or symbols of CasADi.

    Of the points, one row for each (pair, side, segment, point): whether it touches; whether the
    nearest point is a node; its place on the segment if so; that segment; and the weights of the
    rates that turn the neighbour's surface there.
    """

    below: object  # (columns · n): 1 where a node is below the plane
    points: object  # (points, 3 + 2 n)

    def vector(self) -> np.ndarray:
        """As the equations want it."""
        return np.concatenate([self.below.ravel(), self.points.ravel("F")])


class Equations:
    """The equations of motion of a row, as functions of CasADi of (t, y, p).

    y is (θ of column 0, θ of column 1, …, all θ̇, the integrals), in the units above.
    """

    def __init__(self, case: Case) -> None:
        self.case = case
        self.columns, n = case.brush.columns, case.segments
        self.count = self.columns * n
        self.integral_count = self.columns * len(OF_FILAMENT) + (self.columns - 1) * len(OF_PAIR)
        self.size = 2 * self.count + self.integral_count
        point_count = 2 * (self.columns - 1) * n * case.brush.contact_points
        time = casadi.SX.sym("t")
        angles = casadi.SX.sym("theta", self.count)
        rates = casadi.SX.sym("theta_rate", self.count)
        accelerations = casadi.SX.sym("theta_acceleration", self.count)
        below = casadi.SX.sym("below", self.count)
        points = casadi.SX.sym("points", point_count, 3 + 2 * n)
        parameters = casadi.vertcat(below, casadi.vec(points))
        self.parameter_count = parameters.numel()

        self._time, self._angles, self._rates = time, angles, rates
        kinetic, potential, dissipation = self._chains()
        on_workpiece = self._workpiece(below)
        pressed, torques, between, pair_forces = self._neighbours(points)
        momenta = casadi.gradient(kinetic, rates)
        mass_matrix = casadi.jacobian(momenta, rates)
        right_side = (
            casadi.gradient(kinetic - potential - pressed, angles)
            - casadi.gradient(dissipation, rates)
            - casadi.jtimes(momenta, angles, rates)
            - casadi.jacobian(momenta, time)
            + on_workpiece[0]
            + torques
        )
        integrands = casadi.vertcat(on_workpiece[1], between)
        residual = mass_matrix @ accelerations - right_side
        instant = [time, angles, rates, parameters]
        motion = casadi.Function("motion", instant, [mass_matrix, right_side, integrands])
        by_state = casadi.vertcat(angles, rates)
        tangents = casadi.Function(
            "tangents",
            [*instant, accelerations],
            [casadi.jacobian(residual, by_state), casadi.jacobian(integrands, by_state)],
        )
        # F_n of every filament, forces between neighbours, and the penetration rates of points.
        normal = [on_workpiece[1][len(OF_FILAMENT) * c] for c in range(self.columns)]
        self.observed = casadi.Function(
            "observed", instant, [casadi.vertcat(*normal), pair_forces, self._closing]
        )
        self._set_derivative(motion, tangents)

    def _chains(self) -> tuple[casadi.SX, casadi.SX, casadi.SX]:
        """E_kin and E_spring in J, D in W; sets positions and velocities of the nodes."""
        case, n = self.case, self.case.segments
        h = LENGTH_M / n
        mass = MASS_PER_LENGTH * h
        damping_time = 2 * DAMPING_RATIO / FIRST_FREQUENCY
        kinetic, springs, dissipation = 0, 0, 0
        self._nodes, self._velocities = [], []
        for column in range(self.columns):
            angles = self._angles[column * n : (column + 1) * n]
            rates = self._rates[column * n : (column + 1) * n]
            behind = column * case.brush.pitch_rad
            body = case.start_angle_rad - behind + case.rate_rad_s * self._time
            nodes = [BODY_RADIUS_M * casadi.vertcat(casadi.cos(body), casadi.sin(body))]
            for k in range(n):
                step = h * casadi.vertcat(casadi.cos(angles[k]), casadi.sin(angles[k]))
                velocity = self._velocity(nodes[k] + step / 2)
                kinetic += mass / 2 * casadi.sumsqr(velocity) + mass * h**2 / 24 * rates[k] ** 2
                # The clamp joint carries only half a segment's compliance.
                stiffness = (2 if k == 0 else 1) * BENDING_STIFFNESS / h
                bend = angles[k] - (body if k == 0 else angles[k - 1])
                bend_rate = rates[k] - (case.rate_rad_s if k == 0 else rates[k - 1])
                springs += stiffness / 2 * bend**2
                dissipation += damping_time * stiffness / 2 * bend_rate**2
                nodes.append(nodes[k] + step)
            self._nodes.append(casadi.horzcat(*nodes))
            self._velocities.append(casadi.horzcat(*map(self._velocity, nodes)))
        return kinetic, springs, dissipation

    def _velocity(self, point: casadi.SX) -> casadi.SX:
        return casadi.jacobian(point, self._time) + casadi.jtimes(point, self._angles, self._rates)

    def _workpiece(self, below: casadi.SX) -> tuple[casadi.SX, casadi.SX]:
        """Generalised forces of the plane, and the rates of the integrals of each filament."""
        case, n = self.case, self.case.segments
        torques, integrands = casadi.SX.zeros(self.count), []
        for column, (nodes, velocities) in enumerate(
            zip(self._nodes, self._velocities, strict=True)
        ):
            total, along, work = 0, 0, 0
            for k in range(n):
                depth = below[column * n + k] * (case.height_m - nodes[1, k + 1])
                pressure = CONTACT_STIFFNESS_N_M * depth
                sliding = velocities[0, k + 1]
                rubbing = self._friction(case.friction_coefficient, pressure, sliding)
                force = casadi.vertcat(rubbing, pressure)
                torques += casadi.jtimes(nodes[:, k + 1], self._angles, force, True)
                total, along, work = total + pressure, along + rubbing, work - rubbing * sliding
            integrands += [total, along, work]
        return torques, casadi.vertcat(*integrands)

    @staticmethod
    def _friction(coefficient: float, pressure: casadi.SX, sliding: casadi.SX) -> casadi.SX:
        """Coulomb's law, regularised."""
        return -coefficient * pressure * sliding / casadi.sqrt(sliding**2 + REGULARISATION_M_S**2)

    def _neighbours(
        self, points: casadi.SX
    ) -> tuple[casadi.SX, casadi.SX, casadi.SX, casadi.SX]:
        """Σ E_ab; other generalised forces; rates of the pairs' integrals; Σ N of each pair."""
        brush, n = self.case.brush, self.case.segments
        part = LENGTH_M / n / brush.contact_points
        energy, torques, integrands, normals = 0, casadi.SX.zeros(self.count), [], []
        closing, row = [], 0
        for pair in range(self.columns - 1):
            sums = casadi.SX.zeros(len(OF_PAIR))
            for a, b, sign in ((pair, pair + 1, 1), (pair + 1, pair, -1)):
                for k in range(n):
                    for i in range(brush.contact_points):
                        place = (i + 0.5) / brush.contact_points
                        touch = points[row, :]
                        found = self._point(a, b, k, place, touch, part)
                        energy += found[0]
                        torques += found[1]
                        total, force, rubbed, damped, rate = found[2:]
                        sums += casadi.vertcat(total, sign * force, rubbed, damped)
                        closing.append(rate)
                        row += 1
            integrands.append(sums)
            normals.append(sums[0])
        self._closing = casadi.vertcat(*closing)
        return energy, torques, casadi.vertcat(*integrands), casadi.vertcat(*normals)

    def _point(
        self, a: int, b: int, k: int, place: float, touch: casadi.SX, part: float
    ) -> tuple[casadi.SX, ...]:
        """A point of segment k of column a, pressed off column b.

        Its energy; generalised forces of damping and friction; normal force; whole force on a; work
        of friction and of damping per time; rate of the penetration, 0 unless it touches.
        """
        brush, n = self.case.brush, self.case.segments
        touches, at_node, node_place = touch[0], touch[1], touch[2]
        segment, turning = touch[3 : 3 + n].T, touch[3 + n :].T
        # Where it is, and where the points of the material are that it consists of.
        own = (1 - place) * self._nodes[a][:, k] + place * self._nodes[a][:, k + 1]
        own_velocity = (1 - place) * self._velocities[a][:, k] + place * self._velocities[a][:, k + 1]
        inner, outer = self._nodes[b][:, :-1] @ segment, self._nodes[b][:, 1:] @ segment
        # Segments have the length h. Where no segment is chosen both ends are the origin.
        nearest = casadi.dot(own - inner, outer - inner) / (LENGTH_M / n) ** 2
        other_place = at_node * node_place + (1 - at_node) * nearest
        other = inner + other_place * (outer - inner)
        distance = casadi.norm_2(own - other)
        depth = touches * (DIAMETER_M - distance)
        energy = brush.stiffness_n_m2 / 4 * part * depth**2

        normal = (own - other) / distance
        tangent = casadi.vertcat(-normal[1], normal[0])
        of_inner = self._velocities[b][:, :-1] @ segment
        of_outer = self._velocities[b][:, 1:] @ segment
        relative = own_velocity - of_inner - other_place * (of_outer - of_inner)
        rate = -touches * casadi.dot(relative, normal)
        elastic = brush.stiffness_n_m2 / 2 * part * depth
        viscous = elastic * brush.damping_s_m * rate
        pressure = elastic + viscous
        lever = distance / 2 if brush.friction_at == "surfaces" else 0
        spins = self._rates[a * n + k] + casadi.dot(turning, self._rates[b * n : (b + 1) * n])
        sliding = casadi.dot(relative, tangent) - lever * spins
        rubbing = self._friction(brush.friction_coefficient, pressure, sliding)

        # Virtual power: the generalised force of F at a point with velocity v is (∂v/∂θ̇)ᵀ F.
        extra = casadi.SX.sym("extra", 2)
        power = casadi.dot(relative, normal) * extra[0] + sliding * extra[1]
        torques = casadi.gradient(power, self._rates)
        torques = casadi.substitute(torques, extra, casadi.vertcat(viscous, rubbing))
        force = pressure * normal + rubbing * tangent
        return energy, torques, pressure, force, -rubbing * sliding, viscous * rate, rate

    def _set_derivative(self, motion: casadi.Function, tangents: casadi.Function) -> None:
        """dy/dt as a function of (t, y, p), which knows its Jacobian."""
        n, extra = self.count, self.integral_count
        time, y = casadi.MX.sym("t"), casadi.MX.sym("y", self.size)
        p = casadi.MX.sym("p", self.parameter_count)
        instant = [time, y[:n], y[n : 2 * n] * RATE_UNIT_RAD_S, p]
        mass_matrix, right_side, integrands = motion(*instant)
        accelerations = casadi.solve(mass_matrix, right_side, "ldl")
        derivative = casadi.vertcat(
            instant[2], accelerations / RATE_UNIT_RAD_S, integrands / INTEGRAL_UNIT
        )
        # From M q̈ = f follows ∂q̈ = −M⁻¹ ∂(M q̈ − f) at the q̈ of the state.
        by_state, integrands_by_state = tangents(*instant, accelerations)
        by_state = -casadi.solve(mass_matrix, casadi.densify(by_state), "ldl")
        by_angles, by_rates = casadi.horzsplit(by_state, n)
        by_integrands = casadi.horzsplit(integrands_by_state, n)
        jacobian = casadi.vertcat(
            casadi.horzcat(
                casadi.MX(n, n), casadi.MX(RATE_UNIT_RAD_S * casadi.DM.eye(n)), casadi.MX(n, extra)
            ),
            casadi.horzcat(by_angles / RATE_UNIT_RAD_S, by_rates, casadi.MX(n, extra)),
            casadi.horzcat(
                by_integrands[0] / INTEGRAL_UNIT,
                by_integrands[1] * (RATE_UNIT_RAD_S / INTEGRAL_UNIT),
                casadi.MX(extra, extra),
            ),
        )
        # CasADi wants the Jacobian by all arguments, given the result too; those by t and p are
        # not used.
        size, empty = self.size, casadi.MX(self.size, 1)
        custom = casadi.Function(
            "jac_derivative",
            [time, y, p, empty],
            [empty, jacobian, casadi.MX(size, self.parameter_count)],
            ["t", "y", "p", "out_ode"],
            ["jac_ode_t", "jac_ode_y", "jac_ode_p"],
        )
        names, options = (["t", "y", "p"], ["ode"]), {"custom_jacobian": custom}
        self.derivative = casadi.Function("derivative", [time, y, p], [derivative], *names, options)


@dataclass(frozen=True)
class Window:
    """A piece of the motion with one touch.

    The touch is a row of whole numbers: 1 for nodes below the plane; for points 0 in the air, 2 k at
    the neighbour's node k (0 if that is the root: 2 n + 1 then) and 2 k − 1 inside its segment k.
    """

    times: np.ndarray
    states: np.ndarray  # columns
    touch: np.ndarray
    parameters: np.ndarray

    def first(self, count: int) -> "Window":
        """Its first points."""
        return replace(self, times=self.times[:count], states=self.states[:, :count])


class Motion:
    """A pass, window by window."""

    def __init__(self, case: Case, relative_tolerance: float) -> None:
        self.case, self.equations = case, Equations(case)
        self._n, self._columns = case.segments, case.brush.columns
        share, y = casadi.MX.sym("share"), casadi.MX.sym("y", self.equations.size)
        p = casadi.MX.sym("p", self.equations.parameter_count)
        window = casadi.MX.sym("window", 2)  # start and length in s
        derivative = self.equations.derivative(window[0] + window[1] * share, y, p)
        problem = {
            "t": share,
            "x": y,
            "p": casadi.vertcat(window, p),
            "ode": window[1] * derivative,
        }
        options = {
            "reltol": relative_tolerance,
            "abstol": ABSOLUTE_TOLERANCE * relative_tolerance,
            "max_num_steps": 1_000_000,
        }
        self._shares = np.linspace(0.0, 1.0, POINTS)
        grid = list(self._shares)
        self._integrator = casadi.integrator("window", "cvodes", problem, 0.0, grid, options)

    def start(self) -> np.ndarray:
        """Straight filaments, turning rigidly with the body."""
        case = self.case
        bodies = case.start_angle_rad - case.brush.pitch_rad * np.arange(self._columns)
        rates = np.full(self.equations.count, case.rate_rad_s / RATE_UNIT_RAD_S)
        integrals = np.zeros(self.equations.integral_count)
        return np.concatenate([np.repeat(bodies, self._n), rates, integrals])

    def polylines(self, times: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Positions (times, columns, nodes, 2), for angles as columns."""
        case = self.case
        bodies = case.start_angle_rad - case.brush.pitch_rad * np.arange(self._columns)
        body = (bodies + case.rate_rad_s * times[:, None])[..., None]
        azimuths = angles.T.reshape(len(times), self._columns, self._n)
        h = LENGTH_M / self._n
        steps = [np.stack([r * np.cos(a), r * np.sin(a)], -1) for r, a in
                 ((BODY_RADIUS_M, body), (h, azimuths))]
        return np.cumsum(np.concatenate(steps, axis=2), axis=2)

    def _touch_of_points(self, own: np.ndarray, other: np.ndarray) -> np.ndarray:
        """What of polylines `other` the points of polylines `own` touch, (times, points)."""
        count = self.case.brush.contact_points
        places = ((np.arange(count) + 0.5) / count)[:, None]
        starts, ends = own[:, :-1, None, :], own[:, 1:, None, :]
        points = (starts + places * (ends - starts)).reshape(len(own), -1, 1, 2)
        inner, along = other[:, None, :-1, :], np.diff(other, axis=1)[:, None]
        where = np.sum((points - inner) * along, axis=-1) / np.sum(along**2, axis=-1)
        offsets = points - inner - np.clip(where, 0.0, 1.0)[..., None] * along
        distances = np.linalg.norm(offsets, axis=-1)
        nearest = np.argmin(distances, axis=-1)[..., None]
        where = np.take_along_axis(where, nearest, axis=-1)[..., 0]
        distance = np.take_along_axis(distances, nearest, axis=-1)[..., 0]
        feature = 2 * nearest[..., 0] + np.where(where <= 0.0, 0, np.where(where >= 1.0, 2, 1))
        feature = np.where(feature == 0, 2 * self._n + 1, feature)
        return np.where(distance < DIAMETER_M, feature, 0)

    def touches(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """The touch (see `Window`) at each time, as rows."""
        lines = self.polylines(times, states[: self.equations.count])
        rows = [(lines[:, :, 1:, 1] < self.case.height_m).reshape(len(times), -1)]
        for pair in range(self._columns - 1):
            for a, b in ((pair, pair + 1), (pair + 1, pair)):
                rows.append(self._touch_of_points(lines[:, a], lines[:, b]))
        return np.concatenate(rows, axis=1).astype(int)

    def touch(self, time: float, y: np.ndarray) -> np.ndarray:
        """That of one state."""
        return self.touches(np.array([time]), y[:, None])[0]

    def parameters(self, touch: np.ndarray) -> np.ndarray:
        """The touch as the equations take it."""
        n, nodes = self._n, self.equations.count
        points = np.zeros((len(touch) - nodes, 3 + 2 * n))
        for row, feature in zip(points, touch[nodes:], strict=True):
            if feature == 0:
                continue
            node = 0 if feature == 2 * n + 1 else feature // 2
            row[0], row[1], row[2] = 1.0, float(node * 2 == feature or node == 0 and feature > 1), 1.0
            if feature == 2 * n + 1:
                segments, row[2], row[3] = [0], 0.0, 1.0
            elif feature % 2 == 1:
                row[1], segments = 0.0, [node]
                row[3 + node] = 1.0
            else:
                # The surface at a node turns with both segments.
                row[1], segments = 1.0, [node - 1, min(node, n - 1)]
                row[3 + node - 1] = 1.0
            for segment in segments:
                row[3 + n + segment] += 1.0 / len(segments)
        return Parameters(touch[:nodes].astype(float), points).vector()

    def _window(self, start_s: float, end_s: float, y: np.ndarray, touch: np.ndarray) -> Window:
        """The motion with one touch, whether or not it lasts."""
        parameters = self.parameters(touch)
        p = np.concatenate([[start_s, end_s - start_s], parameters])
        states = np.array(self._integrator(x0=y, p=p)["xf"])
        if not np.all(np.isfinite(states)):
            raise RuntimeError(f"{self.case.name}: CVODES stopped in the window at {start_s} s")
        times = start_s + (end_s - start_s) * self._shares
        times[-1] = end_s
        return Window(times, states, touch, parameters)

    def between(self, window: Window, i: int) -> Callable[[float], np.ndarray]:
        """The state after point i, until the next: of degree 5 in angles, 3 in the integrals."""
        n, angles, integrals = self.equations.count, [], []
        for time, y in zip(window.times[i : i + 2], window.states[:, i : i + 2].T, strict=True):
            slope = np.array(self.equations.derivative(time, y, window.parameters)).ravel()
            angles.append([y[:n], slope[:n], RATE_UNIT_RAD_S * slope[n : 2 * n]])
            integrals.append([y[2 * n :], slope[2 * n :]])
        # Over the time since point i, whose rounding would else enter.
        ends = [0.0, window.times[i + 1] - window.times[i]]
        of_angles, of_integrals = (BPoly.from_derivatives(ends, y) for y in (angles, integrals))
        of_rates = of_angles.derivative()
        return lambda since: np.concatenate(
            [of_angles(since), of_rates(since) / RATE_UNIT_RAD_S, of_integrals(since)]
        )

    def observed(self, time: float, y: np.ndarray, parameters: np.ndarray) -> list[np.ndarray]:
        """F_n of every filament, Σ N of every pair, rates of penetration of all points."""
        n = self.equations.count
        values = self.equations.observed(time, y[:n], y[n : 2 * n] * RATE_UNIT_RAD_S, parameters)
        return [np.array(value).ravel() for value in values]

    def normal_forces_n(self, window: Window) -> np.ndarray:
        """F_n (times, columns)."""
        lines = self.polylines(window.times, window.states[: self.equations.count])
        below = window.touch[: self.equations.count].reshape(self._columns, self._n)
        depths = below * (self.case.height_m - lines[:, :, 1:, 1])
        return CONTACT_STIFFNESS_N_M * np.sum(depths, axis=-1)

    def peak_in(self, window: Window, column: int) -> float:
        """Largest F_n of a filament in a window."""
        forces = self.normal_forces_n(window)[:, column]
        i = int(np.argmax(forces))
        peak = float(forces[i])
        for j in (i - 1, i):
            if not 0 <= j < len(forces) - 1:
                continue
            state, start = self.between(window, j), window.times[j]

            def negative(since: float, state=state, start=start) -> float:
                here = state(since)[:, None]
                point = replace(window, times=np.array([start + since]), states=here)
                return -float(self.normal_forces_n(point)[0, column])

            bounds = (0.0, window.times[j + 1] - start)
            peak = max(peak, -float(minimize_scalar(negative, bounds=bounds, method="bounded").fun))
        return peak

    def _first_change(self, window: Window) -> int | None:
        """The first point, but the start, at which something else touches."""
        rows = self.touches(window.times, window.states)
        changed = np.flatnonzero(np.any(rows != window.touch, axis=1))
        # The start is the event that ended the window before.
        changed = changed[changed > 0]
        return int(changed[0]) if len(changed) > 0 else None

    def _check(self, window: Window) -> None:
        """That nothing happens which the equations leave out."""
        lines = self.polylines(window.times[-1:], window.states[: self.equations.count, -1:])[0]
        for column in range(self._columns - 2):
            ends = lines[column][:, None] - lines[column + 2][None]
            # Nodes are h apart: no point is nearer than this.
            if np.min(np.linalg.norm(ends, axis=-1)) < DIAMETER_M:
                raise RuntimeError(f"{self.case.name}: columns touch that are not neighbours")
        if self.case.brush.damping_s_m > 0.0 and self._columns > 1:
            rates = self.observed(window.times[-1], window.states[:, -1], window.parameters)[2]
            if np.min(rates) * self.case.brush.damping_s_m <= -1.0:
                raise RuntimeError(f"{self.case.name}: a damped contact would pull")

    def windows(self) -> Iterator[Window]:
        """The whole motion."""
        end_of_all, self.changes = self.case.end_s, 0
        start_s, y, until_s = 0.0, self.start(), None
        touch, length, since_s = self.touch(start_s, y), LONGEST_WINDOW_S, 0.0
        while start_s < end_of_all:
            end_s = until_s or min(start_s + length, end_of_all)
            # The last bit is no window of its own.
            if end_of_all - end_s < 1e-3 * length:
                end_s = end_of_all
            window = self._window(start_s, end_s, y, touch)
            change = self._first_change(window)
            following, until_of_next = touch, None
            if change is not None and until_s is None:
                # Once more from the point before the change to that after it, at much finer points.
                until_of_next = float(window.times[change])
                window = window.first(change)
            elif change is not None:
                window, following = self._until_change(window, change)
                self.changes += 1
                if self.changes > MOST_CHANGES:
                    raise RuntimeError(f"{self.case.name}: chatters at {start_s} s")
            if len(window.times) > 1:
                self._check(window)
                yield window
            start_s, y = float(window.times[-1]), window.states[:, -1]
            if following is not touch:
                length, since_s = start_s - since_s, start_s
            length = WINDOW_GROWTH * max(length, start_s - since_s)
            length = min(max(length, SHORTEST_WINDOW_S), LONGEST_WINDOW_S)
            touch, until_s = following, until_of_next

    def _until_change(self, window: Window, change: int) -> tuple[Window, np.ndarray]:
        """The window until the touch changes, which is located, and the next touch."""
        before = float(window.times[change - 1])
        state = self.between(window, change - 1)
        low, high = 0.0, float(window.times[change]) - before
        # To 2e-9 of the distance of the points.
        for _ in range(29):
            middle = (low + high) / 2
            if np.array_equal(self.touch(before + middle, state(middle)), window.touch):
                low = middle
            else:
                high = middle
        times = np.append(window.times[:change], before + high)
        states = np.column_stack([window.states[:, :change], state(high)])
        ended = replace(window, times=times, states=states)
        return ended, self.touch(before + high, state(high))
