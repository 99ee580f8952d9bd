"""What is measured of each kind of scene if nothing is chosen: rules of orders 4 to 8, 50 digits.

The built-in rules are of order 1 and 2, except `imex`; beside them, at 50 digits, are rules that
are used for accuracy. Runs are short, for a step costs as much as its order.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from typing import TypeAlias

from discmech.integrators import Scene, Scheme
from discmech.integrators.compiler import text_key
from discmech.integrators.rules import Discretisation

Pair: TypeAlias = tuple[Scene, Discretisation]

#: on the pair groupoid, a group, an action and a product, each on its cheapest scene
FAMILY = {
    "pendulum": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "gauss-3", "gauss-4",
                 "kahan-li-8:midpoint"),
    "rigid-body": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "gauss-3",
                   "kahan-li-8:midpoint"),
    "heavy-top": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "kahan-li-8:midpoint"),
    "reduced-kepler": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "gauss-3", "gauss-4",
                       "kahan-li-8:midpoint"),
}  # fmt: skip
DIGITS = 50
#: the forms and momenta of these are judged too; the family's other rules show nothing more there
KEPT = {
    "pendulum": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "kahan-li-8:midpoint"),
    "rigid-body": ("lobatto-3", "triple-jump:midpoint", "kahan-li-8:midpoint"),
    "heavy-top": ("lobatto-3", "triple-jump:midpoint"),
    "reduced-kepler": ("gauss-2", "lobatto-3", "triple-jump:midpoint", "kahan-li-8:midpoint"),
}


def of_each_kind(pairs: Iterable[Pair]) -> frozenset[tuple[str, str]]:
    """Return (scene, rule) of each kind of scene: of groupoid, and of what the equations contain.

    These the report measures in more digits than a double has; the rules take turns. The single
    steps of every case are of 50 digits, so that other runs of a kind show nothing more in them.
    """
    rules: dict[str, list[str]] = {}
    kinds: dict[tuple[object, ...], str] = {}
    for scene, rule in sorted(pairs, key=lambda pair: pair[0].name not in FAMILY):
        rules.setdefault(scene.name, []).append(rule.name)
        parts = (scene.force, scene.fast, scene.one_form, scene.hamiltonian,
                 scene.discrete_lagrangian)  # fmt: skip
        kind = (type(scene.groupoid), *(part is None for part in parts), bool(scene.holonomic),
                bool(scene.nonholonomic), scene.timed)  # fmt: skip
        kinds.setdefault(kind, scene.name)
    known = Counter(rule for names in rules.values() for rule in names)
    used = Counter[str]()
    picks = set[tuple[str, str]]()
    for name in kinds.values():
        # a rule that few scenes can have comes first
        turn = min(rules[name], key=lambda one: (used[one], known[one]))
        used[turn] += 1
        picks.add((name, turn))
    return frozenset(picks)


def step_text(scheme: Scheme) -> str:
    """Return the digest of the equations of a step."""
    return text_key(scheme.equations.step)


def same_steps(pairs: Iterable[Pair], asked: Callable[[Pair], str]) -> dict[tuple[str, str], str]:
    """Return (scene, rule) ↦ an earlier rule whose equations of a step are the same there.

    Rules differ in where they ask L; without a base there is one place. asked: gives a pair's
    `step_text`.
    """
    first: dict[tuple[str, str], str] = {}
    same: dict[tuple[str, str], str] = {}
    for scene, rule in pairs:
        if not scene.groupoid.dim_x:
            earlier = first.setdefault((scene.name, asked((scene, rule))), rule.name)
            if earlier != rule.name:
                same[scene.name, rule.name] = earlier
    return same
