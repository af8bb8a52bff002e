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
from bristle.distributed import ClusterError  # noqa: E402
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
        return self._start("worker", "--scheduler-file", file, "--nthreads", "1", "--no-nanny")

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
        study = bristle.distributed.study(coarse, THOUSANDS, client, out=out, progress=kill)
        assert kill.acted and len(client.nthreads()) == 1
    assert len(study) == 10_000 and study.failures == 0
    done = [done for done, _, _ in kill.told]
    assert done == sorted(done) and kill.told[-1] == (10_000, 10_000, 0)
    bristle.study(coarse, THOUSANDS, out=tmp_path / "here", progress=False)
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
        with pytest.raises(ClusterError, match="the scheduler is lost"):
            bristle.distributed.study(coarse, HUNDREDS, client, out=out, progress=Once(kill))
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
    assert failed.failures == 3 and failed.runs["status"][-1] == "ok"
    local = bristle.study(small_brush, depths, out=tmp_path / "here", progress=False)
    assert_same_files(out, tmp_path / "here")
    assert (study.runs["interaction_factor"] == local.runs["interaction_factor"]).all()
    # A local study goes on from the journal of the cluster, whose cases are all done.
    (out / "runs.csv").unlink()
    bristle.study(small_brush, depths, out=out, progress=False)
    assert_same_files(out, tmp_path / "here")


def journal_of(settings: bristle.Settings, velocities: list[float]) -> str:
    """Journal of the first case of a study."""
    swept = settings.replace(study={"brushing_velocity_m_s": velocities})
    return bristle._bristle.Cases(swept._input, False).simulate([0], lambda: None)


def of_another_version(journal: str) -> str:
    """Returns the journal in another format."""
    assert '"format":2' in journal
    return journal.replace('"format":2', '"format":9')


def test_results_of_another_build_are_refused(coarse: bristle.Settings) -> None:
    swept = coarse.replace(study={"brushing_velocity_m_s": [10.0, 20.0]})
    study = bristle._bristle.PendingStudy(swept._input, (None, False, False), 1, None, None)
    with pytest.raises(ValueError, match="another version of Bristle"):
        study.take(of_another_version(journal_of(coarse, [10.0, 20.0])))
    # Results of other settings are none of this study.
    study.take(journal_of(coarse, [11.0, 20.0]))
    assert study.counts() == (0, 2, 0)
    whole = journal_of(coarse, [10.0, 20.0])
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


def test_workers_of_another_build_and_workers_that_fail(
    coarse: bristle.Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep = {"process.brushing_velocity_m_s": [10.0, 20.0]}
    other = of_another_version(journal_of(coarse, [10.0, 20.0]))

    def simulate_elsewhere(cases: list[int], settings: object, check: bool) -> tuple[str, str]:
        return other, "tcp://other"

    def fail(cases: list[int], settings: object, check: bool) -> tuple[str, str]:
        raise OSError("no memory")

    with Client(processes=False, n_workers=1, dashboard_address=None) as client:
        monkeypatch.setattr(bristle.distributed, "_simulate", simulate_elsewhere)
        with pytest.raises(ClusterError, match="worker tcp://other .* another version of Bristle"):
            bristle.distributed.study(coarse, sweep, client)
        monkeypatch.setattr(bristle.distributed, "_simulate", fail)
        with pytest.raises(ClusterError, match="OSError: no memory"):
            bristle.distributed.study(coarse, sweep, client, retries=1)


def test_a_worker_that_stops_looking_ends(coarse: bristle.Settings) -> None:
    class Unwanted(Exception):
        pass

    def unwanted() -> None:
        raise Unwanted

    long = coarse.replace(filament={"segments": 200}, process={"turns": 50})
    swept = long.replace(study={"brushing_velocity_m_s": [10.0]})
    with pytest.raises(Unwanted):
        bristle._bristle.Cases(swept._input, False).simulate([0], unwanted)


def test_wrong_arguments(coarse: bristle.Settings) -> None:
    with pytest.raises(ValueError, match="No clients found"):
        bristle.distributed.study(coarse, HUNDREDS)
    with Client(processes=False, n_workers=0, dashboard_address=None) as client:
        with pytest.raises(ValueError, match="retries must be at least 0"):
            bristle.distributed.study(coarse, HUNDREDS, client, retries=-1)
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
