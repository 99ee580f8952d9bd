"""Flows whose double precision runs uncompiled: the same text, where a scheme runs only once.

Compiling costs some seconds a scheme, which several hundred schemes of a few thousand steps each
would not win back.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

from discmech.integrators import Scheme
from discmech.integrators.compiler import SINGULAR, Kernels, interpreted, kernel_text
from discmech.integrators.flows import Flow

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
    """A flow with its kernels as Python, and a change of their text."""

    edit: Edit | None = None

    @cached_property
    def _kernels(self) -> Kernels:
        text = kernel_text(self.system, self.without)
        kernels = interpreted(self.edit(text) if self.edit else text, self.numbers)

        def advance(*arguments: Any) -> Any:
            """Python's functions raise where machine code and gmpy2 give what is no number."""
            try:
                return kernels.advance(*arguments)
            except (ValueError, OverflowError, ZeroDivisionError):
                return 0, SINGULAR

        return replace(kernels, advance=advance)
