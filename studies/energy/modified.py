"""The changes of the modified energy along a run, and along runs from places beside the motion."""

from __future__ import annotations

import random
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import StepFailure
from discmech.integrators.equations import initial_momentum
from discmech.integrators.errors import DiscmechError
from discmech.integrators.flows import Trajectory

from ..core.case import Case
from ..core.fitting import steadiness
from ..evidence import evidence_of
from ..systems.modified_change import Change
from ..systems.modified_energy import NUMBERS, STATES, changes, dual_of
from ..systems.moving_energy import moving_energy
from ..systems.runs import usual_steps
from .limits import LIMITS
from .records import Beside

QUICK = 10**5  # steps of the usual run of a rule with cheap steps
PLACES, STEPS, STATES_BESIDE = 2, 2000, 8  # places beside the motion, and the runs from there
ASIDE = 0.02, 0.1  # shares of a coordinate's size by which they lie beside it
STEP = 0.55, 0.95  # shares of the scene's step


def measured(case: Case, run: Trajectory, steps: int) -> list[Change]:
    """Return `Changes.rows` over the energy that moves, of a run of the scene's step; [] if
    unknown.

    A program that cannot make a long run soon is not run for some hundred short ones either.
    """
    if usual_steps(case) < QUICK:
        return []
    return _rows(case, case.scene.step, run, steps)[0]


def _rows(
    case: Case, step: Fraction, run: Trajectory, steps: int, states: int = STATES
) -> tuple[list[Change], float]:
    """Return (`Changes.rows` over the energy that moves, the band of these states).

    Another form that the method may keep is sought only if a run seems to drift.
    """
    scale = moving_energy(case.scene) or 1.0
    differences = changes(case.scheme, step, run, steps, states)
    if differences is not None and _seems_to_drift(differences.rows(scale)):
        differences = changes(case.scheme, step, run, steps, states, form=True)
    if differences is None:
        return [], 0.0
    return differences.rows(scale), float(np.ptp(differences.of_energy)) / scale


def _seems_to_drift(rows: Sequence[Change]) -> bool:
    """True if the modified energy goes one way, or drifts for certain, with the canonical form."""
    beyond = abs(rows[-1].modified) > rows[-1].bound
    return (beyond and goes_one_way(rows)) or certain_drift(rows) is not None


def beside(case: Case) -> list[Beside]:
    """Return the changes along short runs from places that lie beside the motion.

    They lie off it in every coordinate, so off its planes of symmetry, with steps that are no
    h·2⁻ᵏ, which the scene's own run cannot show. They are drawn from the seed of the evidence.
    """
    dual, scene = dual_of(case.scene), case.scene
    if dual is None or not case.rule.is_formula:
        return []
    drawn = random.Random(f"{evidence_of(case.scheme).seed} energy")
    start = np.array([float(e) for e in _start(case)])
    runs: list[Beside] = []
    for _ in range(PLACES):
        size = np.abs(start)
        parts = (size[: dual.n], size[dual.n :])
        sizes = np.concatenate([np.where(e > 0, e, e.max(initial=0.0) or 1.0) for e in parts])
        aside = [drawn.choice((-1, 1)) * drawn.uniform(*ASIDE) for _ in start]
        place = start + sizes * aside
        step = Fraction(scene.step) * Fraction(drawn.uniform(*STEP))
        try:
            flow = case.scheme.flow(step, 16)
            run = flow.trajectory(STEPS, x0=place[: dual.n] if dual.n else None,
                                  mu0=place[dual.n :])  # fmt: skip
            rows, band = _rows(case, step, run, STEPS, STATES_BESIDE)
        except (StepFailure, DiscmechError):
            continue
        if rows:
            runs.append(Beside(place.tolist(), float(step), band, rows))
    return runs


def _start(case: Case) -> list[Any]:
    s = case.scheme.s
    with NUMBERS.working():
        x = [NUMBERS.number(e) for e in case.scene.x0]
        return [*x, *initial_momentum(s, case.scene, NUMBERS)]


def resolved(rows: Sequence[Change], band: float) -> list[Change]:
    """Return the rows whose change is known to a share of the band, or to round-off.

    A way that changes H̃ − H by more than the band does shows something else than the run.
    """
    return [
        r for r in rows
        if r.bound <= max(LIMITS["known"] * band, 2 * r.round_off)
        and r.path <= max(LIMITS["elsewhere"] * band, 2 * r.round_off)
    ]  # fmt: skip


def certain_drift(rows: Sequence[Change]) -> Change | None:
    """Return the last resolved row if the modified energy goes one way, beyond any effect of
    states.

    For a symplectic method the changes vanish; if it keeps another form they are within a few times
    `form` (Newmark's β = 1/4 on an orbit that turns slowly). For another method they are as good as
    those of the energy where the state has come back, and are off by at most `path` where it has
    not. Or each of many states has gone farther than the one before, along a line, and they come
    back as near as before: no walk is so straight, and a slow part of the motion goes away.
    """
    if len(rows) < 3:
        return None
    last, values = rows[-1], np.array([0.0, *(r.modified for r in rows)])
    beyond = abs(last.modified) - last.bound - LIMITS["beyond"] * last.form
    farther = abs(np.sign(np.diff(values)).sum()) == len(rows)
    if beyond > 0 and len(rows) >= LIMITS["many"] and farther:
        times, paths = np.array([r.time for r in rows]), [r.path for r in rows]
        off = np.abs(values[1:] - times / times[-1] * values[-1]).max()
        half = len(rows) // 2
        as_near = 2 * max(paths[:half]) >= max(paths[half:])
        if off <= LIMITS["straight"] * abs(values[-1]) and as_near:
            return last
    beyond -= last.walk
    return last if beyond > LIMITS["beyond"] * last.path and goes_one_way(rows) else None


def drift_beside(places: Sequence[Beside]) -> tuple[Beside, Change] | None:
    """Return the first place from which the energy drifts for certain, and the row with it."""
    for place in places:
        drift = certain_drift(resolved(place.rows, place.band))
        if drift is not None:
            return place, drift
    return None


def stands(rows: Sequence[Change], band: float) -> bool:
    """True if the modified energy stays within its uncertainty, in every one of these rows."""
    most = LIMITS["stands"] * band
    return bool(rows) and all(
        abs(r.modified) <= min(r.bound, max(most, 2 * r.round_off)) for r in rows
    )


def covers(rows: Sequence[Change], duration: float) -> bool:
    """True if rows cover the whole run, to its last quarter."""
    return bool(rows) and rows[-1].time >= 0.75 * duration


def goes_one_way(rows: Sequence[Change]) -> bool:
    """True if the modified energy goes one way from row to row, on one side in the later half.

    One state far off, where the series of H̃ is worth little, is most of the way by itself.
    """
    values = np.array([0.0, *(r.modified for r in rows)])
    sides = np.sign(values[1 + len(rows) // 2 :])
    return steadiness(values) >= LIMITS["steady"] and abs(sides.sum()) == len(sides)
