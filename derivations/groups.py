"""Cases of every reference file, by groups, and the settings of their computation.

SI units, angles in radians.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from cases import (
    ANGULAR,
    EDGE_ANGLES,
    HERTZ_STIFFNESS_N_M2,
    IMPULSE_X,
    IMPULSE_Y,
    IMPULSE_Z,
    LENGTH_M,
    NORMAL,
    OVER_EDGES,
    RIGHT,
    SLIDING,
    WORK,
    Brush,
    Case,
    Filament,
    Tool,
    Workpiece,
)


def contacts() -> list[Case]:
    """Returns six of the paper's 120 contacts: sweeping, striking, and the tier between."""
    depths_m = {2.5: [0.5e-3], 10.0: [1e-3], 15.0: [2.5e-3], 20.0: [3e-3], 30.0: [0.5e-3, 5e-3]}
    return [Case("paper", velocity, a_e) for velocity, each in depths_m.items() for a_e in each]


def edges() -> list[Case]:
    """Returns passes over edges, a cylinder and a bore, several turns, and other filaments."""
    leaving, entering = Workpiece("edge"), Workpiece("edge", -3e-3, side="entering")
    coarse, wavy_shape = Filament(10), {"waviness_amplitude_m": 0.5e-3, "waviness_phase_rad": 0.3}
    tapered = replace(coarse, tip_diameter_m=0.6e-3)
    found = [
        Case("leaving", 10.0, 1e-3, 0.3, workpiece=leaving),
        Case("entering", 10.0, 2e-3, workpiece=entering),
        Case("plane", 10.0, 1e-3),
        Case("2 turns", 30.0, 1e-3, filament=coarse, turns=2),
        Case("4 turns", 30.0, 1e-3, filament=coarse, turns=4),
        Case("3 turns, friction", 30.0, 1.5e-3, 0.4, coarse, turns=3),
        Case("2 turns, leaving", 20.0, 1e-3, 0.3, coarse, leaving, turns=2),
    ]
    pieces = (
        ("leaving", leaving),
        ("leaving, 3 mm", Workpiece("edge", 3e-3)),
        ("entering, -3 mm", entering),
        ("cylinder", Workpiece("cylinder", radius_m=0.05)),
        ("bore", Workpiece("bore", radius_m=0.30)),
    )
    processes = list(product((5.0, 10.0, 20.0), (1e-3, 2e-3), (0.0, 0.3)))
    for (name, piece), process in product(pieces, processes):
        found.append(Case(name, *process, coarse, piece))
    sides = ("leaving", 2e-3), ("entering", -4e-3)
    for degrees, (side, offset), friction in product((60, 120), sides, (0.0, 0.3)):
        piece = Workpiece("edge", offset, math.radians(degrees), 0.5e-3, side)
        found.append(Case(f"{side}, {degrees} degrees", 10.0, 1.5e-3, friction, coarse, piece))
    for friction in (0.0, 0.3):
        found.append(Case("wavy", 10.0, 1e-3, friction, replace(coarse, **wavy_shape)))
        found.append(Case("tapered", 10.0, 1e-3, friction, tapered))
    both = replace(tapered, **wavy_shape)
    return [*found, Case("wavy and tapered, leaving", 10.0, 1e-3, 0.3, both, leaving)]


def bump() -> Workpiece:
    """Returns a convex bump that nodes meet, y = A (cos(2π x/L) − 1)/2, with straight ends."""
    height, length, points = 1.5e-3, 0.048, []
    for x in np.linspace(-0.08, 0.08, 41).tolist():
        phase = 2 * math.pi * min(abs(x) / length, 0.5)
        points.append((round(x, 9), round(height * (math.cos(phase) - 1) / 2, 9)))
    return Workpiece("profile", control_points_m=tuple(points))


def corner(side: str, turn_deg: float, spacing_m: float, degree: int, offset_m: float) -> Workpiece:
    """Returns two straight faces with a corner, rounded by control points `spacing_m` apart."""
    distances = [spacing_m * i for i in range(1, degree + 3)]
    distances += [distances[-1] + d for d in (0.006, 0.014, 0.030, 0.060)]
    turn = math.radians(turn_deg)
    points = [(-d, 0.0) for d in reversed(distances)] + [(0.0, 0.0)]
    points += [(d * math.cos(turn), -d * math.sin(turn)) for d in distances]
    if side == "entering":
        points = [(-x, y) for x, y in reversed(points)]
    points = tuple((round(x, 9), round(y, 9)) for x, y in points)
    return Workpiece("profile", offset_m, degree=degree, control_points_m=points)


def profiles() -> list[Case]:
    """Returns passes with friction over chamfers, circles and splines."""
    leaving = Workpiece("chamfer", -6e-3, RIGHT, 0.5e-3, "leaving", 0.0, 4e-3, 0.12)
    entering = Workpiece("chamfer", -4e-3, RIGHT, 0.3e-3, "entering", 0.0, 2e-3)
    flat = Workpiece("chamfer", -5e-3, math.radians(100), 0.5e-3, "entering", 0.0, 3e-3, 0.5)
    kinds = (
        ("chamfer, leaving", leaving, 6, 0.25),
        ("chamfer, entering", entering, 6, 0.25),
        ("chamfer, flat, entering", flat, 8, 0.3),
        ("cylinder", Workpiece("cylinder", radius_m=0.05), 7, 0.25),
        ("cylinder, an edge", Workpiece("cylinder", radius_m=0.012), 6, 0.25),
        ("bore", Workpiece("bore", radius_m=0.25), 7, 0.25),
        ("spline, a bump", bump(), 8, 0.3),
        ("spline, entering", corner("entering", 50.0, 2e-3, 3, -4e-3), 6, 0.25),
        ("spline, leaving", corner("leaving", 60.0, 1.5e-3, 4, -8e-3), 6, 0.25),
    )
    return [
        Case(name, *process, friction, Filament(n), piece)
        for name, piece, n, friction in kinds
        for process in ((5.0, 2e-3), (10.0, 1.5e-3), (20.0, 1e-3))
    ]


def sliding() -> list[Case]:
    """Returns passes whose sliding work is known, with its place on edges."""
    entering, obtuse = Workpiece("edge", -5e-3, side="entering"), math.radians(120)
    kinds = [
        ("plane", Workpiece(), 0.3),
        ("plane, no friction", Workpiece(), 0.0),
        ("leaving", Workpiece("edge", 3e-3), 0.3),
        ("entering", entering, 0.3),
        ("entering, no friction", entering, 0.0),
        ("leaving, 60 degrees", Workpiece("edge", 2e-3, math.radians(60), 0.5e-3), 0.3),
        ("entering, 120 degrees", Workpiece("edge", -4e-3, obtuse, 0.5e-3, "entering"), 0.3),
    ]
    others = {case.name: case for case in profiles()}
    names = ["chamfer, entering", "chamfer, leaving", "cylinder", "cylinder, an edge", "bore"]
    for name in [*names, "spline, a bump", "spline, entering"]:
        kinds.append((name, others[name].workpiece, others[name].friction_coefficient))
    return [Case(name, 10.0, 1.5e-3, mu, Filament(6), piece) for name, piece, mu in kinds]


def calibration() -> list[Case]:
    """Returns points with constants that a calibration must find."""
    filament = Filament(8, youngs_modulus_pa=2.8e9, damping_ratio=0.03)
    processes = product((5.0, 10.0, 20.0, 30.0), (0.5e-3, 1e-3, 2e-3, 3e-3))
    return [Case("plane", *process, 0.15, filament) for process in processes]


def segments() -> list[Case]:
    """Returns soft contacts and wires with chains of more than 25 segments."""
    wire = Filament(50, 0.03, 0.3e-3, 0.3e-3, 7850.0, 2.06e11)
    soft = {"contact_stiffness_n_m": 1e3}
    return [
        Case("soft", 30.0, 4e-3, 0.2, Filament(25), **soft),
        Case("soft", 30.0, 4e-3, 0.2, Filament(50), **soft),
        Case("wire", 10.0, 1e-3, 0.2, wire),
        Case("soft wire", 10.0, 2e-3, 0.2, wire, **soft),
    ]


def row() -> list[Case]:
    """Returns planar rows of filaments that touch each other."""
    three = Brush(3)
    rubbing, close = replace(three, friction_coefficient=0.2), replace(three, filament_count=745.0)
    at_centrelines = replace(rubbing, friction_at="centrelines")
    stiff = replace(three, stiffness_n_m2=HERTZ_STIFFNESS_N_M2)
    damped, finer = replace(three, damping_s_m=0.1), replace(three, contact_points=7)
    everything = replace(close, friction_coefficient=0.2, damping_s_m=0.05)
    slow, fast = (10.0, 1e-3), (30.0, 2e-3)
    first = ("alone", Brush(1)), ("two", Brush(2)), ("three", three)
    first += (("three, Hertz's stiffness", stiff),)
    kinds = [(*kind, process) for kind, process in product(first, (slow, fast))]
    kinds += [
        ("three, 7 points", finer, slow),
        ("three, damped", damped, slow),
        ("alone, friction", Brush(1), (*slow, 0.3)),
        ("three, friction on the workpiece", three, (*slow, 0.3)),
        ("three, friction", rubbing, (*slow, 0.3)),
        ("three, friction at centrelines", at_centrelines, (*slow, 0.3)),
        ("alone, deep", Brush(1), (10.0, 3e-3)),
        ("three, close", close, (10.0, 3e-3)),
        ("three, close, friction and damped", everything, (20.0, 2e-3, 0.3)),
        ("two, wide", Brush(2, filament_count=150.0), slow),
    ]
    return [
        Case(name, *process, filament=Filament(5), brush=brush) for name, brush, process in kinds
    ]


def space() -> list[Case]:
    """Returns one and two filaments in space, with friction on the workpiece and between them."""
    kinds = (
        ("alone, tilted", Brush(1), 0.05),
        ("oblique", Brush(2, 800.0, along_m=0.6e-3), 0.0),
        ("abreast", Brush(2, 1100.0, along_m=1.1e-3), 0.0),
        ("tilted", Brush(2), 0.05),
        ("oblique, tilted", Brush(2, 800.0, along_m=0.8e-3), 0.02),
    )
    found = []
    for process, (name, brush, tilt) in product(((10.0, 1e-3), (20.0, 2e-3)), kinds):
        brush = replace(brush, friction_coefficient=0.2)
        case = Case(name, *process, 0.25, Filament(5), brush=brush, lateral_tilt_rad=tilt)
        found.append(case)
    return found


def poses() -> list[Case]:
    """Returns tools of any kind and pose over a plane."""
    smooth_and_rough = (
        ("radial, tilted by 0.1", Tool(RIGHT, 0.1, 0.3), 10.0, 1e-3),
        ("radial, tilted by 0.4", Tool(RIGHT, 0.4, 0.3), 8.0, 2e-3),
        ("cone of 0.9", Tool(0.9, RIGHT - 0.9), 10.0, 1e-3),
        ("cone of 1.2", Tool(1.2, 0.2, -0.2), 8.0, 1.5e-3),
        ("cup, nearly flat", Tool(0.0, RIGHT - 0.12), 6.0, 1.5e-3),
        ("cup, flat", Tool(0.0, RIGHT), 5.0, 1e-3),
    )
    rough = (
        # This one is bent outwards by 4 mm.
        ("cup, fast and leaning over", Tool(0.0, RIGHT + 0.15, 0.5), 20.0, 3e-3, 0.3),
        # This one is deeper on one side, but in contact on both.
        ("cup, tilted in contact", Tool(0.0, RIGHT - 3e-3), 5.0, 2e-3, 0.2),
        ("cone, with a trim", Tool(0.9, RIGHT - 0.95, 0.2, positions=3), 10.0, 2e-3, 0.2),
        ("radial, with a trim", Tool(RIGHT, 0.05, positions=3), 10.0, 1.5e-3, 0.2),
    )
    kinds = [
        (f"{name}, friction {mu:g}", tool, *process, mu)
        for (name, tool, *process), mu in product(smooth_and_rough, (0.0, 0.2))
    ]
    kinds += rough
    return [Case(name, *process, Filament(5), tool=tool) for name, tool, *process in kinds]


def cup(velocity_m_s: float, depth_m: float, segments: int, length_m: float = LENGTH_M) -> Case:
    """Returns a cup whose axis points into the plane."""
    filament = Filament(segments, length_m)
    return Case("cup", velocity_m_s, depth_m, filament=filament, tool=Tool(0.0, RIGHT))


def free_cups() -> Iterator[Case]:
    """Yields cups that touch nothing."""
    for length, velocity, n in product((0.020, 0.040, 0.080), (5.0, 10.0, 30.0), (5, 25)):
        yield cup(velocity, 0.0, n, length)


def flat_cups() -> Iterator[Case]:
    """Yields cups that are pressed flat."""
    for inputs in product((2.0, 5.0, 10.0), (0.5e-3, 1e-3, 3e-3), (5, 25)):
        yield cup(*inputs)


@dataclass(frozen=True)
class Group:
    """Cases of a file, and the settings of their computation."""

    cases: list[Case]
    relative_tolerance: float
    integrals: tuple[str, ...]
    has_peaks: bool = False


GROUPS = {
    "contacts_cvodes": Group(contacts(), 1e-11, (NORMAL,), True),
    "edges": Group(edges(), 1e-11, OVER_EDGES),
    "profiles": Group(profiles(), 1e-11, OVER_EDGES, True),
    "sliding": Group(sliding(), 1e-11, (*OVER_EDGES, *SLIDING, *EDGE_ANGLES)),
    "calibration": Group(calibration(), 1e-11, (NORMAL, IMPULSE_X)),
    "segments": Group(segments(), 1e-11, (NORMAL, IMPULSE_X, WORK), True),
    "row": Group(row(), 1e-12, (NORMAL, IMPULSE_X, WORK), True),
    "space": Group(space(), 1e-11, (NORMAL, IMPULSE_X, IMPULSE_Y, IMPULSE_Z, WORK), True),
    "poses": Group(poses(), 1e-11, (NORMAL, IMPULSE_X, IMPULSE_Y, IMPULSE_Z, ANGULAR, WORK)),
}
