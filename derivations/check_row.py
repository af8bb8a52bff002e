"""Checks tests/data/reference_row.json by equations of motion that are written by hand.

What enters: the names of cases (default: those named below), and the file.
What leaves: a line for each case with the largest differences; exit code 1 if one is too large.

Newton's laws of the segments in NumPy instead of energies in CasADi; SciPy's LSODA instead of
CVODES, in short steps across the kinks instead of windows between them. Shared with
reference_row.py: nothing but the file. SI units.

Run from the repository root:

    python derivations/check_row.py
"""

import argparse
import json
import math
import sys
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

FILE = Path(__file__).parent.parent / "tests" / "data" / "reference_row.json"
# One of each kind; some names stand for two velocities.
DEFAULT_NAMES = (
    "two",
    "three",
    "three, damped",
    "three, friction",
    "three, friction at centrelines",
    "three, close, friction and damped",
)
TOLERANCE, LONGEST_STEP_S = 1e-10, 2e-6
# Largest relative difference of p_n and of the normal impulses of pairs.
LIMIT = 2e-6


class Row:
    """A row as an entry of the file describes it."""

    def __init__(self, entry: dict[str, object]) -> None:
        inputs = entry["input"]
        filament, process, contact = inputs["filament"], inputs["process"], inputs["contact"]
        self.brush, self.contact = inputs["brush"], contact
        self.surfaces = entry.get("friction_at") == "surfaces"
        self.columns, self.n = self.brush["columns"], filament["segments"]
        self.body_radius = inputs["tool"]["body_radius_m"]
        length, self.d = filament["length_m"], filament["diameter_m"]
        self.h = length / self.n
        radius = self.body_radius + length
        self.rate = process["brushing_velocity_m_s"] / radius
        self.height = process["penetration_depth_m"] - radius
        behind = 2 * math.pi / inputs["tool"]["filament_count"] * np.arange(self.columns)
        self.start = entry["start_angle_rad"] - behind
        self.end_s = entry["end_s"]

        line = filament["density_kg_m3"] * math.pi * self.d**2 / 4
        bending = filament["youngs_modulus_pa"] * math.pi * self.d**4 / 64
        self.mass = line * self.h
        self.stiffness = np.full(self.n, bending / self.h)
        self.stiffness[0] *= 2
        frequency = 1.8751040687**2 * math.sqrt(bending / (line * length**4))
        self.damping = 2 * filament["damping_ratio"] / frequency * self.stiffness
        # Centres are the root and these lengths along the directions of the segments.
        self.arms = np.tril(np.full((self.n, self.n), self.h), -1) + np.eye(self.n) * self.h / 2

    def rubbed(self, coefficient: float, pressure: float, sliding: float) -> float:
        """Friction against a sliding velocity."""
        speed = math.hypot(sliding, self.contact["friction_regularisation_m_s"])
        return -coefficient * pressure * sliding / speed

    def derivative(self, time: float, y: np.ndarray) -> np.ndarray:
        """Of angles, rates, p_n of every filament and normal impulse of every pair."""
        columns, n = self.columns, self.n
        theta, rates = y[: 2 * columns * n].reshape(2, columns, n)
        bodies = self.start + self.rate * time
        along, across = directions(theta)
        root, root_across = directions(bodies)
        nodes = np.cumsum(
            np.concatenate([self.body_radius * root[:, None], self.h * along], axis=1), axis=1
        )
        turning = self.body_radius * self.rate * root_across[:, None]
        moving = self.h * rates[..., None] * across
        velocities = np.cumsum(np.concatenate([turning, moving], axis=1), axis=1)

        forces, torques = np.zeros_like(nodes), np.zeros((columns, n))
        pressures = self.contact["stiffness_n_m"] * np.maximum(self.height - nodes[..., 1], 0.0)
        forces[..., 1] = pressures
        for place in zip(*np.nonzero(pressures), strict=True):
            sliding = velocities[place][0]
            coefficient = self.contact["friction_coefficient"]
            forces[place][0] = self.rubbed(coefficient, pressures[place], sliding)
        motion = nodes, along, velocities, rates
        pairs = [
            sum(self.press(*each, motion, forces, torques) for each in ((k, k + 1), (k + 1, k)))
            for k in range(columns - 1)
        ]

        accelerations = np.zeros((columns, n))
        for column in range(columns):
            e, t, w = along[column], across[column], rates[column]
            inertia = self.mass * (self.arms.T @ self.arms)
            inertia = inertia * np.cos(theta[column][:, None] - theta[column])
            inertia += np.eye(n) * self.mass * self.h**2 / 12
            centripetal = -self.body_radius * self.rate**2 * root[column]
            centripetal = centripetal - (self.arms * w**2) @ e
            moment = -self.mass * np.sum((self.arms.T @ centripetal) * t, axis=1)
            bend = np.diff(theta[column], prepend=bodies[column])
            bend_rate = np.diff(w, prepend=self.rate)
            joints = self.stiffness * bend + self.damping * bend_rate
            moment += np.append(joints[1:], 0.0) - joints + torques[column]
            beyond = np.cumsum(forces[column, :0:-1], axis=0)[::-1]
            moment += self.h * np.sum(beyond * t, axis=1)
            accelerations[column] = np.linalg.solve(inertia, moment)
        return np.concatenate(
            [rates.ravel(), accelerations.ravel(), np.sum(pressures[:, 1:], axis=1), pairs]
        )

    def press(
        self,
        a: int,
        b: int,
        motion: tuple[np.ndarray, ...],
        forces: np.ndarray,
        torques: np.ndarray,
    ) -> float:
        """Adds what points of column a and column b do to each other; the sum of normal forces."""
        nodes, along, velocities, rates = motion
        count, total = self.brush["contact_points"], 0.0
        shares = np.tile((np.arange(count) + 0.5) / count, self.n)
        owners = np.repeat(np.arange(self.n), count)
        points = nodes[a, owners] + (shares * self.h)[:, None] * along[a, owners]
        inner = nodes[b, :-1]
        places = np.sum((points[:, None] - inner) * along[b], axis=-1) / self.h
        places = np.clip(places, 0.0, 1.0)
        offsets = points[:, None] - inner - (places * self.h)[..., None] * along[b]
        distances = np.linalg.norm(offsets, axis=-1)
        for i in np.flatnonzero(np.min(distances, axis=1) < self.d):
            k, s = owners[i], int(np.argmin(distances[i]))
            f, u, distance = shares[i], places[i, s], distances[i, s]
            normal = offsets[i, s] / distance
            weights = ((a, k, 1 - f), (a, k + 1, f), (b, s, u - 1), (b, s + 1, -u))
            relative = sum(weight * velocities[column, node] for column, node, weight in weights)
            spring = self.brush["stiffness_n_m2"] / 2 * self.h / count * (self.d - distance)
            pressure = spring * (1 - self.brush["damping_s_m"] * float(relative @ normal))
            tangent = np.array([-normal[1], normal[0]])
            # Where the nearest point is a node, the surface turns with both segments.
            others = {s}
            if u <= 0.0:
                others.add(max(s - 1, 0))
            if u >= 1.0:
                others.add(min(s + 1, self.n - 1))
            lever = distance / 2 if self.surfaces else 0.0
            spin = rates[a, k] + sum(rates[b, other] for other in others) / len(others)
            sliding = float(relative @ tangent) - lever * spin
            rubbing = self.rubbed(self.brush["friction_coefficient"], pressure, sliding)
            for column, node, weight in weights:
                forces[column, node] += weight * (pressure * normal + rubbing * tangent)
            torques[a, k] -= lever * rubbing
            for other in others:
                torques[b, other] -= lever * rubbing / len(others)
            total += pressure
        return total

    def impulses(self) -> np.ndarray:
        """p_n of every filament and normal impulses of every pair, at the end."""
        count = self.columns * self.n
        still = np.zeros(2 * self.columns - 1)
        start = np.repeat(self.start, self.n)
        y = np.concatenate([start, np.full(count, self.rate), still])
        scales = np.concatenate([np.ones(count), np.full(count, 1e3), np.full(still.size, 1e-3)])
        solution = solve_ivp(
            self.derivative,
            (0.0, self.end_s),
            y,
            method="LSODA",
            t_eval=[self.end_s],
            rtol=TOLERANCE,
            atol=0.1 * TOLERANCE * scales,
            max_step=LONGEST_STEP_S,
        )
        if not solution.success:
            raise RuntimeError(solution.message)
        return solution.y[2 * count :, -1]


def directions(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors at azimuths, and those across."""
    cosines, sines = np.cos(angles), np.sin(angles)
    return np.stack([cosines, sines], axis=-1), np.stack([-sines, cosines], axis=-1)


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description="Check the reference of rows of filaments.")
    parser.add_argument("names", nargs="*", default=DEFAULT_NAMES, help="of the cases")
    parser.add_argument("--file", type=Path, default=FILE, help="JSON file to check")
    arguments = parser.parse_args()
    found = json.loads(arguments.file.read_text(encoding="utf-8"))["cases"]
    unknown = set(arguments.names) - {entry["name"] for entry in found}
    if unknown:
        parser.error(f"no case is named {', '.join(sorted(unknown))} in {arguments.file}")
    worst = 0.0
    for entry in found:
        if entry["name"] not in arguments.names:
            continue
        expected = [each["contact_normal_impulse_n_s"] for each in entry["filaments"]]
        expected += [each["normal_impulse_n_s"] for each in entry["neighbours"]]
        differences = Row(entry).impulses() / expected - 1
        worst = max(worst, float(np.max(np.abs(differences))))
        velocity = entry["input"]["process"]["brushing_velocity_m_s"]
        listed = ", ".join(f"{difference:.1e}" for difference in differences)
        print(f"{entry['name']}, {velocity:g} m/s: {listed}", flush=True)
    if worst > LIMIT:
        print(f"A difference of {worst:.1e} exceeds {LIMIT:g}.", file=sys.stderr)
    return int(worst > LIMIT)


if __name__ == "__main__":
    sys.exit(main())
