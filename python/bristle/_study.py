"""Many contacts or brushes over a grid of settings."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Mapping
from functools import cached_property
from os import PathLike
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bristle import _arguments as arguments
from bristle import _bristle
from bristle._errors import warn_of
from bristle._settings import Section, Settings, checked_study, require

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class Advice:
    """The cases of a study that suit a process best, from `Study.advise`.

    Printed, it is the text of ``bristle advise``.
    """

    def __init__(self, text: str, values: Mapping[str, Any]) -> None:
        self._text = text
        self._values = values

    @property
    def values(self) -> Mapping[str, Any]:
        """What ``bristle advise --json`` prints, in SI units."""
        return self._values

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return self._text


class Study:
    """A simulated study, from `study`: one row per case, in the order of the grid."""

    def __init__(self, settings: Settings, simulated: _bristle.SimulatedStudy) -> None:
        self._settings = settings
        self._simulated = simulated

    @property
    def settings(self) -> Settings:
        """What was simulated; `Settings.sweep` has the sweeps."""
        return self._settings

    @cached_property
    def runs(self) -> Mapping[str, npt.NDArray[Any]]:
        """The columns of ``runs.csv`` by their names, in SI units, not to be written to.

        What a case that failed does not have is NaN; ``status`` says why.
        """
        runs = {key: np.asarray(value) for key, value in self._simulated.runs().items()}
        for column in runs.values():
            column.flags.writeable = False
        return MappingProxyType(runs)

    @property
    def failures(self) -> int:
        """The number of cases that failed."""
        return self._simulated.failures()

    def __len__(self) -> int:
        return int(self.runs["status"].size)

    def __repr__(self) -> str:
        axes = (f"{len(values)} of {name}" for name, values in self._simulated.axes())
        return f"<Study: {len(self)} cases, {' × '.join(axes)}>"

    def to_pandas(self) -> pd.DataFrame:
        """The rows as a table of pandas, which must be installed."""
        import pandas as pd

        frame = pd.DataFrame({key: np.array(value) for key, value in self.runs.items()})
        descriptions = self._simulated.descriptions()
        frame.attrs["units"] = {
            key: descriptions[key][0] for key in self.runs if key in descriptions
        }
        return frame

    def to_xarray(self) -> xr.Dataset:
        """The grid as a data set of xarray, which must be installed.

        The dimensions have the names of the swept columns of ``runs.csv``, from the
        slowest to the fastest. Attributes are ``units`` and ``long_name``.
        """
        import xarray as xr

        descriptions = self._simulated.descriptions()

        def attributes(name: str) -> dict[str, str]:
            if name not in descriptions:
                return {}
            units, long_name = descriptions[name]
            return {"units": units, "long_name": long_name}

        axes = {name: len(values) for name, values in self._simulated.axes()}
        shape = list(axes.values())

        def along(axis: int, name: str) -> npt.NDArray[Any]:
            """The values of an axis, of the type that they have in the rows."""
            values = np.moveaxis(self.runs[name].reshape(shape), axis, 0)
            return values.reshape(shape[axis], -1)[:, 0]

        return xr.Dataset(
            {
                name: (list(axes), column.reshape(shape), attributes(name))
                for name, column in self.runs.items()
                if name not in axes
            },
            {
                name: (name, along(axis, name), attributes(name))
                for axis, name in enumerate(axes)
            },
        )

    def report(self, path: str | PathLike[str]) -> None:
        """Writes the page of the study, as ``bristle study`` does to ``report.html``.

        Raises:
            OSError: If the file cannot be written.
        """
        file = arguments.path("path", path)
        self._simulated.report(self._settings._input, file)

    def advise(
        self,
        *,
        max_velocity_m_s: float | None = None,
        max_rotational_speed_rpm: float | None = None,
        max_depth_m: float | None = None,
        max_force_n: float | None = None,
        max_power_w: float | None = None,
        min_ratio: float | None = None,
        max_ratio: float | None = None,
        target_force_n: float | None = None,
    ) -> Advice:
        """Ranks the cases within limits by the tool force: ``bristle advise``.

        The highest force comes first or, with ``target_force_n``, the nearest to it.

        Args:
            max_velocity_m_s: Highest brushing velocity, in m/s.
            max_rotational_speed_rpm: Highest rotational speed, in rpm.
            max_depth_m: Largest penetration depth, in m.
            max_force_n: Highest force of the tool, in N.
            max_power_w: Highest power of the drive, in W.
            min_ratio: Lowest contact time ratio, from 0 (striking) to 1 (sweeping).
            max_ratio: Highest contact time ratio.
            target_force_n: The force that is wanted, in N.

        Raises:
            ValueError: If limits contradict each other, or there is nothing to compare.
        """
        limits = {
            "max_velocity_m_s": max_velocity_m_s,
            "max_rotational_speed_rpm": max_rotational_speed_rpm,
            "max_depth_m": max_depth_m,
            "max_force_n": max_force_n,
            "max_power_w": max_power_w,
            "min_ratio": min_ratio,
            "max_ratio": max_ratio,
            "target_force_n": target_force_n,
        }
        given = {
            key: value if key.endswith("ratio") else arguments.positive(key, value)
            for key, value in limits.items()
            if value is not None
        }
        text, values = self._simulated.advise(given)
        return Advice(text, arguments.fixed(json.loads(values)))

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (self._settings, self._simulated.state()))


def _restored(settings: Settings, state: tuple[str, str]) -> Study:
    return Study(settings, _bristle.SimulatedStudy.of_state(state))


class _Line:
    """Progress on one line of a terminal; nothing elsewhere, or if it is over soon."""

    PATIENCE_S = 1.0
    PAUSE_S = 0.2

    def __init__(self) -> None:
        self._begun = time.monotonic()
        self._told = 0.0

    def __call__(self, done: int, total: int, failed: int) -> None:
        now = time.monotonic()
        if not sys.stderr.isatty() or now - self._begun < self.PATIENCE_S:
            return
        if now - self._told < self.PAUSE_S and done < total:
            return
        self._told = now
        failures = f", {failed} failed" if failed else ""
        end = "\n" if done == total else ""
        print(f"\r{done}/{total} cases{failures}", end=end, file=sys.stderr, flush=True)


def teller(
    progress: bool | Callable[[int, int, int], object],
) -> Callable[[int, int, int], object] | None:
    """What shows progress, if anything does."""
    return _Line() if progress is True else progress or None


def swept(settings: Settings, sweep: Section | None) -> Settings:
    """Settings with the values of ``sweep``; by default with those that they state."""
    require(settings)
    if sweep is None:
        return settings
    return settings.replace(study=None).replace(study=sweep)


def study(
    settings: Settings,
    sweep: Section | None = None,
    *,
    threads: int | None = None,
    out: str | PathLike[str] | None = None,
    restart: bool = False,
    progress: bool | Callable[[int, int, int], object] = True,
    memory_bytes: int | None = None,
) -> Study:
    """Simulates all combinations of the swept values, as ``bristle study`` does.

    Other threads of Python go on meanwhile. Ctrl-C stops it; with ``out``, the same
    call goes on from the cases that are in the journal.

    >>> import bristle
    >>> depths = [1e-3, 2e-3]
    >>> sweep = {"process.penetration_depth_m": depths, "filament.segments": [5, 10]}
    >>> study = bristle.study(bristle.Settings.paper(10.0, 1e-3), sweep)
    >>> study.runs["segments"].tolist()
    [5, 5, 10, 10]

    Args:
        settings: What all cases share.
        sweep: Values of each swept setting by its dotted path: an array, or a mapping
            with ``start``, ``stop`` and ``step``. By default those that the settings
            state in the section ``[study]``.
        threads: Number of threads, by default one per core; changes no result.
        out: Directory for ``runs.csv``, ``study.json``, ``report.html`` and the journal,
            with the same bytes as by the program.
        restart: Whether to discard the results of an earlier call in ``out``.
        progress: Whether to show progress on a terminal, or a function that is called
            with the numbers of cases that are done, of all, and of those that failed.
        memory_bytes: Refuses brushes that need more memory than this.

    Raises:
        SettingsError: If the settings of some case are not allowed, or ``out`` has the
            journal of another study.
        OSError: If a file cannot be written.
    """
    settings = swept(settings, sweep)
    directory = None if out is None else arguments.path("out", out)
    simulated = _bristle.study(
        checked_study(settings),
        arguments.whole_or_none("threads", threads, 1),
        directory,
        restart,
        arguments.whole_or_none("memory_bytes", memory_bytes, 0),
        teller(progress),
    )
    warn_of(simulated)
    return Study(settings, simulated)
