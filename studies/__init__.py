"""Studies: each measures one property of a scheme and judges it; rendering is apart.

from discmech.studies import check, show
show(check("order", scenes=[scene], rules=[rule]))
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .core.study import Study, every_study

if TYPE_CHECKING:
    from .command.explain import explain
    from .core.case import Verdict
    from .order.own_runs import own_order
    from .proof import prove
    from .systems import system_of
    from .user.checking import check
    from .user.drawing import plot
    from .user.filming import film

__all__ = [
    "NAMES", "Study", "Verdict", "check", "explain", "film", "get", "own_order", "plot",
    "prove", "show", "system_of",
]  # fmt: skip

#: the studies of scenes and rules, in the order of the report; those of packages are found last
NAMES: tuple[str, ...]


def get(name: str) -> Study:
    """The study of that name; raises `BadInput` for an unknown one."""
    known = {key: study for key, study in every_study().items() if study.of_systems}
    if not isinstance(name, str) or name not in known:  # an array is compared entry by entry
        from discmech.integrators.errors import unknown

        raise unknown("study", name, known)
    return known[name]


def _names() -> tuple[str, ...]:
    """A package with a study of its own imports this module, before all studies are known."""
    return tuple(study.name for study in every_study().values() if study.usual)


#: the modules of names that are loaded when they are first asked for
_LATER = {
    "Verdict": "core.case", "check": "user.checking", "explain": "command.explain",
    "film": "user.filming", "own_order": "order.own_runs", "plot": "user.drawing",
    "prove": "proof", "system_of": "systems",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Return a name of `__all__`: a page is written without any integrator."""
    if name == "NAMES":
        return _names()
    if name in _LATER:
        return getattr(import_module(f"{__name__}.{_LATER[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def show(result: dict[str, Any]) -> None:
    """Print a result's verdict table, and why something did not pass.

    result: what `check` returns. Raises `BadInput` for anything else.
    """
    from discmech.integrators.errors import BadInput, shown

    if not (isinstance(result, dict) and {"study", "cases", "verdict"} <= result.keys()):
        raise BadInput(f"show takes what check(...) returns, not {shown(result)}.")
    from .command.output import console
    from .core.result import study_result_of
    from .report.tables import print_result

    print_result(console(), study_result_of(result))
