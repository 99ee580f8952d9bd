"""Why Ω is not kept: the solver's residual, or the structure itself.

The equations of a step are solved to round-off here, and then left off by ever less: the defect of
a sound map sinks with what is left, that of a wrong one stays.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from integrators.flow import Flow
from integrators.tangent import newton

from .case import Case
from .diagnosis import named

TOLERANCES = tuple(10.0**-k for k in range(2, 15, 3))


def of_symplecticity(case: Case, kind: str, step: Fraction, limit: float) -> dict[str, Any]:
    """Whether the solver or the structure breaks Ω, by sweeping how well a step is solved.

    kind: "pullback" or "poisson". At a few points of a run the equations of the next step are
    solved to round-off here, and then left off by each of `TOLERANCES`: the defect of a sound map
    sinks with them, that of a wrong one stays.
    """
    flow = case.scheme.flow(step, case.digits)
    run = flow.trajectory(4)
    residual = solved = 0.0
    swept = dict.fromkeys(TOLERANCES, 0.0)
    with flow.numbers.working():
        for x, u, mu in zip(run.x, run.u, run.mu, strict=True):
            defect, off, polished, shift = _at(flow, kind, x, u, mu)
            residual, solved = max(residual, off), max(solved, defect(polished))
            for tolerance in TOLERANCES:
                swept[tolerance] = max(swept[tolerance], defect(polished + tolerance * shift))
    evidence = {"residual": residual, "solved": solved,
                "swept": [[t, d] for t, d in swept.items()]}  # fmt: skip
    said = ", ".join(f"{d:.1e} at {t:.0e}" for t, d in swept.items())
    if solved <= limit:
        return named(
            "solver residual",
            f"steps are solved to {residual:.1e} only, and the defect follows ({said}); solved to "
            f"round-off it is {solved:.1e}.",
            evidence,
        )
    return named(
        "structure",
        f"the {kind} defect is {solved:.1e} however well the steps are solved ({said}): the map "
        "does not keep Ω.",
        evidence,
    )


def _at(
    flow: Flow, kind: str, x: Any, u: Any, mu: Any
) -> tuple[Callable[[np.ndarray], float], float, np.ndarray, np.ndarray]:
    """At one point: (defect as a function of the velocity that was solved for, its relative
    residual in the flow, that velocity to round-off, its change for a residual of one)."""
    geometry, numbers = flow.geometry, flow.numbers
    x, u = flow._vectors(x, u)
    here = flow._arrow(x, u)
    if kind == "pullback":
        base, wanted = here["target"], here["plus"]
        own = flow._evolve(here, x, u)[1]

        def defect(v: np.ndarray) -> float:
            there = flow._arrow(base, v)
            return float(flow._pullback(here, there, geometry.tangent(here, there)))
    else:
        mus = np.array([numbers.number(e) for e in mu], dtype=numbers.dtype)
        base, wanted = x, mus * flow._h
        own = flow._solve(x, mus, u)

        def defect(v: np.ndarray) -> float:
            return float(flow._poisson(base, mus, flow._step_at(flow._arrow(base, v))))

    def change(v: np.ndarray) -> np.ndarray:
        at = flow._arrow(base, v)
        return np.asarray(numbers.solve(at["minus_u"], wanted - at["minus"]))

    polished = newton(change, own, 0, numbers.eps)
    polished = own if polished is None else polished
    size = max(abs(e) for e in wanted)
    off = float(max(abs(flow._arrow(base, own)["minus"] - wanted)) / size)
    shift = numbers.solve(flow._arrow(base, polished)["minus_u"], 0 * wanted + size)
    return defect, off, polished, np.asarray(shift)
