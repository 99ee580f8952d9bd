"""What a rule sees of the groupoid and the Lagrangian.

G.target, G.velocity and L answer with functions that know what they stand for: a rule may
differentiate them, replace letters in them or expand them. Where they stay as they are, the scheme
recognises them and derives each term once. What else a rule may do to an expression (coefficients,
arguments, bound letters) is right too: a user's rule is asked once more with everything written
out (`WrittenGroupoid`, `WrittenLagrangian`), and where the two differ that one is derived.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..errors import BadInput
from ..groupoids import Groupoid
from ..numbers import floats_exact, sympy
from .symbols import SceneSymbols


def answer(name: str, value: Callable[..., Any]) -> Any:
    """A class of sympy functions whose applications stand for value(*arguments)."""

    def written_out(self: Any) -> Any:
        return value(*self.args)

    def derivative(self: Any, s: Any) -> Any:
        return written_out(self).diff(s)

    members = {
        "written_out": written_out,
        "_eval_derivative": derivative,
        "_eval_is_real": lambda self: True,
        # expand() is asked by rules that look into an expression
        "_eval_expand_basic": lambda self, **hints: written_out(self),
    }
    return type(name, (sympy.Function,), members)


class GroupoidForRule:
    """The groupoid as a rule sees it: targets and velocities, elements and the inversion."""

    def __init__(self, groupoid: Groupoid, s: SceneSymbols) -> None:
        self.groupoid, self.s = groupoid, s
        n, m = groupoid.dim_x, groupoid.dim_u

        def target(i: Any, *a: Any) -> Any:
            return groupoid.target(_column(a[:n]), _column(a[n:-1]), a[-1])[int(i)]

        def velocity(i: Any, *a: Any) -> Any:
            x, w, dw = (_column(part) for part in (a[:n], a[n : n + m], a[n + m : -1]))
            return groupoid.velocity(x, w, dw, a[-1])[int(i)]

        self.Target, self.Velocity = answer("target", target), answer("velocity", velocity)
        #: whether the rule takes velocities from curves, and so serves every chart alike
        self.gave_velocities = False

    def target(self, x: Any, u: Any, h: Any) -> Any:
        """b(x, u; h), n×1; u may be any value w(u, s) of a curve in the chart."""
        self._check((x, self.groupoid.dim_x, "x"), (u, self.groupoid.dim_u, "u"))
        h = floats_exact(h)
        if not self.groupoid.dim_x or h == 0 or not any(u):
            return x
        return self._each(self.Target, self.groupoid.dim_x, *x, *u, h)

    def velocity(self, x: Any, w: Any, dw: Any, h: Any) -> Any:
        """ξ = L(x, w; h)⁻¹ dw/dθ at the chart value w of a curve w(θ), m×1."""
        self.gave_velocities = True
        m = self.groupoid.dim_u
        self._check((x, self.groupoid.dim_x, "x"), (w, m, "w"), (dw, m, "dw"))
        if self.groupoid.left_is_identity or not any(w):
            return dw.applyfunc(floats_exact)
        return self._each(self.Velocity, len(dw), *x, *w, *dw, h)

    def element(self, u: Any, h: Any) -> Any:
        """The matrix τ(hu)."""
        return self.groupoid.element(u, h)

    def inversion(self, x: Any, u: Any, h: Any) -> Any:
        """ι(x, u; h) of (x, u)⁻¹ = (b, ι)."""
        return self.groupoid.inversion(x, u, h)

    def constant(self, value: Any) -> Any:
        """A letter for an exact number, given as a function digits → mpf."""
        return self.s.constant(value)

    def _check(self, *given: tuple[Any, int, str]) -> None:
        for column, length, name in given:
            if len(column) != length:
                raise BadInput(
                    f"the rule asks {self.groupoid.name} with {len(column)} entries for {name}, "
                    f"but {length} are needed."
                )

    @staticmethod
    def _each(kind: Any, length: int, *arguments: Any) -> Any:
        given = [floats_exact(a) for a in arguments]
        return sympy.Matrix(length, 1, [kind(i, *given) for i in range(length)])


class LagrangianForRule:
    """The Lagrangian as a rule sees it: L(x, u), L.fast(x) and L.parameters."""

    def __init__(self, s: SceneSymbols) -> None:
        self.s, self.parameters = s, s.parameters
        n = len(s.x)
        self.Value = answer(
            "lagrangian", lambda *a: s.lagrangian_at(_column(a[:n]), _column(a[n:]))
        )
        self.Fast = answer("fast", lambda *a: s.fast_at(_column(a)))

    def __call__(self, x: Any, u: Any) -> Any:
        if len(x) != len(self.s.x) or len(u) != len(self.s.u):
            return self.s.lagrangian_at(x, u)  # which says what is wrong
        return self.Value(*x, *u)

    def fast(self, x: Any) -> Any:
        """The fast part of the potential at x."""
        _ = self.s.fast_at(self.s.x)  # raises where the scene names none
        return self.Fast(*x)


class WrittenGroupoid(GroupoidForRule):
    """The groupoid with its answers written out."""

    def target(self, x: Any, u: Any, h: Any) -> Any:
        """b(x, u; h), n×1, as expressions."""
        answer = super().target(x, u, h)
        return answer.applyfunc(written)

    def velocity(self, x: Any, w: Any, dw: Any, h: Any) -> Any:
        """L(x, w; h)⁻¹ dw/dθ, m×1, as expressions."""
        return super().velocity(x, w, dw, h).applyfunc(written)


class WrittenLagrangian(LagrangianForRule):
    """The Lagrangian as the scene's expression."""

    def __call__(self, x: Any, u: Any) -> Any:
        return self.s.lagrangian_at(x, u)

    def fast(self, x: Any) -> Any:
        """The fast part of the potential at x."""
        return self.s.fast_at(x)


def written(e: Any) -> Any:
    """The expression with every answer in it replaced by what it stands for."""
    while answers := [a for a in e.atoms(sympy.Function) if hasattr(a, "written_out")]:
        e = e.xreplace({a: a.written_out() for a in answers})
    return e


def _column(entries: Any) -> Any:
    return sympy.Matrix(len(entries), 1, list(entries))
