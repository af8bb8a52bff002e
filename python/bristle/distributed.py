"""Studies on a cluster, by Dask: ``docs/python.md``, "Clusters", has examples."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from os import PathLike

from bristle import _arguments as arguments, _bristle
from bristle._errors import warn_of
from bristle._progress import TellCases, of_cases
from bristle._settings import Section, Settings, checked_study
from bristle._study import Study, pending, swept

try:
    from distributed import CancelledError, Client, Future, as_completed, get_worker
except ModuleNotFoundError:
    raise ImportError('bristle.distributed needs Dask: pip install "./python[distributed]"')

__all__ = ["study", "ClusterError"]

_MAX_CASES_PER_TASK = 64  # Dask takes a millisecond per task, a pass takes several.


class ClusterError(RuntimeError):
    """A cluster that cannot finish a study. The text says why, and what to do."""


_cases_of: Callable[[Settings, bool], _bristle.Cases] = lru_cache(maxsize=4)(
    lambda settings, check: _bristle.Cases(settings._input, check)
)


def _simulate(cases: list[int], settings: Settings, check: bool) -> tuple[str, str]:
    """Returns the journal of some cases, and the address of the worker."""
    key = (worker := get_worker()).get_current_task()

    def stop_if_cancelled() -> None:
        task = worker.state.tasks.get(key)
        if task is None or task.state == "cancelled":
            raise RuntimeError("the study has ended")

    return _cases_of(settings, check).simulate(cases, stop_if_cancelled), worker.address


def _take(gathered: _bristle.PendingStudy, future: Future[tuple[str, str]]) -> None:
    """Adds the results of a task to the study."""
    try:
        journal, worker = future.result()
    except Exception as error:
        is_lost = isinstance(error, CancelledError)
        why = "the scheduler is lost" if is_lost else f"{type(error).__name__}: {error}"
        raise ClusterError(f"{why}\nhelp: with `out` the same call goes on") from error
    try:
        gathered.take(journal)
    except ValueError as error:
        why = f"the results of worker {worker} cannot be used: {error}"
        raise ClusterError(f"{why}\nhelp: install one build of Bristle everywhere") from error


def study(
    settings: Settings,
    sweep: Section | None = None,
    client: Client | None = None,
    *,
    out: str | PathLike[str] | None = None,
    restart: bool = False,
    check: bool = False,
    progress: bool | TellCases = True,
    memory_bytes: int | None = None,
    retries: int = 3,
) -> Study:
    """Simulates all combinations of the swept values on a cluster.

    Arguments, results, files and journal are those of :func:`bristle.study`, to the byte.
    Dask schedules the cases, and repeats those of a worker that dies. Each thread of a worker
    simulates one case at a time, so that there is no number of threads.

    Args:
        client: A client of Dask; by default the current one.
        memory_bytes: Memory of each thread of a worker.
        retries: Number of times that Dask repeats a task that fails.

    Raises:
        ClusterError: If the workers have another build of Bristle or fail, or the scheduler
            is lost. With ``out`` the same call goes on; without it the exception has a
            `bristle.PartialStudy` as ``study``, which goes on here.
    """
    if isinstance(sweep, Client):
        raise TypeError("the client comes after the sweep: study(settings, client=…)")
    client = Client.current() if client is None else client
    if client.asynchronous:
        raise TypeError("the client is asynchronous: use a Client(…) that is not")
    retries = arguments.whole("retries", retries, 0)
    settings = swept(settings, sweep)
    run = pending(
        settings,
        checked_study(settings),
        files=(out, restart, check),
        threads=1,
        memory_bytes=arguments.whole_or_none("memory_bytes", memory_bytes, 0),
    )
    with run as gathered, of_cases(progress) as tell:
        cases = gathered.waiting()
        # Four tasks for each thread, so that one that is early finds another.
        share = len(cases) // (4 * max(sum(client.nthreads().values()), 1)) + 1
        size = 1 if gathered.has_brush() else min(share, _MAX_CASES_PER_TASK)
        chunks = [cases[first : first + size] for first in range(0, len(cases), size)]
        futures = client.map(
            _simulate, chunks, settings=settings, check=check, retries=retries, pure=False
        )
        try:
            for future in as_completed(futures):
                if tell is not None:
                    tell(*gathered.counts())
                _take(gathered, future)
                # Dask would repeat it if the worker died later.
                future.release()
        finally:
            for future in futures:
                future.release()
        simulated = gathered.finish(None, tell)
        warn_of(simulated)
    return Study(settings, simulated)
