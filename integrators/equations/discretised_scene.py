"""A scene discretised by a rule: equations, which have no values, and the scene with its values."""

from __future__ import annotations

from typing import Any

from ..errors import (
    BadInput,
    CannotMeasure,
    arguments_checked,
    brief_name,
    misplaced,
    shown,
)
from ..groupoids import check_axioms
from ..hooks import source_text
from ..numbers import uncollected
from ..numbers.types import Column
from ..rules import Discretisation, check_rule, own
from ..scene import Scene
from .arrows import Arrows
from .checks import check_smooth, check_start
from .constrained_equations import ConstrainedEquations
from .constrained_start import on_constraints
from .one_step_equations import OneStepEquations
from .rule_view import with_momenta
from .step_equations import DiscreteEquations, StepEquations
from .symbols import SceneSymbols


def _on_arrows(name: str) -> property:
    """Return the property of that name of the arrows; without arrows it raises `CannotMeasure`."""
    doc = getattr(Arrows, name).__doc__
    return property(lambda of: getattr(of.equations.arrows_for(name), name), doc=doc)


class DiscretisedScene:
    """The pair of `equations` and the `scene` with its values, by a `rule`.

    The equations of a composition are those of its base rule. Attributes: s, x, u, y, v, h, w and
    groupoid of the equations, and the theory's objects on arrows, written out (`Arrows`), which
    raise `CannotMeasure` where a step is no map of arrows.

    equations: those of a scene that differs only in values; then nothing is derived. Otherwise
    raises `BadInput` if the groupoid violates its axioms, the rule or the Lagrangian cannot be
    evaluated, or L_d is degenerate (FL singular everywhere). Raises it for a start that violates a
    constraint of the scene by more than round-off, and for a parameter of another shape than in the
    equations.
    """

    #: what subclasses have: the order, a flow at one step size, the runs of a recording, and True
    #: if a step is a map of arrows
    order: Any
    flow: Any
    runs: Any
    has_arrows: Any
    #: what any other object is
    no_scene = "no scene"

    @uncollected()
    def __init__(
        self, scene: Scene, rule: Discretisation, equations: StepEquations | None = None
    ) -> None:
        if isinstance(scene, Discretisation):
            raise misplaced(scene.name, "rule", "scene")
        if said := getattr(scene, "no_scheme", ""):
            raise BadInput(said)
        if not isinstance(scene, Scene):
            raise BadInput(
                f"{brief_name(scene)} is {self.no_scene}: give a Scene, or scenes.get(name)."
            )
        check_rule(rule)
        if not isinstance(equations, StepEquations | None):
            raise BadInput(
                f"{shown(equations)} is no StepEquations: give a scene and a rule alone; for a "
                "retraction say SCENE.with_retraction(...)."
            )
        derived = self.derive(scene, rule) if equations is None else equations
        if len(scene.parameter_values) != len(derived.s.parameter_list):
            raise BadInput(f"{scene.name}: a parameter has another shape than before.")
        if scene.all_constraints:
            scene = on_constraints(derived.s, scene)
        check_start(derived.s, scene)
        if equations is None:
            derived.check_regular(scene, rule)
        # L_d that a scene gives has a rule of its own; one with momenta keeps the given rule
        same = rule.method is not None or derived.rule.name == rule.name
        self.hold(scene, rule if same else derived.rule, derived)

    def derive(self, scene: Scene, rule: Discretisation) -> StepEquations:
        """Return the equations of a step; raises `CannotMeasure` where the rule has no meaning."""
        check_axioms(scene.groupoid)
        of_step = rule.of_step
        if refusal := of_step.refusal(scene):
            raise CannotMeasure(refusal)
        if not of_step.asks_lagrangian:
            return OneStepEquations(_symbols(scene), of_step)
        if scene.all_constraints:
            return ConstrainedEquations(_symbols(scene, of_step.stages), of_step)
        if scene.discrete_lagrangian is not None:
            of_step = own  # no rule applies if L_d is given
        if scene.hamiltonian is not None and not scene.has_lagrangian:
            of_step = with_momenta(SceneSymbols(scene), of_step)
        return DiscreteEquations(_symbols(scene, of_step.stages), of_step)

    def hold(self, scene: Scene, rule: Any, equations: StepEquations) -> None:
        """Set the attributes; the letters are those of the equations."""
        self.scene, self.rule, self.equations, self.s = scene, rule, equations, equations.s
        self.x, self.u, self.y, self.v = equations.x, equations.u, equations.y, equations.v
        self.h, self.groupoid = equations.h, equations.groupoid

    def scene_with(self, values: dict[str, Any]) -> Scene:
        """Return the scene with other values; raises `BadInput` for another law of the scene."""
        functions = {"lagrangian", "groupoid", "discrete_lagrangian", "fast", "force", "contact"}
        if derived := set(values) & functions:
            raise BadInput(
                f"{self.scene.name}: another {min(derived)} makes another scheme; "
                "derive it: Scheme(scene.with_values(...), rule)."
            )
        return self.scene.with_values(**values)

    def digits(self, wanted: int) -> int:
        """Return the digits in which its steps can be made, at most so many."""
        return self.scene.digits(wanted) if self.rule.runs_at(wanted) else 16

    @property
    def arrows(self) -> Arrows | None:
        """The objects on arrows (x, u); None if a step of the equations is no map of arrows."""
        return self.equations.arrows

    @property
    def discrete(self) -> Arrows:
        """L_d with its maps, without constraints; raises `CannotMeasure` if there is none."""
        return self.equations.discrete or self.equations.arrows_for("discrete Lagrangian")

    @property
    def w(self) -> Column:
        """The unknowns of a step."""
        return self.equations.w

    @property
    def adjoint(self) -> Any:
        """The adjoint; raises `CannotMeasure` where only a `Scheme` has one."""
        raise self.refused("adjoint")

    def modified_equation(self, *arguments: Any, **named: Any) -> Any:
        """Raise `CannotMeasure`: only a `Scheme` has a modified equation."""
        raise self.refused("modified equation")

    @arguments_checked
    def export(self, language: str, harness: bool = False) -> str:
        """Return one file with this scheme's step: language is "c", "numpy", "julia" or "jax".

        harness: with an adapter that answers JSON lines, as `external` asks them. Raises `BadInput`
        for another language, and for what cannot be exported.
        """
        return str(source_text(self, language, harness))

    def refused(self, name: str) -> CannotMeasure:
        """Return the refusal of what only steps of one size, given by formulas, have."""
        return self.equations.refused(name)

    rho, L, R = map(_on_arrows, ("rho", "L", "R"))
    FL, W, omega = map(_on_arrows, ("FL", "W", "omega"))
    legendre_minus, legendre_plus = map(_on_arrows, ("legendre_minus", "legendre_plus"))
    residual, discrete_lagrangian = map(_on_arrows, ("residual", "discrete_lagrangian"))


def _symbols(scene: Scene, stages: int = 0) -> SceneSymbols:
    """Return a scene's letters, with a finite, real and smooth Lagrangian."""
    s = SceneSymbols(scene, stages)
    if scene.lagrangian is not None:
        check_smooth(scene, s)
    return s
