"""The changes of the modified energy along a run, and along runs from places beside the motion."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import StepFailure
from discmech.integrators.equations import initial_momentum
from discmech.integrators.errors import DiscmechError
from discmech.integrators.flows import Trajectory

from ..core.case import Case
from ..evidence import evidence_of
from ..systems.modified_change import Change
from ..systems.modified_energy import NUMBERS, STATES, changes, dual_of
from ..systems.moving_energy import moving_energy
from ..systems.runs import usual_steps
from .judging_modified import seems_to_drift
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
    if differences is not None and seems_to_drift(differences.rows(scale)):
        differences = changes(case.scheme, step, run, steps, states, form=True)
    if differences is None:
        return [], 0.0
    return differences.rows(scale), float(np.ptp(differences.of_energy)) / scale


def beside(case: Case) -> list[Beside]:
    """Return the changes along short runs from places that lie beside the motion.

    They lie off it in every coordinate, so off its planes of symmetry, with steps that are no
    h·2⁻ᵏ, which the scene's own run cannot show. They are drawn from the seed of the evidence.
    """
    dual, scene = dual_of(case.scene), case.scene
    if dual is None:
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
