"""Processes that measure side by side. They end with this one, however it ends."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.connection import wait
from pathlib import Path
from threading import Thread
from typing import Any

from .cluster import Cluster
from .environment import collect_rarely, environment, here, names_from, one_thread

#: the queue by which a process of a pool sends news before its task ends; None in the first one
_news: Any = None
#: a process that has this variable runs no socket.py of the current folder in place of Python's
SAFE = "PYTHONSAFEPATH"


def tell(news: Any) -> None:
    """Send an object to the listener of the pool that this process belongs to."""
    if _news is not None:
        _news.put(news)


@contextmanager
def worker_pool(
    workers: int | Cluster, heard: Callable[[Any], None] | None = None
) -> Iterator[Executor]:
    """Yield a pool of processes, killed at once if an exception (such as an interrupt) leaves it.

    Their finished results are in the store, so only the current tasks are lost. Workers of a
    cluster are not ours to kill: they are asked to drop the remaining tasks. heard: is called, in a
    thread of its own, with the objects that processes here `tell`.
    """
    if isinstance(workers, Cluster):
        with workers.pool() as pool:
            yield pool
        return
    others = set(active_children())
    # the resource tracker, which starts here, removes the semaphores of a process that was ended at
    # once (`command.interrupts`), and would report each to the user
    filters = os.environ.get("PYTHONWARNINGS"), "ignore:resource_tracker:UserWarning"
    safe = os.environ.get(SAFE)
    with environment({"PYTHONWARNINGS": ",".join(filter(None, filters)), SAFE: "1"}):
        news = None if heard is None else get_context("spawn").SimpleQueue()
        own = ProcessPoolExecutor(workers, get_context("spawn"), _begin, (news, safe, here()))
    if news is not None:
        listener = Thread(target=_listen, args=(news, heard), daemon=True)
        listener.start()
    try:
        # a new process keeps its parent's blocked signals, and its settings
        with _interrupts_wait(), one_thread(), environment({SAFE: "1"}):
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
    """Pass on the news until there is None, or the listener fails: a task sends it again."""
    listening = True
    while (told := news.get()) is not None:
        try:
            if listening:
                heard(told)
        except Exception:
            # such as a reader that has gone: the first thread will meet that, too
            listening = False


@contextmanager
def _interrupts_wait() -> Iterator[None]:
    """Block interrupts, if the system can: one that comes meanwhile comes afterwards."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(news: Any, safe: str | None, folder: Path) -> None:
    """Leave interrupts to the first process, and end with it.

    safe: its value of `SAFE`. folder: from which it takes relative names.
    """
    global _news
    _news = news
    del os.environ[SAFE]  # the programs that this process starts are the user's
    if safe is not None:
        os.environ[SAFE] = safe
    collect_rarely()
    names_from(folder).__enter__()  # to the end of this process
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)
