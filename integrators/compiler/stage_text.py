"""The text of a collocation step: kernels with a stage in each lane, and their driver.

In lanes: `velocity(x, w, p, own, c) → (ẇ, ξ, μ)` and `force(x, w, p, ξ, pull, own, c) → (π̇, f)`,
where `own` are a site's parameters and `pull` the force of its bonds, both () for a scene; of a
lattice `point(x, w, c) → z` of a node, and `pull(x of both ends, own, c) → force on both`.
In plain numbers, for the ends of a step: `shift(x, w, p, dp, turn, lost, c) → change of π₀ − μ`,
`update(x, w, p, dp, turn, ex, eμ, c) → (dx, dμ)` and `extents(x, w, c)`.
In lanes, for the start of the iteration: `moved(x, w, ξ, c) → L ξ` and `pulled(x, w, μ, c) → L⁻ᵀ
μ`. The first coefficient is h.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cached_property

from ..numbers import (
    Coefficients,
    Node,
    NodeMatrix,
    Nodes,
    coefficients_text,
    function_text,
    sympy,
    with_tables,
)
from ..numbers.statements import Arguments
from ..numbers.types import Letters
from .elimination import solve
from .layout import StageLayout
from .module_text import texts_of, with_names
from .stage_system import LatticeStages, StageSystem

UNSEEN = 16  # corrections of w below so many round-offs of x/h do not move x


class NoShortForm(Exception):
    """A linear system needs a loop over rows, which lanes do not have."""


def text_of_stages(system: StageSystem, lattice: LatticeStages | None = None) -> str:
    """Return the text of all kernels of a collocation step, and of its driver.

    system: the collocation of a scene, or of one site of the lattice.
    """
    kernels = StageText(system, lattice)
    text = kernels.text  # `text` finds the coefficients, so it must come first
    n, m = len(system.x), len(system.w)
    width = len(kernels.coefficients.values)
    layout = StageLayout(n=n, m=m, solved=m, reused=0, width=width, iterated=True,
                         count=system.count)  # fmt: skip
    most = lattice.most if lattice and lattice.most else "HUGE"
    widths = "xs=n, us=m, mus=m"
    if lattice:
        widths = ("x=n, nu=m, mu=m, p=SITES, q=BONDS, given=0, w1=MOMENTA, w2=MOMENTA, w3=m, "
                  f"w=m * {system.nodes.unknown}, work=WORK, ties=1")  # fmt: skip
    facts = [
        f"LAYOUT = {layout}",
        f"n, m, COUNT, PARTS = {n}, {m}, {system.count}, -(-{system.count} // WIDTH)",
        # machine code holds the numbers of the nodes, and is stored under the digest of this text
        f"NODES = '{system.nodes.family}'",
        f"AS_THEY_ARE = PYTHON and {lattice is None}",
        f"BONDED, TURNING = {lattice is not None}, {len(kernels.turning)}",
        f"SITES, BONDS = {len(kernels.own)}, {len(lattice.bond_own) if lattice else 0}",
        f"RULE = {kernels.record}",
        "SYSTEMS = RULE,",
        "MOMENTA = m * PARTS * WIDTH",
        "MOVES, GAINS, TURNS = 2 * MOMENTA, 3 * MOMENTA, 4 * MOMENTA",
        "PULL = TURNS + TURNING * PARTS * WIDTH",
        "POINT = PULL + MOMENTA",
        "SHIFT = POINT + n * PARTS * WIDTH if BONDED else PULL",
        "ENDS = SHIFT + m",
        "WORK = ENDS + 3 * m + TURNING",
        f"WIDTHS = dict({widths}, coefficients=RULE.width)",
        # a component has one size on the whole lattice, so smaller sites need more sweeps than a
        # scene: with 1/4 energy drifts (chain of 6, gauss-4, 2·10⁵ steps: 5.8e-13, Newton 4.9e-14)
        f"NOISE, SMALLEST = ROOT_EPS / 16, R(1) / {64 if lattice else 4}",
        f"UNSEEN, MOST_AT_START = {UNSEEN}, min(MOST_SWEEPS, {most})",
    ]
    driver = texts_of("lattice_stage_driver" if lattice else "stage_driver", "sweeps",
                      "component_sizes", "edge_watch", "tuple_operations")  # fmt: skip
    return with_tables("\n\n".join([f"# {system.name}", text, "\n".join(facts), driver]))


class StageText:
    """Writes the kernels of a collocation step, and of the force of a lattice's bond.

    Raises `NoShortForm` if the mass matrix is too large to be eliminated in lanes.
    """

    def __init__(self, system: StageSystem, lattice: LatticeStages | None = None) -> None:
        self.system, self.lattice = system, lattice
        self.own, self.pull = (lattice.own, lattice.pull) if lattice else ((), ())
        self.coefficients = Coefficients(system.q, system.graph)
        self.coefficients.symbol(system.q[0])

    def _function(self, name: str, arguments: Arguments, results: Sequence[Nodes]) -> str:
        text = function_text(name, {**arguments, "c": self.coefficients}, results,
                             self.coefficients)  # fmt: skip
        return with_names(f"@kernel\n{text}", self.own)

    def _solution(self, name: str, matrix: NodeMatrix, right: Nodes) -> list[Node]:
        """Return the solution of linear equations; raises `NoShortForm` if a loop would find it."""
        order = list(range(len(right)))
        solution, looped = solve(self.system.graph, matrix, right, self.coefficients, order)
        if looped:
            raise NoShortForm(f"the equations of {name} tie many unknowns together")
        return solution

    @cached_property
    def turning(self) -> list[int]:
        """Indices at which f is neither 0 nor equal to the entry of π̇."""
        pairs = zip(self.system.turned, self.system.rates[1], strict=True)
        return [i for i, (f, p) in enumerate(pairs) if f and f is not p]

    @cached_property
    def excess(self) -> NodeMatrix:
        """Rᵀ − 1."""
        columns = zip(*self.system.right_field, strict=True)
        return [[e - int(i == j) for j, e in enumerate(c)] for i, c in enumerate(columns)]

    @cached_property
    def shifted(self) -> bool:
        """True if π₀ may differ from μ: if R is not 1, or f not π̇."""
        return any(map(any, self.excess)) or bool(self.turning)

    @cached_property
    def text(self) -> str:
        """The text of all functions."""
        functions = [*self.kernels.values(), coefficients_text("prepare", self.coefficients)]
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
                arguments = {"x": system.x, "w": system.w, "given": letters}
                kernels[name] = self._function(name, arguments, [values])
        if self.lattice:
            ends, force = {"x": system.x, "w": system.w}, [self.lattice.force]
            kernels["point"] = self._function("point", ends, [system.target])
            bond = {"x": self.lattice.x, "own": self.lattice.bond_own}
            kernels["pull"] = with_names(self._function("pull", bond, force), bond["own"])
        elif system.extents:
            kinds = [[e for kind, e in system.extents if kind == wanted]
                     for wanted in ("size", "rest")]  # fmt: skip
            arguments = {"x": system.x, "w": system.w}
            kernels["extents"] = self._function("extents", arguments, kinds)
        return kernels

    @property
    def record(self) -> str:
        """The record that the driver is given, as text."""
        system = self.system
        names = [*re.findall(r"^def (\w+)", self.text, re.MULTILINE)]
        facts = {"affine": False, "watched": bool(system.extents), "branched": False,
                 "shifted": self.shifted, "rotating": system.moved is not None,
                 "width": len(self.coefficients.values)}  # fmt: skip
        entries = {name: name for name in names} | facts
        return f"Record({', '.join(f'{k}={v}' for k, v in entries.items())})"

    def _velocity(self) -> str:
        """Return the text of ẇ, ξ and μ at (w, π)."""
        system, graph = self.system, self.system.graph
        arguments = {"x": system.x, "w": system.w, "p": system.p, "own": self.own}
        xi = self._solution("velocity", system.mass, system.right)
        letters = (e.index for e in graph.letters(system.xi))
        moved = graph.rebuilt(system.rates[0], dict(zip(letters, xi, strict=True)))
        return self._function("velocity", arguments, [moved, xi, system.momentum])

    def _force(self) -> str:
        """Return the text of π̇, and of the entries `turning` of f, at (w, π) and ξ."""
        system = self.system
        turned = [system.turned[i] for i in self.turning]
        arguments = {"x": system.x, "w": system.w, "p": system.p, "xi": system.xi,
                     "pull": self.pull, "own": self.own}  # fmt: skip
        return self._function("force", arguments, [system.rates[1], turned])

    @property
    def _turns(self) -> list[Node]:
        """Σ h b_i f_i of each component: the sum of π̇, a sum of its own, or 0."""
        system, graph = self.system, self.system.graph
        own = dict(zip(self.turning, graph.letters(system.turn), strict=False))
        sums = zip(system.turned, graph.letters(system.dp), strict=True)
        return [own.get(i, dp if f else graph.number(0)) for i, (f, dp) in enumerate(sums)]

    @property
    def _ends(self) -> Arguments:
        system = self.system
        return {"x": system.x, "w": system.w, "p": system.p, "dp": system.dp,
                "turn": system.turn[: len(self.turning)]}  # fmt: skip

    def _shift(self) -> str:
        """Return the text of R₁⁻ᵀ(μ + Σhbf − R₁ᵀπ₁), without cancelling terms; lost is π₀ − μ."""
        system, graph = self.system, self.system.graph
        lost, dp = self._lost("lo0", system.w), graph.letters(system.dp)
        excess = graph.times(self.excess, graph.letters(system.p))
        right = [graph.sum([(1, turn), (-1, a), (-1, b), (-1, e)])
                 for turn, a, b, e in zip(self._turns, dp, lost, excess, strict=True)]  # fmt: skip
        slope = [list(column) for column in zip(*system.right_field, strict=True)]
        arguments = {**self._ends, "lost": [e.args for e in lost]}
        return self._function("shift", arguments, [self._solution("shift", slope, right)])

    def _update(self) -> str:
        """Return the text of increments of x and μ, less the rounding errors of earlier sums."""
        system, graph = self.system, self.system.graph
        ex, emu = self._lost("ex", system.x), self._lost("emu", system.w)
        gain = graph.plus(system.gain, self._turns)
        grown = [[a - e for a, e in zip(column, lost, strict=True)]
                 for column, lost in ((system.increment, ex), (gain, emu))]  # fmt: skip
        errors = {name: [e.args for e in lost] for name, lost in (("ex", ex), ("emu", emu))}
        return self._function("update", {**self._ends, **errors}, grown)

    def _lost(self, name: str, beside: Letters) -> list[Node]:
        return self.system.graph.letters(
            sympy.Symbol(f"{name}_{i}", real=True) for i in range(len(beside))
        )
