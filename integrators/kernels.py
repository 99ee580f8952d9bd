"""Kernels of a scheme: generated text, compiled by numba or run on numbers of any precision.

One module a scheme: `prepare(q) → c`, `correct(x, w, μ, k, c) → (dw, size)` (or `direct` where F⁻
is affine in u), `update(x, w, μ, k, ex, eμ, c) → (dx, dμ, k)`, `carry(x, c) → k`, then the driver.
The step h and the parameters are symbols (the vector q), so nothing is generated or compiled again
for another step. k are the costly functions of x alone (sin x, 1/r³) that the next step needs
again: they are computed once, at the end of a step.
"""

from __future__ import annotations

import inspect
from functools import cached_property
from typing import Any

from . import driver
from .elimination import loop_text, solve
from .equations import Scheme
from .evaluation import evaluate_matrix
from .identities import is_zero, random_point
from .printing import Coefficients, function_text
from .tables import with_tables
from .vectors import vector_text


class KernelBuilder:
    """Derives the kernels' expressions from a scheme and writes their text."""

    def __init__(self, scheme: Scheme) -> None:
        self.scheme = scheme
        self.coefficients = Coefficients(scheme.s.q)
        self.x, self.w, self.mu = scheme.x, scheme.u, scheme.s.mu
        self.end = scheme.s.y

    @cached_property
    def jacobian(self) -> Any:
        """∂(F⁻/h)/∂u, m×m, through the points."""
        return self._over_h(self.scheme.total_u(self.scheme.minus_at_points))

    def _over_h(self, matrix: Any) -> Any:
        """matrix/h term by term, so that powers of h cancel before they are ever rounded."""
        from sympy import Add

        h = self.scheme.h
        return matrix.applyfunc(lambda e: Add(*[t / h for t in Add.make_args(e)]))

    @cached_property
    def affine(self) -> bool:
        """Whether F⁻ is affine in u, so that one correction solves it.

        Decided by comparing ∂F⁻/∂u at two random u of the same x, h and parameters, exactly.
        """
        if not set().union(*(e.free_symbols for e in self.jacobian)) & {
            *self.w,
            *(z for p in self.scheme.points for z in p.z),
        }:
            return True
        symbols = [*self.x, *self.w, *self.scheme.s.q]
        first, other = (
            random_point(symbols, small=(*self.w, self.scheme.h), seed=i) for i in (0, 1)
        )
        second = {**first, **{u: other[u] for u in self.w}}
        one, two = (self._at(self.jacobian, point) for point in (first, second))
        return all(is_zero(a - b) for a, b in zip(one, two, strict=True))

    def _pivot_rows(self) -> list[int]:
        """The order of the rows in which elimination meets large pivots, at a random point.

        Chosen when the kernel is generated, so it costs a step nothing; where it is a poor choice
        Newton only takes more corrections.
        """
        m = len(self.w)
        if m <= 3:
            return list(range(m))
        from scipy.linalg import lu_factor

        point = random_point([*self.x, *self.w, *self.scheme.s.q], (*self.w, self.scheme.h))
        numbers = evaluate_matrix(self._at(self.jacobian, point), 16 + 1)
        _, swaps = lu_factor([[float(numbers[i, j]) for j in range(m)] for i in range(m)])
        rows = list(range(m))
        for i, j in enumerate(swaps):
            rows[i], rows[j] = rows[j], rows[i]
        return rows

    def _at(self, matrix: Any, point: dict[Any, Any]) -> Any:
        """The matrix at a numerical point; the points of the step are evaluated first."""
        values = {
            z: b.xreplace(point)
            for p in self.scheme.points
            for z, b in zip(p.z, p.value, strict=True)
        }
        return matrix.xreplace({**point, **values})

    @cached_property
    def carried(self) -> list[tuple[Any, Any]]:
        """Costly functions of x in F⁻ that F⁺ needs at the end point: [(at x, at y)]."""
        scheme = self.scheme
        to_end = dict(zip(self.x, self.end, strict=True))
        constants = set(scheme.s.q)
        old = _costly([*scheme.minus_at_points, *self.jacobian], self.x, constants)
        new = _costly(scheme.gain_at_points, self.end, constants)
        return [(a, a.xreplace(to_end)) for a in old if a.xreplace(to_end) in new]

    def build(self) -> str:
        """The text of the whole module, decorators `kernel`, `helper`, `entry` left to its host."""
        kernels = [f"@kernel\n{text}" for text in (self._solver(), self._update())]
        carry = self._carry()
        c, q = self.coefficients.values, self.scheme.s.q
        numbered = {s: _symbol(f"q{i}") for i, s in enumerate(q)}
        prepare = function_text(
            "prepare", {"q": numbered.values()}, [[e.xreplace(numbered) for e in c]]
        )
        shape = {
            "affine": self.affine,
            "dim_x": len(self.x),
            "dim_u": len(self.w),
            "carried": len(self.carried),
        }
        text = "\n\n".join(
            [
                f"# {self.scheme.scene.name}\nSHAPE = {shape}",
                *kernels,
                vector_text(len(self.x), len(self.w), len(self.carried), len(c), self.affine),
                *([f"@aside\n{loop_text()}"] if "eliminate(" in kernels[0] else []),
                *_driver_text(self.affine),
                carry,
                prepare,
            ]
        )
        return with_tables(text)

    # -- numbers that stay consistent ------------------------------------------------------------

    @cached_property
    def _xi(self) -> dict[Any, Any]:
        """u ↦ ξ = hu, for those u that the groupoid's maps depend on.

        Written in ξ their coefficients are the chart's own (1, 1/2, 1/4), exact in binary, so that
        rounding does not turn a rotation into a slow spiral: h²/4 rounded apart from h lets |Γ|²
        drift linearly (Lagrange top, 10⁶ steps: 2e-12; in ξ: 1e-14).
        """
        used = self.scheme.L.free_symbols
        return {u: _symbol(f"xi{i}") for i, u in enumerate(self.w) if u in used}

    def _in_xi(self, e: Any) -> Any:
        h = self.scheme.h
        return e.xreplace({u: xi / h for u, xi in self._xi.items()})

    def _hoist(self, e: Any) -> Any:
        return self.coefficients.hoist(self._in_xi(e))

    @property
    def _define_xi(self) -> list[tuple[Any, Any]]:
        h, xi = self.scheme.h, self._xi
        return [(list(xi.values()), [self.coefficients.hoist(h * u) for u in xi])] if xi else []

    # -- the kernels ----------------------------------------------------------------------------

    def _arguments(self) -> dict[str, Any]:
        c = [f"c{i}" for i in range(len(self.coefficients.values))]
        return {"x": self.x, "w": self.w, "mu": self.mu, "k": self._k, "c": c}

    @cached_property
    def _k(self) -> list[Any]:
        from sympy import Symbol

        return [Symbol(f"k{i}", real=True) for i in range(len(self.carried))]

    def _points(self, *uses: Any) -> list[tuple[Any, Any]]:
        """The points that the expressions use, as (symbols, values)."""
        free = set().union(*(e.free_symbols for use in uses for e in use))
        return [
            (list(p.z), [self._hoist(b) for b in p.value])
            for p in self.scheme.points
            if free & set(p.z)
        ]

    def _with_k(self, entries: Any) -> list[Any]:
        at_x = {a: k for (a, _), k in zip(self.carried, self._k, strict=True)}
        return [self._hoist(e.xreplace(at_x)) for e in entries]

    def _solver(self) -> str:
        """`correct`, one Newton correction; `direct`, the solution itself, if F⁻ is affine."""
        scheme = self.scheme
        minus, jacobian = self._over_h(scheme.minus_at_points), self.jacobian
        if self.affine:
            zero = dict.fromkeys(self.w, 0)
            minus = scheme.written_out(minus).xreplace(zero)
            jacobian = scheme.written_out(jacobian).xreplace(zero)
        residual = self.mu - minus
        dw, steps = solve(jacobian, residual, self.coefficients, self._pivot_rows())
        entries = [(s, type(values)(self._with_k(values))) for s, values in steps]
        points = [] if self.affine else self._points(jacobian, residual)
        before = [*points, *entries]
        if not self.affine:
            before = [*self._define_xi, *before]
        names = self._with_k(dw)
        results: list[Any] = [names]
        if not self.affine:
            results.append(sum(_absolute(e) for e in names))
        arguments = self._arguments()
        if self.affine:
            del arguments["w"]
        return function_text("direct" if self.affine else "correct", arguments, results, before)

    def _update(self) -> str:
        """`update`: what x and μ grow by, less what the sums before lost (ex, emu), and the new k.

        The loss is taken off in here, where the compiler may choose the order: it is tiny, and off
        the longest path it costs nothing.
        """
        scheme = self.scheme
        gain = self._over_h(scheme.gain_at_points)
        increment = scheme.scene.groupoid.increment(self.x, self.w, scheme.h)
        dx = [self._hoist(e) for e in increment]
        d_symbols = scheme.s.vector("d", len(self.x))
        at_end = [b for _, b in self.carried]
        before = self._define_xi
        if len(self.x):
            before.append((list(d_symbols), dx))
        if any((set(self.end) & e.free_symbols) for e in [*gain, *at_end]):
            before.append((list(self.end), list(self.x + d_symbols)))
        inner = [p for p in scheme.points if not p.is_end]
        before += [
            point for point in self._points(gain) if any(point[0] == list(p.z) for p in inner)
        ]
        before.append(
            ([f"n{i}" for i in range(len(at_end))], [self.coefficients.hoist(b) for b in at_end])
        )
        swap = {b: _symbol(f"n{i}") for i, b in enumerate(at_end)}
        dmu = self._with_k([e.xreplace(swap) for e in gain])
        ex, emu = (scheme.s.vector(name, len(v)) for name, v in (("ex", self.x), ("emu", self.w)))
        grown = [list(d_symbols - ex), [d - e for d, e in zip(dmu, emu, strict=True)]]
        results = [*grown, [_symbol(f"n{i}") for i in range(len(at_end))]]
        arguments = self._arguments()
        c = arguments.pop("c")
        arguments |= {"ex": ex, "emu": emu, "c": c}
        return function_text("update", arguments, results, before)

    def _carry(self) -> str:
        values = [self.coefficients.hoist(a) for a, _ in self.carried]
        return function_text("carry", {"x": self.x, "c": self._arguments()["c"]}, [values])


def _symbol(name: str) -> Any:
    from sympy import Symbol

    return Symbol(name, real=True)


def _absolute(e: Any) -> Any:
    from sympy import Abs

    return Abs(e, evaluate=False)


def _costly(entries: Any, variables: Any, constants: set[Any]) -> list[Any]:
    """Largest subexpressions that are functions or roots of `variables` and constants alone."""
    wanted = set(variables)
    found: list[Any] = []

    def visit(e: Any) -> None:
        if not e.free_symbols & wanted:
            return
        costly = e.is_Function or (e.is_Pow and not (e.exp.is_Integer and e.exp > 0))
        if costly and e.free_symbols <= wanted | constants:
            if e not in found:
                found.append(e)
            return
        for a in e.args:
            visit(a)

    for entry in entries:
        visit(entry)
    return found


def _driver_text(affine: bool) -> list[str]:
    """The driver's functions with the decorators that their host defines."""
    solve: Any = driver.solve_direct if affine else driver.solve_newton
    parts: list[Any] = [solve, driver.advance]
    if not affine:
        parts = [driver.best_order, driver.study, *parts]
    kinds = {driver.advance: "entry", driver.study: "aside", driver.best_order: "aside"}
    texts = [inspect.getsource(f).replace(f"def {solve.__name__}(", "def solve(") for f in parts]
    return [f"@{kinds.get(f, 'helper')}\n{text}" for f, text in zip(parts, texts, strict=True)]
