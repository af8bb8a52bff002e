"""Figures of matplotlib without pyplot, which notebooks show by themselves."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias, cast

from matplotlib.figure import Figure as PlainFigure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Placed: TypeAlias = "Axes | Sequence[Axes] | None"
"""Axes to draw on: one, as many as there are diagrams, or ``None`` for a new figure."""


class Figure(PlainFigure):
    """A figure that a notebook shows, whether or not pyplot was imported."""

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        self.savefig(file, format="png")
        return file.getvalue()


def diagrams(
    ax: Placed, count: int, size: tuple[float, float], *, side_by_side: bool = False
) -> tuple[PlainFigure, list[Axes]]:
    """The axes of ``count`` diagrams with their figure: those of the caller, or new ones.

    Raises:
        ValueError: If the caller has another number of axes.
    """
    if ax is None:
        figure = Figure(figsize=size, layout="constrained")
        shape = (1, count) if side_by_side else (count, 1)
        return figure, list(figure.subplots(*shape, squeeze=False).flat)
    given: list[Any] = [ax] if hasattr(ax, "plot") else list(cast("Sequence[Any]", ax))
    if len(given) != count:
        raise ValueError(f"ax needs {count} axes of matplotlib, not {len(given)}")
    return given[0].figure.figure, given


def beside(axes: Axes, title: str | None = None) -> None:
    """Draws the legend to the right of the axes, where no curve is."""
    axes.legend(title=title, loc="upper left", bbox_to_anchor=(1.0, 1.0))
