"""Where a run begins: what was given is checked, rounded once, and completed by the scene."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..bisections.translates import GroupChart
from ..equations.checks import check_start
from ..equations.continuous import initial_momentum
from ..errors import BadInput
from .failures import failure

if TYPE_CHECKING:
    from .flow import Flow


class Start(NamedTuple):
    """x, μ, and a guess of the first solution: u in the chart of a translate."""

    x: np.ndarray
    mu: np.ndarray
    guess: np.ndarray
    translate: int = 0


class Starting:
    """The starts of a flow's runs, in its own numbers."""

    def __init__(self, flow: Flow) -> None:
        self.flow, self.scheme, self.numbers = flow, flow.scheme, flow.numbers

    def at(self, x0: Any, mu0: Any, u0: Any = None, element0: Any = None) -> Start:
        """The start of a run with these arguments (`Flow.trajectory`); None is the scene's own.

        Raises `BadInput` for what does not fit, `StepFailure` where FL is singular at element0.
        """
        if element0 is not None:
            if mu0 is not None or u0 is not None:
                raise BadInput(
                    f"{self.scheme.scene.name}: element0 says what mu0 and u0 are; leave these out."
                )
            return self._with_element(element0, x0)
        if x0 is None and mu0 is None and u0 is None:
            return self.own
        return self._with_momentum(x0, mu0, u0)

    @cached_property
    def own(self) -> Start:
        """The scene's start, rounded once for all runs of this flow."""
        return self._with_momentum(None, None, None)

    def _with_momentum(self, x0: Any, mu0: Any, u0: Any) -> Start:
        scene = self.scheme.scene
        guess = scene.v0 if u0 is None else u0
        if mu0 is None:
            if x0 is not None:
                scene = scene.with_values(x0=x0)
                check_start(self.scheme.s, scene)
            mu0 = initial_momentum(self.scheme.s, scene, self.numbers)
        x, guess = self.rounded(scene.x0 if x0 is None else x0, guess)
        _, mu = self.rounded(scene.x0, mu0)
        return Start(x, mu, guess)

    def _with_element(self, element: Any, x0: Any) -> Start:
        """(x, F⁻(x, g)/h, where g lies) of a first step g."""
        flow, scheme = self.flow, self.scheme
        if scheme.element is None:
            raise BadInput(
                f"{scheme.scene.name}: element0 is the first step of a discrete Lagrangian given "
                "on the group; give mu0 (and u0) instead."
            )
        if len(flow.parts) > 1:
            raise BadInput(
                f"{scheme.scene.name}: {scheme.rule.name} is a composition, whose step is no one "
                "element; give mu0 (and u0) instead of element0."
            )
        g, scene = self._in_group(element), scheme.scene
        x, _ = self.rounded(scene.x0 if x0 is None else x0, scene.v0)
        translate, u = flow.edge.place(g)
        mu = flow.geometry_in(translate).at(x, u)["minus"] / flow._h
        # where FL is singular at g, μ does not tell g apart, and the run would begin elsewhere
        solved = flow.machine.solve(x, mu, flow.edge.coefficients(translate), u)
        far = flow.edge.root_eps * (1 + max(abs(u)))
        if solved is None or not max(abs(solved[0] - u)) <= far:
            raise failure(flow, "FL is singular at the first step element0", {"x": x, "mu": mu})
        return Start(x, mu, u, translate)

    def _in_group(self, g: Any) -> np.ndarray:
        """An N×N matrix that lies in the group, to a thousand round-offs."""
        scene = self.scheme.scene
        chart = GroupChart(scene.groupoid, self.numbers)
        try:
            g = chart.array(g)
            J = chart.best(g)
            off = np.max(abs(chart.element(chart.coordinates(g, J), J) - g))
        except (TypeError, ValueError, IndexError, ZeroDivisionError):
            off = None
        if off is None or not off <= 2**20 * self.numbers.eps * (1 + np.max(abs(g))):
            raise BadInput(
                f"{scene.name}: element0 is no element of {scene.groupoid.name}; give a "
                f"matrix of that group, {chart.size}×{chart.size}."
            )
        return np.asarray(g)

    def rounded(self, *vectors: Any) -> list[np.ndarray]:
        """An x, or an x and a u (or μ), checked and rounded; None is the empty vector.

        Raises `BadInput` for what is no list of the length that is needed.
        """
        name, number = self.scheme.scene.name, self.numbers.number
        out = []
        for vector, length in zip(vectors, (len(self.scheme.x), len(self.scheme.u)), strict=True):
            listed = isinstance(vector, Iterable) or hasattr(vector, "shape")
            if vector is not None and (isinstance(vector, str) or not listed):
                raise BadInput(
                    f"{name}: {vector!r} was given where a list of {length} numbers is needed."
                )
            entries = [] if vector is None else list(vector)
            if len(entries) != length:
                raise BadInput(
                    f"{name}: a vector of {len(entries)} entries was given where {length} are "
                    "needed."
                )
            out.append(np.array([number(e) for e in entries], dtype=self.numbers.dtype))
        return out
