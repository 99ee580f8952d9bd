"""Value, gradient and Hessian of a scalar as one function of columns of numbers.

Both derivatives are those of the scalar's graph, in which held nodes are computed once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ...numbers import Graph, Node, Scope, arithmetic, numeric, opaque, within_doubles
from ...numbers.types import Letter, Number, Vector

#: number of array entries that are computed at a time
CHUNK = 2**21


class SecondDerivatives:
    """A scalar of `inputs` and `data` (letters) as a function of columns of numbers.

    Raises `BadInput` for functions that double precision does not have.
    """

    def __init__(self, scalar: Node, inputs: Sequence[Letter], data: Sequence[Letter]) -> None:
        graph = Graph()  # in the scalar's own nothing is differentiated by parameters
        (value,) = graph.rebuilt([scalar], {})
        scope, by = Scope(graph), graph.letters(inputs)
        slopes = [graph.hold(e) for e in scope.jacobian([value], by)[0]]
        hessian = scope.jacobian(slopes, by)
        self.size = len(by)
        self._places = [(i, j) for i in range(self.size) for j in range(i + 1) if hessian[i][j]]
        results = [value, *slopes, *(hessian[i][j] for i, j in self._places)]
        self._function = _in_columns(graph, inputs, data, results)

    def couples(self, count: int) -> bool:
        """Return True if some second derivative by two of the first inputs is not 0."""
        return any(i < count and j < count for i, j in self._places)

    def __call__(self, a: np.ndarray, q: Sequence[Number | Vector]) -> tuple[np.ndarray, ...]:
        """Return (values (N,), gradients (N, k), Hessians (N, k, k)) at N rows of k inputs.

        q: the data, each a number or N numbers.
        """
        rows = max(1, CHUNK // self.size**2)
        with within_doubles("the control problem"):
            parts = [
                self._at(a[i : i + rows], [e[i : i + rows] if np.ndim(e) else e for e in q])
                for i in range(0, len(a), rows)
            ]
        return tuple(map(np.concatenate, zip(*parts, strict=True)))

    def _at(self, a: np.ndarray, q: list[Number | Vector]) -> tuple[np.ndarray, ...]:
        rows, k = len(a), self.size
        values = self._function(a.T, q)
        # also for constants; integers beyond 2⁶³ are Python's own
        values = np.broadcast_to(values.reshape(len(values), -1).astype(float), (len(values), rows))
        hessian = np.zeros((rows, k, k))
        for (i, j), entry in zip(self._places, values[1 + k :], strict=True):
            hessian[:, i, j] = hessian[:, j, i] = entry
        return values[0], values[1 : 1 + k].T, hessian


def _in_columns(
    graph: Graph, inputs: Sequence[Letter], data: Sequence[Letter], results: list[Node]
) -> Callable[..., np.ndarray]:
    """Return the results (r, N) as a function of columns; row by row if they branch (tables)."""
    branching = opaque(graph.order(results))
    arguments = {"a": inputs, "q": data}
    f = numeric(arguments, [results], arithmetic(16), columns=not branching, graph=graph)
    if not branching:
        return f

    def by_rows(*columns: Sequence[Vector]) -> np.ndarray:
        sizes = [len(part) for part in columns]
        entries = np.broadcast_arrays(*(e for part in columns for e in part))
        cuts = np.cumsum(sizes)[:-1]
        return np.array([f(*np.split(row, cuts)) for row in np.array(entries).T]).T

    return by_rows
