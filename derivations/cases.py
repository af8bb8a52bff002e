"""Cases of the reference files: tool, filament, workpiece and process of each, as data.

`GROUPS` has the cases of every file. `Case` also derives all that needs no mechanics: the pose of
the tool, angles and times of a pass, and the place of the workpiece.

SI units, angles in radians. Frames are those of MODEL.md.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.polynomial import Legendre, Polynomial

# The paper's tool and filament, and the defaults for what the paper leaves open.
BODY_RADIUS_M = 0.140
WIDTH_M = 0.020
LENGTH_M = 0.040
TOOL_RADIUS_M = BODY_RADIUS_M + LENGTH_M
FILAMENT_COUNT = 10_500
DIAMETER_M = 1.18e-3
DENSITY_KG_M3 = 1110.0
YOUNGS_MODULUS_PA = 3.0e9
DAMPING_RATIO = 0.05
CONTACT_STIFFNESS_N_M = 1e5
REGULARISATION_M_S = 1e-3
LEAD_ANGLE_RAD = 0.005
TAIL_ANGLE_RAD = 0.15
# Stiffness between filaments: the default, and Hertz's value E/(4 (1 − ν²)) with ν = 0.4.
LINE_STIFFNESS_N_M2, HERTZ_STIFFNESS_N_M2 = 6e7, 9e8

# Number of segments up to which each node presses with the whole stiffness.
WHOLE_STIFFNESS_SEGMENTS = 25
# Radius in segments from which a convex arc is a face.
SEGMENTS_OF_FACE = 5
# Maximum number of turns in which the filament touches all the time.
MAX_TURNS = 50
RIGHT = math.pi / 2


@dataclass(frozen=True)
class State:
    """One instant of a chain in space, at which its equations of motion are evaluated."""

    kind: str
    youngs_modulus_pa: float
    base_angle: float  # β in rad
    base_rate: float  # ω in rad/s
    base_acceleration: float  # β̈ in rad/s²
    gravity: list[float]  # g in m/s², inertial frame
    q: list[float]  # φ_1, θ_1, …, φ_n, θ_n in rad
    v: list[float]  # their rates in rad/s


@dataclass(frozen=True)
class Filament:
    """A filament; by default the paper's, straight and uniform."""

    segments: int = 25
    length_m: float = LENGTH_M
    diameter_m: float = DIAMETER_M
    tip_diameter_m: float = DIAMETER_M
    density_kg_m3: float = DENSITY_KG_M3
    youngs_modulus_pa: float = YOUNGS_MODULUS_PA
    damping_ratio: float = DAMPING_RATIO
    waviness_amplitude_m: float = 0.0
    waviness_length_m: float = 0.020
    waviness_phase_rad: float = 0.0

    @property
    def segment_m(self) -> float:
        """Length of a segment."""
        return self.length_m / self.segments

    def _diameters_m(self, arc_lengths: np.ndarray) -> np.ndarray:
        """Returns the diameters, which are linear from the root to the tip."""
        taper = self.tip_diameter_m - self.diameter_m
        return self.diameter_m + taper * arc_lengths / self.length_m

    def _bending_stiffnesses(self, arc_lengths: np.ndarray) -> np.ndarray:
        """Returns E I in N m²."""
        return self.youngs_modulus_pa * math.pi * self._diameters_m(arc_lengths) ** 4 / 64

    def _masses_per_length(self, arc_lengths: np.ndarray) -> np.ndarray:
        """Returns ρ A in kg/m."""
        return self.density_kg_m3 * math.pi * self._diameters_m(arc_lengths) ** 2 / 4

    def contact_share(self, node: int) -> float:
        """Returns the share of the contact stiffness of a node, which is 1 at the tip."""
        return 1.0 if node == self.segments else min(1.0, WHOLE_STIFFNESS_SEGMENTS / self.segments)

    @property
    def masses_kg(self) -> list[float]:
        """Masses of the segments."""
        centres = (np.arange(self.segments) + 0.5) * self.segment_m
        return (self._masses_per_length(centres) * self.segment_m).tolist()

    @property
    def inertias_kg_m2(self) -> list[float]:
        """Moments of inertia of the segments about their centres, across their axes."""
        return [mass * self.segment_m**2 / 12 for mass in self.masses_kg]

    @property
    def stiffnesses_n_m(self) -> list[float]:
        """Stiffnesses of the joints; the clamp joint carries only half a segment's compliance."""
        joints = np.array([0.25, *range(1, self.segments)]) * self.segment_m
        stiffnesses = self._bending_stiffnesses(joints) / self.segment_m
        stiffnesses[0] *= 2
        return stiffnesses.tolist()

    @property
    def damping_time_s(self) -> float:
        """Damping over stiffness of a joint, 2 ζ / Ω_1.

        Ω_1 is the frequency of the clamped beam, by Ritz's method with polynomials up to degree 15.
        """
        legendre = [Legendre.basis(i, [0.0, 1.0]).convert(kind=Polynomial) for i in range(14)]
        functions = [Polynomial.basis(2) * each for each in legendre]
        points, weights = np.polynomial.legendre.leggauss(24)
        points, weights = (points + 1) / 2, weights / 2
        values = np.array([function(points) for function in functions])
        bends = np.array([function.deriv(2)(points) for function in functions])
        mass = weights * self._masses_per_length(self.length_m * points)
        stiffness = weights * self._bending_stiffnesses(self.length_m * points)
        # The largest eigenvalue, 1/Ω_1², is known to rounding; the smallest would not be.
        factor = np.linalg.cholesky((bends * stiffness) @ bends.T)
        values = np.linalg.solve(factor, values)
        squared_times = np.linalg.eigvalsh((values * mass) @ values.T)
        return 2 * self.damping_ratio * math.sqrt(squared_times[-1]) * self.length_m**2

    @property
    def dampings_n_m_s(self) -> list[float]:
        """Dampings of the joints."""
        return [self.damping_time_s * stiffness for stiffness in self.stiffnesses_n_m]

    @property
    def relaxed_angles_rad(self) -> np.ndarray:
        """γ_1 … γ_n, relative to the clamp."""
        arc_lengths = np.arange(self.segments + 1) * self.segment_m
        phases = 2 * math.pi * arc_lengths / self.waviness_length_m + self.waviness_phase_rad
        across = self.waviness_amplitude_m * np.sin(phases)
        return np.arcsin(np.diff(across) / self.segment_m)

    def inputs(self) -> dict[str, object]:
        """Returns the filament in the keys of the input file."""
        keys = ["segments", "tip_diameter_m", "waviness_amplitude_m"]
        if self.waviness_amplitude_m > 0.0:
            keys += ["waviness_length_m", "waviness_phase_rad"]
        return {key: getattr(self, key) for key in keys}


OF_EDGE = ("offset_m", "included_angle_rad", "edge_radius_m", "side")
WORKPIECE_KEYS = {
    "plane": (),
    "edge": OF_EDGE,
    "chamfer": (*OF_EDGE, "chamfer_width_m", "chamfer_angle_rad"),
    "cylinder": ("offset_m", "radius_m"),
    "bore": ("offset_m", "radius_m"),
    "profile": ("offset_m", "degree", "control_points_m"),
}


@dataclass(frozen=True)
class Workpiece:
    """A workpiece of any kind, as MODEL.md places it; a profile is open and clamped."""

    kind: str = "plane"
    offset_m: float = 0.0
    included_angle_rad: float = math.pi / 2
    edge_radius_m: float = 0.2e-3
    side: str = "leaving"
    radius_m: float = 0.0
    chamfer_width_m: float = 0.0
    chamfer_angle_rad: float = math.pi / 4
    degree: int = 3
    control_points_m: tuple[tuple[float, float], ...] = ()

    def inputs(self) -> dict[str, object]:
        """Returns the workpiece in the keys of the input file."""
        return {key: getattr(self, key) for key in ("kind", *WORKPIECE_KEYS[self.kind])}


@dataclass(frozen=True)
class Brush:
    """Filaments that touch, as the input file's [brush] describes them, and their number around.

    Each column is behind the one before, and by `along_m` farther along the tool's axis. Friction
    between filaments acts half-way between their centrelines, where the surfaces meet. In another
    reading of the model it acts at the points on the centrelines.
    """

    columns: int
    filament_count: float = 682.0
    stiffness_n_m2: float = LINE_STIFFNESS_N_M2
    contact_points: int = 3
    damping_s_m: float = 0.0
    friction_coefficient: float = 0.0
    friction_at: str = "surfaces"
    along_m: float = 0.0

    def inputs(self) -> dict[str, object]:
        """Returns the keys of the input file.

        Two filaments abreast are a column of two staggered rows: the second is half a pitch of its
        row behind.
        """
        keys = "stiffness_n_m2", "contact_points", "damping_s_m", "friction_coefficient"
        settings = {key: getattr(self, key) for key in keys}
        arrangement = (1, 2) if self.along_m > 0.0 else (self.columns, 1)
        return {
            **dict(zip(("columns", "rows"), arrangement, strict=True)),
            **settings,
            "steady": False,
        }


# A filament of the paper's brush without neighbours.
ALONE = Brush(1, FILAMENT_COUNT)


@dataclass(frozen=True)
class Tool:
    """Kind and pose of a tool: γ, τ, σ, and the number of filaments along the trim.

    `place_m` is the place s of the simulated filament on the trim.
    """

    filament_angle_rad: float = RIGHT
    tilt_rad: float = 0.0
    skew_rad: float = 0.0
    positions: int = 1
    place_m: float = 0.0

    @property
    def kind(self) -> str:
        """Kind in the input file."""
        return {0.0: "cup", RIGHT: "round"}.get(self.filament_angle_rad, "cone")

    @property
    def pose(self) -> np.ndarray:
        """Rotation from the tool's frame to that of the workpiece, R_y(σ) R_x(τ)."""
        c, s = math.cos(self.tilt_rad), math.sin(self.tilt_rad)
        about_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
        c, s = math.cos(self.skew_rad), math.sin(self.skew_rad)
        return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ about_x

    def root_m(self, place_m: float) -> tuple[float, float]:
        """Returns the distance from the axis, and the coordinate along it, of a root."""
        sin, cos = math.sin(self.filament_angle_rad), math.cos(self.filament_angle_rad)
        return BODY_RADIUS_M - place_m * cos, place_m * sin


@dataclass(frozen=True)
class Case:
    """A pass, several turns, or turns in which the filament touches all the time."""

    name: str
    brushing_velocity_m_s: float
    penetration_depth_m: float
    friction_coefficient: float = 0.0
    filament: Filament = Filament()
    workpiece: Workpiece = Workpiece()
    turns: int = 1
    brush: Brush = ALONE
    tool: Tool = Tool()
    lateral_tilt_rad: float = 0.0
    contact_stiffness_n_m: float = CONTACT_STIFFNESS_N_M

    @property
    def label(self) -> str:
        """Name and process, unique in a group."""
        process = f"{self.brushing_velocity_m_s:g} m/s, {1e3 * self.penetration_depth_m:g} mm"
        return f"{self.name}, {process}, µ = {self.friction_coefficient:g}"

    @property
    def is_planar(self) -> bool:
        """`true` if the motion stays in the plane of rotation by symmetry."""
        is_lateral = self.lateral_tilt_rad != 0.0 or self.brush.along_m > 0.0
        return self.tool == Tool() and not is_lateral

    @property
    def behind_rad(self) -> float:
        """Angle from a column to the next."""
        return 2 * math.pi / self.brush.filament_count

    @property
    def rate_rad_s(self) -> float:
        """ω = v_b / R(0)."""
        radius = BODY_RADIUS_M + self.filament.length_m * math.sin(self.tool.filament_angle_rad)
        return self.brushing_velocity_m_s / radius

    @property
    def process(self) -> dict[str, float]:
        """v_b and a_e in the keys of the input file."""
        keys = "brushing_velocity_m_s", "penetration_depth_m"
        return {key: getattr(self, key) for key in keys}

    @property
    def turn_s(self) -> float:
        """Time of a turn."""
        return 2 * math.pi / self.rate_rad_s

    def across_and_along_m(self, place_m: float) -> tuple[float, float]:
        """Returns the depth of the undeformed tip across the tilted axis, and along it."""
        tool, length = self.tool, self.filament.length_m
        radius, along = tool.root_m(place_m)
        radius += length * math.sin(tool.filament_angle_rad)
        along += length * math.cos(tool.filament_angle_rad)
        return radius * abs(math.cos(tool.tilt_rad)), along * math.sin(tool.tilt_rad)

    @property
    def height_m(self) -> float:
        """y of the workpiece's own y = 0."""
        ends = [0.0] if self.tool.positions == 1 else [-WIDTH_M / 2, WIDTH_M / 2]
        return self.penetration_depth_m - max(sum(self.across_and_along_m(s)) for s in ends)

    @property
    def half_angle_rad(self) -> float:
        """Half of the angle over which the undeformed tip is in the material; π if always.

        All workpieces but a bore lie below y = 0.
        """
        if self.workpiece.kind == "bore":
            radius, centre = self.workpiece.radius_m, self.height_m + self.workpiece.radius_m
            sine = (TOOL_RADIUS_M**2 + centre**2 - radius**2) / (2 * TOOL_RADIUS_M * centre)
            return math.pi / 2 + math.asin(sine)
        across, along = self.across_and_along_m(self.tool.place_m)
        depth = self.height_m + across + along
        return math.pi if depth >= 2 * across else math.acos(1 - depth / across)

    @property
    def is_all_round(self) -> bool:
        """`true` if the undeformed tip is in the material during the whole turn."""
        return self.half_angle_rad == math.pi

    @property
    def start_angle_rad(self) -> float:
        """β_0: the first filament starts at the lead angle before it can touch."""
        ahead = 0.0 if self.is_all_round else self.half_angle_rad + LEAD_ANGLE_RAD
        return -math.copysign(RIGHT, math.cos(self.tool.tilt_rad)) - ahead

    @property
    def end_s(self) -> float:
        """End of a single turn: the last filament is the tail angle past its nominal exit."""
        angle = LEAD_ANGLE_RAD + 2 * self.half_angle_rad + TAIL_ANGLE_RAD
        return (angle + (self.brush.columns - 1) * self.behind_rad) / self.rate_rad_s

    @property
    def ends_of_turns_s(self) -> list[float]:
        """Ends of all turns; the workpiece comes up in the first one if it is touched all round."""
        if self.turns == 1 and not self.is_all_round:
            return [self.end_s]
        turns = MAX_TURNS + 1 if self.is_all_round else self.turns
        return [self.turn_s * turn for turn in range(1, turns + 1)]

    @property
    def of_trim(self) -> list[tuple[float, "Case"]]:
        """Filaments at Gauss's points of the trim, each with its share of all filaments."""
        points, weights = np.polynomial.legendre.leggauss(self.tool.positions)
        tools = [replace(self.tool, place_m=float(s) * WIDTH_M / 2) for s in points]
        weights = weights * [tool.root_m(tool.place_m)[0] for tool in tools]
        filaments = [replace(self, tool=tool) for tool in tools]
        return list(zip(weights / np.sum(weights), filaments, strict=True))

    def inputs(self) -> dict[str, dict[str, object]]:
        """Returns the case in the keys of the input file."""
        brush, width_m = self.brush, 2 * self.brush.along_m or WIDTH_M
        tool = {"body_radius_m": BODY_RADIUS_M, "width_m": width_m}
        tool["filament_count"] = brush.filament_count
        if self.tool != Tool():
            keys = ("kind", "filament_angle_rad", "tilt_rad", "skew_rad", "positions")
            tool |= {key: getattr(self.tool, key) for key in keys}
        keys = ("segments", "length_m", "youngs_modulus_pa", "damping_ratio")
        keys += ("diameter_m", "density_kg_m3")
        filament = {key: getattr(self.filament, key) for key in keys}
        contact = {
            "stiffness_n_m": self.contact_stiffness_n_m,
            "friction_coefficient": self.friction_coefficient,
            "friction_regularisation_m_s": REGULARISATION_M_S,
        }
        angles = {"lead_angle_rad": LEAD_ANGLE_RAD, "tail_angle_rad": TAIL_ANGLE_RAD}
        process = self.process | angles
        found = {"tool": tool, "filament": filament, "contact": contact, "process": process}
        if brush != ALONE:
            found["brush"] = brush.inputs()
        if brush != ALONE and not self.is_planar:
            found["brush"]["ends"] = "free"
            filament["lateral_tilt_rad"] = self.lateral_tilt_rad
        return found


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


# Integrals of each filament over time, by the names of the metrics.
NORMAL, WORK = "contact_normal_impulse_n_s", "friction_work_j"
IMPULSE_X, IMPULSE_Y, IMPULSE_Z = (f"contact_impulse_{axis}_n_s" for axis in "xyz")
ANGULAR = "contact_angular_impulse_n_m_s"
OVER_EDGES = (NORMAL, IMPULSE_X, IMPULSE_Y, "edge_contact_normal_impulse_n_s", WORK, ANGULAR)
SLIDING = ("sliding_work_j", "edge_sliding_work_j")
EDGE_ANGLES = ("edge_work_angle_rad", "edge_work_angle_std_rad")


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
