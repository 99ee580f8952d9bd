"""A gradient through a program's run, held against differences of its own steps."""

import dataclasses
import re

import numpy as np
import pytest

from discmech import BadInput, black_box, scenes
from discmech.studies.core.case import Case
from discmech.studies.symplecticity import in_numbers
from discmech.studies.symplecticity.judging_numbers import judge
from discmech.studies.symplecticity.records import (
    FoundOfNumbers,
    Held,
    MeasuredOfNumbers,
    OfNumbers,
    OfRun,
)

from . import methods

PENDULUM = scenes.get("pendulum")


def tangent(q, p, h, steps, s, by_length=True):
    """The derivative of Störmer–Verlet's end by (q, p) and by the pendulum's length."""
    m, g, length = s.parameters.mass, s.parameters.gravity, s.parameters.length
    D, q, p = np.eye(2, 3), q[0], p[0]
    for _ in range(steps):
        for part in (h / 2, None, h / 2):
            if part is None:
                q, D[0] = q + h * p / (m * length**2), D[0] + h * D[1] / (m * length**2)
                D[0, 2] -= by_length * 2 * h * p / (m * length**3)
                continue
            D[1] -= part * m * g * length * np.cos(q) * D[0]
            D[1, 2] -= by_length * part * m * g * np.sin(q)
            p -= part * m * g * length * np.sin(q)
    return {"start": D[:, :2], "length": D[:, 2]}, np.array([q, p])


def whole(*given):
    return tangent(*given)[0]


def halved(q, p, h, steps, s):
    return tangent(q, p, h / 2, 2 * steps, s)[0]


def off(*given):
    return {**whole(*given), "start": whole(*given)["start"] * (1 + 1e-6)}


def without_path(*given):
    return tangent(*given, by_length=False)[0]


def truncated(q, p, h, steps, s):
    """The derivative by the start of the last 20 steps, as of a truncated back-propagation."""
    _, (x, y) = tangent(q, p, h, max(0, steps - 20), s)
    return tangent(np.array([x]), np.array([y]), h, min(steps, 20), s)[0]["start"]


def of_start(*given):
    return whole(*given)["start"]


def transposed(*given):
    return of_start(*given).T


def square(q, p):
    return q[0] ** 2 + p[0] ** 2


def of_square(*given, part=1.0):
    found, end = tangent(*given)
    return {name: 2 * part * end @ D for name, D in found.items()}


def of_less(*given):
    return of_square(*given, part=1 - 1e-6)


def said(gradient, scalar=None, box=methods.verlet):
    box = dataclasses.replace(box, gradient=gradient, scalar=scalar, vectorised=True)
    case = Case("symplecticity", PENDULUM, box, 16)
    found = in_numbers.measure(case, lambda *_: None)
    verdict = judge(case, FoundOfNumbers(found.rows, found.measured, OfRun()))
    return verdict.verdict, verdict.reason


@pytest.mark.dear(but=("of_start",))
@pytest.mark.parametrize(("gradient", "scalar"),
                         [(whole, None), (of_start, None), (of_square, square)])  # fmt: skip
def test_the_derivative_of_its_own_steps_passes(gradient, scalar):
    verdict, reason = said(gradient, scalar)
    assert verdict == "pass"
    assert re.search(r"gradient by start is that of runs of 16 steps from \d places, .*e-1", reason)


@pytest.mark.dear(but=("without_path", "transposed"))
@pytest.mark.parametrize(
    ("gradient", "scalar", "by"),
    [(off, None, "start"), (halved, None, "start"), (without_path, None, "length"),
     (transposed, None, "start"), (of_less, square, "start"), (truncated, None, "start")],
)  # fmt: skip
def test_another_derivative_fails(gradient, scalar, by):
    verdict, reason = said(gradient, scalar)
    assert verdict == "fail"
    steps = 16 if gradient is not truncated else r"\d\d"
    assert re.search(f"its gradient is not the derivative of its run of {steps} steps by", reason)
    assert f"steps by {by}" in reason


@pytest.mark.parametrize(("slope", "verdict"), [(0.0, "pass"), (1e-6, "fail")])
def test_a_scalar_that_does_not_change_has_a_gradient_of_0(slope, verdict):
    """Its differences are noise alone, and no unit."""
    constant = lambda q, p: 1.0 + 1e-16 * q[0]  # noqa: E731
    assert said(lambda *a: np.full(2, slope), constant)[0] == verdict


def test_what_differences_cannot_see_is_inconclusive():
    def rough(q, p, h, system):
        q, p = methods.verlet.formula(q, p, h, system)
        return q + 1e-7 * np.sin(1e9 * q), p

    verdict, reason = said(of_start, box=black_box()(rough))
    assert verdict == "inconclusive" and "could be hidden" in reason


@pytest.mark.parametrize(
    ("gradient", "why"),
    [(lambda *a: np.eye(3), r"shape \(3, 3\).*run has \(2, 2\)"),
     (lambda *a: {"weight": np.eye(2)}, "weight"), (lambda *a: 1 / 0, "ZeroDivisionError"),
     (lambda q, p: np.eye(2), r"a function of \(q, p, h, steps, system\)")],
)  # fmt: skip
def test_answers_of_another_kind_are_refused(gradient, why):
    with pytest.raises(BadInput, match=why):
        said(gradient)


def test_bad_arguments_are_refused():
    with pytest.raises(BadInput, match=r"scalar=.*give that too"):
        black_box(scalar=square)
    with pytest.raises(BadInput, match=r"gradient is a function"):
        black_box(gradient=1)
    ways = {"read": lambda q, p: (q, p), "write": lambda q, p: (q, p)}
    for own in ({"state": "Rp"}, {"state": "qv"}, ways):
        for word in ("gradient", "jacobian"):
            with pytest.raises(BadInput, match=rf"{word}=.*leave it out"):
                black_box(**own, **{word: whole})


def test_a_gradient_is_demanded_of_a_program_that_claims_nothing_else():
    box = black_box(order=2, gradient=whole, name="plain")(methods.kick_drift_kick)
    case = Case("symplecticity", PENDULUM, box, 16)
    held = Held("gradient", "start", 0.0, 1e-11, 16)
    row = OfNumbers(certain=0.0, resolution=1e-12, left=1e-3, derivatives=[held])
    found = FoundOfNumbers([row] * 3, MeasuredOfNumbers(certain=0.0, resolution=1e-12))
    verdict = judge(case, found)
    assert verdict.verdict == "pass" and verdict.expected["demanded"] == ["gradient"]
    without = dataclasses.replace(found, rows=[dataclasses.replace(row, derivatives=())] * 3)
    assert judge(case, without).verdict == "inconclusive"
