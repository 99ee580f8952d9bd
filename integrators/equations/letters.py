"""What a rule sees of the groupoid, and the letters (atoms) that its answers are kept as.

A rule asks for points b(x, w; h) and velocities ξ = L(x, w)⁻¹ dw/dθ along a curve w(θ) from 0 to u.
Each answer is a column of letters with a value and slopes: the discrete Lagrangian stays a small
function of few letters, and whatever is derived from it goes through the chain rule
(`integrators.equations.chain_rule`).

    point      z = b(x, θu; h) or b(x, W; 1)      slopes in u, or in W and the base
    chart      W = hw(u, s), or dw(u, s)          slopes in x, u, s
    velocity   ξ = L(x, W; 1)⁻¹ dw                slopes in x, W, dw
    value      L(z, ξ) at such a node             slopes in z, ξ
    element    g = τ(hu) B (`integrators.equations.on_group`)   slopes in u
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from ..groupoids.groupoid import Groupoid
from ..numbers.differentiation import jacobian
from ..numbers.exact import floats_exact
from ..numbers.lazy import sympy
from .symbols import SceneSymbols


@dataclass(frozen=True, eq=False)
class Atom:
    """A column of letters `z` for the expressions `value`; slopes: [(column, ∂z/∂column)].

    A point at a fraction of the straight step has that fraction as `theta`, and its `fields`: how
    e→ and e← move it. A point of a curve has its `base` (x or y) and `turn` with
    ∂z/∂base · ρ(base) = ∂z/∂W · turn, for e→(b) = 0 at the arrow (base, W).
    """

    kind: Literal["element", "point", "chart", "velocity", "value", "gradient", "sum", "name"]
    z: Any
    value: Any
    slopes: list[tuple[Any, Any]] = field(default_factory=list)
    theta: Any = None
    fields: tuple[Any, Any] | None = None
    base: Any = None
    turn: Any = None

    @property
    def moved(self) -> tuple[Any, Any]:
        """How e→ and e← move a point of the straight step, n×m each."""
        assert self.fields is not None
        return self.fields

    @property
    def is_end(self) -> bool:
        """Whether it is y = b(x, u; h)."""
        return bool(self.theta == 1)


class GroupoidForRule:
    """What a rule sees of the groupoid: targets and velocities, kept as atoms."""

    def __init__(self, groupoid: Groupoid, s: SceneSymbols) -> None:
        self.groupoid, self.s = groupoid, s
        self.atoms: list[Atom] = []
        #: whether the rule takes velocities from curves, and so serves every chart alike
        self.gave_velocities = False
        self._found: dict[Any, Any] = {}

    def target(self, x: Any, u: Any, h: Any) -> Any:
        """b(x, u; h); u may be any chart value w(u, s), and x may be the end y of the step."""
        h = floats_exact(h)
        theta = h / self.s.h
        if not self.groupoid.dim_x or theta == 0 or not any(u):
            return x
        straight = u == self.s.u and theta.is_number
        if x == self.s.x and straight:
            return self._point_of_step(theta)
        if x not in (self.s.x, self.s.y) or not (straight or self._is_curve(u, h)):
            return self.groupoid.target(x, u, h)
        return self._point_of_curve(x, u, h)

    def velocity(self, x: Any, w: Any, dw: Any, h: Any) -> Any:
        """ξ = L(x, w; h)⁻¹ dw/dθ at the chart value w of a curve w(θ), m×1."""
        self.gave_velocities = True
        h = floats_exact(h)
        w, dw = w.applyfunc(floats_exact), dw.applyfunc(floats_exact)
        if self.groupoid.left_is_identity or not any(w):
            return self._chart(dw, "dw")
        chart, rate = self._chart(h * w, "W"), self._chart(dw, "dw")
        key = ("ξ", *map(tuple, (x, chart, rate)))
        if key not in self._found:
            value = self.groupoid.velocity(x, chart, rate, self.s.h**0)
            self._found[key] = self._quotients(value, [chart, rate, x])
        return self._found[key]

    def lagrangian(self, x: Any, xi: Any) -> Any:
        """l(x, ξ); the value at a node of a curve is kept as a letter."""
        value = self.s.lagrangian_at(x, xi)

        known = {atom.z[0]: atom for atom in self.atoms}
        point = known.get(x[0]) if len(x) else None
        if known.get(xi[0]) is None or (len(x) and (point is None or point.turn is None)):
            return value
        return self._atom("value", "a", sympy.Matrix([value]), [x, xi])[0]

    def element(self, u: Any, h: Any) -> Any:
        """The matrix τ(hu)."""
        return self.groupoid.element(u, h)

    def inversion(self, x: Any, u: Any, h: Any) -> Any:
        """ι(x, u; h) of (x, u)⁻¹ = (b, ι)."""
        return self.groupoid.inversion(x, u, h)

    def constant(self, value: Any) -> Any:
        """An exact number, or a function digits → mpf, kept as a letter."""
        return self.s.constant(value)

    # -- inner ----------------------------------------------------------------------------------

    def _atom(self, kind: Any, letter: str, value: Any, columns: list[Any]) -> Any:
        """Letters for a value, with its slopes in those of the columns that it holds."""
        slopes = [(c, value.jacobian(c)) for c in columns if len(c)]
        slopes = [(c, slope) for c, slope in slopes if any(slope)]
        return self._add(Atom(kind, self._letters(letter, value), value, slopes))

    def _quotients(self, value: Any, columns: list[Any]) -> Any:
        """Letters for N/D, their slopes and the 1/D: rational derivatives stay small.

        With q = N/D and S_a = ∂_a q = (∂_a N − q ∂_a D)/D the derivatives of S_a are
        ∂_b S_a = (∂_ab N − S_b ∂_a D − S_a ∂_b D − q ∂_ab D)/D.
        """
        columns = [c for c in columns if set(c) & value.free_symbols]
        parts = [e.together().as_numer_denom() for e in value]
        if not any(bottom.free_symbols for _, bottom in parts):
            return self._atom("velocity", "v", value, columns)
        over: dict[Any, Any] = {}
        for _, bottom in parts:
            if bottom not in over:
                o = self._letters("o", [bottom])
                slopes = [(c, -(o[0] ** 2) * sympy.Matrix([bottom]).jacobian(c)) for c in columns]
                over[bottom] = self._add(Atom("velocity", o, sympy.Matrix([1 / bottom]), slopes))[0]
        N, D = (sympy.Matrix(part) for part in zip(*parts, strict=True))
        o = [over[e] for e in D]
        z = self._letters("v", value)
        first = [self.s.vector(f"{z[0]}_{i}", len(z) * len(c)).reshape(len(z), len(c))
                 for i, c in enumerate(columns)]  # fmt: skip
        self._add(Atom("velocity", z, sympy.Matrix([n * e for n, e in zip(N, o, strict=True)]),
                       list(zip(columns, first, strict=True))))  # fmt: skip
        d = [jacobian(D, a) for a in columns]
        for a, z_a, d_a in zip(columns, first, d, strict=True):
            n_a = jacobian(N, a)
            rows = range(len(z))
            inner = [(k, i) for k in rows for i in range(len(a))]
            values = sympy.Matrix([(n_a[k, i] - z[k] * d_a[k, i]) * o[k] for k, i in inner])
            slopes = []
            for b, z_b, d_b in zip(columns, first, d, strict=True):
                n_ab, d_ab = jacobian(list(n_a), b), jacobian(list(d_a), b)
                slopes.append((b, sympy.Matrix(len(inner), len(b), [
                    (n_ab[row, j] - z_b[k, j] * d_a[k, i]
                     - z_a[k, i] * d_b[k, j] - z[k] * d_ab[row, j]) * o[k]
                    for row, (k, i) in enumerate(inner) for j in range(len(b))
                ])))  # fmt: skip
            self._add(Atom("velocity", z_a.reshape(len(inner), 1), values, slopes))
        return z

    def _point_of_step(self, theta: Any) -> Any:
        g, s = self.groupoid, self.s
        if theta not in self._found:
            z = s.vector("y" if theta == 1 else f"z{len(self.atoms)}", g.dim_x)
            value = g.target(s.x, s.u, theta * s.h)
            slopes = [(s.u, g.point_slope(s.x, s.u, s.h, theta, z))]
            slopes.append((s.x, value.jacobian(s.x)))
            fields = g.point_fields(s.x, s.u, s.h, theta, z)
            self._found[theta] = self._add(Atom("point", z, value, slopes, theta, fields))
        return self._found[theta]

    def _point_of_curve(self, base: Any, w: Any, h: Any) -> Any:
        g, s = self.groupoid, self.s
        one = s.h**0
        if base == s.y:
            base = self._point_of_step(one)
        chart = self._chart(h * w, "W")
        key = ("z", *map(tuple, (base, chart)))
        if key not in self._found:
            value = g.target(base, chart, one)
            z = self._letters("z", value)
            slope = g.point_slope(base, chart, one, one, z)
            turn = s.h * g.R(base, chart, one)
            slopes = [(chart, slope), (base, value.jacobian(base))]
            self._found[key] = self._add(Atom("point", z, value, slopes, base=base, turn=turn))
        return self._found[key]

    def _is_curve(self, w: Any, h: Any) -> bool:
        known = {*self.s.u, *self.s.stages, *self.s.q, *self.s.x, *self.s.y}
        return w.free_symbols | h.free_symbols <= known

    def _chart(self, value: Any, kind: str) -> Any:
        """The letters of a chart value; u itself and 0 need none."""
        s = self.s
        value = value.applyfunc(lambda e: e.expand())
        if value == s.u or not any(value):
            return value
        key = (kind, tuple(value))
        if key not in self._found:
            self._found[key] = self._atom("chart", "w", value, [s.x, s.u, s.stages])
        return self._found[key]

    def _letters(self, letter: str, value: Any) -> Any:
        return self.s.vector(f"{letter}{len(self.atoms)}", len(value))

    def _add(self, atom: Atom) -> Any:
        self.atoms.append(atom)
        return atom.z


class LagrangianForRule:
    """What a rule sees of the Lagrangian: L(x, u), L.fast(x) and L.parameters."""

    def __init__(self, s: SceneSymbols, seen: GroupoidForRule) -> None:
        self.s, self.seen, self.parameters = s, seen, s.parameters

    def __call__(self, x: Any, u: Any) -> Any:
        return self.seen.lagrangian(x, u)

    def fast(self, x: Any) -> Any:
        """The fast part of the potential at x."""
        return self.s.fast_at(x)
