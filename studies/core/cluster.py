"""Measuring on the workers of a Dask scheduler: the same tasks, with the same text and versions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Lock
from typing import Any

from discmech.integrators import BadInput

from .fingerprint import of_everything
from .record import versions

_ONE_AT_A_TIME = Lock()  # precisions are set for a whole process


@dataclass(frozen=True)
class Cluster:
    """The workers of a scheduler, by its address (tcp://host:8786); extra `discmech[cluster]`."""

    address: str

    @contextmanager
    def pool(self) -> Iterator[Executor]:
        """Yield its workers as an executor; the task of a worker that dies is given to another.

        Raises `BadInput` if no scheduler answers, it has no worker, or a worker has other versions.
        """
        try:
            from distributed import Client, KilledWorker
        except ImportError:
            raise BadInput('clusters need Dask: pip install "discmech[cluster]".') from None
        try:
            client = Client(self.address, timeout="10s", set_as_default=False)
        except (OSError, ValueError):
            raise BadInput(
                f"no Dask scheduler answers at {self.address}: start one with `dask scheduler`, "
                "which prints its address."
            ) from None
        with client:
            expected = _here()
            if not client.scheduler_info()["workers"]:
                raise BadInput(
                    f"the scheduler at {self.address} has no workers: start some with `dask worker "
                    f"{self.address} --nthreads 1`."
                )
            answers = client.run(_here, on_error="return")
            for worker, there in answers.items():
                _refuse_others(worker, expected, there)
            try:
                yield _Checked(client.get_executor(), expected)
            except KilledWorker as error:
                raise BadInput(f"{error} The same command goes on where it stopped.") from None


class _Checked(Executor):
    """An executor of workers that may join later: each task checks its own worker."""

    def __init__(self, inner: Executor, expected: dict[str, Any]) -> None:
        self.inner, self.expected = inner, expected

    def submit(self, function: Callable[..., Any], /, *args: Any, **more: Any) -> Future[Any]:
        """Submit the call to a worker."""
        return self.inner.submit(_on_worker, self.expected, function, *args, **more)


def _on_worker(
    expected: dict[str, Any], function: Callable[..., Any], *args: Any, **more: Any
) -> Any:
    from distributed import get_worker

    name = get_worker().address
    with _ONE_AT_A_TIME:
        _refuse_others(name, expected, _here())
        try:
            return function(*args, **more)
        except BadInput as error:  # such as a missing file
            raise BadInput(f"the worker {name}: {error}") from None


def _here() -> dict[str, Any]:
    """Return the versions, and the text of the bench, of this process."""
    return {**versions(), "text": of_everything()}


def _refuse_others(worker: str, expected: dict[str, Any], there: Any) -> None:
    if not isinstance(there, dict):
        raise BadInput(f"the worker {worker} cannot load discmech ({there}): install it there.")
    for name, here in expected.items():
        if there.get(name) != here:
            differs = (
                "another text of discmech" if name == "text"
                else f"{name} {there.get(name)}, and this machine {here}"
            )  # fmt: skip
            raise BadInput(f"the worker {worker} has {differs}: numbers must come from equal ones.")
