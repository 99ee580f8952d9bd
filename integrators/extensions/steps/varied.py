"""A rule whose steps vary: a time transformation dt = σ dτ that wraps any rule.

With equal steps ε of the fictitious time τ a step takes a physical time of about ε·σ(x, μ). There
are three ways (Hairer, Lubich, Wanner, VIII.2 and VIII.3):

    poincare    the rule on L̃ = σ(x) (L(x, x′/σ) + E₀), E₀ the energy of the start: the system of
                the Hamiltonian K = σ(x) (H + p_t) on the extended phase space (x, t, μ, p_t). The
                physical time is the coordinate of p_t = −E₀, and a step adds ∂L̃_d/∂E₀ to it.
    reversible  the step ε/ζ with the step density ζ_{n+1/2} = ζ_{n−1/2} + ε G(z_n),
                G = −(d/dt σ)/σ, d/dt along the motion (Hairer, Söderlind)
    naive       the step ε·σ(z_n) of the present state alone: a control that has to be caught
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

from ...errors import BadInput, arguments_checked, check_function, check_name, shown, unknown
from ...numbers.types import Function
from ...rules import Discretisation
from ...scene import Again, Scene

_HLW = "Hairer, Lubich, Wanner, Geometric Numerical Integration"
#: name of the way → its source
WAYS = {
    "poincare": f"Sundman (1912), Poincaré; Hairer, Appl. Numer. Math. 25 (1997), 219; {_HLW}, "
    "VIII.2.1",
    "reversible": "Hairer, Söderlind, SIAM J. Sci. Comput. 26 (2005), 1838: the integrating "
    f"controller; {_HLW}, VIII.3.2",
    "naive": f"a control: the step follows the present state alone ({_HLW}, VIII.1)",
}


@dataclass(frozen=True)
class Varied(Discretisation):
    """`base` with steps of the size step·σ in physical time, by one of the `WAYS`."""

    base: Discretisation = field(kw_only=True)
    sigma: Function | None = field(kw_only=True)
    way: str = field(kw_only=True)
    #: its step is a step of the time τ and has a state of its own
    composes: ClassVar[bool] = False

    @property
    def digest(self) -> str:
        """The way and the rule with the coefficients of its composition, as a text."""
        own = getattr(self.base, "method", None)
        numbers = "" if own is None else f" {own.in_turn} {own.coefficients(60)}"
        return f"{self.way} {self.base.name} {self.base.order}{numbers} {self.base.digest}"

    def unmeasured(self, study: str) -> str:
        """Return why a study of equal steps cannot measure it; "" for that of varying steps."""
        if study == "steps":
            return ""
        return (
            f"the study {study} takes equal steps, and those of {self.name} vary: `discmech steps` "
            f"judges it; {study} judges the rule {self.base.name}, and takes a scene in its own "
            "time, in_own_time(scene, sigma)."
        )

    def applies(self, scene: Scene) -> bool:
        """True if the base can be used in this way."""
        return self.base.applies(scene) and not self.refusal(scene)

    def refusal(self, scene: Scene) -> str:
        """Return why the base does not exist on the scene, or with steps that vary so; or ""."""
        by_poincare = self.way == "poincare"
        asked = ("steps that vary", "steps that vary by Poincaré")[: 1 + by_poincare]
        if refusal := scene.refusal_of(*asked, rule=self.name):
            return refusal
        if by_poincare and not self.base.asks_lagrangian:
            return (
                f"{self.name}: the way poincare takes rules on a Lagrangian, and {self.base.name} "
                "is a one-step map: take a rule such as gauss-2, or a scene in its own time, "
                "in_own_time(scene, sigma)."
            )
        if self.sigma is None and scene.sigma is None:
            return (
                f"{scene.name} names no sigma of its own, which {self.name} follows: give "
                "Scene(sigma=...), or vary(rule, sigma)."
            )
        return self.base.refusal(scene)

    def sigma_on(self, scene: Scene) -> Function | None:
        """Return the function σ: its own, or that of the scene."""
        return scene.sigma if self.sigma is None else self.sigma

    def discretise(self, scene: Scene) -> Any:
        """Return the `VariedScheme`, for `Scheme(scene, rule)`."""
        from .varied_scheme import VariedScheme  # a list of rules needs none of it

        return VariedScheme(scene, self)

    def __reduce__(self) -> Again:
        """Return how to pickle it: it is built from its base again; σ is found by its module."""
        return _made, (self.base, self.sigma, self.way, self.name, self.source)


@arguments_checked
def vary(
    rule: Discretisation,
    sigma: Function | None = None,
    way: str = "reversible",
    *,
    name: str | None = None,
    source: str = "",
) -> Varied:
    """Return a rule with steps that vary: dt = sigma(x, mu, p) dτ, p the scene's parameters.

    rule: any rule of one step, one-step map or composition. sigma: a smooth positive function of x
    (n×1), the momentum mu (m×1, natural basis) and the parameters; of x alone for "poincare";
    default: that of the scene (`Scene(sigma=...)`), and commands call the rule way:rule. way:
    "poincare", "reversible" or "naive" (`WAYS`). The flow's step is ε, a step of τ; rows of its
    runs have the physical time in t. name: default way:rule.

    Raises `BadInput` for a rule or a function of another kind, and an unknown way.
    """
    if not isinstance(rule, Discretisation) or isinstance(rule, Varied):
        what = "has steps that vary already" if isinstance(rule, Varied) else "is no rule"
        raise BadInput(f"vary: {shown(getattr(rule, 'name', rule))} {what}: give a rule.")
    if not rule.is_formula:
        raise BadInput(f"vary: {rule.name} is a program, which chooses its steps itself.")
    if way not in WAYS:
        raise unknown("way to vary steps", way, WAYS)
    if sigma is not None:
        check_function(sigma, "vary: sigma=", "(x, mu, p)")
    label = name or f"{way}:{rule.name}"
    check_name("rule", label, r"[\w.:-]{1,80}")
    return _made(rule, sigma, way, label, source or WAYS[way])


def _made(rule: Discretisation, sigma: Function | None, way: str, name: str, source: str) -> Varied:
    return Varied(
        name, sigma or rule.formula, rule.order, source, rule.stages, rule.splits, rule.groupoids,
        base=rule, sigma=sigma, way=way,
    )  # fmt: skip
