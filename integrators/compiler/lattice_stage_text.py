"""The text of collocation on a lattice: kernels of one site and of a bond's force, and the driver.

`velocity` and `force` are as in `stage_text`, with the site's own parameters and the force of its
bonds; `point(x, w, c) → z` of a node, `pull(x of both ends, own, c) → force on both`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ..numbers import with_tables
from ..numbers.types import Column, Letters
from .lattice_text import UNSEEN, with_names
from .stage_system import StageSource
from .stage_text import StageText, collocation_driver


@dataclass(frozen=True, eq=False)
class LatticeStages:
    """One collocation step of a lattice, whose bonds act as forces on its sites at the nodes.

    q: h, then parameters that all sites share. source: the collocation of one site, with its own
    letters `own` and the force `pull` on it. force: ρ̂ᵀ∂L/∂x of a bond, at both its ends x, with
    its letters `bond_own`. most: number of sweeps of the first step beyond which another way is
    faster, or None if it is unknown.
    """

    source: StageSource
    q: Letters
    own: Letters
    pull: Letters
    x: Letters
    bond_own: Letters
    force: Column
    most: int | None = None

    @property
    def key(self) -> tuple[Any, ...]:
        """Everything from which the text is made."""
        source = self.source
        return (source.nodes, source.given, self.q, self.own, self.pull, self.x, self.bond_own,
                self.force, self.most)  # fmt: skip


def collocation_text(system: LatticeStages) -> str:
    """Return the text of the kernels and of the driver of a lattice's collocation.

    Raises `NoShortForm` like `StageText`.
    """
    kernels = _SiteStages(system)
    text = kernels.text  # `text` finds the coefficients, so it must come first
    stages = kernels.system
    facts = [
        f"n, m, COUNT = {len(stages.x)}, {len(stages.w)}, {stages.count}",
        f"PARTS, NODES = -(-{stages.count} // WIDTH), '{stages.nodes.family}'",  # as `stage_text`
        f"SITES, BONDS, S = {len(system.own)}, {len(system.bond_own)}, m * {stages.nodes.unknown}",
        f"RULE = {kernels.record}",
        "SYSTEMS = RULE,",
        "MOMENTA = m * PARTS * WIDTH",
        "MOVES, PULL, POINT = 2 * MOMENTA, 3 * MOMENTA, 4 * MOMENTA",
        "ENDS = POINT + n * PARTS * WIDTH",
        "SHIFT = ENDS + 2 * m + RULE.turning",
        "WIDTHS = dict(w=S, w1=MOMENTA, w2=MOMENTA, w3=m, work=SHIFT + m, ties=1, "
        "coefficients=RULE.width)",
        # a component has one size on the whole lattice, so smaller sites need more sweeps than a
        # scene: with 1/4 energy drifts (chain of 6, gauss-4, 2·10⁵ steps: 5.8e-13, Newton 4.9e-14)
        "NOISE, SMALLEST = ROOT_EPS / 16, R(1) / 64",
        f"UNSEEN, MOST_AT_START = {UNSEEN}, min(MOST_SWEEPS, {system.most or 'HUGE'})",
    ]
    driver = collocation_driver("lattice_stage_driver")
    return with_tables("\n\n".join([f"# {stages.name}", text, "\n".join(facts), driver]))


class _SiteStages(StageText):
    """Kernels of one site's collocation, with its own letters, and the force of a bond."""

    def __init__(self, given: LatticeStages) -> None:
        self.given = given
        super().__init__(replace(given.source.derived(), q=given.q, extents=()))

    @property
    def kernels(self) -> dict[str, str]:
        """The kernels of a scene, the point b(x, w; 1) and the force of a bond."""
        given, system = self.given, self.system
        ends = {"x": system.x, "w": system.w}
        pulled = self._function("pull", {"x": given.x, "own": given.bond_own}, [given.force], [])
        return {**super().kernels, "point": self._function("point", ends, [system.target], []),
                "pull": with_names(pulled, given.bond_own)}  # fmt: skip

    def _function(self, name: str, arguments: Any, results: Any, before: Any) -> str:
        given = self.given
        if name == "force":
            arguments = {**arguments, "pull": given.pull}
        if name in ("force", "velocity"):
            arguments = {**arguments, "own": given.own}
        return with_names(super()._function(name, arguments, results, before), given.own)
