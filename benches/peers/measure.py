"""The measurements of run.py: takes turns between Bristle and the others, and prints the table.

Every number is the median over rounds; in each round everything is measured once, so a slow spell
of the machine meets all. A ratio is the median over the rounds of the ratio within a round.
"""

import argparse
import csv
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from multiprocessing import Pool
from pathlib import Path
from statistics import median
from types import TracebackType

import casadi
import mujoco
import numpy as np
import pinocchio
from casadi_contact import LINEAR_SOLVERS, Contact, compiled

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "derivations"))

import reference_aba as aba_chain  # noqa: E402

SEGMENTS = 25
# Of the largest acceleration: tests/reference.rs asserts this of the same comparison.
AGREEMENT = 1e-11
# Of joint accelerations: by a factorisation of the 75 × 75 mass matrix, whose condition costs
# digits.
MUJOCO_AGREEMENT = 1e-7


def relative(values: np.ndarray, expected: np.ndarray) -> float:
    """Largest deviation, relative to the largest expected value."""
    return float(np.max(np.abs(values - expected)) / np.max(np.abs(expected)))


class Program:
    """A timing program that answers a line with a line."""

    def __init__(self, path: Path) -> None:
        self._process = subprocess.Popen(
            [path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __enter__(self) -> "Program":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        assert self._process.stdin
        self._process.stdin.close()
        self._process.wait()

    def send(self, text: str) -> None:
        """Writes without waiting for an answer."""
        assert self._process.stdin
        self._process.stdin.write(text + "\n")
        self._process.stdin.flush()

    def ask(self, text: str) -> str:
        """Writes a line and reads one."""
        self.send(text)
        assert self._process.stdout
        answer = self._process.stdout.readline()
        if not answer:
            raise RuntimeError("a timing program ended early")
        return answer


def ask_bristle(bristle: Program, measure: str, **values: object) -> dict:
    """What Bristle's program answers."""
    return json.loads(bristle.ask(json.dumps({"measure": measure, **values})))


@dataclass
class Line:
    """One line of the table: the times of all rounds in s."""

    name: str
    note: str = ""
    seconds: list[float] = field(default_factory=list)


def interleaved(lines: list[tuple[Line, Callable[[], float]]], rounds: int) -> list[Line]:
    """Measures every line once a round."""
    for _ in range(rounds):
        for line, measure in lines:
            line.seconds.append(measure())
    return [line for line, _ in lines]


def shown(seconds: float) -> str:
    """Three digits, in a unit that fits."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def table(title: str, lines: list[Line]) -> str:
    """The first line is Bristle's; the others have a ratio to it."""
    text = f"| {title} | time | peer / Bristle | remarks |\n|---|---:|---:|---|\n"
    for line in lines:
        pairs = zip(line.seconds, lines[0].seconds, strict=True)
        ratio = f"{median(own / first for own, first in pairs):.3g}" if line is not lines[0] else ""
        text += f"| {line.name} | {shown(median(line.seconds))} | {ratio} | {line.note} |\n"
    return text


# ---------------------------------------------------------------------------- accelerations


def state() -> aba_chain.State:
    """The bent, turning filament of `cargo bench --bench speed -- accelerations`."""
    rate, angle = 10.0 / 0.18, -1.55
    q, v = [], []
    for k in range(SEGMENTS):
        along = (k + 0.5) / SEGMENTS
        bend = along**1.5
        q += [np.pi / 2 + 0.02 * bend, angle - 0.6 * bend]
        v += [2.0 * along, rate * (1.0 - 2.0 * along)]
    return aba_chain.State(
        "bench", aba_chain.YOUNGS_MODULUS_PA, angle, rate, 0.0, [0.0, 0.0, 0.0], q, v
    )


def pinocchio_problem(
    at: aba_chain.State,
) -> tuple[pinocchio.Model, np.ndarray, np.ndarray, np.ndarray]:
    """Model, positions, velocities and torques that reference_aba.py computes for a state."""
    found: list[tuple] = []
    original = pinocchio.aba

    def recorded(model: object, data: object, q: object, v: object, tau: object) -> object:
        found.append((model, q, v, tau))
        return original(model, data, q, v, tau)

    pinocchio.aba = recorded
    try:
        aba_chain.accelerations(at)
    finally:
        pinocchio.aba = original
    return found[0]


def mujoco_chain(
    gravity: np.ndarray, q: np.ndarray, v: np.ndarray, tau: np.ndarray
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Pinocchio's chain and state in MuJoCo: the same rates, but quaternions start with w."""
    constants = aba_chain.chain_constants(SEGMENTS, aba_chain.YOUNGS_MODULUS_PA)
    h, inertia = constants.segment_length_m, constants.segment_inertia_kg_m2
    bodies = ""
    for k in range(SEGMENTS):
        bodies += (
            f'<body pos="0 0 {h if k else 0.0!r}"><joint type="ball"/>'
            f'<inertial pos="0 0 {h / 2!r}" mass="{constants.segment_mass_kg!r}" '
            f'diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>'
        )
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler boundmass="0" boundinertia="0"/>
        <option gravity="{" ".join(repr(float(x)) for x in gravity)}">
        <flag contact="disable" constraint="disable" energy="disable"/></option>
        <worldbody>{bodies}{"</body>" * SEGMENTS}</worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.qpos[:] = q.reshape(-1, 4)[:, [3, 0, 1, 2]].ravel()
    data.qvel[:] = v
    data.qfrc_applied[:] = tau
    return model, data


def accelerations(bristle: Program, loop: Path | None, rounds: int) -> str:
    """Row 1."""
    at = state()
    calls = 20_000
    request = {
        "base_angle": at.base_angle,
        "base_rate": at.base_rate,
        "base_acceleration": at.base_acceleration,
        "gravity": at.gravity,
        "q": [at.q[i : i + 2] for i in range(0, len(at.q), 2)],
        "v": [at.v[i : i + 2] for i in range(0, len(at.v), 2)],
    }
    ours = np.ravel(ask_bristle(bristle, "accelerations", calls=1, **request)["accelerations"])
    theirs = np.array(aba_chain.accelerations(at))
    deviation = relative(ours, theirs)
    if not deviation <= AGREEMENT:
        raise RuntimeError(f"Pinocchio's accelerations differ from Bristle's by {deviation:.1e}")

    model, q, v, tau = pinocchio_problem(at)
    data = model.createData()

    def of_bristle() -> float:
        return ask_bristle(bristle, "accelerations", calls=calls, **request)["seconds"]

    def from_python() -> float:
        few = calls // 10
        start = time.perf_counter()
        for _ in range(few):
            pinocchio.aba(model, data, q, v, tau)
        return (time.perf_counter() - start) / few

    body_model, body_data = mujoco_chain(model.gravity.linear, q, v, tau)
    mujoco.mj_forward(body_model, body_data)
    expected = pinocchio.aba(model, data, q, v, tau).copy()
    body_deviation = relative(body_data.qacc, expected)
    if not body_deviation <= MUJOCO_AGREEMENT:
        raise RuntimeError(f"MuJoCo differs from Pinocchio by {body_deviation:.1e}")

    def of_mujoco() -> float:
        few = calls // 40
        start = time.perf_counter()
        for _ in range(few):
            mujoco.mj_forward(body_model, body_data)
        return (time.perf_counter() - start) / few

    agreement = f"accelerations agree to {deviation:.0e} of the largest"
    handicaps = "75 instead of 50 rates; torques of springs and dampers not counted"
    lines = [
        (Line("Bristle, `Dynamics::accelerations`"), of_bristle),
        (
            Line("Pinocchio, `aba`, from Python", f"with the call; {handicaps}; {agreement}"),
            from_python,
        ),
        (
            Line(
                "MuJoCo, `mj_forward`, from Python",
                f"with the call; contacts, constraints off; {handicaps}; agree to "
                f"{body_deviation:.0e}",
            ),
            of_mujoco,
        ),
    ]
    if loop is None:
        return table(f"accelerations, n = {SEGMENTS}, one state", interleaved(lines, rounds))
    with Program(loop) as program:
        constants = aba_chain.chain_constants(SEGMENTS, at.youngs_modulus_pa)
        numbers = [
            constants.segment_length_m,
            constants.segment_mass_kg,
            constants.segment_inertia_kg_m2,
            *model.gravity.linear,
        ]
        program.send(" ".join([str(SEGMENTS), *(repr(float(x)) for x in numbers)]))
        values = " ".join(repr(float(x)) for x in (*q, *v, *tau))
        answer = np.array([float(x) for x in program.ask(f"1 {values}").split()])[2:]
        error = relative(answer, expected)
        if not error <= AGREEMENT:
            raise RuntimeError(f"the loop in C++ computes something else: {error:.1e}")

        def in_cpp() -> float:
            # The faster of the algorithm's two conventions.
            return min(float(x) for x in program.ask(f"{calls // 2} {values}").split()[:2])

        name = "Pinocchio, `aba`, from a loop in C++"
        lines.insert(1, (Line(name, f"{handicaps}; {agreement}"), in_cpp))
        return table(f"accelerations, n = {SEGMENTS}, one state", interleaved(lines, rounds))


# ---------------------------------------------------------------------------- contacts


# (v_b in m/s, a_e in m)
Case = tuple[float, float]

CASE: Case = (10.0, 1.0e-3)
# Of p_n.
ACCURACY = 1e-3
# From tight to loose.
TOLERANCES = [10 ** (-k / 2) for k in range(12, 3, -1)]


def reference_impulse(case: Case) -> float:
    """p_n in N s of a case, by derivations/reference_contacts.py."""
    path = ROOT / "tests" / "data" / "reference_contacts.csv"
    rows = csv.DictReader(path.read_text(encoding="utf-8").splitlines()[1:])
    for row in rows:
        if (float(row["brushing_velocity_m_s"]), float(row["penetration_depth_m"])) == case:
            return float(row["contact_normal_impulse_n_s"])
    raise LookupError(f"no reference for {case}")


def loosest(error: Callable[[float], float]) -> tuple[float, float]:
    """The loosest tolerance that is accurate, as all tighter ones are, and its error."""
    found: tuple[float, float] | None = None
    for tolerance in TOLERANCES:
        now = error(tolerance)
        if not now <= ACCURACY:
            break
        found = (tolerance, now)
    if found is None:
        raise RuntimeError(f"no tolerance gives p_n to {ACCURACY}")
    return found


def accuracy(found: tuple[float, float]) -> str:
    """Remark on a tolerance and its error."""
    tolerance, error = found
    return f"relative tolerance {tolerance:.1e}, error of p_n {error:.1e}"


def contact_of_bristle(bristle: Program, case: Case, tolerance: float) -> tuple[float, float]:
    """Seconds, and p_n in N s."""
    answer = ask_bristle(
        bristle,
        "contact",
        brushing_velocity_m_s=case[0],
        penetration_depth_m=case[1],
        relative_tolerance=tolerance,
    )
    return answer["seconds"], answer["impulse"]


def fastest_linear_solver(function: casadi.Function) -> str:
    """The one with the shortest of three passes, at a moderate tolerance."""

    def seconds(linear_solver: str) -> float:
        contact = Contact(function, CASE, 1e-4, linear_solver)
        return min(contact.run()[0] for _ in range(3))

    return min(LINEAR_SOLVERS, key=seconds)


def one_contact(
    bristle: Program, function: casadi.Function, linear_solver: str, rounds: int
) -> str:
    """Row 2."""
    exact = reference_impulse(CASE)

    def error(impulse: float) -> float:
        return abs(impulse / exact - 1)

    ours = loosest(lambda tolerance: error(contact_of_bristle(bristle, CASE, tolerance)[1]))
    theirs = loosest(
        lambda tolerance: error(Contact(function, CASE, tolerance, linear_solver).run()[1])
    )
    contact = Contact(function, CASE, theirs[0], linear_solver)
    lines = interleaved(
        [
            (
                Line("Bristle, `simulate`", f"{accuracy(ours)}; spatial, all metrics"),
                lambda: contact_of_bristle(bristle, CASE, ours[0])[0],
            ),
            (
                Line(
                    "CasADi's C code and CVODES",
                    f"{accuracy(theirs)}; planar, p_n only, {linear_solver}",
                ),
                lambda: contact.run()[0],
            ),
        ],
        rounds,
    )
    return table("one contact, v_b = 10 m/s, a_e = 1 mm, n = 25, one thread", lines)


# ---------------------------------------------------------------------------- the study


# Every so many of the 120 cases are run on the peer unless --full asks for all; with 11 each depth
# and almost each velocity comes up.
STRIDE = 11


def run_case(
    library: Path, case: Case, tolerance: float, linear_solver: str
) -> tuple[float, float]:
    """Seconds and p_n of a case, in a process of its own pool."""
    function = casadi.external("contact", str(library))
    return Contact(function, case, tolerance, linear_solver).run()


def study(bristle: Program, library: Path, linear_solver: str, rounds: int, full: bool) -> str:
    """Row 3."""

    def impulses(tolerance: float) -> dict[Case, float]:
        answer = ask_bristle(bristle, "study", relative_tolerance=tolerance)
        return {
            (case["brushing_velocity_m_s"], case["penetration_depth_m"]): case["impulse"]
            for case in answer["cases"]
        }

    exact = impulses(1e-8)
    cases = list(exact)[:: 1 if full else STRIDE]
    function = casadi.external("contact", str(library))

    def error_of_bristle(tolerance: float) -> float:
        found = impulses(tolerance)
        return max(abs(found[case] / exact[case] - 1) for case in exact)

    def error_of_peer(tolerance: float) -> float:
        return max(
            abs(Contact(function, case, tolerance, linear_solver).run()[1] / exact[case] - 1)
            for case in cases
        )

    ours, theirs = loosest(error_of_bristle), loosest(error_of_peer)
    cores = os.cpu_count() or 1
    remark = f"{accuracy(theirs)} at most; "
    if full:
        remark += f"all {len(cases)} cases, {cores} processes"
    else:
        remark += f"{len(cases)} of {len(exact)} cases, their sum scaled, divided by {cores} cores"
    contacts = [Contact(function, case, theirs[0], linear_solver) for case in cases]

    def of_bristle() -> float:
        return ask_bristle(bristle, "study", relative_tolerance=ours[0])["seconds"]

    def of_peer() -> float:
        if not full:
            return sum(contact.run()[0] for contact in contacts) * len(exact) / len(cases) / cores
        start = time.perf_counter()
        arguments = [(library, case, theirs[0], linear_solver) for case in cases]
        pool.starmap(run_case, arguments, chunksize=1)
        return time.perf_counter() - start

    with Pool(cores) as pool:
        lines = interleaved(
            [
                (
                    Line("Bristle, `run_study`", f"{accuracy(ours)} at most; {cores} threads"),
                    of_bristle,
                ),
                (Line("CasADi's C code and CVODES", remark), of_peer),
            ],
            rounds,
        )
    return table(f"the study, {len(exact)} contacts, {cores} cores", lines)


# ---------------------------------------------------------------------------- the whole


def machine() -> str:
    """Processor, cores, load and versions."""
    model = "unknown processor"
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line for line in cpuinfo.read_text().splitlines() if line.startswith("model name")]
        model = names[0].split(":", 1)[1].strip() if names else model
    rust = subprocess.run(["rustc", "--version"], check=True, stdout=subprocess.PIPE, text=True)
    load = os.getloadavg()[0]
    packages = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    return (
        f"{model}, {os.cpu_count()} cores, load {load:.1f}; "
        f"Python {platform.python_version()}, {packages}, {rust.stdout.strip()}."
    )


PACKAGES = ("casadi", "mujoco", "pin", "numpy", "scipy")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Called by run.py.")
    parser.add_argument("--bristle", type=Path, required=True, help="its timing program")
    parser.add_argument("--pinocchio", type=Path, help="its timing program")
    parser.add_argument("--directory", type=Path, required=True, help="for what is compiled")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--full", action="store_true")
    arguments = parser.parse_args()

    before = machine()
    parts = []
    with Program(arguments.bristle) as bristle:
        rounds = 5 if arguments.quick else 21
        parts.append(accelerations(bristle, arguments.pinocchio, rounds))
        function = compiled(arguments.directory)
        linear_solver = fastest_linear_solver(function)
        parts.append(one_contact(bristle, function, linear_solver, rounds))
        if not arguments.quick:
            library = arguments.directory / "contact.so"
            parts.append(study(bristle, library, linear_solver, 3, arguments.full))
    text = "\n".join([f"{before}\n", *parts])
    print(text)
    if arguments.out:
        arguments.out.write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
