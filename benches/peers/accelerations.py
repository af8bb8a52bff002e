"""Accelerations of one state at a time, and per state of a batch."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from paper_case import SEGMENTS, State, bent_state
from programs import Program, Setup
from table import Group, Line, Measured, Peers, interleaved, shortest, shown, timed

if TYPE_CHECKING:
    import numpy as np
    from pinocchio_chain import Problem

# Largest difference over the largest acceleration, as in tests/bristle/reference.rs.
AGREEMENT = 1e-11
# MuJoCo factorises M, whose condition costs digits; and its rods on two hinges have a small inertia about their axes.
MUJOCO_AGREEMENT = {"spherical": 1e-7, "universal": 1e-6}
# Equal to the bit.
BATCH_AGREEMENT = 1e-15


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
