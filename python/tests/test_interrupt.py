"""Signals stop what takes long; SIGALRM stands for Ctrl-C."""

import signal
import time
from collections.abc import Callable
from types import FrameType

import bristle
import pytest

WITHIN_S = 0.1
"""Time limit of a signal on an idle machine."""

SLACK = 5.0
"""Multiple of this limit on a busy machine."""


class Interrupted(Exception):
    """Exception of the handler."""


def stops(work: Callable[[], object]) -> None:
    """Checks that a signal after 0.2 s ends the work with the exception it raises."""
    raised = [0.0]

    def handler(number: int, frame: FrameType | None) -> None:
        raise Interrupted

    earlier = signal.signal(signal.SIGALRM, handler)
    try:
        begun = time.perf_counter()
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(Interrupted):
            work()
        raised[0] = time.perf_counter() - begun - 0.2
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, earlier)
    assert raised[0] < SLACK * WITHIN_S


def test_a_contact(settings: bristle.Settings) -> None:
    long = settings.replace(filament={"segments": 200}, process={"turns": 50})
    stops(lambda: bristle.simulate(long))


def test_a_brush(settings: bristle.Settings) -> None:
    stops(lambda: bristle.brush(settings.replace(brush={"rows": 15})))


def test_equations() -> None:
    stops(lambda: bristle.derive(60))


def test_a_study(settings: bristle.Settings) -> None:
    sweep = {"process.brushing_velocity_m_s": {"start": 1.0, "stop": 9.0, "step": 1e-3}}
    stops(lambda: bristle.study(settings, sweep, progress=False))


def test_a_study_of_brushes(settings: bristle.Settings) -> None:
    sweep = {"process.penetration_depth_m": [1e-3, 2e-3]}
    brushes = settings.replace(brush={"rows": 15})
    stops(lambda: bristle.study(brushes, sweep, progress=False))
