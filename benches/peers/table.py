"""The table: lines of times that are measured in turns, and their ratios."""

import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import median


@dataclass
class Line:
    """One line of the table: the values of all rounds, in s."""

    name: str
    note: str = ""
    values: list[float] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)

    @property
    def value(self) -> float:
        """Median."""
        return median(self.values)

    def cells(self) -> list[str]:
        """Returns the cells of the table, without the first one."""
        if not self.values:
            return [self.name, "", "", self.note]
        ratio = f"{median(self.ratios):.3g}" if self.ratios else ""
        return [self.name, shown(self.value), ratio, self.note]

    def record(self) -> dict[str, object]:
        """Returns the line for --json."""
        record: dict[str, object] = {"name": self.name, "remarks": self.note}
        if self.values:
            record |= {"unit": "s", "median": self.value, "rounds": self.values}
        if self.ratios:
            record |= {"ratio": median(self.ratios), "ratios": self.ratios}
        return record


@dataclass
class Group:
    """Lines that are measured in turns; ratios are to the first of them."""

    title: str
    lines: list[Line] = field(default_factory=list)

    def rows(self) -> str:
        """Returns the rows of the table."""
        text = ""
        for i, line in enumerate(self.lines):
            text += f"| {' | '.join([self.title if i == 0 else '', *line.cells()])} |\n"
        return text


HEADER = "| what | code | median | ratio | remarks |\n|---|---|---:|---:|---|\n"


def shown(seconds: float) -> str:
    """Formats three digits, in a unit that fits."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


Measured = tuple[Line, Callable[[], float]]


def interleaved(measured: Sequence[Measured], rounds: int) -> list[Line]:
    """Measures every line once a round; ratios are to the first one."""
    for _ in range(rounds):
        for line, measure in measured:
            line.values.append(measure())
    lines = [line for line, _ in measured]
    for line in lines[1:]:
        pairs = zip(line.values, lines[0].values, strict=True)
        line.ratios = [own / first for own, first in pairs]
    return lines


def shortest(seconds: Callable[[], float]) -> float:
    """Returns the shortest time of some passes, by which variants are chosen."""
    return min(seconds() for _ in range(5))


def timed(calls: int, function: Callable[..., object], *arguments: object) -> Callable[[], float]:
    """Measures the seconds of a call, as the mean of `calls`."""

    def seconds() -> float:
        start = time.perf_counter()
        for _ in range(calls):
            function(*arguments)
        return (time.perf_counter() - start) / calls

    return seconds


class Peers:
    """The available lines of a group."""

    def __init__(self) -> None:
        self.measured: list[Measured] = []
        self.left_out: list[Line] = []

    def add(self, name: str, prepare: Callable[[], list[Measured]]) -> None:
        """Adds the lines that `prepare` makes, or one with the reason for their absence."""
        progress(f"preparing {name}")
        try:
            self.measured += prepare()
        except Exception as error:  # Whatever it is, it is this peer's, and the others go on.
            traceback.print_exc()
            reason = " ".join(str(error).split())[:160]
            self.left_out.append(Line(name, f"left out: {type(error).__name__}: {reason}"))

    def group(self, title: str, first: Measured, rounds: int) -> Group:
        """Measures the lines in turns with the first one, and adds the missing ones."""
        return Group(title, interleaved([first, *self.measured], rounds) + self.left_out)


def progress(text: str) -> None:
    """Writes to standard error: the table is the output."""
    print(f"peers: {text}", file=sys.stderr, flush=True)
