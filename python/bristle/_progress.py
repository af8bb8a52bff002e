"""Progress: on one line of a terminal, elsewhere in a line now and then."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from typing import TypeAlias, TypeVar

TellCases: TypeAlias = Callable[[int, int, int], object]
"""Takes the numbers of cases that are done, of all, and of those that failed."""

TellShare: TypeAlias = Callable[[float], object]
"""Takes the share that is done, from 0 to 1."""

Tell = TypeVar("Tell", bound=Callable[..., object])

PATIENCE_S = 1.0
"""Time before which nothing is shown on a terminal."""

PAUSE_S = 0.2
"""Time between two changes of the line of a terminal."""

PAUSES_S = (10.0, 20.0, 40.0, 60.0)
"""Times between lines elsewhere, those of the program; the last one is repeated."""

WIDTH = 70
"""The line of a terminal is filled with spaces, as the one before it may be longer."""


class _Line:
    """One line of a terminal, or line after line in a notebook or a file."""

    def __init__(self) -> None:
        self._is_terminal = sys.stderr.isatty()
        self._begun = time.monotonic()
        self._due = self._begun + (PATIENCE_S if self._is_terminal else PAUSES_S[0])
        self._earlier: float | None = None
        self._shown = 0

    def tell(self, share: float, done: str, failures: str = "") -> None:
        """Shows the words for what is ``done``, the time left, and ``failures``."""
        now = time.monotonic()
        if self._earlier is None:
            self._earlier = share
        is_last = self._is_terminal and self._shown > 0 and share == 1.0
        if now < self._due and not is_last:
            return
        passed = now - self._begun
        left = ""
        if self._earlier < share < 1.0:
            seconds = passed * (1.0 - share) / (share - self._earlier)
            left = f", {_in_time(seconds + 1.0)} left"
        text = f"{done}{left}{failures}"
        self._shown += 1
        if self._is_terminal:
            self._due = now + PAUSE_S
            print(f"\r{text:<{WIDTH}}", end="", file=sys.stderr, flush=True)
        else:
            self._due += PAUSES_S[min(self._shown, len(PAUSES_S) - 1)]
            print(f"after {_in_time(passed)}: {text}", file=sys.stderr, flush=True)

    def end(self) -> None:
        """Ends the line of a terminal."""
        if self._is_terminal and self._shown > 0:
            print(file=sys.stderr)


def _in_time(seconds: float) -> str:
    """Such as ``2 min 10 s``."""
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes_of_hour = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes_of_hour} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


@contextmanager
def _shown(
    progress: bool | Tell, tell_on: Callable[[_Line], Tell]
) -> Iterator[Tell | None]:
    """Yields the function that shows progress: that of the caller, one on a line, or none."""
    if callable(progress):
        yield progress
    elif not progress:
        yield None
    else:
        line = _Line()
        try:
            yield tell_on(line)
        finally:
            line.end()


def of_cases(progress: bool | TellCases) -> AbstractContextManager[TellCases | None]:
    """Returns the function that shows the progress of a study, if there is one."""

    def tell(line: _Line, done: int, total: int, failed: int) -> None:
        failures = f", {failed} failed" if failed else ""
        line.tell(done / total, f"{done} of {total} cases", failures)

    return _shown(progress, lambda line: partial(tell, line))


def of_share(
    progress: bool | TellShare, what: str
) -> AbstractContextManager[TellShare | None]:
    """Returns the function that shows the progress of ``what``, if there is one."""

    def tell(line: _Line, share: float) -> None:
        line.tell(share, f"{100.0 * share:.0f} % of {what}")

    return _shown(progress, lambda line: partial(tell, line))
