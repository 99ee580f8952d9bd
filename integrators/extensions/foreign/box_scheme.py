"""A scene with a black box: the attributes of a scheme, as far as a program can provide them."""

from __future__ import annotations

from ...equations import DiscretisedScene, SceneSymbols, StepEquations, check_finite
from ...errors import BadInput, CannotMeasure, arguments_checked
from ...groupoids import check_axioms
from ...numbers import Arithmetic, exact_rational
from ...numbers.types import Given
from ...rules import Discretisation
from ...scene import Scene
from .box_flow import BoxFlow
from .gradient import check_gradient
from .scene_in_numbers import SceneInNumbers, scene_in_numbers


class BoxEquations(StepEquations):
    """The scene's letters and a box, whose step has no formula."""

    def refused(self, name: str) -> CannotMeasure:
        return CannotMeasure(
            f"{self.rule.name} is a black box, a function of numbers: it has no {name}."
        )


class BoxScheme(DiscretisedScene):
    """A scene with a black box: it has flows and a claimed order, but no Ω on arrows.

    Raises `BadInput` for an argument that is not a scene, and `CannotMeasure` if the box cannot run
    on the scene.
    """

    #: a step is a map (x, μ) ↦ (x′, μ′), not an arrow
    has_arrows = False
    substeps: tuple[()] = ()
    no_scene = "no scene that a black box can be run on"

    def derive(self, scene: Scene, rule: Discretisation) -> BoxEquations:
        """Return the scene's letters; raises `CannotMeasure` if the box cannot run on the scene."""
        if refusal := rule.refusal(scene):
            raise CannotMeasure(refusal)
        check_axioms(scene.groupoid)
        s = SceneSymbols(scene)
        if scene.in_numbers:
            check_gradient(scene)
        else:
            check_finite(scene, s)
        return BoxEquations(s, rule)

    def in_numbers(self, numbers: Arithmetic, kind: type | None = None) -> SceneInNumbers:
        """Return the scene as the last argument of a black box, in the given arithmetic."""
        return scene_in_numbers(self.s, self.scene, numbers, kind)

    @property
    def order(self) -> int | None:
        """The order that the author claims."""
        return self.rule.order

    @property
    def base(self) -> BoxScheme:
        """This scheme, since a box is not a composition."""
        return self

    #: unknown: only steps there and back can tell, whatever its author claims
    self_adjoint: bool | None = None

    def at(self, **values: object) -> BoxScheme:
        """Return this box on the scene with other values; raises like `Scheme.at`."""
        return BoxScheme(self.scene_with(values), self.rule, self.equations)

    @arguments_checked
    def flow(
        self, step: Given | None = None, digits: int = 16, on_edge: str = "refuse", *,
        tolerance: Given | None = None,
    ) -> BoxFlow:  # fmt: skip
        """Return the box at one step size.

        Raises `CannotMeasure` for digits that it does not have, and `BadInput` for a tolerance, for
        which only a scheme can choose a step.
        """
        if step is None or tolerance is not None:
            raise BadInput(f"{self.scene.name}: give a step; a black box chooses none itself.")
        if not self.rule.runs_at(digits):
            raise CannotMeasure(
                f"the black box {self.rule.name} computes in machine numbers, so {digits} digits "
                'are nothing it has: take digits=16, or say numbers="any" if it works on mpmath '
                "numbers."
            )
        only = self.rule.step
        if only is not None and exact_rational(step, "step") != only:
            raise CannotMeasure(
                f"{self.rule.name} is a map of one step, {float(only):.6g}, and makes none of "
                f"{float(step):.6g}: only its form, volume and way back are judged (discmech "
                "symplecticity, discmech reversibility)."
            )
        return BoxFlow(self, step, digits)
