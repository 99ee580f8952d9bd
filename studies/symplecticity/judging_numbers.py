"""The judge of the form under a map of numbers, with three answers.

A defect beyond all errors is certain, and fails. Without one, the resolution is the smallest defect
that would have shown; a pass needs a resolution far below the defect of a method of this order that
is not symplectic. All other cases are inconclusive.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from discmech.integrators.numbers import jacobian, sympy

from ..core.case import Case, Verdict
from ..core.claims import keeps_volume, not_claimed
from ..core.outcome import named
from ..evidence.cloud import STEPS_ASKED, WIDE, in_box
from .in_numbers import ENOUGH, RESOLVED, at_step, decisive, may_hide, wanted_share
from .judging_form import is_defect
from .limits import LIMITS
from .own_derivatives import STEPS, may_be_hidden
from .records import FoundOfNumbers, Jump, OfNumbers

_ROUGH = (
    "the program is not smooth: the ends of its steps jump by {:.1e} of the motion between starts "
    "close by, as by an iteration that stops early, a comparison, or single precision"
)
#: what an iteration that stops early leaves in a derivative is its last correction, by which it
#: jumps, times the number of corrections, which is seldom more; smaller jumps are no cause
ITERATIONS = 100


def judge(case: Case, record: FoundOfNumbers) -> Verdict:
    """Fail a certain defect, pass a resolved absence, and name the missing evidence otherwise.

    Of a method that claims to keep volume the largest change of it is told beside any verdict.
    """
    verdict = _judged(case, record)
    changes = [row.volume.measured for row in record.rows if row.volume]
    if not changes or not keeps_volume(case.rule):
        return verdict
    return replace(verdict, measured={"volume": max(changes), **verdict.measured})


def _judged(case: Case, record: FoundOfNumbers) -> Verdict:
    measured, rows = record.measured, record.rows
    left = decisive(case, rows).left or 0.0 if measured.resolution else 0.0
    expected: dict[str, Any] = {"resolved": wanted_share(case, left)}
    reason = not_claimed(case.rule, "symplectic")
    if not reason and not _closed_force(case):
        reason = "forced: the exact flow changes the form, which need not be kept; measured only"
    certain = measured.certain
    if certain is None:
        said = f"the black box makes no step from any place around the motion: {rows[0].why_not}"
        return Verdict("fail", f"{said}.", expected)
    noise, again = max(row.noise for row in rows), measured.residual or 0.0
    if again > LIMITS["made again"] * case.rule.unit(16):
        said = f"the same step made again differs by {again:.2g} of the motion: it "
        said += "is no map of (q, p) and h, but keeps something between calls, or is random; a "
        said += "method with memory is a class with start, step and read."
        if not case.rule.repeats:
            said = f"the same run made again, up to one of its rows, ends {again:.2g} of the "
            said += "motion beside that row: it keeps something from an earlier run, is random, "
            said += "or its rows are interpolated. A row is the end of a run of so many steps."
        return Verdict("fail", said, expected)
    if wrong := _wrong(case, rows):
        return replace(wrong, expected=expected)
    unkept = _volume(case, rows)
    demanded = [*(["volume"] if keeps_volume(case.rule) else []), *_given_by(case)]
    if unkept and (reason or certain == 0):
        alone = {"demanded": demanded} if reason else {}
        return replace(unkept, expected=expected | alone)
    if reason:
        if unknown := _volume_unknown(case, rows) or _unseen(case, rows):
            return Verdict("inconclusive", unknown, expected)
        kept = ["volume is kept in single steps"] * keeps_volume(case.rule)
        said = "; ".join([*kept, *_looked_at(case, record)])
        said = f"{said[:1].upper()}{said[1:]}." if said else ""
        return Verdict("pass", said, {**expected, "not_demanded": reason, "demanded": demanded})
    rough = f"; {_ROUGH.format(noise)}" if noise else ""
    if is_defect(certain, case.rule.unit(16)):
        row = max(rows, key=lambda r: r.certain or 0.0)
        said = f"the form is not kept: its defect is {row.certain:.2g} beyond every error of the "
        said += f"differences, in {row.entry} {at_step(case, row)}"
        return Verdict("fail", said + rough * (noise * ITERATIONS >= certain) + ".", expected)
    if wrong := _jumps(case, record):
        return replace(wrong, expected=expected)
    run = record.run
    if run.broken:
        said = f"single steps keep the form, but a run does not: after {run.broken} steps of "
        said += f"{run.step:.3g} the defect over closed curves of starts is {run.certain:.2g} "
        said += f"beyond every error{rough * (noise * ITERATIONS * run.broken >= run.certain)}."
        return Verdict("fail", said, expected, measured={"run": run.certain})
    expected["left"] = left
    if missing := [r for r in rows if r.certain is None]:
        said = f"{len(missing)} of {len(rows)} steps around the motion failed"
        return Verdict("inconclusive", f"{said}: {missing[0].why_not}.", expected)
    resolution = measured.resolution or 0.0
    if resolution <= may_hide(case, left):
        if run.covered < run.wanted:
            said = "single steps keep the form, and closed curves of starts tell nothing of it "
            said += f"after more than {run.covered} steps of {run.step:.3g} of the motion"
            return Verdict("inconclusive", f"{said}{rough}.", expected)
        if unknown := _unseen(case, rows):
            return Verdict("inconclusive", unknown, expected)
        told = "the form is kept in single steps"
        if resolution > RESOLVED * left:
            told += f", but for defects of {resolution:.0e} of the motion,"
        told += f" and in runs of up to {run.seen} steps" if run.seen else ""
        told += " that together cover the motion" if run.covered > run.seen else ""
        if run.left:
            told += f"; its orbits leave the box after {run.left} steps or fewer, and end there"
        if not case.rule.follows_motion:
            told += "; the motion of a map of one step is not held against a scene's"
        told = "; ".join([told, *_looked_at(case, record)])
        return Verdict("pass", f"{told}.", {**expected, "steps": run.seen})
    said = f"no defect is seen, but one of {resolution:.1e} could be hidden, where a "
    said += f"method of this order that is not symplectic would leave {left:.1e}"
    return Verdict("inconclusive", f"{said}{rough}.", expected)


def _closed_force(case: Case) -> bool:
    """True if there is no force, or one that leaves the exact flow symplectic (dθ_f = 0).

    On a pair groupoid that is a force F(x, t) with ∂F_i/∂x_j = ∂F_j/∂x_i.
    """
    scene, s = case.scene, case.scheme.s
    if scene.force is None:
        return True
    if not scene.groupoid.canonical:
        return False
    force = list(s.force)
    by_x, by_u = jacobian(force, s.position), jacobian(force, s.u)
    return all(sympy.simplify(e) == 0 for e in [*by_u, *(by_x - by_x.T)])


def _given_by(case: Case) -> list[str]:
    """Return the names of the derivatives that a program gives, and that its steps are to have.

    On constraints there are none: the program's map is not defined beside them.
    """
    if case.scene.all_constraints:
        return []
    return [word for word in ("jacobian", "gradient") if getattr(case.rule, word, None) is not None]


def _wrong(case: Case, rows: Sequence[OfNumbers]) -> Verdict | None:
    """Return a fail if a program's own derivative is none of its steps."""
    departures = [(each.off, k, each) for k, row in enumerate(rows) for each in row.derivatives]
    off, k, worst = max(departures, key=lambda each: each[0], default=(0.0, 0, None))
    if worst is None or not is_defect(off, case.rule.unit(16)):
        return None
    of = "step" if worst.what == "jacobian" else f"run of {worst.steps} steps by {worst.by}"
    said = (
        f"its {worst.what} is not the derivative of its {of}: an entry is off by {off:.2g} of the "
        f"motion, beyond every error of the differences, {at_step(case, rows[k])}."
    )
    return Verdict("fail", said, measured={worst.what: off})


def _jumps(case: Case, record: FoundOfNumbers) -> Verdict | None:
    """Return a fail if a step jumps across a surface, so that it is not one to one.

    Steps smaller than what is no defect (`may_hide`) count as none. By a large one the images of
    the two sides are far apart, and may be those of no others.
    """
    left = decisive(case, record.rows).left or 0.0 if record.jumps else 0.0
    for jump in record.jumps:
        if jump.size <= may_hide(case, left) or not (jump.across or 0.0) > LIMITS["jump across"]:
            continue
        said = f"a step jumps by {jump.size:.2g} of the motion where it crosses {_at(jump)}, at "
        said += f"step {jump.step:.3g}, and not along the image of the surface that it jumps at: "
        if jump.size > LIMITS["jump nearby"]:
            said += "whether it is one to one, as a map that keeps the form is, is not known."
            return Verdict("inconclusive", said)
        said += "on either side it may keep the form, but the images of both overlap, or leave a "
        return Verdict("fail", said + "gap between them.", measured={"jump": jump.size})
    return None


def cause_of_jump(case: Case, record: FoundOfNumbers) -> dict[str, Any] | None:
    """Return the cause of a fail by a jump, or None."""
    if is_defect(record.measured.certain or 0.0, case.rule.unit(16)) or not _jumps(case, record):
        return None
    said = "look for what is done on one side alone: a comparison, a clip, a table's cell."
    return named("jump", said, {"state": list(record.jumps[0].state)})


def cause_in_box(case: Case, record: FoundOfNumbers) -> dict[str, Any] | None:
    """Return the cause of a form that a map of a box certainly loses, or None."""
    wrong = [row for row in record.rows if is_defect(row.certain or 0.0, case.rule.unit(16))]
    if not (wrong and in_box(case)):
        return None
    from .cause_in_box import of_box

    wrong_at, at = ({tuple(row.state) for row in rows} for rows in (wrong, record.rows))
    worst = max(wrong, key=lambda row: row.certain or 0.0)
    told = of_box(case, worst, f"at {len(wrong_at)} of {len(at)} states")
    return told and named(*told, {"state": list(worst.state)})


def _at(jump: Jump) -> str:
    x, mu = (", ".join(f"{e:.4g}" for e in part) for part in np.split(np.array(jump.state), 2))
    return f"x = ({x}), mu = ({mu})"


def _looked_at(case: Case, record: FoundOfNumbers) -> list[str]:
    """Return how far a derivative that is given was held against steps, and from how many states.

    Faults of a box, or of the states around a motion, may lie between these.
    """
    told, rows = [], record.rows
    for jump in record.jumps[:1]:
        told.append(f"it jumps by {jump.size:.2g} of the motion at {_at(jump)}, where "
                    "differences of states see either side alone")  # fmt: skip
    if record.around:
        share = record.around ** (-1 / len(rows[0].state))
        told.append(
            f"its box was looked at from {record.around} drawn states, one to {share:.2g} of each "
            "side" if in_box(case.scheme) else f"{record.around} more states, drawn up to {WIDE:g} "
            f"of the motion's size beside it, by {STEPS_ASKED}, were looked through by plain "
            "differences"
        )  # fmt: skip
    longer: dict[tuple[str, str], float] = {}
    for (what, by, steps), hidden in (best := _hidden(rows)).items():
        if steps > STEPS:
            longer[what, by] = min(hidden, longer.get((what, by), math.inf))
    for (what, by, steps), hidden in sorted(best.items()):
        if steps > STEPS and hidden > longer[what, by]:
            continue  # of longer runs that which hides least is told
        of = "steps" if what == "jacobian" else f"runs of {steps} steps"
        places = sum(any((e.what, e.by, e.steps) == (what, by, steps) for e in row.derivatives)
                     for row in rows)  # fmt: skip
        told.append(f"its {what} by {by} is that of {of} from {places} places, but for errors "
                    f"of {hidden:.0e} of the motion")  # fmt: skip
    return told


def _hidden(rows: Sequence[OfNumbers]) -> dict[tuple[str, str, int], float]:
    """Return what differences hide of each derivative that is given, at the place that tells most.

    The keys are its name, by what it is taken, and the steps of the run.
    """
    best: dict[tuple[str, str, int], float] = {}
    for each in (each for row in rows for each in row.derivatives):
        key = each.what, each.by, each.steps
        best[key] = min(best.get(key, math.inf), each.hidden)
    return best


def _unseen(case: Case, rows: Sequence[OfNumbers]) -> str:
    """Return why a derivative that is not wrong is not known to be right; or ""."""
    best = _hidden(rows)
    allowed = may_be_hidden(case.rule)
    for (what, by, steps), hidden in best.items():
        if steps <= STEPS and not hidden <= allowed:
            said = f"its {what} by {by} is that of its steps as far as differences see: an error "
            return f"{said}of {hidden:.1g} of the motion could be hidden."
    if missing := [word for word in _given_by(case) if word not in {what for what, *_ in best}]:
        return f"its {missing[0]} was not held against its steps: no place has such a run."
    return ""


def _volume(case: Case, rows: Sequence[OfNumbers]) -> Verdict | None:
    """Return a fail if volume is claimed and not kept."""
    if not keeps_volume(case.rule):
        return None
    of = [(row.volume.certain, k, row.volume) for k, row in enumerate(rows) if row.volume]
    certain, k, volume = max(of, key=lambda triple: triple[0], default=(0.0, 0, None))
    if volume is None or not is_defect(certain, case.rule.unit(16)):
        return None
    said = (
        f"volume is not kept: a step changes it by {volume.measured:.2g}, beyond every error of "
        f"the differences, {at_step(case, rows[k])}."
    )
    return Verdict("fail", said, measured={"volume": volume.measured})


def _volume_unknown(case: Case, rows: Sequence[OfNumbers]) -> str:
    """Return why a claim of volume without a form is undecided, a sentence; "" if decided."""
    if not keeps_volume(case.rule):
        return ""
    told = [r for r in rows if r.volume and r.left is not None
            and r.volume.resolution <= may_hide(case, r.left)]  # fmt: skip
    if len(told) >= min(ENOUGH, len(rows)):
        return ""
    return (
        f"no change of volume is seen, but {len(told)} of {len(rows)} places alone resolve what a "
        f"method of this order that does not keep it would leave; {ENOUGH} are needed."
    )
