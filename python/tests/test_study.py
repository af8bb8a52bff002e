"""Studies: tables, grids, files, progress, and how they resume."""

import pickle
import re
import warnings
from pathlib import Path
from typing import Any

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
    runs = study.runs
    assert isinstance(runs, bristle.Table) and pickle.loads(pickle.dumps(runs)) == runs
    assert (runs.units["tool_contact_normal_force_n"], runs.units["status"]) == ("N", "")
    pandas = pytest.importorskip("pandas")
    frame = runs.to_pandas()
    assert frame.shape[0] == 12 and (frame["status"] == "ok").all()
    origin = {
        "bristle_version": bristle.__version__,
        "settings": study.settings.to_toml(),
    }
    assert frame.attrs == {"units": runs.units, **origin}
    pandas.testing.assert_frame_equal(study.to_pandas(), frame)
    pytest.importorskip("xarray")
    grid = study.to_xarray()
    assert dict(grid.sizes) == {
        "segments": 2,
        "penetration_depth_m": 2,
        "brushing_velocity_m_s": 3,
    }
    assert grid.attrs == origin
    force = grid["tool_contact_normal_force_n"]
    assert force.attrs == {"units": "N", "long_name": "contact normal force of the tool"}
    assert grid["penetration_depth_m"].attrs["units"] == "m"
    case = force.sel(segments=5, penetration_depth_m=2e-3, brushing_velocity_m_s=30.0)
    assert float(case) == study.runs["tool_contact_normal_force_n"][-1]


def test_dimensions_have_no_dots(small_brush: bristle.Settings) -> None:
    pytest.importorskip("xarray")
    sweep = {"brush.columns": [3], "contact.friction_coefficient": [0.0, 0.2]}
    grid = bristle.study(small_brush, sweep).to_xarray()
    # The metrics have columns, too.
    assert dict(grid.sizes) == {"brush_columns": 1, "friction_coefficient": 2}
    assert grid["columns"].values.tolist() == [[3, 3]]
    assert grid["friction_coefficient"].attrs["long_name"] == "coefficient of friction"
    both = {"brush.friction_coefficient": [0.1], "contact.friction_coefficient": [0.2]}
    names = {"brush_friction_coefficient": 1, "contact_friction_coefficient": 1}
    assert dict(bristle.study(small_brush, both).to_xarray().sizes) == names


def test_it_is_drawn(settings: bristle.Settings, study: bristle.Study) -> None:
    figures = pytest.importorskip("matplotlib.figure")
    (axes,) = study.plot("max_tip_deflection_m").axes
    assert axes.get_xlabel() == r"brushing velocity $v_{\mathrm{b}}$ in m/s"
    assert axes.get_ylabel() == r"largest tip deflection $s_{\mathrm{n,max}}$ in mm"
    legend = axes.get_legend()
    assert legend is not None
    named = r"number of segments n, penetration depth $a_{\mathrm{e}}$ in mm"
    assert legend.get_title().get_text() == named
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts == ["4, 1", "4, 2", "5, 1", "5, 2"]
    last = 1e3 * study.runs["max_tip_deflection_m"][-3:]
    assert axes.lines[-1].get_ydata() == pytest.approx(last)
    near = "tool_contact_normal_force_n.*`Study.runs` has them all"
    with pytest.raises(ValueError, match=near):
        study.plot("tool_normal_force")
    with pytest.raises(ValueError, match="no metric 'status'"):
        study.plot("status")

    def drawn(settings: bristle.Settings, **sweep: Any) -> Any:
        return bristle.study(settings, sweep, progress=False).plot()

    depths = np.linspace(1e-3, 2e-3, 11)
    falling = [3e-3, 2e-3, 1e-3]
    (one,) = drawn(settings, penetration_depth_m=falling).axes
    assert one.lines[0].get_xdata().tolist() == [1.0, 2.0, 3.0]
    assert one.get_legend() is None and not one.collections
    scattering = settings.replace(uncertainty={"length_std_m": 1e-3, "samples": 64})
    (banded,) = drawn(scattering, penetration_depth_m=falling).axes
    assert len(banded.collections) == 1
    tools = {name: {"filament": {"length_m": 0.04}} for name in ("a", "b $x$")}
    (named,) = drawn(scattering, penetration_depth_m=[1e-3], tools=tools).axes
    assert [label.get_text() for label in named.get_xticklabels()] == ["a", r"b \$x\$"]
    long = {"filament.segments": range(2, 14), "penetration_depth_m": depths}
    chart, bar = drawn(settings, **long).axes
    assert chart.get_ylabel() == r"penetration depth $a_{\mathrm{e}}$ in mm"
    assert bar.get_ylabel() == r"contact normal force of the tool $F_{\mathrm{n,w}}$ in N"
    with pytest.raises(ValueError, match="22 curves over segments, at most 10"):
        drawn(settings, **long, tools=tools)
    figure = figures.Figure()
    left, right = figure.subplots(1, 2)
    assert study.plot(ax=left) is figure and left.lines and not right.lines
    with pytest.raises(ValueError, match="ax needs 1 axes of matplotlib, not 2"):
        study.plot(ax=[left, right])


def test_it_advises_and_pickles(study: bristle.Study, tmp_path: Path) -> None:
    advice = study.advise(max_velocity_m_s=20.0, verify=False)
    assert advice["limits"] == {"max_velocity_m_s": 20.0}
    assert set(dict(advice)) == set(advice.keys()) and len(advice) == len(advice.values())
    assert "verified" not in advice["recommendation"]
    assert "not simulated" in str(advice)
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
    other = {"filament.segments": [6]}
    bristle.study(settings, other, out=out, progress=False)
    assert (out / "previous" / "runs.csv").read_bytes() == (whole / "runs.csv").read_bytes()


class Stopped(Exception):
    """Exception of the progress function once a case is done."""


def stop(done: int, total: int, failed: int) -> None:
    if done > 0:
        raise Stopped


def test_an_exception_carries_what_is_done(
    settings: bristle.Settings, study: bristle.Study
) -> None:
    def interrupted() -> bristle.PartialStudy:
        with pytest.raises(Stopped) as error:
            bristle.study(settings, SWEEP, threads=1, progress=stop)
        partial: bristle.PartialStudy = error.value.study  # type: ignore[attr-defined]
        done, total, failed = partial.counts
        assert 0 < done < total == 12 and failed == 0
        says = f"{done} of 12 cases are done: `study.resume()` of this exception goes on"
        assert error.value.__notes__ == [says] and partial.settings.sweep is not None
        return partial

    partial = interrupted()
    done = partial.counts[0]
    # Another call begins from nothing.
    told: list[tuple[int, int, int]] = []
    bristle.study(settings, SWEEP, progress=lambda *counts: told.append(counts))
    assert told[0] == (0, 12, 0)
    # What ends it again carries it again.
    with pytest.raises(Stopped) as error:
        partial.resume(threads=1, progress=stop)
    assert error.value.study is partial and partial.counts[0] >= done  # type: ignore[attr-defined]
    told.clear()
    resumed = partial.resume(progress=lambda *counts: told.append(counts))
    assert told[0][0] >= done and told[-1] == (12, 12, 0)
    assert resumed.runs == study.runs
    # A warning that is an exception loses nothing, either.
    with warnings.catch_warnings():
        warnings.simplefilter("error", bristle.ResultWarning)
        with pytest.raises(bristle.ResultWarning) as warning:
            bristle.study(settings, SWEEP, progress=False)
    assert warning.value.study.counts == (12, 12, 0)  # type: ignore[attr-defined]


def test_cases_are_checked(settings: bristle.Settings, tmp_path: Path) -> None:
    sweep = {"process.penetration_depth_m": [1e-3, 2e-3]}
    checked = bristle.study(settings, sweep, check=True, out=tmp_path, progress=False)
    changes = checked.runs["change_when_checked"]
    assert (changes > 0.0).all() and (changes < 0.1).all()
    again: bristle.Study = pickle.loads(pickle.dumps(checked))
    assert (again.runs["change_when_checked"] == changes).all()


def test_progress_is_told_where_there_is_no_terminal(
    settings: bristle.Settings,
    small_brush: bristle.Settings,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    sweep = {"contact.stiffness_n_m": [1e300, 1e5]}
    with pytest.warns(bristle.SettingsWarning):
        bristle.study(settings, sweep)
    assert capsys.readouterr().err == "", "it is over soon"
    monkeypatch.setattr(bristle._progress, "PAUSES_S", (0.0, 0.0))
    with pytest.warns(bristle.SettingsWarning):
        bristle.study(settings, sweep)
    lines = capsys.readouterr().err.splitlines()
    assert re.fullmatch(r"after \d+ s: 0 of 2 cases", lines[0])
    assert re.fullmatch(r"after \d+ s: 2 of 2 cases, 1 failed", lines[-1])
    # It takes longer than the time between two looks.
    brush = small_brush.replace(filament={"segments": 15}, brush={"columns": 40})
    bristle.brush(brush)
    for line in (lines := capsys.readouterr().err.splitlines()):
        assert re.fullmatch(r"after \d+ s: \d+ % of the brush(, \d+ s left)?", line)
    assert lines
    shares: list[float] = []
    bristle.brush(brush, progress=shares.append)
    assert shares == sorted(shares) and 0.0 <= shares[0] and shares[-1] <= 1.0
    shares.clear()
    turns = settings.replace(process={"turns": 20})
    bristle.simulate(turns, progress=shares.append)
    assert shares == sorted(shares) and 0.0 <= shares[0] and shares[-1] <= 1.0

    def refuse(share: float) -> None:
        raise Stopped

    with pytest.raises(Stopped):
        bristle.simulate(turns, progress=refuse)
    with pytest.raises(Stopped):
        bristle.brush(brush, progress=refuse)


def test_progress_on_a_terminal_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    times = iter([0.0, 0.5, 2.0, 2.1, 4.0, 200.0, 200.1])
    monkeypatch.setattr("time.monotonic", lambda: next(times))
    with bristle._progress.of_cases(True) as tell:
        assert tell is not None
        for done in (0, 1, 2, 3, 4, 8):
            tell(done, 8, 1)
    shown = capsys.readouterr().err
    texts = [text.rstrip() for text in shown.split("\r")]
    assert texts == [
        "",
        "1 of 8 cases, 15 s left, 1 failed",
        "3 of 8 cases, 7 s left, 1 failed",
        "4 of 8 cases, 3 min 21 s left, 1 failed",
        "8 of 8 cases, 1 failed",
    ]
    assert shown.endswith("\n")


def test_a_tool_of_arrays_is_in_all_cases(settings: bristle.Settings) -> None:
    sweep = {
        "process.penetration_depth_m": [1e-3, 0.03],
        "process.brushing_velocity_m_s": [10.0, 20.0],
    }
    tool = bristle.Tool.rotating(settings, lambda t: 1.0 - 0.3 * np.sin(2.0 * np.pi * t))
    with pytest.warns(bristle.SettingsWarning):
        study = bristle.study(settings, sweep, tool=tool, progress=False)
    deeper = settings.replace(
        process={"penetration_depth_m": 1e-3, "brushing_velocity_m_s": 20.0}
    )
    alone = bristle.simulate(deeper, tool=tool).metrics
    for key, value in alone.items():
        # The depth is given, and the workpiece has no edge.
        if isinstance(value, float) and key != "force_stiffness_n_m" and "edge_" not in key:
            assert study.runs[key][1] == value, key
    again: bristle.Study = pickle.loads(pickle.dumps(study))
    assert again.tool == study.tool == tool and again.runs == study.runs
    assert again.plot().axes
    frame = study.runs.to_pandas()
    assert frame.attrs["tool"] == "<Tool: 1024 samples of a turn>"
    for call in (study.advise, lambda: study.report("page.html")):
        with pytest.raises(ValueError, match="for round tools"):
            call()
    with pytest.raises(ValueError, match="leave out `out`"):
        bristle.study(settings, sweep, tool=tool, out="results")
    refused: list[tuple[Any, str]] = [
        ({"filament.lateral_tilt_rad": [0.0, 0.1]}, "lateral_tilt_rad.*of each"),
        ({"process.rotational_speed_rpm": [500.0]}, "brushing_velocity_m_s"),
        ({"brush.rows": [1]}, r"\[brush\]"),
    ]
    for swept, says in refused:
        with pytest.raises(bristle.SettingsError, match=says):
            bristle.study(settings, swept, tool=tool, progress=False)


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


def test_sweeps_take_the_place_of_those_that_are_stated(settings: bristle.Settings) -> None:
    sweep = {"brushing_velocity_m_s": [10.0], "penetration_depth_m": [1e-3]}
    # Without [process], these settings are complete only with their sweeps.
    stated = settings.replace(study=sweep).replace(process=None)
    other = {"penetration_depth_m": (2e-3,), "brushing_velocity_m_s": (20.0, 30.0)}
    study = bristle.study(stated, other, progress=False)
    assert list((study.settings.sweep or {}).items()) == list(other.items())


def test_what_is_swept_is_checked(settings: bristle.Settings) -> None:
    with pytest.raises(bristle.SettingsError) as error:
        bristle.study(settings, {"filament.segmnts": [3]}, progress=False)
    assert error.value.key == "study.filament.segmnts"
    with pytest.raises(bristle.SettingsError, match=r"sweeps at least one"):
        bristle.study(settings, progress=False)
