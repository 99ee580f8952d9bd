"""The runs of a scheme at one step size and one precision: kernels, edges, starts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cached_property

from ..bisections import POLICIES, EdgePolicy
from ..compiler import (
    Kernels,
    KernelsAtStep,
    NoShortForm,
    StagesAtStep,
    Step,
    compile,
    compile_stages,
)
from ..equations import DiscretisedScene, blamed, composed_step, no_stages, stage_source
from ..errors import BadInput, arguments_checked, shown
from ..geometry import StepContext, StepMap
from ..numbers import Number, Numbers, Vector, arithmetic, exact_rational
from ..numbers.types import Given, Rows
from ..runs import File, FlowRuns, Progress, Stepper, Trajectory, run
from ..scene import Again, flow_of
from .free_motion import FreeMotion
from .initial_state import Start, Starting
from .step_choice import StepChoice

# the squares and inverses of such steps are far from over- and underflow
TINIEST = Fraction(1, 10**100)

#: (the scheme of a substep, a function digits ↦ its share of the step)
Substeps = Sequence[tuple[DiscretisedScene, Callable[[int], Number]]]


class SceneRuns(FlowRuns):
    """The steps of a scheme on (x, μ), and the runs that consist of them.

    step: a non-zero number (exact: a float is its binary value; "0.1" is one tenth); a negative
    step runs Φ₋ₕ, which is the inverse only for a self-adjoint rule. digits = 16 is compiled double
    precision, more gives mpmath numbers, and 7 single precision, run by Python.

    on_edge: "refuse", "bisect" or "shrink" if a step reaches the edge of its chart
    (`bisections.edge_policies`). substeps: those of a composition, whose rows
    have the u of the first substep. Raises `BadInput` for a step that is 0 or not finite, and for
    another on_edge.
    """

    #: savings that the kernels do not make (`omissions.SAVINGS`), so that their gain can be
    #: measured
    without: frozenset[str] = frozenset()
    #: how the step was chosen, if a tolerance was given (`Scheme.flow`)
    choice: StepChoice | None = None

    def __init__(
        self,
        scheme: DiscretisedScene,
        step: Given,
        digits: int = 16,
        on_edge: str = "refuse",
        substeps: Substeps = (),
    ) -> None:
        self.scheme, self.digits, self.on_edge = scheme, digits, on_edge
        self.step = size = exact_rational(step, "step")
        if on_edge not in POLICIES:
            choices = ", ".join(map(repr, POLICIES))
            raise BadInput(f"on_edge is {shown(on_edge)}: give one of {choices}.")
        if size == 0:
            raise BadInput("a step of 0 goes nowhere: give a positive or negative step.")
        if not TINIEST <= abs(size) <= 1 / TINIEST:
            raise BadInput("the step is beyond 1e-100 or 1e100: choose units that fit the motion.")
        self.numbers = numbers = arithmetic(digits, single=True)
        # thirty more digits, so that the shares add up to 1 in the flow's own numbers
        shares = [(e, exact_rational(share(digits + 30), "coefficient")) for e, share in substeps]
        made = {key: StepContext(key[0], numbers, key[1] * size) for key in shares}
        self.context = StepContext(scheme, numbers, size, tuple(made[key] for key in shares))
        #: contexts whose steps, one after another, make a step of this flow
        self.parts = self.context.parts

    def __reduce__(self) -> Again:
        """Return the pickled form: the flow is made again from its scheme, step and digits."""
        own = {k: v for k, v in vars(self).items() if k in ("choice", "without")}
        return flow_of, (self.scheme, self.step, self.digits, self.on_edge, own)

    @arguments_checked
    def trajectory(
        self,
        steps: int,
        every: int = 1,
        *,
        x0: Numbers | None = None,
        mu0: Numbers | None = None,
        u0: Numbers | None = None,
        element0: Rows | None = None,
        t0: Given = 0,
        checkpoint: File = None,
        progress: Progress = None,
    ) -> Trajectory:
        """Run `steps` steps from the scene's start (or from x0, mu0), with a row every `every`
        steps.

        t0: the time of the start (exact), which matters if the scene depends on time; an x0 with
        its time, such as a row of `Trajectory.base`, needs no t0. Memory grows with the rows, not
        with the steps. u0 is only Newton's first guess. If L_d is given on the group, element0
        (N×N) may be the first step g instead: μ0 = F⁻/h. `progress` is called with the number of
        steps done so far. checkpoint: a file. The rows are then kept beside it, and the state is
        saved in it about once a second: the same call continues a killed run, with the same
        numbers. Raises `StepFailure` (with the rows so far) if a step cannot be solved, `BadInput`
        for wrong shapes and counts, starts off a constraint, and the checkpoint of another run.
        """

        def stepper() -> Stepper:
            time = t0 if type(t0) is int else exact_rational(t0, "t0")
            start = self.starting.at(x0, mu0, u0, element0, time)
            if mu0 is not None:
                self.starting.check(start)
            return self.stepper(start)

        return self._run(stepper, steps, every, progress, checkpoint)

    def stepper(self, start: Start) -> Stepper:
        """Return a run from a start, for the loop `runs.run`."""
        return FreeMotion(self.edge, start)

    def dual_step(self, x: Numbers, mu: Numbers) -> tuple[Vector, Vector]:
        """Return (b, μ′), the step from (x, μ) on the dual algebroid, with u from F⁻(x, u) = hμ.

        With contact the step has its impulses in it; a step that varies begins with the density
        1/σ, and with E₀ the energy.
        """
        with self.numbers.working():
            rows = run(self.stepper(self.starting.at(x, mu)), 1)
            return rows.base[-1], rows.mu[-1]

    @property
    def geometry(self) -> StepMap:
        """The scheme's maps and derivatives as numbers at this step."""
        return self.context.geometry

    @cached_property
    def system(self) -> Step:
        """One step as data to be compiled; for a composition with its adjoint's substeps."""
        if not self.context.substeps:
            return self.context.equations.step
        return composed_step(*dict.fromkeys(c.equations for c in (self.context, *self.parts)))

    @cached_property
    def _kernels(self) -> Kernels:
        with blamed(self.scheme):
            return compile(self.system, self.numbers, self.without)

    @cached_property
    def machine(self) -> KernelsAtStep:
        """The compiled kernels at this step, with their coefficients and buffers."""
        name = f"{self.scheme.scene.name} with {self.scheme.rule.name}"
        kinds = [int(part.equations is not self.context.equations) for part in self.parts]
        return KernelsAtStep(self._kernels, self.numbers, [p.q for p in self.parts], kinds, name)

    @cached_property
    def edge(self) -> EdgePolicy:
        """The policy for steps that reach the edge of their chart."""
        made = (lambda: self.machine), (lambda: self.system)
        return POLICIES[self.on_edge](self.context, *made, self.stages)

    @cached_property
    def stages(self) -> StagesAtStep | None:
        """The kernels of collocation at this step, or None if Newton's method solves all steps."""
        return self._collocation[0]

    @property
    def by_newton(self) -> str:
        """The reason for steps by Newton's method alone; "" if a fixed point goes first."""
        return self._collocation[1]

    @cached_property
    def _collocation(self) -> tuple[StagesAtStep | None, str]:
        return collocation(self.context, self.without)

    @cached_property
    def starting(self) -> Starting:
        """The starts of runs."""
        return Starting(self.edge)


# The choice of steps that are solved as collocation, by the fixed point of their stages.


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
