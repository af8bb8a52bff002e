"""Settings from measured forces."""

import json
import math
from pathlib import Path

import bristle
import numpy as np
import pytest

KEYS = ["filament.youngs_modulus_pa", "contact.friction_coefficient"]


def _brush(modulus: float, friction: float) -> bristle.Settings:
    return bristle.Settings.paper(10.0, 1e-3).replace(
        filament={"segments": 5, "youngs_modulus_pa": modulus},
        contact={"friction_coefficient": friction},
    )


@pytest.fixture(scope="module")
def measured() -> dict[str, np.ndarray]:
    sweep = {
        "process.brushing_velocity_m_s": [5.0, 15.0, 30.0],
        "process.penetration_depth_m": [1e-3, 2e-3],
    }
    runs = bristle.study(_brush(2.2e9, 0.25), sweep, progress=False).runs
    names = ["brushing_velocity_m_s", "penetration_depth_m", "tool_torque_n_m"]
    columns = {name: np.array(runs[name]) for name in names}
    columns["force_n"] = np.array(runs["tool_contact_normal_force_n"])
    columns["torque_n_m"] = columns.pop("tool_torque_n_m")
    columns["torque_n_m"][0] = math.nan
    return columns


def test_exact_forces_give_the_settings(
    measured: dict[str, np.ndarray], tmp_path: Path
) -> None:
    shares: list[float] = []
    found = bristle.calibrate(
        _brush(3e9, 0.1),
        measured,
        fit=KEYS,
        relative_std=0.03,
        out=tmp_path / "out",
        progress=shares.append,
    )
    names = ["calibrated.toml", "calibration.html", "calibration.json", "residuals.csv"]
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == names
    loaded = bristle.load(tmp_path / "out" / "calibrated.toml")
    assert loaded.filament["youngs_modulus_pa"] == pytest.approx(2.2e9, rel=1e-2)
    assert json.loads((tmp_path / "out" / "calibration.json").read_text()) == found.record
    values = dict(found)
    assert list(found.keys()) == KEYS and list(found.values()) == [values[key] for key in KEYS]
    assert values[KEYS[0]] == pytest.approx(2.2e9, rel=1e-3)
    assert values[KEYS[1]] == pytest.approx(0.25, rel=1e-3)
    assert found.undetermined == [] and found.chi_squared < 1e-2
    assert [each["id"] for each in found.findings] == ["B015"], "the filaments are packed"
    assert found.residuals["residual"].size == 11
    errors = [found.standard_errors[key] for key in KEYS]
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(errors)
    assert found.correlations[0, 0] == 1.0
    assert len(found.next_measurement) == 3
    assert str(found).startswith("E = 2.2")
    low, high = found.intervals_95[KEYS[0]] or (0.0, 0.0)
    assert low < 2.2e9 < high
    settings = found.settings
    assert settings.filament["youngs_modulus_pa"] == values[KEYS[0]]
    runs = bristle.study(settings, {"process.penetration_depth_m": [1e-3]}, progress=False).runs
    lower, upper = runs["tool_force_lower_95_n"][0], runs["tool_force_upper_95_n"][0]
    assert lower < runs["tool_contact_normal_force_n"][0] < upper


def test_columns_are_those_that_the_program_reads(measured: dict[str, np.ndarray]) -> None:
    """A heading with another unit counts, one of nothing measured does not."""

    def fitted(columns: dict[str, object], settings: bristle.Settings) -> bristle.Calibration:
        key = KEYS[:1]
        return bristle.calibrate(settings, columns, fit=key, relative_std=0.03, progress=False)

    plain = fitted(dict(measured), _brush(3e9, 0.25))
    columns: dict[str, object] = dict(measured)
    columns["penetration_depth_mm"] = 1e3 * measured["penetration_depth_m"]
    del columns["penetration_depth_m"], columns["torque_n_m"]
    columns["force_kn"] = 1e-3 * np.asarray(columns.pop("force_n"))
    columns["operator"] = ["somebody"] * 6
    force = fitted({**measured, "torque_n_m": np.full(6, np.nan)}, _brush(3e9, 0.25))
    found = fitted(columns, _brush(3e9, 0.25))
    assert found[KEYS[0]] == pytest.approx(force[KEYS[0]], rel=1e-6)
    assert found[KEYS[0]] != plain[KEYS[0]]
    # Headings of a laboratory, which the settings name.
    named = _brush(3e9, 0.25).replace(
        measured={
            "file": "forces.csv",
            "columns": {
                "penetration_depth_m": "ae [mm]",
                "force_n": {"column": "Fz", "unit": "kN"},
            },
        }
    )
    columns["ae [mm]"] = columns.pop("penetration_depth_mm")
    columns["Fz"] = columns.pop("force_kn")
    assert fitted(columns, named)[KEYS[0]] == found[KEYS[0]]
    with pytest.raises(bristle.SettingsError, match="no column `penetration_depth_m`"):
        fitted(columns, _brush(3e9, 0.25))


def test_what_was_fitted_is_checked(measured: dict[str, np.ndarray]) -> None:
    found = bristle.calibrate(
        _brush(3e9, 0.25), measured, fit=KEYS[:1], relative_std=0.03, check=True, progress=False
    )
    assert found.change_when_checked is not None and 0.0 < found.change_when_checked < 1e-2


def test_what_is_not_determined_has_no_value() -> None:
    """Slow filaments sweep: modulus and number of filaments scale all forces alike."""
    slow = {
        "brushing_velocity_m_s": [1.5, 1.5, 2.0, 2.0],
        "penetration_depth_m": [2e-3, 3e-3, 2e-3, 3e-3],
    }
    slow["force_n"] = [
        bristle.simulate(
            _brush(2.2e9, 0.0).replace(
                process={"brushing_velocity_m_s": velocity, "penetration_depth_m": depth}
            )
        ).metrics["tool_contact_normal_force_n"]
        for velocity, depth in zip(*slow.values(), strict=True)
    ]
    fit = {"filament.youngs_modulus_pa": (1e9, 1e10), "tool.filament_count": (5e3, 2e4)}
    found = bristle.calibrate(
        _brush(2.2e9, 0.0), slow, fit=fit, relative_std=0.03, progress=False
    )
    assert dict(found) == dict.fromkeys(fit)
    assert "only" in found.undetermined[0]
    with pytest.raises(ValueError, match="only"):
        _ = found.settings


def test_what_cannot_be_calibrated_is_refused(measured: dict[str, np.ndarray]) -> None:
    def refused(message: str, columns: dict[str, object], fit: list[str]) -> None:
        with pytest.raises(bristle.SettingsError, match=message):
            bristle.calibrate(_brush(3e9, 0.1), columns, fit=fit, progress=False)

    refused("there is no column", {"force_n": [1.0]}, KEYS)
    refused("state what is to be fitted", dict(measured), [])
    refused("is no scalar setting", dict(measured), ["filament.modulus"])
    with pytest.raises(ValueError, match="different lengths"):
        bristle.calibrate(
            _brush(3e9, 0.1), {**measured, "force_n": [1.0]}, fit=KEYS, progress=False
        )
