"""Passes with friction over chamfers, cylinders, bores and splines, by the planar code of edges.

What enters: nothing; the cases are those of `cases()` below.
What leaves: a JSON file with the metrics of all cases.

The chain, its differentiation by CasADi and CVODES are those of `cvodes.py`; `reference_edges.py`
has chamfers and circles. Splines are stated here:

1. A profile is a clamped B-spline of SciPy with uniform knots, and goes on straight beyond its
   ends. Its polynomial pieces are curves of their own. The nearest point of a profile is searched
   among densely sampled points, and then by Newton's method.
2. Stretches that are convex with radii below five segments are edges. The filament meets each of
   them at the point of its polyline that is deepest in it: a node, or the point of a segment where
   it is parallel to the curve.
3. The equations take the polynomials of the pieces that are touched, and solve for the foot of a
   node, or for the point with the segment's direction, by Newton's method. After every window their
   force is compared with that of the search.

Each case is computed at two tolerances; the file gives the larger difference as its own error, and
the largest jump of F_n where something else begins to touch: at the ends of a spline's edge MODEL.md
lets the force jump.

Run from the repository root:

    python derivations/reference_profiles.py
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import casadi
import cvodes
import numpy as np
import reference_edges as edges
from cases import CONTACT_STIFFNESS_N_M, DATA, LENGTH_M, entries_of, parser_of, write_cases
from cvodes import Window
from reference_edges import (
    SEGMENTS_OF_FACE,
    Case,
    Contact,
    Equations,
    Filament,
    Motion,
    Workpiece,
)
from scipy.interpolate import BSpline
from scipy.optimize import brentq
from scipy.spatial import cKDTree

# Points of each piece of a spline among which the nearest is searched.
SAMPLES = 500
# Iterations of Newton's method. It starts within a piece, and converges quadratically.
ITERATIONS = 8
# Largest difference of F_n between the equations and the search, in N. A penetration is the
# difference of coordinates of 0.2 m, rounded at 3e-17 m.
FORCE_ROUNDING_N = 1e-9
# Shorter windows say nothing about jumps.
LEAST_WINDOW_S = 1e-14
# Windows that fail are repeated down to this length.
SHORTEST_WINDOW_S = 1e-9
# Of the number of a touch, more than there are pieces.
MOST_PIECES = 100

edges.UNUSED["profile"] = (*edges.OF_EDGE, *edges.OF_CHAMFER, "radius_m")


@dataclass(frozen=True)
class Spline(Workpiece):
    """An open profile."""

    degree: int = 3
    control_points_m: tuple[tuple[float, float], ...] = ()


def crossed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The cross product of vectors (…, 2)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def left(vectors: np.ndarray) -> np.ndarray:
    """Vectors (…, 2) turned by a right angle: the outward normals of tangents."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


class SplineProfile:
    """A spline in the frame of the tool, with its edges.

    Piece 0 is the straight line before its start, the last piece that after its end. The parameter
    of the curve goes from 0 to the number of pieces between them.
    """

    def __init__(self, case: Case) -> None:
        piece = case.workpiece
        points = np.array(piece.control_points_m) + [piece.offset_m, case.height_m]
        self.degree, count = piece.degree, len(points) - piece.degree
        ends = np.zeros(piece.degree), np.full(piece.degree, count)
        knots = np.concatenate([ends[0], np.arange(count + 1), ends[1]])
        self._count = count
        self._curves = [BSpline(knots, points, piece.degree).derivative(i) for i in range(3)]
        # Coefficients by power, piece and coordinate. Each piece has its own parameter from 0 to 1.
        powers = [
            self._curves[0].derivative(power)(np.arange(count)) / math.factorial(power)
            for power in range(piece.degree + 1)
        ]
        self.polynomials = np.stack(powers, axis=1)
        self._ends, tangents = self._curves[0]([0.0, count]), self._curves[1]([0.0, count])
        self._directions = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
        self._parameters = np.linspace(0.0, count, SAMPLES * count + 1)
        self._tree = cKDTree(self._curves[0](self._parameters))
        self.stretches = self._stretches(1.0 / (SEGMENTS_OF_FACE * LENGTH_M / case.filament.segments))
        self.radius = 1.0 / float(np.max(self.curvature(self._parameters)))

    def curvature(self, parameters: np.ndarray) -> np.ndarray:
        """In 1/m, positive where the profile is convex."""
        first, second = self._curves[1](parameters), self._curves[2](parameters)
        return -crossed(first, second) / np.linalg.norm(first, axis=-1) ** 3

    def _stretches(self, limit: float) -> list[tuple[float, float]]:
        """The parameters between which the curvature is above the limit."""
        above = self.curvature(self._parameters) > limit
        changes = np.flatnonzero(above[1:] != above[:-1])
        cuts = [
            brentq(lambda u: float(self.curvature(u)) - limit, *self._parameters[i : i + 2], xtol=1e-15)
            for i in changes
        ]
        if above[0] or above[-1] or len(cuts) % 2:
            raise RuntimeError("an edge at the end of a profile")
        return list(zip(cuts[::2], cuts[1::2], strict=True))

    def coefficients(self, piece: int) -> np.ndarray:
        """Those of a piece by power and coordinate; of a line over the distance from its end."""
        if 1 <= piece <= self._count:
            return self.polynomials[piece - 1]
        end = 0 if piece == 0 else 1
        found = np.zeros((self.degree + 1, 2))
        found[:2] = self._ends[end], self._directions[end]
        return found

    def feet(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The gaps of points (…, 2), the pieces of their feet, and the parameters of these."""
        parameters = self._parameters[self._tree.query(points)[1]]
        for _ in range(ITERATIONS):
            here, first, second = (curve(parameters) for curve in self._curves)
            offsets = here - points
            slopes = np.sum(offsets * first, axis=-1)
            bends = np.sum(first**2 + offsets * second, axis=-1)
            # Far from the profile Newton's method may leave; those points do not touch.
            steps = np.clip(slopes / np.where(bends > 0.0, bends, np.inf), -0.1, 0.1)
            parameters = np.clip(parameters - steps, 0.0, self._count)
        normals = left(self._curves[1](parameters))
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        gaps = np.sum((points - self._curves[0](parameters)) * normals, axis=-1)
        distances = np.linalg.norm(points - self._curves[0](parameters), axis=-1)
        pieces = 1 + np.minimum(parameters.astype(int), self._count - 1)
        for piece, end, sign in ((0, 0, -1.0), (self._count + 1, 1, 1.0)):
            offsets = points - self._ends[end]
            along = sign * (offsets @ self._directions[end])
            across = offsets @ left(self._directions[end])
            is_on_line = (along > 0.0) & (np.abs(across) <= distances)
            gaps, pieces = np.where(is_on_line, across, gaps), np.where(is_on_line, piece, pieces)
            parameters = np.where(is_on_line, sign * np.inf, parameters)
        return gaps, pieces, parameters

    def faces_of(self, nodes: np.ndarray) -> np.ndarray:
        """For nodes (…, 2): 0 in the air or on an edge, else 1 + the piece that they penetrate."""
        gaps, pieces, parameters = self.feet(nodes)
        touches = gaps < 0.0
        for start, end in self.stretches:
            touches &= (parameters < start) | (parameters > end)
        return np.where(touches, 1 + pieces, 0)

    def deepest(self, nodes: np.ndarray, stretch: int) -> tuple[np.ndarray, np.ndarray]:
        """What of polylines (…, n + 1, 2) is deepest in a stretch.

        That is its gap, and a number: the feature, 2 k at node k and 2 k − 1 inside segment k, times
        MOST_PIECES, and the piece of the curve.
        """
        start, end = self.stretches[stretch]
        node_gaps, node_pieces, parameters = self.feet(nodes)
        node_gaps = np.where((parameters >= start) & (parameters <= end), node_gaps, np.inf)
        # Inside a segment, the curve is parallel to it.
        inner, along = nodes[..., :-1, :], np.diff(nodes, axis=-2)
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
        here, normals = self._curves[0](places), left(self._curves[1](places))
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        shares = np.sum((here - inner) * along, axis=-1) / np.sum(along**2, axis=-1)
        gaps = np.sum((inner + shares[..., None] * along - here) * normals, axis=-1)
        gaps = np.where(is_parallel & (shares > 0.0) & (shares < 1.0), gaps, np.inf)
        pieces = 1 + np.minimum(places.astype(int), self._count - 1)
        # Nodes and segments in turn, from node 0.
        shape = (*nodes.shape[:-2], 2 * nodes.shape[-2] - 1)
        all_gaps, all_pieces = np.empty(shape), np.empty(shape, dtype=int)
        all_gaps[..., ::2], all_gaps[..., 1::2] = node_gaps, gaps
        all_pieces[..., ::2], all_pieces[..., 1::2] = node_pieces, pieces
        feature = np.argmin(all_gaps, axis=-1)[..., None]
        numbers = MOST_PIECES * feature + np.take_along_axis(all_pieces, feature, axis=-1)
        return np.min(all_gaps, axis=-1), numbers[..., 0]

    def features_of(self, nodes: np.ndarray) -> np.ndarray:
        """Of polylines (…, n + 1, 2) and every stretch the number of what touches it, else 0."""
        found = np.zeros((*nodes.shape[:-2], len(self.stretches)), dtype=int)
        for stretch in range(len(self.stretches)):
            gaps, numbers = self.deepest(nodes, stretch)
            found[..., stretch] = np.where(gaps < 0.0, numbers, 0)
        return found

    def normal_force_n(self, line: np.ndarray, touch: np.ndarray) -> float:
        """F_n of a polyline (n + 1, 2) with a touch, by the search."""
        n = len(line) - 1
        gaps = self.feet(line[1:])[0][touch[:n] > 0]
        on_edges = [self.deepest(line, i)[0] for i in np.flatnonzero(touch[n:])]
        return -CONTACT_STIFFNESS_N_M * (float(np.sum(gaps)) + float(sum(on_edges)))


class SplineEquations(Equations):
    """The equations with the contact on pieces of a spline."""

    def __init__(self, filament: Filament, degree: int, edge_count: int) -> None:
        self.degree = degree
        super().__init__(filament, circle=False, arc_count=edge_count)

    def _touch_symbols(self) -> tuple[casadi.SX, ...]:
        n, size = self.filament.segments, 1 + 2 * (self.degree + 1)
        # Of each node: 1 if it touches a face, and the coefficients of its piece. Of each edge the
        # same for a node and for the inside of a segment, and which segment, 1 there and else 0.
        nodes = casadi.SX.sym("nodes", size, n)
        at_nodes = casadi.SX.sym("at_nodes", size + n, self.arc_count)
        insides = casadi.SX.sym("insides", size + n, self.arc_count)
        return nodes, at_nodes, insides

    def _curve(self, polynomial: casadi.SX, place: casadi.SX) -> list[casadi.SX]:
        """A curve and its first two derivatives, by Horner's rule."""
        coefficients = casadi.reshape(polynomial, self.degree + 1, 2)
        zero = casadi.SX.zeros(2)
        here, first, second = zero, zero, zero
        for power in range(self.degree, -1, -1):
            second = second * place + 2 * first
            first = first * place + here
            here = here * place + coefficients[power, :].T
        return [here, first, second]

    def _foot(self, point: casadi.SX, polynomial: casadi.SX) -> tuple[casadi.SX, casadi.SX]:
        """The gap of a point and the normal at its foot."""
        ends = [self._curve(polynomial, casadi.SX(place))[0] for place in (0.0, 1.0)]
        chord = ends[1] - ends[0]
        place = casadi.dot(point - ends[0], chord) / casadi.sumsqr(chord)
        for _ in range(ITERATIONS):
            here, first, second = self._curve(polynomial, place)
            bend = casadi.sumsqr(first) + casadi.dot(here - point, second)
            place -= casadi.dot(here - point, first) / bend
        here, first, _ = self._curve(polynomial, place)
        normal = casadi.vertcat(-first[1], first[0]) / casadi.norm_2(first)
        return casadi.dot(point - here, normal), normal

    def _add_contacts(
        self, contact: Contact, nodes: casadi.SX, touch: tuple[casadi.SX, ...]
    ) -> None:
        on_faces, at_nodes, insides = touch
        size = 1 + 2 * (self.degree + 1)
        for k in range(self.filament.segments):
            node = nodes[:, k + 1]
            contact.add(node, *self._foot(node, on_faces[1:, k]), on_faces[0, k])
        for i in range(self.arc_count):
            node = nodes[:, 1:] @ at_nodes[size:, i]
            gap, normal = self._foot(node, at_nodes[1:size, i])
            contact.add(node, gap, normal, at_nodes[0, i], is_edge=True)

            at_segment, polynomial = insides[size:, i], insides[1:size, i]
            inner = nodes[:, :-1] @ at_segment
            # Where no segment is chosen, any direction is a finite one.
            along = (nodes[:, 1:] - nodes[:, :-1]) @ at_segment
            along += (1 - insides[0, i]) * casadi.SX([1.0, 0.0])
            where = casadi.SX(0.5)
            for _ in range(ITERATIONS):
                _, first, second = self._curve(polynomial, where)
                slope = first[0] * along[1] - first[1] * along[0]
                where -= slope / (second[0] * along[1] - second[1] * along[0])
            here, first, _ = self._curve(polynomial, where)
            normal = casadi.vertcat(-first[1], first[0]) / casadi.norm_2(first)
            place = casadi.SX.sym("place")
            material = inner + place * along
            nearest = casadi.dot(here - inner, along) / casadi.sumsqr(along)
            gap = casadi.dot(material - here, normal)
            contact.add_on_edge(material, gap, normal, insides[0, i], place, nearest)


class Watched(Motion):
    """A pass of which the largest F_n and its largest jump are known."""

    peak_n, jump_n = 0.0, 0.0

    def force_n(self, window: Window, i: int) -> float:
        """F_n at a point."""
        return float(self.observed(window.times[i], window.states[:, i], window.parameters)[0][0])

    def windows(self) -> Iterator[Window]:
        """The whole motion."""
        before = 0.0
        for window in super().windows():
            if window.times[-1] - window.times[0] < LEAST_WINDOW_S:
                # What rounding leaves between a face and its edge.
                yield window
                continue
            self.jump_n = max(self.jump_n, abs(self.force_n(window, 0) - before))
            before = self.force_n(window, -1)
            if np.any(window.touch):
                self.peak_n = max(self.peak_n, self._peak_in(window))
            yield window

    def _peak_in(self, window: Window) -> float:
        forces = [self.force_n(window, i) for i in range(len(window.times))]
        largest = int(np.argmax(forces))
        peak = forces[largest]
        if peak < self.peak_n * (1 - 1e-3):
            return peak
        # Once more between the points beside it: where friction changes its sign, the force turns too
        # fast for an interpolation.
        for i in range(max(largest - 1, 0), min(largest + 1, len(forces) - 1)):
            ends, state = window.times[i : i + 2], window.states[:, i]
            fine = self._window(*ends, state, window.touch)
            peak = max(peak, *(self.force_n(fine, j) for j in range(len(fine.times))))
        return peak


class SplineMotion(Watched):
    """A pass over a spline."""

    # Once for all cases that share them.
    equations_of = staticmethod(cache(SplineEquations))

    @classmethod
    def _profile_and_equations(cls, case: Case) -> tuple[SplineProfile, SplineEquations]:
        profile = SplineProfile(case)
        return profile, cls.equations_of(case.filament, profile.degree, len(profile.stretches))

    def _of_touch(self, touch: np.ndarray) -> list[np.ndarray]:
        n, profile = self._n, self.profile
        size = 1 + 2 * (profile.degree + 1)
        nodes = np.zeros((size, n))
        at_nodes, insides = np.zeros((2, size + n, len(profile.stretches)))
        # Of what does not touch any curve that makes finite numbers: a line, and a parabola.
        second = 1 + profile.degree + 1
        for each in (nodes, at_nodes, insides):
            each[2] = 1.0
        insides[second + 2] = 1.0
        for node, face in enumerate(touch[:n]):
            if face > 0:
                nodes[:, node] = [1.0, *profile.coefficients(face - 1).ravel("F")]
        for edge, number in enumerate(touch[n:]):
            if number > 0:
                feature, piece = divmod(number, MOST_PIECES)
                column = (at_nodes if feature % 2 == 0 else insides)[:, edge]
                column[:size] = [1.0, *profile.coefficients(piece).ravel("F")]
                column[size + (feature - 1) // 2] = 1.0
        return [each.ravel("F") for each in (nodes, at_nodes, insides)]

    def _window(self, start_s: float, end_s: float, y: np.ndarray, touch: np.ndarray) -> Window:
        """The motion with one touch; less of it where a polynomial goes astray beyond its piece."""
        while True:
            try:
                return super()._window(start_s, end_s, y, touch)
            except RuntimeError:
                end_s = start_s + (end_s - start_s) / 4
                if end_s - start_s < SHORTEST_WINDOW_S:
                    raise

    def depth_at_edges_m(self, window: Window) -> float:
        """Largest penetration of an edge in a window."""
        lines = self.polylines(window.times, window.states[: self._n])
        touched = np.flatnonzero(window.touch[self._n :])
        return -min(float(np.min(self.profile.deepest(lines, edge)[0])) for edge in touched)

    def windows(self) -> Iterator[Window]:
        """The whole motion; compares the force of the equations with that of the search."""
        for window in super().windows():
            middle = len(window.times) // 2
            line = self.polylines(window.times[[middle]], window.states[: self._n, [middle]])[0]
            force = self.profile.normal_force_n(line, window.touch)
            if abs(force - self.force_n(window, middle)) > FORCE_ROUNDING_N:
                raise RuntimeError(f"{self.case.name}: another F_n at {window.times[middle]} s")
            yield window


def result(case: Case) -> dict[str, object]:
    """The entry of a case in the file."""
    runs = []
    for tolerance in (edges.TOLERANCE, edges.LOOSER):
        kind = SplineMotion if case.workpiece.kind == "profile" else Watched
        motion = kind(case, tolerance)
        values = edges.metrics(motion)
        values["peak_contact_normal_force_n"] = motion.peak_n
        values["largest_jump_of_force_n"] = motion.jump_n
        runs.append(values)
    entry = edges.entry_of(case, *runs)
    peak, looser_peak = (each["peak_contact_normal_force_n"] for each in runs)
    change = abs(looser_peak / peak - 1)
    entry["own_error"] = max(entry["own_error"], float(f"{change:.1g}"))
    return entry


def bump() -> Spline:
    """A convex bump that nodes meet, y = A (cos(2π x/L) − 1)/2, with straight ends."""
    height, length, count = 1.5e-3, 0.048, 41
    points = []
    for x in np.linspace(-0.08, 0.08, count):
        share = min(abs(x) / length, 0.5)
        points.append((round(float(x), 9), round(height * (math.cos(2 * math.pi * share) - 1) / 2, 9)))
    return Spline("profile", control_points_m=tuple(points))


def corner(side: str, turn_deg: float, spacing_m: float, degree: int, offset_m: float) -> Spline:
    """Two straight faces with a corner between them, which control points so far apart round."""
    distances = [spacing_m * i for i in range(1, degree + 3)]
    distances += [distances[-1] + d for d in (0.006, 0.014, 0.030, 0.060)]
    turn = math.radians(turn_deg)
    points = [(-d, 0.0) for d in reversed(distances)] + [(0.0, 0.0)]
    points += [(d * math.cos(turn), -d * math.sin(turn)) for d in distances]
    if side == "entering":
        points = [(-x, y) for x, y in reversed(points)]
    points = [(round(x, 9), round(y, 9)) for x, y in points]
    return Spline("profile", offset_m, degree=degree, control_points_m=tuple(points))


def cases() -> list[Case]:
    """The cases of the file."""
    leaving = Workpiece(
        "chamfer", -6e-3, edge_radius_m=0.5e-3, chamfer_width_m=4e-3, chamfer_angle_rad=0.12
    )
    entering = Workpiece(
        "chamfer", -4e-3, edge_radius_m=0.3e-3, side="entering", chamfer_width_m=2e-3
    )
    flat = replace(
        entering, offset_m=-5e-3, included_angle_rad=math.radians(100), edge_radius_m=0.5e-3
    )
    flat = replace(flat, chamfer_width_m=3e-3, chamfer_angle_rad=0.5)
    cylinder, rod = Workpiece("cylinder", radius_m=0.05), Workpiece("cylinder", radius_m=0.012)
    bore = Workpiece("bore", radius_m=0.25)
    rising = corner("entering", 50.0, 2e-3, 3, -4e-3)
    falling = corner("leaving", 60.0, 1.5e-3, 4, -8e-3)
    found = []
    for name, piece, n, friction in (
        ("chamfer, leaving", leaving, 6, 0.25),
        ("chamfer, entering", entering, 6, 0.25),
        ("chamfer, flat, entering", flat, 8, 0.3),
        ("cylinder", cylinder, 7, 0.25),
        ("cylinder, an edge", rod, 6, 0.25),
        ("bore", bore, 7, 0.25),
        ("spline, a bump", bump(), 8, 0.3),
        ("spline, entering", rising, 6, 0.25),
        ("spline, leaving", falling, 6, 0.25),
    ):
        for velocity, depth in ((5.0, 2e-3), (10.0, 1.5e-3), (20.0, 1e-3)):
            found.append(Case(name, Filament(n), piece, velocity, depth, friction))
    return found


def main() -> None:
    """Command line."""
    output = DATA / "reference_profiles.json"
    arguments = parser_of("Write passes over chamfers, circles and splines.", output).parse_args()
    entries = entries_of(result, cases(), arguments)
    if arguments.only is None:
        command = cvodes.command("reference_profiles.py", edges.TOLERANCE)
        write_cases(arguments.output, command, entries)


if __name__ == "__main__":
    main()
