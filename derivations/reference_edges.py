"""Passes over edges, curves and turns, by a planar code that shares nothing with the Rust code.

What enters: nothing; the cases are those of `cases()` below.
What leaves: a JSON file with the metrics of all cases, and two trajectories.

How it is done:

1. The filament stays in the plane of rotation, so one azimuth θ_k a segment describes it. E_kin,
   E_pot and D are written down in these, for segments that may differ and joints that may be
   relaxed at an angle; CasADi differentiates them into M(q) q̈ = f(q, q̇, t) (Uhlmann and Hoyer,
   Ceramics 2021, Eq. 1) and into the Jacobian of f.
2. Faces press on the nodes, an arc with an edge's radius on the point of the polyline nearest to
   its centre, as MODEL.md says. Which node meets which face, and whether the nearest point lies
   inside a segment or on a node, is the *touch* of a state. The equations take the touch as
   parameters and are smooth while it does not change.
3. CVODES of SUNDIALS (BDF of orders 1 to 5, Newton's method), as CasADi ships it, integrates
   windows with a constant touch. The touch of the motion is searched about every microsecond;
   where it changes, the time is located by bisection, the window ends there, and CVODES is started
   again. No step crosses a kink. Nothing is smoothed but friction, as MODEL.md says.
4. The integrals of the metrics are states of the solver; contact times are sums of windows.

Each case is computed at two tolerances; the file gives the larger difference of its impulse and
friction work as its own error.

SI units, angles in radians: z along the tool axis, y normal to the plane y = 0 of the workpiece,
which lies at −(R − a_e); the body angle is β = β_0 + ω t.

Run from the repository root:

    python derivations/reference_edges.py
"""

import argparse
import json
import math
import multiprocessing
import platform
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path

import casadi
import numpy as np
import scipy
from numpy.polynomial import Legendre, Polynomial
from scipy.interpolate import BPoly

ROOT = Path(__file__).parent.parent
DEFAULT_OUTPUT = ROOT / "tests" / "data" / "reference_edges.json"
TRAJECTORIES = Path(__file__).parent / "trajectories"

# The paper's tool and filament, and the defaults for what the paper leaves open.
BODY_RADIUS_M = 0.140
LENGTH_M = 0.040
TOOL_RADIUS_M = BODY_RADIUS_M + LENGTH_M
DIAMETER_M = 1.18e-3
DENSITY_KG_M3 = 1110.0
YOUNGS_MODULUS_PA = 3.0e9
DAMPING_RATIO = 0.05
CONTACT_STIFFNESS_N_M = 1e5
REGULARISATION_M_S = 1e-3
LEAD_ANGLE_RAD = 0.005
TAIL_ANGLE_RAD = 0.15

# Units of the solver's states, so that one absolute tolerance fits all: angles of 1 rad, rates of
# 1000 rad/s, integrals of 1 mN s, 1 mJ and 1 mN m s.
RATE_UNIT_RAD_S = 1e3
INTEGRAL_UNIT = 1e-3
INTEGRALS = (
    "contact_normal_impulse_n_s",
    "contact_impulse_x_n_s",
    "contact_impulse_y_n_s",
    "edge_contact_normal_impulse_n_s",
    "friction_work_j",
    "contact_angular_impulse_n_m_s",
)
TOLERANCE, LOOSER = 1e-10, 1e-9
# Absolute over relative tolerance, in these units.
ABSOLUTE_TOLERANCE = 0.1
# CVODES is asked for the motion one window after the other, and gives it at so many points in each.
WINDOW_S = 4e-4
POINTS = 401
# Below this a number is zero but for rounding, in any of the units.
LEAST_VALUE = 1e-18
# More changes of the touch than this mean that a pass chatters, which this code does not solve.
MOST_CHANGES = 20_000

ROWS = 1001
COLUMNS = (
    "time_s",
    "contact_normal_force_n",
    "edge_contact_normal_force_n",
    "contact_force_x_n",
    "contact_force_y_n",
    "contact_normal_impulse_n_s",
    "tip_x_m",
    "tip_y_m",
    "tip_deflection_m",
)
# What says nothing about a workpiece of a kind.
UNUSED = {
    "plane": ("offset_m", "included_angle_rad", "edge_radius_m", "side", "radius_m"),
    "edge": ("radius_m",),
    "cylinder": ("included_angle_rad", "edge_radius_m", "side"),
    "bore": ("included_angle_rad", "edge_radius_m", "side"),
}


@dataclass(frozen=True)
class Filament:
    """A filament of the paper's length; straight and uniform unless told."""

    segments: int
    tip_diameter_m: float = DIAMETER_M
    waviness_amplitude_m: float = 0.0
    waviness_length_m: float = 0.020
    waviness_phase_rad: float = 0.0

    def diameter_m(self, arc_length: float) -> float:
        """Linear from the root to the tip."""
        return DIAMETER_M + (self.tip_diameter_m - DIAMETER_M) * arc_length / LENGTH_M

    def bending_stiffness(self, arc_length: float) -> float:
        """E I in N m²."""
        return YOUNGS_MODULUS_PA * math.pi * self.diameter_m(arc_length) ** 4 / 64

    def mass_per_length(self, arc_length: float) -> float:
        """ρ A in kg/m."""
        return DENSITY_KG_M3 * math.pi * self.diameter_m(arc_length) ** 2 / 4

    def relaxed_angles(self) -> np.ndarray:
        """γ_1 … γ_n, relative to the clamp."""
        h = LENGTH_M / self.segments
        phases = 2 * math.pi * h / self.waviness_length_m * np.arange(self.segments + 1)
        across = self.waviness_amplitude_m * np.sin(phases + self.waviness_phase_rad)
        return np.arcsin(np.diff(across) / h)

    def first_frequency(self) -> float:
        """Ω_1 of the clamped beam, by the method of Ritz with polynomials up to degree 15."""
        legendre = (Legendre.basis(i, domain=[0.0, 1.0]) for i in range(14))
        functions = [Polynomial.basis(2) * each.convert(kind=Polynomial) for each in legendre]
        points, weights = np.polynomial.legendre.leggauss(24)
        points, weights = (points + 1) / 2, weights / 2
        values = np.array([function(points) for function in functions])
        bends = np.array([function.deriv(2)(points) for function in functions])
        stiffness = weights * [self.bending_stiffness(LENGTH_M * s) for s in points]
        mass = weights * [self.mass_per_length(LENGTH_M * s) for s in points]
        factor = np.linalg.cholesky((values * mass) @ values.T)
        bends = np.linalg.solve(factor, bends)
        squares = np.linalg.eigvalsh((bends * stiffness) @ bends.T)
        return math.sqrt(squares[0] / LENGTH_M**4)


@dataclass(frozen=True)
class Workpiece:
    """A plane, an edge, a cylinder or a bore, as MODEL.md places it."""

    kind: str
    offset_m: float = 0.0
    included_angle_rad: float = math.pi / 2
    edge_radius_m: float = 0.2e-3
    side: str = "leaving"
    radius_m: float = 0.0


@dataclass(frozen=True)
class Case:
    """A pass, or several turns; v_b in m/s, a_e in m."""

    name: str
    filament: Filament
    workpiece: Workpiece
    brushing_velocity_m_s: float
    penetration_depth_m: float
    friction_coefficient: float = 0.0
    turns: int = 1

    @property
    def rate_rad_s(self) -> float:
        """ω = v_b / R."""
        return self.brushing_velocity_m_s / TOOL_RADIUS_M

    @property
    def height_m(self) -> float:
        """Where y = 0 of the workpiece lies."""
        return self.penetration_depth_m - TOOL_RADIUS_M

    @property
    def half_angle_rad(self) -> float:
        """Half of the angle over which the undeformed tip is below y = 0 or in the bore's material.

        All other workpieces lie below y = 0, so the undeformed filament touches none before.
        """
        if self.workpiece.kind == "bore":
            radius = self.workpiece.radius_m
            centre = self.height_m + radius
            sine = (TOOL_RADIUS_M**2 + centre**2 - radius**2) / (2 * TOOL_RADIUS_M * centre)
            return math.pi / 2 + math.asin(sine)
        return math.acos(-self.height_m / TOOL_RADIUS_M)

    @property
    def start_angle_rad(self) -> float:
        """β_0: the lead angle before the first touch."""
        return -math.pi / 2 - self.half_angle_rad - LEAD_ANGLE_RAD

    @property
    def turn_s(self) -> float:
        """Time of a turn."""
        return 2 * math.pi / self.rate_rad_s

    @property
    def end_s(self) -> float:
        """The tail angle past the last touch of a single turn; several turns are whole."""
        if self.turns > 1:
            return self.turns * self.turn_s
        return (LEAD_ANGLE_RAD + 2 * self.half_angle_rad + TAIL_ANGLE_RAD) / self.rate_rad_s


class Profile:
    """The workpiece of a case in the frame of the tool: its faces and its arc."""

    def __init__(self, case: Case) -> None:
        piece = case.workpiece
        self.origin = np.array([piece.offset_m, case.height_m])
        self.has_arc = piece.kind == "edge"
        self.radius = piece.edge_radius_m
        # Circles are one face; of a cylinder the filament is outside, of a bore inside.
        self.circle = piece.kind in ("cylinder", "bore")
        self.circle_sign = -1.0 if piece.kind == "bore" else 1.0
        self.circle_radius = piece.radius_m
        self.circle_centre = self.origin - [0.0, self.circle_sign * piece.radius_m]
        # Faces through the origin. Along each, away from the edge, lies its tangent.
        mirror = np.array([-1.0 if piece.side == "entering" else 1.0, 1.0])
        angle = piece.included_angle_rad
        self.normals = np.array([[0.0, 1.0], [math.sin(angle), -math.cos(angle)]]) * mirror
        self.tangents = np.array([[-1.0, 0.0], [-math.cos(angle), -math.sin(angle)]]) * mirror
        inwards = np.array([-self.radius / math.tan(angle / 2), -self.radius]) * mirror
        self.centre = self.origin + inwards

    def faces_of(self, nodes: np.ndarray) -> np.ndarray:
        """For nodes (…, 2): 0 in the air or on the arc, else 1 or 2, the face they penetrate."""
        if self.circle:
            distances = np.linalg.norm(nodes - self.circle_centre, axis=-1)
            return (self.circle_sign * (distances - self.circle_radius) < 0.0).astype(int)
        depths = -(nodes - self.origin) @ self.normals.T
        if not self.has_arc:
            return (depths[..., 0] > 0.0).astype(int)
        along = (nodes - self.centre) @ self.tangents.T
        inside = np.all(depths > 0.0, axis=-1)
        nearer = (along[..., 1] < 0.0) | (depths[..., 0] <= depths[..., 1])
        first = (along[..., 0] >= 0.0) & nearer
        second = (along[..., 1] >= 0.0) & ~first
        return np.where(inside & first, 1, np.where(inside & second, 2, 0))

    def nearest(self, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What of polylines (…, n + 1, 2) is nearest to the arc's centre.

        That is a feature, 2 k at node k and 2 k − 1 inside segment k; its nearest point; and the
        distance of that.
        """
        inner, pieces = nodes[..., :-1, :], np.diff(nodes, axis=-2)
        places = np.sum((self.centre - inner) * pieces, axis=-1) / np.sum(pieces**2, axis=-1)
        points = inner + np.clip(places, 0.0, 1.0)[..., None] * pieces
        distances = np.linalg.norm(points - self.centre, axis=-1)
        nearest = np.argmin(distances, axis=-1)[..., None]
        place = np.take_along_axis(places, nearest, axis=-1)[..., 0]
        feature = 2 * nearest[..., 0] + np.where(place <= 0.0, 0, np.where(place >= 1.0, 2, 1))
        point = np.take_along_axis(points, nearest[..., None], axis=-2)[..., 0, :]
        return feature, point, np.take_along_axis(distances, nearest, axis=-1)[..., 0]

    def feature_of(self, nodes: np.ndarray) -> np.ndarray:
        """Of polylines (…, n + 1, 2) the nearest feature if it touches the arc, else 0."""
        if not self.has_arc:
            return np.zeros(nodes.shape[:-2], dtype=int)
        feature, point, distance = self.nearest(nodes)
        along = (point - self.centre) @ self.tangents.T
        touches = (distance < self.radius) & np.all(along <= 0.0, axis=-1)
        return np.where(touches, feature, 0)


class Equations:
    """The equations of motion of a filament, as functions of CasADi of (t, y, p).

    y is (θ_1 … θ_n, θ̇_1 … θ̇_n, the integrals), in the units above. The parameters p are those
    of the case and of its touch.
    """

    def __init__(self, filament: Filament, circle: bool) -> None:
        self.filament, self.circle = filament, circle
        n = filament.segments
        time = casadi.SX.sym("t")
        angles, rates = casadi.SX.sym("theta", n), casadi.SX.sym("theta_rate", n)
        accelerations = casadi.SX.sym("theta_acceleration", n)
        # Start angle, rate, friction; centre, radius and sign of the circle or arc.
        case = casadi.SX.sym("case", 7)
        # Of each node: 1 if it touches its face, and the face's normal and distance.
        faces = casadi.SX.sym("faces", n, 4)
        # 1 at the segment that touches the arc; whether anything does, and whether its outer node.
        at_arc, at_segment = casadi.SX.sym("at_arc", 2), casadi.SX.sym("at_segment", n)
        parameters = casadi.vertcat(case, casadi.vec(faces), at_arc, at_segment)

        kinetic, potential, dissipation, nodes = self._energies_and_nodes(time, angles, rates, case)
        contact = self._contact(time, angles, rates, nodes, case, faces, at_arc, at_segment)
        torques, integrands, forces = contact
        momenta = casadi.gradient(kinetic, rates)
        mass_matrix = casadi.jacobian(momenta, rates)
        right_side = (
            casadi.gradient(kinetic - potential, angles)
            - casadi.gradient(dissipation, rates)
            - casadi.jtimes(momenta, angles, rates)
            - casadi.jacobian(momenta, time)
            + torques
        )
        residual = mass_matrix @ accelerations - right_side

        instant = [time, angles, rates, parameters]
        motion = casadi.Function("motion", instant, [mass_matrix, right_side, integrands])
        by_state = casadi.vertcat(angles, rates)
        tangents = casadi.Function(
            "tangents",
            [*instant, accelerations],
            [casadi.jacobian(residual, by_state), casadi.jacobian(integrands, by_state)],
        )
        tip = nodes[:, n]
        tip_velocity = casadi.jacobian(tip, time) + casadi.jtimes(tip, angles, rates)
        self.observed = casadi.Function(
            "observed", instant, [casadi.vertcat(forces, tip, tip_velocity)]
        )
        self._set_derivative(motion, tangents, parameters.numel())

    def _set_derivative(
        self, motion: casadi.Function, tangents: casadi.Function, parameter_count: int
    ) -> None:
        """dy/dt as a function of (t, y, p), which knows its Jacobian."""
        n, size = self.filament.segments, 2 * self.filament.segments + len(INTEGRALS)
        self.size, self.parameter_count = size, parameter_count
        time, y = casadi.MX.sym("t"), casadi.MX.sym("y", size)
        p = casadi.MX.sym("p", parameter_count)
        instant = [time, y[:n], y[n : 2 * n] * RATE_UNIT_RAD_S, p]
        mass_matrix, right_side, integrands = motion(*instant)
        accelerations = casadi.solve(mass_matrix, right_side, "ldl")
        derivative = casadi.vertcat(
            instant[2], accelerations / RATE_UNIT_RAD_S, integrands / INTEGRAL_UNIT
        )
        # From M q̈ = f follows ∂q̈ = −M⁻¹ ∂(M q̈ − f) at the q̈ of the state.
        by_state, integrands_by_state = tangents(*instant, accelerations)
        by_state = -casadi.solve(mass_matrix, casadi.densify(by_state), "ldl")
        integrals = casadi.MX(n, len(INTEGRALS))
        by_integrands = casadi.horzsplit(integrands_by_state, n)
        by_angles, by_rates = casadi.horzsplit(by_state, n)
        unit_rates = casadi.MX(RATE_UNIT_RAD_S * casadi.DM.eye(n))
        jacobian = casadi.vertcat(
            casadi.horzcat(casadi.MX(n, n), unit_rates, integrals),
            casadi.horzcat(by_angles / RATE_UNIT_RAD_S, by_rates, integrals),
            casadi.horzcat(
                by_integrands[0] / INTEGRAL_UNIT,
                by_integrands[1] * (RATE_UNIT_RAD_S / INTEGRAL_UNIT),
                casadi.MX(len(INTEGRALS), len(INTEGRALS)),
            ),
        )
        # CasADi wants the Jacobian by all arguments, given the result too; those by t and p are
        # not used.
        custom = casadi.Function(
            "jac_derivative",
            [time, y, p, casadi.MX(size, 1)],
            [casadi.MX(size, 1), jacobian, casadi.MX(size, parameter_count)],
            ["t", "y", "p", "out_ode"],
            ["jac_ode_t", "jac_ode_y", "jac_ode_p"],
        )
        names = ["t", "y", "p"], ["ode"]
        options = {"custom_jacobian": custom}
        self.derivative = casadi.Function("derivative", [time, y, p], [derivative], *names, options)

    def _energies_and_nodes(
        self, time: casadi.SX, angles: casadi.SX, rates: casadi.SX, case: casadi.SX
    ) -> tuple[casadi.SX, casadi.SX, casadi.SX, casadi.SX]:
        """E_kin and E_spring in J, D in W, and the positions of the nodes 0 … n as columns."""
        filament, n = self.filament, self.filament.segments
        h = LENGTH_M / n
        damping_time = 2 * DAMPING_RATIO / filament.first_frequency()
        relaxed = filament.relaxed_angles()
        body_angle = case[0] + case[1] * time
        nodes = [BODY_RADIUS_M * casadi.vertcat(casadi.cos(body_angle), casadi.sin(body_angle))]
        kinetic, springs, dissipation = 0, 0, 0
        for k in range(n):
            step = h * casadi.vertcat(casadi.cos(angles[k]), casadi.sin(angles[k]))
            centre = nodes[k] + step / 2
            velocity = casadi.jacobian(centre, time) + casadi.jtimes(centre, angles, rates)
            mass = filament.mass_per_length((k + 0.5) * h) * h
            kinetic += mass / 2 * casadi.sumsqr(velocity) + mass * h**2 / 24 * rates[k] ** 2
            # The clamp joint carries only half a segment's compliance.
            if k == 0:
                stiffness = 2 * filament.bending_stiffness(h / 4) / h
                bend, bend_rate = angles[0] - body_angle - relaxed[0], rates[0] - case[1]
            else:
                stiffness = filament.bending_stiffness(k * h) / h
                bend = angles[k] - angles[k - 1] - (relaxed[k] - relaxed[k - 1])
                bend_rate = rates[k] - rates[k - 1]
            springs += stiffness / 2 * bend**2
            dissipation += damping_time * stiffness / 2 * bend_rate**2
            nodes.append(nodes[k] + step)
        return kinetic, springs, dissipation, casadi.horzcat(*nodes)

    def _contact(
        self,
        time: casadi.SX,
        angles: casadi.SX,
        rates: casadi.SX,
        nodes: casadi.SX,
        case: casadi.SX,
        faces: casadi.SX,
        at_arc: casadi.SX,
        at_segment: casadi.SX,
    ) -> tuple[casadi.SX, casadi.SX, casadi.SX]:
        """Generalised forces; the rates of the integrals; F_n, its part on the edge, F_x, F_y."""
        n = self.filament.segments
        friction, centre, radius, sign = case[2], case[3:5], case[5], case[6]

        def pressed(
            point: casadi.SX, gap: casadi.SX, normal: casadi.SX, touches: casadi.SX
        ) -> tuple[casadi.SX, casadi.SX, casadi.SX]:
            """F_n, the force on the filament, and the power that friction takes."""
            velocity = casadi.jacobian(point, time) + casadi.jtimes(point, angles, rates)
            sliding = velocity - casadi.dot(velocity, normal) * normal
            speed = casadi.sqrt(casadi.sumsqr(sliding) + REGULARISATION_M_S**2)
            pressure = -touches * CONTACT_STIFFNESS_N_M * gap
            rubbing = -friction * pressure / speed * sliding
            return pressure, pressure * normal + rubbing, -casadi.dot(rubbing, sliding)

        total, on_edge, work, angular, force_sum = 0, 0, 0, 0, casadi.SX.zeros(2)
        torques = casadi.SX.zeros(n)
        for k in range(n):
            node, normal = nodes[:, k + 1], faces[k, 1:3].T
            gap = casadi.dot(node, normal) - faces[k, 3]
            if self.circle:
                distance = casadi.norm_2(node - centre)
                gap, normal = sign * (distance - radius), sign * (node - centre) / distance
            pressure, force, taken = pressed(node, gap, normal, faces[k, 0])
            torques += casadi.jtimes(node, angles, force, True)
            total, work, force_sum = total + pressure, work + taken, force_sum + force
            angular += node[0] * force[1] - node[1] * force[0]
        if not self.circle:
            place = casadi.SX.sym("place")
            inner, outer = nodes[:, :-1] @ at_segment, nodes[:, 1:] @ at_segment
            along = outer - inner
            # Of the filament's material; the nearest point moves along it.
            material = inner + place * along
            nearest = casadi.dot(centre - inner, along) / casadi.sumsqr(along)
            # Segments have the length h; where no segment is chosen there is nothing to divide.
            nearest = casadi.if_else(at_arc[0] > 0, nearest, 0.5)
            here = at_arc[1] + (1 - at_arc[1]) * nearest
            offset = material - centre
            distance = casadi.norm_2(offset)
            normal = casadi.if_else(at_arc[0] > 0, offset / distance, 0)
            gap = distance - radius
            pressure, force, taken = pressed(material, gap, normal, at_arc[0])
            turning = casadi.jtimes(material, angles, force, True)
            moment = material[0] * force[1] - material[1] * force[0]
            [pressure, force, taken, turning, moment] = casadi.substitute(
                [pressure, force, taken, turning, moment], [place], [here]
            )
            torques, total, on_edge = torques + turning, total + pressure, on_edge + pressure
            work, force_sum, angular = work + taken, force_sum + force, angular + moment
        forces = casadi.vertcat(total, on_edge, force_sum)
        return torques, casadi.vertcat(total, force_sum, on_edge, work, angular), forces


@cache
def equations(filament: Filament, circle: bool) -> Equations:
    """The equations, once for all cases that share them."""
    return Equations(filament, circle)


@dataclass(frozen=True)
class Touch:
    """What touches: of every node the face, and the feature at the arc (see `Profile`)."""

    faces: tuple[int, ...]
    feature: int

    @property
    def anything(self) -> bool:
        """Whether F_n > 0."""
        return self.feature > 0 or any(self.faces)


@dataclass(frozen=True)
class Window:
    """A piece of the motion with one touch."""

    times: np.ndarray
    states: np.ndarray  # columns
    touch: Touch
    parameters: np.ndarray
    ends_turn: bool = False

    def first(self, count: int) -> "Window":
        """Its first points."""
        return replace(self, times=self.times[:count], states=self.states[:, :count])


class Motion:
    """A pass, window by window."""

    def __init__(self, case: Case, relative_tolerance: float) -> None:
        self.case, self.profile = case, Profile(case)
        self.equations = equations(case.filament, self.profile.circle)
        self._n = case.filament.segments
        share = casadi.MX.sym("share")
        y = casadi.MX.sym("y", self.equations.size)
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
        """The relaxed shape, turning rigidly with the body."""
        angles = self.case.start_angle_rad + self.case.filament.relaxed_angles()
        rates = np.full(self._n, self.case.rate_rad_s / RATE_UNIT_RAD_S)
        return np.concatenate([angles, rates, np.zeros(len(INTEGRALS))])

    def _of_case(self) -> np.ndarray:
        profile = self.profile
        centre, radius = profile.centre, profile.radius
        if profile.circle:
            centre, radius = profile.circle_centre, profile.circle_radius
        case = self.case
        first = [case.start_angle_rad, case.rate_rad_s, case.friction_coefficient]
        return np.array([*first, *centre, radius, profile.circle_sign])

    def _parameters(self, touch: Touch) -> np.ndarray:
        n, profile = self._n, self.profile
        faces = np.zeros((n, 4))
        for node, face in enumerate(touch.faces):
            # A node in the air has a face too, for a finite expression, which counts zero times.
            normal = profile.normals[max(face, 1) - 1]
            faces[node] = [float(face > 0), *normal, float(normal @ profile.origin)]
        segment = np.zeros(n)
        if touch.feature > 0:
            segment[(touch.feature - 1) // 2] = 1.0
        arc = [float(touch.feature > 0), float(touch.feature > 0 and touch.feature % 2 == 0)]
        return np.concatenate([self._of_case(), faces.ravel("F"), arc, segment])

    def polylines(self, times: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Positions (times, nodes, 2), for angles as columns."""
        body = self.case.start_angle_rad + self.case.rate_rad_s * times
        steps = np.stack([np.cos(angles), np.sin(angles)], axis=-1) * (LENGTH_M / self._n)
        root = BODY_RADIUS_M * np.stack([np.cos(body), np.sin(body)], axis=-1)
        return np.cumsum(np.concatenate([root[None], steps]), axis=0).transpose(1, 0, 2)

    def touches(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Rows (faces of the nodes, feature), one per time."""
        lines = self.polylines(times, states[: self._n])
        faces = self.profile.faces_of(lines[:, 1:])
        return np.column_stack([faces, self.profile.feature_of(lines)])

    def touch(self, time: float, y: np.ndarray) -> Touch:
        """That of one state."""
        row = self.touches(np.array([time]), y[:, None])[0]
        return Touch(tuple(int(face) for face in row[:-1]), int(row[-1]))

    def _window(self, start_s: float, end_s: float, y: np.ndarray, touch: Touch) -> Window:
        """The motion with one touch, whether or not it lasts."""
        parameters = self._parameters(touch)
        p = np.concatenate([[start_s, end_s - start_s], parameters])
        states = np.array(self._integrator(x0=y, p=p)["xf"])
        if not np.all(np.isfinite(states)):
            raise RuntimeError(f"{self.case.name}: CVODES stopped in the window at {start_s} s")
        times = start_s + (end_s - start_s) * self._shares
        times[-1] = end_s
        return Window(times, states, touch, parameters)

    def between(self, window: Window, i: int) -> Callable[[float], np.ndarray]:
        """The state after point i, until the next: of degree 5 in angles, 3 in the integrals."""
        n, angles, integrals = self._n, [], []
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

    def observed(self, time: float, y: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """F_n, its part on the edge, F_x, F_y; position and velocity of the tip."""
        n = self._n
        values = self.equations.observed(time, y[:n], y[n : 2 * n] * RATE_UNIT_RAD_S, parameters)
        return np.array(values).ravel()

    def depth_at_arc_m(self, window: Window) -> float:
        """Largest penetration of the arc in a window in which something touches it."""
        lines = self.polylines(window.times, window.states[: self._n])
        return self.profile.radius - float(np.min(self.profile.nearest(lines)[2]))

    @staticmethod
    def integrals(window: Window, i: int) -> np.ndarray:
        """Those of INTEGRALS at a point."""
        return window.states[-len(INTEGRALS) :, i] * INTEGRAL_UNIT

    def _first_change(self, window: Window) -> int | None:
        """The first point, but the start, at which something else touches."""
        here = np.array([*window.touch.faces, window.touch.feature])
        rows = self.touches(window.times, window.states)
        changed = np.flatnonzero(np.any(rows != here, axis=1))
        # The start is the event that ended the window before.
        changed = changed[changed > 0]
        return int(changed[0]) if len(changed) > 0 else None

    def windows(self) -> Iterator[Window]:
        """The whole motion."""
        turn, end_of_turn, end_of_all = 0, 0.0, self.case.end_s
        start_s, y, self.changes = 0.0, self.start(), 0
        touch, until_s = self.touch(start_s, y), None
        while start_s < end_of_all:
            if start_s >= end_of_turn:
                turn += 1
                end_of_turn = min(turn * self.case.turn_s, end_of_all)
            end_s = until_s or min(start_s + WINDOW_S, end_of_turn)
            # The last bit of a turn is no window of its own.
            if end_of_turn - end_s < 1e-3 * WINDOW_S:
                end_s = end_of_turn
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
                yield replace(window, ends_turn=bool(window.times[-1] == end_of_turn))
            start_s, y = float(window.times[-1]), window.states[:, -1]
            touch, until_s = following, until_of_next

    def _until_change(self, window: Window, change: int) -> tuple[Window, Touch]:
        """The window until the touch changes, which is located, and the next touch."""
        before = float(window.times[change - 1])
        state = self.between(window, change - 1)
        low, high = 0.0, float(window.times[change]) - before
        # To 2e-9 of the distance of the points, some 1e-18 s.
        for _ in range(29):
            middle = (low + high) / 2
            if self.touch(before + middle, state(middle)) == window.touch:
                low = middle
            else:
                high = middle
        times = np.append(window.times[:change], before + high)
        states = np.column_stack([window.states[:, :change], state(high)])
        ended = replace(window, times=times, states=states)
        return ended, self.touch(before + high, state(high))


def metrics(case: Case, relative_tolerance: float) -> dict[str, object]:
    """What the file says about a case, from a run at one tolerance."""
    motion = Motion(case, relative_tolerance)
    contact_time, turns, deepest = 0.0, [], 0.0
    faces: set[int] = set()
    before = np.zeros(len(INTEGRALS))
    for window in motion.windows():
        if window.touch.anything:
            contact_time += window.times[-1] - window.times[0]
            faces |= set(window.touch.faces) - {0}
        if window.touch.feature > 0:
            deepest = max(deepest, motion.depth_at_arc_m(window))
        last, end = window, motion.integrals(window, -1)
        if window.ends_turn:
            of_turn, of_time = end - before, contact_time
            turns.append(of_turn[0])
            before, contact_time = end, 0.0
    tip = motion.observed(last.times[-1], last.states[:, -1], last.parameters)[4:]
    return {
        "contact_time_s": of_time,
        **dict(zip(INTEGRALS, of_turn, strict=True)),
        "turn_contact_normal_impulses_n_s": turns,
        "final_tip_m": tip[:2],
        "final_tip_velocity_m_s": tip[2:],
        "touches_at_end": last.touch.anything,
        "faces_touched": sorted(faces),
        "largest_edge_penetration_m": deepest,
        "changes_of_touch": motion.changes,
    }


def difference(case: Case, values: dict[str, object], others: dict[str, object]) -> float:
    """Largest difference of two runs: impulses over p_n or p_n R, times and work relative."""
    normal = values[INTEGRALS[0]]
    largest = float(np.linalg.norm(values["final_tip_m"] - others["final_tip_m"])) / LENGTH_M
    for name in (*INTEGRALS, "contact_time_s"):
        scale = normal
        if name in ("friction_work_j", "contact_time_s"):
            scale = values[name]
        elif name == "contact_angular_impulse_n_m_s":
            scale = normal * TOOL_RADIUS_M
        change = abs(values[name] - others[name])
        # Without friction its work is a rounding error, see `rounded`.
        largest = max(largest, change / abs(scale) if change > LEAST_VALUE else 0.0)
    return largest


def rounded(value: object) -> object:
    """Twelve digits: more than the integrator gives, and no rounding of the processor's."""
    if isinstance(value, (list, tuple, np.ndarray)):
        return [rounded(each) for each in value]
    if isinstance(value, float):
        return float(f"{value:.12g}") if abs(value) > LEAST_VALUE else 0.0
    return value


def result(case: Case) -> dict[str, object]:
    """The entry of a case in the file."""
    values, others = metrics(case, TOLERANCE), metrics(case, LOOSER)
    entry = asdict(case)
    # Only what makes the filament and the workpiece what they are.
    if case.filament.waviness_amplitude_m == 0.0:
        del entry["filament"]["waviness_length_m"], entry["filament"]["waviness_phase_rad"]
    for key in UNUSED[case.workpiece.kind]:
        del entry["workpiece"][key]
    entry["start_angle_rad"], entry["end_s"] = case.start_angle_rad, case.end_s
    entry |= values
    entry["own_error"] = float(f"{difference(case, values, others):.1g}")
    return {key: rounded(value) for key, value in entry.items()}


def cases() -> list[Case]:
    """The cases of the file."""
    leaving, shifted = Workpiece("edge"), Workpiece("edge", offset_m=3e-3)
    entering = Workpiece("edge", offset_m=-3e-3, side="entering")
    cylinder, bore = Workpiece("cylinder", radius_m=0.05), Workpiece("bore", radius_m=0.30)
    plane, coarse = Workpiece("plane"), Filament(10)
    # First those that take longest.
    found = [*shown().values(), Case("plane", Filament(25), plane, 10.0, 1e-3)]
    for turns in (2, 4):
        found.append(Case(f"{turns} turns", coarse, plane, 30.0, 1e-3, turns=turns))
    found.append(Case("2 turns, leaving", coarse, leaving, 20.0, 1e-3, 0.3, 2))
    for name, piece in (
        ("leaving", leaving),
        ("leaving, 3 mm", shifted),
        ("entering, -3 mm", entering),
        ("cylinder", cylinder),
        ("bore", bore),
    ):
        for velocity in (5.0, 10.0, 20.0):
            for depth in (1e-3, 2e-3):
                for friction in (0.0, 0.3):
                    found.append(Case(name, coarse, piece, velocity, depth, friction))
    for angle_deg in (60, 120):
        for side, offset in (("leaving", 2e-3), ("entering", -4e-3)):
            piece = Workpiece("edge", offset, math.radians(angle_deg), 0.5e-3, side)
            for friction in (0.0, 0.3):
                name = f"{side}, {angle_deg} degrees"
                found.append(Case(name, coarse, piece, 10.0, 1.5e-3, friction))
    wavy = Filament(10, waviness_amplitude_m=0.5e-3, waviness_phase_rad=0.3)
    tapered = Filament(10, tip_diameter_m=0.6e-3)
    for friction in (0.0, 0.3):
        found.append(Case("wavy", wavy, plane, 10.0, 1e-3, friction))
        found.append(Case("tapered", tapered, plane, 10.0, 1e-3, friction))
    both = replace(tapered, waviness_amplitude_m=0.5e-3, waviness_phase_rad=0.3)
    found.append(Case("wavy and tapered, leaving", both, leaving, 10.0, 1e-3, 0.3))
    return found


def shown() -> dict[str, Case]:
    """The cases whose trajectories are written, and the names of their files."""
    leaving, entering = Workpiece("edge"), Workpiece("edge", offset_m=-3e-3, side="entering")
    return {
        "edge_leaving_cvodes.csv": Case("leaving", Filament(25), leaving, 10.0, 1e-3, 0.3),
        "edge_entering_cvodes.csv": Case("entering", Filament(25), entering, 10.0, 2e-3),
    }


def tip_deflection_m(case: Case, time: float, tip: np.ndarray) -> float:
    """Distance from the tip to the undeformed filament, the straight piece from the root."""
    body_angle = case.start_angle_rad + case.rate_rad_s * time
    direction = np.array([math.cos(body_angle), math.sin(body_angle)])
    offset = tip - BODY_RADIUS_M * direction
    along = min(max(float(offset @ direction), 0.0), LENGTH_M)
    return float(np.linalg.norm(offset - along * direction))


def trajectory(case: Case, relative_tolerance: float) -> np.ndarray:
    """Rows of COLUMNS."""
    motion, rows = Motion(case, relative_tolerance), []
    times = np.linspace(0.0, case.end_s, ROWS)
    for window in motion.windows():
        while len(rows) < ROWS and times[len(rows)] <= window.times[-1]:
            time = times[len(rows)]
            i = int(np.searchsorted(window.times, time, side="right")) - 1
            i = min(max(i, 0), len(window.times) - 2)
            state = motion.between(window, i)(time - window.times[i])
            impulse = state[-len(INTEGRALS)] * INTEGRAL_UNIT
            observed = motion.observed(time, state, window.parameters)
            tip = observed[4:6]
            deflection = tip_deflection_m(case, time, tip)
            rows.append([time, *observed[:4], impulse, *tip, deflection])
    return np.array(rows)


def trajectory_text(case: Case) -> str:
    """The file of a trajectory."""
    table, looser = trajectory(case, TOLERANCE), trajectory(case, LOOSER)
    largest = np.max(np.abs(table - looser), axis=0)[1:]
    errors = ", ".join(
        f"{name} {error:.1g}" for name, error in zip(COLUMNS[1:], largest, strict=True)
    )
    piece = case.workpiece
    lines = [
        f"# {command()}",
        f"# A pass of the paper's case over an edge: {case.filament.segments} segments, brushing "
        f"velocity {case.brushing_velocity_m_s:g} m/s, penetration depth "
        f"{case.penetration_depth_m:g} m, coefficient of friction {case.friction_coefficient:g}, "
        f"{piece.side} side, offset {piece.offset_m:g} m, edge radius {piece.edge_radius_m:g} m.",
        f"# Own error, largest difference to relative tolerance {LOOSER:g}: {errors}.",
        ",".join(COLUMNS),
    ]
    lines += [",".join(f"{rounded(float(value)):.12g}" for value in row) for row in table]
    return "\n".join(lines) + "\n"


def command() -> str:
    """How the files were made."""
    return (
        f"python derivations/reference_edges.py (Python {platform.python_version()}, "
        f"casadi {casadi.__version__}, numpy {np.__version__}, scipy {scipy.__version__}): "
        f"CVODES, relative tolerance {TOLERANCE:g}, absolute {ABSOLUTE_TOLERANCE * TOLERANCE:g} "
        f"of 1 rad, {RATE_UNIT_RAD_S:g} rad/s, {INTEGRAL_UNIT:g} N s"
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Write passes over edges, curves and turns.")
    parser.add_argument("--processes", type=int, default=1, help="cases computed at the same time")
    parser.add_argument("--output", type=Path, default=DEFAULT_OUTPUT, help="JSON file to write")
    parser.add_argument(
        "--trajectories", type=Path, default=TRAJECTORIES, help="directory of the trajectories"
    )
    arguments = parser.parse_args()
    with multiprocessing.Pool(arguments.processes) as pool:
        entries = pool.map(result, cases(), chunksize=1)
        texts = pool.map(trajectory_text, shown().values(), chunksize=1)
    lines = ",\n".join(json.dumps(entry) for entry in entries)
    arguments.output.write_text(
        f'{{"made_by": {json.dumps(command())},\n"cases": [\n{lines}\n]}}\n',
        encoding="utf-8",
        newline="\n",
    )
    for name, text in zip(shown(), texts, strict=True):
        (arguments.trajectories / name).write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
