"""A scene in numbers for a black box: compiled functions of arrays."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...equations import (
    SceneSymbols,
    closed_velocity,
    constraint,
    energy,
    energy_gradient,
    legendre_inverse,
    momentum,
    poisson_tensor,
    rates,
)
from ...errors import BadInput, unknown
from ...numbers import Arithmetic, Double, Graph, jacobian, numeric, sympy
from ...numbers.types import Expression, Function, Matrix, Number, Numbers, SymbolicMatrix, Vector
from ...scene import Scene


class ByName(SimpleNamespace):
    """Parameters as attributes, and by their names in brackets: p.k and p["k"].

    Raises `BadInput` for a name that is none of them.
    """

    def __getitem__(self, name: str) -> Any:
        if name in vars(self):
            return vars(self)[name]
        raise unknown("parameter", name, vars(self))


class SceneInNumbers:
    """The scene as the last argument of a black box: functions of arrays q (n,) and p (m,).

    In double precision q (n, k) and p (m, k) are k states at once, and results have one more
    dimension at the end.

    Attributes: parameters, by name (numbers, or arrays for lists); t, the time at the start of the
    step; n, m, the lengths of q and p; name, the scene's. If the scene depends on time, each
    function also takes it as a last argument (default: `t`). p is the momentum in the natural
    basis, velocities are natural ones; on a pair groupoid these are ∂L/∂v and v.
    """

    #: the time of the step that is made, as a function, until the time is asked for
    when: Callable[[], Number] | None = None

    def __init__(
        self, s: SceneSymbols, scene: Scene, numbers: Arithmetic, kind: type | None = None
    ) -> None:
        self._s, self._numbers, self._kind = s, numbers, kind
        self.name, self.n, self.m = scene.name, s.n, len(s.mu)
        with numbers.working():
            self._p = [numbers.number(v) for v in scene.parameter_values]
            self._near = np.array([numbers.number(v) for v in scene.v0], dtype=numbers.dtype)
        self._double = isinstance(numbers, Double)
        self.t: Number = 0.0 if self._double else numbers.public(np.array([numbers.number(0)]))[0]
        self._clocked = s.clocked

    @property
    def t(self) -> Number:
        """The time at the start of the step, computed when it is asked for."""
        if self.when is not None:
            self._t, self.when = self.when(), None
        return self._t

    @t.setter
    def t(self, time: Number) -> None:
        self._t, self.when = time, None

    @cached_property
    def parameters(self) -> ByName:
        """The scene's parameters by name."""
        values = iter(self._numbers.public(np.array(self._p, dtype=self._numbers.dtype)).tolist())
        parameters = ByName()
        for name, letters in vars(self._s.parameters).items():
            if not hasattr(letters, "shape"):
                setattr(parameters, name, next(values))
                continue
            rows, columns = letters.shape
            entries = [next(values) for _ in range(rows * columns)]
            array = np.array(entries, dtype=float if self._double else object)
            setattr(parameters, name, array if columns == 1 else array.reshape(rows, columns))
        return parameters

    def f(self, q: Vector, p: Vector, t: Number | None = None) -> tuple[Vector, Vector]:
        """Return the vector field (q̇, ṗ), arrays (n,) and (m,)."""
        field = self._value("f", q, p, t)
        return field[: self.n], field[self.n :]

    def H(self, q: Vector, p: Vector, t: Number | None = None) -> Number:
        """Return the energy H(q, p), a number."""
        return self._value("H", q, p, t)

    def gradient(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        """Return ∂H/∂q at (q, p), (n,), without the scene's force (see `force`)."""
        return self._value("gradient", q, p, t)

    def velocity(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        """Return ∂H/∂p at (q, p), (m,): the natural velocity."""
        return self._value("velocity", q, p, t)

    def force(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        """Return the force beside the Hamiltonian, (m,); zeros if the scene has none."""
        return self._value("force", q, p, t)

    def tensor(self, q: Vector, p: Vector) -> Matrix:
        """Return the Poisson tensor B at (q, p), (n+m, n+m): f = B dH + force."""
        return self._value("tensor", q, p)

    def momentum(self, q: Vector, v: Vector, t: Number | None = None) -> Vector:
        """Return the momentum ∂L/∂v of a velocity v, (m,)."""
        return self._value("momentum", q, v, t)

    def constraint(self, q: Vector) -> Vector:
        """Return φ(q) of the scene's holonomic constraints, (k,)."""
        return self._value("constraint", q)

    def constraint_jacobian(self, q: Vector) -> Matrix:
        """Return φ′(q) of the scene's holonomic constraints, (k, n)."""
        return self._value("constraint_jacobian", q)

    def velocities(self, x: Matrix, mu: Matrix) -> Matrix:
        """Return ξ(x, μ) of rows, (r, m), for the user: any time stands behind x."""
        numbers = self._numbers
        with numbers.working():
            return numbers.public(self._solved(numbers.own(x), numbers.own(mu)))

    def _value(
        self, what: str, q: Vector, second: Vector | None = None, t: Number | None = None
    ) -> Any:
        """Return a quantity of `QUANTITIES` at (q, second), in the box's kind of number."""
        if several(q, second):
            return self._at_once(what, q, second, t)
        function = _function(self._s, what, self._numbers)
        solved = _is_solved_for(self._s, what)
        if not solved and self._plain(q, q if second is None else second):
            rest = () if second is None else (second.tolist(),)
            return self._given(function(self._base(q, t), *rest, self._p))
        with self._numbers.working():
            arguments = [self._base(q, t), *([] if second is None else [self._list(second)])]
            if solved:
                rows = (np.array([part], dtype=self._numbers.dtype) for part in arguments)
                arguments.insert(1, list(self._solved(*rows)[0]))
            return self._given(function(*arguments, self._p))

    def _at_once(self, what: str, q: Vector, second: Vector | None, t: Number | None) -> Vector:
        """Return the quantity for k states at once, along its last dimension."""
        count = np.shape(q if second is None else second)[-1]
        arguments = [list(np.asarray(e, dtype=float)) for e in (q, second) if e is not None]
        if self._clocked:
            time = np.asarray(self.t if t is None else t, dtype=float)
            arguments[0].append(np.broadcast_to(time, (count,)))
        if _is_solved_for(self._s, what):
            rows = (np.array(part).T.reshape(count, -1) for part in arguments)
            arguments.insert(1, list(self._solved(*rows).T))
        function = _function(self._s, what, self._numbers, True)
        values = np.asarray(function(*arguments, self._p))
        shape = (*values.shape[: RANKS.get(what, 1)], count)
        return self._given(np.broadcast_to(values.T, shape[::-1]).T)

    def _solved(self, x: Matrix, mu: Matrix) -> Matrix:
        """Return ξ(x, μ) of rows of this arithmetic's numbers."""
        inverse: Function = legendre_inverse(self._s, self._numbers)
        near = np.broadcast_to(self._near, (len(mu), len(self._near)))
        return inverse(x, mu, self._p, near)

    def _plain(self, q: Vector, p: Vector) -> bool:
        return self._double and type(q) is type(p) is np.ndarray and q.dtype == p.dtype == float

    def _base(self, q: Vector, t: Number | None) -> list[Number]:
        """Return q in this arithmetic, followed by the time if the scene depends on it."""
        x = self._list(q)
        if not self._clocked:
            return x
        return [*x, *self._list([self.t if t is None else t])]

    def _list(self, values: Numbers) -> list[Number]:
        if self._double:
            return np.asarray(values, dtype=float).tolist()
        return [self._numbers.number(e) for e in np.ravel(values)]

    def _given(self, result: Any) -> Any:
        """Return a result in the box's kind of number."""
        if self._kind is not None:
            return np.asarray(result, dtype=self._kind)[()]
        if self._double:
            return result
        shown = self._numbers.public(np.asarray(result, dtype=object))
        return shown if shown.shape else shown[()]


def several(q: Vector, p: Vector | None = None) -> bool:
    """Return True if these are many states at once, each a column."""
    return getattr(q, "ndim", 1) == 2 or getattr(p, "ndim", 1) == 2


def _field(s: SceneSymbols) -> list[Expression]:
    rate = list(rates(s))
    return rate[: s.n] + rate[len(s.x) :]  # without the rate of the time


def _tensor(s: SceneSymbols) -> SymbolicMatrix:
    """Return the Poisson tensor of (x, μ): that of the groupoid, or Dirac's."""
    whole = poisson_tensor(s, s.x, s.mu)
    if s.clocked:  # without the time
        whole.row_del(s.n)
        whole.col_del(s.n)
    return whole


#: quantities by name: those of (x, ξ, μ), and others of (x, μ), (x, ξ) or x
OF_VELOCITY: dict[str, Callable[[SceneSymbols], Any]] = {
    "f": _field,
    "H": energy,
    "gradient": lambda s: list(energy_gradient(s)[0])[: s.n],
    "velocity": lambda s: list(s.u),
    "force": lambda s: list(s.force) if s.forced else [sympy.Integer(0)] * len(s.mu),
}
QUANTITIES: dict[str, Callable[[SceneSymbols], Any]] = {
    **OF_VELOCITY,
    "tensor": _tensor,
    "momentum": lambda s: list(momentum(s)),
    "constraint": lambda s: list(constraint(s, s.x)),
    "constraint_jacobian": lambda s: jacobian(constraint(s, s.x), s.position),
}
#: dimensions of a quantity that is no vector
RANKS = {"H": 0, "tensor": 2, "constraint_jacobian": 2}


@lru_cache(maxsize=512)
def _is_solved_for(s: SceneSymbols, what: str) -> bool:
    """Return True if a quantity contains ξ, and ξ(x, μ) has no closed form."""
    if what not in OF_VELOCITY or closed_velocity(s) is not None:
        return False
    value = QUANTITIES[what](s)
    letters = (sympy.Tuple(*value) if isinstance(value, list) else value).free_symbols
    return not letters.isdisjoint(s.u)


@lru_cache(maxsize=512)
def _function(s: SceneSymbols, what: str, numbers: Arithmetic, columns: bool = False) -> Function:
    """Return a quantity as a function of the letters that it asks for, and of the parameters."""
    letters, graph = {"x": s.x}, Graph()
    if what in OF_VELOCITY and (closed := closed_velocity(s)) is not None:
        graph.define(s.u, [graph.hold(e) for e in graph.column(closed)])
    elif _is_solved_for(s, what) or what == "momentum":
        letters["u"] = s.u
    if what in OF_VELOCITY or what == "tensor":
        letters["mu"] = s.mu
    letters["p"] = s.parameter_list
    return numeric(letters, [QUANTITIES[what](s)], numbers, columns, graph)


# A scene whose Hamiltonian is a function of numbers, in the form that a black box gets.


class NumericScene(SceneInNumbers):
    """`SceneInNumbers` for the user's own functions H(q, p) and gradient(q, p)."""

    _double = True

    def __init__(
        self, s: SceneSymbols, scene: Scene, numbers: Arithmetic, kind: type | None = None
    ) -> None:
        self._s, self._numbers, self._kind = s, numbers, kind
        self.name, self.n, self.m = scene.name, s.n, len(s.mu)
        self._scene, self._clocked, self.t = scene, False, 0.0
        with numbers.working():
            self._p = [numbers.number(v) for v in scene.parameter_values]
        self._canonical = scene.groupoid.canonical

    def _slopes(self, q: Vector, p: Vector) -> tuple[Vector, Vector]:
        if several(q, p):  # the user's functions are of one state
            both = [
                self._slopes(*one) for one in zip(np.transpose(q), np.transpose(p), strict=True)
            ]
            return np.array([e[0] for e in both]).T, np.array([e[1] for e in both]).T
        slopes = _inside(self._scene.gradient, q, p)
        if slopes is None:
            return np.full(self.n, np.nan), np.full(self.m, np.nan)
        return np.asarray(slopes[0], float).reshape(self.n), np.asarray(slopes[1], float).reshape(
            self.m
        )

    def f(self, q: Vector, p: Vector, t: Number | None = None) -> tuple[Vector, Vector]:
        of_q, of_p = self._slopes(q, p)
        if self._canonical:
            return self._given(of_p), self._given(-of_q)
        rates = np.einsum("ij...,j...->i...", self.tensor(q, p), np.concatenate([of_q, of_p]))
        return self._given(rates[: self.n]), self._given(rates[self.n :])

    def H(self, q: Vector, p: Vector, t: Number | None = None) -> Number:
        if several(q, p):
            each = zip(np.transpose(q), np.transpose(p), strict=True)
            return np.array([self.H(*one) for one in each])
        value = _inside(self._scene.numeric_hamiltonian, q, p)
        value = np.nan if value is None else value
        return self._given(np.float64(np.asarray(value, float).reshape(())))

    def gradient(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        return self._given(self._slopes(q, p)[0])

    def velocity(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        return self._given(self._slopes(q, p)[1])

    def force(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        return self._given(np.zeros(np.shape(p)))

    def velocities(self, x: Matrix, mu: Matrix) -> Matrix:
        return np.array([self.velocity(*row) for row in zip(x, mu, strict=True)])

    def momentum(self, q: Vector, v: Vector, t: Number | None = None) -> Vector:
        raise BadInput(
            f"{self.name} is a Hamiltonian in numbers, so the momentum of a velocity is not known: "
            'take state="qp".'
        )


def _inside(function: Any, q: Vector, p: Vector) -> Any:
    """Return a user's function at a state; None outside its domain, such as a table's."""
    try:
        return function(np.array(q, float), np.array(p, float))
    except (ArithmeticError, LookupError, ValueError):
        return None


def scene_in_numbers(
    s: SceneSymbols, scene: Scene, numbers: Arithmetic, kind: type | None = None
) -> SceneInNumbers:
    """Return a scene in an arithmetic; one whose Hamiltonian is in numbers has doubles alone."""
    return (NumericScene if scene.in_numbers else SceneInNumbers)(s, scene, numbers, kind)
