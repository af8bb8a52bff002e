"""Arguments that no user means to pass are refused at once, by their names."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import bristle
import numpy as np
import pytest

PROFILE = {
    "kind": "profile",
    "control_points_m": [[-0.1, 0.0], [-0.05, 0.0], [0.05, 0.0], [0.1, 0.0]],
}


def refused(settings: bristle.Settings, **sections: Any) -> bristle.SettingsError:
    with pytest.raises(bristle.SettingsError) as error:
        settings.replace(**sections)
    return error.value


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((5_000_000, 2)),
        np.broadcast_to(np.zeros(2), (10**9, 2)),
        [(0.0, 0.0)] * 20_000,
    ],
    ids=["large", "broadcast", "list"],
)
def test_too_many_control_points(settings: bristle.Settings, points: Any) -> None:
    error = refused(settings, workpiece={"kind": "profile", "control_points_m": points})
    assert error.key == "workpiece.control_points_m"
    assert "at most 10000" in str(error)


def test_too_many_numbers(settings: bristle.Settings) -> None:
    square = np.broadcast_to(1.0, (10**6, 10**6))
    for values in (np.zeros(10**7), range(10**12), square):
        error = refused(settings, study={"penetration_depth_m": values})
        assert error.key == "study.penetration_depth_m"
        assert "at most 1000000" in str(error)


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("process", "gravity_m_s2", [0.0, 0.0, 0.0, -9.8]),
        ("process", "gravity_m_s2", [0.0, -9.8, 0.0, "down"]),
        ("process", "gravity_m_s2", [0.0, -9.8]),
        ("workpiece", "normal", [0.0, 1.0, 0.0, 0.0]),
        ("workpiece", "control_points_m", np.zeros((5, 3))),
        ("workpiece", "control_points_m", [[0.0, 0.0], [1.0, 0.0, "x"]]),
    ],
)
def test_vectors_and_points_of_another_length(
    settings: bristle.Settings, section: str, key: str, value: Any
) -> None:
    if key == "control_points_m":
        value = {**PROFILE, key: value}
    else:
        value = {key: value}
    assert refused(settings, **{section: value}).key == f"{section}.{key}"


def test_masked_arrays(settings: bristle.Settings) -> None:
    masked = np.ma.masked_invalid([[-0.1, 0.0], [0.0, np.nan], [0.1, 0.0]])
    error = refused(settings, workpiece={**PROFILE, "control_points_m": masked})
    assert error.key == "workpiece.control_points_m" and "masked" in str(error)
    states = np.ma.masked_less(np.full((2, 4, 2), [1.5, -1.0]), 0.0)
    plain = np.full((2, 4, 2), 1.5)
    with pytest.raises(ValueError, match="v has masked"):
        bristle.accelerations(settings, plain, states)
    with pytest.raises(ValueError, match="position_m has masked"):
        bristle.Tool(position_m=np.ma.masked_less(np.eye(3), 0.5), direction=np.eye(3))
    # Nothing is masked.
    rates = np.ma.array(plain)
    expected = bristle.accelerations(settings, plain, plain)
    assert np.array_equal(bristle.accelerations(settings, rates, rates), expected)


def test_arrays_of_any_memory(settings: bristle.Settings) -> None:
    plain = 1.5 + 0.01 * np.arange(16.0).reshape(2, 4, 2)
    expected = bristle.accelerations(settings, plain, plain)
    memory = np.zeros(8 * plain.size + 1, dtype=np.uint8)
    unaligned = memory[1:].view(np.float64).reshape(plain.shape)
    unaligned[...] = plain
    assert not unaligned.flags.aligned
    strided = np.zeros((4, 8, 4))[::2, ::2, ::2]
    strided[...] = plain
    others: list[Any] = [unaligned, strided, plain.astype(">f8"), np.asfortranarray(plain)]
    for other in others:
        assert np.array_equal(bristle.accelerations(settings, other, other), expected)
    points = np.array(PROFILE["control_points_m"])
    piece = settings.replace(workpiece=PROFILE)
    for other in (points.astype(">f8"), np.asfortranarray(points)):
        workpiece = {**PROFILE, "control_points_m": other}
        assert settings.replace(workpiece=workpiece) == piece


def test_tools_of_numbers_only() -> None:
    with pytest.raises(TypeError, match="position_m must be real numbers"):
        bristle.Tool(position_m=1j * np.eye(3), direction=np.eye(3))
    with pytest.raises(TypeError, match="direction must be real numbers"):
        bristle.Tool(position_m=np.eye(3), direction=[["1", "0", "0"]] * 3)


def test_tools_of_too_many_samples() -> None:
    many = np.broadcast_to([0.1, 0.0, 0.0], (10**9, 3))
    with pytest.raises(ValueError, match="position_m has 1000000000 samples, at most"):
        bristle.Tool(position_m=many, direction=many)


def test_texts_that_are_no_unicode(settings: bristle.Settings, tmp_path: Path) -> None:
    assert refused(settings, workpiece={"kind": "\ud800"}).key == "workpiece.kind"
    assert "Unicode" in str(refused(settings, workpiece={"\udfff": 1}))
    # The names of files may have such bytes.
    path = tmp_path / "brush-\udcff.toml"
    try:
        path.write_text(settings.to_toml(), encoding="utf-8")
    except (OSError, UnicodeError):
        pytest.skip("the file system has no such names")
    loaded = bristle.load(path)
    assert loaded == settings and loaded.name == "brush-?.toml"
    assert bristle.simulate(loaded)._repr_html_()


def test_metrics_cannot_be_written_to(settings: bristle.Settings) -> None:
    contact = bristle.simulate(settings)
    with pytest.raises(TypeError):
        contact.metrics["contact_normal_impulse_n_s"] = 1.0
    with pytest.raises(TypeError):
        contact.statistics["steps"] = 1
    assert isinstance(contact.metrics["turn_contact_normal_impulses_n_s"], tuple)
    assert json.loads(json.dumps(dict(contact.metrics))) is not None


def test_whole_numbers_without_end(settings: bristle.Settings) -> None:
    large = 10**30
    for call in (
        lambda: bristle.simulate(settings, samples=large),
        lambda: bristle.study(settings, {"filament.segments": [4]}, threads=large),
        lambda: bristle.study(settings, {"filament.segments": [4]}, memory_bytes=large),
        lambda: bristle.derive(10**5000),
    ):
        with pytest.raises(ValueError, match="must be at most"):
            call()
