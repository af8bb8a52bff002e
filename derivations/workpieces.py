"""Contacts of filaments with workpieces: one face, faces with arcs between them, or a spline.

Each workpiece has what `passes.py` needs of it:

- `edge_count`, the number of edges;
- `symbols()`, the parameters of one filament's contacts, and `parameters(active)`, their values;
- `press(contact, nodes, time, symbols)`, which adds the contacts to the equations;
- `active_sets(lines, times)`, for polylines (…, n + 1, 3) the face of each node, and of each edge
  the feature of the polyline that meets it, with 0 for nothing;
- `edge_depths(lines)`, the penetrations of the edges.

Faces press on nodes. Edges press on one point of the polyline each, as MODEL.md says. Profiles lie
in the x-y plane and are extruded along z.
"""

import math
from itertools import pairwise

import casadi
import numpy as np
from cases import (
    EDGE_ANGLES,
    NORMAL,
    REGULARISATION_M_S,
    SEGMENTS_OF_FACE,
    SLIDING,
    Case,
    Workpiece,
)
from scipy.interpolate import BSpline, PPoly
from scipy.optimize import brentq
from scipy.spatial import cKDTree

# Added to speeds, so that one of zero has a derivative.
LEAST_SPEED_M_S = 1e-9
# Points of each piece of a spline among which the nearest is searched.
SAMPLES = 500
# Length of the straight lines beyond the ends of a spline, in m.
LINE_M = 1.0
# Iterations of Newton's method. It starts within a piece, and converges quadratically.
ITERATIONS = 8
# Factor of the feature in the number that meets a spline's edge: more than there are pieces.
MAX_PIECES = 100


def in_space(vector: casadi.SX) -> casadi.SX:
    """Returns a vector of the plane with its third component, 0."""
    return casadi.vertcat(vector, 0.0)


def at_node(segments: int, node: int) -> casadi.DM:
    """Returns the weights of all nodes in one of them."""
    return casadi.DM(casadi.Sparsity.unit(segments + 1, node), 1.0)


def on_segment(at_segment: casadi.SX, place: casadi.SX) -> casadi.SX:
    """Returns the weights of all nodes in a point of the segment at which `at_segment` is 1."""
    return casadi.vertcat(at_segment * (1 - place), 0) + casadi.vertcat(0, at_segment * place)


def crossed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Returns the cross product of vectors (…, 2)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def friction(coefficient: float, pressure: casadi.SX, sliding: casadi.SX) -> casadi.SX:
    """Returns Coulomb's friction, regularised."""
    speed = casadi.sqrt(casadi.sumsqr(sliding) + REGULARISATION_M_S**2)
    return -coefficient * pressure / speed * sliding


def tangential(velocity: casadi.SX, normal: casadi.SX) -> casadi.SX:
    """Returns the part of a velocity across a normal."""
    return velocity - casadi.dot(velocity, normal) * normal


class Contact:
    """Contacts of one filament with the workpiece: forces on its nodes, and rates of integrals.

    Nodes and their velocities are columns. Angular impulses are those about the tool's axis.
    """

    def __init__(self, case: Case, nodes: casadi.SX, velocities: casadi.SX) -> None:
        self._case, self._nodes, self._velocities = case, nodes, velocities
        self._axis = casadi.DM(case.tool.pose[:, 2])
        self.on_nodes = casadi.SX.zeros(*nodes.shape)
        self.pressure, self.on_edges, self.force = 0, 0, casadi.SX.zeros(3)
        self._work, self._angular, self._sliding, self._angles = 0, 0, [0, 0], [0, 0]

    def press_node(
        self, node: int, gap: casadi.SX, normal: casadi.SX, active: casadi.SX
    ) -> None:
        """Adds a node on a face."""
        share = self._case.filament.contact_share(node)
        self.press(at_node(self._case.filament.segments, node), gap, normal, share * active)

    def press(
        self,
        weights: casadi.SX,
        gap: casadi.SX,
        normal: casadi.SX,
        active: casadi.SX,
        is_edge: bool = False,
        bisector: np.ndarray | None = None,
    ) -> None:
        """Adds a point, which is the mean of the nodes with these weights, if `active` is not zero.

        The angle of the normal from the bisector of the faces is positive towards the face that
        filaments meet last: clockwise, as the body turns counter-clockwise above the workpiece.
        """
        point, velocity = self._nodes @ weights, self._velocities @ weights
        pressure = -active * self._case.contact_stiffness_n_m * gap
        sliding = tangential(velocity, normal)
        rubbing = friction(self._case.friction_coefficient, pressure, sliding)
        force = pressure * normal + rubbing
        self.on_nodes += force @ weights.T
        self.pressure, self.force = self.pressure + pressure, self.force + force
        self._work -= casadi.dot(rubbing, sliding)
        self._angular += casadi.dot(self._axis, casadi.cross(point, force))
        power = pressure * casadi.sqrt(casadi.sumsqr(sliding) + LEAST_SPEED_M_S**2)
        self._sliding[0] += power
        if is_edge:
            self.on_edges += pressure
            self._sliding[1] += power
        if bisector is not None:
            x, y = bisector
            # The normal of an open contact has any direction.
            across = casadi.if_else(active > 0, y * normal[0] - x * normal[1], 0.0)
            along = casadi.if_else(active > 0, x * normal[0] + y * normal[1], 1.0)
            angle = casadi.atan2(across, along)
            self._angles[0] += power * angle
            self._angles[1] += power * angle**2

    def rates(self, names: tuple[str, ...]) -> casadi.SX:
        """Returns the rates of integrals; those of an edge's angle are its first two moments."""
        all_rates = {
            NORMAL: self.pressure,
            "edge_contact_normal_impulse_n_s": self.on_edges,
            **{f"contact_impulse_{axis}_n_s": self.force[i] for i, axis in enumerate("xyz")},
            "friction_work_j": self._work,
            "contact_angular_impulse_n_m_s": self._angular,
            **dict(zip((*SLIDING, *EDGE_ANGLES), (*self._sliding, *self._angles), strict=True)),
        }
        return casadi.vertcat(*(all_rates[name] for name in names))


class Face:
    """A plane, a cylinder that nodes meet, or a bore.

    The plane comes up within the first turn if the filament touches it all round.
    """

    edge_count = 0

    def __init__(self, case: Case) -> None:
        self._n = case.filament.segments
        time, point = casadi.SX.sym("t"), casadi.SX.sym("point", 3)
        if case.workpiece.kind == "plane":
            height = case.height_m
            if case.is_all_round:
                u = casadi.fmin(time / case.turn_s, 1)
                height += case.penetration_depth_m * (u**3 * (10 - 15 * u + 6 * u**2) - 1)
            gap, normal = point[1] - height, casadi.SX([0.0, 1.0, 0.0])
        else:
            # Filaments are outside a cylinder and inside a bore.
            sign = -1.0 if case.workpiece.kind == "bore" else 1.0
            radius = case.workpiece.radius_m
            offset = point[:2] - casadi.SX([case.workpiece.offset_m, case.height_m - sign * radius])
            distance = casadi.norm_2(offset)
            gap, normal = sign * (distance - radius), sign * in_space(offset / distance)
        self._gap = casadi.Function("gap", [time, point], [gap, normal])

    def symbols(self) -> list[casadi.SX]:
        """Returns 1 for each node that touches, else 0."""
        return [casadi.SX.sym("active", self._n)]

    def press(
        self, contact: Contact, nodes: casadi.SX, time: casadi.SX, symbols: list[casadi.SX]
    ) -> None:
        """Adds the nodes."""
        for k in range(self._n):
            gap, normal = self._gap(time, nodes[:, k + 1])
            contact.press_node(k + 1, gap, normal, symbols[0][k])

    def parameters(self, active: np.ndarray) -> np.ndarray:
        """Returns the active set in the form of the equations."""
        return active.astype(float)

    def active_sets(self, lines: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Returns 1 for each node in the material, else 0."""
        points = lines[:, 1:].reshape(-1, 3).T
        gaps = np.array(self._gap(np.repeat(times, self._n)[None], points)[0])
        return (gaps.reshape(-1, self._n) < 0.0).astype(int)


class FacesAndArcs:
    """Straight faces, and arcs with the radius of an edge between them; or an arc all round."""

    def __init__(self, case: Case) -> None:
        piece = case.workpiece
        self._n, self._h = case.filament.segments, case.filament.segment_m
        self._origin = np.array([piece.offset_m, case.height_m])
        self._radius = piece.edge_radius_m
        if piece.kind == "cylinder":
            # No face, and no ends of the arc.
            self._radius = piece.radius_m
            self._normals = self._directions = np.array([[0.0, 1.0]])
            self._distances, self._reaches = np.zeros(1), np.array([[np.inf, -np.inf]])
            self._centres = self._origin[None] - [0.0, piece.radius_m]
            self._tangents = np.zeros((1, 2, 2))
            self._bisectors = [None]
        else:
            self._set_corners(piece)
        self.edge_count = len(self._centres)

    def _set_corners(self, piece: Workpiece) -> None:
        """Sets the faces between the corners of an edge or a chamfer, and the arcs on the corners.

        A face has its outward normal, its distance from the tool's axis, its direction, and the two
        places along the direction between which it reaches. An arc has its centre, and the
        directions in which the adjacent faces go away from it.
        """
        # Downward inclination of each face, and its corner with the next.
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
        self._directions = np.array([[math.cos(a), -math.sin(a)] for a in inclined]) * mirror
        self._normals = np.array([[math.sin(a), math.cos(a)] for a in inclined]) * mirror
        points = np.array(corners) * mirror + self._origin
        self._distances = np.sum(self._normals * points[[0, *range(len(points))]], axis=1)
        ones, others = self._normals[:-1], self._normals[1:]
        products = np.sum(ones * others, axis=1, keepdims=True)
        self._centres = points - self._radius * (ones + others) / (1 + products)
        self._tangents = np.stack([-self._directions[:-1], self._directions[1:]], axis=1)
        # Each face goes away from the edge; the outward bisector is opposite to both.
        sums = -np.sum(self._tangents, axis=1)
        self._bisectors = list(sums / np.linalg.norm(sums, axis=1, keepdims=True))
        # A face reaches from the foot of one arc's centre to that of the next.
        feet, count = self._directions @ self._centres.T, len(points)
        starts = [-np.inf, *(feet[i + 1, i] for i in range(count))]
        ends = [*(feet[i, i] for i in range(count)), np.inf]
        self._reaches = np.column_stack([starts, ends])

    def symbols(self) -> list[casadi.SX]:
        """Returns the parameters of nodes and arcs, as columns.

        A node has 1 if it touches its face, and the face's normal and distance. An arc has 1 if it
        is touched, 1 if a node touches it, and 1 at the segment that does.
        """
        nodes = casadi.SX.sym("nodes", 4, self._n)
        return [nodes, casadi.SX.sym("arcs", 2 + self._n, self.edge_count)]

    def press(
        self, contact: Contact, nodes: casadi.SX, time: casadi.SX, symbols: list[casadi.SX]
    ) -> None:
        """Adds nodes on faces, and the nearest points on arcs."""
        of_nodes, of_arcs = symbols
        for k in range(self._n):
            normal = of_nodes[1:3, k]
            gap = casadi.dot(nodes[:2, k + 1], normal) - of_nodes[3, k]
            contact.press_node(k + 1, gap, in_space(normal), of_nodes[0, k])
        for i in range(self.edge_count):
            active, is_node, at_segment = of_arcs[0, i], of_arcs[1, i], of_arcs[2:, i]
            centre = casadi.SX(self._centres[i])
            inner, outer = nodes[:2, :-1] @ at_segment, nodes[:2, 1:] @ at_segment
            nearest = casadi.dot(centre - inner, outer - inner) / self._h**2
            weights = on_segment(at_segment, is_node + (1 - is_node) * nearest)
            offset = nodes[:2, :] @ weights - centre
            distance = casadi.norm_2(offset)
            gap, normal = distance - self._radius, in_space(offset / distance)
            contact.press(weights, gap, normal, active, True, self._bisectors[i])

    def parameters(self, active: np.ndarray) -> np.ndarray:
        """Returns the active set in the form of the equations."""
        nodes, arcs = np.zeros((4, self._n)), np.zeros((2 + self._n, self.edge_count))
        for node, face in enumerate(active[: self._n]):
            # A node in the air has a face too, for a finite expression with the weight zero.
            at = max(face, 1) - 1
            nodes[:, node] = [float(face > 0), *self._normals[at], self._distances[at]]
        for arc, feature in enumerate(active[self._n :]):
            if feature > 0:
                arcs[:2, arc] = 1.0, float(feature % 2 == 0)
                arcs[2 + (feature - 1) // 2, arc] = 1.0
        return np.concatenate([nodes.ravel("F"), arcs.ravel("F")])

    def _faces_of(self, nodes: np.ndarray) -> np.ndarray:
        """Returns for nodes (…, 2) the number of the face they penetrate, or 0."""
        depths = self._distances - nodes @ self._normals.T
        along = nodes @ self._directions.T
        is_in = np.all(depths > 0.0, axis=-1, keepdims=True)
        is_in = is_in & (along >= self._reaches[:, 0]) & (along <= self._reaches[:, 1])
        nearest = np.argmin(np.where(is_in, depths, np.inf), axis=-1)
        return np.where(np.any(is_in, axis=-1), 1 + nearest, 0)

    def active_sets(self, lines: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Returns the face of each node, and of each arc the feature: see `nearest_of`."""
        lines, found = lines[..., :2], [self._faces_of(lines[:, 1:, :2])]
        for arc in range(self.edge_count):
            feature, point, distance = nearest_of(lines, self._centres[arc])
            along = (point - self._centres[arc]) @ self._tangents[arc].T
            touches = (distance < self._radius) & np.all(along <= 0.0, axis=-1)
            found.append(np.where(touches, feature, 0)[:, None])
        return np.concatenate(found, axis=1)

    def edge_depths(self, lines: np.ndarray) -> np.ndarray:
        """Returns the penetrations of the arcs, which are circles here."""
        distances = [nearest_of(lines[..., :2], centre)[2] for centre in self._centres]
        return self._radius - np.stack(distances, axis=-1)


def nearest_of(lines: np.ndarray, point: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the feature of polylines (…, n + 1, d) that is nearest to points (…, d).

    A feature is 2 k at node k and 2 k − 1 inside segment k. The nearest point and its distance
    follow.
    """
    inner, pieces = lines[..., :-1, :], np.diff(lines, axis=-2)
    offsets = np.asarray(point)[..., None, :] - inner
    places = np.sum(offsets * pieces, axis=-1) / np.sum(pieces**2, axis=-1)
    clipped = np.clip(places, 0.0, 1.0)[..., None] * pieces
    distances = np.linalg.norm(offsets - clipped, axis=-1)
    nearest = np.argmin(distances, axis=-1)[..., None]
    place = np.take_along_axis(places, nearest, axis=-1)[..., 0]
    feature = 2 * nearest[..., 0] + np.where(place <= 0.0, 0, np.where(place >= 1.0, 2, 1))
    found = np.take_along_axis(inner + clipped, nearest[..., None], axis=-2)[..., 0, :]
    return feature, found, np.take_along_axis(distances, nearest, axis=-1)[..., 0]


class Spline:
    """A clamped B-spline with uniform knots, which goes on straight beyond its ends.

    The first and the last piece are these lines. Stretches that are convex with radii below five
    segments are edges. The filament meets each of them at the deepest point of its polyline: a
    node, or the point of a segment where it is parallel to the curve.
    """

    def __init__(self, case: Case) -> None:
        piece = case.workpiece
        points = np.array(piece.control_points_m) + [piece.offset_m, case.height_m]
        self._n, self._degree = case.filament.segments, piece.degree
        count = len(points) - piece.degree
        ends = np.zeros(piece.degree), np.full(piece.degree, count)
        spline = BSpline(
            np.concatenate([ends[0], np.arange(count + 1), ends[1]]), points, piece.degree
        )
        # Coefficients by power from the highest, piece and coordinate. Lines have their length as
        # parameter, so that Newton's method takes the same steps there.
        coefficients = np.zeros((piece.degree + 1, count + 2, 2))
        for power in range(piece.degree + 1):
            derivative = spline.derivative(power)(np.arange(count)) / math.factorial(power)
            coefficients[piece.degree - power, 1:-1] = derivative
        ends, tangents = spline([0.0, count]), spline.derivative()([0.0, count])
        tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
        coefficients[-2, [0, -1]] = tangents
        coefficients[-1, [0, -1]] = ends[0] - LINE_M * tangents[0], ends[1]
        self._knots = np.array([-LINE_M, *range(count + 1), count + LINE_M])
        curve = PPoly(coefficients, self._knots)
        self._coefficients = coefficients[::-1]
        self._curves = [curve, curve.derivative(), curve.derivative(2)]
        samples = [np.linspace(*ends, SAMPLES, False) for ends in pairwise(self._knots)]
        self._parameters = np.append(np.concatenate(samples), self._knots[-1])
        self._tree = cKDTree(curve(self._parameters))
        self._stretches = self._convex(1.0 / (SEGMENTS_OF_FACE * case.filament.segment_m))
        self.edge_count = len(self._stretches)

    def _pieces_of(self, parameters: np.ndarray) -> np.ndarray:
        """Returns the pieces with these parameters, counted from 0."""
        pieces = np.searchsorted(self._knots, parameters, side="right") - 1
        return np.clip(pieces, 0, len(self._knots) - 2)

    def _convex(self, limit: float) -> list[tuple[float, float]]:
        """Returns the parameters between which the curvature is above a limit, in 1/m."""

        def excess(parameters: np.ndarray) -> np.ndarray:
            first, second = self._curves[1](parameters), self._curves[2](parameters)
            return -crossed(first, second) / np.linalg.norm(first, axis=-1) ** 3 - limit

        above, cuts = excess(self._parameters) > 0.0, []
        for i in np.flatnonzero(above[1:] != above[:-1]):
            cuts.append(brentq(excess, *self._parameters[i : i + 2], xtol=1e-15))
        return list(zip(cuts[::2], cuts[1::2], strict=True))

    def symbols(self) -> list[casadi.SX]:
        """Returns the parameters of all nodes, and of the node and the segment at each edge.

        The columns have 1 for a contact, coefficients of the curve, and 1 at the segment.
        """
        rows = 1 + 2 * (self._degree + 1) + self._n
        return [casadi.SX.sym("contacts", rows, self._n + 2 * self.edge_count)]

    def _curve(self, polynomial: casadi.SX, place: casadi.SX) -> list[casadi.SX]:
        """Returns a curve and its first two derivatives, by Horner's rule."""
        coefficients = casadi.reshape(polynomial, self._degree + 1, 2)
        here = first = second = casadi.SX.zeros(2)
        for power in range(self._degree, -1, -1):
            second = second * place + 2 * first
            first = first * place + here
            here = here * place + coefficients[power, :].T
        return [here, first, second]

    @staticmethod
    def _gap(point: casadi.SX, here: casadi.SX, tangent: casadi.SX) -> tuple[casadi.SX, casadi.SX]:
        """Returns the gap of a point over its foot, and the normal there."""
        normal = casadi.vertcat(-tangent[1], tangent[0]) / casadi.norm_2(tangent)
        return casadi.dot(point - here, normal), in_space(normal)

    def _foot(self, point: casadi.SX, polynomial: casadi.SX) -> tuple[casadi.SX, casadi.SX]:
        """Returns the gap of a point, and the normal at its nearest point of the curve."""
        ends = [self._curve(polynomial, casadi.SX(place))[0] for place in (0.0, 1.0)]
        chord = ends[1] - ends[0]
        place = casadi.dot(point - ends[0], chord) / casadi.sumsqr(chord)
        for _ in range(ITERATIONS):
            here, first, second = self._curve(polynomial, place)
            bend = casadi.sumsqr(first) + casadi.dot(here - point, second)
            place -= casadi.dot(here - point, first) / bend
        return self._gap(point, *self._curve(polynomial, place)[:2])

    def press(
        self, contact: Contact, nodes: casadi.SX, time: casadi.SX, symbols: list[casadi.SX]
    ) -> None:
        """Adds nodes on faces, and nodes and points of segments on edges."""
        size, feet = 1 + 2 * (self._degree + 1), self._n + self.edge_count
        for i, column in enumerate(casadi.horzsplit(symbols[0])):
            active, polynomial, at_segment = casadi.vertsplit(column, [0, 1, size, size + self._n])
            if i < self._n:
                contact.press_node(i + 1, *self._foot(nodes[:2, i + 1], polynomial), active)
                continue
            if i < feet:
                weights = on_segment(at_segment, casadi.SX(1.0))
                gap, normal = self._foot(nodes[:2, :] @ weights, polynomial)
                contact.press(weights, gap, normal, active, True)
                continue
            inner, outer = nodes[:2, :-1] @ at_segment, nodes[:2, 1:] @ at_segment
            # Without a chosen segment, any direction gives finite numbers.
            along = outer - inner + (1 - active) * casadi.SX([1.0, 0.0])
            where = casadi.SX(0.5)
            for _ in range(ITERATIONS):
                _, first, second = self._curve(polynomial, where)
                slope = first[0] * along[1] - first[1] * along[0]
                where -= slope / (second[0] * along[1] - second[1] * along[0])
            here, first, _ = self._curve(polynomial, where)
            place = casadi.dot(here - inner, along) / casadi.sumsqr(along)
            gap, normal = self._gap(inner + place * along, here, first)
            contact.press(on_segment(at_segment, place), gap, normal, active, True)

    def parameters(self, active: np.ndarray) -> np.ndarray:
        """Returns the active set in the form of the equations."""
        n, size = self._n, 1 + 2 * (self._degree + 1)
        found = np.zeros((size + n, n + 2 * self.edge_count))
        # Open contacts get curves that make finite numbers: a line, and a parabola.
        found[2] = 1.0
        found[2 + self._degree + 2, n + self.edge_count :] = 1.0
        for node in np.flatnonzero(active[:n]):
            found[:size, node] = [1.0, *self._coefficients[:, active[node] - 1].ravel("F")]
        for edge in np.flatnonzero(active[n:]):
            feature, piece = divmod(active[n + edge], MAX_PIECES)
            column = found[:, n + edge + (feature % 2) * self.edge_count]
            column[:size] = [1.0, *self._coefficients[:, piece].ravel("F")]
            column[size + (feature - 1) // 2] = 1.0
        return found.ravel("F")

    def _feet(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the gaps of points (…, 2), and the parameters of their feet."""
        parameters = self._parameters[self._tree.query(points)[1]]
        for _ in range(ITERATIONS):
            here, first, second = (curve(parameters) for curve in self._curves)
            slopes = np.sum((here - points) * first, axis=-1)
            bends = np.sum(first**2 + (here - points) * second, axis=-1)
            # Newton's method may diverge far from the profile; those points do not touch.
            steps = np.clip(slopes / np.where(bends > 0.0, bends, np.inf), -0.1, 0.1)
            parameters = np.clip(parameters - steps, self._knots[0], self._knots[-1])
        return self._gaps(points, parameters), parameters

    def _gaps(self, points: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Returns the gaps of points over the curve at parameters."""
        tangents = self._curves[1](parameters)
        offsets = points - self._curves[0](parameters)
        return crossed(tangents, offsets) / np.linalg.norm(tangents, axis=-1)

    def _deepest(self, lines: np.ndarray, stretch: int) -> tuple[np.ndarray, np.ndarray]:
        """Returns the gap of the deepest feature of polylines (…, n + 1, 2) in a stretch.

        A number follows: MAX_PIECES times the feature, as in `nearest_of`, and the piece of the
        curve.
        """
        start, end = self._stretches[stretch]
        node_gaps, parameters = self._feet(lines)
        node_gaps = np.where((parameters >= start) & (parameters <= end), node_gaps, np.inf)
        # Inside a segment, the curve is parallel to it.
        inner, along = lines[..., :-1, :], np.diff(lines, axis=-2)
        samples = np.linspace(start, end, SAMPLES)
        slopes = self._curves[1](samples)
        angles = np.unwrap(np.arctan2(slopes[:, 1], slopes[:, 0]))[::-1]
        towards = np.arctan2(along[..., 1], along[..., 0])
        towards += np.pi * np.ceil((angles[0] - towards) / np.pi)
        is_parallel = towards <= angles[-1]
        places = np.interp(towards, angles, samples[::-1])
        for _ in range(ITERATIONS):
            slope = crossed(self._curves[1](places), along)
            bend = crossed(self._curves[2](places), along)
            places = np.clip(places - slope / np.where(is_parallel, bend, np.inf), start, end)
        offsets = self._curves[0](places) - inner
        shares = np.sum(offsets * along, axis=-1) / np.sum(along**2, axis=-1)
        gaps = self._gaps(inner + shares[..., None] * along, places)
        gaps = np.where(is_parallel & (shares > 0.0) & (shares < 1.0), gaps, np.inf)
        # Nodes and segments in turn, from node 0.
        all_gaps, all_places = np.empty((2, *lines.shape[:-2], 2 * lines.shape[-2] - 1))
        all_gaps[..., ::2], all_gaps[..., 1::2] = node_gaps, gaps
        all_places[..., ::2], all_places[..., 1::2] = parameters, places
        feature = np.argmin(all_gaps, axis=-1)[..., None]
        pieces = self._pieces_of(np.take_along_axis(all_places, feature, axis=-1))
        numbers = MAX_PIECES * feature + pieces
        return np.min(all_gaps, axis=-1), numbers[..., 0]

    def active_sets(self, lines: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Returns 1 + the piece that a node penetrates, and the numbers of features on edges."""
        gaps, parameters = self._feet(lines[:, 1:, :2])
        touches, pieces = gaps < 0.0, self._pieces_of(parameters)
        for start, end in self._stretches:
            touches &= (parameters < start) | (parameters > end)
        found = [np.where(touches, 1 + pieces, 0)]
        for stretch in range(self.edge_count):
            gaps, numbers = self._deepest(lines[..., :2], stretch)
            found.append(np.where(gaps < 0.0, numbers, 0)[:, None])
        return np.concatenate(found, axis=1)

    def edge_depths(self, lines: np.ndarray) -> np.ndarray:
        """Returns the penetrations of the edges."""
        depths = [-self._deepest(lines[..., :2], edge)[0] for edge in range(self.edge_count)]
        return np.stack(depths, axis=-1)


def workpiece_of(case: Case) -> Face | FacesAndArcs | Spline:
    """Returns the workpiece of a case in the frame of the tool."""
    piece = case.workpiece
    if piece.kind == "profile":
        return Spline(case)
    is_arc = piece.radius_m < SEGMENTS_OF_FACE * case.filament.segment_m
    if piece.kind in ("edge", "chamfer") or (piece.kind == "cylinder" and is_arc):
        return FacesAndArcs(case)
    return Face(case)
