"""Tables of named NumPy arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas as pd

Column: TypeAlias = npt.NDArray[np.float64] | npt.NDArray[np.int64]


class Table(Mapping[str, "Column"]):
    """Columns of equal length by their names, which cannot be written to.

    A name is the key of the result file, with the unit at its end; whole numbers are
    integers, and all others floats.
    """

    __slots__ = ("_columns", "_units")

    def __init__(
        self, columns: Mapping[str, Column], units: Mapping[str, str]
    ) -> None:
        self._columns = columns
        self._units = units

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
        """Whether the same columns have the same values and units."""
        if not isinstance(other, Table):
            return NotImplemented
        return (
            self._units == other._units
            and list(self) == list(other)
            and all(np.array_equal(self[n], other[n], equal_nan=True) for n in self)
        )

    def __repr__(self) -> str:
        rows = len(next(iter(self._columns.values()), ()))
        return f"<Table: {rows} rows of {', '.join(self._columns)}>"

    def to_pandas(self) -> pd.DataFrame:
        """The columns as a table of pandas, which must be installed."""
        import pandas as pd

        frame = pd.DataFrame({name: np.array(self[name]) for name in self})
        frame.attrs["units"] = self.units
        return frame

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (dict(self._columns), dict(self._units)))


def _restored(columns: Mapping[str, Column], units: Mapping[str, str]) -> Table:
    for column in columns.values():
        column.flags.writeable = False
    return Table(columns, units)
