"""One contact in PyElastica: a Cosserat rod, explicit steps (position Verlet).

The rod has the chain's joints: one element more, which is held in the clamp, so that the first
bending joint is at the root, with twice the stiffness. Beyond the chain it stretches and shears, by
the material's moduli (G = E/3, PyElastica's default); its masses are at the nodes. So it is another
model, and p_n differs however small the step. What an explicit method cannot have is damping
proportional to the stiffness: it would need steps of a few ns. PyElastica's own dampers weigh on
the absolute motion (`AnalyticalLinearDamper`: p_n is wrong by a factor of forty) or on short waves
only (`LaplaceDissipationFilter`: wrong by half). So the damping comes from a damper of our own,
written against its interface, that solves for the rates implicitly, in O(n).

The contact is a force at the nodes, k_c δ, by its interface as well: its `RodPlaneContact` acts on
the elements' centres, cancels internal forces, and knows no p_n.
"""

import logging
import math
import time

import elastica
import numpy as np
from numba import njit
from paper_case import (
    BODY_RADIUS_M,
    CONTACT_STIFFNESS_N_M,
    DENSITY_KG_M3,
    DIAMETER_M,
    LENGTH_M,
    SEGMENTS,
    YOUNGS_MODULUS_PA,
    Case,
    Chain,
    Pass,
)

Array = np.ndarray


class Simulator(
    elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping
):
    """The features that are used."""


@njit
def _place(positions: Array, directors: Array, angle: float, radii: Array) -> None:
    """Nodes and the element in the clamp."""
    cosine, sine = math.cos(angle), math.sin(angle)
    for node in range(2):
        positions[0, node] = radii[node] * cosine
        positions[1, node] = radii[node] * sine
        positions[2, node] = 0.0
    # Rows: z, then across, then along the rod.
    for row, (x, y, z) in enumerate(((0.0, 0.0, 1.0), (sine, -cosine, 0.0), (cosine, sine, 0.0))):
        directors[row, 0, 0], directors[row, 1, 0], directors[row, 2, 0] = x, y, z


@njit
def _move(velocities: Array, spins: Array, angle: float, rate: float, radii: Array) -> None:
    """Their rates."""
    for node in range(2):
        velocities[0, node] = -radii[node] * rate * math.sin(angle)
        velocities[1, node] = radii[node] * rate * math.cos(angle)
        velocities[2, node] = 0.0
    spins[0, 0], spins[1, 0], spins[2, 0] = rate, 0.0, 0.0


@njit
def _press(positions: Array, forces: Array, plane: float, stiffness: float) -> float:
    """Adds the contact forces and returns their sum."""
    total = 0.0
    for node in range(2, positions.shape[1]):
        penetration = plane - positions[1, node]
        if penetration > 0.0:
            forces[1, node] += stiffness * penetration
            total += stiffness * penetration
    return total


@njit
def _damp(
    spins: Array, directors: Array, inertias: Array, damping: Array, step: float, work: Array
) -> None:
    """Solves (J + Δ D) ω = J ω*, tridiagonal, in the axes of the world; ω of element 0 is given."""
    count = spins.shape[1]
    turned, pivots = work[:3], work[3]
    for k in range(count):
        for axis in range(3):
            turned[axis, k] = 0.0
            for row in range(3):
                turned[axis, k] += directors[row, axis, k] * spins[row, k]
    for k in range(1, count):
        inner = step * damping[k - 1]
        outer = step * damping[k] if k < count - 1 else 0.0
        factor = inner if k == 1 else inner / pivots[k - 1]
        pivots[k] = inertias[k] + inner + outer
        if k > 1:
            pivots[k] -= factor * inner
        for axis in range(3):
            turned[axis, k] = inertias[k] * turned[axis, k] + factor * turned[axis, k - 1]
    for k in range(count - 1, 0, -1):
        for axis in range(3):
            if k < count - 1:
                turned[axis, k] += step * damping[k] * turned[axis, k + 1]
            turned[axis, k] /= pivots[k]
        for row in range(3):
            spins[row, k] = 0.0
            for axis in range(3):
                spins[row, k] += directors[row, axis, k] * turned[axis, k]


class Clamp(elastica.ConstraintBase):
    """Holds the first element in the turning body."""

    def __init__(
        self, _first: Array, _second: Array, _director: Array, contact_pass: Pass, **rest: object
    ) -> None:
        super().__init__(**rest)
        self._pass = contact_pass
        self._radii = np.array([BODY_RADIUS_M - LENGTH_M / SEGMENTS, BODY_RADIUS_M])

    def _angle(self, instant: float) -> float:
        return self._pass.start_angle_rad + self._pass.rate_rad_s * float(instant)

    def constrain_values(self, system: elastica.CosseratRod, time: float) -> None:
        """Positions and directors."""
        angle = self._angle(time)
        _place(system.position_collection, system.director_collection, angle, self._radii)

    def constrain_rates(self, system: elastica.CosseratRod, time: float) -> None:
        """Velocities and spins."""
        angle, rate = self._angle(time), self._pass.rate_rad_s
        _move(system.velocity_collection, system.omega_collection, angle, rate, self._radii)


class NodeContact(elastica.NoForces):
    """k_c δ at every node; `total` gets the sum over the steps, of which each asks once."""

    def __init__(self, plane_m: float, total: Array) -> None:
        super().__init__()
        self._plane_m, self._total = plane_m, total

    def apply_forces(self, system: elastica.CosseratRod, time: float = 0.0) -> None:
        """Adds to the external forces."""
        self._total[0] += _press(
            system.position_collection,
            system.external_forces,
            self._plane_m,
            CONTACT_STIFFNESS_N_M,
        )


class JointDamper(elastica.DamperBase):
    """Torques d_k (ω_k − ω_{k−1}) of the joints, implicitly."""

    def __init__(self, damping: Array, step_s: float, **rest: object) -> None:
        super().__init__(**rest)
        self._damping, self._step_s = damping, step_s
        self._inertias = self._system.mass_second_moment_of_inertia[0, 0].copy()
        self._work = np.zeros((4, SEGMENTS + 1))

    def dampen_rates(self, system: elastica.CosseratRod, time: float) -> None:
        """Changes the spins."""
        _damp(
            system.omega_collection,
            system.director_collection,
            self._inertias,
            self._damping,
            self._step_s,
            self._work,
        )


class Contact:
    """One pass at a fixed step."""

    def __init__(self, case: Case, step_s: float) -> None:
        self._pass, self._step_s = Pass(case), step_s

    def run(self, part: float = 1.0) -> tuple[float, float]:
        """Seconds, and p_n in N s."""
        chain, angle, rate = Chain(SEGMENTS), self._pass.start_angle_rad, self._pass.rate_rad_s
        along = np.array([math.cos(angle), math.sin(angle), 0.0])
        simulator = Simulator()
        rod = elastica.CosseratRod.straight_rod(
            SEGMENTS + 1,
            along * (BODY_RADIUS_M - chain.length_m),
            along,
            np.array([0.0, 0.0, 1.0]),
            LENGTH_M + chain.length_m,
            DIAMETER_M / 2,
            DENSITY_KG_M3,
            youngs_modulus=YOUNGS_MODULUS_PA,
            shear_modulus=YOUNGS_MODULUS_PA / 3,
        )
        rod.bend_matrix[:2, :2, 0] *= 2
        rod.velocity_collection[0] = -rate * rod.position_collection[1]
        rod.velocity_collection[1] = rate * rod.position_collection[0]
        rod.omega_collection[0] = rate
        simulator.append(rod)
        simulator.constrain(rod).using(
            Clamp,
            contact_pass=self._pass,
            constrained_position_idx=(0, 1),
            constrained_director_idx=(0,),
        )
        total = np.zeros(1)
        simulator.add_forcing_to(rod).using(NodeContact, self._pass.height_m, total)
        damping = np.array(chain.damping_n_m_s)
        simulator.dampen(rod).using(JointDamper, damping=damping, step_s=self._step_s)
        simulator.finalize()

        stepper, step = elastica.PositionVerlet(), np.float64(self._step_s)
        instant = np.float64(0.0)
        steps = round(part * self._pass.end_s / self._step_s)
        start = time.perf_counter()
        for _ in range(steps):
            instant = stepper.step(simulator, instant, step)
        seconds = time.perf_counter() - start
        return seconds, float(total[0]) * self._step_s


def quiet() -> None:
    """It warns of inertias that are small in SI units, each time that it makes a rod."""
    logging.getLogger().setLevel(logging.ERROR)
