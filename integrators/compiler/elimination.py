"""Generated code that solves the linear equations of a Newton correction.

Small or sparse systems are unrolled, so that zeros cost nothing. A large dense one (many bodies
with an implicit rule) is solved by a loop (`tuple_operations.eliminate`), whose text stays short.
The loop exchanges rows, which unrolled elimination cannot do, so it also solves systems whose
pivots may vanish.
"""

from __future__ import annotations

from ..numbers import Coefficients, Together, sympy
from ..numbers.types import Assignment, Column, Expression, Letter, SymbolicMatrix

#: number of multiplications up to which a system is unrolled: a dense one of 12 unknowns
UNROLLED = 600
#: number of unknowns up to which a block that depends on parameters alone is unrolled: it is solved
#: once a flow, but its intermediate values get no names, so its expressions grow
NAMELESS = 9
#: number of unknowns up to which a block is solved by its adjugate, which has no pivots
ADJUGATE = 3


def solve(
    matrix: SymbolicMatrix,
    rhs: Column,
    coefficients: Coefficients,
    rows: list[int],
    exchange: bool = False,
) -> tuple[Column, list[Assignment]]:
    """Solve matrix·dw = rhs: return (dw, [(symbols, values)] in order of computation).

    Unknowns that no equation couples are solved separately, so a product of groupoids costs the sum
    of its parts. A block up to 3×3 is solved by the adjugate (one division), a larger one by
    elimination in the order of `rows` or by the loop. Anything that depends on parameters alone is
    computed once per flow. exchange: True if a pivot in that order may vanish at some point, so
    that rows are exchanged.
    """
    steps = Steps(coefficients)
    matrix = matrix.applyfunc(lambda e: _multiplied_out(e, coefficients))
    solution: dict[int, Letter] = {}
    for equations, unknowns in blocks(matrix, rows):
        block, right = matrix.extract(equations, unknowns), rhs.extract(equations, [0])
        varies = not all(map(coefficients.constant, block))
        large = work(block) > UNROLLED if varies else len(unknowns) > NAMELESS
        if large or (exchange and varies and len(unknowns) > ADJUGATE):
            solved = steps.together(block, right)
        else:
            J, b = steps.matrix("j", block), steps.matrix("e", right)
            solved = (_by_adjugate if len(unknowns) <= ADJUGATE else _by_elimination)(J, b, steps)
        solution |= zip(unknowns, solved, strict=True)
    return sympy.Matrix([solution[j] for j in range(matrix.cols)]), steps.done


def _multiplied_out(e: Expression, coefficients: Coefficients) -> Expression:
    """Return `e` with parameters multiplied into sums whose terms have parameters as well.

    In the equations themselves this would let energy drift (`Coefficients`). In their derivatives
    it is harmless, and it shortens the longest path of a correction (Kepler, midpoint: by 7 %).
    """

    def constants(term: Expression) -> list[Expression]:
        return [f for f in sympy.Mul.make_args(term) if coefficients.constant(f)]

    terms = []
    for term in sympy.Add.make_args(e):
        own = constants(term)
        rest = [f for f in sympy.Mul.make_args(term) if f not in own]
        inner = rest[0].args if len(rest) == 1 and rest[0].is_Add else ()
        spread = own and inner and sum(not constants(i) for i in inner) <= 1
        terms += [sympy.Mul(*own, i) for i in inner] if spread else [term]
    return sympy.Add(*terms)


class Equations(Together):
    """The unknowns of m linear equations, which `tuple_operations.eliminate` solves."""

    def lines(self, names: list[str], texts: list[str]) -> list[str]:
        """Return the lines that fill a matrix, solve, and read the unknowns."""
        m, a = len(names), f"rows_{names[0]}"
        places = (f"{a}[{i}][{j}]" for i in range(m) for j in range(m + 1))
        filled = [f"{at} = {text}" for at, text in zip(places, texts, strict=True) if text != "0"]
        read = [f"{name} = {a}[{i}][{m}]" for i, name in enumerate(names)]
        return [f"{a} = zeros({m}, {m + 1})", *filled, f"eliminate({a}, {m})", *read]


class Steps:
    """Intermediate values, named in the order in which they are computed."""

    def __init__(self, coefficients: Coefficients) -> None:
        self.constant = coefficients.constant
        self.done: list[Assignment] = []

    def name(self, letter: str, value: Expression) -> Expression:
        """Return a new symbol for the value; one of parameters alone stays unnamed."""
        if self.constant(value):
            return value
        symbol = sympy.Symbol(f"{letter}{len(self.done)}", real=True)
        self.done.append(([symbol], [value]))
        return symbol

    def together(self, block: SymbolicMatrix, right: Column) -> list[Letter]:
        """Return the symbols of the unknowns of a block that the loop solves."""
        start = len(self.done)
        symbols = [sympy.Symbol(f"s{start}_{i}", real=True) for i in range(len(right))]
        self.done.append((symbols, Equations(block.row_join(right))))
        return symbols

    def matrix(self, letter: str, entries: SymbolicMatrix) -> SymbolicMatrix:
        """Return the matrix with a name for each entry."""
        return sympy.Matrix(*entries.shape, [self.name(letter, e) for e in entries])


def blocks(matrix: SymbolicMatrix, rows: list[int]) -> list[tuple[list[int], list[int]]]:
    """Split into [(equations in the order of `rows`, unknowns)], coupled by non-zero entries.

    If a block has more equations than unknowns, it is singular, and everything is one block.
    """
    m = matrix.cols
    group = list(range(m))  # of each unknown
    for i in rows:
        joined = {group[j] for j in range(m) if matrix[i, j] != 0}
        group = [min(joined) if g in joined else g for g in group]
    parts = []
    for g in sorted(set(group)):
        unknowns = [j for j in range(m) if group[j] == g]
        equations = [i for i in rows if any(matrix[i, j] != 0 for j in unknowns)]
        parts.append((equations, unknowns))
    square = all(len(equations) == len(unknowns) for equations, unknowns in parts)
    return parts if square else [(rows, list(range(m)))]


def work(block: SymbolicMatrix) -> int:
    """Count the multiplications of an elimination in this order that skips zeros."""
    m, count = block.rows, 0
    filled = [[entry != 0 for entry in row] for row in block.tolist()]
    for p in range(m):
        used = [j for j in range(p + 1, m) if filled[p][j]]
        for i in range(p + 1, m):
            if filled[i][p]:
                count += 1 + len(used)
                for j in used:
                    filled[i][j] = True
    return count


def _by_adjugate(J: SymbolicMatrix, b: Column, steps: Steps) -> list[Letter]:
    over = steps.name("o", 1 / J.det(method="berkowitz"))
    return [steps.name("s", over * e) for e in J.adjugate() * b]


def _by_elimination(J: SymbolicMatrix, b: Column, steps: Steps) -> list[Letter]:
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
    solution: list[Expression] = [0] * m
    for p in reversed(range(m)):
        rest = b[p] - sum(J[p, j] * solution[j] for j in range(p + 1, m))
        solution[p] = name("s", rest * J[p, p])
    return solution
