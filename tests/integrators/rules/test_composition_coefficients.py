"""The coefficients of compositions against the order conditions and the published decimals."""

import itertools

import mpmath
import pytest

from discmech.integrators.rules import METHODS

# -- the order conditions, in words of non-commuting letters ---------------------------------------


def times(a, b, order):
    """The product of two polynomials in words of letters, each letter with its degree."""
    found = {}
    for (u, x), (v, y) in itertools.product(a.items(), b.items()):
        if sum(u) + sum(v) <= order:
            found[u + v] = found.get(u + v, 0) + x * y
    return found


def exponential(generator, order):
    total, term = {(): mpmath.mpf(1)}, {(): mpmath.mpf(1)}
    for k in range(1, order + 1):
        term = {w: c / k for w, c in times(term, generator, order).items()}
        total = {w: total.get(w, 0) + term.get(w, 0) for w in {*total, *term}}
    return total


def defect(steps, order):
    """How far the product of steps exp(Σ_d γ^d E_d) is from exp(E_1): all words to that order.

    A symmetric step has odd letters only. Φ and Φ* are exp(Σ ±γ^d E_d), the sign of even ones.
    """
    total = {(): mpmath.mpf(1)}
    for generator in steps:
        total = times(total, exponential(generator, order), order)
    wanted = exponential({(1,): mpmath.mpf(1)}, order)
    return max(abs(total.get(w, 0) - wanted.get(w, 0)) for w in {*total, *wanted})


def generators(method, numbers, order):
    for i, c in enumerate(numbers):
        if method.in_turn:
            sign = -1 if i % 2 == 0 else 1
            yield {(d,): (c**d if d % 2 else sign * c**d) for d in range(1, order + 1)}
        else:
            yield {(d,): c**d for d in range(1, order + 1, 2)}


@pytest.mark.dear("sofroniou-spaletta-10")
@pytest.mark.parametrize("name", METHODS)
def test_order_conditions_hold_to_60_digits(name):
    method = METHODS[name]
    with mpmath.workdps(80):
        numbers = method.coefficients(70)
        assert numbers == numbers[::-1]
        assert abs(sum(numbers) - 1) < mpmath.mpf(10) ** -70
        # a palindrome has no terms of even order in its logarithm
        top = method.order - 1
        assert defect(generators(method, numbers, top), top) < mpmath.mpf(10) ** -60
        above = method.order + 1
        assert defect(generators(method, numbers, above), above) > mpmath.mpf(10) ** -8


@pytest.mark.parametrize("name", METHODS)
def test_a_wrong_digit_is_seen(name):
    """The ends and the middle off in the thirtieth digit: still a palindrome, still of sum 1."""
    method = METHODS[name]
    with mpmath.workdps(80):
        numbers = method.coefficients(70)
        off = mpmath.mpf(10) ** -30
        left = (len(numbers) - 1) // 2  # the middle, or the left one of two
        for i, change in ((0, off), (-1, off), (left, -off), (-1 - left, -off)):
            numbers[i] += change
        top = method.order - 1
        assert defect(generators(method, numbers, top), top) > mpmath.mpf(10) ** -33


PUBLISHED = {
    # of self-adjoint steps: γ₁ γ₂ …
    "kahan-li-6": "0.39216144400731413927925056 0.33259913678935943859974864 "
    "-0.70624617255763935980996482 0.08221359629355080023149045 0.79854399093482996339895035",
    "kahan-li-8": "0.13020248308889008087881763 0.56116298177510838456196441 "
    "-0.38947496264484728640807860 0.15884190655515560089621075 -0.39590389413323757733623154 "
    "0.18453964097831570709183254 0.25837438768632204729397911 0.29501172360931029887096624 "
    "-0.60550853383003451169892108",
    "sofroniou-spaletta-10": "0.078795722521686419263907679 0.31309610341510852776481247 "
    "0.02791838323507806610952027 -0.22959284159390709415121340 0.13096206107716486317465686 "
    "-0.26973340565451071434460973 0.07497334315589143566613711 0.11199342399981020488957508 "
    "0.36613344954622675119314812 -0.39910563013603589787862981 0.10308739852747107731580277 "
    "0.41143087395589023782070412 -0.00486636058313526176219566 -0.39203335370863990644808194 "
    "0.05194250296244964703718290 0.05066509075992449633587434 0.04967437063972987905456880 "
    "0.04931773575959453791768001",
    # of a splitting ABA: a₁ b₁ a₂ b₂ …, to 15 decimals
    "blanes-moan-4": "0.0792036964311957 0.209515106613362 0.353172906049774 -0.143851773179818 "
    "-0.0420650803577195 0.434336666566456",
    "blanes-moan-6": "0.0502627644003922 0.148816447901042 0.413514300428344 -0.132385865767784 "
    "0.0450798897943977 0.067307604692185 -0.188054853819569 0.432666402578175 0.541960678450780",
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_they_are_the_published_ones(name):
    """To the last digit or two; a splitting's are sums of neighbours, b₁ = β₁ + α₁."""
    method, published = METHODS[name], PUBLISHED[name].split()
    with mpmath.workdps(40):
        found = method.coefficients(40)
        if method.in_turn:
            found = [found[0], *(a + b for a, b in itertools.pairwise(found))]
        gaps = [abs(a - mpmath.mpf(b)) for a, b in zip(found, published, strict=False)]
        assert len(gaps) == len(published)
        assert max(gaps) < (5e-15 if method.in_turn else 1e-25)
