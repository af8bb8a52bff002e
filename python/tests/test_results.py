"""Contacts and brushes: their numbers, their arrays, and how they are shown."""

import json
import pickle
import sys
import threading
import warnings
from pathlib import Path
from typing import Any, get_type_hints

import bristle
import numpy as np
import pytest


def test_a_contact_has_the_metrics_of_the_program(settings: bristle.Settings) -> None:
    contact = bristle.simulate(settings)
    metrics = contact.metrics
    assert list(metrics) == [*_speeds(), *list(metrics)[2:]]
    assert set(metrics) == bristle.Metrics.__required_keys__
    assert metrics["rotational_speed_rpm"] == pytest.approx(530.5, abs=0.1)
    assert metrics["turn_contact_normal_impulses_n_s"] == (
        metrics["contact_normal_impulse_n_s"],
    )
    assert set(contact.statistics) == set(get_type_hints(bristle.Statistics))
    assert contact.statistics["steps"] == metrics["steps"]


def _speeds() -> list[str]:
    return ["brushing_velocity_m_s", "rotational_speed_rpm"]


def test_arrays_have_names_units_and_shapes(settings: bristle.Settings) -> None:
    contact = bristle.simulate(settings, shapes=7)
    history = contact.history
    assert all(column.shape == (100,) for column in history.values())
    assert history.units["contact_normal_force_n"] == "N"
    assert history["time_s"][0] == 0.0
    impulse = contact.metrics["contact_normal_impulse_n_s"]
    assert history["contact_normal_impulse_n_s"][-1] == pytest.approx(impulse)
    times, nodes = contact.shapes
    assert times.shape == (7,) and nodes is contact.shapes.nodes
    assert contact.shapes.nodes.shape == (7, 11, 3)
    lengths = np.linalg.norm(np.diff(contact.shapes.nodes, axis=1), axis=2)
    assert np.allclose(lengths, 0.004, rtol=1e-2)
    profile = contact.profile
    per_cell = profile["normal_impulse_n_s_m"] * profile["length_m"]
    assert per_cell.sum() == pytest.approx(impulse)
    assert profile["on_edge"].dtype == np.int64
    with pytest.raises(ValueError):
        history["time_s"][0] = 1.0
    assert contact.history is history


def test_without_samples_there_are_none(settings: bristle.Settings) -> None:
    contact = bristle.simulate(settings, samples=0, shapes=0)
    assert contact.history["time_s"].size == 0
    assert contact.shapes.nodes.shape == (0, 11, 3)
    assert contact._repr_html_() == bristle.simulate(settings, samples=0)._repr_html_()


def test_a_contact_is_shown(settings: bristle.Settings) -> None:
    contact = bristle.simulate(settings)
    page = contact._repr_html_()
    assert page is not None
    assert page.startswith("<iframe srcdoc=") and "&quot;courses&quot;" in page
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    assert len(contact.plot().axes) == 3
    pandas = pytest.importorskip("pandas")
    frame = contact.history.to_pandas()
    assert isinstance(frame, pandas.DataFrame) and frame.shape == (100, 13)
    assert frame.attrs["units"]["time_s"] == "s"
    assert frame.attrs["settings"] == settings.to_toml()


def test_results_pickle(settings: bristle.Settings) -> None:
    contact = bristle.simulate(settings, shapes=5)
    again: bristle.Contact = pickle.loads(pickle.dumps(contact))
    assert again.settings == settings
    assert again.metrics == contact.metrics
    assert again.statistics == contact.statistics
    assert again.history == contact.history and again.profile == contact.profile
    assert (again.shapes.nodes == contact.shapes.nodes).all()
    assert again._repr_html_() == contact._repr_html_()
    table = pickle.loads(pickle.dumps(contact.history))
    assert not table["time_s"].flags.writeable
    assert table != contact.profile
    deeper = settings.replace(process={"penetration_depth_m": 2e-3})
    assert bristle.simulate(deeper).history != contact.history


def test_threads_of_python_simulate_at_once(settings: bristle.Settings) -> None:
    depths = [0.5e-3, 1e-3, 1.5e-3, 2e-3]
    cases = [settings.replace(process={"penetration_depth_m": a}) for a in depths]
    alone = [bristle.simulate(case).metrics for case in cases]
    together: list[bristle.Metrics | None] = [None] * len(cases)

    def simulate(index: int) -> None:
        together[index] = bristle.simulate(cases[index]).metrics

    threads = [threading.Thread(target=simulate, args=(i,)) for i in range(len(cases))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert together == alone


def test_results_that_are_not_what_they_seem_draw_a_warning(
    settings: bristle.Settings,
) -> None:
    with pytest.warns(bristle.ResultWarning, match="filaments touch each other"):
        bristle.simulate(settings)
    few = {"filament_count": 1000, "filament_count_uncertainty": 0}
    sparse = settings.replace(tool=few)
    fast = sparse.replace(process={"brushing_velocity_m_s": 30.0})
    vibrates = "of its vibration.*\n.*turns = .steady."
    with pytest.warns(bristle.ResultWarning, match=vibrates):
        bristle.simulate(fast)
    sweep = {"process.penetration_depth_m": [1e-3]}
    with pytest.warns(bristle.ResultWarning, match=vibrates):
        bristle.study(fast, sweep, progress=False)
    [found] = [each for each in bristle.simulate(fast).findings if each["id"] == "B008"]
    assert found["quantity"] == "process.turns" and found["value"] > found["limit"] == 0.05
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bristle.simulate(sparse.replace(contact={"stiffness_n_m": 1e6}))


def test_errors_of_a_simulation_have_time_and_step(settings: bristle.Settings) -> None:
    hard = settings.replace(contact={"stiffness_n_m": 1e300})
    with (
        pytest.warns(bristle.SettingsWarning),
        pytest.raises(bristle.SimulationError) as error,
    ):
        bristle.simulate(hard)
    assert error.value.time_s is not None and error.value.time_s > 0.0
    assert str(error.value).startswith("the simulation failed: ")
    again = pickle.loads(pickle.dumps(error.value))
    assert (again.time_s, again.step) == (error.value.time_s, error.value.step)


def test_a_brush_has_metrics_and_tables(small_brush: bristle.Settings) -> None:
    brush = bristle.brush(small_brush, frames=4)
    assert set(brush.metrics) == bristle.BrushMetrics.__required_keys__
    assert (brush.metrics["columns"], brush.metrics["rows"]) == (3, 1)
    assert brush.filaments["column"].tolist() == [0, 1, 2]
    impulses = brush.filaments["contact_normal_impulse_n_s"]
    assert impulses[0] > impulses[2]
    assert brush.history["contact_normal_force_n"].max() > 0.0
    assert brush.history.units["contact_moment_n_m"] == "N m"
    assert set(brush.contacts) >= {"column", "other_column", "impulse_n_s"}
    assert brush.frames.nodes.shape[1:] == (3, 6, 3)
    assert brush.frames.nodes.shape[0] == brush.frames.times.size > 0
    assert brush._repr_html_().startswith("<iframe")
    again: bristle.Brush = pickle.loads(pickle.dumps(brush))
    assert again.metrics == brush.metrics
    assert (again.frames.nodes == brush.frames.nodes).all()


def test_a_brush_needs_its_section(settings: bristle.Settings) -> None:
    with pytest.raises(bristle.SettingsError, match=r"\[brush\]"):
        bristle.brush(settings)


def test_a_tool_of_arrays_is_that_of_the_settings(settings: bristle.Settings) -> None:
    angle = 2.0 * np.pi * np.arange(30) / 30
    radial = np.stack([np.cos(angle), np.sin(angle), np.zeros(30)], axis=1)
    tool = bristle.Tool(position_m=0.14 * radial, direction=2.0 * radial)
    contact = bristle.simulate(settings, tool=tool)
    round_one = bristle.simulate(settings).metrics["contact_normal_impulse_n_s"]
    impulse = contact.metrics["contact_normal_impulse_n_s"]
    # To the tolerance: rounding differs, and the filament bounces.
    assert impulse == pytest.approx(round_one, rel=1e-4)
    assert contact.tool is tool and contact._repr_html_() is None
    again: bristle.Contact = pickle.loads(pickle.dumps(contact))
    assert again.tool is not None
    assert (again.tool.position_m == tool.position_m).all()
    # Trailing filaments press less.
    turned = np.stack([np.cos(angle - 0.2), np.sin(angle - 0.2), 0 * angle], axis=1)
    trailing = bristle.simulate(settings, tool=bristle.Tool(0.14 * radial, turned))
    assert trailing.metrics["contact_normal_impulse_n_s"] != pytest.approx(impulse)


@pytest.mark.parametrize("count", [8, 9])
def test_a_tool_turns_at_a_speed_that_varies(
    settings: bristle.Settings, count: int
) -> None:
    def speed(times: np.typing.ArrayLike) -> Any:
        return 1.0 - 0.2 * np.sin(2.0 * np.pi * np.asarray(times))

    tool = bristle.Tool.rotating(settings, 500.0 * speed(np.arange(count) / count))
    x, y, z = tool.position_m.T
    angle = np.unwrap(np.arctan2(y, x))
    times = np.arange(angle.size) / angle.size
    turned = 2.0 * np.pi * times + 0.2 * (np.cos(2.0 * np.pi * times) - 1.0)
    assert np.allclose(angle, turned, rtol=0.0, atol=1e-12) and not z.any()
    # It is faster where the filament touches.
    varied, faster, slower = (
        bristle.simulate(settings.replace(process={"brushing_velocity_m_s": v}), tool=t)
        for v, t in ((10.0, tool), (12.0, None), (10.0, None))
    )
    impulses = [c.metrics["contact_normal_impulse_n_s"] for c in (varied, faster, slower)]
    assert impulses[0] == pytest.approx(impulses[1], rel=0.01)
    assert impulses[0] != pytest.approx(impulses[2], rel=0.03)
    assert varied.metrics["rotational_speed_rpm"] == pytest.approx(
        slower.metrics["rotational_speed_rpm"]
    )
    by_function = bristle.Tool.rotating(settings, speed)
    assert by_function == bristle.Tool.rotating(settings, speed) != tool
    assert len({by_function, tool}) == 2
    tilted = bristle.Tool.rotating(settings.replace(filament={"lateral_tilt_rad": 0.1}), speed)
    assert np.allclose(tilted.direction[:, 2], np.sin(0.1))


def test_one_speed_is_that_of_the_whole_turn(settings: bristle.Settings) -> None:
    tool = bristle.Tool.rotating(settings, lambda times: 1.0)
    assert tool == bristle.Tool.rotating(settings, lambda times: np.ones_like(times))


def test_the_angle_of_the_body_is_that_of_the_clamp(settings: bristle.Settings) -> None:
    turns = settings.replace(process={"turns": 3})
    even = bristle.Tool.rotating(turns, lambda times: 1.0)
    swinging = bristle.Tool.rotating(turns, lambda t: 1.0 - 0.2 * np.sin(2.0 * np.pi * t))
    phase = bristle.simulate(turns).history["base_angle_rad"]
    contact = bristle.simulate(turns, tool=swinging, samples=301, shapes=301)
    time, angle = (contact.history[key] for key in ("time_s", "base_angle_rad"))
    of_even = bristle.simulate(turns, tool=even).history["base_angle_rad"]
    assert np.allclose(of_even, phase, rtol=0.0, atol=1e-9)
    x, y = contact.shapes.nodes[:, 0, :2].T
    assert np.allclose(x + 1j * y, 0.14 * np.exp(1j * angle), rtol=0.0, atol=1e-12)
    # Unwrapped, it changes as fast as the speed says.
    rates = np.gradient(angle, time) / (10.0 / 0.18)
    assert rates.min() == pytest.approx(0.8, rel=0.01)
    assert rates.max() == pytest.approx(1.2, rel=0.01)


def test_contacts_and_brushes_go_to_files(
    settings: bristle.Settings, small_brush: bristle.Settings, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    contact = bristle.simulate(settings, out=out, check=True, threads=1)
    names = ["case.json", "check.json", "history.csv", "metrics.json", "profile.csv", "shapes.csv"]
    assert sorted(file.name for file in out.iterdir() if file.suffix != ".parquet") == names
    assert json.loads((out / "metrics.json").read_text()) == json.loads(
        json.dumps(dict(contact.metrics))
    )
    checked = json.loads((out / "check.json").read_text())["metrics"]
    assert contact.checked is not None
    force = contact.checked["metrics"]["contact_normal_impulse_n_s"]
    assert dict(force) == checked["contact_normal_impulse_n_s"]
    assert 0.0 < force["relative_change"] < 1e-2
    plain = bristle.simulate(settings)
    assert plain.checked is None and plain.metrics == contact.metrics
    assert (plain.shapes.nodes == contact.shapes.nodes).all()
    again: bristle.Contact = pickle.loads(pickle.dumps(contact))
    assert again.checked == contact.checked
    with pytest.raises(ValueError, match="leave out `out`"):
        tool = bristle.Tool.rotating(settings, lambda times: 1.0)
        bristle.simulate(settings, tool=tool, out=out)
    # A brush takes the place of a contact.
    brush = bristle.brush(small_brush, out=out, check=True, progress=False)
    names = ["brush.html", "brush.json", "check.json", "contacts.csv"]
    names += ["filaments.csv", "history.csv", "metrics.json"]
    assert sorted(file.name for file in out.iterdir()) == names
    assert brush.checked is not None
    assert brush.checked["repeated"] == "quarter of the tolerance"
    assert pickle.loads(pickle.dumps(brush)).checked == brush.checked


def test_a_brush_goes_on_from_its_checkpoint(
    small_brush: bristle.Settings, tmp_path: Path
) -> None:
    long = small_brush.replace(filament={"segments": 15}, brush={"columns": 30})

    class Stopped(Exception):
        """Exception of the progress function."""

    def stop(share: float) -> None:
        if share > 0.1:
            raise Stopped

    def interrupt() -> None:
        with pytest.raises(Stopped):
            bristle.brush(long, out=tmp_path, progress=stop)
        assert (tmp_path / "checkpoint.bin").is_file()

    def first_share(**options: Any) -> float:
        shares: list[float] = []
        bristle.brush(long, out=tmp_path, progress=shares.append, **options)
        assert not (tmp_path / "checkpoint.bin").exists()
        return shares[0]

    interrupt()
    assert first_share() > 0.1
    metrics = (tmp_path / "metrics.json").read_bytes()
    interrupt()
    assert first_share(restart=True) < 0.1
    assert (tmp_path / "metrics.json").read_bytes() == metrics


def test_figures_show_themselves_without_pyplot(
    settings: bristle.Settings, small_brush: bristle.Settings
) -> None:
    figures = pytest.importorskip("matplotlib.figure")
    contact, brush = bristle.simulate(settings), bristle.brush(small_brush, progress=False)
    for drawn, count in ((contact, 3), (brush, 2)):
        figure: Any = drawn.plot()
        assert figure._repr_png_().startswith(b"\x89PNG") and len(figure.axes) == count
        own = figures.Figure()
        assert drawn.plot(ax=own.subplots(count)) is own
        assert all(axes.lines for axes in own.axes)
    force, scene = brush.plot(time_s=0.0).axes
    assert len(scene.lines) == 3
    legend: Any = force.get_legend()
    assert legend.get_bbox_to_anchor().x0 >= force.bbox.x1, "beside the curves"
    with pytest.raises(ValueError, match="no frames"):
        bristle.brush(small_brush, frames=0, progress=False).plot()
    assert "matplotlib.pyplot" not in sys.modules


def test_speeds_of_a_tool_are_checked(settings: bristle.Settings) -> None:
    wrong: list[tuple[Any, str]] = [
        ([1.0, 2.0], "from 3 to 2500"),
        (np.ones((3, 3)), "from 3 to 2500"),
        (lambda times: [1.0, 1.0], "from 3 to 2500"),
        ([1.0, 2.0, np.nan], "positive and finite"),
        # The series between the values is negative.
        ([1.0, 1.0, 1e-3, 1e-3, 1.0, 1.0], "positive and finite"),
    ]
    for speed, says in wrong:
        with pytest.raises(ValueError, match=says):
            bristle.Tool.rotating(settings, speed)


def test_a_tool_of_arrays_is_checked(settings: bristle.Settings) -> None:
    ones = np.ones((8, 3))
    with pytest.raises(ValueError, match=r"\(k, 3\)"):
        bristle.Tool(ones, ones[:7])
    with pytest.raises(ValueError, match="zero"):
        bristle.Tool(ones, 0.0 * ones)
    with pytest.raises(bristle.SettingsError, match="never touch"):
        bristle.simulate(settings, tool=bristle.Tool(0.01 * ones, ones))
