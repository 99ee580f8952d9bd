"""Extremes: runs at the edge of each scene, and the signs and messages of their failures."""

from __future__ import annotations

import math
import shlex
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators import BadInput, Scheme, StepFailure
from discmech.integrators.scene import Scene

from ..core.case import Case, Choice, Progress, silent
from ..core.fingerprint import own_name
from ..systems.runs import energy_with_terms, relative_drifts
from .edges import EXTREMES, Extreme

NAME = "extremes"
NEEDS = f"it needs one of the bench's own scenes {', '.join(EXTREMES)}."
DIGITS = (16,)
# hω where the step resolves the motion, and where it does not
FINE, COARSE = Fraction(1, 10), Fraction(5)
#: steps by hω: a coarse one goes wrong in a few, and a reference has to follow fifty times as long
STEPS = {FINE: 256, COARSE: 64}
WRONG = 1e-2  # a relative error that has to be noticed
TRUSTED = 10  # the error may be so many times the difference from smaller steps
State = tuple[np.ndarray, np.ndarray]  # (x, μ)
REFINED = (1, 3, 16)  # an error that aliasing hides from one of these steps shows in another


@dataclass(frozen=True)
class ExtremeCase(Case):
    """One extreme of a scene with one rule."""

    extreme: Extreme = field(kw_only=True)

    @property
    def command(self) -> str:
        """The command that repeats this case."""
        return f"{super().command} --extreme {shlex.quote(self.extreme.name)}"


def cases(choice: Choice) -> list[Case]:
    """Return every extreme of every scene with every rule."""
    if choice.digits and 16 not in choice.digits:
        return []
    for scene in choice.scenes:
        names = [extreme.name for extreme in EXTREMES.get(own_name(scene), ())]
        for name in choice.asked("extreme", ()) if names else ():
            if name not in names:
                shown = ", ".join(f'"{word}"' for word in names)
                raise BadInput(f'{scene.name} has no extreme "{name}": it has {shown}.')
    return [
        ExtremeCase(NAME, scene, rule, 16, choice.steps, extreme=extreme)
        for scene, rule in choice.pairs()
        for extreme in EXTREMES.get(own_name(scene), ())
        if extreme.name in choice.asked("extreme", (extreme.name,))
    ]


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Return two rows, for a step that resolves the motion and one that does not.

    They are {z, step, steps, outcome, error, estimate, energy, noticed, message}. error: the larger
    of ‖x − x̂‖ and ‖μ − μ̂‖ at the end, each over its largest value in these runs and the
    reference, if there is a certified reference; estimate: the largest such difference from a third
    and a sixteenth of the step; noticed: the signs that a run is not right. measured: the rows by
    name, fine and coarse.
    """
    assert isinstance(case, ExtremeCase)
    progress(f"{case.scene.name} {case.label}: {case.extreme.name}", 0.0)
    rows = [one_extreme(case.scheme, case.extreme, z, case.steps or STEPS[z]) for z in STEPS]
    if any(row["outcome"] == "refused" for row in rows):
        with suppress(StepFailure):  # if it is refused away from the edge too, it is bad input
            case.scheme.flow(case.scene.step).trajectory(1)
    shown = ("outcome", "error", "estimate", "energy", "noticed", "message")
    measured = {
        name: {key: row[key] for key in shown}
        for name, row in zip(("fine", "coarse"), rows, strict=True)
    }
    return {"rows": rows, "measured": measured, "extreme": case.extreme.name}


def one_extreme(derived: Scheme, extreme: Extreme, z: Fraction, steps: int) -> dict[str, Any]:
    """Run it with this step and with smaller ones, and compare it with the reference."""
    step = Fraction(float(z) / extreme.frequency)
    row: dict[str, Any] = {"z": float(z), "step": float(step),
                           "steps": steps, "error": None, "estimate": None, "energy": None,
                           "noticed": "", "message": ""}  # fmt: skip
    derived.scene.with_values(**extreme.values)  # what it refuses is an error, and no sign
    try:
        scheme = derived.at(**extreme.values)
        ends = []
        for parts in REFINED:
            run = scheme.flow(step / parts).trajectory(steps * parts, every=parts)
            ends.append((run.x[-1], run.mu[-1]))
            if parts == 1:
                row["energy"] = _energy_error(scheme, run)
    except (StepFailure, BadInput) as failure:
        stopped = isinstance(failure, StepFailure)
        return row | {"outcome": "stopped" if stopped else "refused", "noticed": "message",
                      "message": str(failure)}  # fmt: skip
    truth = _truth(scheme.scene, steps * step)
    known = ends if truth is None else [*ends, truth]
    sizes = [max(map(_size, block)) or 1.0 for block in zip(*known, strict=True)]
    row["estimate"] = max(_gap(ends[0], end, sizes) for end in ends[1:])
    if truth is not None:
        row["error"] = _gap(ends[0], truth, sizes)
    return row | _told(row)


def _told(row: dict[str, Any]) -> dict[str, Any]:
    """Return the outcome of a run that returned: right, wrong and noticed, or wrong and silent.

    It is right if its error is within that of smaller steps. Numbers that are not finite raise
    before.
    """
    estimate, error, lost = row["estimate"], row["error"], row["energy"]
    signs = {"smaller steps": estimate > WRONG, "energy": lost is None or lost > WRONG}
    if error is None:
        return {"outcome": "no reference",
                "noticed": ", ".join(sign for sign, shown in signs.items() if shown)}  # fmt: skip
    if error <= WRONG and error <= max(TRUSTED * estimate, 1e-9):
        return {"outcome": "right", "noticed": ""}
    if TRUSTED * estimate >= min(error, 1.0):
        return {"outcome": "wrong, noticed", "noticed": "smaller steps"}
    if signs["energy"]:
        return {"outcome": "wrong, noticed", "noticed": "energy"}
    return {"outcome": "wrong, silent", "noticed": "nothing"}


def _gap(one: State, other: State, sizes: list[float]) -> float:
    """Return the larger relative difference of the two blocks."""
    return max(_size(a - b) / size for a, b, size in zip(one, other, sizes, strict=True))


def _size(vector: np.ndarray) -> float:
    """Return ‖v‖₂ without over- or underflow."""
    largest = float(np.abs(vector).max(initial=0.0))
    return largest * float(np.linalg.norm(vector / largest)) if largest else 0.0


def _energy_error(scheme: Scheme, run: Any) -> float | None:
    with np.errstate(all="ignore"):
        worst = float(relative_drifts(energy_with_terms(scheme, 16)(run), 16).max())
    return worst if math.isfinite(worst) else None


#: the answers of `_truth`, failures too, by the numbers of a scene: variants share their name
_truths: dict[str, State | None] = {}


def _truth(scene: Scene, end: Fraction) -> State | None:
    """Return the certified (x, μ) at the end, None if the reference has none."""
    key = str((scene.name, scene.parameters, scene.x0, scene.v0, end))
    if key not in _truths:
        _truths[key] = _certified(scene, end)
    return _truths[key]


def _certified(scene: Scene, end: Fraction) -> State | None:
    try:
        solution = reference.solution(scene, end, digits=15, proof=False)
    except reference.ReferenceFailure:
        return None
    if solution.certain_digits < 12:
        return None
    return np.array([*map(float, solution.x)]), np.array([*map(float, solution.mu)])
