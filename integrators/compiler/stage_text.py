"""The text of a collocation step: kernels with a stage in each lane, and their driver.

In lanes: `velocity(x, w, p, c) → (ẇ, ξ, μ)` and `force(x, w, p, ξ, c) → (π̇, f)`.
In plain numbers, for the ends of a step: `shift(x, w, p, dp, turn, lost, c) → change of π₀ − μ`,
`update(x, w, p, dp, turn, ex, eμ, c) → (dx, dμ)` and `extents(x, w, c)`.
In lanes, for the start of the iteration: `moved(x, w, ξ, c) → L ξ` and `pulled(x, w, μ, c) → L⁻ᵀ
μ`. The first coefficient is h.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cached_property
from typing import Any

from ..numbers import Coefficients, function_text, symbols_of, sympy, with_tables
from ..numbers.types import Assignment, Expression, Expressions, Letter
from .elimination import Equations, solve
from .layout import StageLayout
from .module_text import texts_of
from .stage_system import StageSystem


class NoShortForm(Exception):
    """A linear system needs a loop over rows, which lanes do not have."""


def stage_text(system: StageSystem) -> str:
    """Return the text of all kernels of a collocation step, and of its driver."""
    kernels = StageText(system)
    text = kernels.text  # `text` finds the coefficients, so it must come first
    layout = StageLayout(n=len(system.x), m=len(system.w), solved=len(system.w), reused=0,
                         width=len(kernels.coefficients.values), iterated=True,
                         count=system.count)  # fmt: skip
    facts = [
        f"LAYOUT = {layout}",
        f"COUNT, PARTS = {system.count}, -(-{system.count} // WIDTH)",
        # machine code holds the numbers of the nodes, and is stored under the digest of this text
        f"NODES = '{system.nodes.family}'",
        f"RULE = {kernels.record}",
        "SYSTEMS = RULE,",
        "NOISE, SMALLEST = ROOT_EPS / 16, R(1) / 4",
    ]
    parts = [f"# {system.name}", text, "\n".join(facts), collocation_driver("stage_driver")]
    return with_tables("\n\n".join(parts))


def collocation_driver(name: str) -> str:
    """Return the text of a driver of collocation and of the functions it calls."""
    driver = texts_of(name, "node_sums", "component_sizes", "edge_watch", "tuple_operations")
    for function, kind in (("at_nodes", "ordered"), ("balanced", "ordered"), ("times", "kernel")):
        driver = driver.replace(f"def {function}(", f"@{kind}\ndef {function}(")
    return driver


class StageText:
    """Writes the kernels of a collocation step.

    Raises `NoShortForm` if the mass matrix is too large to be eliminated in lanes.
    """

    def __init__(self, system: StageSystem) -> None:
        self.system = system
        self.coefficients = Coefficients(system.q)
        self.coefficients.symbol(system.q[0])

    def _function(
        self,
        name: str,
        arguments: dict[str, Any],
        results: Sequence[Expressions],
        before: list[Assignment],
    ) -> str:
        given = {**arguments, "c": self.coefficients}
        return f"@kernel\n{function_text(name, given, results, before, self.coefficients)}"

    @cached_property
    def turning(self) -> list[int]:
        """Indices at which f is neither 0 nor equal to the entry of π̇."""
        force, pairs = (
            self.system.turned,
            zip(self.system.turned, self.system.rates[1], strict=True),
        )
        return [i for i, (f, p) in enumerate(pairs) if f != p and force[i] != 0]

    @cached_property
    def shifted(self) -> bool:
        """True if π₀ may differ from μ: if R is not 1, or f not π̇."""
        return self.system.right_field != sympy.eye(len(self.system.w)) or bool(self.turning)

    @cached_property
    def text(self) -> str:
        """The text of all functions."""
        functions = [*self.kernels.values(), self.coefficients.text("prepare")]
        return "\n\n".join([*functions, "def carry(x, c):\n    return ()\n"])

    @property
    def kernels(self) -> dict[str, str]:
        """Name → text of the functions that the driver calls."""
        system = self.system
        kernels = {"velocity": self._velocity(), "force": self._force(), "update": self._update()}
        if self.shifted:
            kernels["shift"] = self._shift()
        if system.moved is not None and system.pulled is not None:
            for name, letters, values in (("moved", system.xi, system.moved),
                                          ("pulled", system.m, system.pulled)):  # fmt: skip
                given = {"x": system.x, "w": system.w, "given": letters}
                kernels[name] = self._function(name, given, [values], [])
        if system.extents:
            kinds = [[e for kind, e in system.extents if kind == wanted]
                     for wanted in ("size", "rest")]  # fmt: skip
            given = {"x": system.x, "w": system.w}
            kernels["extents"] = self._function("extents", given, list(kinds), [])
        return kernels

    @property
    def record(self) -> str:
        """The record that the driver is given, as text."""
        system = self.system
        names = [*re.findall(r"^def (\w+)", self.text, re.MULTILINE)]
        facts = {"affine": False, "watched": bool(system.extents), "branched": False,
                 "shifted": self.shifted, "turning": len(self.turning),
                 "rotating": system.moved is not None,
                 "width": len(self.coefficients.values)}  # fmt: skip
        entries = {name: name for name in names} | facts
        return f"Record({', '.join(f'{k}={v}' for k, v in entries.items())})"

    # -- the kernels ----------------------------------------------------------------------------

    def _velocity(self) -> str:
        """Return the text of ẇ, ξ and μ at (w, π)."""
        system = self.system
        before = list(system.before)
        order = list(range(len(system.w)))
        xi, steps = solve(system.mass, system.right, self.coefficients, order)
        for letters, values in steps:
            if isinstance(values, Equations):
                raise NoShortForm("the mass matrix ties many velocities together")
            before.append((letters, values))
        before.append((list(system.xi), list(xi)))
        results = [system.rates[0], list(system.xi), list(system.m)]
        given = {"x": system.x, "w": system.w, "p": system.p}
        return self._function("velocity", given, results, _used(before, results))

    def _force(self) -> str:
        """Return the text of π̇, and of the entries `turning` of f, at (w, π) and ξ."""
        system = self.system
        before = [*system.before, *system.after]
        turned = [system.turned[i] for i in self.turning]
        results = [system.rates[1], turned]
        given = {"x": system.x, "w": system.w, "p": system.p, "xi": system.xi}
        return self._function("force", given, results, _used(before, results))

    @property
    def _turns(self) -> dict[Letter, Expression]:
        """Σ h b_i f_i of each component: the sum of π̇, a sum of its own, or 0."""
        system = self.system
        own: dict[int, Letter] = {i: system.turn[k] for k, i in enumerate(self.turning)}
        return {
            t: own.get(i, sympy.Integer(0) if system.turned[i] == 0 else system.dp[i])
            for i, t in enumerate(system.turn)
        }

    @property
    def _ends(self) -> dict[str, Any]:
        system = self.system
        return {"x": system.x, "w": system.w, "p": system.p, "dp": system.dp,
                "turn": system.turn[: len(self.turning)]}  # fmt: skip

    def _shift(self) -> str:
        """Return the text of R₁⁻ᵀ(μ + Σhbf − R₁ᵀπ₁), without cancelling terms; lost is π₀ − μ."""
        system = self.system
        lost = [sympy.Symbol(f"lo0_{i}", real=True) for i in range(len(system.w))]
        slope = system.right_field.T
        p, own = sympy.Matrix(list(system.p)), self._turns.values()
        excess = (slope - sympy.eye(len(lost))) * p
        right = sympy.Matrix([
            turn - dp - d - e
            for turn, dp, d, e in zip(own, system.dp, lost, excess, strict=True)
        ])  # fmt: skip
        change, steps = solve(slope, right, self.coefficients, list(range(len(lost))))
        if any(isinstance(values, Equations) for _, values in steps):
            raise NoShortForm("R ties many directions together")
        return self._function("shift", {**self._ends, "lost": lost}, [change], steps)  # fmt: skip

    def _update(self) -> str:
        """Return the text of increments of x and μ, less the rounding errors of earlier sums."""
        system = self.system
        ex, emu = ([sympy.Symbol(f"{name}_{i}", real=True) for i in range(count)]
                   for name, count in (("ex", len(system.x)), ("emu", len(system.w))))  # fmt: skip
        gain = system.gain.xreplace(self._turns)
        grown = [[a - e for a, e in zip(column, lost, strict=True)]
                 for column, lost in ((system.increment, ex), (gain, emu))]  # fmt: skip
        return self._function("update", {**self._ends, "ex": ex, "emu": emu}, grown, [])


def _used(before: list[Assignment], results: Sequence[Expressions]) -> list[Assignment]:
    """Return the definitions that the results use, directly or through others."""
    wanted = symbols_of(e for column in results for e in column)
    kept: list[Assignment] = []
    for letters, values in reversed(before):
        if wanted & set(letters):
            kept.insert(0, (letters, values))
            wanted |= symbols_of(values)
    return kept
