"""Energies of filaments and their contacts with each other, and equations of motion of a case."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import casadi
import cases
import motion
import numpy as np
from cases import RIGHT, Case, Filament
from motion import velocity_of
from workpieces import Contact, friction, tangential, workpiece_of

# Terms of the series of α² in the square of the chord, which is below 2: the last is below 1e-9 of
# the first at a right angle, and below 1e-16 at 0.8 rad.
TERMS = 20

OBSERVED = (
    "contact_normal_force_n",
    "tip_deflection_m",
    *(f"tip_{axis}_m" for axis in "xyz"),
    *(f"tip_velocity_{axis}_m_s" for axis in "xyz"),
)
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
