"""Edges that grow round."""

import csv
import math
import pickle
from pathlib import Path

import bristle
import numpy as np
import pytest


@pytest.fixture
def edge() -> bristle.Settings:
    paper = bristle.Settings.paper(10.0, 2e-3)
    return paper.replace(
        filament={"segments": 6},
        contact={"friction_coefficient": 0.3},
        workpiece={
            "kind": "edge",
            "side": "entering",
            "edge_radius_m": 0.1e-3,
            "offset_m": -5e-3,
        },
        removal={"preston_m2_n": 2e-14, "until": {"edge_radius_m": 0.2e-3}},
    )


def test_an_edge_grows_as_the_program_says(edge: bristle.Settings, tmp_path: Path) -> None:
    shares: list[float] = []
    found = bristle.wear(edge, out=tmp_path / "out", threads=1, progress=shares.append)
    names = ["edge_work.csv", "removal.csv", "removal.html"]
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == names
    for table, name in [(found.history, "removal.csv"), (found.edge_work, "edge_work.csv")]:
        with open(tmp_path / "out" / name, newline="") as file:
            rows = list(csv.DictReader(file))
        assert list(table) == list(rows[0])
        for key in table:
            assert table[key].tolist() == [float(row[key]) for row in rows]
    assert found.history["edge_radius_m"].size == 201
    assert found.edge_radius_m == pytest.approx(0.2e-3)
    area = (1.0 - math.pi / 4.0) * (0.2e-3**2 - 0.1e-3**2)
    assert found.removed_area_m2 == pytest.approx(area)
    assert found.preston_m2_n == 2e-14 and found.life_s is None
    assert found.included_angles_rad == pytest.approx((math.pi / 2.0,))
    assert found.time_s > 0.0 and found.turns == found.history["turns"][-1]
    assert found.filament_length_m == 0.04 and found.change_when_refined < 5e-3
    assert str(found).startswith("edge of 90°: R = 0.200 mm after ")
    again = pickle.loads(pickle.dumps(found))
    assert again.history == found.history and str(again) == str(found)


def test_a_trial_takes_the_place_of_the_coefficient(edge: bristle.Settings) -> None:
    whole = bristle.wear(edge, progress=False)
    trial = {
        "observed": {"edge_radius_m": whole.edge_radius_m, "time_s": whole.time_s},
        "preston_m2_n": None,
    }
    found = bristle.wear(edge.replace(removal=trial), check=True, progress=False)
    assert whole.change_when_checked is None
    assert found.change_when_checked is not None and 0.0 < found.change_when_checked < 1e-2
    assert found.preston_m2_n == pytest.approx(2e-14, rel=1e-3)


def test_figures_show_the_radius(edge: bristle.Settings) -> None:
    pytest.importorskip("matplotlib")
    chamfer = {"kind": "chamfer", "chamfer_width_m": 1e-3}
    found = bristle.wear(
        edge.replace(workpiece=chamfer, removal={"until": {"turns": 20.0}}), progress=False
    )
    assert len(found.included_angles_rad) == 2 and "second_edge_radius_m" in found.history
    [axes] = found.plot().axes
    _, labels = axes.get_legend_handles_labels()
    assert labels == ["edge", "second edge"]


def test_what_cannot_be_followed_is_refused(edge: bristle.Settings) -> None:
    def refused(message: str, settings: bristle.Settings) -> None:
        with pytest.raises(bristle.SettingsError, match=message):
            bristle.wear(settings, progress=False)

    refused("has no edge that grows round", bristle.Settings.paper(10.0, 1e-3))
    refused("at the start", edge.replace(removal={"until": {"edge_radius_m": 0.05e-3}}))
    refused("state when to end", edge.replace(removal={"until": None}))
    refused("is never reached", edge.replace(workpiece={"offset_m": -60e-3}))


def test_radii_give_the_coefficient(edge: bristle.Settings, tmp_path: Path) -> None:
    history = bristle.wear(edge, progress=False).history
    rows = [40, 80, 120, 160, 200]
    measured = {
        "time_s": history["time_s"][rows],
        "edge_radius_m": history["edge_radius_m"][rows],
        "edge_radius_std_m": np.full(5, 2e-6),
    }
    found = bristle.calibrate(
        edge, measured, fit=["removal.preston_m2_n"], out=tmp_path / "out", progress=False
    )
    assert found["removal.preston_m2_n"] == pytest.approx(2e-14, rel=2e-3)
    assert found.square_root is not None and found.square_root["fits"]
    assert "the square root of time fits the radii" in str(found)
    removal = found.settings.removal
    assert removal is not None and removal["preston_m2_n"] == found["removal.preston_m2_n"]
    assert bristle.wear(found.settings, progress=False).edge_radius_m == pytest.approx(0.2e-3)
    assert (tmp_path / "out" / "calibrated.toml").is_file()
    [axes] = found.plot().axes
    assert axes.get_xlabel() == "time in s"
    turns = {"turns": history["turns"][rows], "edge_radius_m": measured["edge_radius_m"]}
    same = bristle.calibrate(
        edge, turns, fit=["removal.preston_m2_n"], relative_std=0.01, progress=False
    )
    assert same["removal.preston_m2_n"] == pytest.approx(2e-14, rel=2e-3)
