"""Steps by the Legendre maps themselves: Newton with their own derivatives, and no kernel.

This is the other way to the same maps: what the compiled kernels do is held against it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..bisections.translates import GroupChart
from ..geometry.local_geometry import StagesNotFound
from ..numbers.newton import newton
from .failures import failure

if TYPE_CHECKING:
    from .flow import Flow


def maps_at(flow: Flow, x: Any, u: Any) -> dict[str, np.ndarray]:
    """The scheme's maps and derivatives at (x, u) (`LocalGeometry.at`).

    Raises `StepFailure` where stages are not found, or a map has no value.
    """
    try:
        return flow.geometry.at(x, u)
    except StagesNotFound:
        cause = "the internal stages were not found"
    except (ArithmeticError, ValueError):  # Python's own functions outside their domain
        cause = "L_d or a derivative of it is no number"
    raise failure(flow, cause, {"x": x, "u": u})


def arrow_from(flow: Flow, x: Any, mu: Any, guess: Any) -> np.ndarray:
    """The u with F⁻(x, u) = hμ, by Newton from the guess; raises `StepFailure` if not found."""

    def change(u: np.ndarray) -> np.ndarray:
        here = flow.geometry.at(x, u)
        du = np.asarray(flow.numbers.solve(here["minus_u"], flow._h * mu - here["minus"]))
        return _along_group(flow, here["R"], du, u)

    found = newton(change, guess, 0, flow.numbers.eps)
    if found is None:
        raise failure(flow, "the step was not found", {"x": x, "mu": mu})
    return found


def arrow_before(flow: Flow, y: Any, v: Any) -> tuple[np.ndarray, np.ndarray]:
    """The (x, u) with b(x, u) = y and F⁺(x, u) = F⁻(y, v); raises `StepFailure` if not found."""
    n, there = len(y), maps_at(flow, y, v)
    wanted = np.concatenate([y, there["minus"]])

    def change(point: np.ndarray) -> np.ndarray:
        here = flow.geometry.at(point[:n], point[n:])
        matrix = np.vstack([np.hstack([here[f"{part}_x"], here[f"{part}_u"]])
                            for part in ("target", "plus")])  # fmt: skip
        gap = wanted - np.concatenate([here["target"], here["plus"]])
        found = np.asarray(flow.numbers.solve(matrix, gap))
        found[n:] = _along_group(flow, here["R"], found[n:], point[n:])
        return found

    found = newton(change, np.concatenate([y - there["rho"] @ v, v]), 0, flow.numbers.eps)
    if found is None:
        raise failure(flow, "the inverse step was not found", {"y": y, "v": v})
    return found[:n], found[n:]


def _along_group(flow: Flow, R: np.ndarray, du: np.ndarray, u: np.ndarray) -> np.ndarray:
    """The change of u that follows R⁻¹du in the group, where L_d is given on it; else du."""
    if flow.scheme.element is None:
        return du
    chart, h = GroupChart(flow.scheme.scene.groupoid, flow.numbers), flow._h
    along = chart.element(h * flow.numbers.solve(R, du))
    return np.asarray(chart.coordinates(along @ chart.element(h * u)) / h - u)


#: (x′, μ′) and the derivative of (x, μ) ↦ (x′, μ′)
Step = tuple[np.ndarray, np.ndarray, np.ndarray]


def step_along(flow: Flow, here: dict[str, np.ndarray]) -> Step:
    """The step on the dual along an arrow, of its maps: (b, F⁺/h)."""
    return here["target"], here["plus"] / flow._h, flow.geometry.dual_step(here, flow._h)


def step_from(flow: Flow, x: Any, mu: Any, guess: Any) -> Step:
    """The step on the dual from (x, μ): the flow's parts one after another."""
    total = None
    for part in flow.parts:
        guess = arrow_from(part, x, mu, guess)
        x, mu, derivative = step_along(part, maps_at(part, x, guess))
        total = derivative if total is None else derivative @ total
    assert total is not None
    return x, mu, total
