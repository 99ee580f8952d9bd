"""Generated code that solves the linear equations of a Newton correction.

Small or sparse systems are unrolled, so that zeros cost nothing. A large dense one (many bodies
with an implicit rule) is solved by a loop (`tuple_operations.eliminate`), whose text stays short.
The loop exchanges rows, which unrolled elimination cannot do, so it also solves systems whose
pivots may vanish.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..numbers import Coefficients, Graph, Node, NodeMatrix, Rational
from ..numbers.nodes import PRODUCT, SUM

#: number of multiplications up to which a system is unrolled: a dense one of 12 unknowns
UNROLLED = 600
#: number of unknowns up to which a block that depends on parameters alone is unrolled: it is solved
#: once a flow, but its intermediate values get no names, so its expressions grow
NAMELESS = 9
#: number of unknowns up to which a block is solved by its adjugate, which has no pivots
ADJUGATE = 3


def solve(
    graph: Graph,
    matrix: NodeMatrix,
    right: Sequence[Node],
    coefficients: Coefficients,
    rows: list[int],
    exchange: bool = False,
) -> tuple[list[Node], bool]:
    """Solve matrix·dw = right: return (dw, True if a loop solves some block).

    Unknowns that no equation couples are solved separately, so a product of groupoids costs the sum
    of its parts. A block up to 3×3 is solved by the adjugate (one division), a larger one by
    elimination in the order of `rows` or by the loop. Anything that depends on parameters alone is
    computed once per flow. exchange: True if a pivot in that order may vanish at some point, so
    that rows are exchanged.
    """
    steps = Steps(graph, coefficients)
    matrix = [[steps.multiplied_out(e) for e in row] for row in matrix]
    solution: dict[int, Node] = {}
    looped = False
    for equations, unknowns in blocks(matrix, rows):
        block = [[matrix[i][j] for j in unknowns] for i in equations]
        b = [right[i] for i in equations]
        varies = not all(coefficients.constant(e) for row in block for e in row)
        large = work(block) > UNROLLED if varies else len(unknowns) > NAMELESS
        if large or (exchange and varies and len(unknowns) > ADJUGATE):
            loop, looped = Loop(block, b), True
            solved = [graph.result(loop, i) for i in range(len(b))]
        else:
            J, b = [[steps.held(e) for e in row] for row in block], [steps.held(e) for e in b]
            small = len(unknowns) <= ADJUGATE
            solved = steps.by_adjugate(J, b) if small else steps.by_elimination(J, b)
        solution |= zip(unknowns, solved, strict=True)
    return [solution[j] for j in range(len(matrix))], looped


class Loop:
    """The unknowns of m linear equations, which `tuple_operations.eliminate` solves."""

    function = None

    def __init__(self, matrix: NodeMatrix, right: Sequence[Node]) -> None:
        self.size = len(right)
        self.arguments = [e for row, b in zip(matrix, right, strict=True) for e in (*row, b)]

    def lines(self, name: str, texts: Sequence[str]) -> list[str]:
        """Return the lines that fill a matrix and solve; its last column becomes the unknowns."""
        m = self.size
        places = (f"{name}[{i}][{j}]" for i in range(m) for j in range(m + 1))
        filled = [f"{at} = {text}" for at, text in zip(places, texts, strict=True) if text != "0"]
        return [f"{name} = zeros({m}, {m + 1})", *filled, f"eliminate({name}, {m})"]

    def place(self, number: int) -> str:
        """Return the index of an unknown in the matrix."""
        return f"[{number}][{self.size}]"


class Steps:
    """The steps of an elimination; values that vary are held, each computed by itself."""

    def __init__(self, graph: Graph, coefficients: Coefficients) -> None:
        self.graph, self.constant = graph, coefficients.constant

    def held(self, value: Node) -> Node:
        """Return a node that stands for the value, or the value itself if it is constant."""
        return value if self.constant(value) else self.graph.hold(value)

    def multiplied_out(self, e: Node) -> Node:
        """Return `e` with parameters multiplied into sums whose terms have parameters as well.

        In the equations themselves this would let energy drift (`Coefficients`). In their
        derivatives it is harmless, and it shortens the longest path of a correction (Kepler,
        midpoint: by 7 %).
        """
        graph = self.graph
        summands: list[tuple[Rational, Node]] = []
        for c, term in e.terms:
            factors = term.args if term.kind == PRODUCT else ()
            rest = [(k, n) for k, n in factors if not self.constant(graph.nodes[k])]
            inner = graph.nodes[rest[0][0]] if len(rest) == 1 and rest[0][1] == 1 else term
            if len(rest) < len(factors) and inner.kind == SUM and self._mostly_scaled(inner):
                own = [(graph.nodes[k], n) for k, n in factors if (k, n) not in rest]
                spread = ((c * a, graph.product([*own, (part, 1)])) for a, part in inner.terms)
                summands += spread
            else:
                summands.append((c, term))
        return graph.sum(summands)

    def _mostly_scaled(self, e: Node) -> bool:
        """Return True if all terms of a sum but one have a constant factor."""
        nodes = self.graph.nodes
        return sum(not (c != 1 or self._has_constant(nodes[i])) for i, c in e.args[1]) <= 1

    def _has_constant(self, term: Node) -> bool:
        factors = term.args if term.kind == PRODUCT else ((term.index, 1),)
        return any(self.constant(self.graph.nodes[k]) for k, _ in factors)

    def by_adjugate(self, J: NodeMatrix, b: Sequence[Node]) -> list[Node]:
        """Return J⁻¹b by the adjugate of J, of at most three rows."""
        graph, m = self.graph, len(b)
        adjugate = [[self._minor(J, j, i) for j in range(m)] for i in range(m)]
        over = self.held(graph.product([(self._dot(J[0], [row[0] for row in adjugate]), -1)]))
        return [self.held(over * self._dot(row, b)) for row in adjugate]

    def _dot(self, a: Sequence[Node], b: Sequence[Node]) -> Node:
        return self.graph.sum((1, x * y) for x, y in zip(a, b, strict=True))

    def _minor(self, J: NodeMatrix, i: int, j: int) -> Node:
        """Return (−1)^(i + j) times the determinant without row i and column j."""
        graph = self.graph
        kept = [[e for k, e in enumerate(row) if k != j] for r, row in enumerate(J) if r != i]
        if not kept:
            return graph.one
        if len(kept) == 1:
            value = kept[0][0]
        else:
            (a, b), (c, d) = kept
            value = a * d - b * c
        return -value if (i + j) % 2 else value

    def by_elimination(self, J: NodeMatrix, b: list[Node]) -> list[Node]:
        """Return J⁻¹b by elimination in the order of the rows; J and b change."""
        graph, m, letter = self.graph, len(b), self.held
        for p in range(m):
            pivot = letter(graph.product([(J[p][p], -1)]))
            for i in range(p + 1, m):
                if not J[i][p]:
                    continue
                factor = letter(J[i][p] * pivot)
                for j in range(p + 1, m):
                    if J[p][j]:
                        J[i][j] = letter(J[i][j] - factor * J[p][j])
                b[i] = letter(b[i] - factor * b[p])
            J[p][p] = pivot
        solution = list(b)
        for p in reversed(range(m)):
            rest = graph.sum([(1, b[p]), *((-1, J[p][j] * solution[j]) for j in range(p + 1, m))])
            solution[p] = letter(rest * J[p][p])
        return solution


def blocks(matrix: NodeMatrix, rows: list[int]) -> list[tuple[list[int], list[int]]]:
    """Split into [(equations in the order of `rows`, unknowns)], coupled by non-zero entries.

    If a block has more equations than unknowns, it is singular, and everything is one block.
    """
    m = len(matrix)
    group = list(range(m))  # of each unknown
    for i in rows:
        joined = {group[j] for j in range(m) if matrix[i][j]}
        group = [min(joined) if g in joined else g for g in group]
    parts = []
    for g in sorted(set(group)):
        unknowns = [j for j in range(m) if group[j] == g]
        equations = [i for i in rows if any(matrix[i][j] for j in unknowns)]
        parts.append((equations, unknowns))
    square = all(len(equations) == len(unknowns) for equations, unknowns in parts)
    return parts if square else [(rows, list(range(m)))]


def work(block: NodeMatrix) -> int:
    """Count the multiplications of an elimination in this order that skips zeros."""
    m, count = len(block), 0
    filled = [[bool(entry) for entry in row] for row in block]
    for p in range(m):
        used = [j for j in range(p + 1, m) if filled[p][j]]
        for i in range(p + 1, m):
            if filled[i][p]:
                count += 1 + len(used)
                for j in used:
                    filled[i][j] = True
    return count
