"""The graph: equal expressions are one node, and its derivatives are those of sympy."""

import random

import pytest
import sympy
from sympy import Rational, cos, exp, log, sin, sqrt, symbols

from discmech.integrators.numbers import Graph, Scope, evaluate_at, jacobian, random_point

A, B, C = LETTERS = symbols("a b c", real=True)


def grown(seed, size=12):
    """Return a random expression of three letters, positive where that matters."""
    choice = random.Random(seed)
    known = [A, B, C, Rational(2, 3), sympy.pi]
    for _ in range(size):
        one, other = choice.choice(known), choice.choice(known)
        known.append(choice.choice([
            one + other, one - 2 * other, one * other, one / (3 + other**2),
            sqrt(1 + one**2), sin(one), cos(one) * other, log(2 + one**2), exp(sin(one)),
            (one - other) ** 3, (2 * one**2 + 4 * other**2 + 6) ** -2 * one,
        ]))  # fmt: skip
    return sum(known[-3:])


def close(found, wanted, graph=None):
    point = random_point(LETTERS)
    values = evaluate_at(found, point, 50, graph), evaluate_at(wanted, point, 50)
    return all(abs(a - b) < 1e-40 * (1 + abs(b)) for a, b in zip(*values, strict=True))


@pytest.mark.parametrize("seed", range(6))
def test_what_is_read_is_shown_and_derived_as_sympy_does(seed):
    graph, e = Graph(), grown(seed)
    assert close([graph.shown(graph.read(e))], [e])
    assert close(Scope(graph).total([e], LETTERS), jacobian([e], LETTERS))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_held_nodes_are_differentiated_through(seed):
    """Twice, with letters for what is held and for rows of its derivatives."""
    graph = Graph()
    scope, by = Scope(graph), graph.letters(LETTERS)
    inner = [grown(seed), grown(seed + 50) ** 2]
    held = scope.held(graph.column(inner), "k")
    (quotient,) = scope.quotients([held[0]], [1 + held[1] * held[1]], "v")
    row = scope.jacobian([quotient * held[0]], by)
    rows = [graph.shown(e) for line in scope.jacobian(row[0], by) for e in line]
    value = inner[0] ** 2 / (1 + inner[1] ** 2)
    assert close(rows, sympy.hessian(value, LETTERS), graph)
    assert close([graph.written_out(rows[1])], [value.diff(A, B)])


def test_equal_expressions_are_one_node():
    graph = Graph()
    a, b, c = graph.letters(LETTERS)
    assert a + b is b + a and (a - b) * c is -(c * (b - a))
    assert (a + b) - b is a and graph.product([(a * b, 2), (b, -2)]) is a * a
    assert graph.read(sqrt(A) * sqrt(A) * B) is a * b
    assert not (a - b) * c + c * (b - a)
    assert graph.read((2 * A - 2 * B) ** 2) is graph.read(4 * (B - A) ** 2)


def test_derivatives_of_a_pair_potential_share_its_powers():
    """The force on one body is minus that on the other, and the Hessian has 1/r³ and 1/r⁵ alone."""
    x = symbols("x0:6", real=True)
    V = 1 / sqrt(sum((x[i] - x[i + 3]) ** 2 for i in range(3)))
    graph = Graph()
    scope, by = Scope(graph), graph.letters(x)
    (force,) = scope.jacobian([graph.read(V)], by)
    assert [force[i] is -force[i + 3] for i in range(3)] == [True] * 3
    hessian = scope.jacobian(force, by)
    assert all(hessian[i][j] is hessian[j][i] for i in range(6) for j in range(6))
    whole = [graph.shown(e) for row in hessian for e in row]
    powers = {e.exp for entry in whole for e in entry.atoms(sympy.Pow) if not e.exp.is_Integer}
    assert powers == {Rational(-3, 2), Rational(-5, 2)}


def test_a_function_without_a_known_derivative_says_so_when_it_is_evaluated():
    graph, f = Graph(), sympy.Function("f", real=True)
    slope = Scope(graph).total([f(A**2)], [A])[0]
    assert slope.has(sympy.Derivative) and slope.free_symbols == {A}


def test_a_node_has_one_key_in_every_order_of_making():
    value = (A + 2 * B) * sin(C) / (1 + A**2)
    one, other = Graph(), Graph()
    other.read(sin(C) * B + C - A)
    assert one.key(one.read(value)) == other.key(other.read(value))
    assert one.key(one.read(value)) != one.key(one.read(2 * value))


def test_held_values_are_rebuilt_with_others_in_place_of_letters():
    graph = Graph()
    held = graph.hold(graph.read(A**2 + B), symbols("e", real=True))
    node = held * graph.read(C)
    (found,) = graph.rebuilt([node], {graph.read(B).index: graph.read(C - A**2)})
    assert graph.shown(found) == C**2
    assert graph.written_out(graph.shown(node)) == (A**2 + B) * C
    assert graph.symbols([node]) == {A, B, C}


def test_a_collected_sum_has_every_term_with_its_first_letter():
    graph = Graph()
    by = graph.letters([A, B])
    for e, wanted in [
        ((A + B) * C + 3 * A, A * (C + 3) + B * C), ((A + C) ** 2, A * (A + 2 * C) + C**2),
        (C * (A * B + 1) - C * A * B, C), (C / A + B, C / A + B),
    ]:  # fmt: skip
        assert graph.shown(graph.collected(graph.read(e), by)) == wanted
