"""One-step maps on the dual algebroid: methods that need no discrete Lagrangian.

A map is data, as a rule is: a formula in z = (x, μ), μ in the natural basis, written once and run
compiled or at any number of digits. What has no discrete Lagrangian has no Ω on the groupoid; the
bench asks the rest of it: order, Poisson form, momenta, energy, stability, work and precision.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..errors import BadInput
from .discretisation import Discretisation


@dataclass(frozen=True)
class OneStepMap(Discretisation):
    """A map z ↦ Z with Z = formula(s, z, h), z a sympy column (n+m)×1.

    implicit: formula(s, z, Z, h) is the residual instead, (n+m)×1, which vanishes at the new Z.
    stages = k: formula(s, z, h, K) gives (Z, residuals): K is a list of k columns (n+m)×1, and the
    list of k residuals, (n+m)×1 each, vanishes at the stages. Newton starts at Z = z + h f(z), and
    at K = f(z): let stages be slopes.

    `s` says what the map may ask of the scene (`equations.DualSystem`). kinds: the kinds of
    groupoid on which it exists, all of them if empty.
    """

    implicit: bool = False
    kinds: tuple[str, ...] = ()

    def applies(self, scene: Any) -> bool:
        """Whether the scene has a vector field on the dual, and a groupoid on which it exists."""
        return not self.refusal(scene)

    def refusal(self, scene: Any) -> str:
        """Why the map has no meaning for the scene, a sentence; empty where it has."""
        if scene.lagrangian is None:
            return (
                f"{scene.name} has only a discrete Lagrangian, so {self.name} has no vector field "
                "to follow."
            )
        if not self.kinds or scene.groupoid.kind in self.kinds:
            return ""
        kinds = " and ".join(_KINDS.get(kind, kind) for kind in self.kinds)
        return (
            f"{self.name} exists on {kinds} only, so it is no method for {scene.name} "
            f"({scene.groupoid.name})."
        )


_KINDS = {"pair": "pair groupoids", "group": "Lie groups", "action": "action groupoids"}


def one_step(
    order: int | None = None,
    *,
    implicit: bool = False,
    stages: int = 0,
    name: str | None = None,
    source: str = "",
    kinds: tuple[str, ...] = (),
) -> Callable[[Callable[..., Any]], OneStepMap]:
    """Decorator: make a one-step map of a function (s, z, h).

    With implicit=True the function is (s, z, Z, h) and gives the residual in the new Z; with
    stages=k it is (s, z, h, K) and gives (Z, residuals of the stages) (`OneStepMap`). kinds: kinds
    of groupoid on which the map exists ("pair", "group", "action", "product", "local"); all if
    empty.
    Raises `BadInput` if the order is no positive whole number, stages no whole number from 0, both
    implicit and stages are given, or the arguments are others.
    """
    if callable(order):
        raise BadInput("write @one_step() with brackets, or @one_step(order=2).")
    if order is not None and (type(order) is not int or order < 1):
        raise BadInput(f"the order of a one-step map is a whole number from 1, not {order!r}.")
    if type(stages) is not int or stages < 0:
        raise BadInput(f"the stages of a one-step map are a whole number from 0, not {stages!r}.")
    if implicit and stages:
        raise BadInput("a one-step map with stages is implicit in these alone: leave implicit out.")
    wanted = "(s, z, Z, h)" if implicit else "(s, z, h, K)" if stages else "(s, z, h)"

    def make(formula: Callable[..., Any]) -> OneStepMap:
        label = name or formula.__name__.replace("_", "-")
        count = len(inspect.signature(formula).parameters)
        if count != wanted.count(",") + 1:
            raise BadInput(
                f"map {label}: the function takes {count} arguments, but "
                f"{'an implicit' if implicit else 'a'} one-step map"
                f"{' with stages' if stages else ''} takes {wanted}."
            )
        if not re.fullmatch(r"[\w.-]{1,80}", label):
            raise BadInput(f"a map's name is {label!r}: use letters, digits, dots and dashes.")
        about = source or inspect.getdoc(formula) or ""
        return OneStepMap(
            label, formula, order, about, stages, implicit=implicit, kinds=tuple(kinds)
        )

    return make
