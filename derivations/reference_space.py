"""Two filaments in space that touch each other and the workpiece, with friction, by CVODES.

What enters: nothing; the cases are those of `cases()` below.
What leaves: a JSON file with what each filament of each case does.

Windows, events and the form of the equations are those of `reference_row.py`. Stated here, in space:

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

import argparse
import json
import math
import multiprocessing
from dataclasses import asdict, dataclass
from pathlib import Path

import casadi
import numpy as np
import reference_row as row
from reference_row import (
    BENDING_STIFFNESS,
    BODY_RADIUS_M,
    CONTACT_STIFFNESS_N_M,
    DAMPING_RATIO,
    DIAMETER_M,
    FIRST_FREQUENCY,
    INTEGRAL_UNIT,
    LEAD_ANGLE_RAD,
    LENGTH_M,
    LINE_STIFFNESS_N_M2,
    MASS_PER_LENGTH,
    RATE_UNIT_RAD_S,
    REGULARISATION_M_S,
    TAIL_ANGLE_RAD,
    TOOL_RADIUS_M,
)

DEFAULT_OUTPUT = row.ROOT / "tests" / "data" / "reference_space.json"
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
class Case:
    """A pass of one or two filaments over the plane; v_b in m/s, a_e in m.

    Filament 1 is behind filament 0 by an angle at the root, and by a distance along z.
    """

    name: str
    filaments: int
    brushing_velocity_m_s: float
    penetration_depth_m: float
    behind_rad: float = 0.0
    along_m: float = 0.0
    lateral_tilt_rad: float = 0.0
    friction_coefficient: float = 0.25
    filament_friction_coefficient: float = 0.2
    segments: int = 5
    contact_points: int = 3
    # Rates of the dampers as seen from the body, as MODEL.md has them, or in the inertial frame.
    objective: bool = True

    @property
    def rate_rad_s(self) -> float:
        """ω = v_b / R."""
        return self.brushing_velocity_m_s / TOOL_RADIUS_M

    @property
    def height_m(self) -> float:
        """Where the plane lies."""
        return self.penetration_depth_m - TOOL_RADIUS_M

    @property
    def contact_angle_rad(self) -> float:
        """Ω_c."""
        return 2 * math.acos(-self.height_m / TOOL_RADIUS_M)

    @property
    def start_angle_rad(self) -> float:
        """Filament 0 starts at the lead angle before its nominal entry."""
        return -math.pi / 2 - self.contact_angle_rad / 2 - LEAD_ANGLE_RAD

    @property
    def end_s(self) -> float:
        """The last filament ends at the tail angle past its nominal exit."""
        behind = self.behind_rad * (self.filaments - 1)
        angle = LEAD_ANGLE_RAD + self.contact_angle_rad + behind + TAIL_ANGLE_RAD
        return angle / self.rate_rad_s


def crossed(a: casadi.SX, b: casadi.SX) -> casadi.SX:
    """Cross product."""
    return casadi.cross(a, b)


class Equations(row.Equations):
    """The equations of motion in space, in the form of `reference_row.py`.

    Coordinates are (φ_1, θ_1, …, φ_n, θ_n) of filament 0, then those of filament 1.
    """

    def __init__(self, case: Case, most_touching: int) -> None:
        self.case, self.columns, n = case, case.filaments, case.segments
        self.contact_points, self.most_touching = case.contact_points, most_touching
        self.node_count = self.columns * n
        self.count = 2 * self.node_count
        self.integral_count = self.columns * len(OF_FILAMENT) + (self.columns - 1) * len(OF_PAIR)
        self.size = 2 * self.count + self.integral_count
        self._time = time = casadi.SX.sym("t")
        self._angles = angles = casadi.SX.sym("q", self.count)
        self._rates = rates = casadi.SX.sym("v", self.count)
        accelerations = casadi.SX.sym("a", self.count)
        below = casadi.SX.sym("below", self.node_count)
        # Of each point that touches: 1; whether the nearest point is a node, and its place on its
        # segment if so; 1 if it lies on filament 0, else −1. Weights of all nodes in the point, and
        # in the ends of the nearest point's segment; of all segments in the turning of both surfaces.
        width = 4 + 3 * (self.node_count + self.columns) + 2 * self.node_count
        points = casadi.SX.sym("points", width, most_touching)
        parameters = casadi.vertcat(below, casadi.vec(points))
        self.parameter_count = parameters.numel()

        kinetic, springs, dissipation = self._chains()
        on_plane, of_plane = self._workpiece(below)
        between, of_pair, pair_force = self._pair(points)
        momenta = casadi.gradient(kinetic, rates)
        mass_matrix = casadi.jacobian(momenta, rates)
        right_side = (
            casadi.gradient(kinetic - springs, angles)
            - casadi.gradient(dissipation, rates)
            - casadi.jtimes(momenta, angles, rates)
            - casadi.jacobian(momenta, time)
            + on_plane
            + between
        )
        integrands = casadi.vertcat(of_plane, of_pair)
        residual = mass_matrix @ accelerations - right_side
        instant = [time, angles, rates, parameters]
        motion = casadi.Function("motion", instant, [mass_matrix, right_side, integrands])
        by_state = casadi.vertcat(angles, rates)
        tangents = casadi.Function(
            "tangents",
            [*instant, accelerations],
            [casadi.jacobian(residual, by_state), casadi.jacobian(integrands, by_state)],
        )
        self.observed = casadi.Function("observed", instant, [pair_force, casadi.SX.zeros(1)])
        self._set_derivative(motion, tangents)

    def _rate_of(self, vector: casadi.SX) -> casadi.SX:
        return casadi.jacobian(vector, self._time) + casadi.jtimes(vector, self._angles, self._rates)

    def _chains(self) -> tuple[casadi.SX, casadi.SX, casadi.SX]:
        """E_kin and E_spring in J, D in W; sets nodes, their velocities, and e × ė of segments."""
        case, n = self.case, self.case.segments
        h = LENGTH_M / n
        mass = MASS_PER_LENGTH * h
        damping_time = 2 * DAMPING_RATIO / FIRST_FREQUENCY
        body_rate = casadi.SX([0.0, 0.0, case.rate_rad_s])
        kinetic, springs, dissipation = 0, 0, 0
        self._nodes, self._velocities, self._directions, self._spins = [], [], [], []
        for filament in range(self.columns):
            body = case.start_angle_rad - filament * case.behind_rad + case.rate_rad_s * self._time
            radial = casadi.vertcat(casadi.cos(body), casadi.sin(body), 0.0)
            tilt = case.lateral_tilt_rad
            before = math.cos(tilt) * radial + casadi.SX([0.0, 0.0, math.sin(tilt)])
            nodes = [BODY_RADIUS_M * radial + casadi.SX([0.0, 0.0, filament * case.along_m])]
            turning_before = self._turning(before, body_rate)
            directions, spins = [], []
            for k in range(n):
                place = 2 * (filament * n + k)
                polar, azimuth = self._angles[place], self._angles[place + 1]
                direction = casadi.vertcat(
                    casadi.sin(polar) * casadi.cos(azimuth),
                    casadi.sin(polar) * casadi.sin(azimuth),
                    casadi.cos(polar),
                )
                velocity = self._rate_of(nodes[k] + h / 2 * direction)
                kinetic += mass / 2 * casadi.sumsqr(velocity)
                kinetic += mass * h**2 / 24 * casadi.sumsqr(self._rate_of(direction))
                # The clamp joint carries only half a segment's compliance.
                stiffness = (2 if k == 0 else 1) * BENDING_STIFFNESS / h
                springs += stiffness / 2 * self._angle_squared(direction - before)
                turning = self._turning(direction, body_rate)
                dissipation += damping_time * stiffness / 2 * casadi.sumsqr(turning - turning_before)
                nodes.append(nodes[k] + h * direction)
                directions.append(direction)
                spins.append(crossed(direction, self._rate_of(direction)))
                before, turning_before = direction, turning
            self._nodes.append(casadi.horzcat(*nodes))
            self._velocities.append(casadi.horzcat(*map(self._rate_of, nodes)))
            self._directions.append(casadi.horzcat(*directions))
            self._spins.append(casadi.horzcat(*spins))
        return kinetic, springs, dissipation

    def _turning(self, direction: casadi.SX, body_rate: casadi.SX) -> casadi.SX:
        """The angular velocity of a segment, without spin about itself, that its dampers see."""
        rate = self._rate_of(direction)
        seen = rate - crossed(body_rate, direction) if self.case.objective else rate
        return crossed(direction, seen)

    @staticmethod
    def _angle_squared(chord: casadi.SX) -> casadi.SX:
        """α² = (2 asin(|chord|/2))² = Σ 2 (k−1)!²/(2k)! |chord|^(2k)."""
        square, total = casadi.sumsqr(chord), 0
        for k in range(TERMS, 0, -1):
            total = (total + 2 * math.factorial(k - 1) ** 2 / math.factorial(2 * k)) * square
        return total

    @staticmethod
    def _rubbing(coefficient: float, pressure: casadi.SX, sliding: casadi.SX) -> casadi.SX:
        """Coulomb's law, regularised."""
        speed = casadi.sqrt(casadi.sumsqr(sliding) + REGULARISATION_M_S**2)
        return -coefficient * pressure / speed * sliding

    def _workpiece(self, below: casadi.SX) -> tuple[casadi.SX, casadi.SX]:
        """Generalised forces of the plane, and the rates of the integrals of each filament."""
        case, n = self.case, self.case.segments
        torques, integrands = casadi.SX.zeros(self.count), []
        for filament in range(self.columns):
            sums = casadi.SX.zeros(len(OF_FILAMENT))
            for k in range(n):
                node = self._nodes[filament][:, k + 1]
                pressure = CONTACT_STIFFNESS_N_M * (case.height_m - node[1])
                pressure *= below[filament * n + k]
                velocity = self._velocities[filament][:, k + 1]
                sliding = casadi.vertcat(velocity[0], 0.0, velocity[2])
                rubbing = self._rubbing(case.friction_coefficient, pressure, sliding)
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
            relative -= crossed(spins @ (own_turning + other_turning), offset) / 2
            sliding = relative - casadi.dot(relative, normal) * normal
            rubbing = self._rubbing(case.filament_friction_coefficient, pressure, sliding)
            force = pressure * normal + rubbing
            # What is paired with velocities and spins in the power of the force.
            on_nodes += force @ (own - other).T
            moments -= crossed(offset, force) / 2 @ (own_turning + other_turning).T
            sums += casadi.vertcat(pressure, sign * force, -casadi.dot(rubbing, sliding))
        torques = casadi.jtimes(casadi.vec(nodes), self._angles, casadi.vec(on_nodes), True)
        # (e × ė)·m = ė·(m × e)
        pairs = [crossed(moments[:, k], directions[:, k]) for k in range(self.node_count)]
        of_moments = casadi.vertcat(*pairs)
        torques += casadi.jtimes(casadi.vec(directions), self._angles, of_moments, True)
        if self.columns == 1:
            return torques, casadi.SX(0, 1), casadi.SX(0, 1)
        return torques, sums, sums[0]


class Motion(row.Motion):
    """A pass, window by window."""

    def __init__(self, case: Case, relative_tolerance: float) -> None:
        super().__init__(case, relative_tolerance)
        self._tolerance, self._known = relative_tolerance, {0: (self.equations, self._integrator)}

    def _equations_of(self, case: Case) -> Equations:
        return Equations(case, 0)

    def _window(self, start_s: float, end_s: float, y: np.ndarray, touch: np.ndarray) -> row.Window:
        """The motion with one touch, by the equations for at least so many points that touch."""
        touching, most = int(np.count_nonzero(touch[self.equations.node_count :])), 0
        while most < touching:
            most = max(2, 2 * most)
        if most not in self._known:
            equations = Equations(self.case, most)
            self._known[most] = equations, self._integrator_of(equations, self._tolerance)
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

    def bodies(self, times: np.ndarray) -> np.ndarray:
        """β of each filament, (times, filaments)."""
        case = self.case
        starts = case.start_angle_rad - case.behind_rad * np.arange(case.filaments)
        return starts + case.rate_rad_s * times[:, None]

    def start(self) -> np.ndarray:
        """Straight filaments along their clamps, turning rigidly with the body."""
        case = self.case
        angles = np.empty((case.filaments, case.segments, 2))
        angles[..., 0] = math.pi / 2 - case.lateral_tilt_rad
        angles[..., 1] = self.bodies(np.zeros(1))[0][:, None]
        rates = np.zeros_like(angles)
        rates[..., 1] = case.rate_rad_s / RATE_UNIT_RAD_S
        integrals = np.zeros(self.equations.integral_count)
        return np.concatenate([angles.ravel(), rates.ravel(), integrals])

    def polylines(self, times: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Positions (times, filaments, nodes, 3), for coordinates as columns."""
        case, bodies = self.case, self.bodies(times)[..., None]
        along = np.broadcast_to(case.along_m * np.arange(case.filaments)[:, None], bodies.shape)
        root = BODY_RADIUS_M * np.cos(bodies), BODY_RADIUS_M * np.sin(bodies), along
        q = angles.T.reshape(len(times), case.filaments, case.segments, 2)
        polar, azimuth, h = q[..., 0], q[..., 1], LENGTH_M / case.segments
        steps = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)
        both = [np.stack(root, axis=-1), h * np.stack(steps, axis=-1)]
        return np.cumsum(np.concatenate(both, axis=2), axis=2)

    @staticmethod
    def deflections_m(lines: np.ndarray, bodies: np.ndarray) -> np.ndarray:
        """Not asked for."""
        return np.zeros(bodies.shape)

    def _check(self, window: row.Window) -> None:
        """Nothing happens that the equations leave out."""


def metrics(case: Case, relative_tolerance: float) -> dict[str, object]:
    """What the file says about a case, from a run at one tolerance."""
    motion, count = Motion(case, relative_tolerance), case.filaments
    times, together, nodes = np.zeros(count), 0.0, count * case.segments
    peaks = np.zeros((2, count))
    for window in motion.windows():
        length, touch = window.times[-1] - window.times[0], window.touch
        times += length * np.any(touch[:nodes].reshape(count, -1) > 0, axis=1)
        together += length * float(np.any(touch[nodes:] > 0))
        peaks = np.maximum(peaks, motion.peaks_in(window))
        last = window
    if np.any(last.touch[:nodes]):
        raise RuntimeError(f"{case.name}: a filament still touches the plane at the end")
    integrals = last.states[2 * motion.equations.count :, -1] * INTEGRAL_UNIT
    split = count * len(OF_FILAMENT)
    of_filament = integrals[:split].reshape(count, -1)
    tips = motion.polylines(last.times[-1:], last.states[: motion.equations.count, -1:])[0, :, -1]
    filaments = [
        {
            **dict(zip(OF_FILAMENT, of_filament[i], strict=True)),
            "contact_time_s": times[i],
            "peak_contact_normal_force_n": peaks[0, i],
            "final_tip_m": tips[i],
        }
        for i in range(count)
    ]
    neighbours = []
    if count > 1:
        pair = dict(zip(OF_PAIR, integrals[split:], strict=True))
        neighbours = [pair | {"contact_time_s": together}]
    return {"filaments": filaments, "neighbours": neighbours, "changes_of_touch": motion.changes}


def result(case: Case) -> dict[str, object]:
    """The entry of a case in the file."""
    values, others = (metrics(case, tolerance) for tolerance in (TOLERANCE, LOOSER))
    entry = asdict(case)
    if case.objective:
        del entry["objective"]
    entry |= {"start_angle_rad": case.start_angle_rad, "end_s": case.end_s} | values
    entry["own_errors"] = row.own_errors(values, others)
    return row.rounded(entry)


def cases(objective: bool) -> list[Case]:
    """The cases of the file."""
    slow, fast = (10.0, 1e-3), (20.0, 2e-3)
    found = []
    for process in (slow, fast):
        found += [
            Case("alone, tilted", 1, *process, lateral_tilt_rad=0.05, objective=objective),
            Case("oblique", 2, *process, 2 * math.pi / 800, 0.6e-3, objective=objective),
            Case("abreast", 2, *process, 2 * math.pi / 1100, 1.1e-3, objective=objective),
            Case("tilted", 2, *process, 2 * math.pi / 682, 0.0, 0.05, objective=objective),
            Case(
                "oblique, tilted",
                2,
                *process,
                2 * math.pi / 800,
                0.8e-3,
                0.02,
                objective=objective,
            ),
        ]
    return found


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Write passes of two filaments in space.")
    parser.add_argument("--processes", type=int, default=1, help="cases computed at the same time")
    parser.add_argument("--output", type=Path, default=DEFAULT_OUTPUT, help="JSON file to write")
    parser.add_argument(
        "--inertial", action="store_true", help="dampers that see rates in the inertial frame"
    )
    arguments = parser.parse_args()
    chosen, lines = cases(not arguments.inertial), []
    with multiprocessing.Pool(arguments.processes) as pool:
        for case, entry in zip(chosen, pool.imap(result, chosen, chunksize=1), strict=True):
            lines.append(json.dumps(entry))
            print(f"{case.name}, {case.brushing_velocity_m_s:g} m/s: done", flush=True)
    made_by = row.command(TOLERANCE).replace("reference_row", "reference_space")
    joined = ",\n".join(lines)
    arguments.output.write_text(
        f'{{"made_by": {json.dumps(made_by)},\n"cases": [\n{joined}\n]}}\n',
        encoding="utf-8",
        newline="\n",
    )


if __name__ == "__main__":
    main()
