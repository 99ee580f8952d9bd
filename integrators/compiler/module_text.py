"""The text of a system's kernels: straight-line Python for machine code and for any precision.

`prepare(q) → c`, `solver(x, w, μ, k, c) → (dw, size)` (if the rows are affine in w, it takes no w
and returns the solution itself), `update(x, w, μ, k, ex, eμ, c) → (dx, dμ, k)`, `carry(x, c) → k`,
and `extents` and `branch` if there is an edge. The step h and the parameters are symbols (the
vector q), so nothing is generated or compiled again for another step. k are costly functions of x
alone (sin x, 1/r³) that the next step needs again: they are computed once, at the end of a step.
"""

from __future__ import annotations

from collections.abc import Iterable, Sized
from functools import cached_property
from pathlib import Path
from typing import Any

from ..numbers import (
    Call,
    Coefficients,
    Definition,
    Function,
    Parameters,
    called_text,
    function_text,
    needed,
    symbols_of,
    sympy,
    with_tables,
    written_out,
)
from ..numbers.types import (
    Assignment,
    Column,
    Expression,
    Expressions,
    Letter,
    Replacement,
    SymbolicMatrix,
)
from .elimination import solve
from .layout import Layout
from .omissions import carried, has_pivots, is_affine, pivot_rows
from .step import Step

SHORTEST = 40  # least number of operations of a function for which a call costs less than it saves
#: long functions of the driver that are called instead of written in, with their decorators
CALLED = {"best_order": "aside", "eliminate": "node"}


def module_text(system: Step, omit: frozenset[str] = frozenset()) -> str:
    """Return the text of all kernels of a system (and of its adjoint), and of the driver."""
    kinds = [system] if system.adjoint is None else [system, system.adjoint]
    kernels = [KernelText(s, suffix, omit) for s, suffix in zip(kinds, ("", "_of_adjoint"))]  # noqa: B905
    texts = [k.text for k in kernels]
    mixed = len(kernels) > 1
    apart = mixed and kernels[0].carried != kernels[1].carried
    layout = Layout(
        n=len(system.x), m=len(system.u), solved=len(system.w),
        reused=0 if apart else len(kernels[0].carried),
        width=max(len(k.coefficients.values) for k in kernels),
        iterated=not all(k.affine for k in kernels), multipliers=system.multipliers,
    )  # fmt: skip
    facts = [
        f"LAYOUT = {layout}",
        f"FAINT = 64 * EPS{' * EPS' if {'slope', 'impulse'} & {*system.kinds} else ''}",
        f"SINGLE, MIXED, APART = {not system.composed}, {mixed}, {apart}",
        *(f"{name} = {k.record}" for name, k in zip(("RULE", "ADJOINT"), kernels)),  # noqa: B905
        f"SYSTEMS = RULE,{' ADJOINT' if mixed else ''}",
    ]
    parts = [f"# {system.name}", *texts, "\n".join(facts), driver_text()]
    return with_tables("\n\n".join(parts))


def driver_text() -> str:
    """Return the driver's text, which is part of every module."""
    text = texts_of("driver", "edge_watch", "newton_iteration", "tuple_operations")
    for name, kind in CALLED.items():
        text = text.replace(f"def {name}(", f"@{kind}\ndef {name}(")
    return text


def texts_of(*names: str) -> str:
    """Return the text of the named files of this room."""
    files = (Path(__file__).with_name(f"{name}.py") for name in names)
    return "\n\n".join(file.read_text(encoding="utf-8") for file in files)


class KernelText:
    """Derives the kernels' expressions from a system and writes their text.

    omit: names of `omissions.SAVINGS` that are not made, so that their gain can be measured, and
    "order" if every elimination exchanges rows.
    """

    def __init__(self, system: Step, suffix: str = "", omit: Iterable[str] = ()) -> None:
        self.system, self.suffix, self.omit = system, suffix, frozenset(omit)
        plain = "coefficients" in self.omit
        self.coefficients = (Parameters if plain else Coefficients)(system.q)
        self.h = system.q[0]
        self._functions: dict[Function, tuple[str, list[Letter], str]] = {}
        self._calls: dict[str, int] = {}

    @cached_property
    def affine(self) -> bool:
        """True if one correction from w = 0, where the rows must be finite, solves a step."""
        if "direct" in self.omit or not is_affine(self.system):
            return False
        return not any(e.has(sympy.nan, sympy.zoo) for part in self._at_zero for e in part)

    @cached_property
    def _at_zero(self) -> tuple[Column, SymbolicMatrix]:
        """The rows and their slope at w = 0; definitions' letters stay only in explicit rows."""
        system, zero = self.system, dict.fromkeys(self.system.w, 0)
        known = () if system.explicit else system.definitions
        rows, slope = (written_out(known, m).xreplace(zero) for m in (system.rows, system.slope))
        return rows, slope

    @cached_property
    def carried(self) -> list[tuple[Expression, Expression]]:
        """The functions of x that are handed on to the next step: [(at x, at y)]."""
        return [] if "carried" in self.omit else carried(self.system)

    @cached_property
    def text(self) -> str:
        """The text of all functions; their decorators say how they are written (`run_text`)."""
        system = self.system
        kernels = [self._edge()] if system.extents else []
        kernels += [self._solver(), self._update()]
        values = [a for a, _ in self.carried]
        kernels.append(self._function("carry", {"x": system.x, "c": self.coefficients}, [values]))
        prepare = self.coefficients.text(f"prepare{self.suffix}")
        shared = [
            f"@{'node' if self._calls[name] > 1 and operations(text) >= SHORTEST else 'kernel'}\n"
            f"{text}"
            for name, _, text in self._functions.values()
        ]
        return "\n\n".join([*shared, *kernels, prepare])

    @property
    def record(self) -> str:
        """The record of this system that the driver is given, as text."""
        names = ["solver", "update", "carry", "prepare"]
        names += ["extents"] if self.system.extents else []
        names += ["branch"] if self.system.branch is not None else []
        facts = {"affine": self.affine, "watched": bool(self.system.extents),
                 "branched": self.system.branch is not None,
                 "width": len(self.coefficients.values)}  # fmt: skip
        entries = {name: f"{name}{self.suffix}" for name in names} | facts
        return f"Record({', '.join(f'{k}={v}' for k, v in entries.items())})"

    # -- numbers that stay consistent ------------------------------------------------------------

    @cached_property
    def _xi(self) -> Replacement:
        """u ↦ ξ = hu, for those u on which the chart depends.

        Written in ξ their coefficients are the chart's own (1, 1/2, 1/4), exact in binary, so that
        rounding does not turn a rotation into a slow spiral: if h²/4 is rounded separately from h,
        |Γ|² drifts linearly (Lagrange top, 10⁶ steps: 2e-12; in ξ: 1e-14).
        """
        xi = zip(self.system.u, _symbols("xi", self.system.u), strict=True)
        return {u: letter for u, letter in xi if u in self.system.scaled}

    @property
    def _define_xi(self) -> list[Assignment]:
        plain = [sympy.Symbol(str(u)) for u in self._xi]  # plain symbols are not read as ξ/h
        return [(list(self._xi.values()), [self.h * u for u in plain])]

    # -- the kernels ----------------------------------------------------------------------------

    @cached_property
    def _reading(self) -> Coefficients:
        return self.coefficients.with_increments(self._xi)

    def _function(self, name: str, arguments: Any, results: Any, before: Any = ()) -> str:
        text = function_text(f"{name}{self.suffix}", arguments, results, before, self._reading)
        return f"@kernel\n{text}"

    @cached_property
    def _k(self) -> list[Letter]:
        return _symbols("k", self.carried)

    def _with_k(self, entries: Expressions) -> list[Expression]:
        at_x = {a: k for (a, _), k in zip(self.carried, self._k, strict=True)}
        return [e.xreplace(at_x) for e in entries]

    def _written(self, definitions: Iterable[Definition]) -> list[Assignment]:
        """Return (letters, values) of definitions, some of which are calls."""
        pairs: list[Assignment] = []
        for d in definitions:
            if d.function is None:
                pairs.append((list(d.letters), list(d.values)))
            else:
                name, shared = self._called(d.function)
                pairs.append((list(d.letters), Call(name, [*d.arguments, *shared])))
        return pairs

    def _called(self, function: Function) -> tuple[str, list[Letter]]:
        """Return a function's name and the caller's letters it uses; write its text once."""
        if function not in self._functions:
            name = f"{function.name}_{len(self._functions)}{self.suffix}"
            before = self._written(function.definitions)
            text, shared = called_text(
                name, function.arguments, function.results, before, self._reading
            )
            self._functions[function] = name, shared, text
        name, shared, _ = self._functions[function]
        self._calls[name] = self._calls.get(name, 0) + 1
        return name, shared

    def _edge(self) -> str:
        """Return the text of `extents`, (sizes, rests) of a step, and of `branch`."""
        system = self.system
        kinds = [[e for kind, e in system.extents if kind == wanted] for wanted in ("size", "rest")]
        wanted = {"extents": kinds}
        if system.branch is not None:
            wanted["branch"] = [[system.branch]]
        texts = []
        for name, results in wanted.items():
            uses = [e for column in results for e in column]
            before = [*self._define_xi, *self._written(needed(system.definitions, uses))]
            arguments = {"x": system.x, "w": system.w, "c": self.coefficients}
            texts.append(self._function(name, arguments, results, before))
        return "\n\n".join(texts)

    def _solver(self) -> str:
        """Return the text of one Newton correction, or of the solution if rows are affine in w."""
        system = self.system
        rows, slope = system.rows, system.slope
        if self.affine:
            rows, slope = self._at_zero
        wanted = system.wanted or [*system.mu, *[0] * (len(system.w) - len(system.mu))]
        residual = sympy.Matrix(wanted) - rows
        # further corrections repair the effect of small pivots, but an affine step has only one
        exchange = self.affine or "order" in self.omit or not has_pivots(system)
        dw, steps = solve(slope, residual, self.coefficients, pivot_rows(system), exchange)
        before = [(s, type(values)(self._with_k(values))) for s, values in steps]
        if not self.affine or system.explicit:
            inner = self._written(needed(system.definitions, [*slope, *residual]))
            before = [*self._define_xi, *inner, *before]
        if system.along is not None:
            letters, along = system.along
            before.append((list(letters), self._with_k(dw)))
            dw = along
        names = self._with_k(dw)
        results: list[Expressions | Expression] = [names]
        arguments = {
            "x": system.x,
            "w": system.w,
            "mu": system.mu,
            "k": self._k,
            "c": self.coefficients,
        }
        if self.affine:
            del arguments["w"]
        else:
            results.append(sum(sympy.Abs(e, evaluate=False) for e in names))
        return self._function("solver", arguments, results, before)

    def _update(self) -> str:
        """Return the text of the increments of x and μ and of the new k.

        The rounding errors of earlier sums (ex, emu) are subtracted here, where the compiler may
        choose the order: they are tiny, and off the longest path this costs nothing.
        """
        system = self.system
        d, new_k = _symbols("d_", system.x), _symbols("n", self.carried)
        at_end = [b for _, b in self.carried]
        before = [*self._define_xi, (d, list(system.increment))]
        uses = [*system.gain, *system.increment]
        inner = self._written(needed(system.definitions, uses, known=system.y))
        used = [*system.gain, *at_end, *(e for _, values in inner for e in values)]
        if symbols_of(used) & set(system.y):
            before.append((list(system.y), [x + e for x, e in zip(system.x, d, strict=True)]))
        before += [*inner, (new_k, at_end)]
        swap = dict(zip(at_end, new_k, strict=True))
        dmu = self._with_k([e.xreplace(swap) for e in system.gain])
        ex, emu = _symbols("ex_", system.x), _symbols("emu_", system.u)
        grown = [[a - e for a, e in zip(column, lost, strict=True)]
                 for column, lost in ((d, ex), (dmu, emu))]  # fmt: skip
        arguments = {"x": system.x, "w": system.w, "mu": system.mu, "k": self._k, "ex": ex,
                     "emu": emu, "c": self.coefficients}  # fmt: skip
        return self._function("update", arguments, [*grown, new_k], before)


def _symbols(letter: str, column: Sized) -> list[Letter]:
    return [sympy.Symbol(f"{letter}{i}", real=True) for i in range(len(column))]


def operations(text: str) -> int:
    """Return the number of arithmetic operations in a text."""
    return sum(map(text.count, "+-*/"))
