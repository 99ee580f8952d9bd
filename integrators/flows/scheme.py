"""A scene discretised by a rule: its equations, its order, its adjoint, its flows."""

from __future__ import annotations

from functools import cached_property
from typing import Any, cast

import numpy as np

from ..equations import DiscretisedScene, StepEquations, blamed
from ..errors import BadInput, arguments_checked, check_names
from ..geometry import is_self_adjoint, order_of_step
from ..hooks import check_gaps, contact_flow, modified_equation, proven_flow
from ..numbers import Matrix
from ..numbers.types import Given
from ..rules import Discretisation, Substep, adjoint
from ..runs import Trajectory
from ..scene import Again, Scene
from .flow import Flow
from .latex import latex_of
from .scene_runs import Substeps
from .step_choice import step_for


class Scheme(DiscretisedScene):
    """A scene discretised by a rule: equations and values, with an order, an adjoint and flows.

    Raises `BadInput` if the groupoid violates its axioms, if the rule or the Lagrangian cannot be
    evaluated, or if L_d is degenerate (FL singular everywhere); for a scene with contact, if the
    start is inside the obstacle (with the depth), and for gaps that are closed there and contradict
    each other.
    """

    def __init__(self, scene: Any, rule: Any, equations: StepEquations | None = None) -> None:
        super().__init__(scene, rule, equations)
        if self.scene.contact is not None:
            check_gaps(self.equations.s, self.scene)

    def __new__(cls, scene: Any = None, *arguments: Any, **named: Any) -> Any:
        """Return what the scene's own `discretise` makes of the rule, or the rule's of the scene.

        A lattice has one, and a rule without a formula; that of a `Scene` is this class.
        """
        if cls is Scheme:  # subclasses check their own arguments: the second may be no rule
            check_names("Scheme", named, ("scene", "rule", "equations"))
            rule: Any = arguments[0] if arguments else named.get("rule")
            asked: tuple[tuple[object, Any], ...] = ((scene, rule), (rule, scene))
            for one, other in () if isinstance(scene, Discretisation) else asked:
                if hasattr(one, "discretise") and not isinstance(one, type | Scene):
                    return one.discretise(other)
        return super().__new__(cls)

    def _repr_latex_(self) -> str | None:
        """Return the equations for a notebook."""
        return latex_of(self)

    def __reduce__(self) -> Again:
        """Return the pickled form: equations are derived again, or read from the cache."""
        return Scheme, (self.scene, self.rule)

    def __deepcopy__(self, memo: object) -> Scheme:
        return self  # a scheme is immutable

    def at(self, **values: Any) -> Scheme:
        """Return this scheme with other values: parameters, x0, v0, step, duration, name.

        Nothing is derived or compiled again. Raises `BadInput` for values that do not fit, and for
        another Lagrangian or groupoid.
        """
        return Scheme(self.scene_with(values), self.rule, self.equations)

    @cached_property
    def self_adjoint(self) -> bool:
        """True if Φ₋ₕ is the inverse of Φₕ, by the Legendre maps, or by the map itself."""
        if (method := self.rule.method) is not None:
            # a palindrome of self-adjoint steps, or of alternating Φ* and Φ
            return bool(method.symmetric)
        with blamed(self):
            return is_self_adjoint(self.equations)

    @cached_property
    def base(self) -> Scheme:
        """The scheme of a composition's base rule; for another rule this scheme."""
        if self.rule.method is None:
            return self
        return Scheme(self.scene, self.equations.rule, self.equations)

    @cached_property
    def adjoint(self) -> Scheme:
        """The scheme of the (base) rule's adjoint, whose step is the inverse of Φ₋ₕ."""
        equations = self.equations.adjoint
        return Scheme(self.scene, equations.rule, equations)

    @cached_property
    def substeps(self) -> tuple[Substep, ...]:
        """The substeps of a composition; () for a rule of one step."""
        method = self.rule.method
        return () if method is None else method.substeps(self.base.self_adjoint)

    @property
    def has_arrows(self) -> bool:
        """True if a step is a map of arrows (x, u) ↦ (y, v), on which Ω is defined.

        It is False for a composition and for a one-step map.
        """
        return not (self.substeps or self.arrows is None)

    @property
    def flow_substeps(self) -> Substeps:
        """(scheme, share of the step) of a composition's substeps, as `Flow` takes it."""
        return [(self.adjoint if s.adjoint else self, s.coefficient) for s in self.substeps]

    @cached_property
    def order(self) -> int | None:
        """The order in (x, μ) of this rule on this scene, or None if the rule states none.

        It is that of `order_of_step`; a composition has the higher one of its own and its base's
        order.
        """
        if (method := self.rule.method) is not None:
            of_base = self.base.order
            order = None if of_base is None else method.order_over(of_base, self.base.self_adjoint)
            return cast("int | None", order)
        if self.equations.discrete is None:
            return cast("int | None", self.rule.order)
        if self.equations.element is not None:
            return self.equations.element.given.order
        return order_of_step(self.rule, self.equations, lambda: self.self_adjoint)

    @arguments_checked
    def modified_equation(self, order: int = 4, digits: int = 16) -> Any:
        """Return the modified equation up to a power of the step: fields and Hamiltonians by order.

        digits: those of its numbers. Raises `BadInput` for another order, `CannotMeasure` where the
        steps have no series in h (`expansions.ModifiedEquation`).
        """
        return modified_equation(self, order, digits)

    @arguments_checked
    def flow(
        self,
        step: Given | None = None,
        digits: int = 16,
        on_edge: str = "refuse",
        *,
        tolerance: Given | None = None,
        impacts: str | None = None,
        proven: bool = False,
    ) -> Flow:
        """Return the flow at one step size; digits = 16 is compiled double precision, more is
        mpmath, and 7 single precision (numpy's float32).

        on_edge: "refuse", "bisect" or "shrink" if a step reaches the edge of its chart
        (`bisections.edge_policies`); a composition cannot "bisect". tolerance: instead of a step,
        the error at eight times of the scene's duration, for which a pilot run chooses the step
        (`Flow.choice`). impacts: "stepped" or "located", if the scene has contact (default: the
        scene's own choice). proven: True for runs of which every step is proven to exist and to be
        unique, with a bound of the distance from the exact discrete run (`Trajectory.proof`); with
        more than 16 digits. Raises `BadInput` unless exactly one of step and tolerance is given,
        for a tolerance out of reach, for one with stepped impacts, and where nothing is proven.
        """
        if impacts is not None:
            self.scene.refuse("impacts")
            return self.at(impacts=impacts).flow(step, digits, on_edge, tolerance=tolerance)
        if (step is None) == (tolerance is None):
            raise BadInput(
                f"{self.scene.name}: give a step, or a tolerance for which a step is chosen."
            )

        if proven:
            return self._proven(step, digits, on_edge, tolerance)
        if tolerance is None:
            return self.flow_at(step, digits, on_edge)
        if self.scene.contact is not None and self.scene.impacts == "stepped":
            raise BadInput(
                f"{self.scene.name}: stepped impacts are late by up to a step, an error that runs "
                'of two steps may share; with a tolerance say impacts="located".'
            )
        choice = step_for(self, tolerance, lambda size: self.flow_at(size, digits, on_edge))
        flow = self.flow_at(choice.step, digits, on_edge)
        flow.choice = choice
        return flow

    def _proven(
        self, step: Given | None, digits: int, on_edge: str, tolerance: Given | None
    ) -> Flow:
        for is_so, why in (
            (tolerance is not None, "give a step, no tolerance"),
            (on_edge != "refuse", "leave on_edge= out"),
            (not 16 < digits <= 300, "ask for 17 to 300 digits, as by digits=30"),
        ):
            if is_so:
                raise BadInput(f"{self.scene.name}: a proven run is made in balls: {why}.")
        self.scene.refuse("a proof")
        made: Flow = proven_flow(self, step, digits, substeps=self.flow_substeps)
        return made

    def flow_at(self, step: Given, digits: int, on_edge: str) -> Flow:
        """Return the flow at a step that was given or chosen."""
        kind: Any = Flow if self.scene.contact is None else contact_flow
        made: Flow = kind(self, step, digits, on_edge, self.flow_substeps)
        return made


def mean_multipliers(flow: Flow, run: Trajectory) -> Matrix:
    """Return λ at every row of a run, (r, k), to second order in h: the mean of both sides' λ.

    `run.multipliers` is the λ of the step h that leaves a row, λ + c h + O(h²) if the rule is
    self-adjoint; on the side that arrives it is the λ of the adjoint's step −h from the same row,
    which undoes the step before it, λ − c h + O(h²). Their mean is even in h, so its error is O(h²)
    plus the error of the row itself. A rule that is not self-adjoint distributes the force of a
    step unevenly to its two ends, and the constraint reacts to that: no single λ is near the force
    of the constraint, but their mean is, to O(h). A composition of such a rule and its adjoint has
    the uneven ends of both at a row: there the mean is over the λ that leave by a step h and a step
    −h of both, again even in h. It costs one step per row, or four. Raises `BadInput` if there are
    no constraints and for a run of another flow, `StepFailure` if a step back cannot be solved.
    """
    scheme = flow.scheme
    if not isinstance(scheme, Scheme) or not run.multipliers.shape[1]:
        raise BadInput(f"{scheme.scene.name} has no constraints, so no multipliers.")
    if run.step != flow.step:
        raise BadInput(
            f"{scheme.scene.name}: that run is of another flow; ask the flow that made it."
        )
    composed = bool(scheme.substeps) and not scheme.base.self_adjoint
    if composed:
        steps = [(part, sign) for part in (scheme.base, scheme.adjoint) for sign in (1, -1)]
    else:
        own = scheme.self_adjoint
        steps = [(scheme if own else Scheme(scheme.scene, adjoint(scheme.rule)), -1)]
    flows = [part.flow(sign * flow.step, flow.digits) for part, sign in steps]
    sums = 0 * run.multipliers if composed else run.multipliers.copy()
    for total, x, mu, u in zip(sums, run.base, run.mu, run.u, strict=True):
        for each in flows:
            total += each.trajectory(0, x0=x, mu0=mu, u0=u).multipliers[0]
    return np.asarray(sums / (len(flows) + (not composed)))
