"""The equations: accelerations of batches, all terms of one state, and their text."""

import inspect
import json
from typing import Any

import bristle
import numpy as np
import pytest


def _states(count: int, segments: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(1)
    q = np.empty((count, segments, 2))
    q[..., 0] = np.pi / 2 + random.uniform(-0.2, 0.2, (count, segments))
    q[..., 1] = random.uniform(-0.3, 0.3, (count, segments))
    return q, random.uniform(-10.0, 10.0, q.shape)


def test_a_batch_equals_its_states_alone(settings: bristle.Settings) -> None:
    q, v = _states(300, 3)
    angles = np.linspace(0.0, 1.0, 300)
    base = {"base_rate_rad_s": 50.0, "base_acceleration_rad_s2": 3.0}
    gravity = [0.0, -9.81, 0.0]
    result = bristle.accelerations(
        settings, q, v, base_angle_rad=angles, gravity_m_s2=gravity, **base
    )
    assert result.shape == (300, 3, 2)
    for k in (0, 7, 255, 256, 299):
        state = {
            "base_angle": angles[k],
            "base_rate": 50.0,
            "base_acceleration": 3.0,
            "gravity": gravity,
            "q": q[k].ravel(),
            "v": v[k].ravel(),
        }
        evaluation = bristle.evaluate(settings, state)
        assert (evaluation.accelerations == result[k].ravel()).all()
        mass = evaluation.mass_matrix
        assert mass.shape == (6, 6) and np.allclose(mass, mass.T)
        assert evaluation.kinetic_energy_j > 0.0
        assert evaluation.tip_position_m.shape == (3,)


def test_arguments_are_checked(settings: bristle.Settings) -> None:
    q, v = _states(4, 2)
    assert bristle.accelerations(settings, q[:0], v[:0]).shape == (0, 2, 2)
    with pytest.raises(ValueError, match=r"\(k, n, 2\)"):
        bristle.accelerations(settings, q, v[:3])
    with pytest.raises(ValueError, match=r"\(k, n, 2\)"):
        bristle.accelerations(settings, q[0], v[0])
    with pytest.raises(ValueError):
        bristle.accelerations(settings, q, v, base_angle_rad=np.zeros(3))
    q[2, 1, 0] = 0.0
    with pytest.raises(ValueError, match="state 3 of the batch"):
        bristle.accelerations(settings, q, v)
    with pytest.raises(ValueError, match="`w`"):
        bristle.evaluate(settings, {"w": 1.0})


def test_the_equations_have_several_forms() -> None:
    assert "q" in bristle.derive(1)
    assert bristle.derive(2, format="latex").count("\\documentclass") == 1
    assert json.loads(bristle.derive(None, planar=True, format="json"))["kernels"]
    assert "def planar_mass_matrix" in bristle.derive(1, planar=True, format="numpy")
    assert all(bristle.derive(1, format="c").values())
    assert "one_pass.m" in bristle.derive(1, format="matlab")
    with pytest.raises(ValueError, match="segment"):
        bristle.derive(0)
    with pytest.raises(ValueError, match='"sympy"'):
        bristle.derive(1, format="word")  # type: ignore[call-overload]


def test_settings_have_the_equations_of_their_filament(
    settings: bristle.Settings,
) -> None:
    short = settings.replace(filament={"segments": 3})
    assert bristle.derive(short, format="latex") == bristle.derive(
        3, planar=True, uniform=True, straight=True, format="latex"
    )
    tapered = short.replace(filament={"tip_diameter_m": 0.5e-3})
    assert bristle.derive(tapered) == bristle.derive(3, planar=True, straight=True)
    with pytest.raises(ValueError, match="any filament"):
        bristle.derive(3, uniform=True, format="c")
    with pytest.raises(ValueError, match="any filament"):
        bristle.derive(None, straight=True)


def test_a_paper_gets_a_fragment() -> None:
    fragment = bristle.derive(2, format="latex", fragment=True, width_mm=70)
    assert "--fragment --width 70mm" in fragment and "\\documentclass" not in fragment
    with pytest.raises(ValueError, match="width"):
        bristle.derive(2, format="latex", fragment=True, width_mm=10)
    with pytest.raises(ValueError, match="fragment"):
        bristle.derive(2, format="latex", width_mm=70)
    with pytest.raises(ValueError, match="latex"):
        bristle.derive(2, fragment=True)


def test_planar_matrices_need_no_more_than_numpy() -> None:
    """The joint of the clamp has an angle, too, at rest and in motion, after several turns."""
    sympy = pytest.importorskip("sympy")
    equations = bristle.derive(2, planar=True, format="sympy")
    mass, force = equations["planar_mass_matrix"], equations["planar_force"]
    symbols = sorted(mass.free_symbols | force.free_symbols, key=str)
    evaluated = sympy.lambdify(symbols, [mass, force], "numpy")
    module: dict[str, Any] = {}
    exec(bristle.derive(2, planar=True, format="numpy"), module)
    random = np.random.default_rng(3)
    for base in (0.0, -2.0, 3.1, 8.0 * np.pi + 0.5):
        for bent in ([0.0, 0.0], [0.4, -0.3]):
            values = {str(symbol): random.uniform(0.5, 1.5) for symbol in symbols}
            values |= {"clamp_direction_x": np.cos(base), "clamp_direction_y": np.sin(base)}
            values |= {"relaxed_angle_1": 0.0, "relaxed_angle_2": 0.0}
            values |= {"theta_1": base + bent[0], "theta_2": base + bent[1]}
            own_mass, own_force = evaluated(*(values[str(symbol)] for symbol in symbols))
            expected_mass, expected_force = (
                function(*_arguments(function, values))
                for function in (module["planar_mass_matrix"], module["planar_force"])
            )
            assert np.allclose(own_mass, expected_mass, rtol=1e-12, atol=1e-12)
            assert np.allclose(np.ravel(own_force), expected_force, rtol=1e-11, atol=1e-11)


def _arguments(function: Any, values: dict[str, float]) -> list[Any]:
    """The arguments of a function of the NumPy module, of the values of symbols."""

    def argument(name: str) -> Any:
        stem = {"q": "theta", "v": "theta_rate"}.get(name, name)
        keys = [stem, *(f"{stem}_{end}" for end in "12xyz")]
        found = [values[key] for key in keys if key in values] or [0.0, 0.0]
        return found[0] if len(found) == 1 else np.array(found)

    return [argument(name) for name in inspect.signature(function).parameters]


def test_sympy_gets_matrices(settings: bristle.Settings) -> None:
    sympy = pytest.importorskip("sympy")
    mass = bristle.derive(2, planar=True, format="sympy")["planar_mass_matrix"]
    assert mass.shape == (2, 2)
    assert sympy.simplify(mass - mass.T) == sympy.zeros(2, 2)
    uniform = bristle.derive(2, planar=True, uniform=True, format="sympy")
    names = {str(symbol) for symbol in uniform["planar_mass_matrix"].free_symbols}
    assert "segment_mass" in names and "segment_mass_1" not in names
