"""The laws that a step keeps by itself, at drawn places: the form, the way back, being a map.

A run of one trajectory sees a law only on that trajectory, and on its symmetry planes. A step from
a place is an ordinary one, in more digits than doubles have. A quantity that is kept is a law too
(`studies.momentum.sight`).
"""

from __future__ import annotations

import random
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import BadInput, Scheme, StepFailure
from discmech.integrators.errors import Displaced
from discmech.integrators.extensions.foreign import scene_in_numbers
from discmech.integrators.flows import (
    Flow,
    form_change_defects,
    restricted_form_defect,
    return_defect,
    volume_defect,
)
from discmech.integrators.geometry import StagesNotFound
from discmech.integrators.numbers import Vector, arithmetic, mpmath

from ..core.limits import MADE_AGAIN, OF_ORDER, of_a_step
from ..core.single_steps import ALIKE, Departure
from ..systems.runs import energy_with_terms
from .cloud import Cloud
from .many_steps import many_steps, unlike_steps
from .places import Place, random_fraction
from .repeated import repeated

DIGITS = 30  # digits of the states; defects are evaluated to twice as many
#: a defect that exceeds round-off of twice the digits: its zeros are known to √ε² (`defects`)
LIMIT = 10.0 ** (5 - DIGITS)
STEPS = 16  # steps of a program from a place that are made again
#: share of a step at which an arrow is the velocity but for a linear part: what is left of it is
#: its square, and 2²⁰ times that where the arrow curves a thousandfold as fast as the motion
SHORT = Fraction(1, 10**10)
#: round-offs by which a step may change what it keeps: 64 of a step's own bound, 16 for a quantity
#: whose terms grow in it
ROUNDINGS = 2**10


class Law(ABC):
    """A law of one step; name: its key in a record. tries: steps that are tried from a place.

    of_attitude: True if it is asked of `Evidence.whole`; along: True if also all along the motion.
    """

    name: str
    tries = 4
    of_attitude = along = False

    def refusal(self, scheme: Scheme) -> str:
        """Return the reason why the law asks nothing of a scheme, or ""."""
        return "" if scheme.rule.is_formula else "a program has no derivative but by differences."

    def longest(self, scheme: Scheme, place: Place, drawn: random.Random) -> Fraction:
        """Return the longest step that is tried from a place."""
        return place.step

    def signs(self, scheme: Scheme) -> Sequence[int]:
        """Return the signs of the steps that are asked: a program may do something else back."""
        return (1,)

    def fewer(self, scheme: Scheme) -> int:
        """Return by how much fewer of `many_steps` are asked."""
        return 1

    def conspicuous(self, scheme: Scheme) -> tuple[list[Place], int]:
        """Return (starts of steps that depart from the law beyond round-off, how many were asked).

        They are `many_steps`, and those that are unlike the steps beside them.
        """
        if scheme.rule.is_formula and (scheme.scene.all_constraints or scheme.s.degenerate):
            return [], 0  # 50 digits see that a state in doubles is off a constraint, or μ off ϑ(x)
        if self.refusal(scheme):
            return [], 0
        unlike, many = unlike_steps(scheme), many_steps(scheme, self.fewer(scheme))
        if many is None or (gaps := self.gaps(many)) is None:
            return unlike, 0
        seen = many.places(gaps, ROUNDINGS * scheme.rule.unit(16))
        return unlike + seen, int(np.isfinite(gaps).sum())

    def gaps(self, many: Cloud) -> Vector | None:
        """Return the departures of many steps in doubles, (r,); None for a law of few places."""
        return None

    @abstractmethod
    def departure(self, scheme: Scheme, place: Place, step: Fraction) -> Departure:
        """Return the departure of one step; raises the errors of steps."""


class Form(Law):
    """The form on the dual; under constraints, on the part of the states that they leave free.

    Under a force its change is asked, beside that of the force's one-form.
    """

    name = "form"

    def refusal(self, scheme: Scheme) -> str:
        """Return the reason why no form is asked for."""
        return f"{why}." if (why := scheme.scene.no_form) else super().refusal(scheme)

    def departure(self, scheme: Scheme, place: Place, step: Fraction) -> Departure:
        """Return the defect of the form, relative to its absolute terms."""
        flow: Flow = scheme.flow(step, DIGITS)
        x: Any = scheme.s.with_time(place.x, place.t)
        forced = scheme.scene.force is not None
        if scheme.scene.all_constraints:
            size = restricted_form_defect(flow, x, place.mu, place.u, forced=forced)
        elif forced:
            size = form_change_defects(flow, x, place.mu, place.u)[0]
        else:
            size = flow.poisson_defect(x, place.mu, u0=place.u)
        return Departure(float(size), LIMIT, "change" if forced else "poisson")


class PhaseVolume(Law):
    """The volume of phase space, for a map that claims it without the form."""

    name = "volume"

    def refusal(self, scheme: Scheme) -> str:
        """Return the reason why volume is not asked for."""
        if scheme.scene.all_constraints or scheme.scene.force is not None:
            return "constraints leave a part of the states, and forces change a volume of them."
        return super().refusal(scheme)

    def departure(self, scheme: Scheme, place: Place, step: Fraction) -> Departure:
        """Return how far the determinant of the step's derivative is from 1."""
        flow: Flow = scheme.flow(step, DIGITS)
        x: Any = scheme.s.with_time(place.x, place.t)
        return Departure(float(volume_defect(flow, x, place.mu, place.u)), LIMIT)


class WayBack(Law):
    """The way back: Φ₋ₕ after Φₕ is the identity, for a method that is its own adjoint."""

    name = "way back"

    def departure(self, scheme: Scheme, place: Place, step: Fraction) -> Departure:
        """Return the distance from the place, over the terms that the two steps add up."""
        forth, back = (scheme.flow(sign * step, DIGITS) for sign in (1, -1))
        x: Any = scheme.s.with_time(place.x, place.t)
        size = float(return_defect(forth, back, x, place.mu, place.u))
        return Departure(size, of_a_step(forth.context.exactly.numbers.digits))

    def gaps(self, many: Cloud) -> Vector:
        """Return the distances of steps back from their starts, over the motion."""
        return np.asarray((np.abs(many.back() - many.z) / many.scale).max(axis=1))


class MadeAgain(Law):
    """A program's run is the same steps made again; of whole runs, each row is the end of one.

    Between its own steps a program of whole runs may interpolate. A row is then as near to the
    motion as the end of a run up to there, but for a power of the step.
    """

    name = "made again"

    def refusal(self, scheme: Scheme) -> str:
        """Return that a formula has nothing but its arguments."""
        return "a formula is a map of the state and the step." if scheme.rule.is_formula else ""

    def departure(self, scheme: Scheme, place: Place, step: Fraction) -> Departure:
        """Return the difference of a short run from the same made again, over the state."""
        flow: Any = scheme.flow(step, 16)
        parts = [np.array([float(e) for e in part]) for part in (place.x, place.mu)]
        scale = np.concatenate([np.full(len(e), np.abs(e).max(initial=0.0) or 1.0) for e in parts])
        repeat = repeated(flow, np.concatenate(parts), scale, STEPS, place.t)
        limit = MADE_AGAIN * scheme.rule.unit(16)
        if getattr(scheme.rule, "runs", False):
            if repeat.error is None:
                return Departure(unknown="the motion is not known, and rows may be interpolated.")
            limit += OF_ORDER["rows: interpolated"] * repeat.error
        return Departure(repeat.gap, limit, "" if repeat.row else ALIKE)


class ArrowVelocity(Law):
    """The arrow u of a step is the velocity ξ(x, μ) as h goes to 0, where ẋ does not say so.

    On an action groupoid and on a product with a group, (x, μ) may move rightly while the body
    turns as another one: a Casimir that is added to H changes ξ alone. (On a group without a base
    the attitude itself is judged.)
    """

    name = "arrow"

    def refusal(self, scheme: Scheme) -> str:
        """Return the reason why no arrow is asked for."""
        scene = getattr(scheme, "lattice", None) or scheme.scene
        if not scheme.rule.asks_lagrangian or scene.groupoid.kind not in ("action", "product"):
            return "(x, μ) alone says how the motion goes."
        return (
            "L_d on the group has no small step."
            if getattr(scene, "discrete_lagrangian", None)
            else ""
        )

    def departure(self, scheme: Scheme, place: Place, step: Fraction) -> Departure:
        """Return |u − ξ| at a step to 0, over |ξ|: the part of u that two short steps share."""
        short = SHORT * step
        arrow, u = short_arrow(scheme, place, short, DIGITS), np.array(place.u)
        if scheme.scene.hamiltonian:  # a place of it has μ alone
            at = scene_in_numbers(scheme.s, scheme.scene, arithmetic(DIGITS))
            u = at.velocity(np.array(place.x), np.array(place.mu), place.t)
        with mpmath.workdps(DIGITS):
            velocity = np.array([*map(mpmath.mpf, u)])
            gap = abs(arrow - velocity).max()
            size = float(gap / (abs(velocity).max() or 1))
        return Departure(size, float(2**20 * SHORT**2), step=float(short))


def short_arrow(scheme: Any, place: Any, step: Fraction, digits: int) -> Any:
    """Return the part of u that a step and one of twice its length from a place share."""
    one, two = (scheme.flow(e * step, digits).trajectory(1, **place.start).u[0] for e in (1, 2))
    with mpmath.workdps(digits):
        return 2 * one - two


class KeepsEnergy(Law):
    """The energy, where each step has to keep it to round-off, as an energy-preserving method does.

    A projection to the energy of the scene's own start, and a loss in a part of the states, are
    sound along the scene's motion alone. No step is longer than the scene's, for which the solver
    of a program is made. digits: those in which it is kept; a quadrature that is exact to the last
    digit of a double is none of 40 digits.
    """

    name = "keeps the energy"

    def __init__(self, digits: int) -> None:
        self.digits = digits

    def refusal(self, scheme: Scheme) -> str:
        """Return "": a step of a program may be held against it, too."""
        return ""

    def longest(self, scheme: Scheme, place: Place, drawn: random.Random) -> Fraction:
        """Return a share of the scene's step, or of the place's if that is shorter."""
        return min(place.step, Fraction(scheme.scene.step)) * random_fraction(drawn, 0.55, 0.95)

    def gaps(self, many: Cloud) -> Vector:
        """Return the changes of H over its terms."""
        return many.changes(energy_with_terms(many.scheme, 16))

    def departure(self, scheme: Scheme, place: Place, step: Fraction) -> Departure:
        """Return the change of H by one step, over Σ|∂H/∂zᵢ zᵢ|.

        H has twice the digits, so that its own round-off is none, and no constant in it counts. A
        function of numbers rounds its value, constants and all, in doubles.
        """
        run = scheme.flow(step, self.digits).trajectory(1, **place.start)
        numbers = arithmetic(scheme.scene.digits(2 * DIGITS))
        at = scene_in_numbers(scheme.s, scheme.scene, numbers)
        rows = list(zip(run.x, run.mu, strict=True))
        before, after = (at.H(*row) for row in rows)
        size: Any = 0
        for x, mu in rows:  # an entry that is 0 is rounded like the others of its kind
            for part, slope in ((x, at.gradient(x, mu)), (mu, at.velocity(x, mu))):
                size += max(map(abs, part), default=0) * sum(map(abs, slope))
        own = scheme.rule.unit(16) if self.digits == 16 else float(arithmetic(self.digits).eps)
        own += float(numbers.eps * abs(before) / size) if size else 0.0
        gap = abs(after - before)
        return Departure(float(gap / size) if gap else 0.0, ROUNDINGS * own, "the energy",
                         float(step))  # fmt: skip


FORM, VOLUME, WAY_BACK = Form(), PhaseVolume(), WayBack()
AGAIN, ARROW = MadeAgain(), ArrowVelocity()
#: by whether the digits are those of doubles
ENERGY = {True: KeepsEnergy(16), False: KeepsEnergy(DIGITS)}


def worst_departure(
    law: Law, scheme: Scheme, places: Sequence[Place], drawn: random.Random
) -> Departure:
    """Return the departure at the places that exceeds its limit most, or why there is none.

    Raises `Displaced` for a program whose answers begin elsewhere than at their start.
    """
    if reason := law.refusal(scheme):
        return Departure(unknown=reason)
    worst, why = Departure(), "no step was made"
    tried = [(place, sign * law.longest(scheme, place, drawn))
             for place in places for sign in law.signs(scheme)]  # fmt: skip
    seen, asked = law.conspicuous(scheme)
    for place, step in [*tried, *((place, place.step) for place in seen)]:
        for _ in range(law.tries):
            try:
                one = law.departure(scheme, place, step)
            except Displaced:
                raise
            except StepFailure as failure:  # this step is too long: a shorter one may be found
                why = " ".join(str(failure).split())
                step *= random_fraction(drawn, 0.2, 0.45)  # no two are in a ratio of 2ᵏ
                continue
            except StagesNotFound as lost:  # a step in doubles that more digits do not find
                why = " ".join(str(lost).split())
                break
            except BadInput as refusal:  # no step from here; those from other places count
                why = " ".join(str(refusal).split())
                break
            if one.size is not None and _is_worse(one, worst):
                worst = replace(one, step=one.step or float(step), place=str(place),
                                on_motion=not place.beside)  # fmt: skip
            break
    return Departure(unknown=why) if worst.size is None else replace(worst, asked=asked)


def _is_worse(one: Departure, other: Departure) -> bool:
    """True for a departure that exceeds its limit by more; one that is not a number does."""
    if other.size is None or one.size is None:
        return True
    return not one.size * other.limit <= other.size * one.limit
