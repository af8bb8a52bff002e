"""The chain in MuJoCo: accelerations at a state, one contact, and the parts that rows share.

Contact. MuJoCo has no springs between bodies and a plane but a soft constraint, whose force is
d (k δ + b v + a_0)/Â with the impedance d, the acceleration a_0 that the node would have without
the constraint, and the constant Â = `invweight0` in place of the inverse mass. (More exactly
(1 − d) Â/d is added to the inverse mass.) At the smallest impedance that it allows, 1e-4, a_0 and
the inverse mass drop out to that number, and a force k_c δ remains if `solref` is
(−(1 − d) k_c Â, 0); in a pass of the paper's case to 3e-6 of its largest.

The clamp turns with a body of 1000 kg m², which the filament cannot slow down.
"""

import time
from collections.abc import Callable

import mujoco
import numpy as np
from paper_case import SEGMENTS, Case, Pass

# isort: split
# From derivations, which paper_case puts on the path.
from cases import BODY_RADIUS_M, CONTACT_STIFFNESS_N_M, Filament

IMPEDANCE = 1e-4
# Radius of a node; the plane is moved by as much.
NODE_RADIUS_M = 1e-6
# MuJoCo refuses bodies without inertia about an axis; 1 / 200 of that across the rod.
LEAST_INERTIA_KG_M2 = 2e-15

HINGES = {"two hinges": ("0 1 0", "0 0 1"), "one hinge, planar": ("0 0 1",)}


def chain_at(
    joints: str, gravity: np.ndarray, q: np.ndarray, v: np.ndarray, tau: np.ndarray
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Pinocchio's chain (rods along z) and state; joints are "spherical" or "universal"."""
    filament, bodies = Filament(SEGMENTS), ""
    h, mass, inertia = filament.segment_m, filament.masses_kg[0], filament.inertias_kg_m2[0]
    along = inertia if joints == "spherical" else LEAST_INERTIA_KG_M2
    joint = '<joint type="ball"/>'
    if joints == "universal":
        joint = '<joint type="hinge" axis="1 0 0"/><joint type="hinge" axis="0 1 0"/>'
    for k in range(SEGMENTS):
        bodies += (
            f'<body pos="0 0 {h if k else 0.0!r}">{joint}'
            f'<inertial pos="0 0 {h / 2!r}" mass="{mass!r}" '
            f'diaginertia="{inertia!r} {inertia!r} {along!r}"/>'
        )
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler boundmass="0" boundinertia="0"/>
        <option gravity="{" ".join(repr(float(x)) for x in gravity)}">
        <flag contact="disable" constraint="disable" energy="disable"/></option>
        <worldbody>{bodies}{"</body>" * SEGMENTS}</worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    # Quaternions start with w here, and end with it in Pinocchio.
    data.qpos[:] = q.reshape(-1, 4)[:, [3, 0, 1, 2]].ravel() if joints == "spherical" else q
    data.qvel[:] = v
    data.qfrc_applied[:] = tau
    return model, data


def filament_xml(
    filament: Filament, joints: str, name: str = "", geoms: Callable[[int], str] = lambda _: ""
) -> str:
    """A body that turns about the tool axis and bears a filament, whose elements have names that
    end in `name`. A segment has a sphere at its outer end, its node, and the geometries that
    `geoms` adds."""
    h, bodies, dampings = filament.segment_m, "", filament.dampings_n_m_s
    mass, inertia = filament.masses_kg[0], filament.inertias_kg_m2[0]
    for k, stiffness in enumerate(filament.stiffnesses_n_m):
        axes = "".join(
            f'<joint type="hinge" axis="{axis}" stiffness="{stiffness!r}" '
            f'damping="{dampings[k]!r}"/>'
            for axis in HINGES[joints]
        )
        bodies += (
            f'<body pos="{h if k else BODY_RADIUS_M!r} 0 0">{axes}'
            f'<inertial pos="{h / 2!r} 0 0" mass="{mass!r}" '
            f'diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>'
            f'<geom name="node_{k}{name}" type="sphere" size="{NODE_RADIUS_M}" '
            f'pos="{h!r} 0 0"/>{geoms(k)}'
        )
    return (
        f'<body name="clamp{name}"><joint type="hinge" axis="0 0 1"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1e3 1e3 1e3"/>'
        f"{bodies}{'</body>' * (filament.segments + 1)}"
    )


def pair_xml(first: str, second: str) -> str:
    """Two geometries that touch without friction."""
    return f'<pair geom1="{first}" geom2="{second}" condim="1"/>'


def pass_model(
    at: Pass, step_s: float, filaments: str, pairs: str, more: str = ""
) -> mujoco.MjModel:
    """Filaments and the plane workpiece, in steps of `step_s`; only the pairs touch."""
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler angle="radian" boundmass="0" boundinertia="0"
        inertiafromgeom="false"/><default><geom contype="0" conaffinity="0"/></default>
        <option timestep="{step_s!r}" gravity="0 0 0" integrator="implicitfast"/>
        <worldbody><geom name="workpiece" type="plane" size="1 1 1" zaxis="0 1 0"
        pos="0 {at.height_m - NODE_RADIUS_M!r} 0"/>{filaments}</worldbody>
        <contact>{pairs}</contact>{more}</mujoco>"""
    )


def make_spring(model: mujoco.MjModel, pair: int, stiffness_n_m: float) -> None:
    """Makes a pair's soft contact a spring."""
    bodies = model.geom_bodyid[[model.pair_geom1[pair], model.pair_geom2[pair]]]
    inverse_mass = model.body_invweight0[bodies, 0].sum()
    model.pair_solref[pair] = [-(1 - IMPEDANCE) * stiffness_n_m * inverse_mass, 0.0]
    model.pair_solimp[pair] = [IMPEDANCE, IMPEDANCE, 1e-3, 0.5, 2.0]


class Contact:
    """One pass at a fixed step."""

    def __init__(self, case: Case, step_s: float, joints: str) -> None:
        self._pass, self._step_s = Pass(case), step_s
        pairs = "".join(pair_xml(f"node_{k}", "workpiece") for k in range(SEGMENTS))
        filament = filament_xml(Filament(SEGMENTS), joints)
        self._model = pass_model(self._pass, step_s, filament, pairs)
        for pair in range(SEGMENTS):
            make_spring(self._model, pair, CONTACT_STIFFNESS_N_M)

    def run(self) -> tuple[float, float]:
        """Returns seconds, and p_n in N s."""
        model, data = self._model, mujoco.MjData(self._model)
        data.qpos[0], data.qvel[0] = self._pass.start_angle_rad, self._pass.rate_rad_s
        steps, step, total = round(self._pass.end_s / self._step_s), mujoco.mj_step, 0.0
        start = time.perf_counter()
        for _ in range(steps):
            step(model, data)
            if data.ncon:
                total += data.efc_force.sum()
        seconds = time.perf_counter() - start
        return seconds, float(total) * self._step_s


def warnings_off() -> None:
    """Turns warnings off: steps that are too large are tried too, and show in p_n."""
    mujoco.set_mju_user_warning(lambda _: None)
