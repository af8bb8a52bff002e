"""The measurements of run.py: alternates between Bristle and other codes, and prints one table.

Every time is the median over rounds; in each round everything of a group is measured once, so a
slow spell of the machine meets all. A ratio is the median over the rounds of the ratio within one.

A peer whose package is missing, or that computes something else than Bristle, has a line that says
so in place of its time.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from paper_case import SEGMENTS, Case, State, bent_state, reference_impulse_n_s

if TYPE_CHECKING:
    import numpy as np
    from casadi_contact import Library
    from pinocchio_chain import Problem

# Peers' lines begin with these names; the first is asked for its version.
PACKAGES = ("casadi", "mujoco", "numpy", "pin")

# Largest difference over the largest acceleration, as in tests/bristle/reference.rs.
AGREEMENT = 1e-11
# MuJoCo factorises M, whose condition costs digits; and its rods on two hinges have a small inertia about their axes.
MUJOCO_AGREEMENT = {"spherical": 1e-7, "universal": 1e-6}
# Equal to the bit.
BATCH_AGREEMENT = 1e-15


# ---------------------------------------------------------------------------- the table


@dataclass
class Line:
    """One line of the table: the values of all rounds, in s."""

    name: str
    note: str = ""
    values: list[float] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)

    @property
    def value(self) -> float:
        """Median."""
        return median(self.values)

    def cells(self) -> list[str]:
        """Returns the cells of the table, without the first one."""
        if not self.values:
            return [self.name, "", "", self.note]
        ratio = f"{median(self.ratios):.3g}" if self.ratios else ""
        return [self.name, shown(self.value), ratio, self.note]

    def record(self) -> dict[str, object]:
        """Returns the line for --json."""
        record: dict[str, object] = {"name": self.name, "remarks": self.note}
        if self.values:
            record |= {"unit": "s", "median": self.value, "rounds": self.values}
        if self.ratios:
            record |= {"ratio": median(self.ratios), "ratios": self.ratios}
        return record


@dataclass
class Group:
    """Lines that are measured in turns; ratios are to the first of them."""

    title: str
    lines: list[Line] = field(default_factory=list)

    def rows(self) -> str:
        """Returns the rows of the table."""
        text = ""
        for i, line in enumerate(self.lines):
            text += f"| {' | '.join([self.title if i == 0 else '', *line.cells()])} |\n"
        return text


HEADER = "| what | code | median | ratio | remarks |\n|---|---|---:|---:|---|\n"


def shown(seconds: float) -> str:
    """Formats three digits, in a unit that fits."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


Measured = tuple[Line, Callable[[], float]]


def interleaved(measured: Sequence[Measured], rounds: int) -> list[Line]:
    """Measures every line once a round; ratios are to the first one."""
    for _ in range(rounds):
        for line, measure in measured:
            line.values.append(measure())
    lines = [line for line, _ in measured]
    for line in lines[1:]:
        pairs = zip(line.values, lines[0].values, strict=True)
        line.ratios = [own / first for own, first in pairs]
    return lines


def shortest(seconds: Callable[[], float]) -> float:
    """Returns the shortest time of some passes, by which variants are chosen."""
    return min(seconds() for _ in range(5))


def timed(calls: int, function: Callable[..., object], *arguments: object) -> Callable[[], float]:
    """Measures the seconds of a call, as the mean of `calls`."""

    def seconds() -> float:
        start = time.perf_counter()
        for _ in range(calls):
            function(*arguments)
        return (time.perf_counter() - start) / calls

    return seconds


class Peers:
    """The available lines of a group."""

    def __init__(self) -> None:
        self.measured: list[Measured] = []
        self.left_out: list[Line] = []

    def add(self, name: str, prepare: Callable[[], list[Measured]]) -> None:
        """Adds the lines that `prepare` makes, or one with the reason for their absence."""
        progress(f"preparing {name}")
        try:
            self.measured += prepare()
        except Exception as error:  # Whatever it is, it is this peer's, and the others go on.
            traceback.print_exc()
            reason = " ".join(str(error).split())[:160]
            self.left_out.append(Line(name, f"left out: {type(error).__name__}: {reason}"))

    def group(self, title: str, first: Measured, rounds: int) -> Group:
        """Measures the lines in turns with the first one, and adds the missing ones."""
        return Group(title, interleaved([first, *self.measured], rounds) + self.left_out)


def progress(text: str) -> None:
    """Writes to standard error: the table is the output."""
    print(f"peers: {text}", file=sys.stderr, flush=True)


# ---------------------------------------------------------------------------- programs


class Program:
    """A timing program that answers a line with a line."""

    def __init__(self, command: Sequence[str | Path]) -> None:
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __enter__(self) -> "Program":
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin
        self._process.stdin.close()
        self._process.wait()

    def ask(self, text: str) -> str:
        """Writes a line and reads one."""
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write(text + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise RuntimeError("a timing program ended early")
        return answer


class Bristle(Program):
    """Bristle's timing program."""

    def request(self, measure: str, **values: object) -> dict:
        """Returns the answer to a request."""
        return json.loads(self.ask(json.dumps({"measure": measure, **values})))

    def contact(self, case: Case, tolerance: float) -> tuple[float, float]:
        """Seconds, and p_n in N s."""
        answer = self.request(
            "contact",
            brushing_velocity_m_s=case[0],
            penetration_depth_m=case[1],
            relative_tolerance=tolerance,
        )
        return answer["seconds"], answer["impulse"]

    def study(self, tolerance: float) -> dict:
        """Seconds and cases."""
        return self.request("study", relative_tolerance=tolerance)

    def impulses(self, tolerance: float) -> dict[Case, float]:
        """p_n of the cases of the study."""
        return {
            (case["brushing_velocity_m_s"], case["penetration_depth_m"]): case["impulse"]
            for case in self.study(tolerance)["cases"]
        }


@dataclass(frozen=True)
class Setup:
    """Programs, directory and extent of the measurements."""

    bristle: Bristle
    loops: list[Path]
    directory: Path
    quick: bool
    full: bool

    @property
    def rounds(self) -> int:
        """Number of repetitions of a short measurement."""
        return 5 if self.quick else 21


# ---------------------------------------------------------------------------- accelerations


def state_of_bristle(at: State) -> dict[str, object]:
    """As bristle.rs reads it."""
    return {
        "base_angle": at.base_angle,
        "base_rate": at.base_rate,
        "base_acceleration": at.base_acceleration,
        "gravity": at.gravity,
        "q": [at.q[i : i + 2] for i in range(0, len(at.q), 2)],
        "v": [at.v[i : i + 2] for i in range(0, len(at.v), 2)],
    }


def deviation(values: "np.ndarray", expected: "np.ndarray", bound: float, of: str) -> float:
    """Largest deviation, relative to the largest expected value; an error if it is too large."""
    import numpy as np

    values, expected = np.ravel(values), np.ravel(expected)
    found = float(np.max(np.abs(values - expected)) / np.max(np.abs(expected)))
    if not found <= bound:
        raise RuntimeError(f"{of} differ by {found:.1e} of the largest")
    return found


CALLS = 20_000
# In a batch: some full sets of lanes, not all of them alike.
BATCH = 64


def accelerations(setup: Setup) -> list[Group]:
    """One state at a time, and per state in a batch."""
    import numpy as np

    bristle, at = setup.bristle, bent_state(SEGMENTS)
    request = state_of_bristle(at)
    answer = bristle.request("accelerations", state=request, calls=1)
    ours = np.ravel(answer["accelerations"])

    def of_bristle() -> float:
        return bristle.request("accelerations", state=request, calls=CALLS)["seconds"]

    peers = Peers()
    fastest: list[Callable[[], float]] = []

    def pinocchio_lines() -> list[Measured]:
        lines, loop = pinocchio_accelerations(setup, at, ours)
        fastest.append(loop)
        return lines

    peers.add("Pinocchio", pinocchio_lines)
    peers.add("MuJoCo", lambda: mujoco_accelerations(at, ours))
    note = "50 rates; springs and dampers included; generic x86-64"
    first = Line("Bristle, `Dynamics::accelerations`", note)
    title = f"accelerations, n = {SEGMENTS}, one state at a time"
    single = peers.group(title, (first, of_bristle), setup.rounds)

    # Each of the batch is checked against what one at a time gives.
    states = [bent_state(SEGMENTS, 0.6 - 0.005 * i) for i in range(BATCH)]
    requests = [state_of_bristle(one) for one in states]
    alone = [
        bristle.request("accelerations", state=one, calls=1)["accelerations"] for one in requests
    ]
    together = bristle.request("batch", states=requests, calls=1)["accelerations"]
    agreement = deviation(
        np.array(together), np.array(alone), BATCH_AGREEMENT, "accelerations of the batch"
    )

    def of_batch() -> float:
        return bristle.request("batch", states=requests, calls=CALLS // BATCH)["seconds"]

    note = f"{BATCH} different states, one thread; agree to {agreement:.0e}"
    batch = [(Line("Bristle, `Batch::accelerations`", note), of_batch)]
    if fastest:
        batch.append((Line("Pinocchio, the fastest above", "it has no batches"), fastest[0]))
    lines = interleaved(batch, setup.rounds)
    return [single, Group(f"the same, per state of a batch of {BATCH}", lines)]


def pinocchio_accelerations(
    setup: Setup, at: State, ours: "np.ndarray"
) -> tuple[list[Measured], Callable[[], float]]:
    """Measures from C++ where it could be compiled, and from Python."""
    import pinocchio
    from pinocchio_chain import JOINTS, problem

    problems = [problem(at, joints) for joints in JOINTS]
    agreement = 0.0
    for one in problems:
        found = pinocchio.aba(one.model, one.model.createData(), one.q, one.v, one.tau)
        agreement = max(
            agreement,
            deviation(one.coordinates(found, at), ours, AGREEMENT, "Pinocchio's accelerations"),
        )
    # The loops of all kinds of joints and builds; the fastest is found once and then measured.
    candidates: list[tuple[float, str, Callable[[], float], Problem]] = []
    for program in setup.loops:
        for one in problems:
            loop = Program(one.arguments(program))
            expected = pinocchio.aba(one.model, one.model.createData(), one.q, one.v, one.tau)
            answer = [float(x) for x in loop.ask(f"1 {one.numbers()}").split()][2:]
            deviation(answer, expected, AGREEMENT, f"accelerations of {program.name}")

            def seconds(loop: Program = loop, one: "Problem" = one) -> float:
                # The faster of the algorithm's two conventions.
                answer = loop.ask(f"{CALLS // 4} {one.numbers()}")
                return min(float(x) for x in answer.split()[:2])

            label = f"{one.joints} joints, {one.model.nv} rates"
            if program != setup.loops[0]:
                label += ", -march=native"
            candidates.append((shortest(seconds), label, seconds, one))

    def from_python(one: "Problem") -> Callable[[], float]:
        arguments = one.model, one.model.createData(), one.q, one.v, one.tau
        return timed(CALLS // 10, pinocchio.aba, *arguments)

    chosen = min(problems, key=lambda one: shortest(from_python(one)))
    rest = f"torques of springs and dampers not counted; agree to {agreement:.0e}"
    call = shortest(from_python(problem(bent_state(1), chosen.joints)))
    note = (
        f"{chosen.joints} joints, {chosen.model.nv} rates; with the call, which for one segment "
        f"takes {shown(call)}; {rest}"
    )
    last = (Line("Pinocchio, `aba`, from Python", note), from_python(chosen))
    if not candidates:
        last[0].note += "; the loop in C++ could not be compiled"
        return [last], last[1]
    ranked = sorted(candidates, key=lambda candidate: candidate[0])
    others = f"the fastest of {len(ranked)} builds, the slowest takes {shown(ranked[-1][0])}"
    note = f"{ranked[0][1]}, {others}; {rest}"
    line = Line("Pinocchio, `aba`, loop in C++", note)
    return [(line, ranked[0][2]), last], ranked[0][2]


def mujoco_accelerations(at: State, ours: "np.ndarray") -> list[Measured]:
    """Measures two hinges a node or ball joints, whichever is faster."""
    import mujoco
    import numpy as np
    from mujoco_chain import chain_at
    from pinocchio_chain import problem

    calls, tried = CALLS // 40, []
    for joints, bound in MUJOCO_AGREEMENT.items():
        one = problem(at, joints)
        model, data = chain_at(joints, one.model.gravity.linear, one.q, one.v, one.tau)
        mujoco.mj_forward(model, data)
        agreement = deviation(
            one.coordinates(np.array(data.qacc), at), ours, bound, "MuJoCo's accelerations"
        )

        seconds = timed(calls, mujoco.mj_forward, model, data)
        tried.append((shortest(seconds), joints, agreement, model.nv, seconds))
    _, joints, agreement, rates, seconds = min(tried, key=lambda one: one[0])
    empty = mujoco.MjModel.from_xml_string("<mujoco/>")
    call = shortest(timed(calls, mujoco.mj_forward, empty, mujoco.MjData(empty)))
    note = (
        f"{'ball joints' if joints == 'spherical' else 'two hinges a node'}, {rates} rates; with "
        f"the call, which for an empty model takes {shown(call)}; contacts and "
        f"constraints off; torques not counted; agree to {agreement:.0e}"
    )
    return [(Line("MuJoCo, `mj_forward`, from Python", note), seconds)]


# ---------------------------------------------------------------------------- contacts


CASE: Case = (10.0, 1.0e-3)
# Largest relative error of p_n.
ACCURACY = 1e-3
# Tolerances from tight to loose, in steps of √10.
TOLERANCES = [10 ** (-k / 2) for k in range(12, 3, -1)]
# A tolerance for which CasADi's time is measured, too.
TIGHT = 1e-7
# Fixed steps from small to large, in s, in finer ratios than the tolerances.
STEPS = [10 ** (-6 + k / 8) for k in range(17)]
# Seconds and p_n in N s at a tolerance or a step.
Pass = Callable[[float], tuple[float, float]]


def loosest(error: Callable[[float], float], choices: Sequence[float]) -> tuple[float, float]:
    """The loosest choice that is accurate, as all tighter ones are, and its error."""
    found: tuple[float, float] | None = None
    reached = float("inf")
    for choice in choices:
        now = error(choice)
        reached = min(reached, now)
        if not now <= ACCURACY:
            break
        found = (choice, now)
    if found is None:
        raise RuntimeError(f"p_n is not reached to {ACCURACY}, but to {reached:.1e}")
    return found


def accuracy(found: tuple[float, float], of: str = "relative tolerance") -> str:
    """Remark on a tolerance or step and its error."""
    choice, error = found
    value = f"{choice:.1e}" if of == "relative tolerance" else f"{choice * 1e6:.2g} µs"
    return f"{of} {value}, error of p_n {error:.1e}"


def one_contact(setup: Setup) -> list[Group]:
    """One pass, one thread, at equal accuracy."""
    exact = reference_impulse_n_s(CASE)

    def error(run: Pass) -> Callable[[float], float]:
        return lambda choice: abs(run(choice)[1] / exact - 1)

    def of_bristle(tolerance: float) -> tuple[float, float]:
        return setup.bristle.contact(CASE, tolerance)

    def line(
        name: str,
        run: Pass,
        choices: Sequence[float],
        note: str,
        of: str = "relative tolerance",
    ) -> Measured:
        found = loosest(error(run), choices)
        remark = Line(name, f"{accuracy(found, of)}; {note}")
        return remark, lambda: run(found[0])[0]

    first = line(
        "Bristle, `simulate`",
        of_bristle,
        TOLERANCES,
        "planar, all metrics and the lateral amplification",
    )
    peers = Peers()

    def casadi_lines(kind: str) -> list[Measured]:
        from casadi_contact import Contact

        library = casadi_library(setup.directory, kind)
        solver = fastest_linear_solver(library)
        made: dict[float, Contact] = {}

        def run(tolerance: float) -> tuple[float, float]:
            if tolerance not in made:
                made[tolerance] = Contact(library, CASE, tolerance, solver)
            return made[tolerance].run()

        found = loosest(error(run), TOLERANCES)
        note = f"{accuracy(found)}; dense M, analytic Jacobian, p_n only, {solver}"
        name = f"CasADi's C code, CVODES, {kind}"
        lines: list[Measured] = [(Line(name, note), lambda: run(found[0])[0])]
        if kind == "spatial":
            remark = accuracy((TIGHT, error(run)(TIGHT)))
            tight = Line("the same, tight", f"{remark}; not at equal accuracy")
            lines.append((tight, lambda: run(TIGHT)[0]))
            plain = Contact(library, CASE, found[0], solver, plain=True)
            reached = (found[0], abs(plain.run()[1] / exact - 1))
            note = f"{accuracy(reached)}; evaluated and differentiated by CasADi itself"
            name = "CasADi, CVODES, spatial, no C code"
            lines.append((Line(name, note), lambda: plain.run()[0]))
        return lines

    def mujoco_lines() -> list[Measured]:
        from mujoco_chain import HINGES, Contact, warnings_off

        warnings_off()
        note = "implicitfast, soft contact of k_c, p_n summed in Python"

        def run(joints: str) -> Pass:
            return lambda step: Contact(CASE, step, joints).run()

        return [line(f"MuJoCo, {joints}", run(joints), STEPS, note, "step") for joints in HINGES]

    peers.add("CasADi's C code, CVODES, spatial", lambda: casadi_lines("spatial"))
    peers.add("CasADi's C code, CVODES, planar", lambda: casadi_lines("planar"))
    peers.add("MuJoCo", mujoco_lines)
    title = f"one contact, v_b = 10 m/s, a_e = 1 mm, n = {SEGMENTS}, one thread"
    return [peers.group(title, first, setup.rounds)]


# ---------------------------------------------------------------------------- rows

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


@cache
def casadi_library(directory: Path, kind: str) -> "Library":
    """Returns the library, compiled at first use."""
    from casadi_contact import Library
    from casadi_equations import Planar, Spatial

    return Library({"planar": Planar, "spatial": Spatial}[kind], directory)


@cache
def fastest_linear_solver(library: "Library") -> str:
    """Returns the solver with the shortest of five passes, at a moderate tolerance."""
    from casadi_contact import LINEAR_SOLVERS, Contact

    def seconds(solver: str) -> float:
        contact = Contact(library, CASE, 1e-4, solver)
        return shortest(lambda: contact.run()[0])

    return min(LINEAR_SOLVERS, key=seconds)


# ---------------------------------------------------------------------------- the study


# Stride through the 120 cases that the peer is timed on, without --full; with 11 each depth and
# almost each velocity occurs. The peer must be accurate in all of them, as Bristle is.
STRIDE = 11
# Tolerance of the p_n with which other tolerances are compared.
STUDY_REFERENCE = 1e-8

_library_of_worker: list["Library"] = []


def _start_worker(library: "Library") -> None:
    _library_of_worker[:] = [library]


def _run_case(case: Case, tolerance: float, solver: str) -> tuple[int, float, float]:
    """Process, seconds and p_n of a case."""
    from casadi_contact import Contact

    return os.getpid(), *Contact(_library_of_worker[0], case, tolerance, solver).run()


def study(setup: Setup) -> list[Group]:
    """The 120 contacts on all cores of both."""
    bristle, cores = setup.bristle, os.cpu_count() or 1
    exact = bristle.impulses(STUDY_REFERENCE)
    cases = list(exact)
    sampled = cases[::STRIDE]

    def error_of_bristle(tolerance: float) -> float:
        found = bristle.impulses(tolerance)
        return max(abs(found[case] / exact[case] - 1) for case in exact)

    ours = loosest(error_of_bristle, TOLERANCES)
    note = f"{accuracy(ours)} at most; {cores} threads"
    first: Measured = (
        Line("Bristle, `run_study`", note),
        lambda: bristle.study(ours[0])["seconds"],
    )
    peers, pools = Peers(), []
    whole = f"all {len(cases)} cases, {cores} processes, the time of the longest"
    part = f"{len(sampled)} of {len(cases)} cases, their sum scaled, divided by {cores} cores"

    def casadi_lines(kind: str) -> list[Measured]:
        from casadi_contact import Contact

        library = casadi_library(setup.directory, kind)
        solver = fastest_linear_solver(library)
        pool = get_context("spawn").Pool(cores, _start_worker, (library,))
        pools.append(pool)

        def runs(tolerance: float) -> list[tuple[int, float, float]]:
            arguments = [(case, tolerance, solver) for case in cases]
            return pool.starmap(_run_case, arguments, chunksize=1)

        def error(tolerance: float) -> float:
            found = zip(cases, runs(tolerance), strict=True)
            return max(abs(impulse / exact[case] - 1) for case, (_, _, impulse) in found)

        def measured(name: str, tolerance: float, note: str, plain: bool = False) -> Measured:
            contacts = []
            if plain or not setup.full:
                contacts = [Contact(library, c, tolerance, solver, plain=plain) for c in sampled]

            def seconds() -> float:
                if contacts:
                    total = sum(contact.run()[0] for contact in contacts)
                    return total * len(cases) / len(sampled) / cores
                # Setting the integrators up is not counted.
                of_worker: dict[int, float] = {}
                for worker, own, _ in runs(tolerance):
                    of_worker[worker] = of_worker.get(worker, 0.0) + own
                return max(of_worker.values())

            return Line(name, f"{note}; {part if contacts else whole}"), seconds

        found = loosest(error, TOLERANCES)
        name = f"CasADi's C code, CVODES, {kind}"
        lines = [measured(name, found[0], f"{accuracy(found)} at most; {solver}")]
        if kind == "spatial":
            note = f"{accuracy((TIGHT, error(TIGHT)))} at most; not at equal accuracy"
            lines.append(measured("the same, tight", TIGHT, note))
            name, note = "CasADi, CVODES, spatial, no C code", accuracy(found) + " at most"
            lines.append(measured(name, found[0], note, plain=True))
        return lines

    try:
        peers.add("CasADi's C code, CVODES, spatial", lambda: casadi_lines("spatial"))
        peers.add("CasADi's C code, CVODES, planar", lambda: casadi_lines("planar"))
        title = f"the study, {len(cases)} contacts, {cores} cores"
        return [peers.group(title, first, 1 if setup.quick else 3)]
    finally:
        for pool in pools:
            pool.terminate()


# ---------------------------------------------------------------------------- the whole


GROUPS: dict[str, Callable[[Setup], list[Group]]] = {
    "accelerations": accelerations,
    "contact": one_contact,
    "row": rows,
    "study": study,
}


def machine() -> dict[str, object]:
    """Processor, cores, load and versions."""
    model = platform.processor() or "unknown processor"
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line for line in cpuinfo.read_text().splitlines() if line.startswith("model name")]
        model = names[0].split(":", 1)[1].strip() if names else model
    versions = {"Python": platform.python_version()}
    for name in PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "missing"
    for name in ("rustc", "cc"):
        try:
            found = subprocess.run([name, "--version"], capture_output=True, text=True, check=True)
            versions[name] = found.stdout.splitlines()[0].strip().removeprefix(f"{name} ")
        except (OSError, subprocess.CalledProcessError):
            versions[name] = "missing"
    load = os.getloadavg()[0]
    return {"processor": model, "cores": os.cpu_count(), "load": load, "versions": versions}


def markdown(before: dict, groups: list[Group]) -> str:
    """The table, with the machine above it."""
    versions = ", ".join(f"{name} {text}" for name, text in before["versions"].items())
    return (
        f"{before['processor']}, {before['cores']} cores, load {before['load']:.1f} before; "
        f"{versions}.\n\n{HEADER}{''.join(group.rows() for group in groups)}"
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Called by run.py.")
    parser.add_argument("--bristle", type=Path, required=True, help="its timing program")
    parser.add_argument(
        "--loop", type=Path, action="append", default=[], help="Pinocchio's timing programs"
    )
    parser.add_argument("--directory", type=Path, required=True, help="for what is compiled")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--only", choices=GROUPS, action="append")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--full", action="store_true")
    arguments = parser.parse_args()

    before, groups = machine(), []
    with Bristle([arguments.bristle]) as bristle:
        setup = Setup(
            bristle,
            arguments.loop,
            arguments.directory,
            arguments.quick,
            arguments.full,
        )
        for name, measure in GROUPS.items():
            if arguments.only and name not in arguments.only:
                continue
            start = time.perf_counter()
            groups += measure(setup)
            progress(f"{name} took {time.perf_counter() - start:.0f} s")
    text = markdown(before, groups)
    print(text)
    if arguments.out:
        arguments.out.write_text(text, encoding="utf-8", newline="\n")
    if arguments.json:
        record = {
            "machine": before,
            "groups": [
                {"what": group.title, "lines": [line.record() for line in group.lines]}
                for group in groups
            ],
        }
        document = json.dumps(record, indent=1, ensure_ascii=False)
        arguments.json.write_text(document + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
