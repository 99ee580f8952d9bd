"""Compare a result with an earlier one saved under a name: worse, better, equal, or undecided.

Each lies in a sealed file of its own, `baseline_folder()`/NAME/STUDY.json: it cannot be made again,
so it is not part of the cache.

A case is compared with one that was asked of the same scene (`asked_of`). Its verdict is, whether
something is demanded no longer, and its figures (`_figures`): those that `View.compared` gives, the
floor of a program's own numbers, times, and errors at equal steps. Two figures differ if their
spreads do not meet, times if they are a factor of `APART` from each other; times are compared only
on one machine with equal versions. Where nothing but the verdict and figures within a limit can be
compared, that is the answer.
"""

from __future__ import annotations

import errno
import json
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discmech.integrators import BadInput
from discmech.integrators.compiler import Damaged, seal, unsealed
from discmech.integrators.errors import CouldNotRun, shown
from discmech.integrators.numbers import flatten
from discmech.integrators.places import baseline_folder, make_private
from discmech.integrators.scene import Opaque, reads

from .outcome import VERDICTS
from .records import Json, number
from .result import SCHEMA, AnyResult, StudyResult, study_result_of
from .study import view_of

if TYPE_CHECKING:
    from .case import Choice
    from .study import Study

#: of a case that was asked of another scene, or is left out by the words of the command
OTHER = "cannot be compared"
#: in the order in which they are shown
ANSWERS = ("worse", OTHER, "cannot tell", "better", "same verdict", "equal")
#: eight scenes timed again six times, by one process or two, without any change, on cores that
#: others use: quartiles of equal cases were up to 1.31 from each other
APART = 1.5


@dataclass(frozen=True, slots=True)
class Line:
    """The change of a case: one of `ANSWERS`, and why."""

    case: str
    command: str
    answer: str
    why: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """The change of each case, the worse ones first, since the baseline of that date and commit.

    environment: other differences, as (what, then, now).
    """

    name: str
    date: str | None
    commit: str | None
    environment: list[tuple[str, str, str]]
    lines: list[Line]


def checked_name(name: str) -> str:
    """Return a name that a baseline may have; raises `BadInput` for any other."""
    if not re.fullmatch(r"[A-Za-z0-9][\w.-]{0,80}", name):
        raise BadInput(f"a baseline's name is {shown(name)}: use letters, digits, dots and dashes.")
    return name


def check_kept(name: str, study: str) -> None:
    """Raise `BadInput` if a result cannot be saved, so that nothing would ever be compared."""
    path = _file(name, study)
    try:
        _replaceable(path)
        make_private(path.parent)
        if not os.access(path.parent, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        raise BadInput(
            f"the baseline {name} cannot be kept ({path}: {error.strerror}); name a folder in "
            "DISCMECH_CACHE."
        ) from None


def save(name: str, result: StudyResult) -> Path:
    """Save a result under a name, in place of an older one of that name and study.

    Returns its file. Raises `BadInput` for one there that `save` did not write, `CouldNotRun` if
    the disk does not take it.
    """
    path = _file(name, result.study)
    _replaceable(path)
    try:
        seal(path, json.dumps(result.to_json()))
    except OSError as error:
        raise CouldNotRun(
            f"the baseline {name} cannot be saved ({path}: {error.strerror or error})."
        ) from None
    return path


def load(name: str, study: str) -> StudyResult | None:
    """Return the result of a study that was saved under a name, or None if there is none.

    Raises `BadInput` for a file that differs from what `save` wrote, or is of another version: it
    is no missing one.
    """
    path, anew = _file(name, study), "save it anew with --save-baseline."
    _replaceable(path)
    if (text := unsealed(path)) is None:
        return None
    contents: Json = json.loads(text)
    if contents.get("schema") != SCHEMA:
        raise BadInput(
            f"the baseline {name} of {study} is of another version of discmech (schema "
            f"{contents.get('schema')}, here {SCHEMA}; {path}): {anew}"
        )
    return study_result_of(contents)


def _file(name: str, study: str) -> Path:
    folder = baseline_folder()
    if folder is None:
        raise BadInput(
            f"the baseline {name} cannot be kept: there is no home folder; name one in "
            "DISCMECH_CACHE."
        )
    return folder / name / f"{study}.json"


def _replaceable(path: Path) -> None:
    """Raise `BadInput` for a file that `save` did not write, or that somebody changed."""
    try:
        if unsealed(path) is not None or not os.path.lexists(path):
            return
        why = "cannot be read"
    except Damaged:
        why = "is damaged, or not yours alone"
    raise BadInput(
        f"the baseline {path} {why}: move it away, and save it anew with --save-baseline."
    )


def asked_of(studies: Iterable[Study], choice: Choice) -> dict[str, dict[str, str]]:
    """Return what the cases of studies are asked of: for each scene its values, by their names.

    A parameter, the start, the duration and the step are written out; a formula, and whatever else
    has functions, is a digest of what they compute, without comments and names of files. What a
    scene leaves out is left out.
    """
    scenes = {case.scene.name: case.scene for study in studies for case in study.cases(choice)}
    return {name: dict(_values(scene)) for name, scene in scenes.items()}


def _values(scene: Any) -> Iterator[tuple[str, str]]:
    for one in fields(scene):
        value = getattr(scene, one.name)
        empty = value is None or (isinstance(value, tuple) and not value)  # it may be an array
        if one.name == "parameters":
            yield from ((name, _written(entry)) for name, entry in value.items())
        elif one.name not in ("name", "title", "source") and not empty:
            yield one.name, _written(value)


def _written(value: Any) -> str:
    """Return numbers and words as they are, if they are few, or a digest."""
    entries = flatten(value) if isinstance(value, tuple) else [value]
    if len(entries) <= WRITTEN and all(isinstance(e, int | Fraction | str) for e in entries):
        return ", ".join(map(str, entries))
    try:
        return DIGEST + reads(value)
    except Opaque as hidden:
        return f"{DIGEST}{hidden}"


def compared(name: str, result: StudyResult, before: StudyResult) -> Comparison:
    """Return the change of each case; raises `BadInput` if there is no common case.

    One that is gone although the command has the same words is worse.
    """
    then, now = _cases(before), _cases(result)
    if not then.keys() & now.keys():
        raise BadInput(f"the baseline {name} of {result.study} has none of these cases.")
    environment = list(_differences(before.record, result.record))
    gone = ("worse", "it is not here now; if it was taken out on purpose, save the baseline anew")
    if before.command != result.command:
        gone = OTHER, f"the words of this command leave it out; the baseline is of {before.command}"
    lines = []
    for key in now | then:
        one, other = then.get(key), now.get(key)
        case = other or one
        assert case is not None
        if other is None:
            answer = gone
        elif one is None:
            answer = "cannot tell", "it is not in the baseline"
        else:
            what = _other_scene(before, result, str(case.scene))
            answer = (OTHER, what) if what else _answer(one, other, bool(environment))
        named = (case.scene, case.rule, case.retraction, case.digits)
        lines.append(Line(_named(case.study, *named), key[1], *answer))
    lines += _properties(result, before)
    lines.sort(key=lambda line: ANSWERS.index(line.answer))
    made = before.record
    return Comparison(name, made.get("date"), made.get("commit"), environment, lines)


def identity(case: AnyResult) -> tuple[str, str]:
    """Return the identity of a case in other runs: its command has study, scene and digits."""
    return str(case.rule), case.command


def _cases(result: StudyResult) -> dict[tuple[str, str], AnyResult]:
    return {identity(case): case for case in result.cases}


def _differences(then: Json, now: Json) -> Iterator[tuple[str, str, str]]:
    """Yield versions and machines that differ."""
    told = ("date", "seconds", "settings", "commit", "clean", "discmech")
    for what in dict.fromkeys([*then, *now]):
        if what not in told and then.get(what) != now.get(what):
            yield what, str(then.get(what)), str(now.get(what))


def _named(study: str, *words: Any) -> str:
    return f"{study}: {', '.join(map(str, filter(None, words)))}"


def _other_scene(then: StudyResult, now: StudyResult, scene: str) -> str:
    """Return a sentence on the values that a scene has no longer; empty if it has the same."""
    before, after = ((whole.asked or {}).get(scene) for whole in (then, now))
    if before == after or after is None:
        return ""
    if before is None:
        return f"the baseline does not say which values {scene} had; save the baseline anew"
    told = [
        f"{what} is another" if DIGEST in f"{old}{new}" else f"{what} = {old} -> {new}"
        for what in {**before, **after}
        for old, new in [(before.get(what, "none"), after.get(what, "none"))]
        if old != new
    ]
    return f"the scene is another: {', '.join(told)}; save the baseline anew"


def _properties(result: StudyResult, before: StudyResult) -> Iterator[Line]:
    """Yield a line for each scheme, on the same scene, that is self-adjoint on one side alone."""
    then, now = (
        {(one["scene"], one["rule"], one["retraction"]): one["self_adjoint"]
         for one in whole.schemes or ()} for whole in (before, result)
    )  # fmt: skip
    for key, was in then.items():
        is_ = now.get(key, was)
        if was != is_ and True in (was, is_) and not _other_scene(before, result, key[0]):
            told = f"{ADJOINT[was]}, now {ADJOINT[is_]}"
            answer = "worse" if was else "better"
            yield Line(_named("scheme", *key), result.command, answer, told)


ADJOINT = {True: "self-adjoint", False: "not self-adjoint", None: "not known to be self-adjoint"}


def _answer(then: AnyResult, now: AnyResult, elsewhere: bool) -> tuple[str, str]:
    was, is_ = then.verdict, now.verdict
    if was != is_:
        worse = VERDICTS.index(is_) < VERDICTS.index(was)
        return "worse" if worse else "better", f"{was}, now {is_}"
    before, after = then.wanted.get("order"), now.wanted.get("order")
    if before is not None and after is not None and before != after:  # with a claim, or the rule
        side = "worse" if after < before else "better"
        return side, f"the expected order was {before:g}, now {after:g}"
    free = now.wanted.get("demanded") or ()
    if "not_demanded" in now.wanted and (
        "not_demanded" not in then.wanted or {*(then.wanted.get("demanded") or ())} - {*free}
    ):
        return "worse", f"more was demanded: {now.wanted['not_demanded']}"
    olds, news = _figures(then), _figures(now)
    lines = []
    for what, a in olds.items():
        if what in news:
            lines.append((_side(a, news[what]), what, a, news[what]))
        elif not what.startswith(("time", "error")):  # other rows may be used
            return "worse", f"{what}: {_shown(a)}, now there is none"
    errors = [line for line in lines if line[1].startswith("error") and line[0] != "equal"]
    mixed = errors if len({side for side, *_ in errors}) > 1 else []
    for wanted in ("worse", "better"):
        for side, what, a, b in lines:
            timed = what.startswith("time")
            alike = timed and (elsewhere or max(a.low / b.high, b.low / a.high) < APART)
            if side == wanted and not alike and not (mixed and what.startswith("error")):
                return side, _change(what, a, b)
        if mixed:
            few = "; ".join(_change(*line[1:]) for line in mixed[:2])
            return "cannot tell", f"some errors are larger and some are smaller: {few}"
    for side, what, a, b in lines:
        if what.startswith("time") and elsewhere:
            return "cannot tell", "times of another machine or of other versions"
        if what.startswith("time") and side != "equal":
            near = "equal things differ as much from run to run"
            return "cannot tell", f"{_change(what, a, b)}, and {near}"
        small, large = sorted((a.high, b.high))
        if large > max(a.chance, b.chance, NEARLY * small):
            near = "a run of chaotic motion may have another by chance"
            return "cannot tell", f"{_change(what, a, b)}, and {near}"
    return "equal" if any(a.alone for _, _, a, _ in lines) else "same verdict", ""


DISTANCE = "distance from the expected order"
BAND = "oscillation of the energy"
#: largest relative error of a band: those of eight runs of 2·10⁵ steps that begin within 10⁻⁹ of
#: each other were 0.6 % apart at most in chaotic motion (double-pendulum), and 3·10⁻⁶ in regular
#: motion
WIDER = 1.1
KEPT = 1e-10  # a smaller band is round-off, perhaps of a long walk
#: factor for an end of a map of stability: the steps of its cells are a tenth of a decade apart
CELL = 10**0.1
# factor for a band of regular motion, and for an error of a run with other round-off
NEARLY = 1.001
#: the same for an error in doubles: with their round-off the points of a fit are within 0.012
#: (log₂, 0.8 %) of a line, but for errors below 2¹² floors, which are covered by 10⁶ roundings
IN_DOUBLES = 1.01
#: digits from which an error at a step is a figure without a spread, and the round-off in it
EXACT, ROUNDED = 30, 1e6
#: factor for the floor of a program's own numbers, as one drawn state is larger than another: less
#: than half a decade, so that one decimal fewer is always seen
STATES = 3.0
#: numbers of a value of a scene that are written out, and what stands before a digest of others
WRITTEN, DIGEST = 12, "digest "


@dataclass(frozen=True, slots=True)
class Figure:
    """The least and the largest value that a figure may have, as distances from the best.

    chance: a value beyond it that is not nearly the same may be another by chance. alone: True if
    cases with equal figures of this kind are equal.
    """

    low: float
    high: float
    chance: float = math.inf
    alone: bool = True


def _figures(case: AnyResult) -> dict[str, Figure]:
    """Return the figures of a case that are compared; smaller is better."""
    figures: dict[str, Figure] = {}
    view = view_of(case.study)
    told = view.compared(case) if view.compared and case.figures else {}
    order, wanted = number(told.get("order")), case.wanted.get("order")
    if order is not None and wanted is not None:
        gap, room = abs(order - wanted), case.wanted["tolerance"]
        figures[DISTANCE] = Figure(max(gap - room, 0.0), gap + room, alone=False)
    band = number(told.get("band"))
    if band is not None and "balance_order" not in case.figures:
        figures[BAND] = _of_run(band, KEPT)
    limit = case.wanted.get("limit") or case.figures.get("resolution") or 0.0
    for name, drift in told.get("drifts", {}).items():
        if number(drift) is not None:
            least = (case.wanted.get("limits") or {}).get(name) or limit
            figures[f"drift of {name}"] = _of_run(drift, least)
    defect = number(told.get("defect"))
    if defect is not None and limit:  # the places are drawn: beyond the limit it may be any other
        high = limit if defect <= limit else math.inf
        figures["defect of the form"] = Figure(defect if defect > limit else 0.0, high, alone=False)
    if (end := told.get("stable")) is not None:
        room = CELL if "bounded" in told else NEARLY
        figures["stable to hω"] = Figure(-end * room, -end / room)
    if (share := told.get("bounded")) is not None:
        edges = told["bounded_spread"]
        figures["share of bounded runs"] = Figure(-share - edges, -share + edges)
    local = case.details.local if isinstance(case.details.local, Mapping) else {}
    size = float((local.get("floor") or "0").split()[0])
    figures["floor of its own numbers"] = Figure(size / STATES, size * STATES, alone=False)
    for row in case.data:
        error = row.get("error")
        many = case.digits >= EXACT
        # in doubles those alone that a fit takes, which are above the floor of round-off
        if error is not None and row.get("steps") is not None and (many or row.get("used")):
            off, near = ROUNDED * 10.0**-case.digits, NEARLY if many else IN_DOUBLES
            figures[f"error at {row['steps']} steps"] = Figure(error / near - off,
                                                               error * near + off)  # fmt: skip
        if row.get("seconds_low") is not None:
            what = row.get("setting", row.get("variant"))
            figures[f"time at {what}"] = Figure(row["seconds_low"], row["seconds_high"])
    return figures


def _of_run(value: float, least: float) -> Figure:
    """Return the figure of a long run, which chaotic motion spreads; up to `least` is round-off."""
    return Figure(value / WIDER - least, value * WIDER + least, (1 + WIDER) * least)


def _side(then: Figure, now: Figure) -> str:
    return "worse" if now.low > then.high else "better" if now.high < then.low else "equal"


def _change(what: str, then: Figure, now: Figure) -> str:
    return f"{what}: {_shown(then)}, now {_shown(now)}"


def _shown(figure: Figure) -> str:
    """Return the ends; of a figure that is better if it is larger those of its own sign."""
    low, high = max(figure.low, 0.0), figure.high
    if high < 0:
        low, high = -high, -figure.low
    return f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"
