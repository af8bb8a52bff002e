"""Passes of filaments over workpieces, by a code that shares nothing with the Rust code.

Input: the cases of `cases.py`.
Output: files in tests/data and derivations/trajectories; or with `--check` a comparison with the
committed files.

Method:

1. The energies of a chain in space are stated once, in polar angles φ_k from z and azimuths θ_k.
   The planar chain is the same with φ_k = π/2. CasADi differentiates them (`motion.py`).
2. Workpieces are plug-ins (`workpieces.py`). Friction is regularised Coulomb friction.
3. Points of a filament are pressed off the nearest point of a neighbour's polyline, along the
   gradient of the energy E_ab. Friction between filaments acts half-way between the two points.
4. The active set lists the nodes that meet faces, the features that meet edges, and the points that
   meet neighbours. The equations are smooth while the set does not change, and the solver starts
   again where it does. Nothing is smoothed but friction, as MODEL.md says.
5. The integrals of the metrics are states of the solver; contact times are sums of windows.

Each case is computed at two tolerances. The file states the largest difference as its own error.

SI units, angles in radians. Frames and symbols are those of MODEL.md.

Run from the repository root:

    python derivations/passes.py edges
    python derivations/passes.py edges --only "leaving, 5 m/s" --check
"""

import argparse
import json
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import casadi
import cases
import files
import motion
import numpy as np
import scipy
from cases import GROUPS, NORMAL, RIGHT, Case, Filament, Group
from files import relative_differences, rounded
from motion import RATE_UNIT_RAD_S, Window, velocity_of
from scipy.optimize import minimize
from workpieces import Contact, friction, nearest_of, tangential, workpiece_of

# Terms of the series of α² in the square of the chord, which is below 2: the last is below 1e-9 of
# the first at a right angle, and below 1e-16 at 0.8 rad.
TERMS = 20
# Longest windows of filaments that press on each other, and of contact all round.
LONGEST_WINDOW_OF_ROW_S, LONGEST_WINDOW_ALL_ROUND_S = 1e-4, 1e-3
# Largest relative difference of the impulses of successive turns that are steady.
STEADY = 1e-3
# Tolerance of the second run, as a multiple of the first one's.
LOOSER = 10.0
# The pass that is written over time, by its group and index, and its rows, both ends included.
TRAJECTORY, ROWS = (GROUPS["contacts_cvodes"], 1), 1001
# Its columns, with the errors that the file states.
COLUMNS = {
    "time_s": 1e-13,
    "contact_normal_force_n": 1e-7,
    NORMAL: 2e-12,
    **dict.fromkeys(("tip_x_m", "tip_y_m", "tip_deflection_m"), 4e-11),
}
# Relative differences from committed numbers, beyond three times the error that the file states:
# the new run has an error, too.
CHECK_TOLERANCE, CHECK_FACTOR = 1e-7, 3.0
# Errors of committed cases that tighter tolerances have shown, and that their files do not state.
KNOWN_ERRORS = {"4 turns": 5e-5}
# Penetrations are sampled about every microsecond, committed peaks of rows every quarter of one. No
# error is stated of velocities.
CHECK_TOLERANCES = {
    ("largest_edge_penetration_m",): 0.03,
    ("final_tip_velocity_m_s",): 1e-5,
    ("filaments", "peak_contact_normal_force_n"): 1e-3,
    ("filaments", "max_tip_deflection_m"): 1e-6,
}

OBSERVED = (
    "contact_normal_force_n",
    "tip_deflection_m",
    *(f"tip_{axis}_m" for axis in "xyz"),
    *(f"tip_velocity_{axis}_m_s" for axis in "xyz"),
)
FORCE_AND_DEFLECTION, TIP = slice(2), slice(2, 8)
# Integrals of the force of a neighbour on the column ahead.
OF_PAIR = (
    "normal_impulse_n_s",
    *(f"impulse_{axis}_n_s" for axis in "xyz"),
    "friction_work_j",
    "damping_work_j",
)


@dataclass(frozen=True)
class Clamp:
    """Root and direction of a filament at the body, its azimuth in the plane, and Ω of the body."""

    root: casadi.SX
    direction: casadi.SX
    azimuth: casadi.SX
    body_rate: casadi.DM

    @classmethod
    def of(cls, case: Case, start_angle_rad: float, time: casadi.SX, column: int) -> "Clamp":
        """Returns the clamp of a column."""
        tool, pose, axis = case.tool, casadi.DM(case.tool.pose), casadi.DM([0.0, 0.0, 1.0])
        body = start_angle_rad - column * case.behind_rad + case.rate_rad_s * time
        radial = casadi.vertcat(casadi.cos(body), casadi.sin(body), 0.0)
        radius, along = tool.root_m(tool.place_m)
        along += column * case.brush.along_m
        elevation = RIGHT - tool.filament_angle_rad + case.lateral_tilt_rad
        root = pose @ (radius * radial + along * axis)
        direction = pose @ (math.cos(elevation) * radial + math.sin(elevation) * axis)
        return cls(root, direction, body, case.rate_rad_s * pose @ axis)


@dataclass(frozen=True)
class Chain:
    """Energies of a filament in J, D in W, and its nodes 0 … n and directions as columns."""

    kinetic: casadi.SX
    springs: casadi.SX
    dissipation: casadi.SX
    nodes: casadi.SX
    velocities: casadi.SX
    directions: casadi.SX
    direction_rates: casadi.SX


def chain(
    instant: Sequence[casadi.SX], coordinates: casadi.SX, clamp: Clamp, filament: Filament
) -> Chain:
    """States the energies of a filament.

    `coordinates` are its part of those of `instant`: θ_1, …, θ_n in the plane of rotation, and
    φ_1, θ_1, …, φ_n, θ_n in space.
    """
    n, h = filament.segments, filament.segment_m
    is_planar = coordinates.numel() == n
    damping_s, relaxed = filament.damping_time_s, [0.0, *filament.relaxed_angles_rad]

    def turning(direction: casadi.SX, rate: casadi.SX) -> casadi.SX:
        """Returns e × (ė − Ω × e), without spin: the rate of a segment seen from the body."""
        return casadi.cross(direction, rate - casadi.cross(clamp.body_rate, direction))

    kinetic, springs, dissipation = 0, 0, 0
    nodes, velocities = [clamp.root], [velocity_of(clamp.root, instant)]
    directions, rates = [clamp.direction], [velocity_of(clamp.direction, instant)]
    azimuth_before = clamp.azimuth
    constants = zip(filament.masses_kg, filament.stiffnesses_n_m, strict=True)
    for k, (mass, stiffness) in enumerate(constants):
        if is_planar:
            azimuth, sine, cosine = coordinates[k], 1.0, 0.0
        else:
            polar, azimuth = coordinates[2 * k], coordinates[2 * k + 1]
            sine, cosine = casadi.sin(polar), casadi.cos(polar)
        direction = casadi.vertcat(sine * casadi.cos(azimuth), sine * casadi.sin(azimuth), cosine)
        rate = velocity_of(direction, instant)
        kinetic += mass / 2 * casadi.sumsqr(velocities[k] + h / 2 * rate)
        kinetic += mass * h**2 / 24 * casadi.sumsqr(rate)
        if is_planar:
            bend_squared = (azimuth - azimuth_before - (relaxed[k + 1] - relaxed[k])) ** 2
        else:
            bend_squared = angle_squared(direction - directions[k])
        springs += stiffness / 2 * bend_squared
        bend_rate = turning(direction, rate) - turning(directions[k], rates[k])
        dissipation += damping_s * stiffness / 2 * casadi.sumsqr(bend_rate)
        nodes.append(nodes[k] + h * direction)
        velocities.append(velocities[k] + h * rate)
        directions.append(direction)
        rates.append(rate)
        azimuth_before = azimuth
    columns = (casadi.horzcat(*each) for each in (nodes, velocities, directions[1:], rates[1:]))
    return Chain(kinetic, springs, dissipation, *columns)


def angle_squared(chord: casadi.SX) -> casadi.SX:
    """Returns α² = (2 asin(|chord|/2))² = Σ 2 (k−1)!²/(2k)! |chord|^(2k)."""
    square, total = casadi.sumsqr(chord), 0
    for k in range(TERMS, 0, -1):
        total = (total + 2 * math.factorial(k - 1) ** 2 / math.factorial(2 * k)) * square
    return total


class Between:
    """Contacts of columns with their neighbours: forces, moments on segments, rates of integrals.

    There are slots for points that touch. A slot has these parameters: for each pair of columns 1
    if the point lies on the one ahead, −1 if it lies on the other; 1 if the nearest point is a
    node, and then its place on its segment; the weights of all nodes in the point, and in both ends
    of the nearest point's segment; the weights of all segments in the turning of both surfaces.
    """

    def __init__(self, case: Case, chains: Sequence[Chain], slots: int) -> None:
        self._case, self._pairs, n = case, case.brush.columns - 1, case.filament.segments
        self._nodes, self._segments = case.brush.columns * (n + 1), case.brush.columns * n
        self._sizes = [self._pairs, 1, 1, *[self._nodes] * 3, self._segments]
        self.symbols = casadi.SX.sym("slots", sum(self._sizes), slots)
        self.on_nodes = casadi.SX.zeros(3, self._nodes)
        self.moments = casadi.SX.zeros(3, self._segments)
        self.rates = casadi.SX.zeros(len(OF_PAIR), self._pairs)
        nodes = casadi.horzcat(*(each.nodes for each in chains))
        velocities = casadi.horzcat(*(each.velocities for each in chains))
        spins = [
            casadi.cross(each.directions[:, k], each.direction_rates[:, k])
            for each in chains
            for k in range(n)
        ]
        for slot in range(slots):
            self._press(self.symbols[:, slot], nodes, velocities, casadi.horzcat(*spins))

    def _press(
        self, slot: casadi.SX, nodes: casadi.SX, velocities: casadi.SX, spins: casadi.SX
    ) -> None:
        """Adds the point of a slot."""
        brush, h = self._case.brush, self._case.filament.segment_m
        parts = casadi.vertsplit(slot, [0, *np.cumsum(self._sizes).tolist()])
        signs, is_node, node_place, own, inner, outer, turning = parts
        active = casadi.sumsqr(signs)
        nearest = casadi.dot(nodes @ (own - inner), nodes @ (outer - inner)) / h**2
        place = is_node * node_place + (1 - is_node) * nearest
        weights = own - inner - place * (outer - inner)
        # An empty slot gets a finite distance.
        offset = nodes @ weights + (1 - active) * casadi.SX([1.0, 0.0, 0.0])
        distance = casadi.norm_2(offset)
        normal, relative = offset / distance, velocities @ weights
        elastic = active * brush.stiffness_n_m2 / 2 * h / brush.contact_points
        elastic *= cases.DIAMETER_M - distance
        closing = -casadi.dot(relative, normal)
        pressure = elastic * casadi.fmax(0.0, 1 + brush.damping_s_m * closing)
        # Half-way: from the point by −offset/2, from the nearest point by +offset/2.
        lever = 0.5 if brush.friction_at == "surfaces" else 0.0
        relative -= lever * casadi.cross(spins @ turning, offset)
        sliding = tangential(relative, normal)
        rubbing = friction(brush.friction_coefficient, pressure, sliding)
        force = pressure * normal + rubbing
        # The power of the force pairs these with velocities and spins.
        self.on_nodes += force @ weights.T
        self.moments -= lever * casadi.cross(offset, force) @ turning.T
        works = casadi.vertcat(-casadi.dot(rubbing, sliding), (pressure - elastic) * closing)
        self.rates += casadi.vertcat(pressure, casadi.SX.zeros(3), works) @ (signs**2).T
        self.rates[1:4, :] += force @ signs.T

    def parameters(self, active: np.ndarray) -> np.ndarray:
        """Returns the active set of the points in the form of the equations.

        Points are those of a column on the next one, segment by segment, then the other way round.
        """
        n, count = self._case.filament.segments, self._case.brush.contact_points
        found = np.zeros(self.symbols.shape)
        for slot, number in enumerate(np.flatnonzero(active)):
            side, of_filament = divmod(int(number), n * count)
            pair, is_behind = divmod(side, 2)
            a, b = (pair + 1, pair) if is_behind else (pair, pair + 1)
            k, i = divmod(of_filament, count)
            place = (i + 0.5) / count
            # The feature is 2 j at node j and 2 j − 1 inside segment j, both counted from 1.
            node, is_inside = divmod(int(active[number]) - 1, 2)
            segment = node if is_inside else max(node - 1, 0)
            following = segment if is_inside else min(node, n - 1)
            parts = np.split(found[:, slot], np.cumsum(self._sizes)[:-1])
            signs, is_node, node_place, own, inner, outer, turning = parts
            signs[pair] = -1.0 if is_behind else 1.0
            is_node[0], node_place[0] = float(not is_inside), float(node > 0)
            own[a * (n + 1) + k], own[a * (n + 1) + k + 1] = 1 - place, place
            inner[b * (n + 1) + segment] = outer[b * (n + 1) + segment + 1] = 1.0
            turning[a * n + k] = 1.0
            # The surface at a node turns with both segments.
            turning[b * n + segment] += 0.5
            turning[b * n + following] += 0.5
        return found.ravel("F")


class Equations(motion.Equations):
    """Equations of motion of the filaments of a case; coordinates column by column."""

    def __init__(
        self, case: Case, integrals: tuple[str, ...], start_angle_rad: float, slots: int
    ) -> None:
        self._case, self._workpiece, self._n = case, workpiece_of(case), case.filament.segments
        count = (1 if case.is_planar else 2) * self._n
        sizes = ("t", 1), ("q", count * case.brush.columns), ("v", count * case.brush.columns)
        instant = time, coordinates, _ = [casadi.SX.sym(*each) for each in sizes]
        clamps = [Clamp.of(case, start_angle_rad, time, i) for i in range(case.brush.columns)]
        chains = [
            chain(instant, coordinates[i * count : (i + 1) * count], clamp, case.filament)
            for i, clamp in enumerate(clamps)
        ]
        symbols, contacts = [], []
        for each in chains:
            of_contact = self._workpiece.symbols()
            contact = Contact(case, each.nodes, each.velocities)
            self._workpiece.press(contact, each.nodes, time, of_contact)
            contacts.append(contact)
            symbols += of_contact
        self._between = between = Between(case, chains, slots)
        parameters = casadi.vertcat(*map(casadi.vec, [*symbols, between.symbols]))

        nodes = casadi.horzcat(*(each.nodes for each in chains))
        on_nodes = casadi.horzcat(*(each.on_nodes for each in contacts)) + between.on_nodes
        force = casadi.jtimes(casadi.vec(nodes), coordinates, casadi.vec(on_nodes), True)
        directions = casadi.horzsplit(casadi.horzcat(*(each.directions for each in chains)))
        moments = casadi.horzsplit(between.moments)
        for direction, moment in zip(directions, moments, strict=True) if slots > 0 else ():
            # (e × ė)·m = ė·(m × e)
            on_direction = casadi.cross(moment, direction)
            force += casadi.jtimes(direction, coordinates, on_direction, True)
        kinetic, springs, dissipation = (
            sum(getattr(each, name) for each in chains)
            for name in ("kinetic", "springs", "dissipation")
        )
        integrands = casadi.vertcat(
            *(each.rates(integrals) for each in contacts), casadi.vec(between.rates)
        )
        self.derive(instant, parameters, (kinetic, springs, dissipation), force, integrands)
        self.positions = casadi.Function("positions", instant[:2], [nodes])
        filaments = zip(clamps, chains, contacts, strict=True)
        observed = [self._observe(*each, case.filament.length_m) for each in filaments]
        results = [casadi.horzcat(*observed)]
        self.observed = casadi.Function("observed", [*instant, parameters], results)

    @staticmethod
    def _observe(clamp: Clamp, chain: Chain, contact: Contact, length_m: float) -> casadi.SX:
        """Returns a column of OBSERVED.

        The deflection is the distance from the tip to the undeformed filament.
        """
        tip = chain.nodes[:, -1]
        offset = tip - clamp.root
        along = casadi.fmin(casadi.fmax(casadi.dot(offset, clamp.direction), 0), length_m)
        deflection = casadi.norm_2(offset - along * clamp.direction)
        return casadi.vertcat(contact.pressure, deflection, tip, chain.velocities[:, -1])

    def parameters(self, active: np.ndarray) -> np.ndarray:
        """Returns the active set in the form of the equations."""
        columns = self._case.brush.columns
        end = columns * (self._n + self._workpiece.edge_count)
        found = [self._workpiece.parameters(each) for each in active[:end].reshape(columns, -1)]
        if columns > 1:
            found.append(self._between.parameters(active[end:]))
        return np.concatenate(found)


class Statics:
    """Potential of one filament in space that turns rigidly over a plane, at t = 0.

    V = E_spring − ½ ω² Σ ∫ρ² dm + ½ k_c Σ δ², with the distance ρ from the tool's axis.
    """

    def __init__(self, case: Case, start_angle_rad: float) -> None:
        self._case, size = case, 2 * case.filament.segments
        instant = [casadi.SX.sym(*each) for each in (("t", 1), ("q", size), ("v", size))]
        clamp = Clamp.of(case, start_angle_rad, casadi.SX(0.0), 0)
        self._clamp = np.array(casadi.evalf(clamp.direction)).ravel()
        at_rest = chain(instant, instant[1], clamp, case.filament)
        axis, h = casadi.DM(case.tool.pose[:, 2]), case.filament.segment_m

        def squared_distance(vector: casadi.SX) -> casadi.SX:
            return casadi.sumsqr(vector) - casadi.dot(vector, axis) ** 2

        centrifugal, stored, height = 0, 0, casadi.SX.sym("height")
        for k, mass in enumerate(case.filament.masses_kg):
            inner, direction = at_rest.nodes[:, k], at_rest.directions[:, k]
            spread = squared_distance(inner + h / 2 * direction)
            spread += h**2 / 12 * squared_distance(direction)
            centrifugal += mass / 2 * case.rate_rad_s**2 * spread
            depth = casadi.fmax(0, height - at_rest.nodes[1, k + 1])
            share = case.filament.contact_share(k + 1)
            stored += share * case.contact_stiffness_n_m / 2 * depth**2
        potential = at_rest.springs - centrifugal + stored
        hessian, gradient = casadi.hessian(potential, instant[1])
        results = [potential, gradient, hessian]
        self._potential = casadi.Function("potential", [instant[1], height], results)
        self._nodes = casadi.Function("nodes", [instant[1]], [at_rest.nodes])

    def equilibrium(self, height_m: float = -1.0) -> tuple[np.ndarray, np.ndarray]:
        """Returns coordinates and nodes at rest over a plane, which is out of reach by default."""
        x, y, z = self._clamp
        straight = np.tile([math.acos(z), math.atan2(y, x)], self._case.filament.segments)
        # Energies are some 1e-4 J, angles 1 rad.
        scale = 1e4
        q = minimize(
            lambda q: scale * float(self._potential(q, height_m)[0]),
            straight,
            method="trust-exact",
            jac=lambda q: scale * np.array(self._potential(q, height_m)[1]).ravel(),
            hess=lambda q: scale * np.array(self._potential(q, height_m)[2]),
            options={"gtol": 1e-9, "maxiter": 10_000},
        ).x
        # Newton's method removes the rest, which energies do not resolve.
        for _ in range(3):
            _, gradient, hessian = (np.array(each) for each in self._potential(q, height_m))
            q = q - np.linalg.solve(hessian, gradient.ravel())
        if np.min(np.linalg.eigvalsh(hessian)) <= 0.0:
            raise RuntimeError(f"{self._case.name}: no minimum")
        return q, np.array(self._nodes(q)).T


class Pass(motion.Motion):
    """The motion of a case.

    An active set lists the contacts of every filament with the workpiece. The points of filaments
    on their neighbours follow: 0 in the air, 2 k + 1 at node k, 2 k inside segment k.
    """

    def __init__(self, case: Case, group: Group, tolerance: float) -> None:
        self.case, self.workpiece, self._n = case, workpiece_of(case), case.filament.segments
        self.integral_names, self._known = group.integrals, {}
        earlier_rad, self._q = self._free_start()
        self._start_angle_rad = case.start_angle_rad - earlier_rad
        ends = [end + 2 * earlier_rad / case.rate_rad_s for end in case.ends_of_turns_s]
        super().__init__(case.label, tolerance, ends)
        if case.brush.columns > 1:
            self.longest_window_s = LONGEST_WINDOW_OF_ROW_S
        elif case.is_all_round:
            self.longest_window_s = LONGEST_WINDOW_ALL_ROUND_S

    def _free_start(self) -> tuple[float, np.ndarray]:
        """Returns the angle by which filaments start earlier, and their coordinates.

        Radial filaments are straight along the clamp, or relaxed. Others are in equilibrium: a bent
        filament may touch before an undeformed one would.
        """
        case = self.case
        if case.tool.filament_angle_rad == RIGHT:
            return 0.0, np.concatenate([self._straight(i) for i in range(case.brush.columns)])
        for earlier_rad in np.arange(0.0, 2.0, 0.02):
            q, line = Statics(case, case.start_angle_rad - earlier_rad).equilibrium()
            if not np.any(self.workpiece.active_sets(line[None], np.zeros(1))):
                return float(earlier_rad), q
        raise RuntimeError(f"{case.label}: touches everywhere")

    def _straight(self, column: int) -> np.ndarray:
        """Returns the coordinates of a relaxed filament along the clamp."""
        clamp = Clamp.of(self.case, self.case.start_angle_rad, 0.0, column)
        if self.case.is_planar:
            return float(clamp.azimuth) + self.case.filament.relaxed_angles_rad
        x, y, z = np.array(clamp.direction).ravel()
        return np.tile([math.acos(z), math.atan2(y, x)], self._n)

    def start(self) -> np.ndarray:
        """Returns the state at t = 0, turning rigidly with the body."""
        omega, rates = self.case.rate_rad_s * self.case.tool.pose[:, 2], []
        if self.case.is_planar:
            rates = [self.case.rate_rad_s] * len(self._q)
        for polar, azimuth in [] if rates else self._q.reshape(-1, 2):
            # ė of e = (sin φ cos θ, sin φ sin θ, cos φ), along the directions of growing φ and θ.
            (sin, cos), (s, c) = (np.sin(polar), np.cos(polar)), (np.sin(azimuth), np.cos(azimuth))
            rate = np.cross(omega, [sin * c, sin * s, cos])
            rates += [rate @ np.array([cos * c, cos * s, -sin]), rate @ np.array([-s, c, 0]) / sin]
        integrals = np.zeros(self.equations_of(None).integral_count)
        return np.concatenate([self._q, np.array(rates) / RATE_UNIT_RAD_S, integrals])

    def equations_of(self, active: np.ndarray | None) -> Equations:
        """Returns the equations with slots for at least the points that touch."""
        slots, touching = 0, 0 if active is None else np.count_nonzero(self.parts(active)[1])
        while slots < touching:
            slots = max(2, 2 * slots)
        if slots not in self._known:
            arguments = self.integral_names, self._start_angle_rad, slots
            self._known[slots] = Equations(self.case, *arguments)
        return self._known[slots]

    def parts(self, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the parts of an active set by columns, and by pairs of them."""
        columns, count = self.case.brush.columns, self._n + self.workpiece.edge_count
        points = active[columns * count :]
        of_pairs = points.reshape(columns - 1, len(points) // max(columns - 1, 1))
        return active[: columns * count].reshape(columns, count), of_pairs

    def lines(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Returns the nodes (times, columns, n + 1, 3) of states as columns."""
        equations = self.equations_of(None)
        nodes = np.array(equations.positions(times[None], states[: equations.count]))
        return nodes.T.reshape(len(times), self.case.brush.columns, self._n + 1, 3)

    def active_sets(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Returns the active set at each time, as rows."""
        lines, columns = self.lines(times, states), self.case.brush.columns
        of_all = lines.reshape(-1, self._n + 1, 3)
        on_workpiece = self.workpiece.active_sets(of_all, np.repeat(times, columns))
        rows = [on_workpiece.reshape(len(times), -1)]
        for pair in range(columns - 1):
            ahead, behind = lines[:, pair], lines[:, pair + 1]
            rows += [self._near(ahead, behind), self._near(behind, ahead)]
        return np.concatenate(rows, axis=1).astype(int)

    def _near(self, own: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Returns the features of lines `other` that points of lines `own` touch, or 0."""
        count = self.case.brush.contact_points
        places = ((np.arange(count) + 0.5) / count)[:, None]
        starts, ends = own[:, :-1, None, :], own[:, 1:, None, :]
        points = (starts + places * (ends - starts)).reshape(len(own), -1, 3)
        feature, _, distance = nearest_of(other[:, None], points)
        return np.where(distance < cases.DIAMETER_M, 1 + feature, 0)

    def observed(self, window: Window) -> np.ndarray:
        """Returns OBSERVED of filaments (points, columns, …)."""
        n, count = window.equations.count, len(window.times)
        states = window.states[:n], window.states[n : 2 * n] * RATE_UNIT_RAD_S
        found = window.equations.observed(window.times[None], *states, window.parameters)
        return np.array(found).T.reshape(count, self.case.brush.columns, -1)

    def peaks(self, window: Window, least: np.ndarray) -> np.ndarray:
        """Returns the largest F_n and deflection of each column in a window, (columns, 2).

        Peaks that may exceed `least` are refined: the motion between the points beside the largest
        value is integrated again. Where friction changes its sign, the force turns too fast for an
        interpolation.
        """
        values = self.observed(window)[..., FORCE_AND_DEFLECTION]
        peaks = np.max(values, axis=0)
        for place in map(tuple, np.argwhere((peaks > 0.0) & (peaks > 0.98 * least))):
            i = int(np.argmax(values[:, *place]))
            for j in range(max(i - 1, 0), min(i + 1, len(window.times) - 1)):
                ends = window.times[j : j + 2].tolist()
                fine = self.window(*ends, window.states[:, j], window.active)
                found = self.observed(fine)[..., FORCE_AND_DEFLECTION]
                peaks[place] = max(peaks[place], float(np.max(found[:, *place])))
        return peaks


def metrics_of(case: Case, group: Group, tolerance: float) -> dict[str, object]:
    """Integrates a case, and returns metrics of filaments, of neighbours, and of the whole.

    Integrals and times are those of the last turn.
    """
    motion, columns = Pass(case, group, tolerance), case.brush.columns
    times, pair_times = np.zeros(columns), np.zeros(columns - 1)
    counts, peaks = np.zeros(columns, dtype=int), np.zeros((columns, 2))
    touched, nominal_time, deepest, faces = np.zeros(columns, dtype=bool), 0.0, 0.0, set()
    turns, before = [], 0.0
    entry = cases.LEAD_ANGLE_RAD / case.rate_rad_s
    nominal_contact_time = 2 * case.half_angle_rad / case.rate_rad_s
    for window in motion.windows():
        on_workpiece, points = motion.parts(window.active)
        touched_before, touched = touched, np.any(on_workpiece > 0, axis=1)
        counts = counts + (touched & ~touched_before)
        start, end = window.times[0], window.times[-1]
        times = times + (end - start) * touched
        pair_times = pair_times + (end - start) * np.any(points > 0, axis=1)
        nominal_part = min(end, entry + nominal_contact_time) - max(start, entry)
        nominal_time += max(0.0, nominal_part) if touched[0] else 0.0
        on_faces, on_edges = np.split(on_workpiece, [case.filament.segments], axis=1)
        faces |= set(on_faces.ravel().tolist()) - {0}
        if np.any(on_edges):
            lines = motion.lines(window.times, window.states)[:, 0]
            depths = motion.workpiece.edge_depths(lines)[:, on_edges[0] > 0]
            deepest = max(deepest, float(np.max(depths)))
        if group.has_peaks:
            peaks = np.maximum(peaks, motion.peaks(window, peaks))
        if window.ends_turn:
            turns.append(window.integrals(-1) - before)
            before, of_turn = window.integrals(-1), (times.tolist(), pair_times.tolist())
            times, pair_times = np.zeros_like(times), np.zeros_like(pair_times)
            # In the first turn the workpiece comes up.
            is_steady = len(turns) > 2 and abs(turns[-1][0] / turns[-2][0] - 1) < STEADY
            if case.is_all_round and is_steady:
                break
    of_filaments, of_pairs = np.split(turns[-1], [columns * len(group.integrals)])
    of_filaments = of_filaments.reshape(columns, -1).tolist()
    of_pairs = of_pairs.reshape(-1, len(OF_PAIR)).tolist()
    tips = motion.observed(window)[-1][:, TIP].reshape(columns, 2, 3)
    return {
        "filaments": [
            {
                "column": i,
                **dict(zip(group.integrals, of_filaments[i], strict=True)),
                "contact_time_s": of_turn[0][i],
                "contact_count": int(counts[i]),
                "peak_contact_normal_force_n": float(peaks[i, 0]),
                "max_tip_deflection_m": float(peaks[i, 1]),
                "final_tip_m": tips[i, 0],
                "final_tip_velocity_m_s": tips[i, 1],
            }
            for i in range(columns)
        ],
        "neighbours": [
            {"columns": [i, i + 1], **dict(zip(OF_PAIR, each, strict=True)), "contact_time_s": time}
            for i, (each, time) in enumerate(zip(of_pairs, of_turn[1], strict=True))
        ],
        "nominal_contact_time_s": nominal_contact_time,
        "contact_time_ratio": nominal_time / nominal_contact_time,
        "end_s": float(window.times[-1]),
        "turn_contact_normal_impulses_n_s": [float(turn[0]) for turn in turns],
        "touches_at_end": bool(np.any(window.active)),
        "faces_touched": sorted(faces),
        "largest_edge_penetration_m": deepest,
        "changes_of_touch": motion.changes,
    }


# Entries of the files, by groups. Inputs are exact, the rest is rounded.


def over_profiles(case: Case, group: Group, tolerance: float) -> dict[str, object]:
    """Returns the entry of a case of the groups edges, profiles and sliding."""
    found = metrics_of(case, group, tolerance)
    (values,) = found.pop("filaments")
    if cases.EDGE_ANGLES[0] in values:
        # Angles are those of edges between faces.
        moments, work = [values.pop(name) for name in cases.EDGE_ANGLES], values[cases.SLIDING[1]]
        if case.workpiece.kind in ("edge", "chamfer"):
            mean, square = (moment / work if work > 0 else 0.0 for moment in moments)
            values[cases.EDGE_ANGLES[0]] = mean
            values[cases.EDGE_ANGLES[1]] = math.sqrt(max(0.0, square - mean**2))
    for name in ("final_tip_m", "final_tip_velocity_m_s"):
        values[name] = values[name][:2]
    unused = ["column", "contact_count", "max_tip_deflection_m"]
    unused += [] if group.has_peaks else ["peak_contact_normal_force_n"]
    for name in ("neighbours", "nominal_contact_time_s", "contact_time_ratio"):
        del found[name]
    return {
        "name": case.name,
        "filament": case.filament.inputs(),
        "workpiece": case.workpiece.inputs(),
        **case.process,
        "friction_coefficient": case.friction_coefficient,
        "turns": case.turns,
        "start_angle_rad": rounded(case.start_angle_rad),
        **{name: rounded(value) for name, value in values.items() if name not in unused},
        **rounded(found),
    }


def of_brush(case: Case, group: Group, tolerance: float) -> dict[str, object]:
    """Returns the entry of a case of the groups row and space."""
    found = metrics_of(case, group, tolerance)
    for filament in found["filaments"]:
        del filament["final_tip_velocity_m_s"]
        filament["final_tip_m"] = filament["final_tip_m"][: 2 if case.is_planar else 3]
    is_rubbing = case.is_planar and case.brush.friction_coefficient > 0.0
    return {
        "name": case.name,
        "input": case.inputs(),
        **({"friction_at": case.brush.friction_at} if is_rubbing else {}),
        "start_angle_rad": rounded(case.start_angle_rad),
        **{key: rounded(found[key]) for key in ("end_s", "filaments", "neighbours")},
        "changes_of_touch": found["changes_of_touch"],
    }


def of_trim(case: Case, group: Group, tolerance: float) -> dict[str, object]:
    """Returns the entry of a case of the group poses: its mean filament."""
    sums = dict.fromkeys((*group.integrals, "nominal_contact_time_s", "contact_time_s"), 0.0)
    for weight, filament in case.of_trim:
        found = metrics_of(filament, group, tolerance)
        values = found | found["filaments"][0]
        for name in sums:
            sums[name] += float(weight * values[name])
    return {"name": case.name, "input": case.inputs(), **rounded(sums)}


def of_tool(case: Case, group: Group, tolerance: float) -> dict[str, object]:
    """Returns the entry of a case of the groups contacts and calibration.

    F_n,w = p_n N_f ω/(2π), and in the same way F_t,w from −∫ F_x dt.
    """
    found = metrics_of(case, group, tolerance)
    values, rate = found | found["filaments"][0], case.brush.filament_count / case.turn_s
    forces = {"tool_contact_normal_force_n": rate * values[NORMAL]}
    if not group.has_peaks:
        forces["tool_tangential_force_n"] = -rate * values["contact_impulse_x_n_s"]
        return case.process | rounded(forces)
    names = ["contact_time_s", "contact_time_ratio", "contact_count", NORMAL]
    names += ["peak_contact_normal_force_n", "max_tip_deflection_m"]
    return case.process | rounded({name: values[name] for name in names} | forces)


ENTRY_OF = {
    **dict.fromkeys(("contacts_cvodes", "calibration"), of_tool),
    **dict.fromkeys(("edges", "profiles", "sliding"), over_profiles),
    **dict.fromkeys(("segments", "row", "space"), of_brush),
    "poses": of_trim,
}


def free_cup(case: Case) -> dict[str, object]:
    """Returns the distance from the axis and the height over the root of a tip without contact."""
    _, nodes = Statics(case, 0.0).equilibrium()
    x, y, z = case.tool.pose.T @ nodes[-1]
    length, segments = case.filament.length_m, case.filament.segments
    inputs = {"length_m": length, "brushing_velocity_m_s": case.brushing_velocity_m_s}
    place = {"radius_m": math.hypot(x, y), "height_m": float(z)}
    return {**inputs, "segments": segments, **rounded(place)}


def flat_cup(case: Case) -> dict[str, object]:
    """Returns the force on a filament of a cup that is pressed flat, without friction."""
    _, nodes = Statics(case, 0.0).equilibrium(case.height_m)
    depth = float(np.sum(np.maximum(0.0, case.height_m - nodes[1:, 1])))
    force = {"force_n": rounded(case.contact_stiffness_n_m * depth)}
    return {**case.process, "segments": case.filament.segments, **force}


# Sections of the file of poses.
STATICS = {"free_cups": (free_cup, cases.free_cups), "flat_cups": (flat_cup, cases.flat_cups)}


def own_errors(entry: dict[str, object], other: dict[str, object]) -> dict[str, object]:
    """Returns the largest differences of two runs, under the names that they have in the files."""
    found = list(relative_differences(entry, other))

    def largest(is_part: Callable[[tuple[str, ...]], bool]) -> float:
        errors = [e for path, e in found if is_part(path) and path not in CHECK_TOLERANCES]
        return float(f"{max(errors, default=0.0):.1g}")

    if "filaments" in entry:
        parts = {
            NORMAL: largest(lambda path: path == ("filaments", NORMAL)),
            "filaments": largest(lambda path: path[0] == "filaments" and path[-1] != NORMAL),
            "neighbours": largest(lambda path: path[0] == "neighbours"),
        }
        return {"own_errors": parts}
    of_sliding = (*cases.SLIDING, *cases.EDGE_ANGLES)
    errors = {"own_error": largest(lambda path: path[-1] not in of_sliding)}
    if cases.SLIDING[0] in entry:
        errors["own_error_of_sliding"] = largest(lambda path: path[-1] in of_sliding)
    return errors


def entry_of(name: str, case: Case, has_error: bool) -> dict[str, object]:
    """Returns the entry of a case of the group `name`, perhaps with its own error."""
    group = GROUPS[name]
    entry = ENTRY_OF[name](case, group, group.relative_tolerance)
    if has_error:
        looser = ENTRY_OF[name](case, group, LOOSER * group.relative_tolerance)
        entry |= own_errors(entry, looser)
    return entry


def command(group_name: str, group: Group) -> str:
    """Returns the command that made a file."""
    tolerance = group.relative_tolerance
    return (
        f"{files.made_by(f'passes.py {group_name}', casadi, np, scipy)}: cvodes, relative "
        f"tolerance {tolerance:g}, absolute {motion.ABSOLUTE_TOLERANCE * tolerance:g} of 1 rad, "
        f"{RATE_UNIT_RAD_S:g} rad/s, {motion.INTEGRAL_UNIT:g} N s"
    )


def path_of(group_name: str) -> Path:
    """Returns the path of the file of a group."""
    return files.DATA / f"reference_{group_name}.{'csv' if 'contacts' in group_name else 'json'}"


def write_group(group_name: str, entries: Sequence[dict[str, object]]) -> None:
    """Writes the file of a group."""
    group, path, sections = GROUPS[group_name], path_of(group_name), {}
    origin = command(group_name, group)
    if path.suffix == ".csv":
        columns = [key for key in entries[0] if key != "own_error"]
        table = np.array([[entry[column] for column in columns] for entry in entries])
        errors = f"Own errors: {', '.join(str(entry['own_error']) for entry in entries)}"
        files.write(path, files.table_text([origin, errors], columns, table))
        return
    if group_name == "poses":
        for name, (entry_of_cup, cups) in STATICS.items():
            lines = ",\n".join(json.dumps(entry_of_cup(case)) for case in cups())
            sections[name] = f"[\n{lines}\n]"
    if group_name == "calibration":
        case = group.cases[0]
        keys = "segments", "youngs_modulus_pa", "damping_ratio"
        constants = {key: getattr(case.filament, key) for key in keys}
        constants["friction_coefficient"] = case.friction_coefficient
        sections["constants"] = json.dumps(constants)
    files.write_cases(path, origin, entries, **sections)


def is_wrong(entry: dict[str, object], committed: dict[str, object], label: str) -> bool:
    """Prints the largest difference from a committed entry, over the allowed one."""
    stated = [committed.get("own_error", 0.0), committed.get("own_error_of_sliding", 0.0)]
    stated.append(KNOWN_ERRORS.get(committed.get("name"), 0.0))
    stated += committed.get("own_errors", {}).values()
    limit = CHECK_TOLERANCE + CHECK_FACTOR * max(stated)
    found = [
        (error / max(limit, CHECK_TOLERANCES.get(path, limit)), error, path)
        for path, error in relative_differences(entry, committed)
    ]
    worst, error, path = max(found)
    print(f"{label}: {error:.1e} in {'/'.join(path)}, {worst:.2f} of what is allowed", flush=True)
    return not worst <= 1.0


def run_group(group_name: str, only: str | None, is_check: bool) -> bool:
    """Writes or checks a group; `True` if a committed number is wrong."""
    all_cases, entries, wrong, committed = GROUPS[group_name].cases, [], False, {}
    if is_check and path_of(group_name).suffix == ".json":
        committed = json.loads(path_of(group_name).read_text(encoding="utf-8"))
    elif is_check:
        columns, table = files.read_table(path_of(group_name))
        committed["cases"] = [dict(zip(columns, row, strict=True)) for row in table.tolist()]
    for i, case in enumerate(all_cases):
        if case.label.startswith(only or ""):
            entries.append(entry_of(group_name, case, not is_check))
            if is_check:
                wrong |= is_wrong(entries[-1], committed["cases"][i], case.label)
            else:
                print(f"{case.label}: done", file=sys.stderr, flush=True)
    if not is_check:
        write_group(group_name, entries)
    for name, (entry_of_cup, cups) in STATICS.items() if group_name == "poses" and is_check else ():
        if name.startswith(only or ""):
            cups = [entry_of_cup(case) for case in cups()]
            wrong |= is_wrong({"cups": cups}, {"cups": committed[name]}, name)
    return wrong


def trajectory(tolerance: float) -> np.ndarray:
    """Returns the rows of the trajectory at a relative tolerance."""
    group, index = TRAJECTORY
    motion, rows = Pass(group.cases[index], group, tolerance), []
    for time, state, window in motion.sampled(ROWS):
        instant = replace(window, times=np.array([time]), states=state[:, None])
        named = dict(zip(OBSERVED, motion.observed(instant)[0, 0], strict=True))
        named |= {"time_s": time, NORMAL: instant.integrals(0)[0]}
        rows.append([named[column] for column in COLUMNS])
    return np.array(rows)


def run_trajectory(is_check: bool) -> bool:
    """Writes or checks the trajectory; `True` if it differs by more than allowed."""
    path = files.TRAJECTORY_FOLDER / "pass_casadi_cvodes.csv"
    group, index = TRAJECTORY
    case, tolerance = group.cases[index], group.relative_tolerance
    columns, rows = list(COLUMNS), trajectory(tolerance)
    if is_check:
        found, committed = files.read_table(path)
        changes = np.max(np.abs(rows - committed), axis=0) / list(COLUMNS.values())
        worst = float(np.max(changes)) / CHECK_FACTOR
        column = columns[int(np.argmax(changes))]
        print(f"trajectory: {worst:.2f} of what is allowed, in {column}", flush=True)
        return found != columns or not worst <= 1.0
    looser = trajectory(LOOSER * tolerance)
    comments = [
        command("trajectory", group),
        f"{case.label}, {case.filament.segments} segments; settings: "
        f"{json.dumps({'workpiece': case.workpiece.inputs(), **case.inputs()})}.",
        f"Own error, largest difference to relative tolerance {LOOSER * tolerance:g}: "
        f"{files.differences(columns, rows, looser)}.",
    ]
    files.write(path, files.table_text(comments, columns, rows, files.LEAST_VALUE))
    return False


def main() -> int:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description="Write or check passes of filaments.")
    parser.add_argument("group", choices=[*GROUPS, "trajectory"], help="names the file")
    parser.add_argument("--only", help="checks cases whose labels begin with this")
    parser.add_argument("--check", action="store_true", help="compare with the committed file")
    arguments = parser.parse_args()
    is_check = arguments.check or arguments.only is not None
    if arguments.group == "trajectory":
        return int(run_trajectory(is_check))
    return int(run_group(arguments.group, arguments.only, is_check))


if __name__ == "__main__":
    sys.exit(main())
