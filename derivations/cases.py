"""A case of the reference files: tool, filament, workpiece and process, as data.

`Case` also derives all that needs no mechanics: the pose of the tool, angles and times of a pass,
and the place of the workpiece. `groups.py` has the cases of every file.

SI units, angles in radians. Frames are those of MODEL.md.
"""

import math
from dataclasses import dataclass, replace

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


# Integrals of each filament over time, by the names of the metrics.
NORMAL, WORK = "contact_normal_impulse_n_s", "friction_work_j"
IMPULSE_X, IMPULSE_Y, IMPULSE_Z = (f"contact_impulse_{axis}_n_s" for axis in "xyz")
ANGULAR = "contact_angular_impulse_n_m_s"
OVER_EDGES = (NORMAL, IMPULSE_X, IMPULSE_Y, "edge_contact_normal_impulse_n_s", WORK, ANGULAR)
SLIDING = ("sliding_work_j", "edge_sliding_work_j")
EDGE_ANGLES = ("edge_work_angle_rad", "edge_work_angle_std_rad")
