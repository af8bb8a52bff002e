"""Tables of named NumPy arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, TypeAlias, TypedDict

import numpy as np
import numpy.typing as npt

from bristle import _bristle
from bristle._settings import Settings
from bristle._tool import Tool

if TYPE_CHECKING:
    import pandas as pd

Column: TypeAlias = npt.NDArray[Any]
"""Floats, whole numbers, or text."""


class Description(TypedDict):
    """Description of a column of a study."""

    unit: str
    """Its SI unit; empty if it has none."""
    name: str
    """In words."""
    label: str
    """For an axis, with the unit in which people read it."""
    factor: float
    """From its SI unit to that unit."""


class Table(Mapping[str, "Column"]):
    """Columns of equal length by their names, which cannot be written to.

    A name is the key of the result file, with the unit at its end; whole numbers are
    integers, other numbers floats.
    """

    __slots__ = ("_columns", "_settings", "_tool", "_units")

    def __init__(
        self,
        columns: Mapping[str, Column],
        units: Mapping[str, str],
        settings: Settings,
        tool: Tool | None = None,
    ) -> None:
        for column in columns.values():
            column.flags.writeable = False
        self._columns = columns
        self._units = units
        self._settings = settings
        self._tool = tool

    @property
    def units(self) -> Mapping[str, str]:
        """SI unit of each column; empty if it has none."""
        return dict(self._units)

    def __getitem__(self, name: str) -> Column:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __eq__(self, other: object) -> bool:
        """Returns ``True`` if the same columns have the same values and units."""
        if not isinstance(other, Table):
            return NotImplemented
        return (
            self._units == other._units
            and list(self) == list(other)
            and all(_are_equal(self[name], other[name]) for name in self)
        )

    def __repr__(self) -> str:
        rows = len(next(iter(self._columns.values()), ()))
        return f"<Table: {rows} rows of {', '.join(self._columns)}>"

    def to_pandas(self) -> pd.DataFrame:
        """The columns as a table of pandas, which must be installed.

        Its ``attrs`` are ``units``, ``bristle_version`` and ``settings``, the text of an
        input file.
        """
        import pandas as pd

        frame = pd.DataFrame({name: np.array(self[name]) for name in self})
        frame.attrs.update(units=self.units, **attributes(self._settings, self._tool))
        return frame

    def __reduce__(self) -> tuple[Any, ...]:
        columns, units = dict(self._columns), dict(self._units)
        return (type(self), (columns, units, self._settings, self._tool))


def _are_equal(one: Column, other: Column) -> bool:
    return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")


def attributes(settings: Settings, tool: Tool | None) -> dict[str, str]:
    """Where results come from, for tables and grids that are read without Bristle."""
    own = {} if tool is None else {"tool": repr(tool)}
    version = _bristle.__version__
    return {"bristle_version": version, "settings": settings.to_toml(), **own}
