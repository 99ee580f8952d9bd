"""The text of a system's kernels: straight-line Python for machine code and for any precision.

`prepare(q) → c`, `solver(x, w, μ, k, c) → (dw, size)` (if the rows are affine in w, it takes no w
and returns the solution itself), `update(x, w, μ, k, ex, eμ, c) → (dx, dμ, k)`, `carry(x, c) → k`,
and `extents` and `branch` if there is an edge. The step h and the parameters are symbols (the
vector q), so nothing is generated or compiled again for another step. k are costly functions of x
alone (sin x, 1/r³) that the next step needs again: they are computed once, at the end of a step.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterable, Sequence
from functools import cached_property
from inspect import getsource
from pathlib import Path
from typing import Any

from ..numbers import (
    Coefficients,
    Node,
    NodeMatrix,
    Operations,
    Value,
    called_text,
    coefficients_text,
    over,
    steepness,
    sympy,
    text_of,
    with_arguments,
    with_tables,
)
from ..numbers.types import Letters, Namespace
from .elimination import solve
from .layout import Layout
from .omissions import carried, has_pivots, is_affine, pivot_rows
from .row_rounding import bounds
from .step import Step

LONGEST = 1000  # a lattice's function with more operations is called instead of written in
CAREFUL = "careful"  # in `omit`: nothing is saved where a step has failed
SHORTEST = 40  # least number of operations of a function for which a call costs less than it saves


def module_text(step: Step, omit: frozenset[str] = frozenset()) -> str:
    """Return the text of all kernels of a step (and of its adjoint), and of the driver."""
    kinds = [step] if step.adjoint is None else [step, step.adjoint]
    kernels = [KernelText(s, suffix, omit) for s, suffix in zip(kinds, ("", "_of_adjoint"))]  # noqa: B905
    texts = [k.text for k in kernels]
    mixed = len(kernels) > 1
    apart = mixed and len({str(k.carried) for k in kernels}) > 1
    layout = Layout(
        n=len(step.x), m=len(step.u), solved=len(step.w),
        reused=0 if apart else len(kernels[0].carried),
        width=max(len(k.coefficients.values) for k in kernels),
        iterated=not all(k.affine for k in kernels), multipliers=step.multipliers,
    )  # fmt: skip
    facts = [
        f"LAYOUT = {layout}",
        "WIDTHS = dict(coefficients=LAYOUT.width, xs=LAYOUT.n, us=LAYOUT.row_width, mus=LAYOUT.m)",
        f"FAINT = 64 * EPS{' * EPS' if {'slope', 'impulse'} & {*step.kinds} else ''}",
        f"ALONE, SINGLE, MIXED, APART = True, {not step.composed}, {mixed}, {apart}",
        f"CAREFUL = {CAREFUL in omit}",
        *(f"{name} = {k.record}" for name, k in zip(("RULE", "ADJOINT"), kernels)),  # noqa: B905
        f"SYSTEMS = RULE,{' ADJOINT' if mixed else ''}",
    ]
    parts = [f"# {step.name}", *texts, "\n".join(facts), driver_text()]
    return with_tables("\n\n".join(parts))


def driver_text() -> str:
    """Return the driver's text, which is part of every module."""
    return texts_of("driver", "edge_watch", "newton_iteration", "tuple_operations")


def texts_of(*names: str | Path) -> str:
    """Return the text of files, and of the rule by which loops end.

    names: of files of this room, or their paths, without the ending.

    What the files import, their decorators, is known wherever the text is run.
    """
    files = (Path(__file__).parent / f"{name}.py" for name in names)
    texts = [getsource(over), getsource(steepness), *(f.read_text(encoding="utf-8") for f in files)]
    return re.sub(r"^from \..*\n", "", "\n\n".join(texts), flags=re.MULTILINE)


def with_names(text: str, own: Letters) -> str:
    """Return the text with identifiers in place of letters like p.h, a site's own parameter h."""
    for i, letter in enumerate(map(str, own)):
        if not letter.isidentifier():
            text = re.sub(rf"\b{re.escape(letter)}\b", f"pp{i}", text)
    return text


class KernelText:
    """Writes the kernels of a step, or of one term of a lattice's.

    omit: names of `omissions.SAVINGS` that are not made, so that their gain can be measured, and
    CAREFUL if every elimination exchanges rows and each row has a bound of its round-off.
    coefficients: those of several steps together. parts: the names of the kernels that are written,
    or () for those of a scene. own: the letters of a lattice's site or bond beside the coefficients
    that all share, or None for a scene.
    """

    def __init__(
        self,
        step: Step,
        suffix: str = "",
        omit: Iterable[str] = (),
        coefficients: Coefficients | None = None,
        parts: Sequence[str] = (),
        own: Letters | None = None,
    ) -> None:
        self.step, self.suffix, self.omit = step, suffix, frozenset(omit)
        edge = ["edge"] if step.extents else []
        rounding = ["rounding"] if CAREFUL in self.omit and not self.affine else []
        every = *edge, *rounding, "solver", "update", "carry", "prepare"
        self.parts, self.own = parts or every, own
        self.coefficients = coefficients or Coefficients(
            step.q, step.graph, plain="coefficients" in self.omit
        )
        #: of the functions that kernels call: (name, what it uses of its caller, text)
        self._functions: dict[Hashable, tuple[str, dict[str, Node | None], str]] = {}
        self._calls: dict[str, int] = {}

    @cached_property
    def affine(self) -> bool:
        """True if one correction from w = 0, where the rows must be finite, solves a step."""
        return "direct" not in self.omit and is_affine(self.step)

    @cached_property
    def carried(self) -> list[tuple[Node, Node]]:
        """The functions of x that are handed on to the next step: [(at x, at y)]."""
        return [] if "carried" in self.omit else carried(self.step)

    @cached_property
    def text(self) -> str:
        """The text of all functions; their decorators say how they are written (`run_text`)."""
        kernels = [getattr(self, f"_{part}")() for part in self.parts]
        shared = [
            self._marked(text, self._calls[name]) for name, _, text in self._functions.values()
        ]
        return "\n\n".join([*shared, *kernels])

    def _marked(self, text: str, calls: int = 1) -> str:
        """Return a function's text with the decorator that says how it is written.

        A kernel of a lattice's term is used up to four times.
        """
        count = operations(text)
        often = calls > 1 and count >= SHORTEST if self.own is None else count > LONGEST
        return with_names(f"@{'node' if often else 'kernel'}\n{text}", self.own or ())

    @property
    def record(self) -> str:
        """The record of this step that the driver is given, as text."""
        step = self.step
        names = ["solver", "update", "carry", "prepare"]
        names += ["rounding", "correction"] if "rounding" in self.parts else []
        names += ["extents"] if step.extents else []
        names += ["branch"] if step.branch is not None else []
        facts = {"affine": self.affine, "watched": bool(step.extents),
                 "branched": step.branch is not None,
                 "width": len(self.coefficients.values)}  # fmt: skip
        entries = {name: f"{name}{self.suffix}" for name in names} | facts
        return f"Record({', '.join(f'{k}={v}' for k, v in entries.items())})"

    def _operations(self, inside: object = None) -> Operations:
        return Operations(self.step.graph, self.coefficients, self._called, inside)

    def _scale(self, operations: Operations) -> None:
        """Write u as ξ/h, ξ = hu, for those u on which the chart depends.

        Written in ξ their coefficients are the chart's own (1, 1/2, 1/4), exact in binary, so that
        rounding does not turn a rotation into a slow spiral: if h²/4 is rounded separately from h,
        |Γ|² drifts linearly (Lagrange top, 10⁶ steps: 2e-12; in ξ: 1e-14).
        """
        h, *scaled = self.step.graph.letters((self.step.q[0], *self.step.scaled))
        for u in scaled:
            operations.scale(u, h)

    def _called(
        self, caller: Operations, function: Any, places: Sequence[int]
    ) -> tuple[str, dict[str, Node | None]]:
        """Return the name of a function and what it uses of its caller; write its text once."""
        key = function, tuple(places)
        if key not in self._functions:
            name = f"{function.name}_{len(self._functions)}{self.suffix}"
            operations = self._operations(function.scope)
            for e in function.arguments:
                operations.name(e, str(e))
            results = operations.values([function.results[i] for i in places])
            text, more = called_text(name, function.arguments, operations, results)
            self._functions[key] = name, more, text
        name, more, _ = self._functions[key]
        self._calls[name] = self._calls.get(name, 0) + 1
        return name, more

    def _function(
        self,
        name: str,
        arguments: Namespace,
        operations: Operations,
        results: Sequence[Sequence[Value] | Value],
    ) -> str:
        letters = arguments if self.own is None else {**arguments, "own": self.own}
        return self._marked(text_of(f"{name}{self.suffix}", letters, operations, results))

    def _start(self, arguments: Namespace) -> Operations:
        """Return operations whose letters of the arguments stand for themselves."""
        operations = self._operations()
        with_arguments(operations, arguments)
        self._scale(operations)
        if "k" in arguments:
            for i, (at_x, _) in enumerate(self.carried):
                operations.name(at_x, f"k{i}")
        return operations

    @cached_property
    def _k(self) -> list[str]:
        return [f"k{i}" for i in range(len(self.carried))]

    def _prepare(self) -> str:
        return coefficients_text(f"prepare{self.suffix}", self.coefficients)

    def _equations(self) -> str:
        """Return the text of a term's rows and of their slope, by rows."""
        arguments = {"x": self.step.x, "w": self.step.w, "c": self.coefficients}
        operations = self._start(arguments)
        values = operations.values(self.step.system)
        m = len(self.step.rows)
        return self._function("equations", arguments, operations, [values[:m], values[m:]])

    def _gain(self) -> str:
        """Return the text of the increments of μ at both ends of a bond."""
        arguments = {"x": self.step.x, "w": self.step.w, "c": self.coefficients}
        operations = self._start(arguments)
        gain = self._at_end(operations, self.step.gain)
        return self._function("gain", arguments, operations, [gain])

    def _carry(self) -> str:
        arguments = {"x": self.step.x, "c": self.coefficients}
        operations = self._start(arguments)
        values = operations.values([a for a, _ in self.carried])
        return self._function("carry", arguments, operations, [values])

    def _edge(self) -> str:
        """Return the text of `extents`, (sizes, rests) of a step, and of `branch`."""
        step = self.step
        kinds = [[e for kind, e in step.extents if kind == wanted] for wanted in ("size", "rest")]
        wanted = {"extents": kinds}
        if step.branch is not None:
            wanted["branch"] = [[step.branch]]
        texts = []
        for name, columns in wanted.items():
            arguments = {"x": step.x, "w": step.w, "c": self.coefficients}
            operations = self._start(arguments)
            entries = (e for column in columns for e in column)
            queue = iter(operations.values([*entries]))
            results = [[next(queue) for _ in column] for column in columns]
            texts.append(self._function(name, arguments, operations, results))
        return "\n\n".join(texts)

    @cached_property
    def _residual(self) -> tuple[list[Node], NodeMatrix]:
        """What is wanted less the rows, and the slope of the rows; at w = 0 if they are affine."""
        step, graph, m = self.step, self.step.graph, len(self.step.w)
        entries = step.system
        if self.affine:
            zero = dict.fromkeys((e.index for e in graph.letters(step.w)), graph.number(0))
            entries = graph.rebuilt(entries, zero)
        slope = [entries[i : i + m] for i in range(m, m + m * m, m)]
        return [a - b for a, b in zip(step.wanted, entries[:m], strict=True)], slope

    def _solver(self) -> str:
        """Return the text of one Newton correction, or of the solution if rows are affine in w."""
        arguments = {"x": self.step.x, "w": self.step.w, "mu": self.step.mu, "k": self._k,
                     "c": self.coefficients}  # fmt: skip
        if self.affine:
            del arguments["w"]
        return self._corrected("solver", arguments, self._residual[0])

    def _corrected(self, name: str, arguments: Namespace, residual: Sequence[Node]) -> str:
        step = self.step
        # further corrections repair the effect of small pivots, but an affine step has only one
        exchange = self.affine or CAREFUL in self.omit or not has_pivots(step)
        slope, order = self._residual[1], pivot_rows(step)
        dw, _ = solve(step.graph, slope, residual, self.coefficients, order, exchange)
        operations = self._start(arguments)
        values = operations.values(dw)
        if step.along is not None:
            letters, along = step.along
            operations.give(step.graph.letters(letters), values)
            values = operations.values(along)
        results: list[Sequence[Value] | Value] = [values]
        if not self.affine:
            results.append(operations.sum([operations.function("abs", e & ~1) for e in values]))
        return self._function(name, arguments, operations, results)

    def _rounding(self) -> str:
        """Return the text of the residual with bounds of its round-off, and of its correction."""
        step, graph = self.step, self.step.graph
        arguments = {"x": step.x, "w": step.w, "mu": step.mu, "c": self.coefficients}
        rows = self._residual[0]
        operations = self._start(arguments)
        values = operations.values([*rows, *bounds(graph, rows)])
        columns = [values[: len(rows)], values[len(rows) :]]
        text = self._function("rounding", arguments, operations, columns)
        letters = sympy.symbols(f"residual_0:{len(rows)}", real=True)
        given = {"x": step.x, "w": step.w, "mu": step.mu, "r": letters, "c": self.coefficients}
        return f"{text}\n\n{self._corrected('correction', given, graph.letters(letters))}"

    def _update(self) -> str:
        """Return the text of the increments of x and μ and of the new k.

        The rounding errors of earlier sums (ex, emu) are subtracted here, where the compiler may
        choose the order: they are tiny, and off the longest path this costs nothing.
        """
        step = self.step
        lost = {"ex": [f"ex_{i}" for i in range(len(step.x))],
                "emu": [f"emu_{i}" for i in range(len(step.u))]}  # fmt: skip
        arguments = {"x": step.x, "w": step.w, "mu": step.mu, "k": self._k, **lost,
                     "c": self.coefficients}  # fmt: skip
        operations = self._start(arguments)
        at_end = self._at_end(operations, [*step.gain, *(b for _, b in self.carried)])
        d = operations.values(step.increment)
        dmu, new_k = at_end[: len(step.gain)], at_end[len(step.gain) :]
        grown = [[operations.sum([a, operations.leaf(e) + 1])
                  for a, e in zip(column, names, strict=True)]
                 for column, names in ((d, lost["ex"]), (dmu, lost["emu"]))]  # fmt: skip
        return self._function("update", arguments, operations, [*grown, new_k])

    def _at_end(self, operations: Operations, uses: Sequence[Node]) -> list[Value]:
        """Return values that may contain y, which is x + (increment)."""
        x, y = map(self.step.graph.letters, (self.step.x, self.step.y))
        d = operations.values(self.step.increment)
        ends = [operations.sum(pair) for pair in zip(operations.values(x), d, strict=True)]
        operations.give(y, ends)
        return operations.values(uses)


def operations(text: str) -> int:
    """Return the number of arithmetic operations in a text."""
    return sum(map(text.count, "+-*/"))
