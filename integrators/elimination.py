"""Linear equations unrolled into straight-line code: what a Newton correction solves."""

from __future__ import annotations

from typing import Any

from .printing import Coefficients


def solve(
    matrix: Any, rhs: Any, coefficients: Coefficients, rows: list[int]
) -> tuple[Any, list[tuple[Any, Any]]]:
    """Unrolled solution of matrix·dw = rhs: (dw, [(symbol, value)] in order).

    Unknowns that no equation ties together are solved apart, so a product of groupoids costs what
    its parts cost. Each block up to 3×3 by the adjugate (one division), above by elimination in the
    order of `rows`; zeros cost nothing, and what depends on parameters alone is done once per flow.
    """
    from sympy import Matrix

    steps = Steps(coefficients)
    solution: list[Any] = [None] * matrix.cols
    for equations, unknowns in blocks(matrix, rows):
        J = steps.matrix("j", [[matrix[i, j] for j in unknowns] for i in equations])
        b = steps.matrix("e", [[rhs[i]] for i in equations])
        found = _by_adjugate(J, b, steps) if len(unknowns) <= 3 else _by_elimination(J, b, steps)
        for j, value in zip(unknowns, found, strict=True):
            solution[j] = value
    return Matrix(solution), steps.done


class Steps:
    """Intermediate values, named in the order in which they are computed."""

    def __init__(self, coefficients: Coefficients) -> None:
        self.q = coefficients.q
        self.done: list[tuple[Any, Any]] = []

    def name(self, letter: str, value: Any) -> Any:
        """A symbol for the value; what depends on parameters alone stays as it is."""
        from sympy import Symbol

        if not value.free_symbols - self.q:
            return value
        symbol = Symbol(f"{letter}{len(self.done)}", real=True)
        self.done.append((symbol, value))
        return symbol

    def matrix(self, letter: str, entries: list[list[Any]]) -> Any:
        """A matrix of names."""
        from sympy import Matrix

        return Matrix([[self.name(letter, e) for e in row] for row in entries])


def blocks(matrix: Any, rows: list[int]) -> list[tuple[list[int], list[int]]]:
    """[(equations in the order of `rows`, unknowns)] that non-zero entries tie together.

    A block with more equations than unknowns is singular: then all is one block.
    """
    m = matrix.cols
    group = list(range(m))  # of each unknown
    for i in rows:
        tied = [j for j in range(m) if matrix[i, j] != 0]
        joined = {group[j] for j in tied}
        if joined:
            group = [min(joined) if g in joined else g for g in group]
    found = []
    for g in sorted(set(group)):
        unknowns = [j for j in range(m) if group[j] == g]
        equations = [i for i in rows if any(matrix[i, j] != 0 for j in unknowns)]
        found.append((equations, unknowns))
    if any(len(equations) != len(unknowns) for equations, unknowns in found):
        return [(rows, list(range(m)))]
    return found


def _by_adjugate(J: Any, b: Any, steps: Steps) -> list[Any]:
    over = steps.name("o", 1 / J.det(method="berkowitz"))
    return [steps.name("s", over * e) for e in J.adjugate() * b]


def _by_elimination(J: Any, b: Any, steps: Steps) -> list[Any]:
    m, name = J.cols, steps.name
    for p in range(m):
        pivot = name("o", 1 / J[p, p])
        for i in range(p + 1, m):
            if J[i, p] == 0:
                continue
            factor = name("f", J[i, p] * pivot)
            for j in range(p + 1, m):
                if J[p, j] != 0:
                    J[i, j] = name("j", J[i, j] - factor * J[p, j])
            b[i] = name("e", b[i] - factor * b[p])
        J[p, p] = pivot
    solution: list[Any] = [0] * m
    for p in reversed(range(m)):
        rest = b[p] - sum(J[p, j] * solution[j] for j in range(p + 1, m))
        solution[p] = name("s", rest * J[p, p])
    return solution
