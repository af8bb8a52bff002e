"""Many contacts or brushes over a grid of settings."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from bristle import _arguments as arguments
from bristle import _bristle
from bristle._errors import warn_of
from bristle._plot import drawn
from bristle._progress import TellCases, of_cases
from bristle._settings import Section, Settings, checked_study, require
from bristle._table import Column, Description, Table, attributes
from bristle._tool import Tool, checked_tool, with_own_speed

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

    from bristle._figure import Placed


class Advice(Mapping[str, Any]):
    """The cases of a study that suit a process best, from `Study.advise`.

    It has the keys and values that ``bristle advise --json`` prints, in SI units. Printed, it is
    the text of ``bristle advise``.
    """

    def __init__(self, text: str, content: Mapping[str, Any]) -> None:
        self._text = text
        self._content = content

    def __getitem__(self, key: str) -> Any:
        return self._content[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._content)

    def __len__(self) -> int:
        return len(self._content)

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return self._text


class Study:
    """A simulated study, from `study`: one row per case, in the order of the grid."""

    def __init__(
        self,
        settings: Settings,
        simulated: _bristle.SimulatedStudy,
        tool: Tool | None = None,
    ) -> None:
        self._settings = settings
        self._simulated = simulated
        self._tool = tool

    @property
    def settings(self) -> Settings:
        """Settings of the study; `Settings.sweep` has the sweeps."""
        return self._settings

    @property
    def tool(self) -> Tool | None:
        """The tool that was simulated in place of the round one of the settings."""
        return self._tool

    @cached_property
    def runs(self) -> Table:
        """One row per case, in the order of the grid: ``runs.csv``.

        What a case that failed does not have is NaN; ``status`` says why.
        """
        columns = {
            name: np.asarray(values) for name, values in self._simulated.runs().items()
        }
        if self._tool is not None:
            columns.update(with_own_speed(columns))
        units = {name: self._descriptions[name]["unit"] for name in columns}
        return Table(columns, units, self._settings, self._tool)

    @cached_property
    def _descriptions(self) -> Mapping[str, Description]:
        return self._simulated.descriptions()

    @cached_property
    def _axes(self) -> dict[str, Column]:
        """The values along each axis, of the type that they have in the rows."""
        sizes = dict(self._simulated.axes())
        shape = list(sizes.values())

        def values(axis: int, name: str) -> Column:
            grid = np.moveaxis(self.runs[name].reshape(shape), axis, -1)
            along: Column = grid.reshape(-1, shape[axis])[0]
            return along

        return {name: values(axis, name) for axis, name in enumerate(sizes)}

    @property
    def failures(self) -> int:
        """The number of cases that failed."""
        return self._simulated.failures()

    @property
    def findings(self) -> tuple[Mapping[str, Any], ...]:
        """Findings with ``id``, ``quantity``, ``value``, ``limit``, the ``rows``, ``statement``, and ``help``.

        ``bristle explain`` says what an id means.
        """
        return tuple(arguments.fixed(each) for each in json.loads(self._simulated.findings()))

    def __len__(self) -> int:
        return int(self.runs["status"].size)

    def __repr__(self) -> str:
        axes = (f"{values.size} of {name}" for name, values in self._axes.items())
        return f"<Study: {len(self)} cases, {' × '.join(axes)}>"

    def to_pandas(self) -> pd.DataFrame:
        """`Study.runs` as a table of pandas, which must be installed."""
        return self.runs.to_pandas()

    def to_xarray(self) -> xr.Dataset:
        """The grid as a data set of xarray, which must be installed.

        The dimensions have the keys of the swept settings, from the slowest to the
        fastest: ``segments``, or ``filament_segments`` where something else has that name.
        Attributes of the variables are ``units`` and ``long_name``, those of the data set
        ``bristle_version`` and ``settings``, the text of an input file.
        """
        import xarray as xr

        def described(name: str) -> dict[str, str]:
            description = self._descriptions[name]
            return {"units": description["unit"], "long_name": description["name"]}

        keys = [name.rpartition(".")[2] for name in self._axes]
        taken = [*keys, *(self.runs.keys() - self._axes.keys())]
        dimensions = [
            name.replace(".", "_") if taken.count(key) > 1 else key
            for name, key in zip(self._axes, keys, strict=True)
        ]
        shape = [values.size for values in self._axes.values()]
        return xr.Dataset(
            {
                name: (dimensions, column.reshape(shape), described(name))
                for name, column in self.runs.items()
                if name not in self._axes
            },
            {
                dimension: (dimension, values, described(name))
                for dimension, (name, values) in zip(
                    dimensions, self._axes.items(), strict=True
                )
            },
            attributes(self._settings, self._tool),
        )

    def plot(
        self, metric: str = "tool_contact_normal_force_n", *, ax: Placed = None
    ) -> Figure:
        """A column of `Study.runs` over the grid, in the units of the program's figures.

        It is drawn over the longest axis, with one curve for each combination of the
        others and, for the force of the tool, the 95 % band of the sampled tools where
        filaments scatter. Two axes of more than 10 values make a map.

        Args:
            metric: The name of a column of numbers.
            ax: Axes of matplotlib to draw on; by default those of a new figure.

        Returns:
            The figure of the axes, which a notebook shows; matplotlib must be installed.

        Raises:
            ValueError: If there is no such column, or too many curves.
        """
        return drawn(self.runs, self._axes, self._descriptions, metric, ax)

    def report(self, path: str | PathLike[str]) -> None:
        """Writes the page of the study, as ``bristle study`` does to ``report.html``.

        Raises:
            OSError: If the file cannot be written.
            ValueError: If the study has a `Tool`: the page draws a round one.
        """
        file = arguments.path("path", path)
        self._require_round("the page")
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
        verify: bool = True,
    ) -> Advice:
        """Says where the tool force is high, or what to set: ``bristle advise``.

        With limits or ``target_force_n`` there is one recommendation, which is simulated, with
        filaments that touch each other where they do.

        Args:
            max_velocity_m_s: Highest brushing velocity, in m/s.
            max_rotational_speed_rpm: Highest rotational speed, in rpm.
            max_depth_m: Largest penetration depth, in m.
            max_force_n: Highest force of the tool, in N.
            max_power_w: Highest power of the drive, in W.
            min_ratio: Lowest contact time ratio, from 0 (striking) to 1 (sweeping).
            max_ratio: Highest contact time ratio.
            target_force_n: The force that is wanted, in N.
            verify: Whether to simulate the recommendation, which takes up to a minute where
                filaments touch.

        Raises:
            ValueError: If limits contradict each other, there is nothing to compare, or the
                study has a `Tool`: advice is about a round one.
        """
        self._require_round("advice")
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
        text, content = self._simulated.advise(given, verify)
        return Advice(text, arguments.of_json(content))

    def _require_round(self, what: str) -> None:
        if self._tool is not None:
            raise ValueError(f"{what} is for round tools, and this study has `tool=`")

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (self._settings, self._simulated.state(), self._tool))


def _restored(settings: Settings, state: tuple[str, str], tool: Tool | None) -> Study:
    return Study(settings, _bristle.SimulatedStudy.of_state(state), tool)


class PartialStudy:
    """A study that ended early, with the results so far: ``study`` of the exception.

    >>> import bristle
    >>> def stop(done, total, failed):
    ...     if done > 0:
    ...         raise KeyboardInterrupt
    >>> try:
    ...     bristle.study(
    ...         bristle.Settings.paper(10.0, 1e-3), {"filament.segments": [4, 5]}, progress=stop
    ...     )
    ... except KeyboardInterrupt as error:
    ...     study = error.study.resume()
    >>> study.failures
    0
    """

    def __init__(
        self, settings: Settings, running: _bristle.PendingStudy, tool: Tool | None = None
    ) -> None:
        self._settings = settings
        self._running = running
        self._tool = tool

    @property
    def settings(self) -> Settings:
        """Settings of the study; `Settings.sweep` has the sweeps."""
        return self._settings

    @property
    def counts(self) -> tuple[int, int, int]:
        """The numbers of cases that are done, of all cases, and of those that failed."""
        return self._running.counts()

    def resume(
        self, *, threads: int | None = None, progress: bool | TellCases = True
    ) -> Study:
        """Simulates the cases that have no result yet.

        Args:
            threads: Number of threads, by default one per core; changes no result.
            progress: As for :func:`bristle.study`.
        """
        threads = arguments.whole_or_none("threads", threads, 1)
        with self.kept(), of_cases(progress) as tell:
            simulated = self._running.finish(threads, tell)
            warn_of(simulated)
        return Study(self._settings, simulated, self._tool)

    @contextmanager
    def kept(self) -> Iterator[_bristle.PendingStudy]:
        """The study while it is simulated, which becomes part of an exception that ends this."""
        try:
            yield self._running
        except BaseException as error:
            done, total, _ = self.counts
            error.study = self  # type: ignore[attr-defined]
            error.add_note(
                f"{done} of {total} cases are done: `study.resume()` of this exception goes on"
            )
            raise

    def __repr__(self) -> str:
        done, total, _ = self.counts
        return f"<PartialStudy: {done} of {total} cases>"


@contextmanager
def pending(
    settings: Settings,
    checked: _bristle.Input,
    *,
    files: tuple[str | PathLike[str] | None, bool, bool],
    threads: int | None,
    memory_bytes: int | None,
    tool: Tool | None = None,
) -> Iterator[_bristle.PendingStudy]:
    """A study with the results in the journal of ``out``, if it has one.

    Without ``out``, the study becomes part of an exception that ends the block.
    """
    out, restart, check = files
    place = arguments.path_or_none("out", out)
    sampled = None if tool is None else tool._sampled
    running = _bristle.PendingStudy(
        checked, (place, restart, check), threads, memory_bytes, sampled
    )
    if place is None:
        with PartialStudy(settings, running, tool).kept():
            yield running
        return
    try:
        yield running
    finally:
        running.close()


def swept(settings: Settings, sweep: Section | None) -> Settings:
    """Settings with the values of ``sweep``; by default with those that they state."""
    require(settings)
    if sweep is None:
        return settings
    return settings._swept(sweep)


def study(
    settings: Settings,
    sweep: Section | None = None,
    *,
    threads: int | None = None,
    out: str | PathLike[str] | None = None,
    restart: bool = False,
    check: bool = False,
    progress: bool | TellCases = True,
    memory_bytes: int | None = None,
    tool: Tool | None = None,
) -> Study:
    """Simulates all combinations of the swept values, as ``bristle study`` does.

    Other threads of Python go on meanwhile. Ctrl-C stops it. With ``out`` the same call goes
    on from the journal; without it the exception has a `PartialStudy` as ``study``.

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
        restart: Whether to discard the results of an earlier call.
        check: Whether to simulate each case again with more precision, for the column
            ``change_when_checked``.
        progress: Whether to show progress, on a line of a terminal and elsewhere in a
            line now and then, or a function that is called with the numbers of cases
            that are done, of all, and of those that failed.
        memory_bytes: Refuses brushes that need more memory than this.
        tool: A tool in place of the round one, as for :func:`bristle.simulate`. Cases may
            differ neither in its shape nor in the rotational speed, but in the brushing
            velocity. Files and brushes have the round tool only.

    Raises:
        SettingsError: If the settings of some case are not allowed, or ``out`` has the
            journal of another study.
        ValueError: If both ``tool`` and ``out`` are given.
        OSError: If a file cannot be written.
    """
    settings = swept(settings, sweep)
    threads = arguments.whole_or_none("threads", threads, 1)
    memory_bytes = arguments.whole_or_none("memory_bytes", memory_bytes, 0)
    if checked_tool(tool) is not None and out is not None:
        raise ValueError("files of results state no `tool=`: leave out `out`")
    checked = checked_study(settings)
    with (
        pending(
            settings,
            checked,
            files=(out, restart, check),
            threads=threads,
            memory_bytes=memory_bytes,
            tool=tool,
        ) as running,
        of_cases(progress) as tell,
    ):
        simulated = running.finish(threads, tell)
        warn_of(simulated)
    return Study(settings, simulated, tool)
