"""The measurements of run.py: alternates between Bristle and other codes, and prints one table.

Every time is the median over rounds; in each round everything of a group is measured once, so a
slow spell of the machine meets all. A ratio is the median over the rounds of the ratio within one.

A peer whose package is missing, or that computes something else than Bristle, has a line that says
so in place of its time.
"""

import argparse
import json
import os
import platform
import subprocess
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from accelerations import accelerations
from contact import one_contact
from programs import Bristle, Setup
from rows import rows
from study import study
from table import HEADER, Group, progress

# Peers' lines begin with these names; the first is asked for its version.
PACKAGES = ("casadi", "mujoco", "numpy", "pin")

GROUPS: dict[str, Callable[[Setup], list[Group]]] = {
    "accelerations": accelerations,
    "contact": one_contact,
    "row": rows,
    "study": study,
}


def machine() -> dict[str, object]:
    """Processor, cores, load and versions."""
    model = platform.processor() or "unknown processor"
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line for line in cpuinfo.read_text().splitlines() if line.startswith("model name")]
        model = names[0].split(":", 1)[1].strip() if names else model
    versions = {"Python": platform.python_version()}
    for name in PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "missing"
    for name in ("rustc", "cc"):
        try:
            found = subprocess.run([name, "--version"], capture_output=True, text=True, check=True)
            versions[name] = found.stdout.splitlines()[0].strip().removeprefix(f"{name} ")
        except (OSError, subprocess.CalledProcessError):
            versions[name] = "missing"
    load = os.getloadavg()[0]
    return {"processor": model, "cores": os.cpu_count(), "load": load, "versions": versions}


def markdown(before: dict, groups: list[Group]) -> str:
    """The table, with the machine above it."""
    versions = ", ".join(f"{name} {text}" for name, text in before["versions"].items())
    return (
        f"{before['processor']}, {before['cores']} cores, load {before['load']:.1f} before; "
        f"{versions}.\n\n{HEADER}{''.join(group.rows() for group in groups)}"
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Called by run.py.")
    parser.add_argument("--bristle", type=Path, required=True, help="its timing program")
    parser.add_argument(
        "--loop", type=Path, action="append", default=[], help="Pinocchio's timing programs"
    )
    parser.add_argument("--directory", type=Path, required=True, help="for what is compiled")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--only", choices=GROUPS, action="append")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--full", action="store_true")
    arguments = parser.parse_args()

    before, groups = machine(), []
    with Bristle([arguments.bristle]) as bristle:
        setup = Setup(
            bristle,
            arguments.loop,
            arguments.directory,
            arguments.quick,
            arguments.full,
        )
        for name, measure in GROUPS.items():
            if arguments.only and name not in arguments.only:
                continue
            start = time.perf_counter()
            groups += measure(setup)
            progress(f"{name} took {time.perf_counter() - start:.0f} s")
    text = markdown(before, groups)
    print(text)
    if arguments.out:
        arguments.out.write_text(text, encoding="utf-8", newline="\n")
    if arguments.json:
        record = {
            "machine": before,
            "groups": [
                {"what": group.title, "lines": [line.record() for line in group.lines]}
                for group in groups
            ],
        }
        document = json.dumps(record, indent=1, ensure_ascii=False)
        arguments.json.write_text(document + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
