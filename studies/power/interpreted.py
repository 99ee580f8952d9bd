"""Flows whose double precision runs uncompiled: the same text, where a scheme runs only once.

Compiling costs some seconds a scheme, which several hundred schemes of a few thousand steps each
would not win back.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

from discmech.integrators import Scheme
from discmech.integrators.compiler.driver import SINGULAR
from discmech.integrators.compiler.modules import composed_file, kernel_body, kernel_file
from discmech.integrators.flows.flow import Flow
from discmech.integrators.numbers.interpreting import run_text

Edit = Callable[[str], str]
Form = tuple[str, Callable[[Any], Any]]


def interpret(scheme: Scheme, edit: Edit | None = None, form: Form | None = None) -> Scheme:
    """The scheme, whose flows run the text of their modules.

    edit: a change of that text; form: the name of a tensor of `LocalGeometry`, and its change.
    """

    def flow(step: Any, digits: int = 16) -> Flow:
        made = _Flow(scheme, step, digits, substeps=scheme.flow_substeps)
        made.edit = edit
        if form is not None:
            name, change = form
            given = getattr(made.geometry, name)
            made.geometry.__dict__[name] = lambda *arguments: change(given(*arguments))
        return made

    scheme.__dict__["flow"] = flow
    return scheme


class _Flow(Flow):
    edit: Edit | None = None

    @cached_property
    def _kernels(self) -> dict[str, Any]:
        composed = self.context.substeps
        return _run(self, composed_file(self.origins) if composed else kernel_file(self.scheme))


def _run(flow: _Flow, path: Path) -> dict[str, Any]:
    text = kernel_body(path)
    names = run_text(flow.edit(text) if flow.edit else text, flow.numbers.namespace())
    advance = names["advance"]

    def guarded(*arguments: Any) -> Any:
        """Python's functions raise where machine code and gmpy2 give what is no number."""
        try:
            return advance(*arguments)
        except (ValueError, OverflowError, ZeroDivisionError):
            return 0, SINGULAR

    return {**names, "advance": guarded}
