"""All runs of a sweep: in this process, on the cores of this machine, or on the workers of a Dask cluster.

A batch of runs goes to whoever is free. A process reads the deck once and keeps it for its later batches.
"""

from __future__ import annotations

from contextlib import contextmanager
from time import monotonic

from .runs import Runner

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from concurrent.futures import Future
    from typing import Any

    from .runs import Outcome, Point, Task

CLUSTER = (
    "are its scheduler and its workers still there? run it again: runs that are done are kept by a sweep"
)
BATCH_SECONDS = 1.0  # a batch takes about so long: a worker that dies costs no more
_kept: dict[object, Runner] = {}


def work(task: Task, points: list[Point]) -> tuple[list[Outcome], float]:
    """Some runs, in whatever process this is called, and how many seconds one of them took."""
    start = monotonic()
    key = _key(task)
    runner = _kept.get(key)
    if runner is None:
        _kept.clear()
        runner = _kept[key] = Runner(task)
    found = [runner.run(point) for point in points]
    return found, (monotonic() - start) / len(points)


def _key(task: Task) -> object:
    return (
        task.source,
        tuple(task.fixed.items()),
        task.names,
        task.signals,
        tuple(task.options.items()),
        task.seed,
    )


def outcomes(
    task: Task, points: list[Point], jobs: int, cluster: str | None = None
) -> Iterator[list[Outcome]]:
    """Batches of outcomes, in whatever order they come. Raises OutsideError where there is no cluster."""
    if cluster is not None:
        yield from _on_cluster(task, points, cluster)
    elif jobs == 1 or len(points) == 1:
        batches = _Batches(points, 1)
        while batch := batches.next():
            found, batches.seconds = work(task, batch)
            yield found
    else:
        yield from _on_cores(task, points, jobs)


class _Batches:
    """The runs in batches: one run first, then as many as take BATCH_SECONDS by the speed of the batches before."""

    def __init__(self, points: list[Point], jobs: int) -> None:
        self.points, self.at, self.jobs = points, 0, jobs
        self.seconds = BATCH_SECONDS  # a run takes

    def next(self) -> list[Point]:
        """Empty at the end."""
        left = len(self.points) - self.at
        size = max(1, min(int(BATCH_SECONDS / max(self.seconds, 1e-9)), -(-left // self.jobs)))
        part = self.points[self.at : self.at + size]
        self.at += len(part)
        return part


def _on_cores(task: Task, points: list[Point], jobs: int) -> Iterator[list[Outcome]]:
    from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait

    batches = _Batches(points, jobs)
    with (
        ProcessPoolExecutor(jobs, mp_context=context(), initializer=belong) as pool,
        told_lost("of this machine", MEMORY),
    ):
        running: set[Future[tuple[list[Outcome], float]]] = set()
        try:
            while True:
                while len(running) < jobs and (batch := batches.next()):
                    running.add(pool.submit(work, task, batch))
                if not running:
                    return
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    found, batches.seconds = future.result()
                    yield found
        except BaseException:  # Ctrl-C, or nobody wants the rest: whole pools are waited for
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def context() -> Any:
    """How processes are made: by fork where nothing but this thread could hold a lock, which starts them with the deck read and
    all modules loaded; else anew."""
    import sys
    import threading
    from multiprocessing import get_context

    alone = sys.platform == "linux" and threading.active_count() == 1
    return get_context("fork" if alone else "spawn")


def keep(task: Task, runner: Runner) -> None:
    """The runner of a task, for the batches that this process and those forked from it work on."""
    _kept.clear()
    _kept[_key(task)] = runner


def belong() -> None:
    """A worker is its parent's: Ctrl-C is for the parent, and whoever has lost it ends, also where it was killed outright."""
    import os
    import signal
    import threading

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def watch() -> None:
        from time import sleep

        while os.getppid() == parent:
            sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


MEMORY = "was it killed, or is memory short? run it again, with fewer processes (-j); runs that are done are kept by a sweep"


@contextmanager
def told_lost(whose: str, hint: str) -> Iterator[None]:
    """Workers that have gone, or whoever hands them their work, are told as that: E523."""
    from concurrent.futures import BrokenExecutor, CancelledError

    from ..diagnostics import Diagnostic, DiagnosticError, OutsideError

    try:
        yield
    except DiagnosticError:
        raise
    except Exception as error:
        # Dask's own errors are named by their package: it is loaded only where a cluster is asked for
        lost = (
            isinstance(error, (BrokenExecutor, CancelledError))
            or type(error).__module__.partition(".")[0] == "distributed"
        )
        if not lost:
            raise
        said = f"a worker {whose} was lost: {type(error).__name__}"
        raise OutsideError(Diagnostic("error", "E523", said, None, hint)) from error


def _on_cluster(task: Task, points: list[Point], address: str) -> Iterator[list[Outcome]]:
    """On the workers of a Dask scheduler, which must have emsim and see the deck's files. What a worker was at when it died is
    run again by another."""
    from ..diagnostics import Diagnostic, OutsideError
    from ..outputs import missing_package

    try:
        from distributed import Client, as_completed
    except ImportError:
        raise missing_package("a cluster needs", "distributed", "cluster") from None
    try:
        client = Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError) as error:
        said = Diagnostic("error", "E522", f"there is no Dask scheduler at {address}: {error or 'no answer'}")
        raise OutsideError(said) from None
    with client, told_lost(f"of {address}", CLUSTER):
        workers = max(1, sum(client.nthreads().values()))
        batches = _Batches(points, workers)
        running = as_completed(loop=client.loop)
        futures: set[Any] = set()
        try:
            while True:
                # one that is worked on and one that waits for every worker
                while len(futures) < 2 * workers and (batch := batches.next()):
                    future = client.submit(work, task, batch, pure=False)
                    futures.add(future)
                    running.add(future)
                if not futures:
                    return
                future = next(running)
                futures.discard(future)
                found, batches.seconds = future.result()
                yield found
        finally:
            client.cancel(list(futures))
