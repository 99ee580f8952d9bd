"""Starts of runs: their arguments are checked, rounded once, and completed from the scene."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..bisections import EdgePolicy
from ..equations import (
    check_force,
    check_momentum,
    check_on_constraints,
    initial_momentum,
    on_constraints,
)
from ..errors import BadInput
from ..numbers import Matrix, Numbers, Vector, exact_rational
from ..numbers.types import Exact, Rows


class Start(NamedTuple):
    """The start of a run: x, μ, a guess of the first u in a translate's chart, and the time."""

    x: Vector
    mu: Vector
    guess: Vector
    translate: int = 0
    t0: Exact = 0


class Starting:
    """The starts of a flow's runs, in its own numbers."""

    def __init__(self, edge: EdgePolicy) -> None:
        self.edge, self.context = edge, edge.context

    def at(
        self, x0: Numbers | Start | None, mu0: Numbers | None, u0: Numbers | None = None,
        element0: Rows | None = None, t0: Exact = 0,
    ) -> Start:  # fmt: skip
        """Return the start of a run with these arguments of `Flow.trajectory`; None: the scene's
        own. An x0 that is such a start already is returned.

        Raises `BadInput` for arguments that do not fit, `StepFailure` if FL is singular at
        element0.
        """
        if x0 is None and mu0 is None and u0 is None and element0 is None and t0 == 0:
            return self.own
        if isinstance(x0, Start):
            return x0
        x0, t0 = self._split_time(x0, t0)
        if element0 is None:
            return self._with_momentum(x0, mu0, u0, t0)
        if mu0 is not None or u0 is not None:
            raise BadInput(
                f"{self.context.scene.name}: element0 determines mu0 and u0; leave these out."
            )
        return self._with_element(element0, x0, t0)

    @cached_property
    def _with_values(self) -> bool:
        """True if a quantity has a prescribed value, such as |Γ|² = 1."""
        return any(quantity.value is not None for quantity in self.context.scene.symmetries)

    def _split_time(self, x0: Any, t0: Exact) -> tuple[Any, Exact]:
        """Return (x0 without its time, the time of the start); x0 may contain a time."""
        s = self.context.equations.s
        try:
            timed = s.clocked and len(x0) == s.n + 1
        except TypeError:  # None, or an argument that is refused later
            timed = False
        if not timed:
            return x0, t0
        *position, last = x0
        time = exact_rational(last, "the time in x0")
        if t0 not in (0, time):
            raise BadInput(f"x0 has the time {last}, but t0 is {t0}: leave one of them out.")
        return position, time

    @cached_property
    def own(self) -> Start:
        """The scene's start, rounded once for all runs of this flow."""
        return self._with_momentum(None, None, None)

    @cached_property
    def _v0(self) -> Vector:
        """The scene's own velocity, where Newton's method starts."""
        return self.context.vector(self.context.scene.v0, len(self.context.equations.s.u))

    def check(self, start: Start) -> None:
        """Raise `BadInput` if a start violates a constraint of the scene.

        A one-step map may violate it, and continues from there.
        """
        context, s = self.context, self.context.equations.s
        if context.scene.all_constraints:
            check_on_constraints(s, context.scene, context.numbers, start.x, start.mu)
        if context.equations.arrows is not None and self._with_values:
            check_momentum(s, context.scene, start.x, start.mu)

    def _with_momentum(
        self, x0: Numbers | None, mu0: Numbers | None, u0: Numbers | None, t0: Exact = 0
    ) -> Start:
        context, scene = self.context, self.context.scene
        s, elsewhere = context.equations.s, mu0 is None and x0 is not None
        if mu0 is None and (elsewhere or t0):  # the scene's own start is on its constraints at 0
            scene = scene.with_values(x0=x0) if elsewhere else scene
            if scene.all_constraints:
                scene = on_constraints(s, scene, t0)
                x0 = scene.x0 if elsewhere else x0
        if elsewhere:
            check_force(s, scene)
        if mu0 is None:
            mu0 = initial_momentum(s, scene, context.numbers, t0)
        at = scene.x0 if x0 is None else x0
        x = context.vector(s.with_time(at, t0), len(s.x))
        mu = context.vector(mu0, len(context.equations.u))
        if elsewhere and self._with_values:  # x0 may be a row of a run, and is rounded then
            check_momentum(s, scene, x, mu)
        guess = self._v0 if u0 is None else context.vector(u0, len(s.u))
        return Start(x, mu, context.start(x, mu, guess), t0=t0)

    def _with_element(self, element: Rows, x0: Numbers | None, t0: Exact) -> Start:
        """Return the start x, F⁻(x, g)/h of a first step g, an N×N matrix."""
        edge, context, scene = self.edge, self.context, self.context.scene
        if context.equations.element is None:
            raise BadInput(
                f"{scene.name}: element0 is the first step of a discrete Lagrangian given "
                "on the group; give mu0 (and u0) instead."
            )
        if context.substeps:
            raise BadInput(
                f"{scene.name}: {context.scheme.rule.name} is a composition, whose step is no "
                "one element; give mu0 (and u0) instead of element0."
            )
        g = self._in_group(element)
        x, _ = context.vectors(scene.x0 if x0 is None else x0, scene.v0)
        translate, u = edge.place(g)
        mu = context.geometry_in(translate).at(x, u)["minus"] / context.h
        # if FL is singular at g, μ does not determine g, and the run would begin elsewhere
        solved = edge.machine.solve(x, mu, edge.coefficients(translate), u)
        far = edge.root_eps * (1 + max(abs(u)))
        if solved is None or not max(abs(solved[0] - u)) <= far:
            raise context.failure("FL is singular at the first step element0", {"x": x, "mu": mu})
        return Start(x, mu, u, translate, t0=t0)

    def _in_group(self, g: Rows) -> Matrix:
        """Return g, N×N, if it is an element of the group to half of a double's digits."""
        scene, chart = self.context.scene, self.context.chart
        try:
            g = chart.array(g)
            u = self.context.coordinates(g, chart.best(g))
        except (TypeError, ValueError, IndexError):  # not a matrix, or one of another size
            u = None
        if u is None:
            raise BadInput(
                f"{scene.name}: element0 is no element of {scene.groupoid.name}; give a "
                f"matrix of that group, {chart.size}×{chart.size}."
            )
        return np.asarray(g)
