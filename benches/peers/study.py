"""The 120 contacts of the study, on all cores."""

import os
from multiprocessing import get_context
from typing import TYPE_CHECKING

from contact import TIGHT, TOLERANCES, accuracy, casadi_library, fastest_linear_solver, loosest
from paper_case import Case
from programs import Setup
from table import Group, Line, Measured, Peers

if TYPE_CHECKING:
    from casadi_contact import Library

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
