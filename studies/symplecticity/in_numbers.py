"""The form under a map of numbers, by differences and closed curves at drawn places."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from discmech.integrators import StepFailure
from discmech.integrators.extensions.foreign import derivative, guarded, noise_of, shifted
from discmech.integrators.extensions.foreign.differences import FARTHEST
from discmech.integrators.numbers import Matrix, Vector

from ..core.case import Case, Progress
from ..evidence.places import seed_in_numbers
from .around import conspicuous
from .constrained import constrained_parameters
from .form_in_numbers import (
    LOOP,
    form_defect,
    loop_defect,
    pulled_back_defect,
    random_curve,
    volume_defect,
)
from .judging_form import is_defect
from .jumps import jumps_of
from .leaves import leaf_defect
from .own_derivatives import of_run, of_step
from .places import Look, looks, map_of, more_looks, scale_of
from .records import Defect, FoundOfNumbers, Held, Jump, MeasuredOfNumbers, OfNumbers

#: share of the defect of a method of that order: a smaller defect is none
RESOLVED = 1e-9
LOOPS = 6  # closed curves per place
# their sizes in parts of the motion; the next is for a place where one is too large
REACHES = (0.08, 0.02, 0.005)
#: one closed curve measures one number of the form, by chance a small one; that all six measure
#: less than a tenth of it happens once in a million
UNSEEN = 10
#: a defect of so much of the motion counts as none either, since at methods of high order nothing
#: less is resolved: the round-off of as many values as the smallest closed curve has, each of the
#: size of the motion, beside an area of its reach; a pass says what could be hidden
FINE = UNSEEN * FARTHEST * 2.0**-53 * LOOP**0.5 / min(REACHES)
ENOUGH = 3  # places that have to reach the resolution
CLEARLY = 10  # further places are tried to get a resolution so many times finer than a pass needs
UNKNOWN_ORDER = 4  # the order for a method that claims none: few methods leave less
#: shares of the motion's size over which a state that stands out is looked at: a narrow part of the
#: states has no edge in the smaller
NEAR = 1, 1 / 64
SMOOTH = 64 * 2.0**-53  # a larger noise, relative to the values, is reported


def measure(case: Case, progress: Progress) -> FoundOfNumbers:
    """Return rows of steps from drawn places.

    measured: the worst of poisson (the defect as measured) and certain (the part of it that no
    error explains); resolution, the best that `ENOUGH` places reach; residual, the difference of a
    repeated step. left: the defect that a method of the order, but not symplectic, would leave at
    that place.
    """
    scheme: Any = case.scheme
    progress(f"{case.scene.name} {case.label}: places", 0.0)
    all_looks, scale, seed = looks(scheme)
    rows = []
    for k, look in enumerate(all_looks):
        progress(f"{case.scene.name} {case.label}: differences", k / len(all_looks))
        rows.append(_row(case, k, look, scale, seed))
    for look in more_looks(scheme, scale, seed):
        if not undecided(case, rows):
            break
        rows.append(_row(case, len(rows), look, scale, seed))
    around, unit, jumps = 0, case.rule.unit(16), list[Jump]()
    known = [row.certain for row in rows if row.certain is not None]
    if known and not is_defect(max(known), unit):
        jumps = jumps_of(case, scale)
        stand_out, around = conspicuous(case, scale)
        near = [_row(case, len(rows), look, part * scale, seed)
                for look in stand_out for part in NEAR]  # fmt: skip
        rows += [row for row in near if row.certain is not None]
    return FoundOfNumbers(rows, _measured(case, rows), around=around, jumps=jumps)


def certain_losses(case: Case, fewer: int) -> list[Look]:
    """Return looks, of so many fewer drawn states, whose step certainly loses the form."""
    scale, seed, unit = scale_of(case.scheme), seed_in_numbers(case.scheme), case.rule.unit(16)
    return [look for k, look in enumerate(conspicuous(case, scale, fewer)[0])
            if any(is_defect(_row(case, k, look, part * scale, seed).certain or 0.0, unit)
                   for part in NEAR)]  # fmt: skip


class Resolved(Protocol):
    """A row whose defect is certain, or whose resolution says what could be hidden."""

    @property
    def certain(self) -> float | None:
        """The part of the defect that exceeds its errors; None where it was not measured."""
        ...

    @property
    def resolution(self) -> float | None:
        """The largest defect that its errors may hide."""
        ...

    @property
    def left(self) -> float | None:
        """The defect that a method of the same order without a form leaves there."""
        ...


def undecided(case: Case, rows: Sequence[Resolved]) -> bool:
    """True if no defect is certain, and too few places clearly resolve the defect left there."""
    certain = [row.certain for row in rows if row.certain is not None]
    if not certain or is_defect(max(certain), case.rule.unit(16)):
        return False
    return sum(CLEARLY * row.resolution <= may_hide(case, row.left) for row in rows
               if row.resolution is not None and row.left is not None) < ENOUGH  # fmt: skip


def _row(case: Case, k: int, look: Look, scale: Vector, seed: int) -> OfNumbers:
    scheme: Any = case.scheme
    flow = scheme.flow(look.step)
    row = OfNumbers(float(look.step), k, float(look.time), state=look.z.tolist())
    f = map_of(flow, look.count, look.time)
    try:
        after = f(look.z)
    except StepFailure as failure:
        return replace(row, why_not=failure.cause)
    n, size = flow.system.n, len(look.z)
    g = guarded(f, size)
    embed, reach = free_states(case, flow.system, look.z, scale)
    around = embedded(case, g, look.z, embed)
    noise = noise_of(around, 0 * reach, reach, scheme.rule.unit(16), seed + k)
    again = _again(g, look.z, after, scale)
    rough = np.maximum(noise.jump, noise.level * (noise.level > SMOOTH * np.abs(after).max()))
    volume = loop = None
    own: list[Held] = []
    if case.scene.all_constraints:
        defects = [_restricted(n, g, embed, reach, noise)]
    else:
        of, own = of_step(flow, g, look, scale, noise)
        own += of_run(flow, look, scale, seed, k)
        tensors = (flow.system.tensor(z[:n], z[n:]) for z in (look.z, after))
        defects = [form_defect(of, *tensors)]
        volume = volume_defect(of)
    entry = _entry(defects[0].entry, n)
    # if differences show a defect, no closed curve is needed; those on leaves cost more
    seen = _leaves(case) and is_defect(defects[0].certain, scheme.rule.unit(16))
    if not (case.scene.all_constraints or seen):
        random = np.random.default_rng(seed + k)
        loops = [_loop(case, flow, g, look, scale, noise, random) for _ in range(LOOPS)]
        loop = max(one.measured for one in loops)
        unseen = UNSEEN * max(one.resolution for one in loops)
        defects.append(Defect(max(one.certain for one in loops), loop, unseen))
    certain = max(d.certain for d in defects)
    return replace(
        row, certain=certain, poisson=max(certain, min(d.measured for d in defects)),
        resolution=min(d.resolution for d in defects), left=left_by(case, look), loop=loop,
        volume=volume, again=again, derivatives=own, noise=float((rough / scale).max()),
        entry=entry, jacobian=next((e.off for e in own if e.what == "jacobian"), None),
    )  # fmt: skip


def _leaves(case: Case) -> bool:
    """True if closed curves lie on symplectic leaves, which are not the whole space of states."""
    return bool(not case.scene.groupoid.canonical)


def _loop(
    case: Case, flow: Any, g: Any, look: Look, scale: Vector, noise: Any, random: Any
) -> Defect:
    """Return the defect over a random closed curve, a smaller one if its image is not resolved."""
    for reach in REACHES:
        curve = random_curve(random, look.z, scale, reach)
        defect = curve_defect(case, flow.system, g, look.z, scale, curve, noise)
        if np.isfinite(defect.resolution):
            break
    return defect


def curve_defect(
    case: Case, system: Any, f: Any, z: Vector, scale: Vector, curve: Matrix, noise: Any = None
) -> Defect:
    """Return the defect of the form over a closed curve of states (r, n+m) about z."""
    n = system.n

    def tensor(columns: Any) -> Any:
        return system.tensor(columns[:n], columns[n:])

    if _leaves(case):
        return leaf_defect(f, tensor, z, scale, curve - z, noise)
    return loop_defect(f, curve, n, noise)


def free_states(case: Case, system: Any, z: Vector, scale: Vector) -> tuple[Any, Vector]:
    """Return (y ↦ state, the size of y): parameters of free states around z."""
    if case.scene.all_constraints:
        return constrained_parameters(system, z, scale)
    return (lambda y: z + y), scale


def embedded(case: Case, f: Any, z: Vector, embed: Any) -> Any:
    """Return f in those parameters."""
    return (lambda y: f(embed(y))) if case.scene.all_constraints else shifted(f, z)


def _restricted(n: int, g: Any, embed: Any, reach: Vector, noise: Any) -> Defect:
    """Return the defect of dq ∧ dp on the states that holonomic constraints leave free."""
    form = np.block([[np.zeros((n, n)), np.eye(n)], [-np.eye(n), np.zeros((n, n))]])
    start = derivative(embed, 2 * n, reach, noise_of(embed, 0 * reach, reach, 2.0**-53))
    of = derivative(lambda y: g(embed(y)), 2 * n, reach, noise)
    return pulled_back_defect(of, start, form)


def _again(g: Any, z: Vector, after: Vector, scale: Vector) -> float:
    """Return the difference of a step repeated after others, relative to the motion."""
    worst = 0.0
    for part in (0.01, -0.02, 0.05):
        g(z + part * scale)
        gap = np.abs(g(z) - after) / (np.abs(after) + scale)
        worst = max(worst, float(gap.max()) if np.isfinite(gap).all() else 1.0)
    return worst


def left_by(case: Case, look: Look) -> float:
    """Return the defect that a method of the order, but not symplectic, would leave.

    It is the rest of the series of exp(hA) after the power p, as for a Taylor method; A has the
    rate of the motion there. The motion of a map of one step is unknown: it may leave nothing.
    """
    if not case.rule.follows_motion:
        return 1.0
    p = case.order or UNKNOWN_ORDER
    z = float(look.step) * look.rate
    return min(1.0, look.count * z ** (p + 1) / math.factorial(p + 1))


def _entry(at: Sequence[int], n: int) -> str:
    names = [f"x[{i}]" if i < n else f"mu[{i - n}]" for i in at]
    return f"{{{', '.join(names)}}}" if names else ""


def decisive(case: Case, rows: Sequence[Resolved]) -> Resolved:
    """Return the row whose resolution `ENOUGH` places reach, relative to what a pass may hide."""
    reached = sorted((row.resolution / (may_hide(case, row.left or 0.0) or 2.0**-1022), k)
                     for k, row in enumerate(rows) if row.resolution is not None)  # fmt: skip
    return rows[reached[min(ENOUGH, len(reached)) - 1][1]]


def _measured(case: Case, rows: Sequence[OfNumbers]) -> MeasuredOfNumbers:
    seen = [r for r in rows if r.certain is not None]
    if not seen:
        return MeasuredOfNumbers()
    resolution = decisive(case, rows).resolution or 0.0
    certain = max(r.certain or 0.0 for r in seen)
    # where differences resolve far less than elsewhere, their defect is their own error
    told = [r.poisson or 0.0 for r in seen if (r.resolution or 0.0) <= 1e3 * resolution]
    again = max(r.again or 0.0 for r in seen)
    return MeasuredOfNumbers(None, max(certain, *told), certain, resolution, again)


def may_hide(case: Case, left: float = 1.0) -> float:
    """Return the largest defect that a pass may hide, where other methods leave a defect `left`.

    It is in units of the program's round-off, and at most a hundredth of `left`.
    """
    most = max(RESOLVED * left, FINE)
    return min(0.01 * left, most * case.rule.unit(16) / 2.0**-53)


def wanted_share(case: Case, left: float) -> float:
    """Return `may_hide` as a share of the defect left by other methods, for tables."""
    return may_hide(case, left) / left if left else may_hide(case)


def at_step(case: Case, row: Any) -> str:
    """Return the step and the time of a row in words, beside the scene's step if it is longer."""
    times = row.step / float(case.scene.step)
    of_scene = f" ({times:.2g} times the scene's)" if times > 2 else ""
    return f"at step {row.step:.3g}{of_scene}, t = {row.time:.3g}"
