"""Kernels of a scheme: generated text, compiled by numba or run on numbers of any precision.

One module a scheme: `prepare(q) → c`, `correct(x, w, μ, k, c) → (dw, size)` (or `direct` where F⁻
is affine in u), `update(x, w, μ, k, ex, eμ, c) → (dx, dμ, k)`, `carry(x, c) → k`, then the driver.
The step h and the parameters are symbols (the vector q), so nothing is generated or compiled again
for another step. k are the costly functions of x alone (sin x, 1/r³) that the next step needs
again: they are computed once, at the end of a step.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..equations.discrete_equations import DiscreteEquations
from ..errors import BadInput
from ..numbers.definitions import inlined
from ..numbers.lazy import sympy
from ..numbers.printing import Coefficients, Parameters, function_text
from . import driver
from .edge_guard import watch_text
from .elimination import loop_text, solve
from .omissions import carried, is_affine, pivot_rows
from .tuple_operations import vector_text


@dataclass(frozen=True)
class KernelTexts:
    """The functions generated for one scheme: their texts, and how many coefficients there are."""

    nodes: list[str]
    solving: list[str]
    elimination: list[str]
    vectors: str
    carry: str
    prepare: str
    width: int


class KernelBuilder:
    """Derives the kernels' expressions from a scheme and writes their text.

    without: names of `savings.SAVINGS` that are not made, so that they can be measured.
    """

    def __init__(self, scheme: DiscreteEquations, without: frozenset[str] = frozenset()) -> None:
        self.scheme, self.without = scheme, without
        plain = "coefficients" in without
        self.coefficients = Parameters(scheme.s.q) if plain else Coefficients(scheme.s.q)
        self.x, self.u, self.w, self.mu = scheme.x, scheme.u, scheme.w, scheme.s.mu

    @cached_property
    def jacobian(self) -> Any:
        """∂(E/h)/∂w, square, through the points: ∂(F⁻/h)/∂u without stages."""
        if self.scheme.element is not None:  # along e→: ∂F⁻/∂u · R
            return self._over_h(self.scheme.at_points.minus_along_right)
        return self._over_h(self.scheme.at_points.slope)

    def _over_h(self, matrix: Any) -> Any:
        """matrix/h term by term, so that powers of h cancel before they are ever rounded."""
        h = self.scheme.h
        return matrix.applyfunc(lambda e: sympy.Add(*[t / h for t in sympy.Add.make_args(e)]))

    @cached_property
    def affine(self) -> bool:
        """Whether one correction solves a step (`savings.is_affine`)."""
        return "direct" not in self.without and is_affine(self.scheme, self.jacobian)

    @cached_property
    def carried(self) -> list[tuple[Any, Any]]:
        """The functions of x that are handed on: [(at x, at y)] (`savings.carried`)."""
        return [] if "carried" in self.without else carried(self.scheme, self.jacobian)

    @cached_property
    def shape(self) -> dict[str, Any]:
        """What the flow must know of the module: lengths, and whether one correction solves it."""
        return {
            "affine": self.affine,
            "dim_x": len(self.x),
            "dim_u": len(self.u),
            "solved": len(self.w),
            "carried": len(self.carried),
        }

    @cached_property
    def texts(self) -> KernelTexts:
        """The generated functions; decorators are names that the module's host defines."""
        solving = [f"@kernel\n{text}" for text in (self._solver(), self._update())]
        carry = self._carry()
        c, q = self.coefficients.values, self.scheme.s.q
        numbered = {s: _symbol(f"q{i}") for i, s in enumerate(q)}
        prepare = function_text(
            "prepare", {"q": numbered.values()}, [[e.xreplace(numbered) for e in c]]
        )
        lengths = (len(self.x), len(self.u), len(self.w), len(self.carried))
        vectors = vector_text(*lengths, len(c), self.affine)
        elimination = [f"@aside\n{loop_text()}"] if "eliminate(" in solving[0] else []
        nodes: list[str] = []
        return KernelTexts(nodes, solving, elimination, vectors, carry, prepare, len(c))

    def build(self) -> str:
        """The text of the whole module, decorators (`kernel`, `entry`, …) left to its host."""
        watch = watch_text(self)  # before the texts, for it asks for coefficients too
        texts = self.texts
        return "\n\n".join(
            [
                f"# {self.scheme.scene.name}\nSHAPE = {self.shape}",
                *texts.nodes,
                *texts.solving,
                texts.vectors,
                *texts.elimination,
                *watch,
                *solver_text(self.affine),
                f"@entry\n{inspect.getsource(driver.advance)}",
                texts.carry,
                texts.prepare,
            ]
        )

    # -- numbers that stay consistent ------------------------------------------------------------

    @cached_property
    def _xi(self) -> dict[Any, Any]:
        """u ↦ ξ = hu, for those u that the groupoid's maps depend on.

        Written in ξ their coefficients are the chart's own (1, 1/2, 1/4), exact in binary, so that
        rounding does not turn a rotation into a slow spiral: h²/4 rounded apart from h lets |Γ|²
        drift linearly (Lagrange top, 10⁶ steps: 2e-12; in ξ: 1e-14).
        """
        used = self.scheme.L.free_symbols
        return {u: _symbol(f"xi{i}") for i, u in enumerate(self.u) if u in used}

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
        c = self.coefficient_names
        return {"x": self.x, "w": self.w, "mu": self.mu, "k": self._k, "c": c}

    @property
    def coefficient_names(self) -> list[str]:
        """The coefficients that have been asked for so far."""
        return [f"c{i}" for i in range(len(self.coefficients.values))]

    @cached_property
    def _k(self) -> list[Any]:
        return [sympy.Symbol(f"k{i}", real=True) for i in range(len(self.carried))]

    def _points(self, *uses: Any, known: Any = ()) -> list[tuple[Any, Any]]:
        """The points (and other atoms) that the expressions use, but for those that are known."""
        found = inlined(self.scheme.at_points.definitions(*uses, known=known))
        return [(list(d.letters), [self._hoist(e) for e in d.values]) for d in found]

    def _with_k(self, entries: Any) -> list[Any]:
        at_x = {a: k for (a, _), k in zip(self.carried, self._k, strict=True)}
        return [self._hoist(e.xreplace(at_x)) for e in entries]

    def _solver(self) -> str:
        """`correct`, one Newton correction; `direct`, the solution itself, if F⁻ is affine."""
        scheme = self.scheme
        system, jacobian = self._over_h(scheme.at_points.system), self.jacobian
        if self.affine:
            zero = dict.fromkeys(self.w, 0)
            system = scheme.written_out(system).xreplace(zero)
            jacobian = scheme.written_out(jacobian).xreplace(zero)
        wanted = [*self.mu, *[0] * len(scheme.s.stages)]
        residual = sympy.Matrix(wanted) - system
        pivots = pivot_rows(scheme, self.jacobian)
        dw, steps = solve(jacobian, residual, self.coefficients, pivots)
        entries = [(s, type(values)(self._with_k(values))) for s, values in steps]
        points = [] if self.affine else self._points(jacobian, residual)
        before = [*points, *entries]
        if not self.affine:
            before = [*self._define_xi, *before]
        if scheme.element is not None:
            dw = self._along_group(dw, before)
        names = self._with_k(dw)
        results: list[Any] = [names]
        if not self.affine:
            results.append(sum(_absolute(e) for e in names))
        arguments = self._arguments()
        if self.affine:
            del arguments["w"]
        name = "direct" if self.affine else "correct"
        return function_text(name, arguments, results, before)

    def _along_group(self, c: Any, before: list[Any]) -> Any:
        """dw with τ(h(w + dw)) = τ(hc) τ(hw): the correction c of g, followed in the group.

        Newton in the chart alone goes astray near its edge (Moser–Veselov, rotations spread over
        the group, from the last step: it finds 55 of 100 steps; followed in the group 99).
        """
        groupoid = self.scheme.scene.groupoid
        if not groupoid.tau.has_translates:
            raise BadInput(
                f"{self.scheme.scene.name}: a discrete Lagrangian given on the group runs in "
                "Cayley's chart and its translates; write retraction=cayley."
            )
        letters = self.scheme.s.vector("c_of_g", len(c))
        before.append((list(letters), self._with_k(c)))
        product = groupoid.product(self.x, letters, self.w, self.scheme.h)
        return product - self.w

    def _update(self) -> str:
        """`update`: what x and μ grow by, less what the sums before lost (ex, emu), and the new k.

        The loss is taken off in here, where the compiler may choose the order: it is tiny, and off
        the longest path it costs nothing.
        """
        scheme = self.scheme
        gain = self._over_h(scheme.at_points.gain)
        increment = scheme.at_points.increment
        dx = [self._hoist(e) for e in increment]
        d_symbols = scheme.s.vector("d", len(self.x))
        at_end = [b for _, b in self.carried]
        before = self._define_xi
        if len(self.x):
            before.append((list(d_symbols), dx))
        inner = self._points(gain, increment, known=scheme.y)  # it is known from the increment
        used = [*gain, *at_end, *(e for _, values in inner for e in values)]
        if any(set(scheme.y) & e.free_symbols for e in used):
            before.append((list(scheme.y), list(self.x + d_symbols)))
        before += inner
        before.append(
            ([f"n{i}" for i in range(len(at_end))], [self.coefficients.hoist(b) for b in at_end])
        )
        swap = {b: _symbol(f"n{i}") for i, b in enumerate(at_end)}
        dmu = self._with_k([e.xreplace(swap) for e in gain])
        ex, emu = (scheme.s.vector(name, len(v)) for name, v in (("ex", self.x), ("emu", self.u)))
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
    return sympy.Symbol(name, real=True)


def _absolute(e: Any) -> Any:
    return sympy.Abs(e, evaluate=False)


def solver_text(affine: bool) -> list[str]:
    """The driver's `solve` and what it calls, with the decorators that their host defines."""
    solve: Any = driver.solve_direct if affine else driver.solve_newton
    aside: list[Any] = [] if affine else [driver.best_order, driver.judge]
    forget = "def forget(memo):\n    return memo\n" if affine else inspect.getsource(driver.forget)
    text = inspect.getsource(solve).replace(f"def {solve.__name__}(", "def solve(")
    sides = [f"@aside\n{inspect.getsource(f)}" for f in aside]
    return [*sides, f"@helper\n{forget}", f"@unfolded\n{text}"]
