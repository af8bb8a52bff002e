"""Settings of a brush from measured forces, or from the radii of an edge over time."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bristle import _arguments as arguments
from bristle import _bristle
from bristle._progress import TellShare, of_share
from bristle._settings import Settings, checked
from bristle._table import Column, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bristle._figure import Placed

_MISSING = {"nan", "None", "<NA>", "NaT"}
"""Texts of values that are missing, of which pandas has several."""

_UNITS = {
    "time_s": "s",
    "brushing_velocity_m_s": "m/s",
    "rotational_speed_rpm": "rpm",
    "penetration_depth_m": "m",
}


class Calibration(Mapping[str, "float | None"]):
    """Settings that were fitted to measured forces or radii, from `calibrate`.

    It maps the dotted path of each fitted setting to its value in its SI unit, which is ``None``
    if it is not determined. Printed, it is the text of ``bristle calibrate``.
    """

    def __init__(
        self,
        settings: Settings,
        record: Mapping[str, Any],
        text: str,
        change_when_checked: float | None = None,
        findings: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        self._stated = settings
        self._record = record
        self._text = text
        self._change_when_checked = change_when_checked
        self._findings = tuple(arguments.fixed(each) for each in findings)

    def __getitem__(self, key: str) -> float | None:
        value: float | None = self._of_each("value")[key]
        return value

    def __iter__(self) -> Iterator[str]:
        return iter(self._of_each("value"))

    def __len__(self) -> int:
        return len(self._record["parameters"])

    @property
    def record(self) -> Mapping[str, Any]:
        """Content of ``calibration.json`` (``docs/results.md``, "Removal, calibration, convergence")."""
        return self._record

    @property
    def change_when_checked(self) -> float | None:
        """Largest relative change of the fitted values with more precision; ``None``
        without ``check=True``."""
        return self._change_when_checked

    @property
    def findings(self) -> tuple[Mapping[str, Any], ...]:
        """Findings with ``id``, ``quantity``, ``value``, ``limit``, ``statement``, and ``help``.

        ``bristle explain`` says what an id means.
        """
        return self._findings

    @property
    def standard_errors(self) -> dict[str, float | None]:
        """The standard error of each value."""
        return self._of_each("standard_error")

    @property
    def intervals_95(self) -> dict[str, tuple[float, float] | None]:
        """The 95 % interval of each value, by the profile of the sum of squares."""
        ends = self._of_each("interval_95")
        return {key: None if pair is None else (pair[0], pair[1]) for key, pair in ends.items()}

    def _of_each(self, name: str) -> dict[str, Any]:
        return {each["key"]: each[name] for each in self._record["parameters"]}

    @cached_property
    def covariance(self) -> npt.NDArray[np.float64]:
        """Covariance of the values, in the order of the settings."""
        return np.array(self._record["covariance"], dtype=float)

    @cached_property
    def correlations(self) -> npt.NDArray[np.float64]:
        """Correlations of the values, in the order of the settings."""
        return np.array(self._record["correlations"], dtype=float)

    @property
    def chi_squared(self) -> float:
        """The sum of squared residuals over their variances."""
        return float(self._record["chi_squared"])

    @property
    def undetermined(self) -> list[str]:
        """Combinations that the measurements do not determine, in words."""
        return [str(group["statement"]) for group in self._record["undetermined"]]

    @property
    def next_measurement(self) -> list[Mapping[str, Any]]:
        """The best points to measure at next, the best first."""
        return list(self._record["next_measurement"])

    @property
    def square_root(self) -> Mapping[str, Any] | None:
        """Fit of the radii of an edge by the square root of time: ``fits``, ``chi_squared``,
        ``probability``, ``c_m_per_sqrt_s`` and a ``statement``; ``None`` for forces."""
        root: Mapping[str, Any] | None = self._record.get("square_root")
        return root

    @cached_property
    def settings(self) -> Settings:
        """The settings with the fitted values. Those of forces carry their errors as ``uncertainty.calibration``.

        Raises:
            ValueError: If not all settings are determined.
        """
        if self.undetermined:
            raise ValueError(
                "; ".join(self.undetermined)
                + ": `dict(calibration)` has what is determined"
            )
        sections: dict[str, dict[str, Any]] = {}
        for key, value in self.items():
            section, _, name = key.partition(".")
            sections.setdefault(section, {})[name] = value
        if self.square_root is None:
            sections["uncertainty"] = {
                "calibration": {
                    "settings": list(self),
                    "standard_errors": list(self.standard_errors.values()),
                    "correlations": self._record["correlations"],
                }
            }
        return self._stated.replace(**sections)

    @cached_property
    def residuals(self) -> Table:
        """One row per force or radius: ``residuals.csv``. ``residual`` is in standard deviations."""
        rows = self._record["residuals"]
        columns: dict[str, Column] = {
            name: np.array([row[name] for row in rows]) for name in rows[0]
        }
        units = {name: _UNITS.get(name, "") for name in columns}
        return Table(columns, units, self._stated)

    def plot(self, *, ax: Placed = None) -> Figure:
        """Measured over fitted forces, a diagram for each quantity, or radii over time.

        Args:
            ax: Axes of matplotlib to draw on, as many as there are diagrams; by default those of
                a new figure.

        Returns:
            The figure of the axes, which a notebook shows; matplotlib must be installed.
        """
        from bristle._figure import beside, diagrams

        table = self.residuals
        if self.square_root is not None:
            return _over_time(table, ax)
        quantities = list(dict.fromkeys(table["quantity"].tolist()))
        size = (6.0 * len(quantities), 4.5)
        figure, all_axes = diagrams(ax, len(quantities), size, side_by_side=True)
        for axes, quantity in zip(all_axes, quantities, strict=True):
            rows = table["quantity"] == quantity
            fitted, measured = table["fitted"][rows], table["measured"][rows]
            ends = [float(min(fitted)), float(max(fitted))]
            axes.plot(ends, ends, color="0.5", linewidth=1, label="measured = fitted")
            axes.errorbar(fitted, measured, table["std"][rows], fmt="s", mfc="none", capsize=3)
            axes.set(xlabel=f"fitted {quantity}", ylabel=f"measured {quantity}")
        beside(all_axes[-1])
        return figure

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return self._text


def _over_time(table: Table, ax: Placed) -> Figure:
    """Measured and fitted radii over time."""
    from bristle._figure import beside, diagrams

    figure, [axes] = diagrams(ax, 1, (7.5, 4.5))
    time = table["time_s"]
    axes.errorbar(
        time, 1e3 * table["measured"], 1e3 * table["std"], fmt="s", mfc="none", capsize=3, label="measured"
    )
    axes.plot(time, 1e3 * table["fitted"], label="fitted")
    axes.plot(time, 1e3 * table["square_root"], color="0.5", linewidth=1, label="square root of time")
    axes.set(xlabel="time in s", ylabel="radius of the edge in mm", ylim=(0.0, None))
    beside(axes)
    return figure


def calibrate(
    settings: Settings,
    measured: Mapping[str, Any],
    *,
    fit: Sequence[str] | Mapping[str, tuple[float, float] | None],
    relative_std: float | None = None,
    max_rotational_speed_rpm: float | None = None,
    max_depth_m: float | None = None,
    threads: int | None = None,
    out: str | PathLike[str] | None = None,
    restart: bool = False,
    check: bool = False,
    progress: bool | TellShare = True,
) -> Calibration:
    """Fits settings to measured forces, or to the radii of an edge over time, as ``bristle calibrate`` does.

    Args:
        settings: The brush. Velocity and depth are those of the points, or of the settings if radii are measured.
        measured: A data frame, or columns by their headings, as the program reads them from a
            file: ``brushing_velocity_m_s`` or
            ``rotational_speed_rpm``, ``penetration_depth_m``, and at least one of ``force_n``,
            ``tangential_force_n``, ``torque_n_m``, ``power_w``, with standard deviations ``std_n``,
            ``tangential_force_std_n``, ``torque_std_n_m``, ``power_std_w``. For
            ``removal.preston_m2_n`` and ``workpiece.edge_radius_m``: ``time_s`` or ``turns``, which
            increase, ``edge_radius_m`` and its standard deviation ``edge_radius_std_m``. Other
            units end the heading, as in ``penetration_depth_mm``; the section ``[measured]`` of
            the settings may name other headings. Further columns are left out.
        fit: Dotted paths of settings, or these with their ranges; ``None`` is the usual range.
        relative_std: Standard deviation over the value, of what has none of its own.
        max_rotational_speed_rpm: Largest speed at which can be measured next, in rpm.
        max_depth_m: Largest depth at which can be measured next, in m.
        threads: Number of threads, by default one per core; changes no result.
        out: A directory for the files of ``bristle calibrate``, without figures of their own:
            ``calibrated.toml``, ``calibration.json``, ``residuals.csv``, ``calibration.html``. With
            ``[brush]`` the same call goes on from its journal after Ctrl-C or a crash.
        restart: Whether to discard the journal of an earlier call.
        check: Whether to simulate again with more precision at the values found, for
            `Calibration.change_when_checked`.
        progress: Whether to show progress, or a function that is called with the share that is
            done.

    Raises:
        SettingsError: If the measurements cannot determine the settings.
        OSError: If a file cannot be written.
    """
    ranges = fit if isinstance(fit, Mapping) else dict.fromkeys(fit)
    options = [
        key if ends is None else f"{key}={float(ends[0])!r}..{float(ends[1])!r}"
        for key, ends in ranges.items()
    ]
    reach = (max_rotational_speed_rpm, max_depth_m)
    threads = arguments.whole_or_none("threads", threads, 1)
    place = arguments.path_or_none("out", out)
    table = (_table(measured), [str(name) for name in measured], relative_std)
    means = (threads, place, restart, check)
    with of_share(progress, "the calibration") as tell:
        record, text, change, findings = _bristle.calibrate(
            checked(settings), table, options, reach, means, tell
        )
    return Calibration(settings, json.loads(record), text, change, json.loads(findings))


def _table(measured: Mapping[str, Any]) -> str:
    """The text of a table with all columns. What is not a number is left empty."""
    columns = {str(name): _cells(measured[name]) for name in measured}
    sizes = {len(column) for column in columns.values()}
    if len(sizes) > 1:
        raise ValueError(f"the columns of `measured` have different lengths: {sorted(sizes)}")
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


def _cells(column: Any) -> list[str]:
    """The cells of a column, without those that are masked, missing or NaN."""
    cells = [str(value) for value in np.ma.asarray(column).ravel().tolist()]
    return ["" if cell in _MISSING else cell for cell in cells]
