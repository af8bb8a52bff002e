"""Accelerations φ̈, θ̈ of the spatial chain at random states, by Pinocchio.

This script differentiates no energy and states no equation of the chain. Pinocchio builds the chain
from rigid bodies and solves for the accelerations by its articulated-body algorithm
(Featherstone 1987), in rotations and Newton-Euler equations instead of coordinates φ, θ.

The chain in Pinocchio
----------------------
Segment k is a rod along the z axis of its body frame, whose origin is the inner node. A spherical
joint (quaternion, relative angular velocity in the axes of the outer body) holds it at the outer
end of segment k − 1, at (0, 0, h) of that body; the first one at the root.

* Coordinates. Body k has the orientation R_k = R_z(θ_k) R_y(φ_k), which takes z to
  e_k = (sin φ_k cos θ_k, sin φ_k sin θ_k, cos φ_k). The joint's quaternion is that of R_{k−1}ᵀ R_k,
  R_0 = 1. Another turn about the rod's own axis would do as well.
* Rates. The bodies turn without spin about their own axes, ω_k = e_k × ė_k; the joint's velocity is
  R_kᵀ (ω_k − ω_{k−1}), where the world stands in for segment 0.
* Accelerations. From Pinocchio's angular acceleration a_k in the world's axes follows
  ë_k = a_k × e_k + ω_k × (ω_k × e_k), and ë_k = ∂_φ e φ̈ + ∂_θ e θ̈ + b gives φ̈_k and θ̈_k: the two
  derivatives are orthogonal.
* Inertia. J about the axes across the rod. About its own axis, any: a rod without spin keeps its
  ë_k whatever turns it about its axis. Here it is J as well.
* Springs and dampers, as joint torques in the axes of the outer body, with the reaction on the
  inner one: −c_k α_k n − d_k (ν_k − ν_{k−1}), n along e_{k−1} × e_k. The dampers see the rods from
  the body, ν_k = e_k × (ė_k − Ω × e_k), Ω = β̇ z. At the first joint e_0 is the clamp's, which is at
  rest in the body, ν_0 = 0; the world takes the reaction.
* Root. In axes that move with the root but do not turn, it rests, and gravity is g − r̈_0.

SI units, angles in radians.

Run from the repository root:

    python derivations/reference_aba.py
    python derivations/reference_aba.py --check
"""

import argparse
import json
import math
import random
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
import pinocchio
from cases import BODY_RADIUS_M, YOUNGS_MODULUS_PA, Filament, State
from files import DATA, made_by, relative_differences, write
from graph_format import compact, lines

FILE = DATA / "reference_aba.json"
SEED = 20211
# A millionth of the paper's modulus: inertia, gyroscopic terms, springs and dampers are of one size
# at moderate rates.
SOFT_YOUNGS_MODULUS_PA = 3.0e3
SEGMENT_COUNTS = (2, 7, 25)
STATES_PER_COUNT = 3
# Least distance of the segments from the poles of their coordinates.
LEAST_POLAR_ANGLE_RAD = 0.4

# Largest difference of --check over the accelerations of a state: processors round differently.
CHECK_TOLERANCE = 1e-11

Array = np.ndarray


@dataclass(frozen=True)
class Rod:
    """One segment's direction and rotation."""

    direction: Array  # e
    direction_rate: Array  # ė in 1/s

    @property
    def angular_velocity(self) -> Array:
        """ω = e × ė in rad/s."""
        return np.cross(self.direction, self.direction_rate)

    def rate_in_body(self, body_rate: float) -> Array:
        """ν = e × (ė − Ω × e) in rad/s, with Ω = β̇ z."""
        rigid = body_rate * np.cross([0.0, 0.0, 1.0], self.direction)
        return np.cross(self.direction, self.direction_rate - rigid)


@dataclass(frozen=True)
class Coordinates:
    """φ, θ and their rates of one segment, with the map to e."""

    phi: float
    theta: float
    phi_rate: float
    theta_rate: float

    @property
    def rotation(self) -> Array:
        """R_z(θ) R_y(φ): the body's axes in those of the world."""
        return pinocchio.utils.rotate("z", self.theta) @ pinocchio.utils.rotate("y", self.phi)

    @property
    def derivatives(self) -> tuple[Array, Array]:
        """∂_φ e and ∂_θ e."""
        x_axis, y_axis = self.rotation[:, 0], self.rotation[:, 1]
        return x_axis, math.sin(self.phi) * y_axis

    @property
    def rod(self) -> Rod:
        """e and ė."""
        by_phi, by_theta = self.derivatives
        return Rod(self.rotation[:, 2], by_phi * self.phi_rate + by_theta * self.theta_rate)

    def accelerations(self, direction_acceleration: Array) -> tuple[float, float]:
        """φ̈ and θ̈ of ë."""
        by_phi, by_theta = self.derivatives
        sine, cosine = math.sin(self.phi), math.cos(self.phi)
        radial = np.array([math.cos(self.theta), math.sin(self.theta), 0.0])
        # b = ∂_φφ e φ̇² + 2 ∂_φθ e φ̇ θ̇ + ∂_θθ e θ̇²
        bias = (
            -self.rod.direction * self.phi_rate**2
            + 2 * (cosine / sine) * by_theta * self.phi_rate * self.theta_rate
            - sine * radial * self.theta_rate**2
        )
        rest = direction_acceleration - bias
        return float(rest @ by_phi), float(rest @ by_theta) / sine**2


def chain_of_bodies(
    filament: Filament,
    effective_gravity: Array,
    joints: Sequence[object],
    axial_inertia: float,
) -> pinocchio.Model:
    """The uniform chain as Pinocchio's model, with these joints in turn at each inner node."""
    h, mass, inertia = filament.segment_m, filament.masses_kg[0], filament.inertias_kg_m2[0]
    centre, moments = np.array([0.0, 0.0, h / 2]), np.diag([inertia, inertia, axial_inertia])
    rod = pinocchio.Inertia(mass, centre, moments)
    model = pinocchio.Model()
    model.gravity.linear = effective_gravity
    parent, placement = 0, pinocchio.SE3.Identity()
    for k in range(filament.segments):
        for i, joint in enumerate(joints):
            parent = model.addJoint(parent, joint, placement, f"joint_{k + 1}_{i + 1}")
            placement = pinocchio.SE3.Identity()
        model.appendBodyToJoint(parent, rod, pinocchio.SE3.Identity())
        placement = pinocchio.SE3(np.eye(3), np.array([0.0, 0.0, h]))
    return model


def joint_torque(
    stiffness: float, damping: float, body_rate: float, inner: Rod, outer: Rod
) -> Array:
    """Torque of spring and damper on the outer side of a bent joint, in N m, in the world's axes.

    At a straight joint the axis of bending is 0/0; no state here has one.
    """
    across = np.cross(inner.direction, outer.direction)
    sine = float(np.linalg.norm(across))
    angle = math.atan2(sine, float(inner.direction @ outer.direction))
    spring = -stiffness * angle * across / sine
    return spring - damping * (outer.rate_in_body(body_rate) - inner.rate_in_body(body_rate))


class ChainState:
    """The chain at a state: its segments, with the clamp's rod ahead of theirs."""

    def __init__(self, state: State) -> None:
        self.segments = [
            Coordinates(*state.q[i : i + 2], *state.v[i : i + 2]) for i in range(0, len(state.q), 2)
        ]
        modulus = state.youngs_modulus_pa
        self.filament = filament = Filament(len(self.segments), youngs_modulus_pa=modulus)
        radial = np.array([math.cos(state.base_angle), math.sin(state.base_angle), 0.0])
        tangential = np.array([-radial[1], radial[0], 0.0])
        root_acceleration = BODY_RADIUS_M * (
            state.base_acceleration * tangential - state.base_rate**2 * radial
        )
        self.effective_gravity = np.array(state.gravity) - root_acceleration
        clamp = Rod(radial, state.base_rate * tangential)
        self.rods = [clamp, *(segment.rod for segment in self.segments)]
        # Torques on the outer side of each joint, in the world's axes.
        joints = zip(filament.stiffnesses_n_m, filament.dampings_n_m_s, strict=True)
        self.torques = [
            joint_torque(*joint, state.base_rate, *self.rods[k : k + 2])
            for k, joint in enumerate(joints)
        ]

    def in_spherical_joints(self) -> tuple[pinocchio.Model, Array, Array, Array]:
        """Pinocchio's model, and its configuration, velocities and torques."""
        positions, velocities, torques = [], [], []
        inner_rotation, inner_velocity = np.eye(3), np.zeros(3)
        for segment, rod, torque in zip(self.segments, self.rods[1:], self.torques, strict=True):
            rotation = segment.rotation
            quaternion = pinocchio.Quaternion(inner_rotation.T @ rotation)
            quaternion.normalize()
            positions.append(quaternion.coeffs())
            velocities.append(rotation.T @ (rod.angular_velocity - inner_velocity))
            torques.append(rotation.T @ torque)
            inner_rotation, inner_velocity = rotation, rod.angular_velocity
        inertia, joints = self.filament.inertias_kg_m2[0], [pinocchio.JointModelSpherical()]
        model = chain_of_bodies(self.filament, self.effective_gravity, joints, inertia)
        return model, *map(np.concatenate, (positions, velocities, torques))


def accelerations(state: State) -> list[float]:
    """φ̈_1, θ̈_1, …, φ̈_n, θ̈_n in rad/s², by the articulated-body algorithm."""
    chain = ChainState(state)
    model, q, v, torques = chain.in_spherical_joints()
    data = model.createData()
    joint_accelerations = pinocchio.aba(model, data, q, v, torques)
    pinocchio.forwardKinematics(model, data, q, v, joint_accelerations)
    result: list[float] = []
    for k, segment in enumerate(chain.segments, 1):
        turning = pinocchio.getAcceleration(
            model, data, k, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        ).angular
        direction, omega = segment.rod.direction, segment.rod.angular_velocity
        direction_acceleration = np.cross(turning, direction) + np.cross(
            omega, np.cross(omega, direction)
        )
        result += segment.accelerations(direction_acceleration)
    return result


def random_state(rng: random.Random, segments: int, soft: bool) -> State:
    """Draws a moving chain in any gravity; a joint steps by up to 1 rad, less at more segments."""
    # The soft filament moves slowly enough that every term counts.
    base_rate, base_acceleration, gravity, rate = (
        (5.0, 20.0, 1.0, 20.0) if soft else (200.0, 1e4, 10.0, 200.0)
    )
    base_angle = rng.uniform(-3.0, 3.0)
    bend = math.sqrt(2 / segments)
    phi, theta, q = math.pi / 2, base_angle, []
    for _ in range(segments):
        phi += rng.uniform(-bend, bend)
        phi = min(max(phi, LEAST_POLAR_ANGLE_RAD), math.pi - LEAST_POLAR_ANGLE_RAD)
        theta += rng.uniform(-bend, bend)
        q += [phi, theta]
    return State(
        kind="soft" if soft else "random",
        youngs_modulus_pa=SOFT_YOUNGS_MODULUS_PA if soft else YOUNGS_MODULUS_PA,
        base_angle=base_angle,
        base_rate=rng.uniform(-base_rate, base_rate),
        base_acceleration=rng.uniform(-base_acceleration, base_acceleration),
        gravity=[rng.uniform(-gravity, gravity) for _ in range(3)],
        q=q,
        v=[rng.uniform(-rate, rate) for _ in range(2 * segments)],
    )


def evaluated_states() -> list[dict[str, object]]:
    """Returns all states of the file, in its order, with their accelerations."""
    rng = random.Random(SEED)
    states = [
        random_state(rng, segments, soft)
        for segments in SEGMENT_COUNTS
        for soft in (False, True)
        for _ in range(STATES_PER_COUNT)
    ]
    return [{**asdict(state), "accelerations": accelerations(state)} for state in states]


def main() -> None:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description="Write accelerations of random states.")
    parser.add_argument("--check", action="store_true", help="compare with the committed file")
    is_check, states = parser.parse_args().check, evaluated_states()
    if not is_check:
        origin = compact(made_by("reference_aba.py", pinocchio, np))
        write(FILE, f'{{"made_by": {origin},\n"states": [\n{lines(states)}\n]}}\n')
        return
    committed = json.loads(FILE.read_text(encoding="utf-8"))
    found = relative_differences({"states": states}, committed)
    path, error = max(found, key=lambda each: each[1])
    print(f"{'/'.join(path)}: {error:.1e}")
    if not error <= CHECK_TOLERANCE:
        sys.exit(f"{FILE} differs by {error:.1e}, more than {CHECK_TOLERANCE}")


if __name__ == "__main__":
    main()
