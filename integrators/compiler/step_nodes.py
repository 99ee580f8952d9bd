"""A step whose expressions are nodes of one graph, the form in which kernels are written."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..numbers import Graph, Node, read_definitions
from .step import Step


class StepNodes:
    """The letters x, u, w, mu, y, q and the expressions of a step, as lists of nodes.

    slope is a list of rows; wanted has as many entries as rows.
    """

    def __init__(self, step: Step) -> None:
        self.step = step
        self.graph = graph = Graph()
        read_definitions(graph, step.definitions)
        letters = (step.x, step.u, step.w, step.mu, step.y, step.q)
        self.x, self.u, self.w, self.mu, self.y, self.q = map(graph.letters, letters)
        self.rows, self.increment, self.gain = map(
            self.read, (step.rows, step.increment, step.gain)
        )
        entries, m = self.read(step.slope), len(step.w)
        self.slope = [entries[i * m : i * m + m] for i in range(m)]
        self.wanted = self.read(step.wanted or [*step.mu, *[0] * (m - len(step.mu))])

    def read(self, entries: Iterable[Any]) -> list[Node]:
        """Return the nodes of expressions in the step's letters."""
        return [self.graph.node(e) for e in entries]
