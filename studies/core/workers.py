"""Processes that measure side by side. They end with this one, however it ends."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread
from typing import Any

from .cluster import Cluster
from .environment import collect_rarely, environment, one_thread

#: what a process of a pool tells the first one before its task ends; None in that one itself
_news: Any = None


def tell(news: Any) -> None:
    """Send something to whoever listens to the pool that this process belongs to."""
    if _news is not None:
        _news.put(news)


@contextmanager
def worker_pool(
    workers: int | Cluster, heard: Callable[[Any], None] | None = None
) -> Iterator[Executor]:
    """A pool of processes, killed at once where an exception (an interrupt, say) leaves it.

    What they finished is in the store, so nothing is lost but what they were at. Workers of a
    cluster are not ours to kill: they are told to forget what is left.
    heard: is called, in a thread of its own, with what processes here `tell`.
    """
    if isinstance(workers, Cluster):
        with workers.pool() as pool:
            yield pool
        return
    others = set(active_children())
    # the resource tracker, which begins here, removes the semaphores of a process that was ended
    # at once (`command.interrupts`), and would tell the user of each
    filters = os.environ.get("PYTHONWARNINGS"), "ignore:resource_tracker:UserWarning"
    with environment({"PYTHONWARNINGS": ",".join(filter(None, filters))}):
        news = None if heard is None else get_context("spawn").SimpleQueue()
        own = ProcessPoolExecutor(workers, get_context("spawn"), _begin, (news,))
    if news is not None:
        listener = Thread(target=_listen, args=(news, heard), daemon=True)
        listener.start()
    try:
        # a process that begins keeps what its parent blocks, and its settings
        with _interrupts_wait(), one_thread():
            for _ in range(workers):
                own.submit(os.getpid)
        yield own
    except BaseException:
        own.shutdown(wait=False, cancel_futures=True)
        for process in set(active_children()) - others:
            process.kill()
        raise
    own.shutdown()
    if news is not None:
        news.put(None)
        listener.join()


def _listen(news: Any, heard: Callable[[Any], None]) -> None:
    """Hand on what is told, until there is None, or it cannot be heard: a task tells it again."""
    listening = True
    while (told := news.get()) is not None:
        try:
            if listening:
                heard(told)
        except Exception:
            listening = False  # a reader has gone, say: the first thread will meet that, too


@contextmanager
def _interrupts_wait() -> Iterator[None]:
    """Block interrupts, where the system can: one that comes meanwhile comes afterwards."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(news: Any) -> None:
    """Interrupts are the first process's business; its end is this one's too."""
    global _news
    _news = news
    collect_rarely()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)
