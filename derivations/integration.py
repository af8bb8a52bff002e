"""Motion of a case from its start, and the metrics of its filaments."""

import math

import casadi
import cases
import motion
import numpy as np
from cases import RIGHT, Case
from filaments import OF_PAIR, Clamp, Equations, chain
from groups import Group
from motion import RATE_UNIT_RAD_S, Window
from scipy.optimize import minimize
from workpieces import nearest_of, workpiece_of

# Longest windows of filaments that press on each other, and of contact all round.
LONGEST_WINDOW_OF_ROW_S, LONGEST_WINDOW_ALL_ROUND_S = 1e-4, 1e-3
# Largest relative difference of the impulses of successive turns that are steady.
STEADY = 1e-3
# Parts of OBSERVED.
FORCE_AND_DEFLECTION, TIP = slice(2), slice(2, 8)


class Statics:
    """Potential of one filament in space that turns rigidly over a plane, at t = 0.

    V = E_spring − ½ ω² Σ ∫ρ² dm + ½ k_c Σ δ², with the distance ρ from the tool's axis.
    """

    def __init__(self, case: Case, start_angle_rad: float) -> None:
        self._case, size = case, 2 * case.filament.segments
        instant = [casadi.SX.sym(*each) for each in (("t", 1), ("q", size), ("v", size))]
        clamp = Clamp.of(case, start_angle_rad, casadi.SX(0.0), 0)
        self._clamp = np.array(casadi.evalf(clamp.direction)).ravel()
        at_rest = chain(instant, instant[1], clamp, case.filament)
        axis, h = casadi.DM(case.tool.pose[:, 2]), case.filament.segment_m

        def squared_distance(vector: casadi.SX) -> casadi.SX:
            return casadi.sumsqr(vector) - casadi.dot(vector, axis) ** 2

        centrifugal, stored, height = 0, 0, casadi.SX.sym("height")
        for k, mass in enumerate(case.filament.masses_kg):
            inner, direction = at_rest.nodes[:, k], at_rest.directions[:, k]
            spread = squared_distance(inner + h / 2 * direction)
            spread += h**2 / 12 * squared_distance(direction)
            centrifugal += mass / 2 * case.rate_rad_s**2 * spread
            depth = casadi.fmax(0, height - at_rest.nodes[1, k + 1])
            share = case.filament.contact_share(k + 1)
            stored += share * case.contact_stiffness_n_m / 2 * depth**2
        potential = at_rest.springs - centrifugal + stored
        hessian, gradient = casadi.hessian(potential, instant[1])
        results = [potential, gradient, hessian]
        self._potential = casadi.Function("potential", [instant[1], height], results)
        self._nodes = casadi.Function("nodes", [instant[1]], [at_rest.nodes])

    def equilibrium(self, height_m: float = -1.0) -> tuple[np.ndarray, np.ndarray]:
        """Returns coordinates and nodes at rest over a plane, which is out of reach by default."""
        x, y, z = self._clamp
        straight = np.tile([math.acos(z), math.atan2(y, x)], self._case.filament.segments)
        # Energies are some 1e-4 J, angles 1 rad.
        scale = 1e4
        q = minimize(
            lambda q: scale * float(self._potential(q, height_m)[0]),
            straight,
            method="trust-exact",
            jac=lambda q: scale * np.array(self._potential(q, height_m)[1]).ravel(),
            hess=lambda q: scale * np.array(self._potential(q, height_m)[2]),
            options={"gtol": 1e-9, "maxiter": 10_000},
        ).x
        # Newton's method removes the rest, which energies do not resolve.
        for _ in range(3):
            _, gradient, hessian = (np.array(each) for each in self._potential(q, height_m))
            q = q - np.linalg.solve(hessian, gradient.ravel())
        if np.min(np.linalg.eigvalsh(hessian)) <= 0.0:
            raise RuntimeError(f"{self._case.name}: no minimum")
        return q, np.array(self._nodes(q)).T


class Pass(motion.Motion):
    """The motion of a case.

    An active set lists the contacts of every filament with the workpiece. The points of filaments
    on their neighbours follow: 0 in the air, 2 k + 1 at node k, 2 k inside segment k.
    """

    def __init__(self, case: Case, group: Group, tolerance: float) -> None:
        self.case, self.workpiece, self._n = case, workpiece_of(case), case.filament.segments
        self.integral_names, self._known = group.integrals, {}
        earlier_rad, self._q = self._free_start()
        self._start_angle_rad = case.start_angle_rad - earlier_rad
        ends = [end + 2 * earlier_rad / case.rate_rad_s for end in case.ends_of_turns_s]
        super().__init__(case.label, tolerance, ends)
        if case.brush.columns > 1:
            self.longest_window_s = LONGEST_WINDOW_OF_ROW_S
        elif case.is_all_round:
            self.longest_window_s = LONGEST_WINDOW_ALL_ROUND_S

    def _free_start(self) -> tuple[float, np.ndarray]:
        """Returns the angle by which filaments start earlier, and their coordinates.

        Radial filaments are straight along the clamp, or relaxed. Others are in equilibrium: a bent
        filament may touch before an undeformed one would.
        """
        case = self.case
        if case.tool.filament_angle_rad == RIGHT:
            return 0.0, np.concatenate([self._straight(i) for i in range(case.brush.columns)])
        for earlier_rad in np.arange(0.0, 2.0, 0.02):
            q, line = Statics(case, case.start_angle_rad - earlier_rad).equilibrium()
            if not np.any(self.workpiece.active_sets(line[None], np.zeros(1))):
                return float(earlier_rad), q
        raise RuntimeError(f"{case.label}: touches everywhere")

    def _straight(self, column: int) -> np.ndarray:
        """Returns the coordinates of a relaxed filament along the clamp."""
        clamp = Clamp.of(self.case, self.case.start_angle_rad, 0.0, column)
        if self.case.is_planar:
            return float(clamp.azimuth) + self.case.filament.relaxed_angles_rad
        x, y, z = np.array(clamp.direction).ravel()
        return np.tile([math.acos(z), math.atan2(y, x)], self._n)

    def start(self) -> np.ndarray:
        """Returns the state at t = 0, turning rigidly with the body."""
        omega, rates = self.case.rate_rad_s * self.case.tool.pose[:, 2], []
        if self.case.is_planar:
            rates = [self.case.rate_rad_s] * len(self._q)
        for polar, azimuth in [] if rates else self._q.reshape(-1, 2):
            # ė of e = (sin φ cos θ, sin φ sin θ, cos φ), along the directions of growing φ and θ.
            (sin, cos), (s, c) = (np.sin(polar), np.cos(polar)), (np.sin(azimuth), np.cos(azimuth))
            rate = np.cross(omega, [sin * c, sin * s, cos])
            rates += [rate @ np.array([cos * c, cos * s, -sin]), rate @ np.array([-s, c, 0]) / sin]
        integrals = np.zeros(self.equations_of(None).integral_count)
        return np.concatenate([self._q, np.array(rates) / RATE_UNIT_RAD_S, integrals])

    def equations_of(self, active: np.ndarray | None) -> Equations:
        """Returns the equations with slots for at least the points that touch."""
        slots, touching = 0, 0 if active is None else np.count_nonzero(self.parts(active)[1])
        while slots < touching:
            slots = max(2, 2 * slots)
        if slots not in self._known:
            arguments = self.integral_names, self._start_angle_rad, slots
            self._known[slots] = Equations(self.case, *arguments)
        return self._known[slots]

    def parts(self, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the parts of an active set by columns, and by pairs of them."""
        columns, count = self.case.brush.columns, self._n + self.workpiece.edge_count
        points = active[columns * count :]
        of_pairs = points.reshape(columns - 1, len(points) // max(columns - 1, 1))
        return active[: columns * count].reshape(columns, count), of_pairs

    def lines(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Returns the nodes (times, columns, n + 1, 3) of states as columns."""
        equations = self.equations_of(None)
        nodes = np.array(equations.positions(times[None], states[: equations.count]))
        return nodes.T.reshape(len(times), self.case.brush.columns, self._n + 1, 3)

    def active_sets(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Returns the active set at each time, as rows."""
        lines, columns = self.lines(times, states), self.case.brush.columns
        of_all = lines.reshape(-1, self._n + 1, 3)
        on_workpiece = self.workpiece.active_sets(of_all, np.repeat(times, columns))
        rows = [on_workpiece.reshape(len(times), -1)]
        for pair in range(columns - 1):
            ahead, behind = lines[:, pair], lines[:, pair + 1]
            rows += [self._near(ahead, behind), self._near(behind, ahead)]
        return np.concatenate(rows, axis=1).astype(int)

    def _near(self, own: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Returns the features of lines `other` that points of lines `own` touch, or 0."""
        count = self.case.brush.contact_points
        places = ((np.arange(count) + 0.5) / count)[:, None]
        starts, ends = own[:, :-1, None, :], own[:, 1:, None, :]
        points = (starts + places * (ends - starts)).reshape(len(own), -1, 3)
        feature, _, distance = nearest_of(other[:, None], points)
        return np.where(distance < cases.DIAMETER_M, 1 + feature, 0)

    def observed(self, window: Window) -> np.ndarray:
        """Returns OBSERVED of filaments (points, columns, …)."""
        n, count = window.equations.count, len(window.times)
        states = window.states[:n], window.states[n : 2 * n] * RATE_UNIT_RAD_S
        found = window.equations.observed(window.times[None], *states, window.parameters)
        return np.array(found).T.reshape(count, self.case.brush.columns, -1)

    def peaks(self, window: Window, least: np.ndarray) -> np.ndarray:
        """Returns the largest F_n and deflection of each column in a window, (columns, 2).

        Peaks that may exceed `least` are refined: the motion between the points beside the largest
        value is integrated again. Where friction changes its sign, the force turns too fast for an
        interpolation.
        """
        values = self.observed(window)[..., FORCE_AND_DEFLECTION]
        peaks = np.max(values, axis=0)
        for place in map(tuple, np.argwhere((peaks > 0.0) & (peaks > 0.98 * least))):
            i = int(np.argmax(values[:, *place]))
            for j in range(max(i - 1, 0), min(i + 1, len(window.times) - 1)):
                ends = window.times[j : j + 2].tolist()
                fine = self.window(*ends, window.states[:, j], window.active)
                found = self.observed(fine)[..., FORCE_AND_DEFLECTION]
                peaks[place] = max(peaks[place], float(np.max(found[:, *place])))
        return peaks


def metrics_of(case: Case, group: Group, tolerance: float) -> dict[str, object]:
    """Integrates a case, and returns metrics of filaments, of neighbours, and of the whole.

    Integrals and times are those of the last turn.
    """
    motion, columns = Pass(case, group, tolerance), case.brush.columns
    times, pair_times = np.zeros(columns), np.zeros(columns - 1)
    counts, peaks = np.zeros(columns, dtype=int), np.zeros((columns, 2))
    touched, nominal_time, deepest, faces = np.zeros(columns, dtype=bool), 0.0, 0.0, set()
    turns, before = [], 0.0
    entry = cases.LEAD_ANGLE_RAD / case.rate_rad_s
    nominal_contact_time = 2 * case.half_angle_rad / case.rate_rad_s
    for window in motion.windows():
        on_workpiece, points = motion.parts(window.active)
        touched_before, touched = touched, np.any(on_workpiece > 0, axis=1)
        counts = counts + (touched & ~touched_before)
        start, end = window.times[0], window.times[-1]
        times = times + (end - start) * touched
        pair_times = pair_times + (end - start) * np.any(points > 0, axis=1)
        nominal_part = min(end, entry + nominal_contact_time) - max(start, entry)
        nominal_time += max(0.0, nominal_part) if touched[0] else 0.0
        on_faces, on_edges = np.split(on_workpiece, [case.filament.segments], axis=1)
        faces |= set(on_faces.ravel().tolist()) - {0}
        if np.any(on_edges):
            lines = motion.lines(window.times, window.states)[:, 0]
            depths = motion.workpiece.edge_depths(lines)[:, on_edges[0] > 0]
            deepest = max(deepest, float(np.max(depths)))
        if group.has_peaks:
            peaks = np.maximum(peaks, motion.peaks(window, peaks))
        if window.ends_turn:
            turns.append(window.integrals(-1) - before)
            before, of_turn = window.integrals(-1), (times.tolist(), pair_times.tolist())
            times, pair_times = np.zeros_like(times), np.zeros_like(pair_times)
            # In the first turn the workpiece comes up.
            is_steady = len(turns) > 2 and abs(turns[-1][0] / turns[-2][0] - 1) < STEADY
            if case.is_all_round and is_steady:
                break
    of_filaments, of_pairs = np.split(turns[-1], [columns * len(group.integrals)])
    of_filaments = of_filaments.reshape(columns, -1).tolist()
    of_pairs = of_pairs.reshape(-1, len(OF_PAIR)).tolist()
    tips = motion.observed(window)[-1][:, TIP].reshape(columns, 2, 3)
    return {
        "filaments": [
            {
                "column": i,
                **dict(zip(group.integrals, of_filaments[i], strict=True)),
                "contact_time_s": of_turn[0][i],
                "contact_count": int(counts[i]),
                "peak_contact_normal_force_n": float(peaks[i, 0]),
                "max_tip_deflection_m": float(peaks[i, 1]),
                "final_tip_m": tips[i, 0],
                "final_tip_velocity_m_s": tips[i, 1],
            }
            for i in range(columns)
        ],
        "neighbours": [
            {"columns": [i, i + 1], **dict(zip(OF_PAIR, each, strict=True)), "contact_time_s": time}
            for i, (each, time) in enumerate(zip(of_pairs, of_turn[1], strict=True))
        ],
        "nominal_contact_time_s": nominal_contact_time,
        "contact_time_ratio": nominal_time / nominal_contact_time,
        "end_s": float(window.times[-1]),
        "turn_contact_normal_impulses_n_s": [float(turn[0]) for turn in turns],
        "touches_at_end": bool(np.any(window.active)),
        "faces_touched": sorted(faces),
        "largest_edge_penetration_m": deepest,
        "changes_of_touch": motion.changes,
    }
