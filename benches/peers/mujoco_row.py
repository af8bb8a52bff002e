"""A row of filaments that touch each other, in MuJoCo.

Each filament is a chain on a body of its own that turns about the tool axis. Its nodes touch the
workpiece, as in mujoco_chain.py. Filaments touch their neighbours, in one of two ways:

- "capsules": each segment is a capsule. MuJoCo makes one contact for two capsules, at their nearest
  points, so that forces between filaments act near nodes. A segment touches the opposite one and
  both that are next to it: three contacts, each with a third of the stiffness k_l h. (Capsules that
  are exactly parallel have two contacts. Filaments in motion are not.)
- "points": the rule of MODEL.md. Each segment has N_q points, which press on the segments of the
  neighbour with a spring of k_l h / (2 N_q), where they come nearer than d. Near a node of the
  neighbour a point may press on both segments there, and then twice as hard as in the model.

Only neighbours touch, and only segments whose numbers differ by one at most: a filament slides
along its neighbour by less than the pitch, which is less than a segment.

A contact is either a spring (`mujoco_chain.make_spring`), or MuJoCo's own: a constraint that ends
penetration within two steps, which has no stiffness and is stable at larger steps.
"""

import math
import time
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import rollout
from mujoco_chain import NODE_RADIUS_M, filament_xml, make_spring, pair_xml, pass_model
from paper_case import Case, Pass

# isort: split
# From derivations, which paper_case puts on the path.
from cases import BODY_RADIUS_M, CONTACT_STIFFNESS_N_M, DIAMETER_M, LENGTH_M, Filament

# Filaments around the tool.
FILAMENTS = 682
PITCH_RAD = 2 * math.pi / FILAMENTS
# k_l, of filaments on each other.
STIFFNESS_N_M2 = 6e7
# Contacts of a segment with those of the neighbour.
CAPSULE_CONTACTS = 3
# Number of steps after which Python reads the results.
STEPS_AT_ONCE = 256
JOINTS = "one hinge, planar"
SOLVERS = ("Newton", "CG", "PGS")


@dataclass(frozen=True)
class Touch:
    """Contact of a row: shapes of filaments, and contacts that are springs."""

    shape: str = "capsules"
    filaments_are_springs: bool = True
    workpiece_is_spring: bool = True
    # k_l, of springs between filaments.
    stiffness_n_m2: float = STIFFNESS_N_M2


@dataclass(frozen=True)
class Motion:
    """Motion of each filament; one value a column."""

    seconds: float
    impulses_n_s: np.ndarray
    contact_times_s: np.ndarray
    max_deflections_m: np.ndarray


def deflections_m(angles_rad: np.ndarray, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
    """Returns the distances from tips to the undeformed filament, which the body has turned."""
    cosines, sines = np.cos(angles_rad), np.sin(angles_rad)
    along = x_m * cosines + y_m * sines - BODY_RADIUS_M
    across = y_m * cosines - x_m * sines
    return np.hypot(along - np.clip(along, 0.0, LENGTH_M), across)


def contact_points(segments: int) -> int:
    """N_q: the least with h / N_q ≤ d."""
    return math.ceil(LENGTH_M / segments / DIAMETER_M)


def segment_xml(filament: Filament, column: int, k: int, points: int) -> str:
    """The shape of a segment: a capsule if there are no points; else it is pressed by points of its
    neighbours, and its own press on them."""
    radius = DIAMETER_M - NODE_RADIUS_M if points else DIAMETER_M / 2
    text = (
        f'<geom name="segment_{k}_{column}" type="capsule" size="{radius!r}" '
        f'fromto="0 0 0 {filament.segment_m!r} 0 0"/>'
    )
    for point in range(points):
        x = filament.segment_m * (point + 0.5) / points
        text += (
            f'<geom name="point_{point}_{k}_{column}" type="sphere" size="{NODE_RADIUS_M}" '
            f'pos="{x!r} 0 0"/>'
        )
    return text


def neighbours_xml(segments: int, column: int, points: int) -> str:
    """Pairs that may touch between a column and the next."""
    pairs = ""
    for k in range(segments):
        for other in range(max(k - 1, 0), min(k + 2, segments)):
            if not points:
                pairs += pair_xml(f"segment_{k}_{column}", f"segment_{other}_{column + 1}")
            for point in range(points):
                for own, opposite in ((column, column + 1), (column + 1, column)):
                    pairs += pair_xml(f"point_{point}_{k}_{own}", f"segment_{other}_{opposite}")
    return pairs


def sensors_xml(segments: int, column: int) -> str:
    """Force of a filament on the workpiece in x, y, z, and the position of its tip."""
    return (
        f'<contact subtree1="clamp_{column}" geom2="workpiece" num="1" data="force" '
        'reduce="netforce"/>'
        f'<framepos objtype="geom" objname="node_{segments - 1}_{column}"/>'
    )


class Row:
    """A row on its way over the workpiece at a fixed step."""

    def __init__(
        self,
        case: Case,
        segments: int,
        columns: int,
        step_s: float,
        touch: Touch,
        solver: str = SOLVERS[0],
    ) -> None:
        self._pass, self._segments, self._columns = Pass(case), segments, columns
        filament = Filament(segments)
        points = contact_points(segments) if touch.shape == "points" else 0
        filaments = pairs = sensors = ""
        for column in range(columns):
            filaments += filament_xml(
                filament,
                JOINTS,
                f"_{column}",
                lambda k, column=column: segment_xml(filament, column, k, points),
            )
            pairs += "".join(pair_xml(f"node_{k}_{column}", "workpiece") for k in range(segments))
            sensors += sensors_xml(segments, column)
        for column in range(columns - 1):
            pairs += neighbours_xml(segments, column, points)
        sensors = f"<sensor>{sensors}</sensor>"
        self._model = pass_model(self._pass, step_s, filaments, pairs, sensors)
        self._model.opt.solver = getattr(mujoco.mjtSolver, f"mjSOL_{solver.upper()}")
        contacts = 2 * points if points else CAPSULE_CONTACTS
        between_n_m = touch.stiffness_n_m2 * filament.segment_m / contacts
        for pair in range(self._model.npair):
            if pair < columns * segments:
                is_spring, stiffness_n_m = touch.workpiece_is_spring, CONTACT_STIFFNESS_N_M
            else:
                is_spring, stiffness_n_m = touch.filaments_are_springs, between_n_m
            if is_spring:
                make_spring(self._model, pair, stiffness_n_m)
            else:
                self._model.pair_solref[pair] = [2 * step_s, 1.0]

    def run(self) -> Motion:
        """Runs the row until the last column has passed."""
        model, data, at = self._model, mujoco.MjData(self._model), self._pass
        rate, step_s = at.rate_rad_s, model.opt.timestep
        starts = at.start_angle_rad - PITCH_RAD * np.arange(self._columns)
        clamps = slice(0, None, self._segments + 1)
        data.qpos[clamps], data.qvel[clamps] = starts, rate
        kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.empty(mujoco.mj_stateSize(model, kind))
        mujoco.mj_getState(model, data, state, kind)
        steps = round((at.end_s + (starts[0] - starts[-1]) / rate) / step_s)
        states = np.empty((1, STEPS_AT_ONCE, state.size))
        sensors = np.empty((1, STEPS_AT_ONCE, model.nsensordata))
        forces, tips = np.empty((steps, self._columns)), np.empty((steps, self._columns, 2))
        seconds = 0.0
        for first in range(0, steps, STEPS_AT_ONCE):
            count = min(STEPS_AT_ONCE, steps - first)
            ends, values = states[:, :count], sensors[:, :count]
            start = time.perf_counter()
            rollout.rollout(model, data, state, nstep=count, state=ends, sensordata=values)
            seconds += time.perf_counter() - start
            state = ends[0, -1].copy()
            # Values are those of the start of each step.
            values = values.reshape(count, self._columns, 6)
            forces[first : first + count] = np.abs(values[:, :, 1])
            tips[first : first + count] = values[:, :, 3:5]
        angles = starts + rate * step_s * np.arange(steps)[:, None]
        return Motion(
            seconds,
            forces.sum(axis=0) * step_s,
            np.count_nonzero(forces, axis=0) * step_s,
            deflections_m(angles, tips[:, :, 0], tips[:, :, 1]).max(axis=0),
        )
