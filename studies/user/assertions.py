"""Assertions on a rule for tests; a failure shows the table, the cause and the picture's file.

Each takes a rule and a scene, objects or words such as midpoint and my_rule.py:two_thirds, and
raises `Missed` unless the study passes them at each of its precisions, or at `digits` if these are
given. Returns the case of the most digits. The pytest plugin provides the assertions as fixtures,
which save their pictures in the test's own folder.
"""

from __future__ import annotations

import inspect
import re
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from discmech.integrators import BadInput, Discretisation, Scene, black_box
from discmech.integrators.errors import CannotMeasure, check_names, shown, signature_of
from discmech.integrators.numbers import arithmetic, whole_number

from .. import get
from ..core import lookup
from ..core.apart import apart
from ..core.case import Case, Choice, in_chart, plain_cases
from ..core.claims import claiming
from ..core.one_case import run_case, with_cause
from ..core.records import Json
from ..core.result import AnyResult, StudyResult
from ..core.shrinking import smallest
from ..core.study import Study, every_study
from ..proof import prove

Rule = Discretisation | str
Where = Scene | str


class Missed(AssertionError):
    """A method lacks an asserted property; `result` is the case, `picture` its file."""

    def __init__(self, message: str, result: Json, picture: Path | None) -> None:
        self.result, self.picture = result, picture
        super().__init__(message)


class NotApplicable(BadInput):
    """The study does not cover the rule on this scene, or the rule has no meaning there.

    This is no fault of the rule: the fixtures of the pytest plugin skip the test with this
    sentence.
    """


def assert_order(
    rule: Rule, scene: Where, order: int | None = None, *, digits: int | None = None, **more: Any
) -> Json:
    """Assert that the measured order in (x, μ) is `order`, by default the rule's order on the
    scene.

    The tolerance on both sides is 0.05 in double precision and 0.01 with more digits.
    """
    __tracebackhide__ = True
    return _assert(get("order"), rule, scene, digits, order=order, **more)


def assert_converges(rule: Rule, scene: Where, *, digits: int | None = None, **more: Any) -> Json:
    """Assert that errors against the certified reference fall with the step, at order 1 or more."""
    __tracebackhide__ = True
    return _assert(get("order"), rule, scene, digits, at_least=1, **more)


def assert_symplectic(rule: Rule, scene: Where, *, digits: int | None = None, **more: Any) -> Json:
    """Assert that Ω and the Poisson bracket are preserved to round-off, up to the largest stable
    step.

    A force changes both: then Ω has to change by −dθ_f, the differential of the force's one-form.
    """
    __tracebackhide__ = True
    return _assert(get("symplecticity"), rule, scene, digits, **more)


def assert_momentum(rule: Rule, scene: Where, *, digits: int | None = None, **more: Any) -> Json:
    """Assert that a long run conserves every momentum map and Casimir that the scene declares."""
    __tracebackhide__ = True
    return _assert(get("momentum"), rule, scene, digits, **more)


def assert_energy(rule: Rule, scene: Where, *, digits: int | None = None, **more: Any) -> Json:
    """Assert that the energy stays in a band without a slope (with a force: the energy balance)."""
    __tracebackhide__ = True
    return _assert(get("energy"), rule, scene, digits, **more)


def assert_reversible(rule: Rule, scene: Where, *, digits: int | None = None, **more: Any) -> Json:
    """Assert that the method is self-adjoint: a step back leads to the start, to round-off."""
    __tracebackhide__ = True
    return _assert(every_study()["reversibility"], rule, scene, digits, **more)


def assert_proven_order(
    rule: Rule, order: int | None = None, *, groupoid: str | Sequence[str] = (), **more: Any
) -> Json:
    """Assert that the order is proven for every Lagrangian of each class, by default the rule's.

    groupoid: the kinds of classes (`proof.prove`). Returns what `prove --json` writes.
    """
    __tracebackhide__ = True
    beside = more.pop("beside", None)
    more.pop("pictures", None)
    check_names("the assertion of a proven order", more, ("order", "groupoid"))
    proof = prove(_in_folder(rule, beside), order, groupoid=groupoid, laws=())
    if not proof.proven:
        raise Missed(_relative(proof.text(), beside), proof.to_json(), None)
    return proof.to_json()


def _assert(
    study: Study,
    rule: Rule,
    scene: Where,
    digits: int | None,
    *,
    order: int | None = None,
    at_least: int | None = None,
    steps: int | None = None,
    retraction: str | None = None,
    pictures: Path | None = None,
    beside: Path | None = None,
    **unknown: Any,
) -> Json:
    """Run the study's cases and raise `Missed` for the first that does not pass.

    order: the order that is demanded instead of the rule's own; at_least: the least order that is.
    beside: the folder of the test, where files are searched first, and to which paths in messages
    are relative. Raises `BadInput` for unknown names, for a rule that the scene cannot use, and for
    a momentum of a scene that declares none; `NotApplicable` if there is nothing to assert.
    """
    __tracebackhide__ = True
    check_names(f"the assertion of {study.name}", unknown,
                ("digits", "steps", "retraction", "order"))  # fmt: skip
    if digits is not None:
        arithmetic(digits)  # this raises for invalid digits
    if steps is not None:
        steps = whole_number("steps", steps, 1)
    if order is not None and (type(order) is not int or order < 1):
        raise BadInput(f"the order asked for is {shown(order)}: give a whole number from 1.")
    try:
        where = lookup.scene_given(_in_folder(scene, beside))
        where = where if retraction is None else in_chart(where, retraction)
        asked = claiming(lookup.rule(_in_folder(_boxed(rule), beside)), study.name)
    except BadInput as error:
        raise BadInput(_relative(str(error), beside)) from None  # the traceback is the test's own
    if study.name == "momentum" and not any(
        getattr(q, "to_roundoff", True) for q in where.symmetries
    ):
        raise BadInput(
            f"{where.name} declares no momentum map and no Casimir, so none can be asserted: give "
            "Scene(symmetries=[Conserved(...)]), or pytest.skip() the test for this scene."
        )
    if order is not None or at_least is not None:
        asked = replace(asked, order=order)
    made = []
    for case in _cases(study, where, asked, digits, steps):
        if order is not None:
            case.know_order(order)
        elif study.name == "order" and at_least is None and case.order is None:
            raise BadInput(
                f"{asked.name} declares no order, so nothing could fail: say which is meant, as in "
                f"assert_order(rule, {shown(where.name)}, order=2)."
            )
        result = run_case(study, case)
        if result.unusable:
            raise BadInput(_relative(result.reason, beside))
        if at_least is not None:
            result = _with_least(study, case, result, at_least)
        if result.verdict not in ("pass", "measured"):
            raise _missed(study, case, result, pictures, beside)
        made.append(result)
    if not_demanded := next((r for r in made if not r.passed), None):
        why = not_demanded.wanted["not_demanded"]
        raise NotApplicable(f"{study.name} of {where.name}: {why}")
    return made[-1].to_json()


def _missed(
    study: Study, case: Case, result: AnyResult, pictures: Path | None, beside: Path | None
) -> Missed:
    """Return the error of a case that does not pass: its reason, table, picture and next step."""
    tried = study.usual and result.verdict == "fail"
    small = smallest(study, case, result) if tried else None
    picture = _picture(result, pictures)
    said = [f"{study.name}: {result.verdict}: {result.reason}", _table(result)]
    if small and (small.scene, small.steps) != (case.scene.name, case.steps):
        steps = f", steps={small.steps}" if small.steps else ""
        said += [f"the smallest that fails: scene {shown(small.scene)}{steps}"]
    elif tried:
        said += ["the smallest that fails: this one, as far as others were tried"]
    if tried and not result.diagnosis:
        said += ["the cause: none that discmech knows explains it"]
    said = [_relative(line, beside) for line in said]
    said += [f"picture: {picture}"] if picture else []
    return Missed("\n".join([*said, _next_step(result)]), result.to_json(), picture)


def _boxed(rule: Any) -> Any:
    """Return a function (q, p, h, system) or (q, p, h), or a class of steps, as a black box."""
    if isinstance(rule, str | Discretisation) or not callable(rule):
        return rule
    if inspect.isclass(rule):
        return black_box()(rule) if hasattr(rule, "start") else rule
    signature = signature_of(rule)
    if signature is None:
        return black_box()(rule)
    # what functools.partial has filled in is no argument of a step
    names = [name for name, each in signature.parameters.items() if each.default is each.empty]
    return rule if names[:1] in (["L"], ["s"]) or len(names) not in (3, 4) else black_box()(rule)


def _in_folder(thing: Any, folder: Path | None) -> Any:
    """Return a word that names a file with the path from that folder, if the file is there."""
    if folder is None or not isinstance(thing, str):
        return thing
    *method, word = re.split(r":(?=[^:]*\.py\b)", thing, maxsplit=1)  # of METHOD:FILE.py:NAME
    path, ext, _ = word.partition(".py")
    return ":".join([*method, str(folder / word)]) if (folder / (path + ext)).is_file() else thing


def _relative(text: str, folder: Path | None) -> str:
    """Return a message with paths relative to that folder."""
    return text if folder is None else text.replace(f"{folder}/", "")


def _next_step(result: AnyResult) -> str:
    """Return what to do about a test that did not pass, in pytest's words."""
    if result.verdict == "inconclusive":
        return "next: ask with other digits= or steps=, or pytest.skip() it with this reason"
    order = round(result.figures.get("order") or 0) if result.wanted.get("order") else 0
    other = f"; if you mean order {order}, ask for order={order}" if order > 0 else ""
    known = '@pytest.mark.xfail(strict=True, reason="...")'
    whose = "scene" if (result.diagnosis or {}).get("cause") == "scene" else "rule"
    return f"next: mend the {whose}, or mark a defect that stays with {known}{other}"


def _cases(
    study: Study, scene: Scene, rule: Discretisation, digits: int | None, steps: int | None
) -> list[Case]:
    """Return the study's cases of a rule on a scene, by precision.

    Raises `NotApplicable` unless the rule can be used on the scene and the study has a case, and
    `BadInput` for digits in which the rule does not compute.
    """
    if digits is not None and not rule.runs_at(digits):
        raise BadInput(
            f"{rule.name} does not compute with {digits} digits: leave digits= out, and it is "
            "judged by those that it has."
        )
    chosen = Choice((scene,), (rule,), digits=() if digits is None else (digits,), steps=steps)
    if said := apart(chosen, study):
        raise NotApplicable(" ".join(said))
    try:
        cases = study.cases(chosen)
        if not study.usual:  # it would ask only rules that claim what is asserted
            cases = cases or plain_cases(study.name, chosen, study.digits)
        _ = Case(study.name, scene, rule, 16).scheme
    except CannotMeasure as refusal:
        raise NotApplicable(str(refusal)) from None
    except BadInput as error:
        raise BadInput(str(error)) from None
    if not cases:
        raise NotApplicable(
            f"{study.name} says nothing of {scene.name} with {rule.name}: {study.lacks(chosen)}"
        )
    return sorted(cases, key=lambda case: case.digits)


def _with_least(study: Study, case: Case, result: AnyResult, least: int) -> AnyResult:
    """Return the result of a rule without an order, of which the assertion demands so much."""
    order = result.figures.get("order")
    if order is None:
        return result  # the study says why
    wanted = {"order": least, "tolerance": result.wanted["tolerance"]}
    if order >= least - wanted["tolerance"]:
        verdict = "pass" if result.verdict == "measured" else result.verdict
        return replace(result, wanted=wanted, verdict=verdict)
    # this finds the cause
    result = run_case(study, replace(case, rule=replace(case.rule, order=least)))
    said = f"the order is {order:.3f}; the test asks for at least {least}."
    said = with_cause(said, result.diagnosis)
    return replace(result, wanted=wanted, verdict="fail", reason=said)


def _table(result: AnyResult) -> str:
    """Return the verdict table as text."""
    from rich.console import Console

    from ..report.tables import terminal_table

    screen = Console(width=120, no_color=True, force_terminal=False)
    with screen.capture() as captured:
        screen.print(terminal_table(_alone(replace(result, reason=""))))
    return captured.get().rstrip()


def _alone(result: AnyResult) -> StudyResult:
    return StudyResult(study=result.study, verdict=result.verdict, cases=[result])


def _picture(result: AnyResult, folder: Path | None) -> Path | None:
    """Return the study's figure of this case as a PNG file, or None if it has none."""
    from ..report.figures import Look, plates
    from ..report.tables import file_name

    if not result.data:
        return None
    drawn = plates([_alone(result)], {}, {}, look=Look(formats=("svg", "png")))
    if not drawn:
        return None
    folder = folder or Path(tempfile.mkdtemp(prefix="discmech-"))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{file_name(f'{result.study}-{result.scene}-{result.rule}')}.png"
    path.write_bytes(drawn[0].drawing.files["png"])
    return path
