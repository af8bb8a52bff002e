"""What Python costs: contacts and batches of accelerations, from Python and in Rust.

    pip install ./python
    python benches/python.py

Measurements alternate between Python and the process of `benches/peers/bristle.rs`, so
that both meet the same load. The shortest times are shown.
"""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import bristle
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
STATES = 10_000
SEGMENTS = 25
CONTACTS = 100
BATCHES = 20


class Rust:
    """The process that measures in Rust."""

    def __init__(self) -> None:
        command = ["cargo", "run", "--quiet", "--release", "-p", "bristle-benches"]
        self._process = subprocess.Popen(
            [*command, "--example", "peers"],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def seconds(self, request: dict[str, object]) -> float:
        """The time that a request takes, in s."""
        assert self._process.stdin is not None and self._process.stdout is not None
        print(json.dumps(request), file=self._process.stdin, flush=True)
        return float(json.loads(self._process.stdout.readline())["seconds"])


def seconds(work: Callable[[], object]) -> float:
    """The time that a call takes, in s."""
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def main() -> None:
    rust = Rust()
    settings = bristle.load(ROOT / "examples" / "zirconia.toml").replace(study=None)
    contact: dict[str, object] = {
        "measure": "contact",
        "brushing_velocity_m_s": settings.process["brushing_velocity_m_s"],
        "penetration_depth_m": settings.process["penetration_depth_m"],
        "relative_tolerance": settings.solver["relative_tolerance"],
    }
    in_rust, in_python = [], []
    for _ in range(CONTACTS):
        in_rust.append(rust.seconds(contact))
        in_python.append(
            seconds(lambda: bristle.simulate(settings, samples=0, shapes=0).metrics)
        )
    more = min(in_python) - min(in_rust)
    print(f"contact, Rust    {1e6 * min(in_rust):9.0f} µs")
    print(f"contact, Python  {1e6 * min(in_python):9.0f} µs, {1e6 * more:.0f} µs more")

    random = np.random.default_rng(1)
    q = np.full((STATES, SEGMENTS, 2), [np.pi / 2, 0.0])
    q += random.uniform(-0.1, 0.1, q.shape)
    v = random.uniform(-10.0, 10.0, q.shape)
    base = {"base_angle": 0.0, "base_rate": 50.0, "base_acceleration": 0.0}
    states = [
        {**base, "gravity": [0.0, 0.0, 0.0], "q": angles.tolist(), "v": rates.tolist()}
        for angles, rates in zip(q, v, strict=True)
    ]
    batch: dict[str, object] = {"measure": "batch", "states": states, "calls": 10}
    in_rust, in_python = [], []
    for _ in range(BATCHES):
        in_rust.append(rust.seconds(batch))
        for _ in range(10):
            in_python.append(
                seconds(
                    lambda: bristle.accelerations(settings, q, v, base_rate_rad_s=50.0)
                )
                / STATES
            )
    share = min(in_rust) / min(in_python)
    print(f"acceleration of {SEGMENTS} segments in a batch of {STATES}, a state:")
    print(f"  Rust           {1e6 * min(in_rust):9.3f} µs")
    print(f"  Python         {1e6 * min(in_python):9.3f} µs, {share:.0%} of the speed")


if __name__ == "__main__":
    main()
