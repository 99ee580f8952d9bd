"""Studies: each measures one property of a scheme and judges it; rendering is apart.

from discmech.studies import check, show
show(check("order", scenes=[scene], rules=[rule]))
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .core.study import Study, every_study

if TYPE_CHECKING:
    from discmech.integrators import Discretisation, Scene

__all__ = ["NAMES", "check", "get", "show"]

#: the studies of scenes and rules, in the order of the report
NAMES = tuple(study.name for study in every_study().values() if study.usual)


def get(name: str) -> Study:
    """The study of that name; raises `BadInput` for an unknown one."""
    if name not in NAMES:
        from discmech.integrators import BadInput

        raise BadInput(f'there is no study "{name}": there are {", ".join(NAMES)}.')
    return every_study()[name]


def check(
    study: str,
    scenes: Sequence[Scene | str] = (),
    rules: Sequence[Discretisation | str] = (),
    digits: Sequence[int] = (),
    steps: int | None = None,
) -> dict[str, Any]:
    """Run one study; scenes and rules are objects or names, all of them if none is given.

    Returns the result as the command line writes it: {"study", "verdict", "cases": [...]}. Raises
    `BadInput` for unknown names and for scenes that the study does not apply to.
    """
    from .core import lookup
    from .core.case import Choice
    from .core.options import digits_in, listed, whole
    from .core.running import run_study

    chosen = Choice(
        scenes=tuple(map(lookup.scene_given, listed("scenes", scenes))),
        rules=tuple(map(lookup.rule_given, listed("rules", rules))),
        digits=tuple(digits_in(str(d)) for d in listed("digits", digits)),
        steps=None if steps is None else whole("steps")(str(steps)),
    )
    return run_study(get(study), chosen)


def show(result: dict[str, Any]) -> None:
    """Print a result's verdict table, and why something did not pass."""
    from .command.output import console
    from .report.tables import print_result

    print_result(console(), result)
