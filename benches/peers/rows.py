"""Rows of filaments that touch, at equal accuracy."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, partial
from typing import TYPE_CHECKING

from accelerations import deviation
from contact import CASE
from programs import Setup
from table import Group, Line, Measured, Peers

if TYPE_CHECKING:
    import numpy as np

# Segments and columns of rows of filaments that touch each other.
ROWS = ((8, 60), (25, 60))
# Columns whose p_n no longer changes from column to column.
PLATEAU = slice(20, 45)
# Error of the mean p_n on the plateau, or of each p_n, against the code's own limit.
ROW_ACCURACY = 2e-2
# Steps of MuJoCo in s and tolerances of Bristle, from small to large; the first one gives the limit.
ROW_STEPS = [2e-6, *(10 ** (-6 + k / 8) for k in range(4, 19))]
ROW_TOLERANCES = [1e-5, *(10 ** (-4 + k / 4) for k in range(13))]

# Seconds and the p_n of each column in N s at a step or tolerance.
RowRun = Callable[[float], tuple[float, "np.ndarray"]]


@dataclass
class RowPeer:
    """A code whose rows are measured, and its results so far, by step or tolerance."""

    run: RowRun
    limit: "np.ndarray"
    values: list[float]
    shown: str
    computed: dict[float, tuple[float, "np.ndarray"]] = field(default_factory=dict)

    def errors(self, step: float) -> tuple[float, float]:
        """Returns the error of the mean on the plateau, and the largest one of a filament."""
        if step not in self.computed:
            self.computed[step] = self.run(step)
        _, impulses = self.computed[step]
        mean = impulses[PLATEAU].mean() / self.limit[PLATEAU].mean() - 1
        return abs(float(mean)), float(abs(impulses / self.limit - 1).max())

    def line(self, name: str, note: str, kind: int) -> Measured:
        """Measures at the fastest of the accurate steps before the first inaccurate one.

        Accurate means in the mean if `kind` is 0, in each filament if it is 1.
        """
        accurate, reached = [], float("inf")
        for step in self.values[1:]:
            reached = min(reached, self.errors(step)[kind])
            if not self.errors(step)[kind] <= ROW_ACCURACY:
                break
            accurate.append(step)
        if not accurate:
            raise RuntimeError(f"p_n is not reached to {ROW_ACCURACY}, but to {reached:.1e}")
        chosen = min(accurate, key=lambda step: self.computed[step][0])
        mean, largest = self.errors(chosen)
        note = (
            f"{self.shown.format(chosen)}, error of the mean {mean:.1e}, of a filament "
            f"{largest:.1e}; {note}"
        )
        return Line(name, note), lambda: self.run(chosen)[0]


def rows(setup: Setup) -> list[Group]:
    """Planar rows of filaments that touch, one thread, at equal accuracy."""
    return [group for segments, columns in ROWS for group in row(setup, segments, columns)]


def row(setup: Setup, segments: int, columns: int) -> list[Group]:
    """One row: accurate in the mean, and in each filament."""
    import numpy as np

    def of_bristle(tolerance: float) -> tuple[float, np.ndarray]:
        answer = setup.bristle.request(
            "row",
            brushing_velocity_m_s=CASE[0],
            penetration_depth_m=CASE[1],
            segments=segments,
            columns=columns,
            tolerance=tolerance,
        )
        return answer["seconds"], np.array(answer["impulses"])

    limit = of_bristle(ROW_TOLERANCES[0])[1]
    ours = RowPeer(of_bristle, limit, ROW_TOLERANCES, "tolerance {:.2g}")

    @cache
    def of_mujoco() -> tuple[np.ndarray, str]:
        """Returns the limit of MuJoCo, and a remark on it."""
        from mujoco_chain import warnings_off
        from mujoco_row import Row, Touch

        warnings_off()
        own = Row(CASE, segments, columns, ROW_STEPS[0], Touch()).run().impulses_n_s
        means = [impulses[PLATEAU].mean() for impulses in (own, limit)]
        found = deviation(*means, ROW_ACCURACY, "the mean p_n of MuJoCo and Bristle")
        return own, f"its limit differs from Bristle's by {found:.1e} in the mean"

    @cache
    def mujoco_row(filaments_are_springs: bool, workpiece_is_spring: bool) -> tuple[RowPeer, str]:
        """Returns a row with the fastest solver, at a step that suits all; and remarks."""
        from mujoco_row import SOLVERS, Row, Touch

        own, note = of_mujoco()
        touch = Touch(
            filaments_are_springs=filaments_are_springs, workpiece_is_spring=workpiece_is_spring
        )

        def of_row(step: float, solver: str) -> tuple[float, np.ndarray]:
            motion = Row(CASE, segments, columns, step, touch, solver).run()
            return motion.seconds, motion.impulses_n_s

        # Solvers take turns, so that a slow spell of the machine meets all.
        tried = [(of_row(ROW_STEPS[2], solver)[0], solver) for _ in range(3) for solver in SOLVERS]
        solver = min(tried)[1]
        peer = RowPeer(lambda step: of_row(step, solver), own, ROW_STEPS, "step {:.2g} s")
        return peer, f"solver {solver}; {note}"

    def capsules(name: str, springs: tuple[bool, bool], kind: int) -> list[Measured]:
        peer, note = mujoco_row(*springs)
        return [peer.line(name, note, kind)]

    groups = []
    for kind, accurate in enumerate(("the mean p_n of the plateau", "p_n of each filament")):
        peers = Peers()
        for name, springs in (
            ("MuJoCo, capsules, springs of k_l and k_c", (True, True)),
            ("MuJoCo, capsules, its own contacts between filaments", (False, True)),
            ("MuJoCo, capsules, its own contacts everywhere", (False, False)),
        ):
            peers.add(name, partial(capsules, name, springs, kind))
        first = ours.line("Bristle", "planar, all metrics of each filament", kind)
        title = f"a row of {columns} filaments, n = {segments}, one thread, {accurate} to 2 %"
        groups.append(peers.group(title, first, min(setup.rounds, 7)))
    return groups
