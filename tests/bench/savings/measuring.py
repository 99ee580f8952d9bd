"""What leaving out work that a scene does not need is worth: each saving taken back by itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from discmech.integrators.compiler import SAVINGS
from discmech.integrators.flows import Flow
from discmech.integrators.groupoids import LieGroup
from discmech.studies.core.case import Case, Choice, Progress, plain_cases, scheme_of, silent
from discmech.studies.work_precision.kernel_work import operations, savings_made
from discmech.studies.work_precision.racing import race

NAME = "savings"
NEEDS = "it needs a Lagrangian, a rule of one step (no composition), and double precision."
DIGITS = (16,)
SHOWN = ("pendulum", "kepler", "rigid-body", "heavy-top")  # where no scene is chosen
STEPS, COMPARED = 20_000, 200
BUDGET = 0.5  # seconds of timing a case
AS_IT_IS, ALL, BASE = "none", "all of these", "no base"


@dataclass(frozen=True)
class Variant:
    """A flow that lacks one saving."""

    name: str
    flow: Flow
    base: int = 0  # entries of x that only this variant has


def cases(choice: Choice) -> list[Case]:
    """Every scene by every rule of one step; a few scenes where none is chosen (or --thorough)."""
    found = plain_cases(NAME, choice, DIGITS) if 16 in (choice.digits or DIGITS) else []
    every = choice.scenes or choice.thorough
    return [c for c in found if c.digits == 16 and (every or c.scene.name in SHOWN)
            and c.scene.lagrangian is not None and c.rule.method is None]  # fmt: skip


def together(case: Case) -> Case:
    """Itself: its variants are timed in turn, disturbed alike."""
    return case


def variants(case: Case) -> list[Variant]:
    """The flow as it is, without each saving that it makes, and without all of them."""
    scheme, step = case.scheme, case.scene.step
    plain = scheme.flow(step)
    made = savings_made(plain)
    found = [Variant(AS_IT_IS, plain)]
    taken_back = {name: [name] for name in SAVINGS if made[name]}
    if len(taken_back) > 1:
        taken_back[ALL] = [*taken_back]
    for name, without in taken_back.items():
        flow = scheme.flow(step)
        flow.without = frozenset(without)
        found.append(Variant(name, flow))
    if isinstance(case.scene.groupoid, LieGroup):
        whole = scheme_of(case.scene.with_attitude(), case.rule)
        found.append(Variant(BASE, whole.flow(step), len(whole.x)))
    return found


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows {variant, operations, corrections, bytes, seconds, seconds_low, seconds_high, samples,
    outliers, times, difference}: work and time of one step, kept bytes of one state with its
    coefficients, time relative to the kernel as it is, largest relative difference of μ.
    """
    several = variants(case)
    rows: list[dict[str, Any]] = []
    wanted = several[0].flow.trajectory(COMPARED).mu
    runs: list[Callable[[], object]] = []
    for variant in several:
        progress(f"{case.scene.name} {case.label}: {variant.name}", 0.3)
        run = variant.flow.trajectory(COMPARED)
        difference = np.abs(run.mu - wanted).max() / np.abs(wanted).max()
        solve, update = operations(variant.flow)
        corrections = variant.flow.trajectory(STEPS, STEPS).newton_mean
        rows.append({
            "variant": variant.name, "operations": solve * corrections + update,
            "corrections": corrections, "bytes": kept_bytes(variant.flow),
            "difference": float(difference),
        })  # fmt: skip
        runs.append(partial(variant.flow.trajectory, STEPS, STEPS))
    progress(f"{case.scene.name} {case.label}: timing", 0.6)
    timings = race(runs, BUDGET)
    for row, timing in zip(rows, timings, strict=True):
        row |= {"seconds": timing.median / STEPS, "seconds_low": timing.low / STEPS,
                "seconds_high": timing.high / STEPS, "samples": timing.samples,
                "outliers": timing.outliers,
                "times": timing.median / timings[0].median}  # fmt: skip
    return {"rows": rows, "measured": {"times": {r["variant"]: r["times"] for r in rows[1:]}}}


def kept_bytes(flow: Flow) -> int:
    """Of a state between two steps (with compensations and Newton's memory), and coefficients."""
    layout, c = flow._kernels.layout, flow.machine.c
    return 8 * (layout.memory + layout.row + c.size)
