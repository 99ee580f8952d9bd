"""Compare the energy of a forced or time-dependent motion with the work that is done on it.

    dH/dt = f·ξ − ∂l/∂t + λᵀB ξ,

the last one the power of constraints that move or push along rows B of their own,

holds along the motion, without a discrete law for it: the balance of a run, H less the work so far,
is off by the method's error and by that of the sum for the work (trapezoidal rule). So it is judged
by how it sinks with the step.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators import Scene, Scheme
from discmech.integrators.equations import (
    SceneSymbols,
    energy,
    energy_terms,
    legendre_inverse,
    nearest_start,
    power,
)
from discmech.integrators.errors import DiscmechError
from discmech.integrators.flows import Trajectory
from discmech.integrators.numbers import Arithmetic, arithmetic, numeric
from discmech.integrators.scene import Constraint, ConstraintParts, remembered, takes_fourth
from discmech.reference import ReferenceFailure

from ..causes.round_off import unit
from ..core.case import Case, Progress
from ..core.fitting import orders_between
from ..systems.constraint_work import constraint_power, constraints_work
from ..systems.moving_energy import motion, moving_energy
from ..systems.runs import in_rows, of_states
from .records import Found, Measured, Row

HALVINGS, MOST_HALVINGS = 3, 5  # number of runs, and the most if their orders do not agree yet
REACHED = 0.05  # runs are halved until their order is no shorter of the wanted one than this


def applies(case: Case) -> bool:
    """True if a force, the time or a constraint may change the energy, as the scene is written."""
    scene = case.scene
    return scene.force is not None or takes_fourth(scene.lagrangian) or works(scene)


@remembered(maxsize=64)
def works(scene: Scene) -> bool:
    """True if constraints of the scene may change its energy."""
    return bool(scene.all_constraints) and constraints_work(SceneSymbols(scene))


@remembered(maxsize=64)
def acts(scene: Scene, duration: float) -> bool:
    """True if the force, or the time, changes the energy in that time by more than round-off.

    Each component of a force counts, for one that does no work as a whole moves energy too.
    """
    if works(scene):
        return True
    s = SceneSymbols(scene)
    try:
        x, mu, xi = motion(scene)
    except (DiscmechError, ReferenceFailure):
        return True
    parts = [f * v for f, v in zip(s.force, s.u, strict=True)] if s.forced else []
    parts += [s.phase_lagrangian.diff(s.x[-1])] if s.clocked else []
    numbers = arithmetic(16)
    f = numeric(
        {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}, [parts], numbers, columns=True
    )
    with np.errstate(all="ignore"):
        rates = f(x.T, xi.T, mu.T, [numbers.number(p) for p in scene.parameter_values])
        largest = max((float(np.abs(np.asarray(e, dtype=float)).max()) for e in rates), default=0.0)
    return not largest * duration < unit(16) * moving_energy(scene)


@lru_cache(maxsize=64)
def left_alone(scene: Scene) -> Scene:
    """Return the scene without its force, with its Lagrangian and its constraints at the time 0.

    A start with the velocity of a constraint that moves is projected onto the one that stands.
    """
    function = scene.hamiltonian or scene.lagrangian
    assert function is not None
    snapshot = (lambda x, v, p: function(x, v, p, 0)) if takes_fourth(function) else function
    which = "lagrangian" if scene.hamiltonian is None else "hamiltonian"
    alone = scene.with_values(force=None, **{which: snapshot})
    if not works(scene):
        return alone
    still = [_standing(e) for e in scene.all_constraints]
    return nearest_start(alone.with_values(holonomic=None, nonholonomic=None, constraints=still))


def _standing(moving: Constraint) -> Constraint:
    """Return a constraint at the time 0, with a = 0."""

    def parts(function: Any, m: int) -> ConstraintParts:
        pieces = moving.kind.parts(function, m)
        return replace(pieces, shift=[0] * len(pieces.shift))

    function = moving.function
    snapshot = (lambda x, p: function(x, p, 0)) if moving.timed else function
    return replace(moving.kind, parts=parts)(snapshot)


def balance(scheme: Scheme, run: Trajectory, digits: int) -> np.ndarray:
    """Return (H − H₀ − work)/scale per row, signed; scale: the largest sum of H's terms."""
    numbers = arithmetic(digits)
    f, inverse = _rates(scheme.s, numbers), legendre_inverse(scheme.s, numbers)
    values, terms = in_rows(scheme, f, run, numbers, inverse)
    with numbers.working():
        steps = np.diff(np.array([numbers.number(t) for t in run.t]))
        work = np.cumsum(steps * (values[1:, 1] + values[:-1, 1]) / 2)
        errors = values[1:, 0] - values[0, 0] - work
        scale = terms[:, 0].max() or 1
        return np.concatenate([[0.0], np.asarray(errors / scale, dtype=float)])


@lru_cache(maxsize=256)
def _rates(s: SceneSymbols, numbers: Arithmetic) -> Any:
    rates = of_states(s, [energy(s), power(s)], [energy_terms(s), energy_terms(s)], numbers)
    if not constraints_work(s):
        return rates
    of_constraints = constraint_power(s, numbers)

    def with_constraints(x: Any, xi: Any, mu: Any, p: Any) -> tuple[Any, Any]:
        """Return the rates of one state, or of a column of states."""
        values, terms = rates(x, xi, mu, p)
        if np.ndim(mu) == 1:
            return [values[0], values[1] + of_constraints(x, xi, mu, p)], terms
        done = [of_constraints(*at, p) for at in zip(x.T, xi.T, mu.T, strict=True)]
        values = np.broadcast_to(values, (2, len(done)))
        return values + np.array([np.zeros(len(done)), done]), terms

    return with_constraints


def measure(case: Case, progress: Progress) -> Found:
    """Return the errors at the smallest step, and the order of the balance.

    Over the scene's duration, or the chosen number of its steps; these are halved twice, and
    further while the order is neither reached nor missed, as when chaotic runs separate.
    """
    first = case.steps or case.scene.steps_for(case.scene.step)
    size = case.scene.step if case.steps else case.scene.duration / first
    ways = []  # how far the balance moves: in chaotic motion its ends are random, this sum is not
    orders: list[float] = []
    for k in range(MOST_HALVINGS):
        if k >= HALVINGS and not unsettled(orders, wanted(case)["balance_order"]):
            break
        steps = first * 2**k
        progress(f"{case.scene.name} {case.label}: {steps} steps", k / MOST_HALVINGS)
        run = case.scheme.flow(size / 2**k, case.digits).trajectory(steps)
        errors = balance(case.scheme, run, case.digits)
        ways.append(float(np.abs(np.diff(errors)).sum()))
        halved = orders_between([2.0**-j for j in range(len(ways))], ways)
        orders = [order for order in halved if not math.isnan(order)]
    times = np.asarray(run.t, dtype=float)
    slope = float(errors[-1] / times[-1])
    spread = max(1, len(times) // 1000)
    rows = [Row(float(t), float(e))
            for t, e in zip(times[::spread], errors[::spread], strict=True)]  # fmt: skip
    order = orders[-1] if orders else math.nan
    measured = Measured(float(np.ptp(errors)), slope, [slope, slope], None, order)
    return Found(rows, measured, duration=float(times[-1]), balance_orders=orders, way=ways[-1],
                 steps=run.steps)  # fmt: skip


def unsettled(orders: list[float], least: float) -> bool:
    """True if the last order is short by at most its difference from the one before (Richardson).

    That difference is about what the next term of the error still adds to it.
    """
    before, last = ([math.nan, math.nan] + orders)[-2:]
    return last < least and not last < least - abs(last - before)


def wanted(case: Case, short: float = REACHED) -> dict[str, Any]:
    """Return the least order of the balance: the method's, or 2, which is that of the sum.

    It is 1 for a rule that declares none: a consistent one balances energy and work in the limit.
    """
    return {"balance_order": min(case.order or 1, 2) - short}
