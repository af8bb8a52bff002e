"""The chain in Pinocchio: with spherical joints, and with two revolute joints at each node.

With spherical joints (75 rates) it is that of derivations/reference_aba.py. With two revolute
joints, or a universal one, a node has as many rates as φ and θ (50 in all), and rods then turn
about their own axes as the joints make them. For the model's rods, which do not, that must cost
nothing: they get no inertia about their axes, and no torques. Torques of springs and dampers on a
rod are taken without their part along it, and summed from the tip for the joints inside.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio
from paper_case import State

# isort: split
# From derivations, which paper_case puts on the path.
import reference_aba
from cases import Filament

# Names of pinocchio_aba.cpp.
JOINTS = ("spherical", "universal", "revolutes")


@dataclass(frozen=True)
class Problem:
    """Input of the articulated-body algorithm."""

    joints: str
    model: pinocchio.Model
    axial_inertia: float
    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray

    def arguments(self, program: Path) -> list[str]:
        """Command line of pinocchio_aba.cpp."""
        segments = self.model.njoints - 1
        if self.joints == "revolutes":
            segments //= 2
        filament = Filament(segments)
        numbers = [filament.segment_m, filament.masses_kg[0], filament.inertias_kg_m2[0]]
        numbers.append(self.axial_inertia)
        numbers += [float(x) for x in self.model.gravity.linear]
        return [str(program), self.joints, str(segments), *(repr(x) for x in numbers)]

    def numbers(self) -> str:
        """q, v and tau of a request."""
        return " ".join(repr(float(x)) for x in (*self.q, *self.v, *self.tau))

    def coordinates(self, joint_accelerations: np.ndarray, state: State) -> np.ndarray:
        """φ̈_1, θ̈_1, … of the joint accelerations."""
        data = self.model.createData()
        pinocchio.forwardKinematics(self.model, data, self.q, self.v, joint_accelerations)
        world, result = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED, []
        for k, segment in enumerate(reference_aba.ChainState(state).segments):
            joint = 2 * k + 2 if self.joints == "revolutes" else k + 1
            direction = segment.rod.direction
            turning = pinocchio.getAcceleration(self.model, data, joint, world).angular
            omega = pinocchio.getVelocity(self.model, data, joint, world).angular
            centripetal = np.cross(omega, np.cross(omega, direction))
            result += segment.accelerations(np.cross(turning, direction) + centripetal)
        return np.array(result)


def problem(state: State, joints: str) -> Problem:
    """The chain and the state with these joints."""
    chain = reference_aba.ChainState(state)
    if joints == "spherical":
        model, *at = chain.in_spherical_joints()
        return Problem(joints, model, chain.filament.inertias_kg_m2[0], *at)
    return _two_axes(joints, chain)


def _two_axes(joints: str, chain: reference_aba.ChainState) -> Problem:
    """R = R_x(α) R_y(β) from the inner rod's axes to the outer one's, whose third is along it."""
    rods, torques = chain.rods, chain.torques
    q, v, axes = [], [], []
    rotation, omega = np.eye(3), np.zeros(3)
    for rod in rods[1:]:
        local = rotation.T @ rod.direction
        alpha, beta = np.arctan2(-local[1], local[2]), np.arcsin(local[0])
        first = rotation[:, 0]
        turned = rotation @ pinocchio.utils.rotate("x", alpha)
        second = turned[:, 1]
        # ė − ω × e = (α̇ first + β̇ second) × e
        rest = rod.direction_rate - np.cross(omega, rod.direction)
        columns = np.column_stack([np.cross(first, rod.direction), np.cross(second, rod.direction)])
        rates = np.linalg.lstsq(columns, rest, rcond=None)[0]
        rotation = turned @ pinocchio.utils.rotate("y", beta)
        omega = omega + rates[0] * first + rates[1] * second
        q += [alpha, beta]
        v += list(rates)
        axes.append((first, second))
    tau, outside = np.zeros(len(q)), np.zeros(3)
    for k in reversed(range(len(torques))):
        on_rod = torques[k] - (torques[k + 1] if k + 1 < len(torques) else 0.0)
        direction = rods[k + 1].direction
        outside = outside + on_rod - (on_rod @ direction) * direction
        tau[2 * k], tau[2 * k + 1] = axes[k][0] @ outside, axes[k][1] @ outside

    at_node = [pinocchio.JointModelRX(), pinocchio.JointModelRY()]
    if joints == "universal":
        at_node = [pinocchio.JointModelUniversal(*np.eye(3)[:2])]
    gravity = chain.effective_gravity
    model = reference_aba.chain_of_bodies(chain.filament, gravity, at_node, axial_inertia=0.0)
    return Problem(joints, model, 0.0, np.array(q), np.array(v), tau)
