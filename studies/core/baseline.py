"""Compare a result with an earlier one saved under a name: worse, better, equal, or undecided.

Each lies in a sealed file of its own, `baseline_folder()`/NAME/STUDY.json: it cannot be made again,
so it is not part of the cache.

Verdicts are compared, and figures: an order with the tolerance of its verdict, a time with its
quartiles, the energy's band to its random spread, and errors at equal steps, which with many digits
have no spread. Where nothing but the verdict and the order can be compared, that is the answer. Two
figures differ if their spreads do not meet, times if they are a factor of
`APART` from each other; times are compared only on one machine with equal versions.
"""

from __future__ import annotations

import errno
import json
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from discmech.integrators import BadInput
from discmech.integrators.compiler import Damaged, seal, unsealed
from discmech.integrators.errors import CouldNotRun, shown
from discmech.integrators.places import baseline_folder, make_private

from .outcome import VERDICTS
from .records import Json
from .result import SCHEMA, AnyResult, StudyResult, study_result_of

#: in the order in which they are shown
ANSWERS = ("worse", "cannot tell", "better", "same verdict", "equal")
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


def compared(name: str, result: StudyResult, before: StudyResult) -> Comparison:
    """Return the change of each case; raises `BadInput` if there is no common case."""
    then, now = _cases(before), _cases(result)
    if not then.keys() & now.keys():
        raise BadInput(f"the baseline {name} of {result.study} has none of these cases.")
    environment = list(_differences(before.record, result.record))
    lines = [_line(key, then.get(key), now.get(key), bool(environment)) for key in now | then]
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


def _line(
    key: tuple[str, str], then: AnyResult | None, now: AnyResult | None, elsewhere: bool
) -> Line:
    case = now or then
    assert case is not None
    named = (case.scene, case.rule, case.retraction, case.digits)
    answer, why = _answer(then, now, elsewhere)
    name = f"{case.study}: {', '.join(map(str, filter(None, named)))}"
    return Line(name, key[1], answer, why)


def _answer(then: AnyResult | None, now: AnyResult | None, elsewhere: bool) -> tuple[str, str]:
    if then is None or now is None:
        return "cannot tell", "it is not in the baseline" if then is None else "it is not here now"
    was, is_ = then.verdict, now.verdict
    if was != is_:
        worse = VERDICTS.index(is_) < VERDICTS.index(was)
        return "worse" if worse else "better", f"{was}, now {is_}"
    before, after = then.wanted.get("order"), now.wanted.get("order")
    if before is not None and after is not None and before != after:  # with a claim, or the rule
        side = "worse" if after < before else "better"
        return side, f"the expected order was {before:g}, now {after:g}"
    lines = [(_side(a, _spreads(now)[what]), what, a, _spreads(now)[what])
             for what, a in _spreads(then).items() if what in _spreads(now)]  # fmt: skip
    timed = [line for line in lines if line[1].startswith("time")]
    errors = [line for line in lines if line[1].startswith("error") and line[0] != "equal"]
    if len({side for side, *_ in errors}) > 1:
        few = "; ".join(f"{what}: {_shown(a)}, now {_shown(b)}" for _, what, a, b in errors[:2])
        return "cannot tell", f"some errors are larger and some are smaller: {few}"
    for side in ("worse", "better"):
        for one, what, a, b in lines:
            is_time = what.startswith("time")
            if one == side and not (
                is_time and (elsewhere or max(a[0] / b[1], b[0] / a[1]) < APART)
            ):
                return side, f"{what}: {_shown(a)}, now {_shown(b)}"
    if elsewhere and timed:
        return "cannot tell", "times of another machine or of other versions"
    for side, what, a, b in timed:
        if side != "equal":
            near = "equal things differ as much from run to run"
            return "cannot tell", f"{what}: {_shown(a)}, now {_shown(b)}, and {near}"
    for _, what, a, b in lines:
        if what == BAND and _far(a[1], b[1]):
            near = "a run of chaotic motion may have another by chance"
            return "cannot tell", f"{what}: {_shown(a)}, now {_shown(b)}, and {near}"
    return "equal" if any(line[1] != DISTANCE for line in lines) else "same verdict", ""


DISTANCE = "distance from the expected order"
BAND = "oscillation of the energy"
#: largest relative error of a band: those of eight runs of 2·10⁵ steps that begin within 10⁻⁹ of
#: each other were 0.6 % apart at most in chaotic motion (double-pendulum), and 3·10⁻⁶ in regular
#: motion
WIDER = 1.1
KEPT = 1e-10  # a smaller band is round-off, perhaps of a long walk
# factor for a band of regular motion, and for an error of a run with other round-off
NEARLY = 1.001
#: the same for an error in doubles: with their round-off the points of a fit are within 0.012
#: (log₂, 0.8 %) of a line, but for errors below 2¹² floors, which are covered by 10⁶ roundings
IN_DOUBLES = 1.01
#: digits from which an error at a step is a figure without a spread, and the round-off in it
EXACT, ROUNDED = 30, 1e6
#: least and largest value of a figure, as distances from the best
Spread = tuple[float, float]


def _spreads(case: AnyResult) -> dict[str, Spread]:
    """Return the figures of a case that have a spread; smaller is better."""
    spreads: dict[str, Spread] = {}
    order, wanted = case.figures.get("order"), case.wanted.get("order")
    if order is not None and wanted is not None:
        gap, room = abs(order - wanted), case.wanted["tolerance"]
        spreads[DISTANCE] = max(gap - room, 0.0), gap + room
    band = case.figures.get("band")
    if band is not None and "balance_order" not in case.figures:
        spreads[BAND] = band / WIDER - KEPT, band * WIDER + KEPT
    for row in case.data:
        error = row.get("error")
        many = case.digits >= EXACT
        # in doubles those alone that a fit takes, which are above the floor of round-off
        if error is not None and row.get("steps") is not None and (many or row.get("used")):
            off, near = ROUNDED * 10.0**-case.digits, NEARLY if many else IN_DOUBLES
            spreads[f"error at {row['steps']} steps"] = error / near - off, error * near + off
        if row.get("seconds_low") is not None:
            what = row.get("setting", row.get("variant"))
            spreads[f"time at {what}"] = row["seconds_low"], row["seconds_high"]
    return spreads


def _far(one: float, other: float) -> bool:
    """True if two bands are not those of one regular motion; bands of round-off are the same."""
    return max(one, other) > KEPT and not max(one, other) <= NEARLY * min(one, other)


def _side(then: Spread, now: Spread) -> str:
    return "worse" if now[0] > then[1] else "better" if now[1] < then[0] else "equal"


def _shown(spread: Spread) -> str:
    return f"{spread[0]:.3g} to {spread[1]:.3g}"
