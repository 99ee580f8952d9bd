"""Proofs that a changed object is as valid as the one before: nothing is left to be caught.

An identity of analytic functions is decided at random rational points (`identities`).
"""

from __future__ import annotations

from typing import Any

from discmech.integrators import Scheme
from discmech.integrators.numbers import first_violation, tracked, vanishes_as

from .faults import Fault
from .sites import IN_RULE, faulty_scheme, sound_scheme


def proof(fault: Fault) -> str:
    """One sentence that says what was proved; empty if nothing could be."""
    site, _, name = fault.site.partition(".")
    if site == "form":
        return _same_up_to_factor(fault, name)
    scheme, sound = faulty_scheme(fault), sound_scheme(fault)
    if site == "equation" and name == "slope_at_points":
        return _same_equations(scheme, sound)
    if site in IN_RULE:
        return _same_after_renaming(scheme, sound) or _same_order(scheme, sound)
    return ""


def _same_equations(scheme: Scheme, sound: Scheme) -> str:
    """E, F⁺ − F⁻ and the target are those of the sound scheme: Newton's matrix alone is not."""
    for name in ("system", "gain", "plus"):
        one, other = (s.discrete.written_out(getattr(s.discrete, name)) for s in (scheme, sound))
        if first_violation(one - other, [*scheme.w, scheme.h]) is not None:
            return ""
    return (
        "the equations of a step and its update are the same, term by term: Newton's matrix only "
        "decides how many corrections they take"
    )


def _same_after_renaming(scheme: Scheme, sound: Scheme) -> str:
    """L_d′(x, u, s) = L_d(x, u, −s): the stationary value over s is the same function."""
    stages = list(scheme.s.stages)
    if not stages:
        return ""
    renamed = sound.discrete_lagrangian.subs({s: -s for s in stages}, simultaneous=True)
    small = [*scheme.u, *stages, scheme.h]
    if first_violation([scheme.discrete_lagrangian - renamed], small) is not None:
        return ""
    return "L_d′(x, u, s) = L_d(x, u, −s): its stationary value over the stages is the same L_d"


def _same_order(scheme: Scheme, sound: Scheme) -> str:
    """L_d′ − L_d = O(h^{p+1}): by the variational error theorem another rule of order p.

    Stages are where L_d is stationary, and of size h: what is O(h^{p+1}) at s = hσ for any σ moves
    them by O(h^{p−1}), and so the stationary value by O(h^{2p−1}), no more than the rest for p ≥ 2.
    """
    order, stages = sound.order, list(scheme.s.stages)
    if order is None or order != scheme.order or (stages and order < 2):
        return ""
    difference = scheme.discrete_lagrangian - sound.discrete_lagrangian
    scaled = difference.xreplace({s: scheme.h * s for s in stages})
    if not vanishes_as(scaled, scheme.h, order + 1, [*scheme.u, *stages]):
        return ""
    return (
        f"L_d′ − L_d = O(h^{order + 1}): by the variational error theorem (Marsden, West, 2.3.1) "
        f"it is another rule of order {order}, and none of a higher one was expected"
    )


def _same_up_to_factor(fault: Fault, name: str) -> str:
    """The tensor is a constant times the one before: defects are of degree 0 in it."""
    import numpy as np

    flow = sound_scheme(fault).flow(sound_scheme(fault).scene.step, 50)
    run = flow.trajectory(3)
    factors = []
    with flow.numbers.working():
        for x, u, mu in zip(run.base, run.u, run.mu, strict=True):
            x, u, mu = (np.array([flow.numbers.number(e) for e in part]) for part in (x, u, mu))
            at: tuple[Any, ...] = (flow.geometry.at(x, u),) if name == "omega" else (x, mu)
            given = tracked(getattr(flow.geometry, name)(*at)).value
            new = fault.operate(given, None)
            place = np.unravel_index(int(np.argmax(np.abs(given).astype(float))), given.shape)
            factor = new[place] / given[place]
            if any(e != 0 for e in (new - factor * given).ravel()):
                return ""
            factors.append(float(factor))
    if len(set(factors)) != 1 or not factors[0]:
        return ""
    return f"the tensor is {factors[0]:g} times the one before, and defects are of degree 0 in it"
