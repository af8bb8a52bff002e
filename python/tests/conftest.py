"""Settings that several tests share."""

import bristle
import pytest


@pytest.fixture
def settings() -> bristle.Settings:
    """A contact that takes a few milliseconds."""
    paper = bristle.Settings.paper(10.0, 1e-3)
    return paper.replace(filament={"segments": 10}, solver={"samples": 100})


@pytest.fixture
def small_brush(settings: bristle.Settings) -> bristle.Settings:
    """Three filaments that touch each other."""
    return settings.replace(
        tool={"filament_count": 682, "filament_count_uncertainty": 0},
        filament={"segments": 5},
        brush={"columns": 3, "rows": 1, "steady": False},
    )
