"""Settings: stated, checked, compared, written and read."""

import pickle
from pathlib import Path

import bristle
import numpy as np
import pytest

TOOL = {"body_radius_m": 0.14, "width_m": 0.02, "filament_count": 10_500}
FILAMENT = {"length_m": 0.04, "diameter_m": 1.18e-3}
PROCESS = {"brushing_velocity_m_s": 10.0, "penetration_depth_m": 1e-3}


def test_what_is_left_out_has_its_default() -> None:
    settings = bristle.Settings(tool=TOOL, filament=FILAMENT, process=PROCESS)
    assert settings.filament["segments"] == 25
    assert settings.workpiece["normal"] == (0.0, 1.0, 0.0)
    assert settings.brush is None and settings.sweep is None
    stated = settings.replace(filament={"segments": 25}, contact={"exponent": 1.0})
    assert stated == settings and hash(stated) == hash(settings)
    assert settings.replace(filament={"segments": 24}) != settings
    assert settings.replace(filament={"segments": 24}).replace(
        filament={"segments": None}
    ) == settings


def test_they_cannot_be_changed(settings: bristle.Settings) -> None:
    with pytest.raises(AttributeError):
        settings.tool = {}  # type: ignore[misc]
    with pytest.raises(TypeError):
        settings.tool["width_m"] = 1.0  # type: ignore[index]


def test_they_go_to_a_file_and_back(tmp_path: Path, settings: bristle.Settings) -> None:
    path = tmp_path / "brush.toml"
    path.write_text(settings.to_toml(), encoding="utf-8")
    assert bristle.load(path) == settings
    assert pickle.loads(pickle.dumps(settings)) == settings
    assert eval(repr(settings), {"Settings": bristle.Settings}) == settings


def test_errors_name_key_and_line(tmp_path: Path, settings: bristle.Settings) -> None:
    path = tmp_path / "brush.toml"
    path.write_text("[tool]\nwidth_m = 0.02\nbody_radius = 0.1\n", encoding="utf-8")
    with pytest.raises(bristle.SettingsError) as error:
        bristle.load(path)
    assert (error.value.key, error.value.line) == ("tool.body_radius", 3)
    assert "did you mean `tool.body_radius_m`?" in str(error.value)
    again = pickle.loads(pickle.dumps(error.value))
    assert (str(again), again.line) == (str(error.value), 3)
    with pytest.raises(bristle.SettingsError) as error:
        settings.replace(process={"penetration_depth_m": -1.0})
    assert error.value.key == "process.penetration_depth_m"
    with pytest.raises(bristle.SettingsError, match="missing"):
        bristle.Settings(tool=TOOL, filament=FILAMENT)
    with pytest.raises(TypeError, match="section"):
        settings.replace(filaments={})
    with pytest.raises(FileNotFoundError):
        bristle.load(tmp_path / "none.toml")


def test_sweeps_may_state_velocity_and_depth(tmp_path: Path) -> None:
    sweep = {"brushing_velocity_m_s": [5.0, 10.0], "penetration_depth_m": [1e-3]}
    settings = bristle.Settings(tool=TOOL, filament=FILAMENT, study=sweep)
    assert settings.sweep == {
        "brushing_velocity_m_s": (5.0, 10.0),
        "penetration_depth_m": (1e-3,),
    }
    with pytest.raises(bristle.SettingsError, match="missing"):
        bristle.simulate(settings)


def test_a_workpiece_is_an_array_or_a_file(
    tmp_path: Path, settings: bristle.Settings
) -> None:
    x = np.linspace(-0.06, 0.06, 7)
    points = np.stack([x, np.where(x == 0.0, 5e-4, 0.0)], axis=1)
    piece = settings.replace(
        workpiece={"kind": "profile", "control_points_m": points},
        solver={"samples": 10},
    )
    rows = "".join(f"{point[0]!r},{point[1]!r}\n" for point in points.tolist())
    (tmp_path / "points.csv").write_text("x_m,y_m\n" + rows, encoding="utf-8")
    text = settings.replace(workpiece=None, solver={"samples": 10}).to_toml()
    text += '[workpiece]\nkind = "profile"\ncontrol_points_csv = "points.csv"\n'
    (tmp_path / "piece.toml").write_text(text, encoding="utf-8")
    assert bristle.load(tmp_path / "piece.toml") == piece
    assert bristle.simulate(piece).metrics["contact_normal_impulse_n_s"] > 0.0


def test_unusual_settings_are_warned_of(settings: bristle.Settings) -> None:
    with pytest.warns(bristle.SettingsWarning, match="filament"):
        bristle.simulate(settings.replace(filament={"diameter_m": 8e-3}))
