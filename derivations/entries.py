"""Entries of the files, by groups. Inputs are exact, the rest is rounded."""

import math

import numpy as np
from cases import EDGE_ANGLES, NORMAL, SLIDING, Case
from files import rounded
from groups import Group, flat_cups, free_cups
from integration import Statics, metrics_of


def over_profiles(case: Case, group: Group, tolerance: float) -> dict[str, object]:
    """Returns the entry of a case of the groups edges, profiles and sliding."""
    found = metrics_of(case, group, tolerance)
    (values,) = found.pop("filaments")
    if EDGE_ANGLES[0] in values:
        # Angles are those of edges between faces.
        moments, work = [values.pop(name) for name in EDGE_ANGLES], values[SLIDING[1]]
        if case.workpiece.kind in ("edge", "chamfer"):
            mean, square = (moment / work if work > 0 else 0.0 for moment in moments)
            values[EDGE_ANGLES[0]] = mean
            values[EDGE_ANGLES[1]] = math.sqrt(max(0.0, square - mean**2))
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
STATICS = {"free_cups": (free_cup, free_cups), "flat_cups": (flat_cup, flat_cups)}
