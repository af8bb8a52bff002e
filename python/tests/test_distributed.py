"""Clusters: a scheduler and workers as processes of their own, some of which fail."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import bristle
import pytest

distributed = pytest.importorskip("distributed")
import bristle.distributed  # noqa: E402
from bristle.distributed import ClusterError, _Chunk, _Queue  # noqa: E402
from distributed import Client  # noqa: E402

FILES = ("runs.csv", "study.json", "report.html")
QUIET = ["--no-dashboard", "--host", "127.0.0.1"]

THOUSANDS = {
    "process.brushing_velocity_m_s": {"start": 10.0, "stop": 29.95, "step": 0.05},
    "process.penetration_depth_m": {"start": 1e-3, "stop": 3.4e-3, "step": 1e-4},
}
"""10 000 cases."""

HUNDREDS = {
    "process.brushing_velocity_m_s": {"start": 10.0, "stop": 29.5, "step": 0.5},
    "process.penetration_depth_m": {"start": 1e-3, "stop": 3.25e-3, "step": 0.25e-3},
}
"""400 cases."""


class Cluster:
    """A scheduler and workers, with one thread each, on this machine."""

    def __init__(self, directory: Path) -> None:
        self._file = directory / "scheduler.json"
        self._processes: list[subprocess.Popen[bytes]] = []
        self._port = 0
        self.scheduler = self.start_scheduler()
        self.workers = [self.start_worker() for _ in range(2)]

    def _start(self, what: str, *options: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.dask_{what}", *options, *QUIET],
            cwd=self._file.parent,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._processes.append(process)
        return process

    def start_scheduler(self) -> subprocess.Popen[bytes]:
        """Starts a scheduler at the address of the one before it, if there was one."""
        self._file.unlink(missing_ok=True)
        file, port = str(self._file), str(self._port)
        self.scheduler = self._start("scheduler", "--scheduler-file", file, "--port", port)
        with self.client() as client:
            self._port = int(client.scheduler.address.rsplit(":", 1)[1])
        return self.scheduler

    def start_worker(self) -> subprocess.Popen[bytes]:
        file = str(self._file)
        return self._start(
            "worker", "--scheduler-file", file, "--nthreads", "1", "--no-nanny"
        )

    def client(self, timeout: float = 20.0) -> Client:
        deadline = time.monotonic() + 20.0
        while not self._file.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        return Client(scheduler_file=str(self._file), timeout=timeout)

    def close(self) -> None:
        for process in self._processes:
            process.kill()
        for process in self._processes:
            process.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    directory = tmp_path / "cluster"
    directory.mkdir()
    cluster = Cluster(directory)
    yield cluster
    cluster.close()


@pytest.fixture
def coarse(settings: bristle.Settings) -> bristle.Settings:
    """A contact that takes a fraction of a millisecond."""
    return settings.replace(filament={"segments": 4})


class Once:
    """Progress that does something once a third of the cases is done."""

    def __init__(self, action: Callable[[], object]) -> None:
        self._action = action
        self.told: list[tuple[int, int, int]] = []
        self.acted = False

    def __call__(self, done: int, total: int, failed: int) -> None:
        self.told.append((done, total, failed))
        if not self.acted and total / 3 < done < total:
            self.acted = True
            self._action()


def assert_same_files(one: Path, other: Path) -> None:
    for name in FILES:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


def test_ten_thousand_cases_and_a_worker_that_is_killed(
    coarse: bristle.Settings, cluster: Cluster, tmp_path: Path
) -> None:
    kill = Once(lambda: cluster.workers[0].send_signal(signal.SIGKILL))
    with cluster.client() as client:
        client.wait_for_workers(2)
        out = tmp_path / "there"
        study = bristle.distributed.study(
            coarse, THOUSANDS, client, out=out, progress=kill, chunk_s=0.2
        )
        assert kill.acted and len(client.nthreads()) == 1
    assert len(study) == 10_000 and study.failures == 0
    done = [done for done, _, _ in kill.told]
    assert done == sorted(done) and kill.told[-1] == (10_000, 10_000, 0)
    bristle.study(coarse, THOUSANDS, out=tmp_path / "here", progress=False)
    assert_same_files(out, tmp_path / "here")


def test_a_worker_that_hangs(coarse: bristle.Settings, cluster: Cluster) -> None:
    hang = Once(lambda: cluster.workers[0].send_signal(signal.SIGSTOP))
    with cluster.client() as client:
        client.wait_for_workers(2)
        study = bristle.distributed.study(
            coarse, HUNDREDS, client, progress=hang, chunk=10, patience_s=1.0
        )
        assert hang.acted
        cluster.workers[0].send_signal(signal.SIGCONT)
    assert len(study) == 400 and study.failures == 0
    alone = bristle.study(coarse, HUNDREDS, progress=False)
    assert all((study.runs[key] == alone.runs[key]).all() for key in alone.runs)


def test_a_scheduler_that_is_restarted(
    coarse: bristle.Settings, cluster: Cluster, tmp_path: Path
) -> None:
    def restart() -> None:
        cluster.scheduler.kill()
        cluster.scheduler.wait()
        cluster.start_scheduler()
        cluster.start_worker()

    once = Once(restart)
    out = tmp_path / "there"
    with cluster.client() as client:
        client.wait_for_workers(2)
        bristle.distributed.study(
            coarse, HUNDREDS, client, out=out, progress=once, chunk=10
        )
    assert once.acted
    bristle.study(coarse, HUNDREDS, out=tmp_path / "here", progress=False)
    assert_same_files(out, tmp_path / "here")


def test_a_scheduler_that_is_lost(
    coarse: bristle.Settings, cluster: Cluster, tmp_path: Path
) -> None:
    def kill() -> None:
        cluster.scheduler.kill()
        cluster.scheduler.wait()

    out = tmp_path / "there"
    with cluster.client(timeout=2.0) as client:
        client.wait_for_workers(2)
        with pytest.raises(ClusterError, match="the connection to the scheduler is lost"):
            bristle.distributed.study(
                coarse, HUNDREDS, client, out=out, progress=Once(kill), chunk=10
            )
    assert not (out / "runs.csv").exists()
    lines = (out / "journal.jsonl").read_bytes().count(b"\n")
    assert 400 / 3 < lines < 401
    cluster.start_scheduler()
    cluster.start_worker()
    told: list[tuple[int, int, int]] = []
    with cluster.client() as client:
        bristle.distributed.study(
            coarse, HUNDREDS, client, out=out, progress=lambda *counts: told.append(counts)
        )
    assert told[0][0] == lines - 1 and told[-1] == (400, 400, 0)
    bristle.study(coarse, HUNDREDS, out=tmp_path / "here", progress=False)
    assert_same_files(out, tmp_path / "here")


def test_brushes_failures_and_the_other_way_round(
    small_brush: bristle.Settings, cluster: Cluster, tmp_path: Path
) -> None:
    depths = {"process.penetration_depth_m": [0.5e-3, 1e-3, 2e-3]}
    out = tmp_path / "there"
    failing = {"contact.stiffness_n_m": [1e300, 1e5], **depths}
    alone = small_brush.replace(brush=None)
    with cluster.client() as client:
        study = bristle.distributed.study(small_brush, depths, client, out=out)
        with pytest.warns(bristle.SettingsWarning):
            failed = bristle.distributed.study(alone, failing, client)
        with pytest.raises(bristle.SettingsError, match="cannot resume"):
            bristle.distributed.study(alone, depths, client, out=out)
    assert failed.failures == 3 and failed.runs["status"][-1] == "ok"
    local = bristle.study(small_brush, depths, out=tmp_path / "here", progress=False)
    assert_same_files(out, tmp_path / "here")
    assert (study.runs["interaction_factor"] == local.runs["interaction_factor"]).all()
    # A local study goes on from the journal of the cluster, whose cases are all done.
    (out / "runs.csv").unlink()
    bristle.study(small_brush, depths, out=out, progress=False)
    assert_same_files(out, tmp_path / "here")


def test_results_of_another_build_are_refused(coarse: bristle.Settings) -> None:
    def pending(velocities: list[float]) -> bristle._bristle.PendingStudy:
        swept = coarse.replace(study={"brushing_velocity_m_s": velocities})
        return bristle._bristle.PendingStudy(swept._input, None, False, 1, None, None)

    def journal(velocities: list[float]) -> str:
        swept = coarse.replace(study={"brushing_velocity_m_s": velocities})
        return bristle._bristle.Cases(swept._input).simulate([0], lambda: None)

    study = pending([10.0, 20.0])
    with pytest.raises(ValueError, match="another study or program"):
        study.take(journal([11.0, 20.0]))
    whole = journal([10.0, 20.0])
    with pytest.raises(ValueError, match="damaged"):
        study.take(whole[:-20])
    study.take(whole)
    assert study.counts() == (1, 2, 0)
    study.take(whole)
    assert study.counts() == (1, 2, 0)
    assert study.finish(None, None).failures() == 0
    assert study.counts() == (2, 2, 0)
    study.close()
    with pytest.raises(ValueError, match="closed"):
        study.finish(None, None)


def test_a_worker_that_stops_looking_ends(coarse: bristle.Settings) -> None:
    class Unwanted(Exception):
        pass

    def unwanted() -> None:
        raise Unwanted

    long = coarse.replace(filament={"segments": 200}, process={"turns": 50})
    swept = long.replace(study={"brushing_velocity_m_s": [10.0]})
    with pytest.raises(Unwanted):
        bristle._bristle.Cases(swept._input).simulate([0], unwanted)


def test_chunks_are_as_long_as_wanted() -> None:
    queue = _Queue([(case, case // 500, 2.0) for case in range(1000)], 16, None, 2.0)
    probe = queue.next(2)
    assert probe is not None and probe.cases == list(range(16))
    # 5 ms a case.
    queue.learn(probe, 0.08)
    assert queue.expected({0: 4.0}) == pytest.approx(0.01)
    sizes = []
    while (chunk := queue.next(2)) is not None:
        sizes.append(len(chunk.cases))
        expected = queue.expected(chunk.work)
        assert expected is not None
        queue.learn(chunk, expected)
    # A quarter of what is left for two threads, and not below 0.1 s.
    assert sum(sizes) == 984 and sizes[:3] == [246, 184, 138]
    assert min(sizes[:-1]) >= 19
    fixed = _Queue([(case, 0, 1.0) for case in range(10)], 1, 4, 2.0)
    chunks = [fixed.next(2) for _ in range(4)]
    assert [chunk and len(chunk.cases) for chunk in chunks] == [4, 4, 2, None]


def test_costs_of_kinds_are_told_apart() -> None:
    queue = _Queue([], 1, None, 1.0)
    queue.learn(_Chunk([0], {0: 1.0}), 1.0)
    assert queue.expected({1: 2.0}) == pytest.approx(2.0)
    queue.learn(_Chunk([1], {1: 1.0}), 3.0)
    queue.learn(_Chunk([2, 3], {0: 1.0, 1: 1.0}), 4.0)
    assert queue.expected({0: 1.0, 1: 1.0}) == pytest.approx(4.0)
    assert queue.expected({1: 1.0}) == pytest.approx(3.0)


def test_wrong_arguments(coarse: bristle.Settings) -> None:
    with pytest.raises(ValueError, match="No clients found"):
        bristle.distributed.study(coarse, HUNDREDS)
    with Client(processes=False, n_workers=0, dashboard_address=None) as client:
        with pytest.raises(ValueError, match="chunk must be at least 1"):
            bristle.distributed.study(coarse, HUNDREDS, client, chunk=0)
        with pytest.raises(ValueError, match="retries must be at most 1000"):
            bristle.distributed.study(coarse, HUNDREDS, client, retries=10**30)
        with pytest.raises(ValueError, match="patience_s must be a positive number"):
            bristle.distributed.study(coarse, HUNDREDS, client, patience_s=0.0)
        with pytest.raises(TypeError, match="after the sweep"):
            bristle.distributed.study(coarse, client)


def test_nothing_is_left_of_a_study_that_is_interrupted(
    coarse: bristle.Settings, cluster: Cluster
) -> None:
    long = coarse.replace(filament={"segments": 200}, process={"turns": 50})
    with cluster.client() as client:
        client.wait_for_workers(2)
        handler = signal.signal(signal.SIGALRM, signal.default_int_handler)
        try:
            signal.setitimer(signal.ITIMER_REAL, 2.0)
            with pytest.raises(KeyboardInterrupt):
                bristle.distributed.study(long, HUNDREDS, client)
        finally:
            signal.signal(signal.SIGALRM, handler)
        deadline = time.monotonic() + 10.0
        while any(client.processing().values()) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not any(client.processing().values())
        assert client.submit(os.getpid).result(timeout=5.0) > 0
