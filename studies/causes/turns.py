"""The cause of coordinates that are kept within one turn: they jump by 2π."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators.extensions.foreign import guarded, scene_in_numbers
from discmech.integrators.numbers import Vector, arithmetic

from ..core.case import Case
from .first_terms import Beginning, Told
from .known_steps import moved

WHOLE = 1e-3  # largest error, in turns, of the shortest step beside whole turns
#: an error so many times the usual is none of the method's a radian before, by steps of a part
#: of the scene's, of which a method has less than of a mean of two angles a turn apart
ACROSS, SHORT = 100, 8


def wrapped(
    starts: list[Beginning], n: int, beside: Callable[[int], str] = lambda i: ""
) -> Told | None:
    """Return the cause if coordinates are off by whole turns, at places beyond one turn.

    beside: what a step across a branch of x[i] is off by beside whole turns, in words.
    """
    turns = [(b.shortest[:n] if b.shortest is not None else np.zeros(n)) / (2 * math.pi)
             for b in starts]  # fmt: skip
    whole = [np.round(e) for e in turns]
    jumps = [i for i in range(n) if any(e[i] for e in whole)]
    if not jumps or any(np.abs(a - b).max() > WHOLE for a, b in zip(turns, whole, strict=True)):
        return None
    return of_turns(jumps, beside=next(filter(None, map(beside, jumps)), ""))


def across(case: Case, starts: list[Beginning], i: int) -> str:
    """Return what a step across a branch of x[i] is off by beside whole turns, in words, or "".

    One that begins a radian before it, and does not cross it, shows what is usual.
    """
    scheme: Any = case.scheme
    if not scheme.s.groupoid.canonical or scheme.scene.clocked:
        return ""
    system = scene_in_numbers(scheme.s, scheme.scene, arithmetic(16))
    step = Fraction(scheme.scene.step) / SHORT
    f, n = guarded(scheme.flow(step).map_of(), len(starts[0].z)), scheme.s.n

    def off(at: float, z: Vector) -> float:
        z = np.where(np.arange(len(z)) == i, at, z)
        gap = f(z) - moved(system, float(step), z.reshape(2, -1)).ravel()
        gap[:n] -= 2 * math.pi * np.round(gap[:n] / (2 * math.pi))
        return float(np.nan_to_num(np.abs(gap / starts[0].span).max(), nan=math.inf))

    for branch, part in itertools.product((math.pi, 0.0), (1 / 8, 7 / 8)):
        for b in starts:
            at = branch - part * float(step) * b.f[i]
            usual, there = off(at - math.copysign(1, b.f[i]), b.z), off(at, b.z)
            if ACROSS * usual < there:
                return (
                    f", and a step that crosses x[{i}] = {branch:.4g} is wrong besides, by "
                    f"{there / usual:.1g} times the usual: it uses an angle before the jump and "
                    "one after it together"
                )
    return ""


def of_turns(entries: Iterable[int], place: str = "", beside: str = "") -> Told:
    """Return the cause of coordinates that are off by whole turns, first at that place.

    beside: what steps are off by where they cross the branch, in words.
    """
    alone = "" if beside else " and by nothing else"
    return "jumps of 2π", (
        f"{', '.join(f'x[{i}]' for i in entries)} differs from the scene's by whole turns{place}"
        f"{alone}: the angle is kept within one turn, so it jumps by 2π{beside}; "
        f"{'compute with' if beside else 'give'} the angle as it goes on."
    )
