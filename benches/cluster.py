"""What a cluster costs: a study with Dask on this machine, and by threads alone.

    pip install "./python[distributed]"
    python benches/cluster.py

Scheduler and workers are processes of their own. Measurements alternate, and the
shortest times are shown.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import bristle
import bristle.distributed
from distributed import Client

ROOT = Path(__file__).resolve().parent.parent
CHUNK = 1000
ROUNDS = 3
SWEEP = {
    "process.brushing_velocity_m_s": {"start": 10.0, "stop": 29.9, "step": 0.1},
    "process.penetration_depth_m": {"start": 1e-3, "stop": 3.45e-3, "step": 5e-5},
}
"""10 000 cases."""


def dask(what: str, directory: str, *options: str) -> subprocess.Popen[bytes]:
    """Starts a process of Dask, whose scheduler is named in a file of a directory."""
    file = ["--scheduler-file", f"{directory}/scheduler.json"]
    command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *file, *options]
    quiet = ["--host", "127.0.0.1", "--no-dashboard"]
    return subprocess.Popen([*command, *quiet], stderr=subprocess.DEVNULL)


def seconds(work: Callable[[], object]) -> float:
    """The time that a call takes, in s."""
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def main() -> None:
    settings = bristle.load(ROOT / "examples" / "zirconia.toml")
    cases = len(bristle.study(settings, SWEEP, progress=False))
    shortest: dict[tuple[str, int], float] = {}
    for _ in range(ROUNDS):
        for number in (1, 2):
            with TemporaryDirectory() as directory:
                processes = [dask("scheduler", directory, "--port", "0")]
                while not Path(directory, "scheduler.json").exists():
                    time.sleep(0.05)
                worker = ("--nthreads", "1", "--no-nanny")
                processes += [dask("worker", directory, *worker) for _ in range(number)]
                with Client(scheduler_file=f"{directory}/scheduler.json") as client:
                    client.wait_for_workers(number)
                    # The workers import the package before anything is measured.
                    bristle.distributed.study(settings, client=client, chunk=10)
                    there = seconds(
                        lambda: bristle.distributed.study(
                            settings, SWEEP, client, chunk=CHUNK, progress=False
                        )
                    )
                for process in processes:
                    process.kill()
                    process.wait()
            here = seconds(lambda: bristle.study(settings, SWEEP, threads=number, progress=False))
            for key, measured in ((("Dask", number), there), (("threads", number), here)):
                shortest[key] = min(measured, shortest.get(key, measured))
    print(f"{cases} cases, {CHUNK} a chunk")
    for (what, number), measured in sorted(shortest.items()):
        print(f"{what:8} {number}  {measured:6.2f} s, {1e3 * measured / cases:.3f} ms a case")
    overhead = shortest["Dask", 1] / shortest["threads", 1] - 1.0
    print(f"one worker over one thread: {overhead:.1%} more")
    for what in ("Dask", "threads"):
        efficiency = shortest[what, 1] / (2.0 * shortest[what, 2])
        print(f"efficiency of two, {what}: {efficiency:.2f}")
    efficiency = shortest["threads", 1] / (2.0 * shortest["Dask", 2])
    print(f"two workers over one thread: {efficiency:.2f}")


if __name__ == "__main__":
    main()
