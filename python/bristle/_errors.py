"""Exceptions and warnings, with the texts of the program."""

import warnings
from collections.abc import Iterable
from typing import Protocol


class SettingsError(ValueError):
    """Settings that cannot be used.

    The text says what is wrong, where, and what to do.
    """

    key: str | None
    """Dotted path of the setting to blame, or ``None`` if no single one is."""

    line: int | None
    """Line of the file, or of `Settings.to_toml`, counted from 1."""

    def __init__(
        self, message: str, key: str | None = None, line: int | None = None
    ) -> None:
        super().__init__(message, key, line)
        self.key = key
        self.line = line

    def __str__(self) -> str:
        return str(self.args[0])


class SimulationError(RuntimeError):
    """A simulation that cannot go on. The text says why, and what to try."""

    time_s: float | None
    """Time at which it stopped, in s, where it is known."""

    step: float | None
    """Length of the last step, in s, where it is known."""

    def __init__(
        self, message: str, time_s: float | None = None, step: float | None = None
    ) -> None:
        super().__init__(message, time_s, step)
        self.time_s = time_s
        self.step = step

    def __str__(self) -> str:
        return str(self.args[0])


class SettingsWarning(UserWarning):
    """Settings that are allowed but unusual, most of them by a slip."""


class ResultWarning(UserWarning):
    """Results that are not what they seem, and what to do about it."""


class _Simulated(Protocol):
    def warnings(self) -> list[str]: ...


def warn_of(simulated: _Simulated) -> None:
    """Warns the caller of the caller of what the program warns of."""
    warn_of_all(simulated.warnings(), 4)


def warn_of_all(messages: Iterable[str], level: int = 3) -> None:
    """Warns the caller of the caller, or one so many levels up."""
    for message in messages:
        warnings.warn(message, ResultWarning, stacklevel=level)
