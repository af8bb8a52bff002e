"""Settings: what an input file states, checked by the program's own reader."""

from __future__ import annotations

import json
import tomllib
import warnings
from collections.abc import Mapping
from math import prod
from os import PathLike
from pathlib import PurePath
from typing import Any, Final, TypeAlias

import numpy as np
import tomli_w

from bristle import _arguments as arguments
from bristle import _bristle
from bristle._errors import SettingsError, SettingsWarning

Section: TypeAlias = Mapping[str, Any]
"""A section of an input file: its keys, with values as in the file."""

_NAME: Final = "settings"
_SECTIONS: Final[tuple[str, ...]] = (
    "tool",
    "filament",
    "contact",
    "workpiece",
    "process",
    "solver",
    "uncertainty",
    "brush",
    "removal",
    "measured",
    "goal",
    "study",
)


_MOST_ELEMENTS: Final = 1_000_000
"""The most numbers in the value of a key."""

_CONTROL_POINTS: Final = "workpiece.control_points_m"


def _plain(value: Any, path: str = "") -> Any:
    """A value as TOML knows it: NumPy arrays and numbers become lists and numbers.

    What is too large is refused before anything is copied.
    """
    if isinstance(value, np.floating):
        return float(value)
    if hasattr(value, "tolist"):
        if np.ma.is_masked(value):
            raise SettingsError(f"`{path}` has masked elements: fill them", path)
        _check_size(path, getattr(value, "shape", ()))
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            value = value.astype(float)
        return _plain(value.tolist(), path)
    if isinstance(value, Mapping):
        dot = "." if path else ""
        return {
            _text(str(key), path): _plain(item, f"{path}{dot}{key}")
            for key, item in value.items()
            if item is not None
        }
    if isinstance(value, (list, tuple, range)):
        _check_size(path, (len(value),))
        return [_plain(item, path) for item in value]
    return _text(value, path) if isinstance(value, str) else value


def _require_mapping(name: str, section: object) -> None:
    if not isinstance(section, Mapping):
        raise TypeError(f"section {name!r} is a mapping of keys, not {section!r}")


def _text(text: str, path: str) -> str:
    """A text that is Unicode."""
    if not text.isascii() and any("\ud800" <= letter <= "\udfff" for letter in text):
        key = path or None
        raise SettingsError(f"{text!r} in `{path}` is not Unicode", key)
    return text


def _check_size(path: str, shape: tuple[int, ...]) -> None:
    """Refuses an array by its shape."""
    if path == _CONTROL_POINTS and shape and shape[0] > _bristle.MAX_CONTROL_POINTS:
        most = _bristle.MAX_CONTROL_POINTS
        raise SettingsError(f"`{path}` has {shape[0]} points, at most {most}", path)
    if prod(shape) > _MOST_ELEMENTS:
        dimensions = " × ".join(str(length) for length in shape)
        raise SettingsError(
            f"`{path}` has {dimensions} elements, at most {_MOST_ELEMENTS}", path
        )


class Settings:
    """Everything that a simulation depends on; cannot be changed.

    Each argument is a section of an input file, with its keys, in SI units
    (``docs/input.md``). What is left out has its default. Values may be NumPy
    arrays, for example ``workpiece={"kind": "profile", "control_points_m":
    points}`` with points of the shape (k, 2), in m.

    Two settings are equal if they have the same values, stated or by default, and
    the same sweeps in the same order.

    >>> settings = Settings(
    ...     tool={"body_radius_m": 0.14, "width_m": 0.02, "filament_count": 10_500},
    ...     filament={"length_m": 0.04, "diameter_m": 1.18e-3},
    ...     process={"brushing_velocity_m_s": 10.0, "penetration_depth_m": 1e-3},
    ... )
    >>> deeper = settings.replace(process={"penetration_depth_m": 2e-3})
    >>> deeper.process["penetration_depth_m"]
    0.002
    >>> deeper == settings
    False
    """

    __slots__ = ("_input", "_name", "_stated", "_values")

    _stated: dict[str, dict[str, Any]]
    _name: str
    _input: _bristle.Input
    _values: str

    def __init__(
        self,
        *,
        tool: Section,
        filament: Section,
        contact: Section | None = None,
        workpiece: Section | None = None,
        process: Section | None = None,
        solver: Section | None = None,
        uncertainty: Section | None = None,
        brush: Section | None = None,
        removal: Section | None = None,
        measured: Section | None = None,
        goal: Section | None = None,
        study: Section | None = None,
    ) -> None:
        """Checks the sections of an input file.

        Args:
            tool: Radius of the body, width, number of filaments.
            filament: Length, diameter, material, number of segments.
            contact: Contact law and friction; by default without friction.
            workpiece: Shape, place and feed of the workpiece; by default a plane.
            process: Velocity or speed, depth, turns.
            solver: Tolerance and number of samples.
            uncertainty: Standard deviations of filaments and friction.
            brush: Pattern of the filaments that touch each other; ``{}`` has defaults.
            removal: Coefficients of removal and wear, and when to end, for `bristle.wear`.
            measured: ``file``, the path of a table of measured forces, and how it is written.
            goal: What a study is asked for, such as ``target_force_n``.
            study: Values of swept settings, for `bristle.study`.

        Raises:
            SettingsError: If a key or a value is not allowed, or one is missing.
        """
        sections = (
            tool,
            filament,
            contact,
            workpiece,
            process,
            solver,
            uncertainty,
            brush,
            removal,
            measured,
            goal,
            study,
        )
        self._state(dict(zip(_SECTIONS, sections, strict=True)), _NAME)

    def _state(self, sections: Mapping[str, Section | None], name: str) -> None:
        stated = _plain(sections)
        # The name of a file may have bytes that are no text.
        name = name.encode(errors="replace").decode()
        checked = _bristle.Input(tomli_w.dumps(stated), name)
        object.__setattr__(self, "_stated", stated)
        object.__setattr__(self, "_name", name)
        object.__setattr__(self, "_input", checked)
        object.__setattr__(self, "_values", checked.values())

    @classmethod
    def _of(cls, sections: Mapping[str, Section | None], name: str) -> Settings:
        settings = cls.__new__(cls)
        settings._state(sections, name)
        return settings

    @classmethod
    def paper(cls, brushing_velocity_m_s: float, penetration_depth_m: float) -> Settings:
        """The brush of Uhlmann and Hoyer (Ceramics 4, 2021) on a plane.

        Args:
            brushing_velocity_m_s: Speed of the undeformed tips, in m/s.
            penetration_depth_m: Depth of the undeformed tool in the workpiece, in m.
        """
        values = _bristle.paper(brushing_velocity_m_s, penetration_depth_m)
        return cls._of(json.loads(values), _NAME)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("settings cannot be changed: use `replace`")

    def __delattr__(self, name: str) -> None:
        raise AttributeError("settings cannot be changed: use `replace`")

    def _section(self, name: str) -> Section:
        section: Section = arguments.fixed(json.loads(self._values)[name])
        return section

    @property
    def tool(self) -> Section:
        """All values of the section ``[tool]``, defaults included."""
        return self._section("tool")

    @property
    def filament(self) -> Section:
        """All values of the section ``[filament]``, defaults included."""
        return self._section("filament")

    @property
    def contact(self) -> Section:
        """All values of the section ``[contact]``, defaults included."""
        return self._section("contact")

    @property
    def workpiece(self) -> Section:
        """All values of the section ``[workpiece]``, defaults included."""
        return self._section("workpiece")

    @property
    def process(self) -> Section:
        """All values of the section ``[process]``, defaults included."""
        return self._section("process")

    @property
    def solver(self) -> Section:
        """All values of the section ``[solver]``, defaults included."""
        return self._section("solver")

    @property
    def uncertainty(self) -> Section:
        """All values of the section ``[uncertainty]``, defaults included."""
        return self._section("uncertainty")

    @property
    def brush(self) -> Section | None:
        """All values of the section ``[brush]``; ``None`` without it."""
        return self._section("brush") if "brush" in self._stated else None

    @property
    def removal(self) -> Section | None:
        """All values of the section ``[removal]``; ``None`` without it."""
        return self._section("removal") if "removal" in self._stated else None

    @property
    def sweep(self) -> Section | None:
        """The sweeps of the section ``[study]``; ``None`` without it."""
        return arguments.fixed(self._stated["study"]) if "study" in self._stated else None

    @property
    def name(self) -> str:
        """Name of the file that they were loaded from, for titles."""
        return PurePath(self._name).name

    def replace(self, **sections: Section | None) -> Settings:
        """Returns the settings with other values of some keys.

        A key whose value is ``None`` gets its default again, and so do all keys of
        a section that is ``None``.

        Raises:
            SettingsError: If a key or a value is not allowed.
            TypeError: If there is no such section.
        """
        stated: dict[str, Section | None] = dict(self._stated)
        for name, section in sections.items():
            if name not in _SECTIONS:
                raise TypeError(f"there is no section {name!r}")
            if section is not None:
                _require_mapping(name, section)
            earlier = stated.get(name) or {}
            stated[name] = None if section is None else {**earlier, **section}
        ordered = {name: stated[name] for name in _SECTIONS if name in stated}
        return type(self)._of(ordered, self._name)

    def _swept(self, sweep: Section) -> Settings:
        """Returns the settings with these sweeps, in their order, in place of the stated ones."""
        _require_mapping("study", sweep)
        return type(self)._of({**self._stated, "study": sweep}, self._name)

    def to_toml(self) -> str:
        """Returns the stated settings as the text of an input file for the program."""
        return tomli_w.dumps(self._stated)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Settings):
            return NotImplemented
        return self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[str, bool, str]:
        """All values, whether they are enough for a contact, and the sweeps."""
        # The order of sweeps and of tools is that of the cases.
        sweeps = json.dumps(self._stated.get("study"))
        return self._values, self._input.is_single(), sweeps

    def __repr__(self) -> str:
        sections = (f"    {name}={keys!r},\n" for name, keys in self._stated.items())
        return f"Settings(\n{''.join(sections)})"

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self)._of, (self._stated, self._name))


def checked(settings: Settings) -> _bristle.Input:
    """Settings for a simulation, with a warning of what is unusual in them."""
    require(settings)
    for warning in settings._input.unusual():
        warnings.warn(warning, SettingsWarning, stacklevel=3)
    return settings._input


def require(settings: Settings) -> None:
    """Checks the type of what was passed as settings."""
    if not isinstance(settings, Settings):
        raise TypeError(
            f"settings are a bristle.Settings, not a {type(settings).__name__}: "
            "use bristle.load for a file"
        )


def checked_study(settings: Settings) -> _bristle.Input:
    """Settings for a study, with a warning of what is unusual in some case."""
    for warning in settings._input.unusual_in_study():
        warnings.warn(warning, SettingsWarning, stacklevel=3)
    return settings._input


def load(path: str | PathLike[str]) -> Settings:
    """The settings that an input file of the program states.

    A table of control points is read. The path of measured forces becomes one from here.

    Args:
        path: A TOML file; ``docs/input.md`` describes it.

    Raises:
        SettingsError: If the file is not right; with key and line.
        OSError: If it cannot be read.
    """
    file = arguments.path("path", path)
    text, points, measured = _bristle.read_input(file)
    stated = tomllib.loads(text)
    if measured is not None:
        stated["measured"]["file"] = measured
    if points is not None:
        del stated["workpiece"]["control_points_csv"]
        stated["workpiece"]["control_points_m"] = points
    ordered = {name: stated[name] for name in _SECTIONS if name in stated}
    return Settings._of(ordered, file)
