"""One-step maps on the dual algebroid: methods that need no discrete Lagrangian.

A map is data, like a rule: a formula in z = (x, μ), with μ in the natural basis, written once and
run compiled or at any number of digits. Without a discrete Lagrangian there is no Ω on the
groupoid; the bench measures everything else: order, Poisson form, momenta, energy, stability, work
and precision.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

from ..errors import BadInput, arguments_checked, shown
from ..numbers.types import Column, Function, Given
from ..scene import Scene
from ..scene.legendre import AffineLagrangian
from .discretisation import (
    Claims,
    Discretisation,
    check_effective,
    checked,
    described,
)
from .parameters import of_decorator, open_numbers

#: the scene as a map gets it, s; equations/ has the class of this name
DualSystem: TypeAlias = Any
#: (Z, residuals) of a map with stages
Staged: TypeAlias = tuple[Column, list[Column]]


@dataclass(frozen=True)
class OneStepMap(Discretisation):
    """A map z ↦ Z with Z = formula(s, z, h), where z is a sympy column (n+m)×1.

    implicit: formula(s, z, Z, h) is the residual instead, (n+m)×1, which vanishes at the new Z.
    stages = k: formula(s, z, h, K) gives (Z, residuals): K is a list of k columns (n+m)×1, and the
    list of k residuals, (n+m)×1 each, vanishes at the stages. Newton starts at Z = z + h f(z), and
    at K = f(z), so stages should be slopes.

    `s` gives the scene's functions that the map may use (`equations.DualSystem`).
    """

    implicit: bool = False
    #: what it asks of a one-form ϑ: "" nothing, "any", or "half", that half of it vanishes
    one_form: str = ""
    kind: ClassVar[str] = "one-step map"
    asks_lagrangian: ClassVar[bool] = False  # it follows the vector field

    def refusal(self, scene: Scene) -> str:
        asked = ["a one-step map"]
        if self.one_form or self.groupoids:
            asked.append("a map of one-forms" if self.one_form else "a map of positions")
        if refusal := scene.refusal_of(*asked, rule=self.name):
            return refusal
        of = scene.lagrangian
        if self.one_form == "half" and isinstance(of, AffineLagrangian) and not of.halved(scene):
            return (
                f"{self.name} needs coordinates in which half of the components of ϑ vanish, and "
                f"those of {scene.name} do not: add the differential of a function to its one-form "
                "that removes them, or take projected-gauss-1, which takes any."
            )
        return super().refusal(scene)


@arguments_checked
def one_step(
    order: int | None = None,
    *,
    implicit: bool = False,
    stages: int = 0,
    name: str | None = None,
    source: str = "",
    groupoids: str | Sequence[str] = (),
    symplectic: bool | None = None,
    reversible: bool | None = None,
    keeps: str | Sequence[str] = (),
    effective: int | None = None,
    one_form: str = "",
    parameters: str | Sequence[str] | Mapping[str, Given] = (),
) -> Callable[[Function], OneStepMap]:
    """Decorator: make a one-step map from a function (s, z, h).

    With implicit=True the function is (s, z, Z, h) and gives the residual in the new Z; with
    stages=k it is (s, z, h, K) and gives (Z, residuals of the stages) (`OneStepMap`). groupoids,
    effective and parameters: see `discretisation`.
    one_form: "any" for a method of degenerate Lagrangians alone, which asks for s.theta; "half" if
    half of the components of ϑ have to vanish (s.halves says which).

    symplectic, reversible, keeps (some of "energy", "volume" and names of a scene's quantities):
    claims. A map with claims is judged by these, and everything else is only measured; a map
    without claims is judged like every rule. Raises `BadInput` like `discretisation`, and if both
    implicit and stages are given.
    """
    where = checked("one_step", "one-step map", order, stages, groupoids)
    if not isinstance(implicit, bool):
        raise BadInput(f"implicit is True or False, not {shown(implicit)}.")
    if implicit and stages:
        raise BadInput("a one-step map with stages is implicit in these alone: leave implicit out.")
    check_effective("one-step map", order, effective)
    if one_form not in ("", "any", "half"):
        raise BadInput(f'one_step(one_form={shown(one_form)}): say "any" or "half", or leave it.')
    claims = Claims.of("one_step", order, symplectic, reversible, keeps)
    said = None if claims == Claims() else claims
    free = open_numbers(parameters)
    wanted = "(s, z, Z, h)" if implicit else "(s, z, h, K)" if stages else "(s, z, h)"

    def make(formula: Function) -> OneStepMap:
        label, about = described("one-step map", formula, wanted, name, source, free)
        rule = OneStepMap(
            label, formula, order, about, stages, groupoids=where, implicit=implicit, claims=said,
            effective=effective, parameters=tuple(free), one_form=one_form,
        )  # fmt: skip
        return of_decorator(rule, free)

    return make
