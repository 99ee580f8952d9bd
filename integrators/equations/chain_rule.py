"""The chain rule through a scheme's atoms, in both directions.

`adjoints` goes backwards from L_d to x, u, s, as adjoint differentiation does. Each node of a
curve (a value of the Lagrangian) is differentiated by itself down to its chart values W and dw,
and its gradient is named; `total` goes forwards and names its second derivatives. So expressions
grow with the number of nodes only in sums of names, and nodes stay alike (`nodes` in
`integrators.compiler.outlining`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..numbers.differentiation import jacobian
from ..numbers.lazy import sympy
from .letters import Atom
from .symbols import SceneSymbols


@dataclass(frozen=True)
class Adjoints:
    """∂L_d along the paths that end in x, u and s, and at the points.

    `at_points`: (point of the straight step, ∂L_d/∂z); `turned`: (point of a curve, its part of
    (∂z/∂base · ρ(base))ᵀ ∂L_d/∂z).
    """

    x: Any
    u: Any
    s: Any
    at_points: list[tuple[Atom, Any]]
    turned: list[tuple[Atom, Any]]


class ChainRule:
    """Derivatives of expressions that hold atoms."""

    def __init__(self, atoms: list[Atom], s: SceneSymbols) -> None:
        self.s = s
        self.given = tuple(atoms)
        #: gradients at the chart values, then names of their derivatives
        self.derived: list[Atom] = []
        self._slopes: dict[tuple[Any, Any], Any] = {}
        self._gradients: dict[str, tuple[Atom, Atom]] = {}

    @property
    def atoms(self) -> list[Atom]:
        """All atoms, each after those that its value holds."""
        return [*self.given, *self.derived]

    def adjoints(self, f: Any) -> Adjoints:
        """Derivatives of the scalar f with respect to everything it depends on."""
        ends = [c for c in (self.s.x, self.s.u, self.s.stages) if len(c)]
        slope = {_key(c): jacobian([f], c).T for c in (*ends, *(a.z for a in self.given))}
        turned = []
        for atom in self.given:  # each node from its value down to its chart values
            weight = slope[_key(atom.z)][0] if atom.kind == "value" else 0
            if weight:
                at_node, turns = self._node(atom)
                for key, found in at_node.items():
                    slope[key] += weight * found
                turned += [(point, weight * part) for point, part in turns]
        turned += self._backwards(slope, set())
        at_points = [(a, slope[_key(a.z)]) for a in self.given if a.fields is not None]
        nothing = self.s.x[:0, :]
        base = [slope.get(_key(c), nothing) if len(c) else nothing
                for c in (self.s.x, self.s.u, self.s.stages)]  # fmt: skip
        if self.derived:
            base[1] = self._sum(base[1])
        return Adjoints(base[0], base[1], base[2], at_points, turned)

    def _node(self, value: Atom) -> tuple[dict[str, Any], list[tuple[Atom, Any]]]:
        """(gradient of one value by the key of each chart or base column, its turned parts)."""
        inside = self._above(value)
        reached = {_key(c): c for a in inside for c, _ in a.slopes}
        slope = {key: 0 * column for key, column in reached.items()}
        slope[_key(value.z)] = value.z.applyfunc(lambda _: self.s.h**0)
        turned = self._backwards(slope, {_key(a.z) for a in inside}, value)
        known = {_key(a.z) for a in inside if a.fields is None}
        found = {}
        for key, here in slope.items():
            if key in known or not any(here):
                continue
            chart = next((a for a in self.given if _key(a.z) == key and a.kind == "chart"), None)
            found[key] = here if chart is None else self._name_gradient("g", here, value, chart)
        return found, turned

    def _above(self, value: Atom) -> list[Atom]:
        """The points and velocities that a value is a function of, and itself."""
        wanted = {_key(value.z)}
        found: list[Atom] = []
        for atom in reversed(self.given):
            if _key(atom.z) in wanted and atom.kind != "chart" and atom.fields is None:
                found.insert(0, atom)
                wanted |= {_key(c) for c, _ in atom.slopes}
        return found

    def _backwards(
        self, slope: dict[str, Any], inside: set[str], node: Atom | None = None
    ) -> list[tuple[Atom, Any]]:
        """Pass slopes on from each atom to what it depends on; returns the turned parts.

        Of a node only the atoms inside; else all but the values, which are passed on already.
        """
        turned: list[tuple[Atom, Any]] = []
        for atom in reversed(self.given):
            here = slope.get(_key(atom.z))
            wanted = _key(atom.z) in inside if node is not None else atom.kind != "value"
            if here is None or not wanted or not any(here) or atom.fields is not None:
                continue
            if atom.kind == "chart" and not self._of_nodes(here):
                here = self._name_gradient("g", here)
            for column, matrix in atom.slopes:
                passed = matrix.T * here
                if atom.turn is not None:
                    if column == atom.base:
                        continue
                    passed = self._name_gradient("r", passed)
                    turned.insert(0, (atom, atom.turn.T * passed))
                slope[_key(column)] += passed
        return turned

    def total(self, column: Any, variable: Any) -> Any:
        """d(column)/d(variable) through all atoms; the variable is x, u or s."""
        result = self._partial(column, variable)
        for atom in self.given:
            if atom.kind == "chart" and len(variable):
                slope = dict((_key(c), m) for c, m in atom.slopes).get(_key(variable))
                if slope is not None:
                    result += self._partial(column, atom.z) * slope
        for atom in [*self.derived]:
            inner = jacobian(column, atom.z) if atom.kind == "sum" and len(variable) else ()
            if any(inner):
                key = (_key(atom.z), _key(variable))
                if key not in self._slopes:
                    self._slopes[key] = self._named(self.total(atom.value, variable), kind="sum")
                result += inner * self._slopes[key]
        return result

    def needed(self, *uses: Any) -> list[Atom]:
        """The atoms that the expressions use, with those these use, in order."""
        wanted = set().union(*(e.free_symbols for use in uses for e in use))
        found: list[Atom] = []
        for atom in reversed(self.atoms):
            if wanted & set(atom.z):
                found.insert(0, atom)
                wanted |= set().union(*(e.free_symbols for e in atom.value))
        return found

    def written_out(self, expression: Any) -> Any:
        """The expression (or matrix) with every atom replaced by its value."""
        for atom in reversed(self.atoms):
            expression = expression.xreplace(dict(zip(atom.z, atom.value, strict=True)))
        return expression

    def values(self, point: dict[Any, Any]) -> dict[Any, Any]:
        """The point (numbers of x, u, s, q) with the values of all atoms at it."""
        found = dict(point)
        for atom in self.atoms:
            found.update(zip(atom.z, [e.xreplace(found) for e in atom.value], strict=True))
        return found

    # -- inner ----------------------------------------------------------------------------------

    def _sum(self, value: Any) -> Any:
        """Letters for a sum over nodes: its derivatives are summed before they are used."""
        z = self.s.vector(f"f{len(self.derived)}", len(value))
        self.derived.append(Atom("sum", z, value))
        return z

    def _of_nodes(self, column: Any) -> bool:
        """Whether it is written with gradients that have names already."""
        letters = {*self.s.q, *(z for atom in self.derived for z in atom.z)}
        return bool(column.free_symbols <= letters)

    def _name_gradient(
        self, letter: str, value: Any, node: Atom | None = None, chart: Atom | None = None
    ) -> Any:
        """Letters for a gradient; with node and chart, it is the one of that node at that chart."""
        z = value
        if not all(e.is_Symbol for e in value):
            z = self.s.vector(f"{letter}{len(self.derived)}", len(value))
            self.derived.append(Atom("gradient", z, value))
        if node is not None and chart is not None:
            self._gradients[_key(z)] = (node, chart)
        return z

    def _partial(self, column: Any, variable: Any) -> Any:
        """∂(column)/∂(variable) with the chart values held, through points and gradients."""
        if not len(variable):
            return sympy.zeros(len(column), 0)
        result = jacobian(column, variable)
        for atom in self.atoms:
            if atom.kind in ("chart", "sum", "name") or atom.z == variable:
                continue
            inner = jacobian(column, atom.z)
            if any(inner):
                result += inner * self._slope(atom, variable)
        return result

    def _slope(self, atom: Atom, variable: Any) -> Any:
        key = (_key(atom.z), _key(variable))
        if key not in self._slopes:
            self._slopes[key] = self._find_slope(atom, variable)
        return self._slopes[key]

    def _find_slope(self, atom: Atom, variable: Any) -> Any:
        if atom.kind == "gradient":
            return self._second(atom, variable)
        result = sympy.zeros(len(atom.z), len(variable))
        for column, matrix in atom.slopes:
            if column == variable:
                result += matrix
                continue
            parent = next((a for a in self.given if a.z == column and a.kind != "chart"), None)
            if parent is not None:
                result += matrix * self._slope(parent, variable)
        return result

    def _second(self, gradient: Atom, variable: Any) -> Any:
        """Second derivatives, named; those of a node are symmetric."""
        mine = self._gradients.get(_key(gradient.z))
        if mine is None:
            return self._named(self._partial(gradient.value, variable))
        node, chart = mine
        for other in self.derived:
            theirs = self._gradients.get(_key(other.z))
            known = self._slopes.get((_key(other.z), _key(chart.z)))
            if known is not None and theirs and theirs[0] is node and theirs[1].z == variable:
                return known.T
        return self._named(self._partial(gradient.value, variable), chart.z == variable)

    def _named(self, matrix: Any, symmetric: bool = False, kind: Any = "name") -> Any:
        """The matrix with names for the entries that are neither numbers nor letters already."""
        constants = set(self.s.q)

        def named(value: Any) -> Any:
            if value.is_Symbol or not value.free_symbols - constants:
                return value
            z = self.s.vector(f"b{len(self.derived)}", 1)
            self.derived.append(Atom(kind, z, sympy.Matrix([value])))
            return z[0]

        result = matrix.copy()
        for i in range(matrix.rows):
            for j in range(matrix.cols):
                mirrored = symmetric and j < i
                result[i, j] = result[j, i] if mirrored else named(matrix[i, j])
        return result


def _key(column: Any) -> str:
    return str(column[0])
