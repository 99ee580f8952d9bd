"""A scheme with a fault in what its flows run: its equations, the text of a step, a form."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from discmech.integrators import Scheme
from discmech.integrators.compiler import Kernels, compiled_text, interpreted, kernel_text
from discmech.integrators.equations import DiscreteEquations
from discmech.integrators.flows import Flow
from discmech.integrators.numbers import Tracked, tracked

Edit = Callable[[str], str]
Form = tuple[str, Callable[[Any], Any]]


class FaultyScheme(Scheme):
    """A scheme whose flows run Newton's kernels alone, for it is there that faults are.

    equations: those to run, if not the scheme's. edit: a change of the kernels' text; form: the
    name of a tensor of `StepMap`, and its change.
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

    def flow_at(self, step: Any, digits: int, on_edge: str) -> Flow:
        """The flow at one step size; arguments as of `Scheme.flow`."""
        made = _Flow(self, step, digits, on_edge, self.flow_substeps)
        made.edit = self.edit
        if self.form is not None:
            name, change = self.form
            geometry = made.context.exactly.geometry
            given = getattr(geometry, name)

            def changed(*arguments: Any) -> Tracked:
                form = tracked(given(*arguments))
                return Tracked(change(form.value), lambda: change(form.balls))

            setattr(geometry, name, changed)
        return made


class _Flow(Flow):
    """A flow without the kernels of collocation, and with a change of Newton's."""

    edit: Edit | None = None
    stages = None

    @cached_property
    def _kernels(self) -> Kernels:
        if self.edit is None:
            return super()._kernels
        text = self.edit(kernel_text(self.system, self.without))
        if self.digits > 16:
            return interpreted(text, self.numbers)
        return compiled_text(self.system, text)
