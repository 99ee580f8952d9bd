"""Order without any scene: by a method's own runs, whose limit may be another motion."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from discmech.integrators.errors import BadInput, CannotMeasure, arguments_checked, shown
from discmech.integrators.extensions.foreign import BlackBox, Recorded
from discmech.integrators.extensions.foreign.calls import BoxRaised, Calls
from discmech.integrators.numbers import Vector, exact_rational

from ..core.fitting import orders_between
from .recorded import common_times

FEWEST = 4  # runs of an order: three differences, so two orders that agree
RUNS = 8  # runs of a function, each with half the step of the one before
CLEAR = 1000  # a difference above so many roundings of the state is the method's
ALIKE = 0.1  # largest difference of the last two orders, for the next power of h still counts
UNKNOWN = (
    "no scene is known, so nothing says that the limit of these runs is right: a wrong sign or "
    "mass has the same order"
)


@dataclass(frozen=True)
class OwnOrder:
    """An order from differences of runs alone; None if they show none.

    steps: those of the runs, the largest first. differences: between each run and the next at the
    same time, relative to the state. sentence: their answer and its limits.
    """

    order: float | None
    steps: tuple[float, ...]
    differences: tuple[float, ...]
    sentence: str

    def __str__(self) -> str:
        return self.sentence


@arguments_checked
def own_order(
    method: BlackBox, q: Any = None, p: Any = None, step: Any = None, steps: int = 16
) -> OwnOrder:
    """Return the order of a black box or of recorded runs by its own runs, each of half the step.

    Recorded runs need no other argument: their steps have to be halves of one another. A function
    needs q (n,) and p (m,), its start, the largest step, and how many of these are made. It gets no
    scene, so it has to know its own forces. Raises `BadInput` for runs or functions of another
    kind, and `CannotMeasure` for a function that raises or needs the scene in numbers.
    """
    if not isinstance(method, BlackBox):
        raise BadInput(f"own_order is of a black box or of recorded runs, not of {shown(method)}.")
    if isinstance(method, Recorded):
        _, rows = common_times(method)
        ends = sorted(
            ((float(run.step), np.concatenate([run.x[k], run.mu[k]]).astype(float))
             for run, k in zip(method.recordings, rows[-1], strict=True)),
            key=lambda pair: -pair[0],
        )  # fmt: skip
        sizes = [size for size, _ in ends]
        if any(abs(a / b - 2) > 1e-6 for a, b in itertools.pairwise(sizes)):
            raise BadInput(
                f"{method.name}: without a scene each run must have half the step of the one "
                f"before; there are {', '.join(f'{e:.6g}' for e in sizes)}."
            )
        return _told(method, sizes, [state for _, state in ends])
    if q is None or p is None or step is None or steps < 1:
        raise BadInput("own_order of a function needs q, p, a step, and a number of steps from 1.")
    first = float(exact_rational(step, "step"))
    sizes = [first / 2**k for k in range(RUNS)]
    return _told(method, sizes, [_end(method, q, p, h, steps * 2**k) for k, h in enumerate(sizes)])


class _NoScene(SimpleNamespace):
    """An object in place of the scene in numbers, which reports that there is none."""

    def __getattr__(self, name: str) -> Any:
        raise CannotMeasure(
            f"the black box asks for system.{name}, but without a scene there is none: let it "
            "compute its own forces, or run it on a Scene."
        )


def _end(method: BlackBox, q: Any, p: Any, h: float, steps: int) -> Vector:
    """Return the state after so many steps."""
    kind = np.float32 if method.numbers == "float32" else float
    q, p = (np.atleast_1d(np.array(part, dtype=kind)) for part in (q, p))
    system = _NoScene(t=0.0, n=len(q), m=len(p), name="no scene", parameters={}, _clocked=False)
    last: list[Any] = []

    def row(k: int, x: Any, mu: Any) -> None:
        last[:] = x, mu

    try:
        calls = Calls(method, system, kind(h), kind, "no scene")
        calls.run(q, p, steps, steps, lambda k: None, row)
    except BoxRaised as error:
        cause = error.__cause__
        raise cause if isinstance(cause, CannotMeasure) else CannotMeasure(error.said) from error
    return np.concatenate(last).astype(float)


def _told(method: BlackBox, sizes: Sequence[float], ends: Sequence[Vector]) -> OwnOrder:
    size = max(float(np.linalg.norm(end)) for end in ends) or 1.0
    gaps = [float(np.linalg.norm(a - b)) / size for a, b in itertools.pairwise(ends)]
    clear = [g for g in gaps if g > CLEAR * method.unit(16)]
    orders = orders_between([2.0**-k for k in range(len(clear))], clear)
    order = orders[-1] if len(orders) > 1 and abs(orders[-1] - orders[-2]) <= ALIKE else None
    if order is None:
        said = f"{method.name}: its own runs tell no order: their differences are "
        said += f"{', '.join(f'{g:.1e}' for g in gaps) or 'none'}; {UNKNOWN}."
        if len(ends) < FEWEST:
            said += f" An order needs {FEWEST} runs or more; there are {len(ends)}."
    else:
        said = f"{method.name} is of order {order:.3f} by its own runs; {UNKNOWN}."
    return OwnOrder(order, tuple(sizes), tuple(gaps), said)
