"""One contact at equal accuracy."""

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from paper_case import SEGMENTS, Case, reference_impulse_n_s
from programs import Setup
from table import Group, Line, Measured, Peers, shortest

if TYPE_CHECKING:
    from casadi_contact import Library

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
