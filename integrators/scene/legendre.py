"""The Lagrangians of a Hamiltonian: its Legendre transform, and ϑ(x)·v − H(x) of a one-form."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from types import CodeType, SimpleNamespace
from typing import Any, TypeAlias

from ..errors import CannotMeasure
from ..numbers import LazyModule, jacobian, to_sympy, without_text
from ..numbers.types import (
    Exact,
    Expression,
    Function,
    Letter,
    Parameters,
    Point,
    Scalar,
    SymbolicMatrix,
    Velocity,
)

mpmath = LazyModule("mpmath")
sympy = LazyModule("sympy")

#: scene.py, which imports this file, has the class of this name
Scene: TypeAlias = Any

# largest number of momenta that the equation v = ∂H/∂μ couples, solved for as letters
MOST_TIED = 3


class OfHamiltonian:
    """A Lagrangian that follows from a Hamiltonian, whose line messages name."""

    hamiltonian: Function

    @property
    def __code__(self) -> CodeType | None:
        return getattr(self.hamiltonian, "__code__", None)

    @property
    def formula(self) -> Function:
        """The function that it is made of, to pickle it."""
        return self.hamiltonian

    def energy(self, *arguments: Any) -> Expression:
        """Return the value of the Hamiltonian, or the entry of a 1×1 matrix."""
        value = sympy.sympify(without_text(self.hamiltonian(*arguments), "its Hamiltonian"))
        return value[0, 0] if getattr(value, "shape", None) == (1, 1) else value


@dataclass(frozen=True)
class LegendreTransform(OfHamiltonian):
    """The Lagrangian l(x, v, p) or l(x, v, p, t) of hamiltonian(x, mu, p) or hamiltonian(x, mu, p,
    t).

    With H = H₀(x) + g(x)·μ + μᵀN(x)μ/2 it is (v − g)ᵀN⁻¹(v − g)/2 − H₀. A call raises
    `CannotMeasure` for another H, for a singular N, and for an N with a long inverse.
    """

    hamiltonian: Function

    @property
    def __wrapped__(self) -> Function:
        """The Hamiltonian, whose arguments and line serve for messages."""
        return self.hamiltonian

    def __call__(self, x: Point, v: Velocity, *rest: Any) -> Expression:
        m = len(v)
        mu = sympy.Matrix(m, 1, lambda i, _: sympy.Dummy(f"mu_{i}", real=True))
        value = self.energy(x, mu, *rest)
        drift = jacobian([value], mu).T
        inverse_mass = jacobian(drift, mu)
        still = dict.fromkeys(mu, 0)
        if inverse_mass.free_symbols & set(mu):
            raise CannotMeasure(f"its Hamiltonian is not quadratic in mu, {_NO_LAGRANGIAN}")
        rate, total = v - drift.xreplace(still), -value.xreplace(still)
        for block in inverse_mass.connected_components():
            tied = inverse_mass.extract(block, block).applyfunc(lambda e: e.simplify())
            if len(block) > MOST_TIED or tied.det().simplify() == 0:
                how = "singular" if len(block) <= MOST_TIED else "too large to be inverted"
                raise CannotMeasure(f"∂²H/∂mu² is {how}, {_NO_LAGRANGIAN}")
            part = rate.extract(block, [0])
            total += part.dot(tied.LUsolve(part)) / 2
        return total

    def exists(self, scene: Scene) -> bool:
        """Return True if the scene has that Lagrangian, or if this fails for another reason."""
        try:
            self(*_letters(scene))
        except CannotMeasure:
            return False
        except Exception:
            return True
        return True

    def is_regular(self, scene: Scene) -> bool:
        """Return True if ∂²H/∂μ² is regular at a generic state, so that v determines μ."""
        x, mu, *rest = _letters(scene)
        value = self.energy(x, mu, *rest)
        slope = jacobian(jacobian([value], mu).T, mu)
        letters = sorted(slope.free_symbols, key=str)
        at = {e: sympy.Rational(2 * k + 3, 3 * k + 7) for k, e in enumerate(letters)}
        with mpmath.workdps(30):
            # sympy's own singular values give up at some diagonal matrices (PrecisionExhausted)
            matrix = mpmath.matrix(slope.xreplace(at).evalf(30).tolist())
            sizes = mpmath.svd(matrix, compute_uv=False)
            return bool(min(sizes) > 1e-20 * max(sizes))


def nested(
    parameter: Exact | tuple[Exact, ...], entry: Callable[[Exact], Expression]
) -> Expression | SymbolicMatrix:
    """Return a parameter, or the matrix of one that is a tuple, with a function of each entry."""
    if not isinstance(parameter, tuple):
        return entry(parameter)
    return sympy.Matrix([[entry(e) for e in row] if isinstance(row, tuple) else [entry(row)]
                         for row in parameter])  # fmt: skip


def _letters(scene: Scene) -> list[Any]:
    """Return the arguments of the scene's Hamiltonian: x, μ, the parameters' values, any time."""
    group = scene.groupoid
    x, v = (sympy.Matrix(n, 1, lambda i, _: sympy.Dummy(real=True))
            for n in (group.dim_x, group.dim_u))  # fmt: skip
    parameters = SimpleNamespace(**{k: nested(e, to_sympy) for k, e in scene.parameters.items()})
    return [x, v, parameters, *([sympy.Dummy(real=True)] if scene.timed else [])]


_NO_LAGRANGIAN = "so no Lagrangian of it is known in closed form."


@dataclass(frozen=True)
class AffineLagrangian(OfHamiltonian):
    """l(x, v, p) = ϑ(x)·v − H(x) of one_form(x, p), a list as long as x, and hamiltonian(x, p).

    Its equations are of first order: dϑ(·, ẋ) = dH.
    """

    one_form: Function
    hamiltonian: Function

    def __call__(self, x: Point, v: Velocity, p: Parameters) -> Expression:
        theta = without_text(self.one_form(x, p), "its one-form")
        moving = zip(theta, v, strict=True)
        return sum(a * b for a, b in moving) - self.energy(x, p)

    def halved(self, scene: Scene) -> bool:
        """Return True if half of the components of ϑ vanish, or if ϑ cannot be evaluated."""

        def letter(_: Exact) -> Letter:
            return sympy.Dummy(real=True)

        x = nested((0,) * scene.groupoid.dim_x, letter)
        p = SimpleNamespace(**{k: nested(e, letter) for k, e in scene.parameters.items()})
        try:
            return len(halves(self.one_form(x, p))[1]) == len(x) // 2
        except Exception:
            return True


def halves(theta: Iterable[Scalar]) -> tuple[list[int], list[int]]:
    """Return the places of the components of a one-form that do not vanish, and of the others."""
    components = [sympy.sympify(e) for e in without_text([*theta], "its one-form")]
    vanishing = [i for i, e in enumerate(components) if e == 0 or e.equals(0)]
    return [i for i in range(len(components)) if i not in vanishing], vanishing
