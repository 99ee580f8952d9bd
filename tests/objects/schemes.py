"""Every scheme, a scene by a rule, derived and compiled once in a process."""

from functools import cache

from discmech.integrators import Scheme, rules
from tests.objects.rules import RULES, two_thirds
from tests.objects.scenes import BUILT_IN, SCENES

#: every (scene, rule) by name
#: but those with constraints, whose steps are no maps of arrows
SCHEMES = tuple(
    (s, r) for s in SCENES for r in RULES
    if RULES[r].applies(SCENES[s]) and not SCENES[s].all_constraints
)  # fmt: skip
BUILT_IN_SCHEMES = tuple((s, r) for s, r in SCHEMES if s in BUILT_IN)


@cache
def scheme_of(scene, rule):
    """One scheme for all tests of a process: a scheme derives each expression once."""
    return Scheme(scene, rule)


@cache
def scheme(scene, rule):
    known = {**RULES, two_thirds.name: two_thirds}
    return scheme_of(SCENES[scene], known[rule] if rule in known else rules.get(rule))


@cache
def flow(scene, rule, step, digits=16):
    """One flow for all tests of a process."""
    return scheme(scene, rule).flow(step, digits)


def with_wrong_force(sound, at_start, at_end):
    """The scheme with its discrete force at both ends times a number: a wrong scheme."""
    maps = sound.arrows
    free = Scheme(sound.scene.with_values(force=None), sound.rule).arrows
    minus = free.minus + at_start * (maps.minus - free.minus)
    plus = free.plus + at_end * (maps.plus - free.plus)
    mark = f"force times {at_start} and {at_end}"
    equations = sound.equations.altered(mark, minus=minus, plus=plus, gain=plus - minus)
    return Scheme(sound.scene, sound.rule, equations)
