"""Random scenes and faults of contact, from a seed: what `discmech contact` makes of them.

    python -m tests.studies.contact_trials SEED [SOUND [UNSOUND]]

Sound: random scenes, rules and units; none may fail. Unsound: the same with a fault in the contact
or in the rule, of a random size; none may pass.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from typing import Any

import numpy as np
import sympy
from sympy import Rational

from discmech import BadInput, Scene, Scheme, StepFailure, discretisation, pair
from discmech.integrators import rules
from discmech.integrators.extensions.contact import Gaps, LocatedSteps
from discmech.studies import get
from discmech.studies.contact import measuring
from discmech.studies.core.case import Case
from tests.studies.as_json import run_case

STUDY = get("contact")
NOTHING = "no gap ever closes"
SOUND_RULES = ("midpoint", "trapezoidal", "midpoint", "gauss-2", "rectangle")


def number(drawn: random.Random, low: float, high: float) -> Rational:
    """A random fraction of three digits."""
    return Rational(round(drawn.uniform(low, high) * 1000), 1000)


def units(drawn: random.Random) -> tuple[Any, Any, Any]:
    """Units of length, time and mass: of two in three scenes 1, else a random power of 10."""
    if drawn.random() < 2 / 3:
        return Rational(1), Rational(1), Rational(1)
    return tuple(Rational(10) ** drawn.randint(-12, 12) for _ in range(3))  # type: ignore[return-value]


def scene(drawn: random.Random, **given: Any) -> Scene:
    """A random ordinary scene with contact; given: values that it is to have."""
    a, b, c = units(drawn)
    g = number(drawn, 0.5, 2) * a / b**2
    k = number(drawn, 0.1, 1) / b**2
    e = drawn.choice((0, 1, 1, number(drawn, 0.2, 0.95)))
    kind = drawn.choice(("floor", "bowl", "corner", "spring", "disc", "two", "space", "pendulum"))
    rough = drawn.choice((0, number(drawn, 0.05, 0.8))) if kind not in ("spring", "two") else 0
    values = {"friction": rough, "restitution": e, "duration": 4 * b,
              "step": b * Rational(1, drawn.choice((30, 40, 50))), **given}  # fmt: skip
    v = [number(drawn, -1, 1) * a / b for _ in range(3)]
    x = [number(drawn, -0.4, 0.4) * a for _ in range(3)]

    def plain(n: int, height: int, more: Any = 0) -> Any:
        def lagrangian(x: Any, v: Any, p: Any) -> Any:
            potential = g * x[height] + (more(x) if more else 0)
            return c * (v.dot(v) / 2 - potential)

        return {"groupoid": pair(n), "lagrangian": lagrangian}

    high = number(drawn, 0.3, 1.2) * a
    if kind == "floor":
        made = {**plain(2, 1, lambda x: k * x[0] ** 2 / 2), "contact": lambda x, p: [x[1]],
                "x0": [x[0], high], "v0": v[:2]}  # fmt: skip
    elif kind == "bowl":
        bend = number(drawn, 0.1, 0.5) / a
        made = {**plain(2, 1), "contact": lambda x, p: [x[1] - bend * x[0] ** 2],
                "x0": [x[0], high], "v0": v[:2]}  # fmt: skip
    elif kind == "corner":
        tilt = number(drawn, 0.3, 1)
        made = {**plain(2, 1), "contact": lambda x, p: [x[1] - tilt * x[0], x[1] + tilt * x[0]],
                "x0": [x[0] / 4, high], "v0": v[:2]}  # fmt: skip
    elif kind == "spring":

        def lagrangian(x: Any, v: Any, p: Any) -> Any:
            return c * (v[0] ** 2 / 2 - 4 * k * x[0] ** 2 / 2 - k * x[0] ** 4 / a**2 / 4)

        made = {"groupoid": pair(1), "lagrangian": lagrangian,
                "contact": lambda x, p: [x[0] + a * Rational(3, 10)], "x0": [high],
                "v0": v[:1]}  # fmt: skip
    elif kind == "disc":
        inertia = number(drawn, 0.3, 0.6)

        def lagrangian(x: Any, v: Any, p: Any) -> Any:
            return c * ((v[0] ** 2 + v[1] ** 2 + inertia * a**2 * v[2] ** 2) / 2 - g * x[1])

        made = {"groupoid": pair(3), "lagrangian": lagrangian,
                "contact": lambda x, p: [(x[1], [x[0] + a * x[2]])],
                "x0": [x[0], drawn.choice((0, high)), 0], "v0": [v[0], 0, v[1] / a]}  # fmt: skip
    elif kind == "two":

        def lagrangian(x: Any, v: Any, p: Any) -> Any:
            return c * ((v[0] ** 2 + 2 * v[1] ** 2) / 2 - g * (x[0] + 2 * x[1]))

        made = {"groupoid": pair(2), "lagrangian": lagrangian,
                "contact": lambda x, p: [x[0], x[1] - x[0] - a / 10],
                "x0": [high, 2 * high + a / 10], "v0": v[:2]}  # fmt: skip
    elif kind == "space":
        made = {**plain(3, 2), "contact": lambda x, p: [x[2] - x[0] / 5 + x[1] / 9],
                "x0": [x[0], x[1], high], "v0": v}  # fmt: skip
    else:
        length = number(drawn, 0.5, 1.5) * a

        def lagrangian(x: Any, v: Any, p: Any) -> Any:
            return c * (length**2 * v[0] ** 2 / 2 + g * length * sympy.cos(x[0]))

        made = {"groupoid": pair(1), "lagrangian": lagrangian,
                "contact": lambda x, p: [length * (sympy.sin(x[0]) + Rational(1, 4))],
                "x0": [number(drawn, 0.5, 1.2)], "v0": [v[0] / a]}  # fmt: skip
        values["friction"] = 0
    return Scene(name=f"random-{kind}", **{**made, **values})


class WrongRebound(LocatedSteps):
    """The restitution is off by a factor."""

    def __init__(self, *given: Any, size: float) -> None:
        super().__init__(*given)
        self.e = self.e * (1 - size)


class LostMomentum(LocatedSteps):
    """An impact takes a part of the momentum that no impulse tells of."""

    def __init__(self, *given: Any, size: float) -> None:
        super().__init__(*given)
        self.size = size

    def _after_impacts(self, m: Any, share: Any, counts: Any, impacts: list[Any]) -> Any:
        before = len(impacts)
        found = super()._after_impacts(m, share, counts, impacts)
        return found._replace(mu=found.mu * (1 - self.size)) if len(impacts) > before else found


class Turned(Gaps):
    """A reflection at a normal that is turned by a small angle."""

    size = 0.0

    def at(self, x: Any, *path: Any) -> Any:
        place = super().at(x, *path)
        normal = place.normal.copy()
        normal[:, -1] = (1 + self.size) * normal[:, -1]
        return place._replace(normal=normal)


class LateImpact(LocatedSteps):
    """Impacts are located too late, by a part of the step."""

    def __init__(self, *given: Any, size: float) -> None:
        super().__init__(*given)
        self.size = size

    def _root(self, value: Any, first: Any, upto: Any) -> Any:
        found = super()._root(value, first, upto)
        if found is None or self.stepped or "slip" in repr(value):
            return found
        late = min(found[0] + self.size, upto)
        return late, value(late)[2]


class Friction(Gaps):
    """Friction of another size, or turned within its plane."""

    size, turned = 0.0, 0.0

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.true = self.friction
        self.friction = [e * (1 - self.size) for e in self.friction]

    def impulses(self, W: Any, U0: Any, cones: Any, start: Any) -> Any:
        P = super().impulses(W, U0, cones, start)
        for plane, _ in cones.planes.values():
            if self.turned and plane.stop - plane.start == 2:
                s, c = np.sin(self.turned), np.cos(self.turned)
                P[plane] = np.array([[c, -s], [s, c]]) @ P[plane]
            elif self.turned:
                P[plane] = -P[plane]
        return P


def faulty(drawn: random.Random) -> tuple[str, dict[str, Any], Any, Any]:
    """(its name, values of the scene that show it, what changes a flow, the rule or None)."""
    size = 10 ** drawn.uniform(-3, -0.7)
    kind = drawn.choice(("rebound", "lost", "late", "weak", "turned", "clock", "force", "theta"))
    some = number(drawn, 0.2, 0.7)

    def steps(of: Any) -> Any:
        def change(flow: Any) -> None:
            own = flow._steps
            flow.__dict__["_steps"] = of(own.gaps, own.h, own.part, own.e, own.stepped, size=size)

        return change

    def gaps(**values: Any) -> Any:
        def change(flow: Any) -> None:
            flow.gaps_kind = type("Faulty", (Friction,), values)

        return change

    name = f"{kind} {size:.1e}"
    if kind == "rebound":
        return name, {"restitution": some}, steps(WrongRebound), None
    if kind == "lost":
        return name, {}, steps(LostMomentum), None
    if kind == "late":
        return name, {}, steps(LateImpact), None
    if kind == "weak":
        return name, {"friction": some}, gaps(size=size), None
    if kind == "turned":
        return name, {"friction": some}, gaps(turned=0.1 + size), None
    part = Fraction(size).limit_denominator(10**6)

    @discretisation(order=drawn.choice((2, None)) if kind != "theta" else 2)
    def wrong(L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
        off = Rational(part.numerator, part.denominator)
        m = G.target(x, u, h / 2 + (off * h if kind == "theta" else 0))
        potential = -L(m, 0 * u)
        if kind == "clock":
            return h * ((L(m, u) + potential) / (1 + off) - (1 + off) * potential)
        return h * (L(m, u) - (off * potential if kind == "force" else 0))

    return name, {}, None, wrong


@contextmanager
def changed(change: Any) -> Iterator[None]:
    """Change each flow of the study."""
    honest = measuring._flow

    def flow(*given: Any) -> Any:
        made = honest(*given)
        if change is not None:
            change(made)
        return made

    measuring._flow = flow
    try:
        yield
    finally:
        measuring._flow = honest


def judged(of: Scene, rule: Any, change: Any = None) -> Any:
    """What the study says of a scene by a rule, with a fault in each of its flows."""
    with changed(change):
        return run_case(STUDY, Case("contact", of, rule, 16))


def sound(seed: int, count: int) -> Iterator[tuple[str, Any]]:
    """(name, result) of random sound cases, in each of which something touches."""
    for k in range(count):
        drawn = random.Random(f"sound {seed} {k}")
        found: Any = {"reason": NOTHING}
        while NOTHING in found["reason"]:
            of, rule = scene(drawn), drawn.choice(SOUND_RULES)
            found = judged(of, rules.get(rule))
        yield f"{k} {of.name} by {rule}", found


def smooth_or_rough(drawn: random.Random, values: dict[str, Any]) -> Scene:
    """A random scene with these values; of friction, one whose contacts have a plane."""
    while True:
        try:
            of = scene(drawn, **values)
            Scheme(of, rules.get("midpoint"))
        except BadInput:
            continue
        return of


def acts(of: Scene, change: Any) -> bool:
    """Whether a fault of the contact changes the motion of a scene: a wrong rebound does not change
    one that never rebounds."""
    ends = []
    for made in (None, change):
        flow = Scheme(of, rules.get("midpoint")).flow(of.step, impacts="located")
        if made is not None:
            made(flow)
        try:
            run = flow.trajectory(150)
        except StepFailure:
            return made is not None
        ends.append(np.array(run.x[-1], dtype=float))
    return bool(abs(ends[0] - ends[1]).max() > 1e-9 * abs(ends[0]).max())


def unsound(seed: int, count: int) -> Iterator[tuple[str, Any]]:
    """(name, result) of random faults."""
    for k in range(count):
        drawn = random.Random(f"unsound {seed} {k}")
        name, values, change, rule = faulty(drawn)
        of = smooth_or_rough(drawn, values)
        while change is not None and not acts(of, change):
            of = smooth_or_rough(drawn, values)
        yield f"{k} {name} on {of.name}", judged(of, rule or rules.get("midpoint"), change)


def main(seed: int, of_sound: int = 40, of_unsound: int = 20) -> int:
    """Print what is not as it should be, and how many there were of each; 1 where one is wrong."""
    wrong = 0
    for trials, count, bad in ((sound, of_sound, "fail"), (unsound, of_unsound, "pass")):
        told: Counter[str] = Counter()
        for name, found in trials(seed, count):
            told[found["verdict"]] += 1
            if found["verdict"] in (bad, "inconclusive"):
                print(
                    f"{found['verdict']}: {trials.__name__} {name}: {found['reason']}", flush=True
                )
            wrong += found["verdict"] == bad
        print(f"{trials.__name__}: {dict(told)}", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
