"""`check`: one study for scenes and rules, given as objects or by name."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from discmech import studies
from discmech.integrators import BadInput, retractions
from discmech.integrators.errors import arguments_checked, shown

from ..core import lookup, words
from ..core.case import Choice
from ..core.options import digits_in, listed, option_words, whole
from ..core.result import study_result_of
from ..core.running import run_study
from ..core.study import Study, refusal
from ..core.study_words import study_called
from ..core.userfile import word_for_study

if TYPE_CHECKING:
    from discmech.integrators import Discretisation, Scene


class Result(dict[str, Any]):
    """A study's result, as JSON data; a notebook shows it as its table with its figures."""

    def _repr_html_(self) -> str:
        """Return the verdict table, the reasons of cases that did not pass, and the figures."""
        from ..report.notebook import html_of

        return html_of(study_result_of(self))


@arguments_checked
def check(
    study: Study | str,
    scenes: Sequence[Scene | str] = (),
    rules: Sequence[Discretisation | str] = (),
    digits: Sequence[int] = (),
    steps: int | None = None,
) -> Result:
    """Run one study; all arguments are objects or names; by default it takes all scenes and rules.

    Returns the result as the command line writes it: {"study", "verdict", "cases": [...]}; a
    notebook shows its table, reasons and figures (`plot` gives these one by one). Rules of one name
    get the names of their files before it, as `discmech verify` does. Raises `BadInput`
    for unknown names and for scenes to which the study does not apply.
    """
    chosen = Choice(
        scenes=tuple(map(lookup.scene_given, listed("scenes", scenes))),
        rules=tuple(map(lookup.rule, listed("rules", rules))),
        digits=tuple(digits_in(str(d)) for d in listed("digits", digits)),
        steps=None if steps is None else whole("steps")(str(steps)),
    )
    asked = _study(study)
    names = words.names_apart(chosen.rules)
    named = tuple(rule if rule.name == name else replace(rule, name=name)
                  for rule, name in zip(chosen.rules, names, strict=True))  # fmt: skip
    result = run_study(asked, replace(chosen, rules=named))
    return Result(replace(result, command=_command(asked, chosen)).to_json())


def _command(study: Study, chosen: Choice) -> str:
    """Return the command that asks for the same; empty where it would find other objects."""
    things = [*chosen.scenes, *chosen.rules]
    used = {s.groupoid.retraction for s in chosen.scenes}
    charts = [name for name in retractions.BUILT_IN if name in used]
    if len(charts) > 1 or not all(map(words.is_found, things)):
        return ""
    flags = {"--rule": [*map(words.address_of, chosen.rules)], "--retraction": charts,
             "--digits": chosen.digits, "--steps": chosen.steps}  # fmt: skip
    scenes = map(words.address_of, chosen.scenes)
    return shlex.join(["discmech", word_for_study(study.name), *scenes, *option_words(flags)])


def _study(thing: Study | str) -> Study:
    """Return the study itself; raises `BadInput` for anything that neither is nor names one."""
    if isinstance(thing, str):
        return study_called(thing) if ".py" in thing else studies.get(thing)
    if trouble := refusal(thing):
        raise BadInput(f"{shown(thing)}: {trouble}.")
    return thing
