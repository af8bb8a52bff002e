"""Rows of filaments that touch each other, by a planar code that shares nothing with the Rust code.

What enters: nothing; the cases are those of `cases()` below.
What leaves: a JSON file with what each filament of each case does, and statics of two filaments;
two trajectories.

How it is done:

1. The filaments of a row stay in the plane of rotation: one azimuth θ_k for each segment. Each is a
   chain of `cvodes.py`. The energy E_ab of filaments that touch is written down here, and CasADi
   differentiates it with the others.
2. The plane of the workpiece presses on nodes. Each of the N_q points of a segment is pressed off
   the nearest point of the neighbour's polyline, which lies inside a segment or at a node. Which
   nodes are below the plane and which part of the neighbour a point touches, if any, is the *touch*
   of a state. The equations take it as parameters and are smooth while it does not change.
3. CVODES integrates windows with a constant touch (`cvodes.py`): no step crosses a kink. Nothing is
   smoothed but friction, as MODEL.md says.
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

import json
import math
from dataclasses import dataclass, replace
from itertools import product

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
    FIRST_CANTILEVER_ROOT,
    LEAD_ANGLE_RAD,
    LEAST_VALUE,
    LENGTH_M,
    REGULARISATION_M_S,
    TAIL_ANGLE_RAD,
    WIDTH_M,
    YOUNGS_MODULUS_PA,
    Passing,
    entries_of,
    parser_of,
    rounded,
    write_cases,
    write_trajectories,
)
from cvodes import INTEGRAL_UNIT, RATE_UNIT_RAD_S, Window, planar_chain, velocity_of
from scipy.optimize import brentq, minimize_scalar

BENDING_STIFFNESS = YOUNGS_MODULUS_PA * math.pi * DIAMETER_M**4 / 64
MASS_PER_LENGTH = DENSITY_KG_M3 * math.pi * DIAMETER_M**2 / 4
FIRST_FREQUENCY = FIRST_CANTILEVER_ROOT**2 * math.sqrt(
    BENDING_STIFFNESS / (MASS_PER_LENGTH * LENGTH_M**4)
)
DAMPING_TIME_S = 2 * DAMPING_RATIO / FIRST_FREQUENCY
# Of filaments on each other: the default, and Hertz's value E/(4 (1 − ν²)) with ν = 0.4.
LINE_STIFFNESS_N_M2, HERTZ_STIFFNESS_N_M2 = 6e7, 9e8

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
TOLERANCE, LOOSER = 1e-12, 1e-11


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


@dataclass(frozen=True)
class Case(Passing):
    """A pass of a row over the plane; v_b in m/s, a_e in m."""

    name: str
    brush: Brush
    brushing_velocity_m_s: float
    penetration_depth_m: float
    friction_coefficient: float = 0.0
    segments: int = 5

    @property
    def columns(self) -> int:
        """Filaments in a row."""
        return self.brush.columns

    @property
    def behind_rad(self) -> float:
        """Angle from a column to the next."""
        return 2 * math.pi / self.brush.filament_count

    @property
    def last_behind_rad(self) -> float:
        """Angle from the first column to the last."""
        return (self.columns - 1) * self.behind_rad

    def inputs(self) -> dict[str, dict[str, object]]:
        """The case in the keys of the input file."""
        brush = self.brush
        of_brush = {
            "columns": brush.columns,
            "rows": 1,
            "stiffness_n_m2": brush.stiffness_n_m2,
            "contact_points": brush.contact_points,
            "damping_s_m": brush.damping_s_m,
            "friction_coefficient": brush.friction_coefficient,
            "steady": False,
        }
        return inputs(self, WIDTH_M, brush.filament_count, {}, of_brush)


def inputs(
    case: Passing,
    width_m: float,
    filament_count: float,
    filament: dict[str, object],
    brush: dict[str, object],
) -> dict[str, dict[str, object]]:
    """A case in the keys of the input file; `filament` has what others do not say."""
    return {
        "tool": {
            "body_radius_m": BODY_RADIUS_M,
            "width_m": width_m,
            "filament_count": filament_count,
        },
        "filament": {
            "segments": case.segments,
            "length_m": LENGTH_M,
            "diameter_m": DIAMETER_M,
            "density_kg_m3": DENSITY_KG_M3,
            "youngs_modulus_pa": YOUNGS_MODULUS_PA,
            "damping_ratio": DAMPING_RATIO,
            **filament,
        },
        "contact": {
            "stiffness_n_m": CONTACT_STIFFNESS_N_M,
            "friction_coefficient": case.friction_coefficient,
            "friction_regularisation_m_s": REGULARISATION_M_S,
        },
        "brush": brush,
        "process": {
            "brushing_velocity_m_s": case.brushing_velocity_m_s,
            "penetration_depth_m": case.penetration_depth_m,
            "lead_angle_rad": LEAD_ANGLE_RAD,
            "tail_angle_rad": TAIL_ANGLE_RAD,
        },
    }


class Equations(cvodes.Equations):
    """The equations of motion of a row, as functions of CasADi of (t, y, p).

    y is (θ of column 0, θ of column 1, …, all θ̇, the integrals). p says what touches: 1 for each
    node below the plane, else 0; and by columns a matrix with a row for each point of a filament on
    a neighbour: whether it touches, whether the nearest point is a node, its place on its segment if
    so, 1 at that segment, and the weights of the segments whose rotation moves the surface there.
    """

    def __init__(self, case: Case) -> None:
        self.case = case
        self.columns, n = case.columns, case.segments
        self.contact_points = case.brush.contact_points
        self.count = self.node_count = self.columns * n
        point_count = 2 * (self.columns - 1) * n * case.brush.contact_points
        self._angles = casadi.SX.sym("theta", self.count)
        self._rates = casadi.SX.sym("theta_rate", self.count)
        self._instant = [casadi.SX.sym("t"), self._angles, self._rates]
        below = casadi.SX.sym("below", self.count)
        points = casadi.SX.sym("points", point_count, 3 + 2 * n)
        parameters = casadi.vertcat(below, casadi.vec(points))

        kinetic, springs, dissipation = self._chains()
        on_workpiece, of_workpiece = self._workpiece(below)
        pressed, torques, between, pair_forces = self._neighbours(points)
        energies = kinetic, kinetic - springs - pressed, dissipation
        integrands = casadi.vertcat(of_workpiece, between)
        self.derive(self._instant, parameters, energies, [on_workpiece, torques], integrands)
        self.observed = casadi.Function(
            "observed", [*self._instant, parameters], [pair_forces, self._closing]
        )

    def _chains(self) -> tuple[casadi.SX, casadi.SX, casadi.SX]:
        """E_kin and E_spring in J, D in W; sets positions and velocities of the nodes."""
        case, n = self.case, self.case.segments
        time, h = self._instant[0], LENGTH_M / n
        # The clamp joint carries only half a segment's compliance.
        stiffnesses = [(2 if k == 0 else 1) * BENDING_STIFFNESS / h for k in range(n)]
        sums = [0, 0, 0]
        self._nodes, self._velocities = [], []
        for column in range(self.columns):
            own = slice(column * n, (column + 1) * n)
            body = case.start_angle_rad - column * case.behind_rad + case.rate_rad_s * time
            *energies, nodes = planar_chain(
                (time, self._angles[own], self._rates[own]),
                (body, case.rate_rad_s),
                [MASS_PER_LENGTH * h] * n,
                stiffnesses,
                DAMPING_TIME_S,
                [0.0] * n,
            )
            sums = [total + each for total, each in zip(sums, energies, strict=True)]
            self._nodes.append(nodes)
            velocities = [velocity_of(nodes[:, k], self._instant) for k in range(n + 1)]
            self._velocities.append(casadi.horzcat(*velocities))
        return tuple(sums)

    def _workpiece(self, below: casadi.SX) -> tuple[casadi.SX, casadi.SX]:
        """Generalised forces of the plane, and the rates of the integrals of each filament."""
        case, n = self.case, self.case.segments
        torques, integrands = casadi.SX.zeros(self.count), []
        for column in range(self.columns):
            nodes, velocities = self._nodes[column], self._velocities[column]
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

    def _neighbours(self, points: casadi.SX) -> tuple[casadi.SX, casadi.SX, casadi.SX, casadi.SX]:
        """Σ E_ab; other generalised forces; rates of the pairs' integrals; Σ N of each pair."""
        brush, n = self.case.brush, self.case.segments
        part = LENGTH_M / n / brush.contact_points
        energy, torques, integrands, closing = 0, casadi.SX.zeros(self.count), [], []
        touches = iter(casadi.vertsplit(points))
        places = [(i + 0.5) / brush.contact_points for i in range(brush.contact_points)]
        for pair in range(self.columns - 1):
            sums = casadi.SX.zeros(len(OF_PAIR))
            sides = (pair, pair + 1, 1), (pair + 1, pair, -1)
            for (a, b, sign), k, place in product(sides, range(n), places):
                found = self._point(a, b, k, place, next(touches), part)
                energy, torques = energy + found[0], torques + found[1]
                total, force, rubbed, damped, rate = found[2:]
                sums += casadi.vertcat(total, sign * force, rubbed, damped)
                closing.append(rate)
            integrands.append(sums)
        normals = [sums[0] for sums in integrands]
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
        own, own_velocity = (
            (1 - place) * each[a][:, k] + place * each[a][:, k + 1]
            for each in (self._nodes, self._velocities)
        )
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


class Motion(cvodes.Motion):
    """A pass of a row.

    A touch has of every node 1 below the plane, else 0; then of every point 0 in the air, 2 k + 1
    nearest to the neighbour's node k, 2 k to the inside of its segment k.
    """

    equations_of = Equations
    # The integrals.
    of_filament, of_pair = OF_FILAMENT, OF_PAIR
    # How often the nearest point of a point has jumped from one segment to another.
    jumps = 0

    def __init__(self, case: Case, relative_tolerance: float) -> None:
        super().__init__(case, self.equations_of(case), relative_tolerance)
        self._n, self._columns = case.segments, case.columns
        self._contact_points = self.equations.contact_points

    def bodies(self, times: np.ndarray) -> np.ndarray:
        """β of each column, (times, columns)."""
        case = self.case
        bodies = case.start_angle_rad - case.behind_rad * np.arange(self._columns)
        return bodies + case.rate_rad_s * times[:, None]

    def start(self) -> np.ndarray:
        """Straight filaments, turning rigidly with the body."""
        bodies = self.bodies(np.zeros(1))[0]
        rates = np.full(self.equations.count, self.case.rate_rad_s / RATE_UNIT_RAD_S)
        integrals = np.zeros(self.equations.integral_count)
        return np.concatenate([np.repeat(bodies, self._n), rates, integrals])

    def polylines(self, times: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Positions (times, columns, nodes, 2), for angles as columns."""
        bodies = self.bodies(times)[..., None]
        azimuths = angles.T.reshape(len(times), self._columns, self._n)
        h = LENGTH_M / self._n
        steps = [
            np.stack([length * np.cos(towards), length * np.sin(towards)], axis=-1)
            for length, towards in ((BODY_RADIUS_M, bodies), (h, azimuths))
        ]
        return np.cumsum(np.concatenate(steps, axis=2), axis=2)

    def _touch_of_points(self, own: np.ndarray, other: np.ndarray) -> np.ndarray:
        """What of polylines `other` the points of polylines `own` touch, (times, points)."""
        count = self._contact_points
        places = ((np.arange(count) + 0.5) / count)[:, None]
        starts, ends = own[:, :-1, None, :], own[:, 1:, None, :]
        points = (starts + places * (ends - starts)).reshape(len(own), -1, 1, own.shape[-1])
        inner, along = other[:, None, :-1, :], np.diff(other, axis=1)[:, None]
        where = np.sum((points - inner) * along, axis=-1) / np.sum(along**2, axis=-1)
        offsets = points - inner - np.clip(where, 0.0, 1.0)[..., None] * along
        distances = np.linalg.norm(offsets, axis=-1)
        nearest = np.argmin(distances, axis=-1)[..., None]
        where = np.take_along_axis(where, nearest, axis=-1)[..., 0]
        distance = np.take_along_axis(distances, nearest, axis=-1)[..., 0]
        feature = 2 * nearest[..., 0] + np.where(where <= 0.0, 0, np.where(where >= 1.0, 2, 1))
        return np.where(distance < DIAMETER_M, 1 + feature, 0)

    def touches(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """The touch at each time, as rows."""
        lines = self.polylines(times, states[: self.equations.count])
        rows = [(lines[:, :, 1:, 1] < self.case.height_m).reshape(len(times), -1)]
        for pair in range(self._columns - 1):
            for a, b in ((pair, pair + 1), (pair + 1, pair)):
                rows.append(self._touch_of_points(lines[:, a], lines[:, b]))
        return np.concatenate(rows, axis=1).astype(int)

    def parameters(self, touch: np.ndarray) -> np.ndarray:
        """The touch as the equations take it."""
        n, nodes = self._n, self.equations.node_count
        points = np.zeros((len(touch) - nodes, 3 + 2 * n))
        at_segment, turning = points[:, 3 : 3 + n], points[:, 3 + n :]
        for row in np.flatnonzero(touch[nodes:]):
            # Segments count from 0 here.
            node, inside = divmod(touch[nodes + row] - 1, 2)
            segment = node if inside else max(node - 1, 0)
            points[row, :3] = 1.0, float(not inside), float(node > 0)
            at_segment[row, segment] = 1.0
            # The surface at a node turns with both segments.
            following = segment if inside else min(node, n - 1)
            turning[row, segment] += 0.5
            turning[row, following] += 0.5
        return np.concatenate([touch[:nodes].astype(float), points.ravel("F")])

    def normal_forces_n(self, touch: np.ndarray, lines: np.ndarray) -> np.ndarray:
        """F_n (times, columns) of polylines with a touch."""
        below = touch[: self.equations.node_count].reshape(self._columns, self._n)
        depths = below * (self.case.height_m - lines[:, :, 1:, 1])
        return CONTACT_STIFFNESS_N_M * np.sum(depths, axis=-1)

    @staticmethod
    def deflections_m(lines: np.ndarray, bodies: np.ndarray) -> np.ndarray:
        """Distances (times, columns) of the tips from the undeformed filaments."""
        directions = np.stack([np.cos(bodies), np.sin(bodies)], axis=-1)
        offsets = lines[:, :, -1] - lines[:, :, 0]
        along = np.clip(np.sum(offsets * directions, axis=-1, keepdims=True), 0.0, LENGTH_M)
        return np.linalg.norm(offsets - along * directions, axis=-1)

    def peaks_in(self, window: Window) -> np.ndarray:
        """Largest F_n and deflection of each filament in a window, (2, columns)."""

        def values(times: np.ndarray, states: np.ndarray) -> np.ndarray:
            lines = self.polylines(times, states[: self.equations.count])
            forces = self.normal_forces_n(window.touch, lines)
            return np.stack([forces, self.deflections_m(lines, self.bodies(times))], axis=1)

        of_points = values(window.times, window.states)
        peaks = np.max(of_points, axis=0)
        for place in np.ndindex(peaks.shape):
            i = int(np.argmax(of_points[(slice(None), *place)]))
            for j in range(max(i - 1, 0), min(i + 1, len(window.times) - 1)):
                state, start = self.between(window, j), window.times[j]

                def negative(since: float, state=state, start=start, place=place) -> float:
                    return -float(
                        values(np.array([start + since]), state(since)[:, None])[0][place]
                    )

                bounds = (0.0, window.times[j + 1] - start)
                found = minimize_scalar(negative, bounds=bounds, method="bounded")
                peaks[place] = max(peaks[place], -float(found.fun))
        return peaks

    def check(self, window: Window) -> None:
        """That nothing happens which the equations leave out."""
        lines = self.polylines(window.times[-1:], window.states[: self.equations.count, -1:])[0]
        for column in range(self._columns - 2):
            ends = lines[column][:, None] - lines[column + 2][None]
            # Nodes are h apart: no point is nearer than this.
            if np.min(np.linalg.norm(ends, axis=-1)) < DIAMETER_M:
                raise RuntimeError(f"{self.case.name}: columns touch that are not neighbours")
        if self.case.brush.damping_s_m > 0.0 and self._columns > 1:
            rates = self.observed(window.times[-1], window.states[:, -1], window.parameters)[1]
            if np.min(rates) * self.case.brush.damping_s_m <= -1.0:
                raise RuntimeError(f"{self.case.name}: a damped contact would pull")

    def changed(self, touch: np.ndarray, following: np.ndarray) -> None:
        """Counts the jumps."""
        count = self.equations.node_count
        before, after = touch[count:], following[count:]
        self.jumps += bool(np.any((before > 0) & (after > 0) & (np.abs(before - after) > 1)))


def column_runs(case: Case, touch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which columns touch the plane, and which pairs of neighbours touch each other."""
    columns, nodes = case.columns, case.columns * case.segments
    on_plane = np.any(touch[:nodes].reshape(columns, -1) > 0, axis=1)
    pairs = np.any(touch[nodes:].reshape(columns - 1, -1) > 0, axis=1) if columns > 1 else []
    return on_plane, np.array(pairs, dtype=bool)


def metrics(motion: Motion) -> dict[str, object]:
    """What the file says about a case, from a run at one tolerance."""
    case, columns = motion.case, motion.case.columns
    times, pair_times = np.zeros(columns), np.zeros(columns - 1)
    counts, touched_before = np.zeros(columns, dtype=int), np.zeros(columns, dtype=bool)
    peaks = np.zeros((2, columns))
    for window in motion.windows():
        on_plane, pairs = column_runs(case, window.touch)
        length = window.times[-1] - window.times[0]
        times, pair_times = times + length * on_plane, pair_times + length * pairs
        counts, touched_before = counts + (on_plane & ~touched_before), on_plane
        peaks = np.maximum(peaks, motion.peaks_in(window))
        last = window
    if np.any(touched_before):
        raise RuntimeError(f"{case.name}: a filament still touches the plane at the end")
    integrals, split = motion.integrals(last, -1), columns * len(motion.of_filament)
    of_filament = integrals[:split].reshape(columns, -1)
    of_pair = integrals[split:].reshape(columns - 1, len(motion.of_pair))
    tips = motion.polylines(last.times[-1:], last.states[: motion.equations.count, -1:])[0, :, -1]
    filaments = [
        {
            "column": column,
            **dict(zip(motion.of_filament, of_filament[column], strict=True)),
            "contact_time_s": times[column],
            "contact_count": int(counts[column]),
            "peak_contact_normal_force_n": peaks[0, column],
            "max_tip_deflection_m": peaks[1, column],
            "final_tip_m": tips[column],
        }
        for column in range(columns)
    ]
    between = [
        {
            "columns": [pair, pair + 1],
            **dict(zip(motion.of_pair, of_pair[pair], strict=True)),
            "contact_time_s": pair_times[pair],
        }
        for pair in range(columns - 1)
    ]
    return {
        "filaments": filaments,
        "neighbours": between,
        "changes_of_touch": motion.changes,
        "jumps_of_nearest_points": motion.jumps,
    }


def own_errors(values: dict[str, object], others: dict[str, object]) -> dict[str, float]:
    """Largest differences of two runs: of p_n, of all else of filaments, and of neighbours.

    Relative; impulses over p_n or the normal impulse of the pair.
    """
    largest = {"contact_normal_impulse_n_s": 0.0, "filaments": 0.0, "neighbours": 0.0}
    for group, scale_of in (("filaments", OF_FILAMENT[0]), ("neighbours", OF_PAIR[0])):
        for one, other in zip(values[group], others[group], strict=True):
            for key, value in one.items():
                if not isinstance(value, float):
                    continue
                change = abs(value - other[key])
                if change > LEAST_VALUE:
                    name = key if key in largest else group
                    scale = one[scale_of] if "impulse" in key else value
                    largest[name] = max(largest[name], change / abs(scale))
    return {name: float(f"{error:.1g}") for name, error in largest.items()}


def result(case: Case) -> dict[str, object]:
    """The entry of a case in the file."""
    values, others = (metrics(Motion(case, each)) for each in (TOLERANCE, LOOSER))
    entry = {"name": case.name, "input": case.inputs()}
    if case.brush.friction_coefficient > 0.0:
        entry["friction_at"] = case.brush.friction_at
    entry |= {"start_angle_rad": case.start_angle_rad, "end_s": case.end_s} | values
    entry["own_errors"] = own_errors(values, others)
    return rounded(entry)


def cases() -> list[Case]:
    """The cases of the file."""
    three = Brush(3)
    rubbing = replace(three, friction_coefficient=0.2)
    at_centrelines = replace(rubbing, friction_at="centrelines")
    close = replace(three, filament_count=745.0)
    stiff = replace(three, stiffness_n_m2=HERTZ_STIFFNESS_N_M2)
    damped, finer = replace(three, damping_s_m=0.1), replace(three, contact_points=7)
    everything = replace(close, friction_coefficient=0.2, damping_s_m=0.05)
    wide = Brush(2, filament_count=150.0)
    slow, fast = (10.0, 1e-3), (30.0, 2e-3)
    found = [
        Case(name, Brush(columns), *process)
        for name, columns in (("alone", 1), ("two", 2), ("three", 3))
        for process in (slow, fast)
    ]
    found += [Case("three, Hertz's stiffness", stiff, *process) for process in (slow, fast)]
    return [
        *found,
        Case("three, 7 points", finer, *slow),
        Case("three, damped", damped, *slow),
        Case("alone, friction", Brush(1), *slow, 0.3),
        Case("three, friction on the workpiece", three, *slow, 0.3),
        Case("three, friction", rubbing, *slow, 0.3),
        Case("three, friction at centrelines", at_centrelines, *slow, 0.3),
        Case("alone, deep", Brush(1), 10.0, 3e-3),
        Case("three, close", close, 10.0, 3e-3),
        Case("three, close, friction and damped", everything, 20.0, 2e-3, 0.3),
        Case("two, wide", wide, *slow),
    ]


def shown() -> dict[str, Case]:
    """The cases whose trajectories are written, and the names of their files."""
    of_name = {(case.name, case.brushing_velocity_m_s): case for case in cases()}
    return {
        "row_three_cvodes.csv": of_name["three", 10.0],
        "row_friction_cvodes.csv": of_name["three, friction", 10.0],
    }


def stiffness_changes(entries: list[dict[str, object]]) -> list[dict[str, object]]:
    """How p_n changes from the default stiffness between filaments to Hertz's."""

    def find(name: str, velocity: float) -> np.ndarray:
        for entry in entries:
            process = entry["input"]["process"]
            if entry["name"] == name and process["brushing_velocity_m_s"] == velocity:
                return np.array([each[OF_FILAMENT[0]] for each in entry["filaments"]])
        raise KeyError(name)

    found = []
    for velocity in (10.0, 30.0):
        soft, hard = find("three", velocity), find("three, Hertz's stiffness", velocity)
        found.append(
            {
                "brushing_velocity_m_s": velocity,
                "relative_change_of_contact_normal_impulse": [
                    float(f"{change:.3g}") for change in hard / soft - 1
                ],
                "of_their_sum": float(f"{hard.sum() / soft.sum() - 1:.3g}"),
            }
        )
    return found


def trajectory_columns(case: Case) -> list[str]:
    """Names of the columns of a trajectory."""
    columns = range(case.columns)
    names = ["contact_normal_force_n", "contact_normal_impulse_n_s", "tip_x_m", "tip_y_m"]
    of_filaments = [f"{name}_{column}" for column in columns for name in names]
    of_pairs = [f"neighbour_normal_force_n_{pair}_{pair + 1}" for pair in columns[:-1]]
    return ["time_s", *of_filaments, *of_pairs]


def trajectory(case: Case, relative_tolerance: float) -> np.ndarray:
    """Rows of `trajectory_columns`."""
    motion, rows, split = Motion(case, relative_tolerance), [], case.columns * len(OF_FILAMENT)
    count = motion.equations.count
    for time, state, window in motion.sampled():
        lines = motion.polylines(np.array([time]), state[:count, None])
        impulses = state[2 * count : 2 * count + split : len(OF_FILAMENT)] * INTEGRAL_UNIT
        forces = motion.normal_forces_n(window.touch, lines)[0]
        of_filaments = np.column_stack([forces, impulses, lines[0, :, -1]])
        between, _ = motion.observed(time, state, window.parameters)
        rows.append([time, *of_filaments.ravel(), *between])
    return np.array(rows)


def trajectory_text(case: Case) -> str:
    """The file of a trajectory."""
    table, looser = trajectory(case, TOLERANCE), trajectory(case, LOOSER)
    names, brush = trajectory_columns(case), case.brush
    errors = cvodes.differences(names, table, looser)
    comments = [
        cvodes.command("reference_row.py", TOLERANCE),
        f"A planar row of {brush.columns} filaments of {case.segments} segments with "
        f"{brush.contact_points} points each, {brush.filament_count:g} around, over the plane: "
        f"brushing velocity {case.brushing_velocity_m_s:g} m/s, penetration depth "
        f"{case.penetration_depth_m:g} m, coefficient of friction on the workpiece "
        f"{case.friction_coefficient:g}, between filaments {brush.friction_coefficient:g}. "
        "Column 0 meets the workpiece first.",
        f"Own error, largest difference to relative tolerance {LOOSER:g}: {errors}.",
    ]
    return cvodes.table_text(comments, names, table, LEAST_VALUE)


# Statics of two straight or bent filaments, in space.

# The paper's filament crosses another at these distances from their clamps, which approach by this
# much more than would make the filaments touch. The formula holds for small slopes: the force acts
# on centrelines, which lie a diameter apart, so the lever arms change by d times the slope.
CROSSING_M = (0.016, 0.012)
APPROACHES_M = (2e-4, 2e-5)
# Penetration of filaments that do not bend.
PENETRATION_M = 1e-5


def contact_forces(
    a: np.ndarray, b: np.ndarray, count: int, segment_m: float
) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """E_ab of polylines (n + 1, 3), with −∂E/∂nodes of each, and ∂²E/∂nodes² without curvature.

    The last is a matrix of the 3 (n_a + n_b + 2) coordinates: the energy is half a sum of squares,
    of which only the slopes are taken, as by Gauss and Newton.
    """
    part = segment_m / count
    places = ((np.arange(count) + 0.5) / count)[:, None]
    energy, forces = 0.0, [np.zeros_like(a), np.zeros_like(b)]
    size = a.size + b.size
    second = np.zeros((size, size))
    for own, other, x, y in ((0, 1, a, b), (1, 0, b, a)):
        points = (x[:-1, None] + places * np.diff(x, axis=0)[:, None]).reshape(-1, 3)
        along = np.diff(y, axis=0)
        where = np.einsum("psi,si->ps", points[:, None] - y[None, :-1], along) / segment_m**2
        where = np.clip(where, 0.0, 1.0)
        offsets = points[:, None] - y[None, :-1] - where[..., None] * along
        distances = np.linalg.norm(offsets, axis=-1)
        nearest = np.argmin(distances, axis=-1)
        for i in np.flatnonzero(np.min(distances, axis=-1) < DIAMETER_M):
            k, place, s = i // count, places[i % count, 0], nearest[i]
            distance, u = distances[i, s], where[i, s]
            normal, depth = offsets[i, s] / distance, DIAMETER_M - distance
            energy += LINE_STIFFNESS_N_M2 / 4 * part * depth**2
            force = LINE_STIFFNESS_N_M2 / 2 * part * depth * normal
            slope = np.zeros(size)
            for filament, node, weight in (
                (own, k, 1 - place),
                (own, k + 1, place),
                (other, s, u - 1),
                (other, s + 1, -u),
            ):
                forces[filament][node] += weight * force
                first = filament * a.size + 3 * node
                slope[first : first + 3] += weight * normal
            second += LINE_STIFFNESS_N_M2 / 2 * part * np.outer(slope, slope)
    return energy, forces[0], forces[1], second


def straight(root: tuple[float, ...], towards: tuple[float, ...], segments: int) -> np.ndarray:
    """Nodes of a straight filament of the paper's length."""
    steps = np.linspace(0.0, LENGTH_M, segments + 1)[:, None]
    return np.array(root) + steps * np.array(towards)


def force_between(a: np.ndarray, b: np.ndarray, count: int, segment_m: float) -> float:
    """Force along z on b, which lies above a; checked against differences of the energy."""
    energy, _, forces, _ = contact_forces(a, b, count, segment_m)
    force, lift = float(np.sum(forces[:, 2])), np.array([0.0, 0.0, 1e-10])
    higher, lower = (contact_forces(a, b + step, count, segment_m)[0] for step in (lift, -lift))
    change = (lower - higher) / (2 * lift[2])
    # Differences of a number that is rounded at its sixteenth digit.
    if abs(change - force) > 1e-6 * force + 1e-14 * energy / lift[2]:
        raise RuntimeError(f"the force {force} N is not the energy's slope {change} N")
    return force


def parallel_filaments() -> dict[str, object]:
    """Force of parallel filaments, and of filaments at a small angle in one plane."""
    gap, segments, angle = DIAMETER_M - PENETRATION_M, 5, 1e-3
    h = LENGTH_M / segments
    exact = LINE_STIFFNESS_N_M2 * PENETRATION_M * LENGTH_M
    below = straight((0, 0, 0), (1, 0, 0), segments)
    above = straight((0, 0, gap), (1, 0, 0), segments)
    # The penetration falls to zero after a quarter of the length.
    tilted = straight((0, 0, gap), (math.cos(angle), 0, math.sin(angle)), segments)
    # Distances from points of the tilted one to the other's line, and the other way round.
    depth = DIAMETER_M - gap * math.cos(angle)
    squares = PENETRATION_M**2 + depth**2 * math.cos(angle)
    wedge = LINE_STIFFNESS_N_M2 / 4 * squares / math.sin(angle)
    return {
        "penetration_m": PENETRATION_M,
        "length_m": LENGTH_M,
        "segments": segments,
        "source": "k_l δ per length; at an angle half k_l ∫⟨δ⟩ ds of both, "
        "δ_0² k_l/(2 angle) for small ones",
        "closed_form_n": exact,
        "computed": [
            {"contact_points": count, "force_n": force_between(below, above, count, h)}
            for count in (1, 3, 30)
        ],
        "angle_rad": angle,
        "closed_form_at_angle_n": wedge,
        "computed_at_angle": [
            {"contact_points": count, "force_n": force_between(below, tilted, count, h)}
            for count in (1, 3, 10, 30, 100, 300)
        ],
    }


def crossed_filaments(angle: float) -> dict[str, object]:
    """Force of straight filaments that cross, over N_q and over where points happen to lie."""
    gap, segments, penetration = DIAMETER_M - PENETRATION_M, 25, PENETRATION_M
    h = LENGTH_M / segments
    half_width = math.sqrt(DIAMETER_M**2 - gap**2)
    # ∫ k_l (d − √(g² + s²)) g/√(g² + s²) ds, of which Hertz's law is the limit for δ ≪ d.
    exact = 2 * DIAMETER_M * math.asinh(half_width / gap) - 2 * half_width
    exact *= LINE_STIFFNESS_N_M2 * gap / math.sin(angle)
    hertz = 4 / 3 * LINE_STIFFNESS_N_M2 * math.sqrt(2 * DIAMETER_M) * penetration**1.5
    hertz /= math.sin(angle)
    computed = []
    for count in (2, 4, 8, 16, 32, 64, 128):
        forces = []
        for share in np.linspace(0.0, 1.0, 8, endpoint=False):
            # Both cross in the middle, but for a share of a part.
            middle = LENGTH_M / 2 + share * h / count
            towards = (math.cos(angle), math.sin(angle), 0.0)
            root = (middle - middle * towards[0], -middle * towards[1], gap)
            crossing = straight(root, towards, segments)
            forces.append(
                force_between(straight((0, 0, 0), (1, 0, 0), segments), crossing, count, h)
            )
        least, most = min(forces), max(forces)
        computed.append({"contact_points": count, "least_force_n": least, "largest_force_n": most})
    return {
        "angle_rad": angle,
        "penetration_m": penetration,
        "segments": segments,
        "source": "(4/3) k_l √(2 d) δ^(3/2)/sin(angle) for δ ≪ d; the energy's integral is "
        "k_l g [2 d asinh(w/g) − 2 w]/sin(angle), g = d − δ, w² = d² − g²",
        "hertz_n": hertz,
        "closed_form_n": exact,
        "half_width_m": half_width / math.sin(angle),
        "computed": computed,
    }


class Cantilevers:
    """Two crossed filaments, clamped at one end each, that are pressed together along z.

    One lies along x, the other, above it, along y. Of each segment, the unknowns are the slopes
    (v, w) of its direction (1, v, w)/√(1 + v² + w²), relative to its filament's axes.
    """

    def __init__(self, segments: int, approach_m: float) -> None:
        self.segment_m, self.segments = LENGTH_M / segments, segments
        first, second = CROSSING_M
        slopes = casadi.SX.sym("slopes", 4 * segments)
        frames = (np.eye(3), np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
        roots = ([0.0, 0.0, 0.0], [first, -second, DIAMETER_M - approach_m])
        springs, nodes = 0, []
        for filament, (frame, root) in enumerate(zip(frames, roots, strict=True)):
            before, node = casadi.SX([1.0, 0.0, 0.0]), casadi.SX(root)
            nodes.append(node)
            for k in range(segments):
                place = 2 * (filament * segments + k)
                direction = casadi.vertcat(1.0, slopes[place], slopes[place + 1])
                direction /= casadi.norm_2(direction)
                # (2 asin(chord/2))² to the sixth power of the chord: analytic at zero.
                square = casadi.sumsqr(direction - before)
                angle_squared = square * (1 + square / 12 + square**2 / 90)
                stiffness = (2 if k == 0 else 1) * BENDING_STIFFNESS / self.segment_m
                springs += stiffness / 2 * angle_squared
                node = node + self.segment_m * casadi.SX(frame.T) @ direction
                nodes.append(node)
                before = direction
        positions = casadi.vertcat(*nodes)
        hessian, gradient = casadi.hessian(springs, slopes)
        by_slopes = casadi.jacobian(positions, slopes)
        self._chains = casadi.Function(
            "chains", [slopes], [springs, gradient, hessian, positions, by_slopes]
        )

    def force_n(self, count: int) -> float:
        """Force along z at rest, by Newton's method with halved steps."""
        slopes = np.zeros(4 * self.segments)
        for _ in range(200):
            springs, gradient, hessian, positions, by_slopes = (
                np.array(value) for value in self._chains(slopes)
            )
            nodes = positions.reshape(2, -1, 3)
            energy, on_a, on_b, second = contact_forces(*nodes, count, self.segment_m)
            energy += float(springs.item())
            gradient = gradient.ravel() - by_slopes.T @ np.concatenate([on_a, on_b]).ravel()
            step = np.linalg.solve(hessian + by_slopes.T @ second @ by_slopes, -gradient)
            if np.max(np.abs(step)) < 1e-13:
                return float(np.sum(on_b[:, 2]))
            share = 1.0
            while share > 1e-6 and self._energy(slopes + share * step, count) > energy + 1e-18:
                share /= 2
            slopes = slopes + share * step
        raise RuntimeError(f"no equilibrium of {self.segments} segments with {count} points each")

    def _energy(self, slopes: np.ndarray, count: int) -> float:
        springs, _, _, positions, _ = self._chains(slopes)
        nodes = np.array(positions).reshape(2, -1, 3)
        return float(springs) + contact_forces(*nodes, count, self.segment_m)[0]


def crossed_cantilevers(approach_m: float) -> dict[str, object]:
    """Force of two cantilevers pressed together, over segments and N_q."""
    compliance = sum(arm**3 for arm in CROSSING_M) / (3 * BENDING_STIFFNESS)
    factor = 4 / 3 * LINE_STIFFNESS_N_M2 * math.sqrt(2 * DIAMETER_M)

    def excess(force: float) -> float:
        return force * compliance + (force / factor) ** (2 / 3) - approach_m

    exact = brentq(excess, 0.0, approach_m / compliance, xtol=1e-16, rtol=1e-14)
    computed = []
    for segments, counts in ((25, (2, 8, 32, 128, 512)), (50, (64, 256)), (100, (32, 128))):
        cantilevers = Cantilevers(segments, approach_m)
        computed += [
            {"segments": segments, "contact_points": count, "force_n": cantilevers.force_n(count)}
            for count in counts
        ]
    return {
        "crossing_m": list(CROSSING_M),
        "approach_m": approach_m,
        "source": "P = δ_0/(a_1³/(3 E I) + a_2³/(3 E I) + 1/k) with 1/k = (P/K)^(2/3)/P of crossed "
        "filaments, K = (4/3) k_l √(2 d); δ_0 is the approach",
        "closed_form_n": exact,
        "stiffness_n_m": exact / (exact / factor) ** (2 / 3),
        "computed": computed,
    }


def statics() -> dict[str, object]:
    """The section of that name."""
    return rounded(
        {
            "diameter_m": DIAMETER_M,
            "youngs_modulus_pa": YOUNGS_MODULUS_PA,
            "length_m": LENGTH_M,
            "stiffness_n_m2": LINE_STIFFNESS_N_M2,
            "parallel": parallel_filaments(),
            "crossed": [crossed_filaments(angle) for angle in (math.pi / 2, math.pi / 6)],
            "cantilevers": [crossed_cantilevers(approach) for approach in APPROACHES_M],
        }
    )


def main() -> None:
    """Command line."""
    output = DATA / "reference_row.json"
    arguments = parser_of("Write passes of rows of filaments that touch.", output, True).parse_args()
    entries = entries_of(result, cases(), arguments)
    if arguments.only is not None:
        return
    write_cases(
        arguments.output,
        cvodes.command("reference_row.py", TOLERANCE),
        entries,
        changes_from_default_to_hertz_stiffness=json.dumps(stiffness_changes(entries)),
        statics=json.dumps(statics(), ensure_ascii=False, indent=1),
    )
    write_trajectories(trajectory_text, shown(), arguments)


if __name__ == "__main__":
    main()
