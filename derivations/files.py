"""Reference files: rounding, writing and comparing numbers.

There is no mechanics here.
"""

import json
import platform
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType

import numpy as np

DATA = Path(__file__).parent.parent / "tests" / "data"
TRAJECTORY_FOLDER = Path(__file__).parent / "trajectories"

# Magnitude below which a number is a rounding error, in any of the units.
LEAST_VALUE = 1e-18
# Keys whose values describe the run and not the motion.
OF_RUN = ("own_error", "changes_of_touch", "jumps_of_nearest_points", "largest_jump_of_force_n")


def rounded(value: object) -> object:
    """Returns a value with twelve digits: more than the integrators give."""
    if isinstance(value, dict):
        return {key: rounded(each) for key, each in value.items()}
    if isinstance(value, float):
        return float(f"{value:.12g}") if abs(value) > LEAST_VALUE else 0.0
    if isinstance(value, (list, tuple)) or hasattr(value, "tolist"):
        return [rounded(each) for each in value]
    return value


def made_by(command: str, *packages: ModuleType) -> str:
    """Returns the command of a script in this directory, and the versions."""
    versions = [f"{package.__name__} {package.__version__}" for package in packages]
    return (
        f"python derivations/{command} (Python {platform.python_version()}, {', '.join(versions)})"
    )


def write(path: Path, text: str) -> None:
    """Writes a file with the same bytes on every system."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def write_cases(path: Path, origin: str, entries: Sequence[dict[str, object]], **more: str) -> None:
    """Writes a JSON file with a line per case; `more` are other sections, as JSON."""
    lines = ",\n".join(map(json.dumps, entries))
    sections = "".join(f',\n"{name}": {text}' for name, text in more.items())
    write(path, f'{{"made_by": {json.dumps(origin)},\n"cases": [\n{lines}\n]{sections}}}\n')


def table_text(
    comments: Sequence[str], columns: Sequence[str], table: np.ndarray, least: float = 0.0
) -> str:
    """Returns a CSV file, in which numbers up to `least` are zero."""
    table = np.where(np.abs(table) > least, table, 0.0)
    lines = [*(f"# {comment}" for comment in comments), ",".join(columns)]
    lines += [",".join(f"{value:.12g}" for value in row) for row in table]
    return "\n".join(lines) + "\n"


def read_table(path: Path) -> tuple[list[str], np.ndarray]:
    """Reads a CSV file: its columns, and its rows as a matrix."""
    lines = path.read_text(encoding="utf-8").splitlines()
    columns, *rows = (line.split(",") for line in lines if not line.startswith("#"))
    return columns, np.array(rows, dtype=float)


def differences(columns: Sequence[str], table: np.ndarray, other: np.ndarray) -> str:
    """Returns the largest difference in each column but the first, with its name."""
    largest = np.max(np.abs(table - other), axis=0)[1:]
    return ", ".join(
        f"{name} {error:.1g}" for name, error in zip(columns[1:], largest, strict=True)
    )


def scale_of(key: str, value: np.ndarray, siblings: dict[str, object]) -> float:
    """Returns the scale of a difference; `siblings` are the values beside it.

    Impulses are relative to the normal impulse, tips to a filament of 40 mm, and the work on edges
    to the whole. Angles of edges are not scaled.
    """
    if key.startswith("edge_work_angle"):
        return 1.0
    if key.startswith("final_tip_m"):
        return 0.040
    if key == "edge_sliding_work_j":
        return siblings["sliding_work_j"]
    if "impulse" in key and not key.startswith("turn"):
        normal = siblings.get("contact_normal_impulse_n_s", siblings.get("normal_impulse_n_s"))
        # The radius of the paper's tool.
        return normal * (0.180 if "angular" in key else 1.0)
    return float(np.linalg.norm(value))


def relative_differences(
    entry: object, other: object, path: tuple[str, ...] = (), siblings: object = None
) -> Iterator[tuple[tuple[str, ...], float]]:
    """Yields the relative difference of every number of `entry` that `other` has, with its path.

    Different texts, counts and statements are infinitely far apart.
    """
    if isinstance(entry, dict):
        for key, value in entry.items():
            if key in other and not key.startswith(OF_RUN):
                yield from relative_differences(value, other[key], (*path, key), entry)
    elif isinstance(entry, list) and entry and isinstance(entry[0], dict):
        if len(entry) != len(other):
            yield path, np.inf
        for one, another in zip(entry, other, strict=False):
            yield from relative_differences(one, another, path)
    elif isinstance(entry, (float, list, tuple)) and not isinstance(other, str):
        value, expected = np.array(entry, dtype=float), np.array(other, dtype=float)
        if value.shape != expected.shape:
            yield path, np.inf
            return
        change = float(np.linalg.norm(value - expected))
        # Without friction its work is a rounding error.
        significant = change > LEAST_VALUE
        yield path, change / abs(scale_of(path[-1], value, siblings)) if significant else 0.0
    elif entry != other:
        yield path, np.inf
