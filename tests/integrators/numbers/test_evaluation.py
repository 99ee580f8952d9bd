"""What is evaluated in Python's numbers: a table of several numbers once, whatever asks for it."""

from collections import Counter

import numpy as np
import pytest
import sympy
from gmpy2 import mpq

from discmech.integrators import MatrixAlgebra, Scene, Scheme, exponential, lie_group, midpoint
from discmech.integrators.compiler.omissions import is_affine
from discmech.integrators.numbers import Graph, arithmetic, node_values
from discmech.integrators.numbers.nodes import Call
from discmech.integrators.retractions import matrix_functions

#: the affine group of the line: no closed form of its exponential
AFFINE = MatrixAlgebra("aff(1)", (((1, 0), (0, 0)), ((0, 1), (0, 0))))


@pytest.fixture
def tables(monkeypatch):
    """How often each table of a function of matrices is computed, by its name and its digits."""
    counts = Counter()
    registered = matrix_functions.registered_function

    def counted(name, numbers):
        counts[name, numbers.digits] += 1
        return registered(name, numbers)

    monkeypatch.setattr(matrix_functions, "registered_function", counted)
    return counts


@pytest.mark.parametrize("in_call", [False, True], ids=["nodes", "results of a call"])
def test_a_table_is_computed_once_for_all_of_its_entries(tables, in_call):
    """So are those of its derivatives, and those inside a function that is called."""
    graph, xi = Graph(), sympy.symbols("xi:2", real=True)
    entries = matrix_functions.MatrixFunction(matrix_functions.DEXP, AFFINE.adjoint)(xi)
    nodes = [graph.read(e) for e in [*entries, *entries.diff(xi[0]), *entries.diff(xi[1])]]
    point = dict(zip(xi, (sympy.Rational(1, 3), sympy.Rational(2, 7)), strict=True))
    wanted = [node_values([e], point, 30)[0] for e in nodes]
    if in_call:

        class function:  # noqa: N801
            arguments, results, scope = graph.letters(xi), nodes, None

        eta = sympy.symbols("eta:2", real=True)
        call = Call(function, graph.letters(eta))
        nodes = [graph.result(call, k) for k in range(len(nodes))]
        point = dict(zip(eta, point.values(), strict=True))
    tables.clear()
    assert node_values(nodes, point, 30) == wanted
    assert sorted(tables.values()) == [1, 1]


def test_a_scheme_computes_a_table_once_for_each_point(tables):
    """The check of regularity has one point, the decision what a step may leave out at most four
    of few digits: that the entries of a slope change is no round-off."""
    body = Scene("body", lie_group(AFFINE, exponential),
                 lambda x, v, p: (2 * v[0] ** 2 + v[0] * v[1] + v[1] ** 2) / 2,
                 v0=["1/5", "1/3"])  # fmt: skip
    system = Scheme(body, midpoint).equations.step
    assert set(tables.values()) == {1}
    tables.clear()
    assert not is_affine(system)
    assert max(tables.values()) <= 2 and max(digits for _, digits in tables) <= 100


def test_a_product_block_by_block_is_the_product():
    """Of exact numbers, with zeros on the lower left of either, both or neither, at two levels."""
    product = arithmetic(50).matrices()["matrix_product"]
    rng = np.random.default_rng(3)
    one, two = (np.kron([[1, 1], [0, 1]], np.ones((4, 4), int)), np.kron(
        np.kron([[1, 1], [0, 1]], [[1, 1], [0, 1]]), np.ones((2, 2), int)))  # fmt: skip
    for left in (one, two, one | one.T):
        for right in (one, two, one | one.T):
            a, b = (np.array([mpq(int(n), 7) for n in (rng.integers(-9, 9, (8, 8)) * e).flat],
                             dtype=object).reshape(8, 8) for e in (left, right))  # fmt: skip
            out = np.empty_like(a)
            product(out, a, b)
            assert (out == a @ b).all()
