"""The cause of a change of Ω: the solver's residual, the step's update, or the structure itself.

The equations of a step are solved to round-off here, and then less accurately on purpose: the
defect of a sound map falls with the residual, that of a wrong one stays.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators.flows import Flow, Trajectory, arrow_from, step_along
from discmech.integrators.geometry import StepContext, poisson_defect, pullback_defect

from ..core.case import Case
from ..core.outcome import named
from .round_off import size

TOLERANCES = tuple(10.0**-k for k in range(2, 15, 3))
BEFORE = 3  # number of steps before the worst one that are tested too


def of_symplecticity(
    case: Case, kind: str, step: Fraction, index: int, limit: float
) -> dict[str, Any] | None:
    """Return the cause of a change of Ω in the step of that index, or None.

    It is the solver, the update or the structure. kind: "pullback", "poisson", "residual", or that
    of constraints, the defect above its limit. The step and those before it are solved to round-off
    here, and then left off by each of `TOLERANCES`. Raises the errors of runs.
    """
    if case.scheme.arrows is None:  # its step is given directly: there is nothing to distinguish
        return named("structure", _OF_MAP, {}) if kind in ("pullback", "poisson") else None
    flow = case.scheme.flow(step, case.digits)
    run = flow.trajectory(index + 1)
    places = range(max(0, index - BEFORE), index + 1)
    with flow.numbers.working():
        if kind == "residual":
            return _of_steps(flow, run, places, limit)
        if case.scheme.substeps:  # for these only the maps themselves are tested, without a solver
            return named("structure", _STRUCTURE.format(kind=kind, said=""), {})
        return _of_maps(flow, run, places, kind, limit)


_OF_MAP = "the one-step map itself does not keep the Poisson bracket."
_STRUCTURE = (
    "the {kind} defect stays however well the steps are solved{said}: the map does not keep Ω."
)


def _of_maps(
    flow: Flow, run: Trajectory, places: range, kind: str, limit: float
) -> dict[str, Any] | None:
    """Return the cause from the pullback or Poisson defect at ever more accurate solutions."""
    solved, swept = 0.0, dict.fromkeys(TOLERANCES, 0.0)
    with flow.context.exactly.numbers.working():
        for k in places:
            at = run.base[k], run.u[k], run.mu[k]
            defect, polished, shift = _at(flow.context.exactly, kind, *at)
            solved = max(solved, defect(polished))
            for tolerance in TOLERANCES:
                swept[tolerance] = max(swept[tolerance], defect(polished + tolerance * shift))
    if solved <= limit:
        return None
    said = f" ({solved:.1e} at round-off, {_said(swept)})"
    evidence = {"solved": solved, "swept": [[t, d] for t, d in swept.items()]}
    return named("structure", _STRUCTURE.format(kind=kind, said=said), evidence)


def _of_steps(flow: Flow, run: Trajectory, places: range, limit: float) -> dict[str, Any] | None:
    """Return the cause from the steps of a run, compared with those of its own and better
    velocities.

    A composition's rows hold the velocity of the first substep, which represents the others.
    """
    if flow.scheme.equations.element is not None:
        return None
    off = own = taken = 0.0
    swept = dict.fromkeys((*TOLERANCES, 0.0), 0.0)
    whole = size(run.mu)
    for k in places:
        (x, u), (_, mu) = (flow.context.vectors(run.base[k], v[k]) for v in (run.u, run.mu))

        def defect(after_x: Any, after_mu: Any, k: int = k) -> float:
            return float(flow.step_defect(run.base[k], run.mu[k], after_x, after_mu, u0=run.u[k]))

        first = flow.parts[0]
        here = first.maps_at(x, u)
        off = max(off, float(max(abs(here["minus"] / first.h - mu))) / whole)
        if len(flow.parts) == 1:
            own = max(own, defect(here["target"], mu + (here["plus"] - here["minus"]) / first.h))
        taken = max(taken, defect(run.base[k + 1], run.mu[k + 1]))
        for tolerance in swept:
            after = _step(flow, x, mu, u, tolerance * whole)
            swept[tolerance] = max(swept[tolerance], defect(*after))
    solved = swept.pop(0.0)
    evidence = {"residual": off, "own": own, "taken": taken, "solved": solved,
                "swept": [[t, d] for t, d in swept.items()]}  # fmt: skip
    if taken <= limit or solved > limit:
        return None
    if (own if len(flow.parts) == 1 else off) > limit:
        return named(
            "solver residual",
            f"the velocities of the run solve F⁻(x, u) = hμ to {off:.1e} only, and the defect "
            f"sinks with what is left ({_said(swept)}); solved to round-off it is {solved:.1e}.",
            evidence,
        )
    return named(
        "update",
        f"the velocities of the run solve F⁻(x, u) = hμ to {off:.1e}, but what a step hands on is "
        f"not (b(x, u), μ + (F⁺ − F⁻)/h) of them: it is off by {taken:.1e}, that would be by "
        f"{own:.1e}. It is the step's update, or its stages.",
        evidence,
    )


def _said(swept: Mapping[float, float]) -> str:
    return ", ".join(f"{d:.1e} at {t:.0e}" for t, d in swept.items())


def _step(flow: Flow, x: Any, mu: Any, guess: Any, off: float) -> tuple[Any, Any]:
    """Return (x′, μ′) by the Legendre maps; each substep is left off by the given share of μ."""
    numbers = flow.numbers
    for part in flow.parts:
        guess = arrow_from(part, x, mu, guess)
        here = part.maps_at(x, guess)
        if off:
            left = 0 * mu + numbers.number(off) * part.h
            here = part.maps_at(x, guess + np.asarray(numbers.solve(here["minus_u"], left)))
        x, mu = here["target"], mu + (here["plus"] - here["minus"]) / part.h
    return x, mu


def _at(
    context: StepContext, kind: str, x: Any, u: Any, mu: Any
) -> tuple[Callable[[np.ndarray], float], np.ndarray, np.ndarray]:
    """Return the test of one point.

    The result is (defect as a function of the velocity that is solved for, that velocity to
    round-off, its change for a residual of 1).
    """
    geometry, numbers = context.geometry, context.numbers
    (x, u), (_, mu) = context.vectors(x, u), context.vectors(x, mu)
    root = numbers.eps**0.5
    if kind == "pullback":
        here = geometry.tracked(x, u)
        base, wanted = here["target"].value, here["plus"].value

        def defect(v: np.ndarray) -> float:
            there = geometry.tracked(base, v)
            tangent = geometry.tangent(here, there)
            return float(pullback_defect(geometry, here, there, tangent, root))
    else:
        base, wanted = x, mu * context.h

        def defect(v: np.ndarray) -> float:
            b, after, along = step_along(context, geometry.tracked(base, v))
            step = b.value, after.value, along
            return float(poisson_defect(geometry, base, mu, step, resolution=root))

    polished = arrow_from(context, base, wanted / context.h, u)
    whole = max(abs(e) for e in wanted) or numbers.number(1)
    shift = numbers.solve(context.maps_at(base, polished)["minus_u"], 0 * wanted + whole)
    return defect, polished, np.asarray(shift)
