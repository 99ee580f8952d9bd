"""Laws of a step: to which power of h a map is symplectic, self-adjoint, and keeps a momentum."""

import re
from fractions import Fraction

import pytest

from discmech import one_step, prove
from discmech.integrators import rules
from discmech.integrators.rules import MAPS, METHODS
from discmech.integrators.rules.maps import newmark
from discmech.studies.command import main
from discmech.studies.proof.conjugate import trees
from discmech.studies.proof.constants import decimals_in
from discmech.studies.proof.laws import LAWS

slow = pytest.mark.slow
HALF, OFF = Fraction(1, 2), Fraction(1, 10**9)


def explicit(rows, weights, order):
    """An explicit Runge–Kutta method."""

    @one_step(order=order)
    def method(s, z, h):
        k = []
        for row in rows:
            parts = (Fraction(c) * e for c, e in zip(row.split(), k, strict=True))
            k.append(s.f(z + h * sum(parts, 0 * z)))
        parts = (Fraction(b) * e for b, e in zip(weights.split(), k, strict=True))
        return z + h * sum(parts, 0 * z)

    return method


def kicks_and_drifts(*shares, first=0):
    """Kicks and drifts in turn; the first is a kick, or a drift for first=1."""

    @one_step(order=2, groupoids="pair")
    def leapfrog(s, z, h):
        for i, share in enumerate(shares):
            parts = [0 * e for e in s.split(z)]
            which = (i + first + 1) % 2
            parts[which] = h * share * s.split(s.f(z))[which]
            z = z + s.join(*parts)
        return z

    return leapfrog


@one_step(order=2, implicit=True)
def kahan(s, z, Z, h):
    """Kahan's method as a Runge–Kutta one (Celledoni, McLachlan, Owren, Quispel 2013)."""
    return Z - z - h * (2 * s.f((z + Z) / 2) - (s.f(z) + s.f(Z)) / 2)


@one_step(order=2, implicit=True)
def trapezoidal(s, z, Z, h):
    return Z - z - h * (s.f(z) + s.f(Z)) / 2


@one_step(order=2, groupoids="pair")
def boris(s, z, h):
    """Boris's method with a mass: half a drift, the kick and the turn by B = dA, half a drift.

    Qin, Zhang, Xiao, Liu, Sun, Tang, Phys. Plasmas 20 (2013), 084503: it keeps the volume. All that
    it needs is in ξ = N(μ − A) and its derivative.
    """
    n, (x, mu) = s.n, s.split(z)
    half = x + h * s.xi(z) / 2
    slope = s.df(s.join(half, 0 * mu))
    M = slope[:n, n:].inv()
    A, dA = -M * s.xi(s.join(half, 0 * mu)), -M * slope[:n, :n]
    force, B = s.split(s.f(s.join(half, A)))[1], dA.T - dA
    v = (M - h * B / 2).inv() * ((M + h * B / 2) * s.xi(z) + h * force)
    new = half + h * v / 2
    return s.join(new, M * (v - s.xi(s.join(new, 0 * mu))))


#: Aubry, Chartier: order 3, pseudo-symplectic of order 5; as in OrdinaryDiffEq.jl, PSRK3p5q4
PSEUDO_SYMPLECTIC = explicit(
    ["", "3/8", "11/12 -2/3", "-1/12 11/6 -3/4"], "1/9 8/9 -2/9 2/9", order=3
)


#: as Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, II.1, II.4 and II.5, print
#: them: Kutta's 3/8 rule, Fehlberg's, Dormand and Prince's, and Butcher's method
PUBLISHED = [
    explicit(["", "1/3", "-1/3 1", "1 -1 1"], "1/8 3/8 3/8 1/8", 4),
    explicit(["", "1/4", "3/32 9/32", "1932/2197 -7200/2197 7296/2197",
              "439/216 -8 3680/513 -845/4104"], "25/216 0 1408/2565 2197/4104 -1/5", 4),
    explicit(["", "1/5", "3/40 9/40", "44/45 -56/15 32/9",
              "19372/6561 -25360/2187 64448/6561 -212/729",
              "9017/3168 -355/33 46732/5247 49/176 -5103/18656"],
             "35/384 0 500/1113 125/192 -2187/6784 11/84", 5),
    explicit(["", "1/3", "0 2/3", "1/12 1/3 -1/12", "-1/16 9/8 -3/16 -3/8",
              "0 9/8 -3/8 -3/4 1/2", "9/44 -9/11 63/44 18/11 0 -16/11"],
             "11/120 0 27/40 27/40 -4/15 -4/15 11/120", 6),
]  # fmt: skip


@slow
@pytest.mark.parametrize("method", PUBLISHED)
def test_published_methods_have_the_order_that_is_printed(method):
    (answer,) = prove(method, groupoid="time", laws=()).classes.values()
    assert answer.proven and answer.order == method.order and not answer.at_least


def implicit(rows, weights, order):
    """An implicit Runge–Kutta method."""
    A, b = ([[*map(Fraction, row.split())] for row in part] for part in (rows, [weights]))

    @one_step(order=order, stages=len(rows))
    def method(s, z, h, K):
        *at, new = (z + h * sum((c * e for c, e in zip(row, K, strict=True)), 0 * z)
                    for row in A + b)  # fmt: skip
        return new, [k - s.f(e) for k, e in zip(K, at, strict=True)]

    return method


LOBATTO_3A = implicit(["0 0 0", "5/24 1/3 -1/24", "1/6 2/3 1/6"], "1/6 2/3 1/6", order=4)
LOBATTO_3B = implicit(["1/6 -1/6 0", "1/6 1/3 0", "1/6 5/6 0"], "1/6 2/3 1/6", order=4)


def reached(rule, law, kind, name=None):
    """Return the last power of h to which a law holds, or None if no power differs."""
    told = prove(rule, groupoid=kind, laws=law).laws[law]
    a = told[name] if name else min(told.values(), key=lambda a: a.order)
    assert a.proven is a.at_least and (a.power is None) == a.at_least
    assert not a.proven or 0 < a.chance < (1e-13 if law.startswith("conjugate") else 1e-15)
    return None if a.proven else a.order


@pytest.mark.dear("rule3", "rule5", "rule6")
@pytest.mark.parametrize(("rule", "symplectic", "self_adjoint"), [
    ("explicit-euler", 1, 1),
    ("heun", 3, 3),
    pytest.param("runge-kutta-4", 4, 5, marks=slow),
    (PSEUDO_SYMPLECTIC, 5, 3),
    ("implicit-midpoint", None, None),
    (kahan, 2, None),
    (trapezoidal, 2, None),
])  # fmt: skip
def test_powers_of_the_form_and_of_the_adjoint(rule, symplectic, self_adjoint):
    assert reached(rule, "symplectic", "cubic") == symplectic
    assert reached(rule, "self-adjoint", "cubic") == self_adjoint


@pytest.mark.dear("rule1", "rule2")
@pytest.mark.parametrize(("rule", "order", "self_adjoint"), [
    (kicks_and_drifts(HALF, 1, HALF), 2, None),
    (kicks_and_drifts(HALF, 1, HALF + OFF), 0, 1),  # a kick that is too strong
    (kicks_and_drifts(HALF / 2, 1, 3 * HALF / 2, first=1), 1, 1),  # at the wrong place
    (kicks_and_drifts(1, 1), 1, 1),  # the symplectic Euler method
])  # fmt: skip
def test_wrong_kicks_keep_the_form_alone(rule, order, self_adjoint):
    found = prove(rule, groupoid="separable")
    assert {a.order for a in found.classes.values()} == {order}
    form, adjoint = found.laws["symplectic"], found.laws["self-adjoint"]
    assert form and all(a.proven and a.order > order for a in form.values())
    assert {None if a.proven else a.order for a in adjoint.values()} == {self_adjoint}


@pytest.mark.dear("rule4")
@pytest.mark.parametrize(("rule", "power"), [
    ("explicit-euler", 1), ("heun", 3), ("implicit-midpoint", None), (trapezoidal, None),
    (kahan, 4), ("average-vector-field", 4),
    *(pytest.param(*e, marks=slow) for e in (
        ("runge-kutta-4", 4), (PSEUDO_SYMPLECTIC, 5), (LOBATTO_3A, 6), (LOBATTO_3B, 4))),
])  # fmt: skip
def test_powers_of_a_conjugate_form(rule, power):
    """Hairer (2010): the average vector field to h^4; Hairer, Zbinden (2013): Lobatto methods."""
    assert reached(rule, "conjugate-symplectic", "cubic") == power


@pytest.mark.dear("1/4")
@pytest.mark.parametrize("beta", ["1/4", "1/6"])
def test_newmark_is_conjugate_where_the_mass_is_constant(beta):
    """Kane, Marsden, Ortiz, West (2000): variational up to a change of variables, for γ = 1/2."""
    found = prove(newmark("1/2", beta), groupoid="separable", laws=LAWS[:2])
    own, other = found.laws.values()
    assert [(a.order, a.proven) for a in own.values()] == [(2, False)] * 2
    assert [(a.order, a.proven) for a in other.values()] == [(2, False), (5, True)]
    assert any("series of trees" in e for e in found.notes)


def test_rooted_trees():
    assert [len(trees(k)) for k in range(1, 8)] == [1, 1, 2, 4, 9, 20, 48]


@slow
def test_boris_keeps_the_volume_and_no_form():
    found = prove(boris, groupoid="magnetic", laws=LAWS[:4])
    (answer,), laws = found.classes.values(), {law: [*a.values()] for law, a in found.laws.items()}
    assert answer.proven and answer.order == 2 and not answer.at_least
    assert [a.proven for (a,) in laws.values()] == [False, False, True, True]
    assert laws["symplectic"][0].order == 2


@pytest.mark.parametrize(("rule", "power"), [("heun", 3), ("implicit-midpoint", None),
                                             (kahan, 2)])  # fmt: skip
def test_powers_of_the_volume(rule, power):
    assert reached(rule, "volume", "cubic") == power


def test_a_form_that_is_kept_keeps_the_volume():
    for rule in ("rectangle", "implicit-midpoint"):
        form, conjugate, of_volume = prove(rule, groupoid="separable", laws=LAWS[:3]).laws.values()
        assert form == conjugate == of_volume


@pytest.mark.dear(but=("explicit-euler", "rectangle"))
@pytest.mark.parametrize(("rule", "kind", "power"), [
    ("implicit-midpoint", "symmetric", None), ("explicit-euler", "symmetric", 1),
    ("rectangle", "symmetric", None), ("midpoint", "lie_group", None),
    pytest.param(PSEUDO_SYMPLECTIC, "symmetric", 5, marks=slow),
    ("explicit-euler", "lie_group", 1),
])  # fmt: skip
def test_momenta(rule, kind, power):
    assert reached(rule, "momentum", kind) == power


def test_a_law_that_no_class_asked_for_has_is_said_with_those_that_have_it():
    notes = prove("midpoint", groupoid="time", laws="momentum").notes
    said = "momentum is no law of these classes, but of those of --groupoid symmetric, lie_group."
    assert said in notes


def test_a_cyclic_momentum_is_kept_by_every_map_of_the_field():
    assert reached("explicit-euler", "momentum", "symmetric", "H(x, μ) without x₁, n = 2") is None


@slow
def test_a_canonical_method_is_no_poisson_map_on_a_group():
    name = "H(μ) on so(3), Cayley"
    assert reached("implicit-midpoint", "symplectic", "lie_group", name) == 2


@slow
@pytest.mark.parametrize("name", [e for e, m in MAPS.items() if not m.one_form
                                  and "lie_group" not in m.groupoids])  # fmt: skip
def test_what_built_in_maps_keep(name):
    found = prove(name, groupoid="separable").laws
    said = {"implicit-midpoint", "dual-gauss-2", "dual-gauss-3", "stoermer-verlet"}
    assert {a.proven for a in found["symplectic"].values()} == {name in said}
    own = {*said, "average-vector-field", "discrete-gradient", "newmark"}
    assert {a.proven for a in found["self-adjoint"].values()} == {name in own}


def test_a_discrete_lagrangian_needs_no_series():
    found = prove("rectangle", groupoid=["time", "force"], laws="symplectic").laws["symplectic"]
    (answer,) = [a for name, a in found.items() if "force" not in name]
    assert answer.proven and "theorem" in answer.why
    assert not any(a.why == answer.why for name, a in found.items() if "force" in name)


def test_a_claim_is_part_of_the_answer(capsys):
    formula = rules.get("heun").formula
    claimed = one_step(order=2, symplectic=True)(formula)
    assert prove(claimed, groupoid="cubic", laws="symplectic").proven is False
    assert prove(claimed, groupoid="cubic", laws=()).proven
    assert main(["prove", "heun", "--groupoid", "cubic"]) == 0
    assert re.search(r"symplectic: kept to h\^3 only for .*degree 3", capsys.readouterr().out)


@pytest.mark.parametrize("method", METHODS)
def test_published_decimals_are_said_to_be_decimals(method):
    said = decimals_in(rules.get(f"{method}:midpoint"))
    assert bool(said) == (method not in ("triple-jump", "suzuki"))
    assert not said or float(said.split("by ")[1]) < 1e-12


@slow
@pytest.mark.parametrize("method", ["triple-jump:rectangle", "suzuki:trapezoidal"])
def test_compositions_with_adjoint_substeps_are_self_adjoint(method):
    found = prove(method, groupoid="separable", laws="self-adjoint")
    assert found.proven and all(a.proven for a in found.laws["self-adjoint"].values())


def test_a_claim_that_no_class_was_asked_for_is_not_decided():
    """Under forces no form is kept, so those classes prove nothing of one."""
    claimed = one_step(order=1, symplectic=True)(rules.get("explicit-euler").formula)
    found = prove(claimed, groupoid="force", laws="symplectic")
    assert found.laws == {"symplectic": {}} and found.proven is None
    assert prove(claimed, groupoid="force", laws=()).proven


@slow
def test_a_class_that_is_too_large_is_named():
    found = prove("runge-kutta-4", groupoid="product", laws="symplectic").laws["symplectic"]
    assert {answer.proven for answer in found.values()} == {None}
    assert all("coefficients" in answer.why for answer in found.values())
