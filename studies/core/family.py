"""What is measured of each kind of scene if nothing is chosen: all rules, orders 4 to 8, 50 digits.

The built-in rules are of order 1 and 2, except `imex`; beside them, at 50 digits, are rules that
are used for accuracy. Runs are short, for a step costs as much as its order.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
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
    """Return (scene, rule) of each kind of scene: the rules take turns.

    These the report measures in more digits than a double has. The single steps of every case are
    of 50 digits, so that other runs of a kind show nothing more in them.
    """
    rules, kinds = _by_kind(pairs)
    turns = _in_turn(rules, [scenes[0] for scenes in kinds])
    return frozenset(turns.items())


def met_in_turn(
    pairs: Sequence[Pair], studies: Iterable[Sequence[Pair]], whole: Iterable[str]
) -> dict[str, str]:
    """Return scene ↦ the rule that alone the report measures there, of rules that take turns.

    The scenes that `whole` names are measured by every rule, and so is one of each kind that a
    study asks, of which pairs are given: what a rule does on a kind of scene is seen there, and
    what is hard in another scene by any rule. That a rule has its order and keeps form and momenta
    for every Lagrangian is proven beside.
    """
    all_rules = {*whole}
    for asked in (pairs, *studies):
        kinds = _by_kind(asked)[1]
        all_rules |= {scenes[0] for scenes in kinds if all_rules.isdisjoint(scenes)}
    rules, kinds = _by_kind(pairs)
    others = [name for scenes in kinds for name in scenes if name not in all_rules]
    return _in_turn(rules, [name for name in others if len(rules[name]) > 1])


def _by_kind(pairs: Iterable[Pair]) -> tuple[dict[str, list[str]], list[list[str]]]:
    """Return the rules of each scene; scenes by kind: of groupoid, and of what equations contain.

    The cheapest scene of a kind, where one is known, is its first.
    """
    rules: dict[str, list[str]] = {}
    kinds: dict[tuple[object, ...], dict[str, None]] = {}
    for scene, rule in sorted(pairs, key=lambda pair: pair[0].name not in FAMILY):
        rules.setdefault(scene.name, []).append(rule.name)
        parts = (scene.force, scene.fast, scene.one_form, scene.hamiltonian,
                 scene.discrete_lagrangian)  # fmt: skip
        kind = (type(scene.groupoid), *(part is None for part in parts), bool(scene.holonomic),
                bool(scene.nonholonomic), scene.timed)  # fmt: skip
        kinds.setdefault(kind, {})[scene.name] = None
    return rules, [list(scenes) for scenes in kinds.values()]


def _in_turn(rules: Mapping[str, Sequence[str]], scenes: Iterable[str]) -> dict[str, str]:
    """Return scene ↦ the rule used least so far; one that few scenes can have comes first."""
    known = Counter(rule for names in rules.values() for rule in names)
    used = Counter[str]()
    turns = {}
    for name in scenes:
        turn = min(rules[name], key=lambda one: (used[one], known[one]))
        used[turn] += 1
        turns[name] = turn
    return turns


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
