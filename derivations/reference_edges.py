"""Passes over edges, curves and turns, by a planar code that shares nothing with the Rust code.

What enters: nothing; the cases are those of `cases()` below.
What leaves: a JSON file with the metrics of all cases, and two trajectories.

How it is done:

1. The filament stays in the plane of rotation, so one azimuth θ_k a segment describes it. The chain
   is that of `cvodes.py`, whose segments may differ and whose joints may be relaxed at an angle;
   the contacts are stated here.
2. Faces press on the nodes, each arc with an edge's radius on the point of the polyline nearest to
   its centre, as MODEL.md says. Which node meets which face, and whether the nearest point lies
   inside a segment or on a node, is the *touch* of a state. The equations take the touch as
   parameters and are smooth while it does not change.
3. CVODES integrates windows with a constant touch (`cvodes.py`). The touch of the motion is searched
   about every microsecond. Nothing is smoothed but friction, as MODEL.md says.
4. The integrals of the metrics are states of the solver; contact times are sums of windows.

Each case is computed at two tolerances; the file gives the larger difference of its impulse and
friction work as its own error.

SI units, angles in radians: z along the tool axis, y normal to the plane y = 0 of the workpiece,
which lies at −(R − a_e); the body angle is β = β_0 + ω t.

Run from the repository root:

    python derivations/reference_edges.py
"""

import math
from dataclasses import asdict, dataclass, replace
from functools import cache

import casadi
import cvodes
import numpy as np
from cases import (
    BODY_RADIUS_M,
    CONTACT_STIFFNESS_N_M,
    DAMPING_RATIO,
    DATA,
    DENSITY_KG_M3,
    DIAMETER_M,
    LEAST_VALUE,
    LENGTH_M,
    REGULARISATION_M_S,
    TOOL_RADIUS_M,
    YOUNGS_MODULUS_PA,
    Passing,
    entries_of,
    parser_of,
    rounded,
    write_cases,
    write_trajectories,
)
from cvodes import INTEGRAL_UNIT, RATE_UNIT_RAD_S, Window, planar_chain, velocity_of
from numpy.polynomial import Legendre, Polynomial

INTEGRALS = (
    "contact_normal_impulse_n_s",
    "contact_impulse_x_n_s",
    "contact_impulse_y_n_s",
    "edge_contact_normal_impulse_n_s",
    "friction_work_j",
    "contact_angular_impulse_n_m_s",
)
TOLERANCE, LOOSER = 1e-10, 1e-9
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
OF_CHAMFER = ("chamfer_width_m", "chamfer_angle_rad")
OF_EDGE = ("included_angle_rad", "edge_radius_m", "side")
UNUSED = {
    "plane": ("offset_m", *OF_EDGE, *OF_CHAMFER, "radius_m"),
    "edge": ("radius_m", *OF_CHAMFER),
    "chamfer": ("radius_m",),
    "cylinder": (*OF_EDGE, *OF_CHAMFER),
    "bore": (*OF_EDGE, *OF_CHAMFER),
}
# A convex arc with a radius of at least so many segments is a face.
SEGMENTS_OF_FACE = 5


@dataclass(frozen=True)
class Filament:
    """A filament of the paper's length; straight and uniform unless told."""

    segments: int
    tip_diameter_m: float = DIAMETER_M
    waviness_amplitude_m: float = 0.0
    waviness_length_m: float = 0.020
    waviness_phase_rad: float = 0.0
    youngs_modulus_pa: float = YOUNGS_MODULUS_PA
    damping_ratio: float = DAMPING_RATIO

    def diameter_m(self, arc_length: float) -> float:
        """Linear from the root to the tip."""
        return DIAMETER_M + (self.tip_diameter_m - DIAMETER_M) * arc_length / LENGTH_M

    def bending_stiffness(self, arc_length: float) -> float:
        """E I in N m²."""
        return self.youngs_modulus_pa * math.pi * self.diameter_m(arc_length) ** 4 / 64

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
    """A plane, an edge, a chamfer, a cylinder or a bore, as MODEL.md places it."""

    kind: str
    offset_m: float = 0.0
    included_angle_rad: float = math.pi / 2
    edge_radius_m: float = 0.2e-3
    side: str = "leaving"
    radius_m: float = 0.0
    chamfer_width_m: float = 0.0
    chamfer_angle_rad: float = math.pi / 4


@dataclass(frozen=True)
class Case(Passing):
    """A pass, or several turns; v_b in m/s, a_e in m."""

    name: str
    filament: Filament
    workpiece: Workpiece
    brushing_velocity_m_s: float
    penetration_depth_m: float
    friction_coefficient: float = 0.0
    turns: int = 1

    @property
    def half_angle_rad(self) -> float:
        """Half of the angle over which the undeformed tip is below y = 0 or in the bore's material.

        All other workpieces lie below y = 0, so the undeformed filament touches none before.
        """
        if self.workpiece.kind != "bore":
            return super().half_angle_rad
        radius = self.workpiece.radius_m
        centre = self.height_m + radius
        sine = (TOOL_RADIUS_M**2 + centre**2 - radius**2) / (2 * TOOL_RADIUS_M * centre)
        return math.pi / 2 + math.asin(sine)

    @property
    def ends_of_turns_s(self) -> list[float]:
        """Several turns are whole."""
        if self.turns == 1:
            return super().ends_of_turns_s
        return [turn * (2 * math.pi / self.rate_rad_s) for turn in range(1, self.turns + 1)]

    @property
    def end_s(self) -> float:
        """The tail angle past the last touch of a single turn."""
        return super().end_s if self.turns == 1 else self.ends_of_turns_s[-1]


class Profile:
    """The workpiece of a case in the frame of the tool: its faces and its arcs.

    Faces are straight, or a single circle. An arc has the radius of an edge.
    """

    def __init__(self, case: Case) -> None:
        piece = case.workpiece
        self.origin = np.array([piece.offset_m, case.height_m])
        self.radius = piece.edge_radius_m
        # Of circles the filament is outside a cylinder and inside a bore.
        self.circle_sign = -1.0 if piece.kind == "bore" else 1.0
        self.circle_radius = piece.radius_m
        self.circle_centre = self.origin - [0.0, self.circle_sign * piece.radius_m]
        is_circle = piece.kind in ("cylinder", "bore")
        is_edge = piece.radius_m < SEGMENTS_OF_FACE * LENGTH_M / case.filament.segments
        self.circle = is_circle and not (piece.kind == "cylinder" and is_edge)
        # Of every face its outward normal, its distance from the axis along it, and its direction,
        # along which it reaches from one place to another. Of every arc its centre, and the
        # directions along which the faces next to it go away from it.
        self.normals, self.distances = np.array([[0.0, 1.0]]), np.array([case.height_m])
        self.directions, self.reaches = np.array([[1.0, 0.0]]), np.array([[-np.inf, np.inf]])
        self.centres, self.tangents = np.zeros((0, 2)), np.zeros((0, 2, 2))
        if piece.kind in ("edge", "chamfer"):
            self._set_corners(piece)
        elif is_circle and not self.circle:
            # An arc all round, and no face.
            self.reaches = np.array([[np.inf, -np.inf]])
            self.radius, self.centres = piece.radius_m, self.circle_centre[None]

    def _set_corners(self, piece: Workpiece) -> None:
        """The faces between the corners of an edge or a chamfer, and the arcs that round those."""
        # By how much each face is inclined downwards, and where it meets the next.
        whole = math.pi - piece.included_angle_rad
        inclined, corners = [0.0, whole], [np.zeros(2)]
        if piece.kind == "chamfer":
            width, angle = piece.chamfer_width_m, piece.chamfer_angle_rad
            along = width * np.array([math.cos(angle), -math.sin(angle)])
            # The outer end of the chamfer lies on the second face, which goes through the origin.
            first = along[0] + along[1] / math.tan(whole)
            corners = [np.array([-first, 0.0]), along - [first, 0.0]]
            inclined = [0.0, angle, whole]
        mirror = np.array([-1.0 if piece.side == "entering" else 1.0, 1.0])
        self.directions = np.array([[math.cos(a), -math.sin(a)] for a in inclined]) * mirror
        self.normals = np.array([[math.sin(a), math.cos(a)] for a in inclined]) * mirror
        points = np.array(corners) * mirror + self.origin
        self.distances = np.sum(self.normals * points[[0, *range(len(points))]], axis=1)
        centres, tangents = [], []
        for i, point in enumerate(points):
            one, other = self.normals[i], self.normals[i + 1]
            centres.append(point - self.radius * (one + other) / (1 + one @ other))
            tangents.append([-self.directions[i], self.directions[i + 1]])
        self.centres, self.tangents = np.array(centres), np.array(tangents)
        # A face reaches from the foot of one arc's centre to that of the next.
        feet = np.einsum("ik,jk->ij", self.directions, self.centres)
        count = len(points)
        self.reaches = np.array(
            [
                [feet[i, i - 1] if i > 0 else -np.inf, feet[i, i] if i < count else np.inf]
                for i in range(count + 1)
            ]
        )

    @property
    def arc_count(self) -> int:
        """Number of arcs."""
        return len(self.centres)

    def faces_of(self, nodes: np.ndarray) -> np.ndarray:
        """For nodes (…, 2): 0 in the air or on an arc, else the number of the face they penetrate."""
        if self.circle:
            distances = np.linalg.norm(nodes - self.circle_centre, axis=-1)
            return (self.circle_sign * (distances - self.circle_radius) < 0.0).astype(int)
        depths = self.distances - nodes @ self.normals.T
        along = nodes @ self.directions.T
        is_in = np.all(depths > 0.0, axis=-1, keepdims=True)
        is_in = is_in & (along >= self.reaches[:, 0]) & (along <= self.reaches[:, 1])
        nearest = np.argmin(np.where(is_in, depths, np.inf), axis=-1)
        return np.where(np.any(is_in, axis=-1), 1 + nearest, 0)

    def nearest(self, nodes: np.ndarray, arc: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What of polylines (…, n + 1, 2) is nearest to the centre of an arc.

        That is a feature, 2 k at node k and 2 k − 1 inside segment k; its nearest point; and the
        distance of that.
        """
        centre = self.centres[arc]
        inner, pieces = nodes[..., :-1, :], np.diff(nodes, axis=-2)
        places = np.sum((centre - inner) * pieces, axis=-1) / np.sum(pieces**2, axis=-1)
        points = inner + np.clip(places, 0.0, 1.0)[..., None] * pieces
        distances = np.linalg.norm(points - centre, axis=-1)
        nearest = np.argmin(distances, axis=-1)[..., None]
        place = np.take_along_axis(places, nearest, axis=-1)[..., 0]
        feature = 2 * nearest[..., 0] + np.where(place <= 0.0, 0, np.where(place >= 1.0, 2, 1))
        point = np.take_along_axis(points, nearest[..., None], axis=-2)[..., 0, :]
        return feature, point, np.take_along_axis(distances, nearest, axis=-1)[..., 0]

    def features_of(self, nodes: np.ndarray) -> np.ndarray:
        """Of polylines (…, n + 1, 2) and every arc the nearest feature if it touches, else 0."""
        found = np.zeros((*nodes.shape[:-2], self.arc_count), dtype=int)
        for arc in range(self.arc_count):
            feature, point, distance = self.nearest(nodes, arc)
            along = (point - self.centres[arc]) @ self.tangents[arc].T if len(self.tangents) else 0.0
            touches = (distance < self.radius) & np.all(np.atleast_1d(along) <= 0.0, axis=-1)
            found[..., arc] = np.where(touches, feature, 0)
        return found


class Equations(cvodes.Equations):
    """The equations of motion of a filament, as functions of CasADi of (t, y, p).

    y is (θ_1 … θ_n, θ̇_1 … θ̇_n, the integrals). The parameters p are those of the case and of its
    touch.
    """

    def __init__(self, filament: Filament, circle: bool, arc_count: int) -> None:
        self.filament, self.circle, self.arc_count = filament, circle, arc_count
        n = filament.segments
        time = casadi.SX.sym("t")
        angles, rates = casadi.SX.sym("theta", n), casadi.SX.sym("theta_rate", n)
        # Start angle, rate, friction.
        case = casadi.SX.sym("case", 3)
        touch = self._touch_symbols()
        parameters = casadi.vertcat(case, *map(casadi.vec, touch))

        h = LENGTH_M / n
        kinetic, springs, dissipation, nodes = planar_chain(
            (time, angles, rates),
            (case[0] + case[1] * time, case[1]),
            [filament.mass_per_length((k + 0.5) * h) * h for k in range(n)],
            # The clamp joint carries only half a segment's compliance.
            [2 * filament.bending_stiffness(h / 4) / h]
            + [filament.bending_stiffness(k * h) / h for k in range(1, n)],
            2 * filament.damping_ratio / filament.first_frequency(),
            filament.relaxed_angles(),
        )
        instant = [time, angles, rates]
        contact = self._contact(instant, case[2])
        self._add_contacts(contact, nodes, touch)
        energies = kinetic, kinetic - springs, dissipation
        self.derive(instant, parameters, energies, [contact.torques], contact.integrands)
        tip = nodes[:, n]
        observed = casadi.vertcat(contact.forces, tip, velocity_of(tip, instant))
        self.observed = casadi.Function("observed", [*instant, parameters], [observed])

    def _contact(self, instant: list[casadi.SX], friction: casadi.SX) -> "Contact":
        """What sums over the contacts."""
        return Contact(instant, friction)

    def _touch_symbols(self) -> tuple[casadi.SX, ...]:
        """What the contacts depend on besides the motion, in the order of the parameters."""
        n = self.filament.segments
        # Centre, radius and sign of the circle.
        circle = casadi.SX.sym("circle", 4)
        # Of each node: 1 if it touches its face, and the face's normal and distance.
        faces = casadi.SX.sym("faces", n, 4)
        # Of each arc: its centre and radius; whether anything touches it, and whether its outer
        # node; 1 at the segment that does.
        arcs = casadi.SX.sym("arcs", 5 + n, self.arc_count)
        return circle, faces, arcs

    def _add_contacts(
        self, contact: "Contact", nodes: casadi.SX, touch: tuple[casadi.SX, ...]
    ) -> None:
        circle, faces, arcs = touch
        for k in range(self.filament.segments):
            node, normal = nodes[:, k + 1], faces[k, 1:3].T
            gap = casadi.dot(node, normal) - faces[k, 3]
            if self.circle:
                centre, radius, sign = circle[:2], circle[2], circle[3]
                distance = casadi.norm_2(node - centre)
                gap, normal = sign * (distance - radius), sign * (node - centre) / distance
            contact.add(node, gap, normal, faces[k, 0])
        for i in range(self.arc_count):
            centre, radius, touches, at_node = arcs[:2, i], arcs[2, i], arcs[3, i], arcs[4, i]
            at_segment = arcs[5:, i]
            inner, outer = nodes[:, :-1] @ at_segment, nodes[:, 1:] @ at_segment
            along = outer - inner
            nearest = casadi.dot(centre - inner, along) / casadi.sumsqr(along)
            # Segments have the length h; where no segment is chosen there is nothing to divide.
            nearest = casadi.if_else(touches > 0, nearest, 0.5)
            here = at_node + (1 - at_node) * nearest
            place = casadi.SX.sym("place")
            offset = inner + place * along - centre
            distance = casadi.norm_2(offset)
            normal = casadi.if_else(touches > 0, offset / distance, 0)
            material = inner + place * along
            contact.add_on_edge(material, distance - radius, normal, touches, place, here)


class Contact:
    """The sums over all contacts: generalised forces, rates of the integrals, and forces.

    The forces are F_n, its part on edges, F_x and F_y.
    """

    def __init__(self, instant: list[casadi.SX], friction: casadi.SX) -> None:
        self._instant, self._friction = instant, friction
        self.torques = casadi.SX.zeros(instant[1].numel())
        self._total, self._on_edges, self._work, self._angular = 0, 0, 0, 0
        self._force = casadi.SX.zeros(2)

    def _pressed(
        self, point: casadi.SX, gap: casadi.SX, normal: casadi.SX, touches: casadi.SX
    ) -> list[casadi.SX]:
        """F_n, the force on the filament, the power that friction takes, torques and moment."""
        velocity = velocity_of(point, self._instant)
        sliding = velocity - casadi.dot(velocity, normal) * normal
        speed = casadi.sqrt(casadi.sumsqr(sliding) + REGULARISATION_M_S**2)
        pressure = -touches * CONTACT_STIFFNESS_N_M * gap
        rubbing = -self._friction * pressure / speed * sliding
        force = pressure * normal + rubbing
        torques = casadi.jtimes(point, self._instant[1], force, True)
        moment = point[0] * force[1] - point[1] * force[0]
        return [pressure, force, -casadi.dot(rubbing, sliding), torques, moment]

    def _sum(self, pressed: list[casadi.SX], is_edge: bool) -> None:
        pressure, force, taken, torques, moment = pressed
        self.torques += torques
        self._total, self._force = self._total + pressure, self._force + force
        self._work, self._angular = self._work + taken, self._angular + moment
        self._on_edges += pressure if is_edge else 0

    def add(
        self,
        point: casadi.SX,
        gap: casadi.SX,
        normal: casadi.SX,
        touches: casadi.SX,
        is_edge: bool = False,
    ) -> None:
        """A node."""
        self._sum(self._pressed(point, gap, normal, touches), is_edge)

    def add_on_edge(
        self,
        material: casadi.SX,
        gap: casadi.SX,
        normal: casadi.SX,
        touches: casadi.SX,
        place: casadi.SX,
        here: casadi.SX,
    ) -> None:
        """A point of the filament's material, at a place of its segment, on an edge.

        The place is a symbol, whose value is `here`: the nearest point moves along the material.
        """
        pressed = self._pressed(material, gap, normal, touches)
        self._sum(casadi.substitute(pressed, [place], [here]), is_edge=True)

    @property
    def integrands(self) -> casadi.SX:
        """Rates of INTEGRALS."""
        return casadi.vertcat(
            self._total, self._force, self._on_edges, self._work, self._angular
        )

    @property
    def forces(self) -> casadi.SX:
        """F_n, its part on edges, F_x, F_y."""
        return casadi.vertcat(self._total, self._on_edges, self._force)


# Once for all cases that share them.
equations = cache(Equations)


class Motion(cvodes.Motion):
    """A pass, whose touch has of every node the face, and of every arc the feature (see `Profile`)."""

    longest_window_s = shortest_window_s = 4e-4
    integral_names = INTEGRALS

    def __init__(self, case: Case, relative_tolerance: float) -> None:
        self._n = case.filament.segments
        self.profile, equations = self._profile_and_equations(case)
        super().__init__(case, equations, relative_tolerance)

    def start(self) -> np.ndarray:
        """The relaxed shape, turning rigidly with the body."""
        angles = self.case.start_angle_rad + self.case.filament.relaxed_angles()
        rates = np.full(self._n, self.case.rate_rad_s / RATE_UNIT_RAD_S)
        return np.concatenate([angles, rates, np.zeros(self.equations.integral_count)])

    @staticmethod
    def _profile_and_equations(case: Case) -> tuple[Profile, Equations]:
        profile = Profile(case)
        return profile, equations(case.filament, profile.circle, profile.arc_count)

    def parameters(self, touch: np.ndarray) -> np.ndarray:
        """The touch as the equations take it, after what is constant in the case."""
        case = self.case
        of_case = [case.start_angle_rad, case.rate_rad_s, case.friction_coefficient]
        return np.concatenate([of_case, *self._of_touch(touch)])

    def _of_touch(self, touch: np.ndarray) -> list[np.ndarray]:
        """The parameters of the contacts, as the equations take them."""
        n, profile = self._n, self.profile
        circle = np.array([*profile.circle_centre, profile.circle_radius, profile.circle_sign])
        faces, arcs = np.zeros((n, 4)), np.zeros((5 + n, profile.arc_count))
        for node, face in enumerate(touch[:n]):
            # A node in the air has a face too, for a finite expression, which counts zero times.
            at = max(face, 1) - 1
            faces[node] = [float(face > 0), *profile.normals[at], profile.distances[at]]
        for arc, feature in enumerate(touch[n:]):
            arcs[:3, arc] = [*profile.centres[arc], profile.radius]
            if feature > 0:
                arcs[3:5, arc] = 1.0, float(feature % 2 == 0)
                arcs[5 + (feature - 1) // 2, arc] = 1.0
        return [circle, faces.ravel("F"), arcs.ravel("F")]

    def polylines(self, times: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Positions (times, nodes, 2), for angles as columns."""
        body = self.case.start_angle_rad + self.case.rate_rad_s * times
        steps = np.stack([np.cos(angles), np.sin(angles)], axis=-1) * (LENGTH_M / self._n)
        root = BODY_RADIUS_M * np.stack([np.cos(body), np.sin(body)], axis=-1)
        return np.cumsum(np.concatenate([root[None], steps]), axis=0).transpose(1, 0, 2)

    def touches(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Rows (faces of the nodes, features at the arcs), one per time."""
        lines = self.polylines(times, states[: self._n])
        faces = self.profile.faces_of(lines[:, 1:])
        return np.column_stack([faces, self.profile.features_of(lines)])

    def depth_at_edges_m(self, window: Window) -> float:
        """Largest penetration of an edge in a window."""
        lines = self.polylines(window.times, window.states[: self._n])
        touched = np.flatnonzero(window.touch[self._n :])
        distances = [np.min(self.profile.nearest(lines, arc)[2]) for arc in touched]
        return self.profile.radius - float(min(distances, default=self.profile.radius))


def metrics(motion: Motion) -> dict[str, object]:
    """What the file says about a case, from a run at one tolerance."""
    contact_time, turns, deepest, n = 0.0, [], 0.0, motion.case.filament.segments
    faces: set[int] = set()
    before = np.zeros(motion.equations.integral_count)
    for window in motion.windows():
        if np.any(window.touch):
            contact_time += window.times[-1] - window.times[0]
            faces |= set(window.touch[:n].tolist()) - {0}
        if np.any(window.touch[n:]):
            deepest = max(deepest, motion.depth_at_edges_m(window))
        last, end = window, motion.integrals(window, -1)
        if window.ends_turn:
            of_turn, of_time = end - before, contact_time
            turns.append(of_turn[0])
            before, contact_time = end, 0.0
    tip = motion.observed(last.times[-1], last.states[:, -1], last.parameters)[0][4:]
    return {
        "contact_time_s": of_time,
        **dict(zip(motion.integral_names, of_turn, strict=True)),
        "turn_contact_normal_impulses_n_s": turns,
        "final_tip_m": tip[:2],
        "final_tip_velocity_m_s": tip[2:],
        "touches_at_end": bool(np.any(last.touch)),
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


def result(case: Case) -> dict[str, object]:
    """The entry of a case in the file."""
    values, others = (metrics(Motion(case, tolerance)) for tolerance in (TOLERANCE, LOOSER))
    return entry_of(case, values, others)


def entry_of(case: Case, values: dict[str, object], others: dict[str, object]) -> dict[str, object]:
    """The entry of a case with the metrics of two runs."""
    entry = asdict(case)
    # Those of the paper.
    del entry["filament"]["youngs_modulus_pa"], entry["filament"]["damping_ratio"]
    # Only what makes the filament and the workpiece what they are.
    if case.filament.waviness_amplitude_m == 0.0:
        del entry["filament"]["waviness_length_m"], entry["filament"]["waviness_phase_rad"]
    for key in UNUSED[case.workpiece.kind]:
        del entry["workpiece"][key]
    entry |= rounded({"start_angle_rad": case.start_angle_rad, "end_s": case.end_s} | values)
    return entry | {"own_error": float(f"{difference(case, values, others):.1g}")}


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
    for time, state, window in motion.sampled():
        impulse = state[-len(INTEGRALS)] * INTEGRAL_UNIT
        observed = motion.observed(time, state, window.parameters)[0]
        tip = observed[4:6]
        deflection = tip_deflection_m(case, time, tip)
        rows.append([time, *observed[:4], impulse, *tip, deflection])
    return np.array(rows)


def trajectory_text(case: Case) -> str:
    """The file of a trajectory."""
    table, looser = trajectory(case, TOLERANCE), trajectory(case, LOOSER)
    errors, piece = cvodes.differences(COLUMNS, table, looser), case.workpiece
    comments = [
        cvodes.command("reference_edges.py", TOLERANCE),
        f"A pass of the paper's case over an edge: {case.filament.segments} segments, brushing "
        f"velocity {case.brushing_velocity_m_s:g} m/s, penetration depth "
        f"{case.penetration_depth_m:g} m, coefficient of friction {case.friction_coefficient:g}, "
        f"{piece.side} side, offset {piece.offset_m:g} m, edge radius {piece.edge_radius_m:g} m.",
        f"Own error, largest difference to relative tolerance {LOOSER:g}: {errors}.",
    ]
    return cvodes.table_text(comments, COLUMNS, table, LEAST_VALUE)


def main() -> None:
    """Command line."""
    output = DATA / "reference_edges.json"
    arguments = parser_of("Write passes over edges, curves and turns.", output, True).parse_args()
    entries = entries_of(result, cases(), arguments)
    if arguments.only is not None:
        return
    write_cases(arguments.output, cvodes.command("reference_edges.py", TOLERANCE), entries)
    write_trajectories(trajectory_text, shown(), arguments)


if __name__ == "__main__":
    main()
