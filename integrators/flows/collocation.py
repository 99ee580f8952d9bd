"""Which steps are solved as collocation, by the fixed point of their stages."""

from __future__ import annotations

from ..bisections import StepContext
from ..compiler import NoShortForm, StagesAtStep, compile_stages
from ..equations import no_stages, stage_system


def collocation(context: StepContext, without: frozenset[str]) -> tuple[StagesAtStep | None, str]:
    """(kernels of collocation at a step, ""), or (None, why Newton's method does all).

    without: savings that kernels do not make; those of collocation have none to leave out.
    """
    if context.substeps:
        return None, "a composition has steps of several sizes"
    if context.one_step:
        return None, "the rule is a one-step map"
    if without:
        return None, "a saving is left out"
    equations = context.equations
    if reason := no_stages(equations):
        return None, reason
    system = stage_system(equations.s, equations.rule.gauss_nodes)
    try:
        kernels = compile_stages(system, context.numbers)
    except NoShortForm as error:
        return None, str(error)
    return StagesAtStep(kernels, context.numbers, [context.q], (0,), context.scene.name), ""
