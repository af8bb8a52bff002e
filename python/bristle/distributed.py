"""Studies on a cluster, by Dask distributed.

Dask is an extra: ``pip install "./python[distributed]"``, on all machines.

    from dask.distributed import Client
    import bristle
    import bristle.distributed

    client = Client("tcp://head:8786")
    settings = bristle.load("study.toml")
    study = bristle.distributed.study(settings, client=client, out="results")

``docs/clusters.md`` says how to start schedulers and workers.
"""

from __future__ import annotations

import time
from collections import defaultdict, deque
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count
from os import PathLike
from queue import Empty, SimpleQueue
from typing import TypeAlias
from uuid import uuid4

from bristle import _arguments as arguments
from bristle import _bristle
from bristle._errors import warn_of
from bristle._progress import TellCases, of_cases
from bristle._settings import Section, Settings, checked_study
from bristle._study import Study, pending, swept

try:
    from distributed import CancelledError, Client, Future, get_worker
except ModuleNotFoundError:
    raise ImportError(
        'bristle.distributed needs Dask: pip install "./python[distributed]"'
    )

__all__ = ["study", "ClusterError"]

_PROBE = 16
"""Cases of a chunk whose cost is not known yet; a brush is a chunk of its own."""

_SHORTEST_S = 0.1
"""Chunks get shorter towards the end of a study, but not shorter than this."""

_WAITING = 2
"""Chunks under way per thread of the workers: one runs while the next is sent."""

_LOOK_S = 0.5
"""Time between two looks at the workers."""

_FETCH_S = 2.0
"""Time that results may take from a worker before others are looked at."""

_PAUSE_S = 0.1
"""Time between two looks at a client that connects again."""

_MOST_RETRIES = 1000
"""The most times that a chunk that fails is tried again."""

_LATE = 5.0
"""A chunk is late if it takes this many times as long as others of its kind."""


_Reply: TypeAlias = tuple[str, float, str]
"""The journal of some cases, the time that they took in s, and the worker's address."""


class ClusterError(RuntimeError):
    """A cluster that cannot finish a study. The text says why, and what to do."""


class _Unwanted(Exception):
    """A chunk whose results nobody waits for any more."""


_known: dict[Settings, _bristle.Cases] = {}
"""On a worker: the studies that it has been sent."""

_KNOWN = 4
"""The number of those that are kept."""


def _simulate(settings: Settings, cases: list[int]) -> _Reply:
    """Simulates some cases on a worker."""
    worker = get_worker()
    key = worker.get_current_task()

    def look() -> None:
        task = worker.state.tasks.get(key)
        if task is None or task.state == "cancelled":
            raise _Unwanted

    begun = time.perf_counter()
    known = _known.get(settings)
    if known is None:
        if len(_known) >= _KNOWN:
            _known.clear()
        known = _known[settings] = _bristle.Cases(settings._input)
    journal = known.simulate(cases, look)
    return journal, time.perf_counter() - begun, worker.address


@dataclass
class _Chunk:
    """Cases that one thread of a worker simulates."""

    cases: list[int] = field(default_factory=list)
    work: dict[int, float] = field(default_factory=dict)
    """By the numbers of the kinds."""
    attempts: dict[str, _Attempt] = field(default_factory=dict)
    """By the keys of Dask's tasks, the latest last."""


@dataclass
class _Attempt:
    future: Future[_Reply]
    worker: str | None = None
    """Address of the worker that was seen to have it last."""
    begun: float | None = None
    """When it was first seen there, by the monotonic clock."""


class _Queue:
    """The cases to be simulated, cut into chunks by what others have cost."""

    def __init__(
        self,
        waiting: Iterable[tuple[int, int, float]],
        probe: int,
        size: int | None,
        seconds: float,
    ) -> None:
        self._waiting = deque(waiting)
        self._left: dict[int, float] = defaultdict(float)
        for _, kind, work in self._waiting:
            self._left[kind] += work
        self._probe = probe
        self._size = size
        self._seconds = seconds
        self._spent: dict[int, float] = defaultdict(float)
        self._done: dict[int, float] = defaultdict(float)

    def learn(self, chunk: _Chunk, seconds: float) -> None:
        """Takes the time that a chunk has cost."""
        expected = self.expected(chunk.work)
        for kind, work in chunk.work.items():
            of_kind = self.expected({kind: work})
            share = 1.0 if not expected or of_kind is None else of_kind / expected
            self._spent[kind] += share * seconds
            self._done[kind] += work

    def expected(self, works: Mapping[int, float]) -> float | None:
        """The time that work of some kinds takes, in s, once any has been done."""
        if not self._spent:
            return None
        overall = sum(self._spent.values()) / sum(self._done.values())
        return sum(
            work * (self._spent[kind] / self._done[kind] if kind in self._done else overall)
            for kind, work in works.items()
        )

    def next(self, threads: int) -> _Chunk | None:
        """The next chunk for workers with so many threads together."""
        left = self.expected(self._left)
        limit = self._seconds
        if left is not None:
            limit = min(limit, max(left / (_WAITING * max(threads, 1)), _SHORTEST_S))
        chunk = _Chunk()
        expected = 0.0
        while self._waiting:
            case, kind, work = self._waiting[0]
            cost = self.expected({kind: work})
            if self._size is not None or cost is None:
                is_full = len(chunk.cases) == (self._size or self._probe)
            else:
                is_full = bool(chunk.cases) and expected + cost > limit
            if is_full:
                break
            self._waiting.popleft()
            self._left[kind] -= work
            expected += cost or 0.0
            chunk.cases.append(case)
            chunk.work[kind] = chunk.work.get(kind, 0.0) + work
        return chunk if chunk.cases else None


@dataclass
class _Dispatch:
    """Sends the chunks of a study to the workers, and gathers their results."""

    _settings: Settings
    _gathered: _bristle.PendingStudy
    _client: Client
    _queue: _Queue
    _tell: TellCases | None
    _retries: int
    _patience: float

    def __post_init__(self) -> None:
        self._name = f"bristle-{uuid4().hex}"
        self._numbers = count()
        self._under_way: dict[str, _Chunk] = {}
        self._done: SimpleQueue[Future[_Reply]] = SimpleQueue()
        self._threads: dict[str, int] = {}
        self._hanging: dict[str, float] = {}
        self._looked = float("-inf")

    def run(self) -> None:
        """Returns once all cases have results."""
        try:
            self._report()
            while True:
                self._look()
                self._send_waiting()
                if not self._under_way:
                    return
                try:
                    self._take(self._done.get(timeout=_LOOK_S))
                except Empty:
                    continue
                self._report()
        finally:
            self._forget(list(self._under_way))

    def _report(self) -> None:
        if self._tell is not None:
            self._tell(*self._gathered.counts())

    def _answering(self) -> list[str]:
        """Addresses of the workers that do not hang."""
        return [address for address in self._threads if address not in self._hanging]

    def _send_waiting(self) -> None:
        """Sends chunks until the workers have enough."""
        threads = sum(self._threads[address] for address in self._answering())
        # One waits even where there is no worker: a cluster that adapts starts one.
        room = max(_WAITING * threads, 1) - len(self._under_way)
        for _ in range(room):
            chunk = self._queue.next(threads)
            if chunk is None:
                return
            self._send(chunk)

    def _send(self, chunk: _Chunk) -> None:
        key = f"{self._name}-{next(self._numbers)}"
        others = self._answering() if self._hanging else []
        future = self._client.submit(
            _simulate,
            self._settings,
            chunk.cases,
            key=key,
            pure=False,
            retries=self._retries,
            workers=others or None,
            # Those may be gone by then.
            allow_other_workers=bool(others),
        )
        chunk.attempts[key] = _Attempt(future)
        self._under_way[key] = chunk
        future.add_done_callback(self._done.put)

    def _forget(self, keys: list[str]) -> None:
        """Cancels attempts whose results are not wanted any more."""
        futures = [self._under_way.pop(key).attempts[key].future for key in keys]
        if futures and self._client.status == "running":
            # A client that is just losing its scheduler has nothing to cancel.
            with suppress(Exception):
                self._client.cancel(futures)

    def _take(self, future: Future[_Reply]) -> None:
        """Takes the end of an attempt, unless another was faster."""
        key = str(future.key)
        chunk = self._under_way.get(key)
        if chunk is None:
            return
        if future.status == "error":
            self._fail(chunk, future)
            return
        if future.status != "finished":
            self._resume(chunk, key)
            return
        try:
            journal, seconds, worker = future.result(timeout=_FETCH_S)
        except TimeoutError:
            # Its worker may hang: others go first, and in time the chunk is late.
            attempt = chunk.attempts[key]
            if attempt.begun is None:
                attempt.begun = time.monotonic()
            self._done.put(future)
            return
        except (CancelledError, OSError):
            # The scheduler was lost meanwhile, which the client notices soon.
            time.sleep(_PAUSE_S)
            self._resume(chunk, key)
            return
        try:
            self._gathered.take(journal)
        except ValueError as error:
            raise ClusterError(
                f"the results of worker {worker} cannot be used: {error}\n"
                "help: install the same build of Bristle on all machines"
            ) from error
        self._hanging.pop(worker, None)
        self._queue.learn(chunk, seconds)
        self._forget(list(chunk.attempts))

    def _fail(self, chunk: _Chunk, future: Future[_Reply]) -> None:
        if len(chunk.attempts) > 1:
            # Another worker has it, too.
            key = str(future.key)
            del self._under_way[key], chunk.attempts[key]
            return
        error = future.exception()
        rows = ", ".join(str(case + 1) for case in chunk.cases[:5])
        more = f" and {len(chunk.cases) - 5} more" if len(chunk.cases) > 5 else ""
        raise ClusterError(
            f"the workers cannot simulate cases {rows}{more}: "
            f"{type(error).__name__}: {error}\n"
            "help: see the logs of the workers; the same call goes on from what is done"
        ) from error

    def _resume(self, chunk: _Chunk, key: str) -> None:
        """Sends a chunk again that was lost with the scheduler and all that it knew.

        Waits until the client, which tries for some time, is connected again.
        """
        while self._client.status == "connecting":
            time.sleep(_PAUSE_S)
        if self._client.status != "running":
            done, total, _ = self._gathered.counts()
            raise ClusterError(
                f"the connection to the scheduler is lost, with {done} of {total} "
                "cases done\n"
                "help: the same call with a new client goes on from these"
            )
        self._hanging.clear()
        del self._under_way[key]
        del chunk.attempts[key]
        if not chunk.attempts:
            self._send(chunk)

    def _look(self) -> None:
        """Looks at the workers now and then, and sends again what is late."""
        now = time.monotonic()
        if now - self._looked < _LOOK_S or self._client.status != "running":
            return
        self._looked = now
        try:
            self._threads = dict(self._client.nthreads())
            processing = self._client.processing()
        except OSError:
            # The scheduler is being lost, which the chunks under way will tell.
            return
        # After some time each gets another chance.
        self._hanging = {
            worker: since
            for worker, since in self._hanging.items()
            if worker in self._threads and now - since < self._patience
        }
        for worker, keys in processing.items():
            for key in self._under_way.keys() & set(keys):
                attempt = self._under_way[key].attempts[key]
                if attempt.worker != worker:
                    attempt.worker, attempt.begun = worker, now
        for key, chunk in list(self._under_way.items()):
            attempt = chunk.attempts[key]
            expected = self._queue.expected(chunk.work)
            is_latest = key == list(chunk.attempts)[-1]
            if attempt.begun is None or expected is None or not is_latest:
                continue
            # Dask may have moved it to a worker that was idle because it hangs.
            is_stuck = attempt.worker in self._hanging
            if is_stuck or now - attempt.begun > self._patience + _LATE * expected:
                self._send_again(chunk, key)

    def _send_again(self, chunk: _Chunk, key: str) -> None:
        """Sends a chunk to another worker, too, if there is one that does not hang.

        The first results count.
        """
        worker = chunk.attempts[key].worker
        if worker is not None:
            self._hanging.setdefault(worker, time.monotonic())
        if self._answering():
            self._send(chunk)


def study(
    settings: Settings,
    sweep: Section | None = None,
    client: Client | None = None,
    *,
    out: str | PathLike[str] | None = None,
    restart: bool = False,
    progress: bool | TellCases = True,
    memory_bytes: int | None = None,
    chunk: int | None = None,
    chunk_s: float = 2.0,
    retries: int = 3,
    patience_s: float = 60.0,
) -> Study:
    """Simulates all combinations of the swept values on a cluster.

    It is :func:`bristle.study` with other machines: results and files are the same to
    the byte, and ``out`` has the same journal, from which either goes on. Cases go out
    in chunks, each to one thread of a worker. What a worker had when it was killed is
    simulated again, and so is what one has that hangs.

    Args:
        settings: What all cases share.
        sweep: Values of each swept setting, as for :func:`bristle.study`.
        client: A client of Dask that is connected to a scheduler; by default the current
            one.
        out: Directory of this machine for the results and the journal.
        restart: Whether to discard the results of an earlier call in ``out``.
        progress: As for :func:`bristle.study`.
        memory_bytes: Memory that each thread of a worker has; brushes that need more are
            refused before anything is simulated.
        chunk: Number of cases in a chunk; by default as many as take ``chunk_s``.
        chunk_s: Duration of a chunk in s, from the measured cost of those before it.
        retries: How often a chunk that fails is tried again, at most 1000 times.
        patience_s: Time in s beyond five times the expected one after which a worker
            that has a chunk counts as hanging, and gets no more for as long.

    Raises:
        SettingsError: If the settings of some case are not allowed, or ``out`` has the
            journal of another study.
        ClusterError: If the workers have another build of Bristle or keep dying, or the
            scheduler is lost. The same call goes on from what is done, as for
            :func:`bristle.study`.
        OSError: If a file cannot be written.
    """
    if isinstance(sweep, Client):
        raise TypeError("the client comes after the sweep: study(settings, client=…)")
    if client is None:
        client = Client.current()
    if client.asynchronous:
        raise TypeError("the client is asynchronous: use a Client(…) that is not")
    chunk = arguments.whole_or_none("chunk", chunk, 1)
    retries = arguments.whole("retries", retries, 0, _MOST_RETRIES)
    arguments.positive("chunk_s", chunk_s)
    arguments.positive("patience_s", patience_s)
    settings = swept(settings, sweep)
    memory_bytes = arguments.whole_or_none("memory_bytes", memory_bytes, 0)
    checked = checked_study(settings)
    with (
        pending(
            settings,
            checked,
            out=out,
            restart=restart,
            threads=1,
            memory_bytes=memory_bytes,
        ) as gathered,
        of_cases(progress) as tell,
    ):
        probe = 1 if gathered.has_brush() else _PROBE
        queue = _Queue(gathered.waiting(), probe, chunk, chunk_s)
        _Dispatch(settings, gathered, client, queue, tell, retries, patience_s).run()
        simulated = gathered.finish(None, None)
        warn_of(simulated)
    return Study(settings, simulated)
