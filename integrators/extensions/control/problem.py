"""A problem of optimal control as data: a scene, a cost, inputs, and the end of the motion."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

from ...errors import BadInput, CannotMeasure, check_function, names_checked, shown
from ...numbers import exact_vector, measure
from ...numbers.types import Function, Given
from ...rules import Discretisation, check_rule, midpoint
from ...scene import Scene
from .boundary_problem import Optimum, solve
from .first_guess import End, Path
from .stages import ControlStages, stages_of

MOST = 64  # largest number of controls: a step has the square of it in second derivatives


@names_checked
@dataclass(frozen=True, eq=False)
class Control:
    """Steer a scene from its start to `end` at the least cost: min ∫ C(x, ξ, f) dt.

    cost(x, v, f, p) or cost(x, v, f, p, t): C, with sympy columns x (n×1), v (m×1) and f, the
    control (controls×1). inputs(x, v, f, p) or inputs(x, v, f, p, t): the m components of force
    that the control produces, in the natural basis of A*, in addition to the scene's own force; by
    default f itself. end: (x1, v1), exact like the scene's start; None for x1 or v1 leaves it free.
    duration: the time of the motion (default: the scene's). path(t): a point near the motion at the
    time t, n numbers, where Newton begins; by default the straight arrow from the start.

    The discrete problem evaluates cost and force at the points where the rule evaluates the
    Lagrangian, with the same weights. For a group whose attitude matters use
    `scene.with_attitude()`. Raises `BadInput` for data that do not fit.
    """

    scene: Scene
    cost: Function
    end: End
    inputs: Function | None = None
    controls: int | None = None
    duration: Given = None
    path: Path | None = None

    #: the sentence with which a `Scheme` refuses it
    no_scheme = "a problem of control has no scheme: solve it by problem.solve(steps, rule)."

    def __post_init__(self) -> None:
        scene = self.scene
        if not isinstance(scene, Scene):
            raise BadInput(f"{shown(scene)} is no scene: give a Scene, or scenes.get(name).")
        name, m = scene.name, scene.groupoid.dim_u
        scene.refuse("control")
        count = m if self.controls is None else self.controls
        if type(count) is not int or not 1 <= count <= MOST or (self.inputs is None and count != m):
            raise BadInput(
                f"{name}: controls is {shown(self.controls)}; give their number, a whole number "
                f"from 1 to {MOST}, and inputs=, which makes {m} components of force of them."
            )
        for word in ("cost", "inputs"):
            if word == "cost" or self.inputs is not None:
                function = getattr(self, word)
                check_function(function, f"{name}: {word}=", "(x, v, f, p)", "(x, v, f, p, t)")
        if not isinstance(self.end, (tuple, list)) or len(self.end) != 2:
            raise BadInput(
                f"{name}: end is {shown(self.end)}; give (x1, v1), None for what is free."
            )
        sizes = zip(("x1", "v1"), self.end, (scene.groupoid.dim_x, m), strict=True)
        end = tuple(e if e is None else exact_vector(e, k, f"{name}: {w}") for w, e, k in sizes)
        duration = scene.duration if self.duration is None else self.duration
        duration = measure(duration, f"{name}: duration")
        if duration <= 0:
            raise BadInput(f"{name}: the duration is {duration}; give a positive time.")
        for key, value in (("controls", count), ("end", end), ("duration", duration)):
            object.__setattr__(self, key, value)

    def stages(self, rule: Discretisation = midpoint) -> ControlStages:
        """Return the discrete problem of one step by a rule, for any number of steps.

        Raises `CannotMeasure` for compositions and one-step maps.
        """
        check_rule(rule)
        if rule.method is not None or not rule.asks_lagrangian:
            raise CannotMeasure(
                f"{self.scene.name}: {rule.name} is no weighted sum of values of L, of which "
                "control takes cost and force; take midpoint, trapezoidal or gauss-2."
            )
        if refusal := rule.refusal(self.scene):
            raise CannotMeasure(refusal)
        assert self.controls is not None  # __post_init__ has checked this
        return stages_of(self.scene, self.cost, self.inputs, self.controls, rule)

    def solve(
        self, steps: int, rule: Discretisation = midpoint, near: Optimum | None = None
    ) -> Optimum:
        """Return a discrete motion with `steps` steps that is a local minimum (`Optimum`).

        Others may cost less. near: an optimum with other steps, from which Newton's method begins,
        so that both are of one branch. Raises `BadInput` if the end cannot be reached or the inputs
        do not steer it, `NotDecided` if what is met is no minimum, or none is met from any start
        (`boundary_problem.best_of`).
        """
        if type(steps) is not int or not 1 <= steps <= 10**6:
            raise BadInput(f"steps is {shown(steps)}: give a whole number from 1 to 10**6.")
        groupoid = self.scene.groupoid
        sizes = [(groupoid.dim_x,), (groupoid.dim_u,), (self.controls,)]
        given = [getattr(near, word, None) for word in ("x", "mu", "node_controls")]
        if near is not None and [getattr(e, "shape", ())[1:] for e in given] != sizes:
            raise BadInput(
                f"near= is no solution of {self.scene.name}: give what its solve returned."
            )
        return solve(self.stages(rule), self.end, self.duration, steps, self.path, near)

    def with_values(self, **changes: Any) -> Control:
        """Return a copy with some fields changed."""
        names = [f.name for f in fields(self)]
        if foreign := set(changes) - set(names):
            raise BadInput(f"a Control has no {shown(min(foreign))}; it has {', '.join(names)}.")
        return replace(self, **changes)
