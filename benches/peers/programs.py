"""Timing programs, and the set-up of a measurement."""

import json
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from paper_case import Case


class Program:
    """A timing program that answers a line with a line."""

    def __init__(self, command: Sequence[str | Path]) -> None:
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __enter__(self) -> "Program":
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin
        self._process.stdin.close()
        self._process.wait()

    def ask(self, text: str) -> str:
        """Writes a line and reads one."""
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write(text + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise RuntimeError("a timing program ended early")
        return answer


class Bristle(Program):
    """Bristle's timing program."""

    def request(self, measure: str, **values: object) -> dict:
        """Returns the answer to a request."""
        return json.loads(self.ask(json.dumps({"measure": measure, **values})))

    def contact(self, case: Case, tolerance: float) -> tuple[float, float]:
        """Seconds, and p_n in N s."""
        answer = self.request(
            "contact",
            brushing_velocity_m_s=case[0],
            penetration_depth_m=case[1],
            relative_tolerance=tolerance,
        )
        return answer["seconds"], answer["impulse"]

    def study(self, tolerance: float) -> dict:
        """Seconds and cases."""
        return self.request("study", relative_tolerance=tolerance)

    def impulses(self, tolerance: float) -> dict[Case, float]:
        """p_n of the cases of the study."""
        return {
            (case["brushing_velocity_m_s"], case["penetration_depth_m"]): case["impulse"]
            for case in self.study(tolerance)["cases"]
        }


@dataclass(frozen=True)
class Setup:
    """Programs, directory and extent of the measurements."""

    bristle: Bristle
    loops: list[Path]
    directory: Path
    quick: bool
    full: bool

    @property
    def rounds(self) -> int:
        """Number of repetitions of a short measurement."""
        return 5 if self.quick else 21
