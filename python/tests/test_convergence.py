"""Numbers of segments and tolerances."""

import json
from pathlib import Path

import pytest

import bristle


def test_convergence_is_that_of_the_program(tmp_path: Path) -> None:
    coarse = bristle.Settings.paper(10.0, 1e-3).replace(filament={"segments": 8})
    shares: list[float] = []
    found = bristle.converge(coarse, out=tmp_path / "out", threads=1, progress=shares.append)
    assert json.loads((tmp_path / "out" / "converge.json").read_text()) == json.loads(
        json.dumps(found.numbers, default=lambda each: dict(each))
    )
    segments = found.numbers["series"][0]
    force = segments["metrics"]["tool_contact_normal_force_n"]
    assert segments["stated"] == 8 and len(force["values"]) == len(segments["values"])
    stated = bristle.simulate(coarse).metrics["tool_contact_normal_force_n"]
    assert force["values"][segments["values"].index(8)] == pytest.approx(stated, rel=1e-12)
    assert 1.5 < force["order"] < 2.5
    error = found.error("tool_contact_normal_force_n")
    assert error is not None and 1e-3 < error < 2e-2
    pytest.importorskip("matplotlib")
    assert [axes.get_xlabel() for axes in found.plot().axes] == [
        series["setting"] for series in found.numbers["series"]
    ]
    assert str(found).count("max F_n") == 1 and shares == sorted(shares)


def test_what_has_no_force_is_refused() -> None:
    far = bristle.Settings.paper(10.0, 1e-3).replace(
        workpiece={"kind": "edge", "edge_radius_m": 1e-4, "offset_m": -0.2}
    )
    with pytest.raises(bristle.SettingsError, match="do not touch"):
        bristle.converge(far, progress=False)
