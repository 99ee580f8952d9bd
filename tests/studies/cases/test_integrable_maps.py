"""Published integrable maps keep their integrals, which hold the step, to round-off."""

import pytest
import sympy

from discmech import Conserved, one_step, scenes
from discmech.integrators import Scene, action, pair, so
from tests.studies.cached_results import measured

H = sympy.Rational(1, 20)


@one_step(order=2, groupoids="pair")
def mcmillan_suris(s, z, h):
    """x₊ + x₋ = 2κx/(1 + νx²) for ẍ = −x − x³, κ = 1 − h²/2, ν = h²/(2κ), of McMillan (1971) and
    Suris (1989)."""
    x, mu = s.split(z)

    def kick(x):  # (κx/(1 + νx²) − x)/h
        square = x[0] ** 2
        return -x * (h / 2 + h / (2 - h**2) * square) / (1 + of_duffing(h)[1] * square)

    half = mu + kick(x)
    new = x + h * half
    return s.join(new, half + kick(new))


def of_duffing(h):
    return 1 - h**2 / 2, h**2 / (2 - h**2)


def integral(x, mu, h):
    """x₊² + x² − 2κx x₊ + νx²x₊² over h², where x₊ = κx/(1 + νx²) + hμ."""
    _, nu = of_duffing(h)
    more, square = 1 + nu * x[0] ** 2, x[0] ** 2
    return more * mu[0] ** 2 + square * (square / (2 - h**2) + 1 - h**2 / 4) / more


def duffing(quantity):
    return Scene(
        "mcmillan", pair(1), lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 2 / 2 - x[0] ** 4 / 4,
        parameters={"h": H}, x0=[1], v0=["0.3"], duration=5, step=H,
        symmetries=[Conserved("I", quantity)],
    )  # fmt: skip


@one_step(order=1, groupoids="action", implicit=True)
def bobenko_suris(s, z, Z, h):
    """The top in the frame of the room: m₊ − m = h p × a, a₊ − a = h/2 m₊ × (a + a₊), m = −μ, of
    Bobenko, Suris, Commun. Math. Phys. 204 (1999), 147."""
    (a, mu), (A, M) = s.split(z), s.split(Z)
    p = sympy.Matrix([0, 0, 1])
    return s.join(A - a + h / 2 * M.cross(a + A), M - mu + h * p.cross(a))


def top(quantity):
    """A round body, whose frame may be that of the room."""
    return Scene(
        "round-top", action(so(3)), lambda x, v, p: v.dot(v) / 2 - x[2], parameters={"h": H},
        x0=["2/7", "3/7", "6/7"], v0=["0.5", "-0.4", "0.8"], duration=5, step=H,
        symmetries=[Conserved("H", quantity),
                    Conserved("|Γ|²", lambda x, mu, p: x.dot(x), kind="Casimir", value=1)],
    )  # fmt: skip


def energy_of_top(x, mu, h):
    p = sympy.Matrix([0, 0, 1])
    return mu.dot(mu) / 2 + x.dot(p) + h / 2 * x.dot(p.cross(mu))


MAPS = [(mcmillan_suris, duffing, integral), (bobenko_suris, top, energy_of_top)]


@pytest.mark.dear("50]", "top")
@pytest.mark.sampled
@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize(("rule", "scene", "of"), MAPS)
@pytest.mark.parametrize("by", ["parameter", "argument"])
def test_an_integral_is_kept_at_the_step_of_a_parameter_or_at_every_step(
    rule, scene, of, by, digits
):
    if by == "parameter":
        made = scene(lambda x, mu, p: of(x, mu, p.h))
    else:
        made = scene(lambda x, mu, p, h: of(x, mu, h))
    found = measured("momentum", made, rule, digits, 200)
    assert found["verdict"] == "pass", found["reason"]


@pytest.mark.dear("top-")
@pytest.mark.parametrize(("rule", "scene", "of"), MAPS)
def test_one_of_the_step_is_asked_at_every_step(rule, scene, of):
    """It says that it takes the step, and holds the scene's."""
    made = scene(lambda x, mu, p, h: of(x, mu, p.h) + 0 * h)
    found = measured("momentum", made, rule, 16, 200)
    assert found["verdict"] == "fail" and "a place that was drawn" in found["reason"]


@pytest.mark.dear("top-")
@pytest.mark.parametrize(("rule", "scene", "of"), MAPS)
def test_an_integral_of_another_step_fails(rule, scene, of):
    made = scene(lambda x, mu, p: of(x, mu, p.h * (1 + sympy.Rational(1, 10**9))))
    found = measured("momentum", made, rule, 50, 100)
    assert found["verdict"] == "fail"


@pytest.mark.slow
def test_a_short_step_does_not_hide_what_a_rule_loses():
    """At h = 10⁻⁴ the fourth order of Runge and Kutta changes L by less than 10⁻²⁷ a step."""
    scene = scenes.get("kepler").with_values(step="1/10000", duration="1/10")
    found = measured("momentum", scene, "runge-kutta-4", 16, 100)
    assert found["verdict"] == "fail" and "a place that was drawn" in found["reason"]
