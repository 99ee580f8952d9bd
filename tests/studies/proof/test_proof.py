"""Proofs of order: what is right is proven, what is wrong is disproven, and the rest is said."""

import json
import math
import random
import signal
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import pytest
import sympy

from discmech import (
    BadInput,
    Scheme,
    compose,
    discretisation,
    explain,
    one_step,
    prove,
    scenes,
    splitting,
)
from discmech.integrators import rules
from discmech.integrators.rules.parameters import with_parameters
from discmech.studies.command import main
from discmech.studies.core.result import StudyResult
from discmech.studies.core.store import Store
from discmech.studies.proof.budget import Budget, OutOfTime
from discmech.studies.proof.classes import classes_of
from discmech.studies.proof.leading import of_rule
from discmech.studies.proof.letters import Told, lettered
from discmech.studies.proof.proving import _answer
from discmech.studies.proof.table import proof_table
from discmech.studies.report.verdicts import proofs

slow = pytest.mark.slow
HALF, THIRD = Fraction(1, 2), sympy.Rational(1, 3)


@discretisation(order=2)
def two_thirds(L, G, x, u, h):
    return h * L(G.target(x, u, h / 3), u) / 2 + h * L(G.target(x, u, 2 * h / 3), u) / 2


def nodes_with_a_stage(node, weight=HALF, bend=1, sign=1, term=0):
    """Two nodes (1 ± node)/2 on a curve of degree 2: Gauss for node² = 1/3."""

    @discretisation(order=4, stages=1, name="bent")
    def rule(L, G, x, u, h, s):
        total = term * h**4 * L(x, u)
        for side, share in ((-1, weight), (1, 1 - weight)):
            c = (1 + side * node) / 2
            w, dw = c * u + bend * c * (c - 1) * s[0], u + sign * (2 * c - 1) * s[0]
            total += h * share * L(G.target(x, w, h), G.velocity(x, w, dw, h))
        return total

    return rule


def weighted(points, order, term=0):
    """h Σ b L at fractions c of the step, and a term of h^order."""

    @discretisation(order=order, name="weighted")
    def rule(L, G, x, u, h):
        total = sum(h * b * L(x if c == 0 else G.target(x, u, c * h), u) for c, b in points)
        return total + term * h**order * L(x, u)

    return rule


def proven(rule, order=None, kind="time"):
    return prove(rule, order, groupoid=kind, laws=()).proven


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="the system has no such timer")
def test_a_budget_ends_a_block_that_swallows_errors():
    budget, before = Budget(0.02), signal.getsignal(signal.SIGPROF)
    with pytest.raises(OutOfTime), budget:
        while True:
            with suppress(Exception):
                sum(range(100))
    assert budget.left <= 0 and signal.getsignal(signal.SIGPROF) == before
    with pytest.raises(OutOfTime), budget:
        raise AssertionError("nothing is left")


@pytest.mark.dear(but=("midpoint", "2]", "heun", "verlet", "[trapezoidal"))
@pytest.mark.parametrize("name", ["midpoint", "trapezoidal", "gauss-2", "lobatto-3", "heun",
                                  "runge-kutta-4", "implicit-midpoint", "stoermer-verlet",
                                  "discrete-gradient", "triple-jump:midpoint",
                                  "suzuki:trapezoidal", "triple-jump:rectangle"])  # fmt: skip
def test_orders_that_rules_state(name):
    found = prove(name, groupoid="time", laws=())
    (answer,) = found.classes.values()
    assert found.proven and answer.order == rules.get(name).order and not answer.at_least
    assert answer.chance < 1e-15


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gauss-3", "gauss-4", "lobatto-5"])
def test_high_orders_on_nodes_in_the_field(name):
    (answer,) = [
        a for e, a in prove(name, groupoid="pair", laws=()).classes.items() if "n = 1" in e
    ]
    assert answer.proven and answer.order == rules.get(name).order


@pytest.mark.parametrize("rule", ["rectangle", *(pytest.param(e, marks=slow)
                                                for e in ("midpoint", two_thirds))])  # fmt: skip
def test_every_class(rule):
    found = prove(rule, laws=())
    assert found.proven
    assert {"L(x, v), n = 3", "L(ξ) on gl(2), Cayley", "L(ξ) on r3, exponential"} <= {
        *found.classes
    }
    order, told, why = found.classes["L(x, v), n = 2"]
    assert told and order == found.order and f"h^{order + 1} differs in x₁" in why


@slow
def test_roots_in_a_rule():
    exact = 1 / sympy.sqrt(3)
    assert proven(nodes_with_a_stage(exact))
    jump = 1 / (2 - 2**THIRD)
    assert proven(compose(rules.midpoint, [jump, 1 - 2 * jump, jump]), 4)
    assert proven(nodes_with_a_stage(sympy.sqrt(2) * sympy.sqrt(6) / 6))
    denested = (1 + sympy.sqrt(2) - sympy.sqrt(3 + 2 * sympy.sqrt(2), evaluate=False)) + exact
    assert proven(nodes_with_a_stage(denested)) is not False


def test_roots_in_the_states_of_a_map():
    """Forest and Ruth's method, and a root that a field may take with the other sign."""
    jump, root = 1 / (2 - 2**THIRD), sympy.sqrt(3 + 2 * sympy.sqrt(2), evaluate=False)

    @one_step(order=4, groupoids="pair")
    def forest_ruth(s, z, h):
        for drift, kick in ((jump / 2, jump), ((1 - jump) / 2, 1 - 2 * jump),
                            ((1 - jump) / 2, jump), (jump / 2, 0)):  # fmt: skip
            z = z + h * s.join(drift * s.split(s.f(z))[0], 0 * s.split(z)[1])
            z = z + h * s.join(0 * s.split(z)[0], kick * s.split(s.f(z))[1])
        return z

    @one_step(order=2)
    def rooted(s, z, h):
        return z + h * s.f(z + h * (root - sympy.sqrt(2)) * s.f(z) / 2)

    assert proven(forest_ruth, kind="separable")
    assert {proven(rooted) for _ in range(4)} <= {True, None}


def test_the_order_of_a_rule_that_states_none():
    rule = weighted([(0, Fraction(1, 6)), (HALF, Fraction(2, 3)), (1, Fraction(1, 6))], 2)
    unstated = discretisation()(rule.formula)
    assert prove(unstated, groupoid="time", laws=()).order == 2


@pytest.mark.slow
def test_a_class_of_its_own():
    assert proven("imex", kind="fast")

    @one_step(order=2, groupoids="pair")
    def leapfrog(s, z, h):
        x, mu = s.split(z)
        mu = mu + h / 2 * s.split(s.f(s.join(x, mu)))[1]
        x = x + h * s.split(s.f(s.join(x, mu)))[0]
        return s.join(x, mu + h / 2 * s.split(s.f(s.join(x, mu)))[1])

    found = prove(leapfrog, groupoid=["separable", "pair"])
    assert found.classes["T(μ) + V(x), n = 2"].proven
    assert found.classes["H(x, μ), n = 1"].proven is False


def wrong_rules():
    """Forty rules with one number that is off, by 1e-9 or more, and the order that they state."""
    draw, cases = random.Random(5), []
    for k in range(40):
        off = Fraction(draw.choice((-1, 1)) * draw.randrange(1, 1000), 10 ** draw.randrange(3, 13))
        kind, node = k % 8, 1 / sympy.sqrt(3)
        cases.append({
            0: lambda off=off: weighted([(HALF + off, 1)], 2),
            1: lambda off=off: weighted([(0, HALF + off), (1, HALF - off)], 2),
            2: lambda off=off: weighted([(Fraction(1, 3), HALF), (Fraction(2, 3) + off, HALF)], 2),
            3: lambda off=off: weighted([(HALF, 1 + off)], 2),
            4: lambda off=off: weighted([(HALF, 1)], 2, term=off),
            5: lambda off=off, node=node: nodes_with_a_stage(node + sympy.Rational(off)),
            6: lambda off=off, node=node: nodes_with_a_stage(node, weight=HALF + off),
            7: lambda off=off, node=node: nodes_with_a_stage(node, term=off),
        }[kind])  # fmt: skip
    cases += [lambda: nodes_with_a_stage(1 / sympy.sqrt(3), bend=-1),
              lambda: nodes_with_a_stage(1 / sympy.sqrt(3), sign=-1),
              lambda: weighted([(0, -HALF), (1, HALF)], 2),
              lambda: compose(rules.midpoint, ["1.351207191959", "-1.702414383918",
                                               "1.351207191959"])]  # fmt: skip
    return cases


@pytest.mark.dear(but=("<lambda>1",))
@pytest.mark.parametrize("make", wrong_rules())
def test_wrong_rules_are_disproven(make):
    rule = make()
    found = prove(rule, 4 if rule.method else None, groupoid="time", laws=())
    (answer,) = found.classes.values()
    assert answer.proven is False and answer.order < found.order
    assert answer.power == answer.order + 1


@pytest.mark.parametrize("power", [0, 1, 2])
def test_wrong_maps_are_disproven(power):
    @one_step(order=2)
    def off(s, z, h):
        k = s.f(z)
        moved = z + h * (k + s.f(z + h * k)) / 2
        return moved + h**power * Fraction(1, 10**9) * (s.f(z) if power else z)

    assert proven(off) is False


def test_a_force_gradient_rule_is_proven_for_the_class_that_it_is_meant_for():
    """It inverts L.mass, and asks for L at a second place, so that a higher degree is needed."""

    @discretisation(order=4, groupoids="pair")
    def straight(L, G, x, u, h):
        mid, end = G.target(x, u, h / 2), G.target(x, u, h)
        g = L.gradient(mid)
        action = h * (L(x, u) + 4 * L(mid, u) + L(end, u)) / 6
        return action - h**3 / 24 * (g.T * L.mass(mid).inv() * g)[0]

    meant = next(e for e in classes_of(False, False) if e.part == "quadratic")
    order, proven, _ = _answer(meant, lettered(straight, Told()), 4, 4, random.Random(1))
    assert (order, proven) == (4, True)


@pytest.mark.slow
def test_decimals_are_said_to_be_decimals():
    assert main(["prove", "kahan-li-6:midpoint", "--groupoid", "time"]) == 3
    (answer,) = prove("kahan-li-6:midpoint", groupoid="time", laws=()).classes.values()
    assert answer.proven is None and answer.order == 2 and "decimals" in answer.why
    found = splitting(["0.5", "1", "0.5"], first="potential")
    assert proven(found)


def test_a_rule_that_reads_parameters_or_needs_more_than_fractions():
    @discretisation(order=2)
    def reads(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2), u) + h * L.parameters.gravity

    @discretisation(order=2)
    def rounds(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2), u) * sympy.exp(u[0] * h**3 + u[0])

    for rule, words in ((reads, "parameter gravity"), (rounds, "exp")):
        found = prove(rule, groupoid="time", laws=())
        assert found.proven is None and words in str([*found.classes.values()])


def test_transcendental_numbers():
    @discretisation(order=2)
    def cancels(L, G, x, u, h):
        return h * (sympy.pi * L(x, u) + (1 - sympy.pi) * L(G.target(x, u, h), u))

    found = prove(cancels, 1, groupoid="time", laws=())
    assert found.proven
    assert proven(cancels, 2) is None  # π may be anything that is not known


@slow
def test_conditions_on_an_open_number():
    w = sympy.Symbol("w")

    @discretisation(order=1)
    def one_point(L, G, x, u, h):
        return h * L(G.target(x, u, w * h), u)

    found = prove(one_point, groupoid="pair", laws=())
    assert found.proven
    assert (
        found.conditions[1] == "for every value of w" and found.conditions[3] == "for no value of w"
    )
    assert found.conditions[2].endswith("w = 1/2")
    assert found.leading == {"L_x·v": w - HALF} or sympy.expand(
        found.leading["L_x·v"] - w + HALF) == 0  # fmt: skip

    @discretisation(order=2, parameters=("w",))
    def mixed(L, G, x, u, h, w):
        ends = (L(x, u) + L(G.target(x, u, h), u)) / 2
        return h * w * ends + h * (1 - w) * L(G.target(x, u, h / 2), u)

    found = prove(mixed, groupoid="pair", laws=())
    assert [found.conditions[k] for k in (2, 3)] == ["for every value of w", "for no value of w"]
    assert sympy.expand(found.leading["v·L_xx v"] - (w / 12 - (1 - w) / 24)) == 0
    with pytest.raises(BadInput, match="leaves w open"):
        Scheme(scenes.get("pendulum"), mixed)


@slow
def test_a_node_squared():
    found = prove(nodes_with_a_stage(sympy.Symbol("t")), groupoid="time", laws=())
    assert found.proven is None
    every = (
        "for every value of t but t = 0, where it has no step"  # as both nodes are in the middle
    )
    assert [found.conditions[k] for k in (2, 5)] == [every, "for no value of t"]
    assert found.conditions[4].startswith("3*t**2 - 1 = 0")


@discretisation(order=2, stages=1, parameters=("w",))
def eighths(L, G, x, u, h, s, w):
    """Weights w/2, (1 − w)/2, (1 − w)/2, w/2 on a parabola: no step for 8w + 1 = 0."""
    total = 0
    for k, b in enumerate((w, 1 - w, 1 - w, w)):
        c = Fraction(k, 3)
        at, bend = c * u + c * (c - 1) * s[0], (2 * c - 1) * s[0]
        total += h * b / 2 * L(G.target(x, at, h), G.velocity(x, at, u + bend, h))
    return total


@slow
def test_values_without_a_step_are_named():
    found = prove(eighths, groupoid="time", laws="self-adjoint")
    assert found.conditions[2] == "for every value of w but w = -1/8, where it has no step"
    assert found.conditions[4] == "4*w - 1 = 0: w = 1/4"
    (law,) = found.laws["self-adjoint"].values()
    assert law.proven and law.order == 5


def test_a_rule_without_a_step_keeps_no_form():
    found = prove(with_parameters(eighths, {"w": "-1/8"}), groupoid="time", laws="symplectic")
    (answer,), (law,) = found.classes.values(), found.laws["symplectic"].values()
    assert answer.proven is law.proven is None and "singular" in law.why


def test_laws_of_a_rule_with_an_open_number():
    @one_step(order=1, implicit=True, parameters=("w",))
    def theta(s, z, Z, h, w):
        return Z - z - h * s.f(w * z + (1 - w) * Z)

    found = prove(theta, groupoid=["cubic", "time"])
    for law in ("symplectic", "self-adjoint", "volume"):
        first, other = found.laws[law].values()
        assert first.condition == "for every value of w, to h^3 if 2*w - 1 = 0: w = 1/2"
        assert other.condition == "for most w" and first.order == other.order == 1
    assert "symplectic: kept to h^1 for every value of w, to h^3 if 2*w - 1 = 0" in found.text()
    (answer,) = found.laws["conjugate-symplectic"].values()
    assert answer.proven is None and "values of w alone" in answer.why


@slow
@pytest.mark.parametrize(("rule", "said"), [
    (eighths, "no sum of v·L_xx v, f·M⁻¹f for every value of w"),
    (nodes_with_a_stage(sympy.Symbol("t")), "order is 1, 2 or 4 for every value of t."),
    (with_parameters(eighths, {"w": "1/7"}), "no sum of v·L_xx v, f·M⁻¹f."),
])  # fmt: skip
def test_why_there_is_no_leading_error(rule, said):
    found = prove(rule, groupoid="pair", laws=())
    assert not found.leading and any(said in e for e in found.notes)


def test_several_open_numbers():
    @discretisation(order=2, parameters=("a", "b"))
    def ends(L, G, x, u, h, a, b):
        return h * (a * L(x, u) + b * L(G.target(x, u, h / 2), u)
                    + (1 - a - b) * L(G.target(x, u, h), u))  # fmt: skip

    assert prove(ends, groupoid="time", laws=()).conditions[2] == "2*a + b - 1 = 0"


@pytest.mark.dear(but=("wanted3",))
@pytest.mark.parametrize(("rule", "wanted"), [
    ("midpoint", {"v·L_xx v": Fraction(-1, 24), "f·M⁻¹f": Fraction(1, 24)}),
    ("trapezoidal", {"v·L_xx v": Fraction(1, 12), "f·M⁻¹f": Fraction(1, 24)}),
    (two_thirds, {"v·L_xx v": Fraction(-1, 36), "f·M⁻¹f": Fraction(1, 24)}),
    ("rectangle", {"L_x·v": Fraction(-1, 2)}),
])  # fmt: skip
def test_leading_errors_by_hand(rule, wanted):
    assert prove(rule, groupoid="pair", laws=()).leading == wanted


@slow
def test_the_leading_error_on_the_straight_path_is_that_of_the_quadrature():
    found = prove("gauss-2", groupoid="pair", laws=()).leading
    assert found["L_xxxx(v, v, v, v)"] == Fraction(7, 36) / 24 - Fraction(1, 120)


def test_the_command(tmp_path, capsys):
    file = tmp_path / "found.json"
    assert main(["prove", "midpoint", "--groupoid", "time", "--json", str(file)]) == 0
    assert "order 2 proven" in capsys.readouterr().out
    told = json.loads(file.read_text())
    (answer,) = told["classes"].values()
    assert told["verdict"] == "proven" and answer["order"] == 2 and answer["proven"] is True
    assert main(["prove", "midpoint", "--groupoid", "time", "--order", "3"]) == 1


def test_a_rule_that_cannot_be_asked_does_not_hinder_others(tmp_path, capsys):
    file = tmp_path / "own.py"
    file.write_text("""from discmech import discretisation

@discretisation(order=2)
def sound(L, G, x, u, h):
    return h * L(G.target(x, u, h / 2), u)

@discretisation(order=2)
def asks(L, G, x, u, h):
    return h * L(G.target(x, u, h / 2 if h > 0 else h), u)
""", "utf-8")  # fmt: skip
    assert main(["prove", str(file), "--groupoid", "time"]) == 2
    told = capsys.readouterr()
    assert "sound: order 2 proven" in told.out and "truth value" in told.err
    found = tmp_path / "found.json"
    words = [str(file), "midpoint", "--groupoid", "time", "--order", "3", "--json", str(found)]
    assert main(["prove", *words]) == 1
    answer = json.loads(found.read_text())
    assert answer["verdict"] == "disproven" and len(answer["rules"]) == 2


@pytest.mark.parametrize(("words", "said"), [
    (["midpoint", "--order", "13"], "12"),
    (["midpoint", "--groupoid", "pears"], "did you mean pair"),
    (["midpint"], "midpoint"),
    (["gauss-8"], "12"),
])  # fmt: skip
def test_bad_words(words, said, capsys):
    assert main(["prove", *words]) == 2
    assert said in capsys.readouterr().err


def test_bad_rules():
    chance = random.Random(1)

    @discretisation(order=2)
    def random_weight(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2), u) * Fraction(chance.randrange(1, 10**6), 10**6)

    @discretisation(order=2)
    def asks(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2 if h > 0 else h), u)

    for rule, words in ((random_weight, "another value each time"), (asks, "truth value")):
        with pytest.raises(BadInput, match=words):
            prove(rule)
    for given in ({"laws": 5}, {"groupoid": 5}):
        with pytest.raises(BadInput, match="is 5: give a word"):
            prove("midpoint", **given)


def test_floats_in_the_points_of_a_rule_with_stages():
    @discretisation(order=2, stages=1)
    def ends(L, G, x, u, h, s):
        points = [(th * u + th * (1 - th) * s[0], u + (1 - 2 * th) * s[0]) for th in (0.0, 1.0)]
        return h * sum(L(G.target(x, w, h), dw) for w, dw in points) / 2

    assert prove(ends, groupoid="pair", laws=()).proven is True


def test_floats_are_said():
    @discretisation(order=2)
    def rounded(L, G, x, u, h):
        return h * (0.1 * L(x, u) + 0.9 * L(G.target(x, u, h / 1.8), u))

    found = prove(rounded, groupoid="time", laws=())
    assert found.proven is False
    assert "0.1 is 3602879701896397/36028797018963968" in found.notes[0]


def test_the_fixture(assert_proven_order):
    assert assert_proven_order(two_thirds, groupoid="time")["verdict"] == "proven"
    with pytest.raises(AssertionError, match="h\\^3 differs in x₁"):
        assert_proven_order("midpoint", 3, groupoid="time")


@pytest.mark.slow
def test_dimensions_by_the_theorem_on_trees():
    (note,) = [e for e in prove(two_thirds, groupoid="pair", laws=()).notes if "every n" in e]
    assert "order 2 for every n, if the rule is one formula for all n, by a theorem" in note

    @discretisation(order=2)
    def squared(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2), u) + h**3 * L(x, u) ** 2

    found = prove(squared, groupoid="pair", laws=())
    assert found.proven and not any("every n" in e for e in found.notes)


@pytest.mark.slow
def test_a_rule_of_points_has_no_meaning_with_the_time_among_them():
    @discretisation(order=2, groupoids="pair")
    def verlet(L, G, x, u, h):
        kinetic = h * (u.T * L.mass(x) * u)[0] / 2
        return kinetic - h * (L.potential(x) + L.potential(x + h * u)) / 2

    @discretisation(order=2, groupoids="pair")
    def ends(L, G, x, u, h):
        return h * (L(x, u) + L(x + h * u, u)) / 2

    found = prove(verlet, groupoid="separable", laws=())
    assert found.classes["v·Mv/2 − V(x), n = 2"].proven and found.proven is False
    found = prove(ends, groupoid=["separable", "time"], laws=())
    assert found.proven and "L(x, v, t), n = 1" not in found.classes
    assert any("no meaning for L(x, v, t)" in e and "test_proof.py" in e for e in found.notes)


def difference(ask, power):
    """The power-th difference of values at 0, 1, 2, …, which is 0 for polynomials below it."""
    return sum((-1) ** j * math.comb(power, j) * ask(j) for j in range(power + 1))


def far(ask):
    """A difference of values at v, 2v, …, which is 0 for polynomials of degree 3."""
    return difference(lambda j: ask(1 + j), 4)


def midpoint_with(more):
    """A midpoint rule with another term."""

    @discretisation(order=2)
    def rule(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2), u) + more(L, G, x, u, h)

    return rule


def heun_with(more):
    """Heun's method with another multiple of the field."""

    @one_step(order=2)
    def method(s, z, h):
        k = s.f(z)
        return z + h * (k + s.f(z + h * k)) / 2 + more(s, z, h) * k

    return method


def with_derivative(count, by="x", size=10):
    """A midpoint rule with h² times a derivative of L, which has order 1 or less."""

    def slope(L, G, x, u, h):
        found = L(x, u)
        for letter in by:
            found = sympy.diff(found, {"x": x, "v": u}[letter][0], count // len(by))
        return h**2 * found / size

    return midpoint_with(slope)


@pytest.mark.slow
@pytest.mark.parametrize(("count", "by", "kind"), [
    (1, "x", "time"), (2, "x", "time"), (3, "x", "time"),
    (4, "x", "pair"), (6, "x", "pair"), (6, "v", "pair"), (6, "xv", "pair"), (9, "x", "pair"),
])  # fmt: skip
def test_derivatives_that_a_rule_takes_itself_are_counted(count, by, kind):
    """h² ∂⁶L/∂x⁶ has no effect where L is of degree 6, nor h² V‴ where V is a cubic."""
    assert proven(with_derivative(count, by, 10**6 if kind == "time" else 10), kind=kind) is False


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2, 3])
def test_derivatives_that_a_map_takes_itself_are_counted(count):
    assert proven(heun_with(lambda s, z, h: h**2 * s.df(z) ** count / 10**6)) is False


@pytest.mark.dear("2]")
@pytest.mark.parametrize("power", [1, 2])
def test_derivatives_by_differences_are_counted(power):
    """Fourth differences over h² are h² times a fourth derivative: order 1."""
    assert proven(midpoint_with(lambda L, G, x, u, h: difference(
        lambda j: L(G.target(x, u, j * h), u) if j else L(x, u), power + 2) / h**power
    )) is False  # fmt: skip


def test_more_derivatives_than_polynomials_can_show_are_not_decided():
    found = prove(with_derivative(30), groupoid="pair", laws=())
    assert found.proven is None
    assert "takes 30 derivatives of L itself" in str([*found.classes.values()])


#: rules that differ from one of order 2, but not where L or H is a short polynomial
HIDDEN = {
    "far velocities": midpoint_with(lambda L, G, x, u, h: h**2 * far(lambda c: L(x, c * u))),
    "far places": midpoint_with(
        lambda L, G, x, u, h: h**2 * far(lambda c: L(G.target(x, c * u, 1), u))),
    "a cosine": midpoint_with(lambda L, G, x, u, h: h**2 * int(L(x, u).has(sympy.cos))),
    "a coefficient": midpoint_with(
        lambda L, G, x, u, h: (h * u[0]) ** 2 * L(x, u).expand().coeff(x[0], 9)),
    "a parameter": midpoint_with(lambda L, G, x, u, h: 0 * L.parameters.c[0]),
    "a root": midpoint_with(
        lambda L, G, x, u, h: h**2 * (sympy.sqrt(u[0] ** 2 + 1 + 2 * u[0]) - u[0] - 1)),
    "far states": heun_with(lambda s, z, h: h**2 * far(lambda c: s.H(c * z))),
    "differences": heun_with(lambda s, z, h: difference(
        lambda j: s.H(z + j * h * s.f(z)), 5) / h**3),
    "a degree": heun_with(lambda s, z, h: h**2 * int(s.degree is None or s.degree > 9)),
}  # fmt: skip


@pytest.mark.parametrize("name", HIDDEN)
def test_what_short_polynomials_hide_is_not_proven(name):
    assert proven(HIDDEN[name]) is not True


def test_a_size_of_the_step_is_not_followed_back():
    """With h³|h| a midpoint rule is not self-adjoint, though its series for h > 0 looks so."""
    sized = midpoint_with(lambda L, G, x, u, h: h**2 * sympy.Abs(h) * L(G.target(x, u, h / 2), u))
    found = prove(sized, groupoid="time", laws="self-adjoint").laws["self-adjoint"]
    assert {a.proven for a in found.values()} == {None}


def test_a_pole_beside_the_solution_is_no_disproof():
    """The explicit Euler method, with twice the field as its stage: order 1."""

    @one_step(order=1, stages=1)
    def twice(s, z, h, K):
        return z + h * K[0] / 2, [(K[0] - 2 * s.f(z)) / h]

    assert proven(twice) is None


@slow
def test_the_table_of_leading_errors():
    page = (Path(__file__).parents[3] / "docs" / "proofs.md").read_text("utf-8")
    table = page.split("| rule | order | coefficients |")[1].split("\n\n")[0].splitlines()[2:]
    assert len(table) == 5
    for row in table:
        names, order, numbers = (cell.strip() for cell in row.strip("|").split("|"))
        wanted = [Fraction(e.replace("−", "-")) for e in numbers.split(", ")]
        for name in names.split(", "):
            assert rules.get(name).order == int(order)
            assert [*of_rule(rules.get(name)).values()] == wanted


@pytest.mark.slow
def test_explain_has_the_leading_error():
    assert "h^3 ((-1/24) v·L_xx v + (1/24) f·M⁻¹f)" in explain("pendulum", "midpoint")
    assert "leading error" not in explain("rigid-body", "midpoint")
    assert "(-1/4320) L_xxxx" in explain("pendulum", "gauss-2")
    for scene in ("charged-particle", "double-pendulum"):  # A·v, and a mass matrix of x
        assert "leading error" not in explain(scene, "gauss-2")


@slow
def test_the_table_of_the_report(monkeypatch):
    """It has an order for each class, and is kept with what was proven."""
    store = Store()
    table = proof_table(store=store)
    for name, *cells in table["lines"]:
        wanted = f"proven: order {rules.get(name).order}"
        assert cells[:3] == [wanted] * 3 and len(cells) == len(table["heads"]) - 1
    monkeypatch.setattr("discmech.studies.proof.table.prove", None)
    assert proof_table(store=store) == table  # nothing is proven again
    laws = {line[0]: line[5:7] for line in table["lines"]}
    assert laws["heun"] == ["kept to h^3 only"] * 2
    assert laws["midpoint"][0].startswith("proven by a theorem")


def test_a_rule_of_group_elements_has_no_meaning_on_pairs():
    @discretisation(order=1)
    def turned(L, G, x, u, h):
        return h * L(x, u) + 0 * G.element(u, h).trace()

    found = prove(turned, groupoid=("pair", "time", "lie_group", "action"), laws=())
    assert found.proven and {name[:4] for name in found.classes} == {"L(ξ)", "L(x,"}
    assert not any("v" in name for name in found.classes)
    said = "it asks for group elements, so it has no meaning for pair, time."
    assert said in found.notes
    with pytest.raises(BadInput, match=r"test_proof.py.*pair\(1\) has no group elements"):
        prove(turned, groupoid="pair", laws=())


def test_what_is_not_asked_is_named_with_its_kind():
    found = prove("midpoint", 9, laws=())
    assert [*found.classes] == ["L(x, v), n = 1"] and found.proven is False
    assert found.not_asked["time"] == ["L(x, v, t), n = 1"] and "lie_group" in found.not_asked
    assert "L(x, v, t), n = 1 (--groupoid time)" in found.text()
    assert "too large to be asked at order 9: L(x, v), n = 2; L(x, v), n = 3" in found.text()
    (line,) = proofs(StudyResult(proofs=[found.to_json() | {"command": "discmech prove midpoint"}]))
    assert "classes that take longer are asked for by --groupoid" in line
