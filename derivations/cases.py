"""The paper's tool and filament, the angles and times of a pass, and how references are written.

What enters: nothing. What leaves: constants, `Passing`, and functions for command lines and files.
There is no mechanics here. Python's library is enough for this module.
"""

import argparse
import json
import math
import multiprocessing
import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).parent.parent
DATA = ROOT / "tests" / "data"
TRAJECTORIES = Path(__file__).parent / "trajectories"

# The paper's tool and filament, and the defaults for what the paper leaves open.
BODY_RADIUS_M = 0.140
WIDTH_M = 0.020
LENGTH_M = 0.040
TOOL_RADIUS_M = BODY_RADIUS_M + LENGTH_M
DIAMETER_M = 1.18e-3
DENSITY_KG_M3 = 1110.0
YOUNGS_MODULUS_PA = 3.0e9
DAMPING_RATIO = 0.05
FIRST_CANTILEVER_ROOT = 1.8751040687
CONTACT_STIFFNESS_N_M = 1e5
REGULARISATION_M_S = 1e-3
LEAD_ANGLE_RAD = 0.005
TAIL_ANGLE_RAD = 0.15
# A millionth of it: at moderate rates inertia, gyroscopic terms, springs and dampers weigh alike.
SOFT_YOUNGS_MODULUS_PA = 3.0e3

# Below this a number of a file is zero but for rounding, in any of the units.
LEAST_VALUE = 1e-18


class Passing:
    """Angles and times of a pass over y = 0, which lies at −(R − a_e), from v_b and a_e."""

    brushing_velocity_m_s: float
    penetration_depth_m: float
    # By how much the last filament is behind the first.
    last_behind_rad = 0.0

    @property
    def rate_rad_s(self) -> float:
        """ω = v_b / R."""
        return self.brushing_velocity_m_s / TOOL_RADIUS_M

    @property
    def height_m(self) -> float:
        """Where y = 0 of the workpiece lies."""
        return self.penetration_depth_m - TOOL_RADIUS_M

    @property
    def half_angle_rad(self) -> float:
        """Half of the angle Ω_c over which the undeformed tip is below y = 0."""
        return math.acos(-self.height_m / TOOL_RADIUS_M)

    @property
    def start_angle_rad(self) -> float:
        """β_0: the first filament starts at the lead angle before it can touch."""
        return -math.pi / 2 - self.half_angle_rad - LEAD_ANGLE_RAD

    @property
    def end_s(self) -> float:
        """The last filament ends at the tail angle past its nominal exit."""
        angle = LEAD_ANGLE_RAD + 2 * self.half_angle_rad + self.last_behind_rad + TAIL_ANGLE_RAD
        return angle / self.rate_rad_s

    @property
    def ends_of_turns_s(self) -> list[float]:
        """A pass is part of one turn."""
        return [self.end_s]


@dataclass(frozen=True)
class State:
    """One instant of a chain in space, at which its equations of motion are evaluated."""

    kind: str
    youngs_modulus_pa: float
    base_angle: float  # β in rad
    base_rate: float  # ω in rad/s
    base_acceleration: float  # β̈ in rad/s²
    gravity: list[float]  # g in m/s², inertial frame
    q: list[float]  # φ_1, θ_1, …, φ_n, θ_n in rad
    v: list[float]  # their rates in rad/s


def rounded(value: object) -> object:
    """Twelve digits: more than the integrators give, and no rounding of the processor's."""
    if isinstance(value, dict):
        return {key: rounded(each) for key, each in value.items()}
    if isinstance(value, float):
        return float(f"{value:.12g}") if abs(value) > LEAST_VALUE else 0.0
    if isinstance(value, (list, tuple)) or hasattr(value, "tolist"):
        return [rounded(each) for each in value]
    return value


def compact(value: object) -> str:
    """JSON, in which a float has the fewest digits that read back as the same double."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def made_by(command: str, *packages: ModuleType) -> str:
    """How a file was made: the command of a script in this directory, and the versions."""
    versions = [f"{package.__name__} {package.__version__}" for package in packages]
    return f"python derivations/{command} (Python {platform.python_version()}, {', '.join(versions)})"


def write(path: Path, text: str) -> None:
    """Writes a file with the same bytes on every system."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def parser_of(
    description: str, output: Path, has_trajectories: bool = False
) -> argparse.ArgumentParser:
    """The command line of a script that writes cases."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--processes", type=int, default=1, help="cases computed at the same time")
    parser.add_argument(
        "--only", help="cases whose names begin with this; prints them and writes nothing"
    )
    parser.add_argument("--output", type=Path, default=output, help="JSON file to write")
    if has_trajectories:
        parser.add_argument(
            "--trajectories", type=Path, default=TRAJECTORIES, help="directory of the trajectories"
        )
    return parser


def entries_of(
    result: Callable[[Passing], dict[str, object]],
    cases: Sequence[Passing],
    arguments: argparse.Namespace,
) -> list[dict[str, object]]:
    """The entries of the chosen cases; prints those of `--only`."""
    chosen = [case for case in cases if case.name.startswith(arguments.only or "")]
    entries = []
    with multiprocessing.Pool(arguments.processes) as pool:
        for case, entry in zip(chosen, pool.imap(result, chosen, chunksize=1), strict=True):
            entries.append(entry)
            print(f"{case.name}, {case.brushing_velocity_m_s:g} m/s: done", flush=True)
    if arguments.only is not None:
        print("\n".join(map(json.dumps, entries)))
    return entries


def write_trajectories(
    text_of: Callable[[Passing], str], shown: dict[str, Passing], arguments: argparse.Namespace
) -> None:
    """Writes the trajectories of cases, by the names of their files."""
    with multiprocessing.Pool(arguments.processes) as pool:
        for name, text in zip(shown, pool.imap(text_of, shown.values()), strict=True):
            write(arguments.trajectories / name, text)


def write_cases(path: Path, origin: str, entries: Sequence[dict[str, object]], **more: str) -> None:
    """Writes a JSON file with a line per case; `more` are other sections, as JSON."""
    lines = ",\n".join(map(json.dumps, entries))
    sections = "".join(f',\n"{name}": {text}' for name, text in more.items())
    write(path, f'{{"made_by": {json.dumps(origin)},\n"cases": [\n{lines}\n]{sections}}}\n')
