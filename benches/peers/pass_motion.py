"""One pass as a peer with equal steps gives it, at every step: rows for a file, and its metrics.

SI units; origin on the tool axis, y normal to the plane workpiece.
"""

from dataclasses import dataclass

import numpy as np
from paper_case import BODY_RADIUS_M, LENGTH_M, Pass

COLUMNS = (
    "time_s",
    "contact_normal_force_n",
    "contact_normal_impulse_n_s",
    "tip_x_m",
    "tip_y_m",
    "tip_deflection_m",
)


def deflections_m(angles_rad: np.ndarray, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
    """Distance from a tip to the undeformed filament, the piece of length l_f from r_0, which the
    body has turned by an angle."""
    cosines, sines = np.cos(angles_rad), np.sin(angles_rad)
    along = x_m * cosines + y_m * sines - BODY_RADIUS_M
    across = y_m * cosines - x_m * sines
    return np.hypot(along - np.clip(along, 0.0, LENGTH_M), across)


@dataclass(frozen=True)
class PassMotion:
    """The pass, its step in s, and a value a step, both ends included."""

    of: Pass
    step_s: float
    tips_m: np.ndarray  # x and y
    forces_n: np.ndarray
    gaps_m: np.ndarray  # the smallest of the nodes

    @property
    def times_s(self) -> np.ndarray:
        """Of the steps."""
        return np.linspace(0.0, self.of.end_s, len(self.forces_n))

    @property
    def impulses_n_s(self) -> np.ndarray:
        """∫ F_n dt by the trapezoidal rule."""
        pieces = self.step_s / 2 * (self.forces_n[1:] + self.forces_n[:-1])
        return np.concatenate([[0.0], np.cumsum(pieces)])

    @property
    def deflections_m(self) -> np.ndarray:
        """Of the tip."""
        angles = self.of.start_angle_rad + self.of.rate_rad_s * self.times_s
        return deflections_m(angles, self.tips_m[:, 0], self.tips_m[:, 1])

    def rows(self, count: int) -> np.ndarray:
        """So many equally spaced ones, both ends included, with the columns above."""
        steps = len(self.forces_n) - 1
        if steps % (count - 1):
            raise ValueError(f"{steps} steps do not make {count} rows")
        columns = (
            self.times_s,
            self.forces_n,
            self.impulses_n_s,
            self.tips_m[:, 0],
            self.tips_m[:, 1],
            self.deflections_m,
        )
        return np.stack(columns, axis=1)[:: steps // (count - 1)]

    def metrics(self) -> dict[str, float | int]:
        """Of the whole pass; contacts begin and end where the gap, linear in a step, vanishes."""
        gaps, closed = self.gaps_m, self.gaps_m < 0.0
        before = np.flatnonzero(closed[1:] != closed[:-1])
        events = self.step_s * (before + gaps[before] / (gaps[before] - gaps[before + 1]))
        # The filament starts in the air and ends there.
        return {
            "contact_normal_impulse_n_s": float(self.impulses_n_s[-1]),
            "contact_time_s": float(np.sum(events[1::2] - events[0::2])),
            "contact_count": len(events) // 2,
            "peak_contact_normal_force_n": float(np.max(self.forces_n)),
            "max_tip_deflection_m": float(np.max(self.deflections_m)),
        }
