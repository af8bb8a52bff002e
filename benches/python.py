"""Cost of Python: contacts and batches of accelerations, from Python and in Rust.

    pip install ./python
    python benches/python.py

Measurements alternate between Python and the process of `benches/python.rs`, so that
both meet the same load. Each turn has a few runs, since the first one finds cold caches.
The shortest times are shown.
"""

from __future__ import annotations

import subprocess
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import bristle
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
STATES = 10_000
SEGMENTS = 25
CONTACTS = 40
RUN = 5
BATCHES = 100


class Rust:
    """The process that measures in Rust."""

    def __init__(self) -> None:
        command = ["cargo", "run", "--quiet", "--release", "-p", "bristle-benches"]
        self._process = subprocess.Popen(
            [*command, "--example", "python"],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def seconds(self, what: str) -> float:
        """Returns the time of one run, in s."""
        assert self._process.stdin is not None and self._process.stdout is not None
        print(what, file=self._process.stdin, flush=True)
        return float(self._process.stdout.readline())


def seconds(work: Callable[[], object]) -> float:
    """Returns the time of a call, in s."""
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def main() -> None:
    rust = Rust()
    # One segment is unusual.
    warnings.simplefilter("ignore", bristle.SettingsWarning)
    settings = bristle.load(ROOT / "examples" / "zirconia.toml").replace(study=None)
    one = settings.replace(filament={"segments": 1})
    for what, simulated in (("contact", settings), ("shortest", one)):
        in_rust, in_python = [], []
        for _ in range(CONTACTS):
            in_rust += [rust.seconds(what) for _ in range(RUN)]
            in_python += [
                seconds(lambda: bristle.simulate(simulated, samples=0, shapes=0).metrics)
                for _ in range(RUN)
            ]
        more = min(in_python) - min(in_rust)
        print(f"contact of {simulated.filament['segments']} segments")
        print(f"  Rust           {1e6 * min(in_rust):9.0f} µs")
        print(f"  Python         {1e6 * min(in_python):9.0f} µs, {1e6 * more:.0f} µs more")

    q = np.full((STATES, SEGMENTS, 2), [np.pi / 2, 0.0])
    q[..., 1] += 0.01 * np.arange(SEGMENTS)
    v = np.ones_like(q)
    in_rust, in_python = [], []
    for _ in range(BATCHES):
        in_rust.append(rust.seconds("batch") / STATES)
        in_python.append(
            seconds(lambda: bristle.accelerations(settings, q, v)) / STATES
        )
    share = min(in_rust) / min(in_python)
    print(f"accelerations of {SEGMENTS} segments in a batch of {STATES}, per state")
    print(f"  Rust           {1e6 * min(in_rust):9.3f} µs")
    print(f"  Python         {1e6 * min(in_python):9.3f} µs, {share:.0%} of the speed")


if __name__ == "__main__":
    main()
