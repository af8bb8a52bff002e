"""Wrong arguments: each draws an exception that names it."""

from collections.abc import Callable
from typing import Any

import bristle
import numpy as np
import pytest

ONE = {"filament.segments": [4]}
STATES = np.full((2, 4, 2), 1.5)

WRONG: list[tuple[str, Callable[[bristle.Settings], object], type[Exception], str]] = [
    ("samples", lambda s: bristle.simulate(s, samples=2**62), ValueError, "samples"),
    ("negative", lambda s: bristle.simulate(s, samples=-1), ValueError, "samples"),
    ("shapes", lambda s: bristle.simulate(s, shapes=10**11), ValueError, "shapes"),
    ("fraction", lambda s: bristle.simulate(s, shapes=2.5), TypeError, "shapes"),  # type: ignore[arg-type]
    ("tool", lambda s: bristle.simulate(s, tool=3), TypeError, "tool"),  # type: ignore[arg-type]
    ("no settings", lambda s: bristle.simulate("x.toml"), TypeError, "bristle.load"),  # type: ignore[arg-type]
    ("study", lambda s: bristle.study("x.toml", ONE), TypeError, "bristle.load"),  # type: ignore[arg-type]
    ("threads", lambda s: bristle.study(s, ONE, threads=0), ValueError, "threads"),
    ("empty", lambda s: bristle.study(s, ONE, out=""), ValueError, "out is empty"),
    ("sweep", lambda s: bristle.study(s, [1, 2]), TypeError, "study"),  # type: ignore[arg-type]
    ("section", lambda s: s.replace(tool=3), TypeError, "'tool'"),  # type: ignore[arg-type]
    ("frames", lambda s: bristle.brush(s, frames=-1), ValueError, "frames"),
    ("segments", lambda s: bristle.derive(401), ValueError, "segments"),
    ("none", lambda s: bristle.derive(0), ValueError, "segments"),
    (
        "complex",
        lambda s: bristle.accelerations(s, STATES * 1j, STATES),
        TypeError,
        "complex",
    ),
    (
        "gravity",
        lambda s: bristle.accelerations(s, STATES, STATES, gravity_m_s2=9.81),  # type: ignore[arg-type]
        ValueError,
        "gravity_m_s2",
    ),
    (
        "not finite",
        lambda s: bristle.evaluate(s, {"q": [1.5, np.nan]}),
        ValueError,
        "q is not finite",
    ),
    ("state", lambda s: bristle.evaluate(s, 3), TypeError, "state"),  # type: ignore[arg-type]
]


@pytest.mark.parametrize(
    ("call", "error", "says"), [row[1:] for row in WRONG], ids=[row[0] for row in WRONG]
)
def test_wrong_arguments(
    settings: bristle.Settings,
    call: Callable[[bristle.Settings], object],
    error: type[Exception],
    says: str,
) -> None:
    with pytest.raises(error, match=says):
        call(settings)


def test_limits_of_advice(settings: bristle.Settings) -> None:
    study = bristle.study(settings, ONE, progress=False)
    for value in (float("nan"), -1.0, float("inf")):
        with pytest.raises(ValueError, match="max_force_n must be a positive number"):
            study.advise(max_force_n=value)


def test_equal_settings_simulate_the_same(settings: bristle.Settings) -> None:
    def compared(*names: str) -> bristle.Settings:
        tools: dict[str, Any] = {
            name: {"filament": {"length_m": 0.03 + 1e-3 * len(name)}} for name in names
        }
        return settings.replace(study={"penetration_depth_m": [1e-3], "tools": tools})

    assert compared("a", "bb") == compared("a", "bb")
    assert compared("a", "bb") != compared("bb", "a")
    sweep = {"brushing_velocity_m_s": [10.0], "penetration_depth_m": [1e-3]}
    whole = settings.replace(study=sweep)
    assert whole == settings.replace(study=sweep)
    assert whole != whole.replace(process=None)
