"""The cause of a one-step map's error: the first terms of its error in h, entry by entry.

At places of the evidence the error of a step is D(h) = Φ_h(z) − φ_h(z) = e₁h + e₂h² + …: e₁ is the
difference between the limit of (Φ_h(z) − z)/h and the vector field; if it is 0, e₂ is a part of the
second derivative of the motion. Signs, factors, forces and halves of steps show in these.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators import BadInput, StepFailure
from discmech.integrators.extensions.foreign import guarded, jump_on, noise_of, scene_in_numbers
from discmech.integrators.extensions.foreign.states import STATES
from discmech.integrators.numbers import Vector, arithmetic

from ..core.case import Case
from ..evidence import NEAR, Floor, Grid, evidence_of
from ..evidence.laws import AGAIN
from .first_terms import PARTS, SAME, SEEN, Beginning, Told, beginnings, factor, only
from .known_steps import by_design
from .no_step import of_no_step
from .second_terms import of_second
from .turns import across, wrapped
from .unlike_steps import of_event, of_unlike_steps

ALIKE = 0.01  # the same of factors beside 1 that are smaller than `SEEN`
SINGLE = 2.0**-24
MOST_DECIMALS = 13  # with fewer decimals it is no chance that all numbers of a step are round
BY_CHANCE = 2**7  # so many doubles lie between two numbers of so few decimals, of any that tells
#: number of steps between h and h/2 for the search for a jump, and of octaves from a place's length
GRID, OCTAVES = 192, 6
FEW = 5e-3  # a number of three digits is nearer to another than this; 1.01 is meant
#: factors that have a known reason
FACTORS = {
    -1.0: "its sign is flipped", 0.0: "it is missing", 2.0: "it is doubled", 0.5: "it is halved",
    2 / 3: "a factor 2/3 is on it", 1.5: "a factor 3/2 is on it",
}  # fmt: skip


def of_step(case: Case, law: str = "order", finest: float | None = None) -> dict[str, Any] | None:
    """Return {"cause", "sentence", "evidence"} of a wrong step, or None if nothing is found.

    A step is wrong if it is no step of the scene's motion, or of lower order than claimed if the
    study `law` asks for it, or if it is that of a method without the law. finest: the order that
    runs show at their finest steps, if it is known.
    """
    single = getattr(case.rule, "numbers", "") == "float32"
    if single:  # it hides the error's first terms: the same function shows them in doubles
        made = replace(case, rule=replace(case.rule, numbers="double"))  # type: ignore[call-arg]
        cause = of_step(made, law)  # errors of its runs may be round-off
        return None if cause and cause["cause"] in _OF_NUMBERS else cause
    if case.rule.unit(16) > 2.0**-50:  # the few digits of a file hide them as well
        return None
    try:
        if (floor := evidence_of(case.scheme).order.floor) is not None:
            return _of_floor(case, floor)
        if (event := of_event(case)) is not None:
            return event
        starts = beginnings(case.scheme, law == "order")
    except (BadInput, StepFailure, reference.ReferenceFailure):
        return None
    if not starts:
        return None
    n = case.scheme.s.n
    told = (
        wrapped(starts, n, partial(across, case, starts))
        or _of_numbers(case, starts)
        or _unprojected(case, starts, n)
        or _late(starts, n)
        or _of_limit(case, starts, n)
        or _of_small_factor(case, starts)
    )
    if told is None:
        told = by_design(case, law)
    if told is None and law == "order":
        told = of_second(case, starts, n, finest)
    if told is None and not case.rule.is_formula:
        told = of_unlike_steps(case)
    if told is None:
        return None
    evidence = {"limit": [float(e) for e in starts[0].first_error / starts[0].span],
                "place": [float(e) for e in starts[0].z]}  # fmt: skip
    return {"cause": told[0], "sentence": told[1], "evidence": evidence}


def _of_floor(case: Case, floor: Floor) -> dict[str, Any] | None:
    """Return the floor as the cause, unless steps above it are of a lower order: it hides why."""
    order = evidence_of(case.scheme).order.order
    if order is not None and order < (case.order or 1) - NEAR:
        return None
    cause = "single precision" if "single precision" in floor.words else "rounded"
    said = f"all that it gives are {floor.words}."
    return {"cause": cause, "sentence": said, "evidence": {"floor": floor.size}}


def _explains(starts: list[Beginning], field: Any) -> bool:
    """Return True if another field is the limit at every place, and the scene's own is far off."""

    def left(b: Beginning) -> float:
        return float(np.abs((b.f + b.first_error - field(b)) / b.span).max())

    off = max(float(np.abs(b.first_error / b.span).max()) for b in starts)
    return all(left(b) <= max(SEEN, 0.01 * off) for b in starts)


def _vanishes(starts: list[Beginning], entries: Any) -> bool:
    return all(bool((np.abs(entries(b)) <= SEEN * b.span).all()) for b in starts)


def _late(starts: list[Beginning], n: int) -> Told | None:
    """Return the cause if a part of the state is of another time, an error that does not grow."""
    grown = (np.abs(b.later - b.first_error).max() for b in starts)
    if _vanishes(starts, lambda b: b.first_error) or not all(
        more <= 0.05 * np.abs(b.first_error).max() for more, b in zip(grown, starts, strict=True)
    ):
        return None
    parts = {"x": slice(0, n), "mu": slice(n, None)}
    late = {}
    for name, part in parts.items():
        c = factor(starts, lambda b, s=part: only(b.first_error, s),
                    lambda b, s=part: only(b.f, s))  # fmt: skip
        if c is not None and abs(c) > SEEN:
            late[name] = c
    if not late:
        return None
    said = " and ".join(f"{name} is that of t {'+' if c > 0 else '−'} {_share(abs(c))}"
                        for name, c in late.items())  # fmt: skip
    return "stored half step", (
        f"the state that is shown belongs to no one time: {said}, as a leapfrog leaves it; bring "
        "both to one time where it is read."
    )


def _unprojected(case: Case, starts: list[Beginning], n: int) -> Told | None:
    """Return the cause if the momentum is off along the gradients of constraints, and no more."""
    scheme: Any = case.scheme
    if case.scene.holonomic is None or _vanishes(starts, lambda b: b.first_error):
        return None
    system = scene_in_numbers(scheme.s, scheme.scene, arithmetic(16))
    for b in starts:
        q, p = b.z[:n], b.z[n:]
        normal = (system.constraint_jacobian(q) @ system.tensor(q, p)[:n, n:]).T
        off = b.first_error[n:] - normal @ np.linalg.lstsq(normal, b.first_error[n:])[0]
        if (np.abs(np.concatenate([b.first_error[:n], off])) > SEEN * b.span).any():
            return None
    return "hidden constraint", (
        "a step leaves a momentum that is off along the gradient of the constraint alone, by O(h): "
        "it is not projected onto the hidden constraint, that the velocity stays on it; project it "
        "at the end of each step, as RATTLE does and SHAKE does not."
    )


def _share(c: float) -> str:
    fraction = Fraction(c).limit_denominator(12)
    near = abs(float(fraction) - c) < 1e-3
    return f"{'' if fraction == 1 else fraction if near else f'{c:.4g}'}h".replace("1/2h", "h/2")


def _of_limit(case: Case, starts: list[Beginning], n: int) -> Told | None:
    """Return the cause if the limit of (Φ_h(z) − z)/h is not the vector field.

    Single steps have to deny the limit: what is in a narrow part of the states, or of the sizes of
    steps, is no polynomial in h at the steps that are extrapolated.
    """
    order = evidence_of(case.scheme).order.order
    if _vanishes(starts, lambda b: b.first_error) or (order is not None and order > 1 - NEAR):
        return None
    still = order is not None and order < NEAR - 1  # D(h) does not sink with h
    if still or all(b.grown > float(PARTS[0] / PARTS[-1]) / 2 for b in starts):
        return of_no_step(starts, n)
    if (told := _named(starts, _NAMED)) is not None:
        return told
    whole = factor(starts, lambda b: b.first_error, lambda b: b.f)
    if whole is not None:
        return all_by(1 + whole)
    own = [1 + float(b.first_error @ b.f / (b.f @ b.f)) for b in starts]
    off = max(float(np.abs(b.first_error / b.span).max()) for b in starts)
    if all(bool((np.abs(b.first_error - (c - 1) * b.f) <= 1e-3 * min(off, 1) * b.span).all())
           for b, c in zip(starts, own, strict=True)):  # fmt: skip
        return "step of its own", (
            "it moves along the motion, but by a time of its own that depends on the state, "
            f"{min(own):.4g} to {max(own):.4g} of the step: its steps are not of the size h."
        )
    if (told := _squared(starts, n)) is not None:
        return told
    if _cancels(starts, n):
        return "flipped sign", (
            "the kicks of a step cancel, so that none is left as h goes to 0, though each moves "
            "the momentum: one of them has the wrong sign."
        )
    for name in starts[0].parts:
        if max(float(np.abs(b.parts[name] / b.span).max()) for b in starts) <= SEEN:
            continue
        c = factor(starts, lambda b: b.first_error, lambda b, k=name: b.parts[k])
        if c is not None and abs(c) > SEEN:
            return said_of(name, 1 + c)
    drag = factor(starts, lambda b: b.first_error, lambda b: np.concatenate([0 * b.z[:n], b.z[n:]]))
    if drag is not None:
        return "drag", f"a force of {drag:.4g} times the momentum acts, which the scene has not."
    return _not_squared(starts, n) or _named(starts, _ANGLES) or _of_entries(starts, n)


def _named(starts: list[Beginning], known: Mapping[str, str]) -> Told | None:
    """Return that of the known causes, with its sentence, whose field is the limit."""
    for word, sentence in known.items():
        asked = all(word in b.others for b in starts)
        if asked and _explains(starts, lambda b, w=word: b.others[w]):
            return word, sentence
    return None


def _squared(starts: list[Beginning], n: int) -> Told | None:
    """Return the cause if a part of a step has h² in place of h."""
    for name, what, own in (
        ("the motion of x", "x", slice(0, n)),
        ("the gradient of the potential", "the momentum", slice(n, None)),
    ):
        missing, c = (
            factor(starts, lambda b, k=key, s=own: only(getattr(b, k), s),
                    lambda b, k=name: b.parts[k])
            for key in ("first_error", "square")
        )  # fmt: skip
        if missing is not None and abs(missing + 1) < SAME and c is not None and abs(c) > SEEN:
            return "power of h", f"{what} is moved by {c:.4g} h² of {name}, in place of h."
    return None


def _not_squared(starts: list[Beginning], n: int) -> Told | None:
    """Return the cause if a term of a step has h in place of h²."""
    for what, own in (("x", slice(0, n)), ("the momentum", slice(n, None))):
        c = factor(starts, lambda b, s=own: only(b.first_error, s),
                    lambda b, s=own: only(b.second, s))  # fmt: skip
        others = _vanishes(starts, lambda b, s=own: b.first_error - only(b.first_error, s))
        if c is not None and abs(c) > SEEN and others:
            return "power of h", (
                f"a term of {what} has h in place of h²: it is {c:.4g} h times the second "
                "derivative, of which a step has h²/2."
            )
    return None


def _cancels(starts: list[Beginning], n: int) -> bool:
    """True if the gradient is missing in the limit, and a step of a free momentum moves it."""
    name = "the gradient of the potential"

    def others(b: Beginning) -> Vector:
        return b.f - b.parts["the motion of x"] - b.parts[name]

    c = factor(starts, lambda b: b.first_error, lambda b: b.parts[name])
    free = not any(others(b).any() for b in starts)
    if c is None or abs(c + 1) > 1e-3 or not free:
        return False
    return any(np.abs(b.moved[0][n:]).max() > SEEN * np.abs(b.z).max() for b in starts)


#: causes that concern the kind of numbers
_OF_NUMBERS = ("single precision", "noise", "rounded")
_NAMED = {
    "velocities for momenta": "it takes and gives velocities where momenta are said: say v in "
    'state=, as in state="qv".',
    "momenta for velocities": "it takes and gives momenta where velocities are said: say p in "
    'state=, as in state="qp".',
    "momentum for velocity": "x moves by the momentum p in place of the velocity ∂H/∂p: it is off "
    "by the mass.",
    "q and p exchanged": "it takes p for q and q for p: the order of its arguments is (q, p).",
    "velocity from the left": "the velocity in the body turns the attitude from the left, as "
    "exp(h ω) R, where it has to from the right, as R exp(h ω): R leads from the body to space.",
    "attitude transposed": "the attitude leads from space to the body, where R leads from the body "
    "to space: give its transpose.",
    "momentum in space": "the momentum is that in space, R p, where p is the momentum in the body.",
    "velocity in space": "the angular velocity is that in space, R ω, where ω is that in the body.",
    "quaternion with w last": "the quaternion is taken as (x, y, z, w), where it is (w, x, y, z).",
    "time frozen": "the field is that of t = 0 at every time: the time is frozen; take system.t.",
    "time doubled": "the field is that of 2t: the time is counted twice.",
}
#: asked last: on a power law, such a force is a factor, or nearly none
_ANGLES = {
    "degrees for radians": "forces are those at π/180 times the coordinates: angles in radians are "
    "taken for degrees.",
    "radians for degrees": "forces are those at 180/π times the coordinates: angles are given in "
    "degrees where they are in radians.",
}


def all_by(c: float) -> Told:
    """Return the cause if everything moves by a factor."""
    if abs(c - 1) < FEW:
        return "few digits", (
            f"every step is {abs(c - 1):.2g} of it too {'long' if c > 1 else 'short'}: "
            "coefficients that should add up to 1 have too few digits."
        )
    c = next((k for k in FACTORS if abs(k - c) < SAME), c)
    if not c:
        return "factor of time", "a step leaves the state where it is."
    more = f": {FACTORS[c]}" if c in FACTORS else ""
    return "factor of time", (
        f"a step moves by {c:.6g} of the vector field{more}; the shares of the step, with their "
        "signs, should add up to 1."
    )


def said_of(name: str, c: float) -> Told:
    """Return the cause if a part of the field comes c times."""
    near = next((k for k in FACTORS if abs(k - c) < 1e-3), None)
    if near == 0.0:
        return f"missing {name.removeprefix('the ')}", f"{name} is missing in the step."
    if near == -1.0:
        return "flipped sign", f"{name} has the wrong sign."
    if abs(c - 1) < FEW:
        return "few digits", (
            f"{name} is off by {abs(c - 1):.2g} of it, at all places alike: a number in the step "
            "has too few digits, or a factor beside 1."
        )
    return "factor", f"{name} comes {c:.6g} times in the step."


def _of_entries(starts: list[Beginning], n: int) -> Told | None:
    """Return the cause for single entries: a factor that is the same everywhere, or the size.

    Single precision is none of these: its rounding is no limit, and `_of_numbers` sees it.
    """
    size = len(starts[0].z)
    off = [max(abs(b.first_error[i]) / b.span[i] for b in starts) for i in range(size)]
    wrong = [i for i in range(size) if off[i] > SEEN]
    names = [f"x[{i}]" if i < n else f"mu[{i - n}]" for i in range(size)]
    factors = [factor(starts, lambda b, s=slice(i, i + 1): only(b.first_error, s),
                      lambda b, s=slice(i, i + 1): only(b.f, s)) for i in wrong]  # fmt: skip
    if wrong and factors[0] is not None and None not in factors:
        name, c = names[wrong[0]], 1 + factors[0]
        if abs(c - 1) < FEW:
            return said_of(f"the rate of {name}", c)
        c = next((k for k in FACTORS if abs(k - c) < 1e-3), c)
        word = FACTORS.get(c, "")
        cause = {"its sign is flipped": "flipped sign", "it is missing": "missing term"}
        return cause.get(word, "factor"), (
            f"the rate of {name} is {c:.6g} times that of the scene{f': {word}' if word else ''}."
        )
    if not wrong:
        return None
    return "another field", (
        f"the limit of (Φ_h(z) − z)/h differs from the vector field in "
        f"{', '.join(names[i] for i in wrong)}, by {max(off):.2g} of the rate of the motion."
    )


def _of_numbers(case: Case, starts: list[Beginning]) -> Told | None:
    """Return the cause if a program's numbers are no doubles, or are not smooth."""
    if case.rule.is_formula or case.rule.unit(16) > 2.0**-50:
        return None
    scheme: Any = case.scheme
    # a start that is round may give what is round
    looks = list(zip(evidence_of(scheme).places, [b.z for b in starts], strict=False))
    place, z = max(looks, key=lambda look: bool((look[1] != look[1].astype(np.float32)).any()))
    size = len(z)
    f = guarded(scheme.flow(place.step).map_of(t0=place.t), size)
    image = f(z)
    if not np.array_equal(image, f(z), equal_nan=True):
        off = float((np.abs(f(z) - image) / starts[0].span).max())
        return "no map", (
            f"the same step made twice differs by {off:.1e}: it is random, or keeps something "
            "between calls; a method with memory is a class with start, step and read."
        )
    again = evidence_of(scheme).departure(AGAIN)
    if again.broken:
        form, n = getattr(scheme.rule, "form", STATES["qp"]), scheme.s.n
        ends = [image]  # a step made again begins at the attitude nearest to its start
        ends += [guarded(scheme.flow(Fraction(again.step)).map_of(t0=at.t), size)(start)
                 for at, start in looks if again.step]  # fmt: skip
        off, said, k = max((*form.off_group(end[:n]), k) for k, end in enumerate(ends))
        if off > again.limit:
            after = f"after a step of {again.step:.2g} " if k else ""
            return "no attitude", f"{after}{said} at the end of each step."
        said = again.name or f"steps of a run, made again, differ from it by {again.size:.1e}"
        return "no map", (
            f"{said}: it keeps something between calls, or is random; a method with memory is a "
            "class with start, step and read."
        )
    if np.isfinite(image).all():  # whole numbers are of single precision, too
        for decimals in range(MOST_DECIMALS):
            image_is, z_is = ((e == np.round(e, decimals)).all() for e in (image, z))
            # large doubles have so few decimals by themselves
            told = np.spacing(np.abs(image)) * BY_CHANCE < 10.0**-decimals
            if image_is and not z_is and told.any():
                return "rounded", f"all that it gives are {Grid(10, decimals).words}."
        if (image == image.astype(np.float32)).all() and (z != z.astype(np.float32)).any():
            return "single precision", "all that it gives are numbers of single precision."
    scale = np.maximum(np.abs(z), starts[0].span * float(place.length))
    noise = noise_of(f, z, scale, 2.0**-53)
    level = float((noise.level / scale).max())
    of_step = float((noise.level / (starts[0].span * float(place.step))).max())
    if level > 1e-10:
        if any(SINGLE / 64 < e < 64 * SINGLE for e in (level, of_step)):
            said = f"a step is rough by {of_step:.1e} of its way: single precision somewhere."
            return "single precision", said
        return "noise", f"a step is rough by {level:.1e} of the state, as nothing smooth is."
    jump, octaves = float((noise.jump / scale).max()), 0
    between = "states" if jump > 1e-11 else "step sizes"
    for octave in range(OCTAVES):  # the number of iterations also depends on the step
        whole = place.length / 2**octave

        def of_step_size(part: float, z: Vector = z, whole: Fraction = whole) -> Vector:
            h = whole * Fraction(round(part * 2**40), 2**40)
            return guarded(scheme.flow(h).map_of(t0=place.t), size)(z)

        one = float((jump_on(of_step_size, 0.5, 1.0, GRID, image) / scale).max())
        if one <= 1e-11:
            continue
        # what an iteration leaves, and so where its number of steps changes, depends on the state
        beside = (z, *(z + share * (starts[-1].z + scale - z) for share in (0.1, 0.2)))
        at = [_rough_part(partial(of_step_size, z=e)) for e in beside]
        if max(at) - min(at) <= 1 / GRID:
            return "step sizes", (
                f"a step jumps by {one:.1e} of the state where the step is "
                f"{float(whole) * at[0]:.3g}, from all states alike: look for what is done by the "
                "size of the step."
            )
        jump, octaves = max(jump, one), octaves + 1
    if jump <= 1e-11:
        return None
    said = f"a step jumps by {jump:.1e} of the state between neighbouring {between}"
    # an iteration stops after fewer steps the shorter its step is; what a comparison chooses
    # changes once
    if octaves > 1:
        return "loose iteration", (
            f"{said}, as an iteration with a loose stop does: iterate until nothing changes."
        )
    return "jump", (
        f"{said}: look for what is done on one side alone, by a comparison, a clip or a table's "
        "cell, or for an iteration that stops early."
    )


def _rough_part(f: Callable[[float], Vector]) -> float:
    """Return where f is roughest on [1/2, 1], by sixth differences on `GRID` points."""
    parts = np.linspace(0.5, 1, GRID)
    rough = np.abs(np.diff([f(part) for part in parts.tolist()], 6, axis=0))
    usual = np.median(rough, axis=0)
    k = (rough / np.where(usual, usual, np.inf)).max(axis=1).argmax()
    return float(parts[k : k + 7].mean())


def _of_small_factor(case: Case, starts: list[Beginning]) -> Told | None:
    """Return the cause if a rate is off by one share too small for `SEEN`, alike at all places.

    Single steps have to deny the limit: a share alone may be what the extrapolation leaves.
    """
    order = evidence_of(case.scheme).order.order
    if order is None or order > 1 - NEAR or not _vanishes(starts, lambda b: b.first_error):
        return None
    for name in ("every step", *starts[0].parts):
        c = factor(starts, lambda b: b.first_error,
                    lambda b, k=name: b.parts.get(k, b.f), ALIKE, 0.0)  # fmt: skip
        if c:
            return all_by(1 + c) if name == "every step" else said_of(name, 1 + c)
    return None
