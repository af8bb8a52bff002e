"""Two filaments in space that touch each other and the workpiece, with friction, by CVODES.

What enters: nothing; the cases are those of `cases()` below.
What leaves: a JSON file with what each filament of each case does.

Touches and metrics are those of `reference_row.py`, windows those of `cvodes.py`. Stated here, in
space:

1. E_kin, E_spring (by the series of α² in the chord of two directions), D with the rates that are
   seen from the turning body; CasADi differentiates them. The force of a point on its nearest
   point is ½ k_l Δs times the overlap: the gradient of E_ab. Only points that touch take part: there
   are equations for 0, 2, 4, … of them.
2. Friction on the plane, a vector in it, and friction between filaments, a vector across the normal
   of E_ab. The latter acts half-way between a point and its nearest point, on the velocities of both
   surfaces there: a segment turns by e × ė, and not about itself. At a node the surface turns with
   the mean of both segments.

Each case is computed at two tolerances; the file gives the larger difference as its own error.

SI units, angles in radians: z along the tool axis, y normal to the plane of the workpiece, which
lies at −(R − a_e). The body turns about +z.

Run from the repository root:

    python derivations/reference_space.py
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import casadi
import cvodes
import numpy as np
import reference_row as row
from cases import (
    BODY_RADIUS_M,
    CONTACT_STIFFNESS_N_M,
    DATA,
    DIAMETER_M,
    LENGTH_M,
    REGULARISATION_M_S,
    WIDTH_M,
    Passing,
    entries_of,
    parser_of,
    rounded,
    write_cases,
)
from cvodes import RATE_UNIT_RAD_S, Window, velocity_of
from reference_row import (
    BENDING_STIFFNESS,
    DAMPING_TIME_S,
    LINE_STIFFNESS_N_M2,
    MASS_PER_LENGTH,
)

# Of each filament, then of the pair. The force between them is that on filament 0.
OF_FILAMENT = (
    "contact_normal_impulse_n_s",
    "contact_impulse_x_n_s",
    "contact_impulse_y_n_s",
    "contact_impulse_z_n_s",
    "friction_work_j",
)
OF_PAIR = (
    "normal_impulse_n_s",
    "impulse_x_n_s",
    "impulse_y_n_s",
    "impulse_z_n_s",
    "friction_work_j",
)
TOLERANCE, LOOSER = 1e-11, 1e-10
# Terms of the series of α² in the square of the chord, which is below 2: the last is below 1e-9 of
# the first at a right angle, and below 1e-16 at 0.8 rad.
TERMS = 20


@dataclass(frozen=True)
class Case(Passing):
    """A pass of one or two filaments over the plane; v_b in m/s, a_e in m.

    Filament 1 is behind filament 0 by an angle at the root, and by a distance along z.
    """

    name: str
    columns: int  # number of filaments
    brushing_velocity_m_s: float
    penetration_depth_m: float
    filament_count: float = 682.0
    along_m: float = 0.0
    lateral_tilt_rad: float = 0.0
    friction_coefficient: float = 0.25
    filament_friction_coefficient: float = 0.2
    segments: int = 5
    contact_points: int = 3
    # Rates of the dampers as seen from the body, as MODEL.md has them, or in the inertial frame.
    objective: bool = True

    @property
    def behind_rad(self) -> float:
        """Angle from a filament to the next."""
        return 2 * math.pi / self.filament_count

    @property
    def last_behind_rad(self) -> float:
        """Angle from the first filament to the last."""
        return (self.columns - 1) * self.behind_rad

    def inputs(self) -> dict[str, dict[str, object]]:
        """The case in the keys of the input file.

        Two filaments abreast are a column of two staggered rows: the second is half a pitch of its
        row behind.
        """
        is_staggered = self.along_m > 0.0
        brush = {
            "columns": 1 if is_staggered else self.columns,
            "rows": 2 if is_staggered else 1,
            "ends": "free",
            "stiffness_n_m2": LINE_STIFFNESS_N_M2,
            "contact_points": self.contact_points,
            "friction_coefficient": self.filament_friction_coefficient,
            "steady": False,
        }
        width = 2 * self.along_m if is_staggered else WIDTH_M
        tilt = {"lateral_tilt_rad": self.lateral_tilt_rad}
        return row.inputs(self, width, self.filament_count, tilt, brush)


def chain(
    instant: Sequence[casadi.SX],
    angles: casadi.SX,
    clamp: tuple[casadi.SX, casadi.SX],
    body_rate: casadi.SX,
    length_m: float = LENGTH_M,
) -> tuple[casadi.SX, casadi.SX, casadi.SX, list[casadi.SX], list[casadi.SX]]:
    """E_kin and E_spring in J, D in W of the paper's filament, its nodes 0 … n and directions.

    `angles` are (φ_1, θ_1, …, φ_n, θ_n) of the coordinates of `instant`; `clamp` is the root and the
    direction there. Dampers see rates from a body that turns at `body_rate`.
    """
    n = angles.numel() // 2
    h = length_m / n
    mass = MASS_PER_LENGTH * h
    damping_s = DAMPING_TIME_S * (length_m / LENGTH_M) ** 2

    def turning(direction: casadi.SX) -> casadi.SX:
        """The angular velocity of a segment, without spin about itself, that its dampers see."""
        rate = velocity_of(direction, instant)
        return casadi.cross(direction, rate - casadi.cross(body_rate, direction))

    root, before = clamp
    nodes, directions, kinetic, springs, dissipation = [root], [], 0, 0, 0
    turning_before = turning(before)
    for k in range(n):
        polar, azimuth = angles[2 * k], angles[2 * k + 1]
        direction = casadi.vertcat(
            casadi.sin(polar) * casadi.cos(azimuth),
            casadi.sin(polar) * casadi.sin(azimuth),
            casadi.cos(polar),
        )
        velocity = velocity_of(nodes[k] + h / 2 * direction, instant)
        kinetic += mass / 2 * casadi.sumsqr(velocity)
        kinetic += mass * h**2 / 24 * casadi.sumsqr(velocity_of(direction, instant))
        # The clamp joint carries only half a segment's compliance.
        stiffness = (2 if k == 0 else 1) * BENDING_STIFFNESS / h
        springs += stiffness / 2 * angle_squared(direction - before)
        turns = turning(direction)
        dissipation += damping_s * stiffness / 2 * casadi.sumsqr(turns - turning_before)
        nodes.append(nodes[k] + h * direction)
        directions.append(direction)
        before, turning_before = direction, turns
    return kinetic, springs, dissipation, nodes, directions


def angle_squared(chord: casadi.SX) -> casadi.SX:
    """α² = (2 asin(|chord|/2))² = Σ 2 (k−1)!²/(2k)! |chord|^(2k)."""
    square, total = casadi.sumsqr(chord), 0
    for k in range(TERMS, 0, -1):
        total = (total + 2 * math.factorial(k - 1) ** 2 / math.factorial(2 * k)) * square
    return total


def friction(coefficient: float, pressure: casadi.SX, sliding: casadi.SX) -> casadi.SX:
    """Coulomb's law, regularised."""
    speed = casadi.sqrt(casadi.sumsqr(sliding) + REGULARISATION_M_S**2)
    return -coefficient * pressure / speed * sliding


class Equations(cvodes.Equations):
    """The equations of motion in space, in the form of `reference_row.py`.

    Coordinates are (φ_1, θ_1, …, φ_n, θ_n) of filament 0, then those of filament 1.
    """

    def __init__(self, case: Case, most_touching: int = 0) -> None:
        self.case, self.columns, n = case, case.columns, case.segments
        self.contact_points, self.most_touching = case.contact_points, most_touching
        self.node_count = self.columns * n
        self._angles = casadi.SX.sym("q", 2 * self.node_count)
        self._rates = casadi.SX.sym("v", 2 * self.node_count)
        self._instant = [casadi.SX.sym("t"), self._angles, self._rates]
        below = casadi.SX.sym("below", self.node_count)
        # Of each point that touches: 1; whether the nearest point is a node, and its place on its
        # segment if so; 1 if it lies on filament 0, else −1. Weights of all nodes in the point, and
        # in the ends of the nearest point's segment; of all segments in the turning of both surfaces.
        width = 4 + 3 * (self.node_count + self.columns) + 2 * self.node_count
        points = casadi.SX.sym("points", width, most_touching)
        parameters = casadi.vertcat(below, casadi.vec(points))

        kinetic, springs, dissipation = self._chains()
        on_plane, of_plane = self._workpiece(below)
        between, of_pair, pair_force = self._pair(points)
        energies = kinetic, kinetic - springs, dissipation
        integrands = casadi.vertcat(of_plane, of_pair)
        self.derive(self._instant, parameters, energies, [on_plane, between], integrands)
        observed = [pair_force, casadi.SX.zeros(1)]
        self.observed = casadi.Function("observed", [*self._instant, parameters], observed)

    def _rate_of(self, vector: casadi.SX) -> casadi.SX:
        return velocity_of(vector, self._instant)

    def _chains(self) -> tuple[casadi.SX, casadi.SX, casadi.SX]:
        """E_kin and E_spring in J, D in W; sets nodes, their velocities, and e × ė of segments."""
        case, count = self.case, 2 * self.case.segments
        axis, tilt = casadi.SX([0.0, 0.0, 1.0]), case.lateral_tilt_rad
        body_rate = case.rate_rad_s * axis if case.objective else casadi.SX.zeros(3)
        energies = casadi.SX.zeros(3)
        self._nodes, self._velocities, self._directions, self._spins = [], [], [], []
        for filament in range(self.columns):
            body = case.start_angle_rad - filament * case.behind_rad
            body += case.rate_rad_s * self._instant[0]
            radial = casadi.vertcat(casadi.cos(body), casadi.sin(body), 0.0)
            root = BODY_RADIUS_M * radial + filament * case.along_m * axis
            clamp = root, math.cos(tilt) * radial + math.sin(tilt) * axis
            angles = self._angles[filament * count : (filament + 1) * count]
            *of_filament, nodes, directions = chain(self._instant, angles, clamp, body_rate)
            energies += casadi.vertcat(*of_filament)
            spins = [casadi.cross(each, self._rate_of(each)) for each in directions]
            self._nodes.append(casadi.horzcat(*nodes))
            self._velocities.append(casadi.horzcat(*map(self._rate_of, nodes)))
            self._directions.append(casadi.horzcat(*directions))
            self._spins.append(casadi.horzcat(*spins))
        return energies[0], energies[1], energies[2]

    def _workpiece(self, below: casadi.SX) -> tuple[casadi.SX, casadi.SX]:
        """Generalised forces of the plane, and the rates of the integrals of each filament."""
        case, n = self.case, self.case.segments
        torques, integrands = casadi.SX.zeros(2 * self.node_count), []
        for filament in range(self.columns):
            sums = casadi.SX.zeros(len(OF_FILAMENT))
            for k in range(n):
                node = self._nodes[filament][:, k + 1]
                pressure = CONTACT_STIFFNESS_N_M * (case.height_m - node[1])
                pressure *= below[filament * n + k]
                velocity = self._velocities[filament][:, k + 1]
                sliding = casadi.vertcat(velocity[0], 0.0, velocity[2])
                rubbing = friction(case.friction_coefficient, pressure, sliding)
                force = rubbing + casadi.vertcat(0.0, pressure, 0.0)
                torques += casadi.jtimes(node, self._angles, force, True)
                sums += casadi.vertcat(pressure, force, -casadi.dot(rubbing, sliding))
            integrands.append(sums)
        return torques, casadi.vertcat(*integrands)

    def _pair(self, points: casadi.SX) -> tuple[casadi.SX, casadi.SX, casadi.SX]:
        """Generalised forces between the filaments, rates of the pair's integrals, normal force."""
        case, count = self.case, self.node_count + self.columns
        nodes, velocities = casadi.horzcat(*self._nodes), casadi.horzcat(*self._velocities)
        directions, spins = casadi.horzcat(*self._directions), casadi.horzcat(*self._spins)
        stiffness = LINE_STIFFNESS_N_M2 / 2 * LENGTH_M / case.segments / case.contact_points
        on_nodes, moments = casadi.SX.zeros(3, count), casadi.SX.zeros(3, self.node_count)
        sums = casadi.SX.zeros(len(OF_PAIR))
        for i in range(self.most_touching):
            touches, at_node, node_place, sign = (points[j, i] for j in range(4))
            own, inner, outer = (points[4 + j * count : 4 + (j + 1) * count, i] for j in range(3))
            first = 4 + 3 * count
            own_turning = points[first : first + self.node_count, i]
            other_turning = points[first + self.node_count :, i]
            # The nearest point; segments have the length h.
            nearest = casadi.dot(nodes @ (own - inner), nodes @ (outer - inner))
            nearest /= (LENGTH_M / case.segments) ** 2
            place = at_node * node_place + (1 - at_node) * nearest
            other = inner + place * (outer - inner)
            # Of what is not there, any distance is a finite one.
            offset = nodes @ (own - other) + (1 - touches) * casadi.SX([1.0, 0.0, 0.0])
            distance = casadi.norm_2(offset)
            pressure, normal = touches * stiffness * (DIAMETER_M - distance), offset / distance
            # Half-way: from the point by −offset/2, from the nearest point by +offset/2.
            relative = velocities @ (own - other)
            relative -= casadi.cross(spins @ (own_turning + other_turning), offset) / 2
            sliding = relative - casadi.dot(relative, normal) * normal
            rubbing = friction(case.filament_friction_coefficient, pressure, sliding)
            force = pressure * normal + rubbing
            # What is paired with velocities and spins in the power of the force.
            on_nodes += force @ (own - other).T
            moments -= casadi.cross(offset, force) / 2 @ (own_turning + other_turning).T
            sums += casadi.vertcat(pressure, sign * force, -casadi.dot(rubbing, sliding))
        torques = casadi.jtimes(casadi.vec(nodes), self._angles, casadi.vec(on_nodes), True)
        # (e × ė)·m = ė·(m × e)
        pairs = [casadi.cross(moments[:, k], directions[:, k]) for k in range(self.node_count)]
        of_moments = casadi.vertcat(*pairs)
        torques += casadi.jtimes(casadi.vec(directions), self._angles, of_moments, True)
        if self.columns == 1:
            return torques, casadi.SX(0, 1), casadi.SX(0, 1)
        return torques, sums, sums[0]


class Motion(row.Motion):
    """A pass in space."""

    equations_of = Equations
    of_filament, of_pair = OF_FILAMENT, OF_PAIR

    def __init__(self, case: Case, relative_tolerance: float) -> None:
        super().__init__(case, relative_tolerance)
        self._tolerance, self._known = relative_tolerance, {0: (self.equations, self._integrator)}

    def _window(self, start_s: float, end_s: float, y: np.ndarray, touch: np.ndarray) -> Window:
        """The motion with one touch, by the equations for at least so many points that touch."""
        touching, most = int(np.count_nonzero(touch[self.equations.node_count :])), 0
        while most < touching:
            most = max(2, 2 * most)
        if most not in self._known:
            equations = Equations(self.case, most)
            integrator = equations.integrator(self._tolerance, self._shares)
            self._known[most] = equations, integrator
        self.equations, self._integrator = self._known[most]
        return super()._window(start_s, end_s, y, touch)

    def parameters(self, touch: np.ndarray) -> np.ndarray:
        """The touch as the equations take it."""
        n, nodes, count = self._n, self.equations.node_count, self._contact_points
        all_nodes = nodes + self._columns
        width = 4 + 3 * all_nodes + 2 * nodes
        points = np.zeros((width, self.equations.most_touching))
        for slot, number in enumerate(np.flatnonzero(touch[nodes:])):
            # Points are those of filament 0 on filament 1, segment by segment, then the others.
            a, of_filament = divmod(int(number), n * count)
            k, i = divmod(of_filament, count)
            place, b = (i + 0.5) / count, 1 - a
            # The feature is 2 j at node j and 2 j − 1 inside segment j, both counted from 1.
            node, inside = divmod(int(touch[nodes + number]) - 1, 2)
            segment = node if inside else max(node - 1, 0)
            following = segment if inside else min(node, n - 1)
            column = points[:, slot]
            column[:4] = 1.0, float(not inside), float(node > 0), 1.0 if a == 0 else -1.0
            own, inner, outer = column[4 : 4 + 3 * all_nodes].reshape(3, all_nodes)
            own[a * (n + 1) + k], own[a * (n + 1) + k + 1] = 1 - place, place
            inner[b * (n + 1) + segment] = outer[b * (n + 1) + segment + 1] = 1.0
            own_turning, other_turning = column[4 + 3 * all_nodes :].reshape(2, nodes)
            own_turning[a * n + k] = 1.0
            # The surface at a node turns with both segments.
            other_turning[b * n + segment] += 0.5
            other_turning[b * n + following] += 0.5
        return np.concatenate([touch[:nodes].astype(float), points.ravel("F")])

    def start(self) -> np.ndarray:
        """Straight filaments along their clamps, turning rigidly with the body."""
        case = self.case
        angles = np.empty((case.columns, case.segments, 2))
        angles[..., 0] = math.pi / 2 - case.lateral_tilt_rad
        angles[..., 1] = self.bodies(np.zeros(1))[0][:, None]
        rates = np.zeros_like(angles)
        rates[..., 1] = case.rate_rad_s / RATE_UNIT_RAD_S
        integrals = np.zeros(self.equations.integral_count)
        return np.concatenate([angles.ravel(), rates.ravel(), integrals])

    def polylines(self, times: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Positions (times, filaments, nodes, 3), for coordinates as columns."""
        case, bodies = self.case, self.bodies(times)[..., None]
        along = np.broadcast_to(case.along_m * np.arange(case.columns)[:, None], bodies.shape)
        root = BODY_RADIUS_M * np.cos(bodies), BODY_RADIUS_M * np.sin(bodies), along
        q = angles.T.reshape(len(times), case.columns, case.segments, 2)
        polar, azimuth, h = q[..., 0], q[..., 1], LENGTH_M / case.segments
        steps = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)
        both = [np.stack(root, axis=-1), h * np.stack(steps, axis=-1)]
        return np.cumsum(np.concatenate(both, axis=2), axis=2)

    @staticmethod
    def deflections_m(lines: np.ndarray, bodies: np.ndarray) -> np.ndarray:
        """Not asked for."""
        return np.zeros(bodies.shape)

    def check(self, window: Window) -> None:
        """Nothing happens that the equations leave out."""


def result(case: Case) -> dict[str, object]:
    """The entry of a case in the file."""
    values, others = (row.metrics(Motion(case, each)) for each in (TOLERANCE, LOOSER))
    errors = row.own_errors(values, others)
    # What the case says already, or nobody asks for.
    del values["jumps_of_nearest_points"]
    for each in (*values["filaments"], *values["neighbours"]):
        for name in ("column", "columns", "contact_count", "max_tip_deflection_m"):
            each.pop(name, None)
    entry = {"name": case.name, "input": case.inputs()}
    entry |= {"start_angle_rad": case.start_angle_rad, "end_s": case.end_s} | values
    return rounded(entry | {"own_errors": errors})


def cases(objective: bool) -> list[Case]:
    """The cases of the file."""
    return [
        Case(name, columns, *process, *place, objective=objective)
        for process in ((10.0, 1e-3), (20.0, 2e-3))
        for name, columns, place in (
            ("alone, tilted", 1, (682.0, 0.0, 0.05)),
            ("oblique", 2, (800.0, 0.6e-3)),
            ("abreast", 2, (1100.0, 1.1e-3)),
            ("tilted", 2, (682.0, 0.0, 0.05)),
            ("oblique, tilted", 2, (800.0, 0.8e-3, 0.02)),
        )
    ]


def main() -> None:
    """Command line."""
    parser = parser_of("Write passes of two filaments in space.", DATA / "reference_space.json")
    parser.add_argument(
        "--inertial", action="store_true", help="dampers that see rates in the inertial frame"
    )
    arguments = parser.parse_args()
    entries = entries_of(result, cases(not arguments.inertial), arguments)
    script = "reference_space.py --inertial" if arguments.inertial else "reference_space.py"
    if arguments.only is None:
        write_cases(arguments.output, cvodes.command(script, TOLERANCE), entries)


if __name__ == "__main__":
    main()
