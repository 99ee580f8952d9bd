"""A scene in a time of its own, by K = σ (H − E₀), whose motion at K = 0 is that of H.

By a Lagrangian, L̃(x, x′) = σ(x) (L(x, x′/σ) + E₀). The momentum is the same, and the energy of the
start is a parameter: −E₀ is the momentum of the physical time, t′ = ∂K/∂p_t = σ.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from types import CodeType
from typing import Any

from ...equations import SceneSymbols, energy, momentum, poisson_tensor
from ...errors import BadInput, check_function
from ...numbers import first_violation, jacobian, measure, sympy, to_sympy
from ...numbers.types import Column, Expression, Function, Given, Namespace, Parameters
from ...scene import Conserved, Scene
from .varied_system import sigma_of

ENERGY = "energy_of_start"  # the parameter E₀


@dataclass(frozen=True)
class InOwnTime:
    """L̃ of a Lagrangian, or K of a Hamiltonian, with σ: a function with the same arguments."""

    function: Function
    sigma: Function
    by_hamiltonian: bool

    @property
    def __wrapped__(self) -> Function:
        """The function whose arguments it has and whose line messages name."""
        return self.function

    @property
    def __code__(self) -> CodeType | None:
        return getattr(self.function, "__code__", None)

    def __call__(self, x: Column, second: Column, p: Parameters) -> Expression:
        E = getattr(p, ENERGY)
        if self.by_hamiltonian:
            return self.sigma(x, second, p) * (self.function(x, second, p) - E)
        sigma = self.sigma(x, 0 * second, p)
        return sigma * (self.function(x, second / sigma, p) + E)


def in_own_time(scene: Scene, sigma: Function | None = None, duration: Given = None) -> Scene:
    """Return the scene in the time τ with dt = sigma(x, mu, p) dτ, called SCENE-in-own-time.

    It is an ordinary scene: every rule and every study takes it, and its form is that of the
    extended phase space at p_t = −E₀. Its symmetries are those that σ has too. sigma: of x alone
    for a scene by its Lagrangian; default: the scene's own. duration: in τ; default: the scene's
    over σ at the start. Raises `BadInput` for a σ that is not positive there, and for scenes with a
    force, a time, constraints or contact.
    """
    if (scale := scene.sigma if sigma is None else sigma) is None:
        raise BadInput(f"{scene.name} names no sigma of its own: give in_own_time(scene, sigma).")
    check_function(scale, f"{scene.name}: sigma=", "(x, mu, p)")
    scene.refuse("a time of its own")
    s = SceneSymbols(scene)
    by_hamiltonian = scene.hamiltonian is not None
    expression = sigma_of(s, scale, bare=not by_hamiltonian)
    at = s.exact_parameters(scene) | dict(zip(s.x, map(to_sympy, scene.x0), strict=True))
    E = energy(s)
    if by_hamiltonian:
        E = s.hamiltonian
        at |= dict(zip(s.mu, map(to_sympy, scene.mu0 or ()), strict=True))
    else:
        E = E.xreplace(dict(zip(s.mu, momentum(s), strict=True)))
        at |= dict(zip(s.u, map(to_sympy, scene.v0), strict=True))
    size, E = (sympy.sympify(e).xreplace(at) for e in (expression, E))
    if not size.is_positive:
        raise BadInput(
            f"{scene.name}: sigma is {float(size):.3g} at the start: give one that is positive."
        )
    function: Any = scene.hamiltonian or scene.lagrangian
    field = "hamiltonian" if by_hamiltonian else "lagrangian"
    made: Namespace = {field: InOwnTime(function, scale, by_hamiltonian)}
    share = Fraction(scene.step) / Fraction(scene.duration)
    if duration is None:  # a short number near to the exact one
        duration = Fraction(f"{float(to_sympy(scene.duration) / size):.3g}")
    duration = measure(duration, f"{scene.name}: duration")
    return replace(
        scene, name=f"{scene.name}-in-own-time", title=f"{scene.title or scene.name}, in its time",
        parameters={**scene.parameters, ENERGY: E},
        v0=() if by_hamiltonian else [size * to_sympy(e) for e in scene.v0],
        duration=duration, step=duration * share, sigma=None,
        symmetries=[q for q in scene.symmetries if _has(s, expression, q)], **made,
    )  # fmt: skip


def _has(s: SceneSymbols, sigma: Expression, quantity: Conserved) -> bool:
    """True if the motion that a quantity generates keeps σ: {σ, J} = 0."""
    if quantity.kind not in ("momentum map", "Casimir") or quantity.of_step:
        return False
    z = [*s.x, *s.mu]
    slope = jacobian(s.conserved(quantity), z)
    bracket = jacobian([sigma], z) * poisson_tensor(s, s.x, s.mu) * slope.T
    return first_violation(bracket) is None
