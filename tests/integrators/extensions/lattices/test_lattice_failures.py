"""What a lattice says where numbers end, and of what it does not take."""

from dataclasses import replace

import numpy as np
import pytest
import sympy

from discmech import BadInput, Lattice, Scheme, black_box, midpoint, pair, so, trapezoidal
from discmech.integrators.errors import CannotMeasure, StepFailure
from discmech.integrators.extensions.lattices import lattice_run, rows_of
from discmech.integrators.rules import gauss
from tests.integrators.extensions.lattices.test_lattices import fput


def beside(on_site, rest, x, v, **more):
    """Nine sites on weak springs at x = rest, of which site 6 begins elsewhere."""
    x0, v0 = np.full((9, 1), float(rest)), np.zeros((9, 1))
    x0[6], v0[6] = x, v
    return Lattice("beside", pair(1), 9, {}, on_site, lambda x, y, p: -((y[0] - x[0]) ** 2) / 20,
                   x0=x0, v0=v0, **more)  # fmt: skip


@pytest.mark.dear(but=("trapezoidal",))
@pytest.mark.sampled
@pytest.mark.parametrize("rule", [gauss(3), midpoint, trapezoidal], ids=lambda r: r.name)
@pytest.mark.parametrize("bonds", ["chain", [(i, i + 1) for i in range(8)]], ids=["chain", "list"])
def test_the_site_that_has_no_numbers_is_named(rule, bonds):
    """Others have none by it."""
    leaving = beside(lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 1.5, 1, 0.05, -1, bonds=bonds)
    for every in (1, 20):
        with pytest.raises(StepFailure, match=r"(is singular|no longer finite).* at site 6 "):
            Scheme(leaving, rule).flow("1/50").trajectory(20, every)


def test_a_site_of_the_second_half_is_named(monkeypatch):
    """Halves that are stepped side by side have counts of their own."""
    monkeypatch.setattr(lattice_run, "LEAST", 2)
    leaving = beside(lambda x, v, p: v[0] ** 2 / 2 + v[0] ** 4 / 9 - x[0] ** 1.5, 1, 0.05, -1)
    with pytest.raises(StepFailure, match="at site 6 at step 3"):
        Scheme(leaving, trapezoidal).flow("1/50").trajectory(20, 20)


@pytest.mark.slow
def test_a_site_whose_first_step_is_not_found_is_named():
    """Its step ends where its mass is infinite, before a row is shown."""
    ending = beside(lambda x, v, p: (v[0] ** 2 + v[0] ** 4 / 9) / 2 / (1 + x[0]), 0, 1, -8)
    with pytest.raises(StepFailure, match="at site 6 at step 0"):
        Scheme(ending, trapezoidal).flow("1/4").trajectory(20)


@pytest.mark.slow
def test_a_site_without_a_velocity_is_named_at_once():
    """One of no mass has a row of no numbers."""
    masses = np.array([1.0, 1, 1, 0, 1])
    light = fput(parameters={"mass": masses, "stiff": 1, "alpha": 0}, sites=5,
                 x0=np.arange(5.0)[:, None] ** 2, v0=np.zeros((5, 1)))  # fmt: skip
    with pytest.raises(StepFailure, match=r"at site 3 at step 0"):
        Scheme(light, trapezoidal).flow("1/50").trajectory(0)


@pytest.mark.parametrize(("given", "said"), [
    ({"x0": None}, "x0 is left out; give an array"),
    ({"v0": None}, "v0 is left out; give an array"),
])  # fmt: skip
def test_an_array_that_is_left_out_is_named(given, said):
    with pytest.raises(BadInput, match=said):
        fput(**given)


def test_an_algebra_is_no_site():
    with pytest.raises(BadInput, match=r"site is so\(3\); give pair\(n\), lie_group\("):
        replace(fput(), site=so(3))


@pytest.mark.parametrize("words", [{"tolerance": 1e-8}, {"step": "1/10", "on_edge": "shrink"}])
def test_what_flows_of_scenes_take_is_refused_in_a_sentence(words):
    with pytest.raises(BadInput, match=r"is for scenes; a lattice has flow\(step\)"):
        Scheme(fput(), midpoint).flow(**words)


@pytest.mark.parametrize(
    "given, words",
    [
        ({"on_site": lambda x, v, p: v[0] ** 2 + sympy.Symbol("z")}, "on_site holds .* symbol z"),
        ({"on_bond": lambda x, y, p: sympy.Symbol("z") * x[0]}, "on_bond holds .* symbol z; write"),
        *(({"symmetries": {"a": xi}}, f"the symmetry a {words}") for xi, words in (
            (lambda x: [1], r"is a function of \(x\); write it with \(x, p\)"),
            (lambda x, p: None, "is None, not an expression"),
            (lambda x, p: [1, 2], "gives 2 entries; give a list of 1"),
            (lambda x, p: [sympy.Symbol("z")], "holds the unknown symbol z"),
        )),
    ],
)  # fmt: skip
def test_what_a_function_of_a_lattice_may_not_give(given, words):
    """Equations of a bond are otherwise written with a letter that no kernel has."""
    with pytest.raises(BadInput, match=words):
        Scheme(fput(**given), midpoint)


@pytest.mark.parametrize("given, count", [
    (1, 1), ([1], 1), (np.array(1), 1), (sympy.Matrix([1]), 1), ([[1], [2]], 2), (((1,), (2,)), 2),
    (np.array([[1], [2]]), 2), ([sympy.Matrix([1]), sympy.Matrix([2])], 2),
])  # fmt: skip
def test_a_symmetry_gives_one_velocity_or_several_in_any_form(given, count):
    """A site of one coordinate has one velocity."""
    assert Scheme(fput(symmetries={"a": lambda x, p: given}), midpoint).flow(1)
    assert len(rows_of(given)) == count


def test_a_program_on_a_lattice_is_refused_as_one():
    """It was evaluated with symbols, as a rule is."""

    @black_box(order=2)
    def drift(q, p, h):
        return q + h * p, p

    with pytest.raises(CannotMeasure, match="lattices run by rules, and drift is a program"):
        Scheme(fput(), drift)
