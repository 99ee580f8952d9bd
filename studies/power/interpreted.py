"""Flows whose double precision runs uncompiled: the same text, where a scheme runs only once.

Compiling costs as much as some thousand steps run by Python, which most of several hundred schemes
would not win back. One that is run further is compiled then.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

from discmech.integrators import Scheme
from discmech.integrators.compiler import SINGULAR, Kernels, compiled_text, interpreted, kernel_text
from discmech.integrators.equations import DiscreteEquations
from discmech.integrators.flows import Flow
from discmech.integrators.numbers import Tracked, tracked

#: steps in Python that take as long as compiling: measured 900 (heavy top, gauss-2) to 7,000
#: (pendulum, midpoint), on Kepler's problem by the trapezoidal rule 4,000
WORTH = 4000
Edit = Callable[[str], str]
Form = tuple[str, Callable[[Any], Any]]


class InterpretedScheme(Scheme):
    """A scheme whose flows run the text of their modules.

    equations: those to run, if not the scheme's. edit: a change of the text; form: the name of a
    tensor of `LocalGeometry`, and its change.
    """

    def __init__(
        self,
        scheme: Scheme,
        equations: DiscreteEquations | None = None,
        edit: Edit | None = None,
        form: Form | None = None,
    ) -> None:
        super().__init__(scheme.scene, scheme.rule, equations or scheme.equations)
        self.edit, self.form = edit, form
        self.steps = 0  # of all flows in double precision

    def flow_at(self, step: Any, digits: int, on_edge: str) -> Flow:
        """The flow at one step size, uncompiled; arguments as of `Scheme.flow`."""
        made = _Flow(self, step, digits, on_edge, self.flow_substeps)
        made.edit = self.edit
        if self.form is not None:
            name, change = self.form
            geometry = made.context.exactly.geometry
            given = getattr(geometry, name)

            def changed(*arguments: Any) -> Tracked:
                form = tracked(given(*arguments))
                return Tracked(change(form.value), lambda: abs(change(form.error)))

            setattr(geometry, name, changed)
        return made


class _Flow(Flow):
    """A flow with its kernels as Python, and a change of their text."""

    scheme: InterpretedScheme
    edit: Edit | None = None
    stages = None  # the faults are in Newton's kernels

    @cached_property
    def _kernels(self) -> Kernels:
        text = kernel_text(self.system, self.without)
        text = self.edit(text) if self.edit else text
        kernels = interpreted(text, self.numbers)

        def advance(*arguments: Any) -> Any:
            """Python's functions raise where machine code and gmpy2 give what is no number."""
            index, stop = arguments[4:6]
            if self.digits == 16:
                self.scheme.steps += stop - index
                if self.scheme.steps > WORTH:
                    return compiled_text(self.system, text).advance(*arguments)
            try:
                return kernels.advance(*arguments)
            except (ValueError, OverflowError, ZeroDivisionError):
                return 0, SINGULAR

        return replace(kernels, advance=advance)
