"""Nonlinear stability: the class of a run at each step size and each stiffness."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import Scheme, StepFailure
from discmech.integrators.flows import side_by_side
from discmech.integrators.numbers import arithmetic

from ..systems.runs import energy_with_terms, relative_drifts, with_terms
from .records import Cell
from .stiff import Family

STEPS, THOROUGH = 60_000, 1_000_000
ROWS = 1000  # states of a run that are kept
PER_DECADE = {False: 10, True: 40}  # steps hω per decade, thorough or not
LOWEST, HIGHEST = -1.0, 1.4  # decades of hω
LONGER = 8
FAR = 10  # an escape is so many times the size of the true motion's region
DRIFT = 0.01  # share of the energy's terms: a smaller shift is an exchange between fast and slow
NOISE = 1e-10  # a band that is round-off does not resonate


def trajectory(scheme: Scheme, step: Fraction, steps: int) -> Any:
    """Return a run of the scheme's own flow with ROWS rows."""
    return scheme.flow(step).trajectory(steps, every=max(1, steps // ROWS))


def stability_map(
    family: Family, derived: Scheme, thorough: bool = False, steps: int | None = None,
    progress: Callable[[float], None] = lambda fraction: None, more: tuple[float, ...] = (),
) -> list[Cell]:  # fmt: skip
    """Return the cells of a map over z = hω and stiffness.

    Stiffnesses are in the family's order, z ascends in each. more: z between those of the grid,
    whose cells have `between`.
    """
    rows: list[Cell] = []
    count = steps or (THOROUGH if thorough else STEPS)
    for i, stiffness in enumerate(family.stiffness):
        column = _column(family, derived, stiffness, grid(thorough).tolist(), count, not steps)
        column = resonant(column, PER_DECADE[thorough] // PER_DECADE[False])
        if more:
            cells = _column(family, derived, stiffness, list(more), count, not steps)
            column += [replace(cell, between=True) for cell in cells]
        rows += sorted(column, key=lambda cell: cell.z)
        progress((i + 1) / len(family.stiffness))
    return rows


def _column(
    family: Family,
    derived: Scheme,
    stiffness: Fraction,
    zs: list[float],
    count: int,
    covering: bool,
) -> list[Cell]:
    """Return the cells at those hω of one stiffness, computed on all cores.

    covering: True for more steps than count, if the family asks for a time.
    """
    scheme = family.scheme(derived, stiffness)
    measures = _measures(family, scheme)
    far = FAR * family.region(stiffness) if family.region else math.inf

    def cell(z: float) -> Cell:
        step = Fraction(z / family.frequency(stiffness))
        cover = math.ceil(family.least / step)
        inside = max(count, cover) if covering and cover <= family.most else count
        outcome = one_run(scheme, step, inside, measures, far)
        return replace(outcome, stiffness=float(stiffness), z=z, step=float(step))

    if not derived.rule.is_formula:  # a program may not be safe in two threads
        return [cell(z) for z in zs]
    return side_by_side(cell, zs, arithmetic(16))


def grid(thorough: bool) -> np.ndarray:
    """Return values of hω, equal parts of decades, 1 and 10 among them."""
    per = PER_DECADE[thorough]
    return np.asarray(10.0 ** (np.arange(round(LOWEST * per), round(HIGHEST * per) + 1) / per))


def _measures(family: Family, scheme: Scheme) -> dict[str, Any]:
    """Return functions of a run: the energy, and the adiabatic invariant if there is one."""
    s = scheme.s
    measures = {"energy": energy_with_terms(scheme, 16)}
    for quantity in scheme.scene.symmetries:
        if quantity.name == family.adiabatic:
            measures["adiabatic"] = with_terms(scheme, s.conserved(quantity), 16)
    return measures


def one_run(
    scheme: Scheme, step: Fraction, steps: int, measures: dict[str, Any], far: float = math.inf,
    again: bool = True,
) -> Cell:  # fmt: skip
    """Return the class and numbers of one run; `resonant` is decided later, from its neighbours.

    far: ‖x‖ that counts as an escape. A shift of the energy may be a part of a slow motion: then
    the run is made `again`, longer.
    """
    cause = ""
    try:
        run = trajectory(scheme, step, steps)
    except StepFailure as failure:
        run, cause = failure.trajectory, failure.cause
    done = run.steps
    told = Cell(steps=done, time=float(step * done), cause=cause)
    if not len(run.t):  # not even the start has a velocity
        return replace(told, outcome="Newton failed" if "Newton" in cause else "blown up")
    with np.errstate(all="ignore"):
        values, terms = measures["energy"](run)
        errors = (values[:, 0] - values[0, 0]) / terms[0, 0]
        if "adiabatic" in measures and not cause:
            drifts = relative_drifts(measures["adiabatic"](run), 16)
            told = replace(told, adiabatic=float(drifts.max()))
    if "Newton" in cause:
        return replace(told, outcome="Newton failed")
    if cause or not np.abs(errors).max() <= 1:
        return replace(told, outcome="blown up")
    if math.isfinite(far) and np.linalg.norm(run.x, axis=1).max() > far:
        return replace(told, outcome="escaped")
    band, tenth = float(np.ptp(errors)), max(1, len(errors) // 10)
    shift = abs(float(errors[-tenth:].mean() - errors[:tenth].mean()))
    drifting = shift > max(band / 2, DRIFT)
    if drifting and again:
        return one_run(scheme, step, LONGER * steps, measures, far, again=False)
    return replace(told, band=band, outcome="drifting" if drifting else "bounded")


def resonant(column: Sequence[Cell], apart: int = 1) -> list[Cell]:
    """Return the cells, a bounded one as resonant if its band is far wider than those a tenth of a
    decade of hω away.

    apart: cells in a tenth of a decade. Without a resonance bands grow with hω: none is wider than
    that of the longer step, by far less than four times. So at the shortest steps the longer one
    alone decides; where a neighbour has no band, or there is no longer one, the class stays.
    """
    cells = list(column)
    for i, (here, longer) in enumerate(zip(column, column[apart:], strict=False)):
        if here.outcome != "bounded" or here.band is None or longer.band is None:
            continue
        shorter = column[i - apart].band if i >= apart else 0.0
        if shorter is not None and here.band > max(NOISE, 4 * shorter, 4 * longer.band):
            cells[i] = replace(here, outcome="resonant")
    return cells


def limits(rows: Sequence[Cell]) -> dict[str, float]:
    """Return per stiffness the largest z up to which all runs are bounded; 0 without any."""
    columns = itertools.groupby(rows, key=lambda cell: cell.stiffness)
    return {
        f"{stiffness:g}": max(
            (cell.z for cell in itertools.takewhile(lambda c: c.outcome == "bounded", column)),
            default=0.0,
        )
        for stiffness, column in columns
    }
