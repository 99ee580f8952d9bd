"""The choice of steps that are solved as collocation, by the fixed point of their stages."""

from __future__ import annotations

from ..compiler import NoShortForm, StagesAtStep, compile_stages
from ..equations import no_stages, stage_source
from ..geometry import StepContext

#: number of stages from which a fixed point is the faster method in double precision. Measured (ns
#: a step, fixed point and Newton): two stages 902, 525 (rigid-body), 1066, 1095 (heavy-top), 171,
#: 119 (pendulum); three stages 735, 2014 (heavy-top). With Lobatto's nodes one stage is no unknown:
#: three 300, 220 and four 286, 279 (pendulum), five 364, 663 and six 441, 1152 (kepler)
LEAST = 3


def collocation(context: StepContext, without: frozenset[str]) -> tuple[StagesAtStep | None, str]:
    """Return (kernels of collocation at a step, ""), or (None, why Newton's method solves all
    steps).

    without: savings that kernels do not make; kernels of collocation cannot leave any out.
    """
    if context.substeps:
        return None, "a composition has steps of several sizes"
    if context.equations.arrows is None:
        return None, "the rule is a one-step map"
    if without:
        return None, "a saving is left out"
    equations, nodes = context.equations, context.equations.rule.nodes
    if nodes is None:
        return None, "the rule has no stages on Gauss or Lobatto nodes"
    if reason := no_stages(equations, nodes):
        return None, reason
    if context.numbers.digits < 16:
        return None, "in single precision Newton's method does all"
    if context.numbers.digits == 16 and nodes.unknown < LEAST:
        return None, "a step of so few stages takes Newton's method no longer"
    source = stage_source(equations.s, nodes)
    numbers = context.numbers
    with numbers.working():  # the first caller makes the tables for all flows
        try:
            kernels = compile_stages(source, numbers)
        except NoShortForm as error:
            return None, str(error)
        return StagesAtStep(kernels, numbers, [context.q], (0,), context.scene.name), ""
