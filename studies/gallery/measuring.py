"""The studies' verdicts on a method of the gallery, compared with its documented claims."""

from __future__ import annotations

from typing import Any

from discmech.integrators import StepFailure, scenes
from discmech.integrators.errors import BadInput

from ..core.case import Case, Progress, silent
from ..core.one_case import run_case
from ..core.study import every_study
from ..order.limits import tolerance
from ..work_precision.racing import race
from .entries import Entry

#: the studies that are run, and the claim that each judges
ASKED = {
    "order": "order", "symplecticity": "symplectic", "energy": "keeps", "momentum": "keeps",
    "reversibility": "reversible",
}  # fmt: skip
LONG = 5000  # steps of the runs of energy and momentum: the slowest library takes 1 ms a step
TIMED = 2000  # steps of the runs that are timed
DIGITS = 16
#: a few roundings in each step of a long run, all of one sign
EXACT = 4 * 2.0**-52 * LONG


def measured(entry: Entry, progress: Progress = silent) -> dict[str, Any]:
    """Return {"name", "scene", "package", "version", "claim", "place", "note", "own_steps",
    "studies", "seconds", "differs", "untold"}.

    studies: of each its verdict, reason and measured numbers; seconds: of a step; differs: a
    sentence for each denied claim; untold: one for each undecided claim.
    """
    box, scene = entry.box, scenes.get(entry.scene)
    studies: dict[str, Any] = {}
    differs, untold = [], []
    for name, claim in ASKED.items():
        study = every_study()[name]
        steps = LONG if name in ("energy", "momentum") else None
        case = Case(name, scene, box, DIGITS, steps)
        if name == "momentum" and not scene.symmetries:
            continue
        result = run_case(study, case, progress, causes=False)
        studies[name] = {"verdict": result.verdict, "reason": result.reason,
                         "measured": result.figures}  # fmt: skip
        if name == "energy" and entry.claims.get("symplectic"):
            claim = "symplectic"
        failed, order = result.verdict == "fail", result.figures.get("order")
        if name == "order" and entry.multistep and order is not None:
            failed = abs(order - entry.claims["order"]) > tolerance(16)
        if entry.claims.get(claim) and failed:
            differs.append(result.reason)
        elif entry.claims.get(claim) and result.verdict == "inconclusive":
            untold.append(result.reason)
    band = studies["energy"]["measured"].get("band")
    if entry.exact and not (band is not None and band <= EXACT):
        differs.append(f"the energy is not kept exactly: its error has a band of {band:.1e}.")
    return {
        "name": entry.name, "scene": entry.scene, "package": entry.package,
        "version": entry.version, "claim": entry.claim, "place": entry.place, "note": entry.note,
        "own_steps": entry.own_steps,
        "claims": {key: value for key, value in entry.claims.items() if key != "state"},
        "studies": studies, "seconds": _seconds(entry, box, scene), "differs": differs,
        "untold": untold,
    }  # fmt: skip


def _seconds(entry: Entry, box: Any, scene: Any) -> float | None:
    """Return the time of a step, or from row to row (`race`); None if the run fails."""
    from discmech.integrators import Scheme

    flow, every = Scheme(scene, box).flow(scene.step), 1 if entry.own_steps else TIMED
    try:
        (timing,) = race([lambda: flow.trajectory(TIMED, every)], 0.0)
    except (StepFailure, BadInput):
        return None
    return timing.median / TIMED
