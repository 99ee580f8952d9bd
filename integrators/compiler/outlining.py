"""Nodes of a curve that are alike become one function, called for each.

The atoms of a node (point, velocity, gradient, second derivatives) are functions of its chart
values and of what all nodes share (x and the coefficients). Two nodes whose values are equal when
their letters are numbered through are alike: derived as often as there are nodes, they are
compiled once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..equations.letters import Atom
from ..numbers.lazy import sympy
from ..numbers.printing import Call, function_text

SMALLEST = 40  # operations from which a call costs less than it saves


class Outliner:
    """Collects the node functions of one module; `texts` are theirs, in order."""

    def __init__(self, hoist: Callable[[Any], Any]) -> None:
        self.hoist = hoist
        self.texts: list[str] = []
        self._names: dict[Any, str] = {}

    def definitions(self, atoms: Sequence[Atom], uses: set[Any]) -> list[tuple[Any, Any]]:
        """(symbols, values) of the atoms for expressions with the symbols `uses`."""
        values = {atom: [self.hoist(e) for e in atom.value] for atom in atoms}
        alike: dict[Any, list[_Node]] = {}
        for part in _parts(atoms):
            node = _Node(part, values, atoms, uses)
            if node.operations >= SMALLEST:
                alike.setdefault(node.key, []).append(node)
        calls: list[tuple[Any, Any]] = []
        called: set[Atom] = set()
        for key, found in alike.items():
            if len(found) > 1:
                name = self._function(key, found[0])
                calls += [(node.outputs, Call(name, node.inputs)) for node in found]
                called = called.union(*(node.atoms for node in found))
        return [*((list(a.z), values[a]) for a in atoms if a not in called), *calls]

    def _function(self, key: Any, node: _Node) -> str:
        if key not in self._names:
            self._names[key] = name = f"node{len(self._names)}"
            columns = [(list(a.z), node.values[a]) for a in node.atoms]
            text = function_text(name, {}, [node.outputs], columns, node.inputs)
            self.texts.append(f"@node\n{text}")
        return self._names[key]


class _Node:
    """Connected atoms: their inputs, their outputs and a key that is equal for nodes alike."""

    def __init__(
        self, part: list[Atom], values: dict[Atom, list[Any]], atoms: Sequence[Atom], uses: set[Any]
    ) -> None:
        self.atoms, self.values = part, values
        own = {z for a in part for z in a.z}
        held = set().union(*(e.free_symbols for a in part for e in values[a]))
        outside = uses.union(*(e.free_symbols for a in atoms if a not in part for e in values[a]))
        self.outputs = [z for a in part for z in a.z if z in outside]
        charts = [z for a in atoms if a.kind == "chart" for z in a.z if z in held]
        shared = sorted(held - own - set(charts), key=str)
        self.inputs = [*charts, *shared]
        letters = [*charts, *(z for a in part for z in a.z)]
        numbered = {z: sympy.Symbol(f"letter {i}", real=True) for i, z in enumerate(letters)}
        flat = tuple(e.xreplace(numbered) for a in part for e in values[a])
        self.key = (flat, tuple(numbered[z] for z in self.outputs), len(charts), tuple(shared))
        self.operations = sum(sympy.count_ops(e) for e in flat)


def _parts(atoms: Sequence[Atom]) -> list[list[Atom]]:
    """The atoms that belong together: connected by their values, but for what joins nodes."""
    inner = [a for a in atoms if a.kind not in ("chart", "sum") and a.fields is None]
    of = {z: i for i, a in enumerate(inner) for z in a.z}
    group = list(range(len(inner)))
    for i, atom in enumerate(inner):
        for z in set().union(*(e.free_symbols for e in atom.value)) & set(of):
            old, new = group[of[z]], group[i]
            group = [new if g == old else g for g in group]
    return [[a for a, g in zip(inner, group, strict=True) if g == k] for k in dict.fromkeys(group)]
