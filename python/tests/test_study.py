"""Studies: tables, grids, files, progress, and how they resume."""

import pickle
from pathlib import Path

import bristle
import numpy as np
import pytest

SWEEP = {
    "process.penetration_depth_m": np.array([1e-3, 2e-3]),
    "process.brushing_velocity_m_s": {"start": 10.0, "stop": 30.0, "step": 10.0},
    "filament.segments": [4, 5],
}


@pytest.fixture
def study(settings: bristle.Settings) -> bristle.Study:
    return bristle.study(settings, SWEEP, progress=False)


def test_cases_are_those_of_single_contacts(
    settings: bristle.Settings, study: bristle.Study
) -> None:
    assert len(study) == 12 and study.failures == 0
    assert study.runs["segments"].tolist() == 6 * [4] + 6 * [5]
    assert not any(column.flags.writeable for column in study.runs.values())
    assert study.runs["brushing_velocity_m_s"][:3].tolist() == [10.0, 20.0, 30.0]
    process = {"brushing_velocity_m_s": 30.0, "penetration_depth_m": 2e-3}
    last = settings.replace(process=process, filament={"segments": 5})
    alone = bristle.simulate(last, samples=0, shapes=0).metrics
    impulse = study.runs["contact_normal_impulse_n_s"][-1]
    assert impulse == alone["contact_normal_impulse_n_s"]


def test_it_becomes_a_table_and_a_grid(study: bristle.Study) -> None:
    pytest.importorskip("pandas")
    frame = study.to_pandas()
    assert frame.shape[0] == 12 and (frame["status"] == "ok").all()
    assert frame.attrs["units"]["tool_contact_normal_force_n"] == "N"
    pytest.importorskip("xarray")
    grid = study.to_xarray()
    assert dict(grid.sizes) == {
        "segments": 2,
        "penetration_depth_m": 2,
        "brushing_velocity_m_s": 3,
    }
    force = grid["tool_contact_normal_force_n"]
    assert force.attrs == {"units": "N", "long_name": "contact normal force of the tool"}
    assert grid["penetration_depth_m"].attrs["units"] == "m"
    case = force.sel(segments=5, penetration_depth_m=2e-3, brushing_velocity_m_s=30.0)
    assert float(case) == study.runs["tool_contact_normal_force_n"][-1]


def test_it_advises_and_pickles(study: bristle.Study, tmp_path: Path) -> None:
    advice = study.advise(max_velocity_m_s=20.0)
    assert advice.values["limits"] == {"max_velocity_m_s": 20.0}
    assert "F_n,w" in str(advice)
    with pytest.raises(ValueError, match="contact time ratio"):
        study.advise(min_ratio=0.8, max_ratio=0.2)
    again: bristle.Study = pickle.loads(pickle.dumps(study))
    assert again.settings == study.settings
    assert all((again.runs[key] == study.runs[key]).all() for key in study.runs)
    study.report(tmp_path / "one.html")
    again.report(tmp_path / "two.html")
    assert (tmp_path / "one.html").read_bytes() == (tmp_path / "two.html").read_bytes()


def test_failed_cases_have_no_numbers(settings: bristle.Settings) -> None:
    sweep = {"contact.stiffness_n_m": [1e300, 1e5]}
    with pytest.warns(bristle.SettingsWarning):
        study = bristle.study(settings, sweep, progress=False)
    assert study.failures == 1
    assert np.isnan(study.runs["contact_time_s"][0])
    assert np.isfinite(study.runs["contact_time_s"][1])
    assert study.runs["status"][0] != "ok" and study.runs["status"][1] == "ok"


def test_it_resumes_from_its_journal(
    settings: bristle.Settings, study: bristle.Study, tmp_path: Path
) -> None:
    class Stopped(Exception):
        pass

    def stop(done: int, total: int, failed: int) -> None:
        if done > 0:
            raise Stopped

    out, whole = tmp_path / "out", tmp_path / "whole"
    with pytest.raises(Stopped):
        bristle.study(settings, SWEEP, threads=1, out=out, progress=stop)
    told = []
    resumed = bristle.study(
        settings, SWEEP, out=out, progress=lambda *counts: told.append(counts)
    )
    assert told[0][0] > 0 and told[-1] == (12, 12, 0)
    assert resumed.runs["contact_time_s"].tolist() == (
        study.runs["contact_time_s"].tolist()
    )
    bristle.study(settings, SWEEP, out=whole, progress=False)
    for name in ("runs.csv", "study.json", "report.html"):
        assert (out / name).read_bytes() == (whole / name).read_bytes(), name
    with pytest.raises(bristle.SettingsError, match="cannot resume"):
        bristle.study(settings, {"filament.segments": [6]}, out=out, progress=False)
    other = {"filament.segments": [6]}
    bristle.study(settings, other, out=out, restart=True, progress=False)


def test_tools_are_compared(settings: bristle.Settings) -> None:
    pytest.importorskip("xarray")
    sweep = {
        "process.penetration_depth_m": [1e-3, 2e-3],
        "tools": {
            "short": {"filament": {"length_m": 0.035}},
            "long": {"filament": {"length_m": 0.04}},
        },
    }
    study = bristle.study(settings, sweep, progress=False)
    assert study.runs["tool"].tolist() == ["short", "short", "long", "long"]
    force = study.to_xarray()["tool_contact_normal_force_n"]
    assert force.sel(tool="short").shape == (2,)


def test_what_is_swept_is_checked(settings: bristle.Settings) -> None:
    with pytest.raises(bristle.SettingsError) as error:
        bristle.study(settings, {"filament.segmnts": [3]}, progress=False)
    assert error.value.key == "study.filament.segmnts"
    with pytest.raises(bristle.SettingsError, match=r"sweeps at least one"):
        bristle.study(settings, progress=False)
