"""A scene discretised by a rule: equations, which have no values, and the scene with its values."""

from __future__ import annotations

from typing import Any, cast

from ..errors import BadInput, CannotMeasure, brief_name, misplaced
from ..groupoids import check_axioms
from ..rules import Composition, Discretisation, OneStepMap, check_rule, own
from ..scene import Scene
from .checks import check_regular, check_start
from .constrained_equations import ConstrainedEquations
from .constrained_start import on_constraints
from .discrete_equations import DiscreteEquations
from .implicit_lagrangian import with_momenta
from .nonsmooth import check_smooth
from .one_step_equations import OneStepEquations
from .symbols import SceneSymbols


class DiscretisedScene:
    """The pair of `equations` and the `scene` with its values, by a `rule`.

    Attributes of the equations are its own too: `scheme.FL` is `scheme.equations.FL`. The equations
    of a composition are those of its base rule.

    equations: those of a scene that differs only in values; then nothing is derived. Otherwise
    raises `BadInput` if the groupoid violates its axioms, the rule or the Lagrangian cannot be
    evaluated, or L_d is degenerate (FL singular everywhere). Raises it for a start that violates a
    constraint of the scene by more than round-off, and for a parameter of another shape than in the
    equations.
    """

    def __init__(
        self,
        scene: Scene,
        rule: Discretisation,
        equations: DiscreteEquations | OneStepEquations | None = None,
    ) -> None:
        if isinstance(scene, Discretisation):
            raise misplaced(scene.name, "rule", "scene")
        if not isinstance(scene, Scene):
            raise BadInput(f"{brief_name(scene)} is no scene: give a Scene, or scenes.get(name).")
        check_rule(rule)
        derived = _derived(scene, rule) if equations is None else equations
        if len(scene.parameter_values) != len(derived.s.parameter_list):
            raise BadInput(f"{scene.name}: a parameter has another shape than before.")
        scene = on_constraints(derived.s, scene)
        check_start(derived.s, scene)
        if isinstance(derived, OneStepEquations):
            if equations is None:
                derived.check_regular(scene)
        elif equations is None:
            check_regular(derived, scene, rule)
        self.scene, self.equations = scene, cast(Any, derived)
        # L_d that a scene gives has a rule of its own; one with momenta keeps the given rule
        same = isinstance(rule, Composition) or derived.rule.name == rule.name
        self.rule = rule if same else derived.rule

    @property
    def one_step(self) -> bool:
        """True if the equations are those of a one-step map, without a discrete Lagrangian."""
        return isinstance(self.equations, OneStepEquations)

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of the equations."""
        if name == "equations":  # not set yet, as in an unfinished copy
            raise AttributeError(name)
        return getattr(self.equations, name)


def _derived(scene: Scene, rule: Discretisation) -> DiscreteEquations | OneStepEquations:
    check_axioms(scene.groupoid)
    of_step = rule.base if isinstance(rule, Composition) else rule
    if refusal := of_step.refusal(scene):
        raise CannotMeasure(refusal)
    if isinstance(of_step, OneStepMap):
        return OneStepEquations(_symbols(scene), of_step)
    if scene.constrained:
        return ConstrainedEquations(_symbols(scene, of_step.stages), of_step)
    if scene.discrete_lagrangian is not None:
        of_step = own  # no rule applies if L_d is given
    if scene.hamiltonian is not None and not scene.has_lagrangian:
        of_step = with_momenta(SceneSymbols(scene), of_step)
    return DiscreteEquations(_symbols(scene, of_step.stages), of_step)


def _symbols(scene: Scene, stages: int = 0) -> SceneSymbols:
    """Return a scene's letters, with a finite, real and smooth Lagrangian."""
    s = SceneSymbols(scene, stages)
    if scene.lagrangian is not None:
        check_smooth(scene, s)
    return s
