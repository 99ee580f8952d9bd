"""A scene in a time of its own, by K = σ (H − E₀), whose motion at K = 0 is that of H.

By a Lagrangian, L̃(x, x′) = σ(x) (L(x, x′/σ) + E₀). The momentum is the same, and the energy of the
start is a parameter: −E₀ is the momentum of the physical time, t′ = ∂K/∂p_t = σ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from types import CodeType
from typing import Any

from ...compiler import Step
from ...equations import SceneSymbols, energy, momentum, poisson_tensor, vector_field
from ...errors import BadInput, check_function
from ...numbers import (
    Node,
    first_violation,
    jacobian,
    measure,
    ratio,
    sympy,
    to_sympy,
    without_text,
)
from ...numbers.types import Column, Expression, Function, Given, Letter, Namespace, Parameters
from ...scene import Conserved, Scene

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
            return self._of(self.sigma, x, second, p) * (self._of(self.function, x, second, p) - E)
        sigma = self._of(self.sigma, x, 0 * second, p)
        return sigma * (self._of(self.function, x, second / sigma, p) + E)

    @staticmethod
    def _of(function: Function, *arguments: Any) -> Expression:
        return without_text(function(*arguments), "its sigma or its energy")


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


# One step of a rule, with the physical time and the step density as two more entries of x.
#
# The step h of a system is the first entry of q; here it stands for the share of ε that a step has.
# Each h in the system is replaced by the effective step, h/(ζ + e D): ζ the density, D its growth
# in a step, e a last entry of q, which is not 0 only in the first substep. So the kernels, the
# driver and all functions of a system stay the same.


#: names of this room's letters, which no parameter of a scene can have: the physical time, the
#: density, and e, by which only the first substep changes the density
TIME, DENSITY, CONTROL = (f"sd{i}" for i in range(3))


def letter(name: str) -> Letter:
    """Return a real letter of that name."""
    return sympy.Symbol(name, real=True)


def with_columns(
    system: Step, columns: Sequence[Letter], increments: Sequence[Expression | Node]
) -> Step:
    """Return the system with more entries of x, which grow by increments in its letters."""
    more = tuple(letter(f"{c}_y") for c in columns)
    return replace(
        system,
        x=(*system.x, *columns),
        y=(*system.y, *more),
        increment=[*system.increment, *increments],
    )


def controlled(
    system: Step, s: SceneSymbols, sigma: Expression, way: str, leading: bool = True
) -> Step:
    """Return a system of equal steps with a step that follows σ, in the way reversible or naive.

    leading: whether the step changes the density; the later substeps of a composition take it as
    it is.
    """
    zeta, control = map(letter, (DENSITY, CONTROL))
    graph = system.graph
    h, before, may_change = graph.letters((system.q[0], zeta, control))
    # sizes that show a chart's edge do not depend on μ: they take the density before the step
    share = {h.index: graph.product([(h, 1), (before, -1)])}
    watched = [(kind, graph.rebuilt([e], share)[0]) for kind, e in system.extents]
    if leading:
        value = graph.hold(graph.read(sigma))
        # a negative value has no real root: a run with such a σ or density ends there
        root = graph.hold(graph.product([(value, ratio(1, 2))]))
        over = graph.product([(root, -2)])
        grows = over - before
        if way == "reversible":
            grows = graph.read(logarithmic_rate(s, sigma) * sigma) * over
        change = may_change * graph.hold(grows)
        after = graph.hold(graph.product([(before + change, ratio(1, 2))]))
        step = graph.hold(graph.product([(h, 1), (after, -2)]))
    else:
        change, step = graph.number(0), graph.hold(graph.product([(h, 1), (before, -1)]))
    result = replace(
        system.at({system.q[0]: step}), q=(*system.q, control), extents=watched, scaled=()
    )
    return with_columns(result, [letter(TIME), zeta], [step, change])


def logarithmic_rate(s: SceneSymbols, sigma: Expression) -> Expression:
    """Return G = −(dσ/dt)/σ along the motion, in x and μ.

    Raises `CannotMeasure` if ξ(x, μ) has no short closed form.
    """
    slope = jacobian([sigma], [*s.x, *s.mu])
    return -(slope * vector_field(s))[0] / sigma


def sigma_of(s: SceneSymbols, function: Function, bare: bool) -> Expression:
    """Return σ in the letters of a scene; bare: of x alone.

    Raises `BadInput` for another shape, for a σ that is not smooth, and for unknown letters.
    """
    what = "sigma"
    expression = s.call(function, what, s.position, s.mu, s.parameters)
    s.refuse_unknown(sympy.Matrix([expression]), {*s.x, *s.mu}, what, function, "x, mu and p")
    s.scalars([expression], what, function)
    pieces = expression.atoms(sympy.Abs, sympy.Max, sympy.Min, sympy.sign, sympy.Heaviside,
                              sympy.Piecewise, sympy.floor, sympy.ceiling)  # fmt: skip
    if any(e.free_symbols & {*s.x, *s.mu} for e in pieces):
        raise BadInput(
            f"{s.name}: sigma is not smooth: it holds {min(map(str, pieces), key=len)[:60]}, and "
            "no step has an order across a jump; write it without, as a root of squares or a sum "
            "of powers."
        )
    if bare and expression.free_symbols & {*s.mu}:
        raise BadInput(
            f'{s.name}: sigma depends on mu; with way="poincare" give a function of x and p '
            'alone, or take way="reversible".'
        )
    return expression
