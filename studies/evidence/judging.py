"""Combine the verdict of runs with single steps: a pass needs both.

A run of one trajectory may hide a lower order, another motion, or a law that is broken beside it.
So this judge stands at the end of each study's own.
"""

from __future__ import annotations

from ..core.case import Measurement, Verdict
from ..core.outcome import KEPT_ELSEWHERE, NOT_CONSISTENT, STEPS_ARE_OFF
from ..core.records import decoded
from ..core.single_steps import ALIKE, ROW, Departure, SingleSteps
from . import NEAR
from .cloud import STEPS_ASKED, WIDE
from .laws import AGAIN, ARROW, ENERGY, FORM, VOLUME, WAY_BACK

#: the key of the record in a measurement
LOCAL = "local"
#: of a law: what the run does, and what a step does, with the size after it, and what follows
WORDS = {
    FORM.name: ("keeps the form", "has a {name} defect of", ""),
    VOLUME.name: ("keeps volume", "changes it by", ""),
    WAY_BACK.name: (
        "goes back to its start", "and back misses it by", ": Φ₋ₕ is not the inverse of Φₕ"
    ),
    AGAIN.name: (
        "is judged as steps", "and 15 more, made again, differ from the run by",
        ": it keeps something from an earlier step or run, is random, returns an attitude that is "
        "no rotation, or its rows are those of another run",
    ),
    ARROW.name: (
        "moves (x, μ) rightly", "has an arrow u that differs from the velocity ξ(x, μ) by",
        ": the body turns as another one, as with a Casimir added to H",
    ),
    ENERGY[True].name: ("keeps the energy in its band", "changes the energy by", ""),
}  # fmt: skip
#: what the limit of a law allows for, where it is more than round-off
ALLOWS = {ARROW.name: "a step so short"}
OF_A_QUANTITY = ("keeps {name}", "changes {name} by", "")


def demand_consistency(
    measurement: Measurement, verdict: Verdict, *laws: str, kept: str = ""
) -> Verdict:
    """Return the verdict of the runs, or a fail if a single step is not consistent.

    It is for studies that a rule of any order passes. laws: names of those that each step keeps,
    too. kept: the sentence that a pass of the runs proves, such as "the form is kept"; the reason
    says that another motion does. If the scene has no exact motion to compare single steps with,
    the verdict of the runs stands; if the rule makes no single step, it does not pass, for the
    motion that it approximates as the step goes to 0 is unknown.
    """
    local = measurement.get(LOCAL)
    if local is None:
        return verdict
    kept = "" if "not_demanded" in verdict.expected else kept
    return judge(decoded(SingleSteps, local), verdict, *laws, kept=kept)


def judge(
    local: SingleSteps | None, verdict: Verdict, *laws: str, wanted: int | None = None,
    asks_order: bool = False, what: str = "", kept: str = "",
) -> Verdict:  # fmt: skip
    """Return the verdict of the runs combined with the single steps: a pass needs both.

    wanted: the declared order; without one, steps need only be consistent. asks_order: True if a
    pass needs an order that is known. what: the name of the system that made the steps, for the
    reason. kept: as of `demand_consistency`.
    """
    if local is None:
        return verdict
    for law in (*laws, AGAIN.name, ARROW.name) if verdict.verdict != "fail" else ():
        one = local.laws.get(law)
        if one is not None and one.broken:
            said = broken(law, one, local.seed, what, kept=verdict.verdict == "pass")
            return Verdict("fail", said, verdict.expected, why=STEPS_ARE_OFF)
    verdict = _of_order(local, verdict, wanted, asks_order, what, kept)
    if verdict.verdict != "pass":
        return verdict
    told = [verdict.reason]
    if local.unscanned:
        told.append("faults in narrow parts of the motion were not looked for, since no run was "
                    f"made {local.unscanned}")  # fmt: skip
    if local.around:
        of = " to ".join(f"{size:.1g}" for size in local.sizes)
        told.append(f"Beside the motion short steps, of {of} of the scene's, were looked at from "
                    f"{local.around} drawn states, up to {WIDE:g} of its size away.")  # fmt: skip
    again = local.laws.get(AGAIN.name, Departure())
    if again.asked and again.unknown:
        said = f"nothing is wrong with the runs, but {again.unknown}."
        return Verdict("inconclusive", said, verdict.expected)
    if again.unknown:
        told.append(f"Whether it counts its steps is not known: {again.unknown.rstrip('.')}.")
    if again.asked:
        told.append(f"Nothing that counts its steps shows in {again.asked} steps of one run.")
    if asked := max((one.asked for law in laws if (one := local.laws.get(law))), default=0):
        told.append(f"Along it {STEPS_ASKED} were looked at from {asked} states.")
    return verdict.because(" ".join(filter(None, told)))


def _of_order(
    local: SingleSteps, verdict: Verdict, wanted: int | None, asks_order: bool, what: str, kept: str
) -> Verdict:
    """Return the verdict with the order of single steps, below which the runs deny nothing."""
    if local.exact or local.floats.explain:
        return verdict
    if local.order is None:
        open_to = verdict.verdict == "pass" and "not_demanded" not in verdict.expected
        if not open_to or not local.unknown or not (asks_order or local.refused):
            return verdict
        said = f"nothing is wrong with the runs, but no single step is judged: {local.unknown}"
        return Verdict("inconclusive", said.rstrip(".") + ".", verdict.expected)
    verdict = verdict.expecting(local_order=local.order) if asks_order else verdict
    if local.order >= (wanted or 1) - NEAR or verdict.verdict == "fail":
        return verdict
    said = lower(local, wanted, what)
    why = NOT_CONSISTENT if local.order < 1 - NEAR else STEPS_ARE_OFF
    if kept and verdict.verdict == "pass":
        said, why = f"{kept}, but by another motion than the scene's: {said}", KEPT_ELSEWHERE
    elif not asks_order and verdict.verdict == "pass":
        said = f"the runs show no fault, but {said}"
    return Verdict("fail", said, verdict.expected, why=why)


def lower(local: SingleSteps, wanted: int | None, what: str = "") -> str:
    """Return the sentence on steps of an order below the wanted one."""
    order, least = local.order or 0.0, wanted or 1
    places = [local.place, "" if local.seed is None else f"seed {local.seed}"]
    where = f" ({', '.join(filter(None, places))})" if local.place else ""
    one = f"one step{f' of {what}' if what else ''}"
    if order < 1 - NEAR:
        return (
            f"the rule is not consistent: {one}, of {local.step:.1g} from an exact state{where}, "
            f"is wrong in {local.component} by O(h^{order + 1:.2f}), and a consistent one by at "
            "most O(h^2). As h goes to 0 it follows another motion, unless later steps undo that."
        )
    said = f"{one} is of order {order:.2f} in {local.component}, "
    said += f"below {'the expected ' if wanted else ''}{least}: from an exact state"
    said += f"{where} a step of {local.step:.1g} is off by O(h^{order + 1:.2f})"
    if (along := local.on_motion or 0.0) >= least - NEAR:
        return (
            f"{said}. The rule is of order {along:.2f} along the motion of the scene and of order "
            f"{order:.2f} beside it, as where coefficients are computed from the scene's start."
        )
    return f"{said}, however little that is in the runs."


def broken(law: str, one: Departure, seed: int | None, what: str = "", kept: bool = True) -> str:
    """Return the sentence on a step that does not keep a law.

    what: the motion that the step is of, where that is no run of the study. kept: whether the run
    is known to keep it.
    """
    if one.name == ALIKE:
        return f"{ALIKE}."
    if one.place.startswith(ROW):
        said = f"from {one.place} {one.name} changes by {one.size:.2g}, where "
        return f"{said}round-off would leave at most {one.limit:.0e}."
    run, step, then = (words.format(name=one.name) for words in WORDS.get(law, OF_A_QUANTITY))
    said = f"in {what} " if what else f"the run {run}, but " * kept
    drawn = "" if seed is None else f" (seed {seed})"
    return (
        f"{said}a step of {one.step:.3g} from {one.place}, a place that was drawn "
        f"{'on' if one.on_motion else 'beside'} the motion{drawn}, {step} {one.size:.2g}, where "
        f"{ALLOWS.get(law, 'round-off')} would leave at most {one.limit:.0e}{then}."
    )
