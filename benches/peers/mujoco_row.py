"""A row of filaments that touch each other, in MuJoCo.

Each filament is a chain on a body of its own that turns about the tool axis. Its nodes touch the
workpiece, as in mujoco_chain.py. Filaments touch their neighbours, in one of two ways:

- "capsules": each segment is a capsule. MuJoCo makes one contact for two capsules, at their nearest
  points, so that forces between filaments act near nodes. A segment touches the opposite one and
  both that are next to it: three contacts, each with a third of the stiffness k_l h. (Capsules that
  are exactly parallel have two contacts. They are so before they touch, but not in motion.)
- "points": the rule of MODEL.md. Each segment has N_q points, which press on the segments of the
  neighbour with a spring of k_l h / (2 N_q), where they come nearer than d. A point next to a node
  of the neighbour may press on both segments there, which is more than the model has.

Only neighbours touch, and only segments whose numbers differ by one at most: a filament slides along
its neighbour by less than the pitch, which is less than a segment.

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
from paper_case import BODY_RADIUS_M, CONTACT_STIFFNESS_N_M, DIAMETER_M, LENGTH_M, Case, Chain, Pass

# Around the tool.
FILAMENTS = 682
PITCH_RAD = 2 * math.pi / FILAMENTS
# k_l, of filaments on each other.
STIFFNESS_N_M2 = 6e7
# Of a segment with those of the neighbour.
CAPSULE_CONTACTS = 3
# Steps between which Python gets hold of the results.
STEPS_AT_ONCE = 256
JOINTS = "one hinge, planar"
SOLVERS = ("Newton", "CG", "PGS")


@dataclass(frozen=True)
class Touch:
    """How a row touches: shapes of filaments, and which contacts are springs."""

    shape: str = "capsules"
    filaments_are_springs: bool = True
    workpiece_is_spring: bool = True
    # Times k_l.
    stiffness_factor: float = 1.0


@dataclass(frozen=True)
class Motion:
    """What each filament does; one value a column."""

    seconds: float
    impulses_n_s: np.ndarray
    contact_times_s: np.ndarray
    max_deflections_m: np.ndarray


def contact_points(segments: int) -> int:
    """N_q: the least with h / N_q ≤ d."""
    return math.ceil(LENGTH_M / segments / DIAMETER_M)


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
        chain, points = Chain(segments), contact_points(segments)
        by_points = touch.shape == "points"
        radius = DIAMETER_M - NODE_RADIUS_M if by_points else DIAMETER_M / 2

        def geoms(column: int, k: int) -> str:
            end = f"_{k}_{column}"
            text = (
                f'<geom name="segment{end}" type="capsule" size="{radius!r}" '
                f'fromto="0 0 0 {chain.length_m!r} 0 0"/>'
            )
            for point in range(points if by_points else 0):
                x = chain.length_m * (point + 0.5) / points
                text += (
                    f'<geom name="point_{point}{end}" type="sphere" size="{NODE_RADIUS_M}" '
                    f'pos="{x!r} 0 0"/>'
                )
            return text

        filaments = pairs = sensors = ""
        for column in range(columns):
            filaments += filament_xml(
                chain, JOINTS, f"_{column}", lambda k, column=column: geoms(column, k)
            )
            # Force on the workpiece in x, y, z, and where the tip is.
            sensors += (
                f'<contact subtree1="clamp_{column}" geom2="workpiece" num="1" data="force" '
                f'reduce="netforce"/><framepos objtype="geom" objname="node_{segments - 1}_{column}"/>'
            )
            for k in range(segments):
                pairs += pair_xml(f"node_{k}_{column}", "workpiece")
        on_workpiece = columns * segments
        for column in range(columns - 1):
            for k in range(segments):
                for other in range(max(k - 1, 0), min(k + 2, segments)):
                    opposite = f"segment_{other}_{column + 1}"
                    if not by_points:
                        pairs += pair_xml(f"segment_{k}_{column}", opposite)
                        continue
                    for point in range(points):
                        pairs += pair_xml(f"point_{point}_{k}_{column}", opposite)
                        pairs += pair_xml(
                            f"point_{point}_{k}_{column + 1}", f"segment_{other}_{column}"
                        )
        sensors = f"<sensor>{sensors}</sensor>"
        self._model = pass_model(self._pass, step_s, filaments, pairs, sensors)
        self._model.opt.solver = getattr(mujoco.mjtSolver, f"mjSOL_{solver.upper()}")
        share = 1 / (2 * points) if by_points else 1 / CAPSULE_CONTACTS
        between_n_m = touch.stiffness_factor * STIFFNESS_N_M2 * chain.length_m * share
        for pair in range(self._model.npair):
            workpiece = pair < on_workpiece
            if touch.workpiece_is_spring if workpiece else touch.filaments_are_springs:
                make_spring(self._model, pair, CONTACT_STIFFNESS_N_M if workpiece else between_n_m)
            else:
                self._model.pair_solref[pair] = [2 * step_s, 1.0]

    def run(self) -> Motion:
        """The whole row: until the last column has passed."""
        model, data, at = self._model, mujoco.MjData(self._model), self._pass
        rate, step_s, delays = at.rate_rad_s, model.opt.timestep, PITCH_RAD * np.arange(self._columns)
        clamps = slice(0, None, self._segments + 1)
        data.qpos[clamps] = at.start_angle_rad - delays
        data.qvel[clamps] = rate
        kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.empty(mujoco.mj_stateSize(model, kind))
        mujoco.mj_getState(model, data, state, kind)
        left = round((at.end_s + delays[-1] / rate) / step_s)
        states = np.empty((1, STEPS_AT_ONCE, state.size))
        sensors = np.empty((1, STEPS_AT_ONCE, model.nsensordata))
        forces = np.empty((left, self._columns))
        tips = np.empty((left, self._columns, 2))
        seconds, done = 0.0, 0
        while left > done:
            count = min(STEPS_AT_ONCE, left - done)
            start = time.perf_counter()
            # Its forces and positions are those of the start of each step.
            rollout.rollout(
                model, data, state, nstep=count, state=states[:, :count],
                sensordata=sensors[:, :count],
            )
            seconds += time.perf_counter() - start
            state = states[0, count - 1].copy()
            values = sensors[0, :count].reshape(count, self._columns, 6)
            forces[done : done + count] = np.abs(values[:, :, 1])
            tips[done : done + count] = values[:, :, 3:5]
            done += count
        times = step_s * np.arange(done)[:, None]
        angles = at.start_angle_rad - delays[None, :] + rate * times
        cosines, sines = np.cos(angles), np.sin(angles)
        along = tips[:, :, 0] * cosines + tips[:, :, 1] * sines - BODY_RADIUS_M
        across = tips[:, :, 1] * cosines - tips[:, :, 0] * sines
        deflections = np.hypot(along - np.clip(along, 0.0, LENGTH_M), across)
        return Motion(
            seconds,
            forces.sum(axis=0) * step_s,
            np.count_nonzero(forces, axis=0) * step_s,
            deflections.max(axis=0),
        )
