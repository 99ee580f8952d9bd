"""A scene in numbers for a black box: compiled functions of arrays."""

from __future__ import annotations

from functools import cached_property, lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..equations import (
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
from ..numbers import Arithmetic, Double, jacobian, numeric, sympy
from ..numbers.types import Assignment, Expression, Function, Matrix, Number, Numbers, Vector
from ..scene import Scene


class SceneInNumbers:
    """The scene as the last argument of a black box: functions of arrays q (n,) and p (m,).

    In double precision q (n, k) and p (m, k) are k states at once, and results have one more
    dimension at the end.

    Attributes: parameters, by name (numbers, or arrays for lists); t, the time at the start of the
    step; n, m, the lengths of q and p; name, the scene's. If the scene depends on time, each
    function also takes it as a last argument (default: `t`). p is the momentum in the natural
    basis, velocities are natural ones; on a pair groupoid these are ∂L/∂v and v.
    """

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
        self._closed = closed_velocity(s) is not None

    @cached_property
    def parameters(self) -> SimpleNamespace:
        """The scene's parameters by name."""
        values = iter(self._numbers.public(np.array(self._p, dtype=self._numbers.dtype)).tolist())
        found = SimpleNamespace()
        for name, letters in vars(self._s.parameters).items():
            if not hasattr(letters, "shape"):
                setattr(found, name, next(values))
                continue
            rows, columns = letters.shape
            held = [next(values) for _ in range(rows * columns)]
            array = np.array(held, dtype=float if self._double else object)
            setattr(found, name, array if columns == 1 else array.reshape(rows, columns))
        return found

    # -- public functions ------------------------------------------------------------------------

    def f(self, q: Vector, p: Vector, t: Number | None = None) -> tuple[Vector, Vector]:
        """Return the vector field (q̇, ṗ), arrays (n,) and (m,)."""
        found = self._of_states("f", q, p, t)
        return found[: self.n], found[self.n :]

    def H(self, q: Vector, p: Vector, t: Number | None = None) -> Number:
        """Return the energy H(q, p), a number."""
        return self._of_states("H", q, p, t)

    def gradient(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        """Return ∂H/∂q at (q, p), (n,), without the scene's force (see `force`)."""
        return self._of_states("gradient", q, p, t)

    def velocity(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        """Return ∂H/∂p at (q, p), (m,): the natural velocity."""
        return self._of_states("velocity", q, p, t)

    def force(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        """Return the force beside the Hamiltonian, (m,); zeros if the scene has none."""
        return self._of_states("force", q, p, t)

    def tensor(self, q: Vector, p: Vector) -> Matrix:
        """Return the Poisson tensor B at (q, p), (n+m, n+m): f = B dH + force."""
        if several(q, p):
            base, rest = self._columns(q, p, None)
            found = _tensor(self._s, self._numbers, True)(base, rest, self._p)
            return np.broadcast_to(found.T, (np.shape(p)[1], *found.shape[1::-1])).T
        with self._numbers.working():
            x, mu = self._base(q, None), self._list(p)
            return self._given(_tensor(self._s, self._numbers)(x, mu, self._p))

    def momentum(self, q: Vector, v: Vector, t: Number | None = None) -> Vector:
        """Return the momentum ∂L/∂v of a velocity v, (m,)."""
        if several(q, v):
            base, rest = self._columns(q, v, t)
            return self._given(_momentum(self._s, self._numbers, True)(base, rest, self._p))
        function = _momentum(self._s, self._numbers)
        if self._plain(q, v):
            return self._given(function(self._base(q, t), v.tolist(), self._p))
        with self._numbers.working():
            return self._given(function(self._base(q, t), self._list(v), self._p))

    def constraint(self, q: Vector) -> Vector:
        """Return φ(q) of the scene's holonomic constraints, (k,)."""
        return self._of_base("constraint", q)

    def constraint_jacobian(self, q: Vector) -> Matrix:
        """Return φ′(q) of the scene's holonomic constraints, (k, n)."""
        return self._of_base("constraint_jacobian", q)

    # -- their computation -----------------------------------------------------------------------

    def _of_states(self, what: str, q: Vector, p: Vector, t: Number | None) -> Any:
        numbers = self._numbers
        if several(q, p):
            return self._at_once(what, q, p, t)
        function = _of_states(self._s, what, numbers)
        if self._closed and self._plain(q, p):
            return self._given(function(self._base(q, t), p.tolist(), self._p))
        with numbers.working():
            x, mu = self._base(q, t), self._list(p)
            if self._closed:
                return self._given(function(x, mu, self._p))
            inverse: Function = legendre_inverse(self._s, numbers)
            rows = (np.array([part], dtype=numbers.dtype) for part in (x, mu))
            xi = inverse(*rows, self._p, self._near[None])[0]
            return self._given(function(x, list(xi), mu, self._p))

    def _at_once(self, what: str, q: Vector, p: Vector, t: Number | None) -> Vector:
        """Return the quantity for k states at once, along its last dimension."""
        function = _of_states(self._s, what, self._numbers, True)
        base, rest = self._columns(q, p, t)
        count = rest[0].size
        if self._closed:
            found = function(base, rest, self._p)
        else:
            inverse = legendre_inverse(self._s, self._numbers)
            near = np.broadcast_to(self._near, (count, len(self._near)))
            xi = inverse(np.array(base).T.reshape(count, -1), np.array(rest).T, self._p, near)
            found = function(base, list(xi.T), rest, self._p)
        shape = (count,) if what == "H" else (len(found), count)
        return self._given(np.broadcast_to(np.asarray(found).T, shape[::-1]).T)

    def _columns(self, q: Vector, p: Vector, t: Number | None) -> tuple[list[Vector], list[Vector]]:
        """Return the entries of k states, (k,) each: q, followed by the time, and p."""
        rest = list(np.asarray(p, dtype=float))
        base = list(np.asarray(q, dtype=float))
        if self._clocked:
            time = np.asarray(self.t if t is None else t, dtype=float)
            base.append(np.broadcast_to(time, rest[0].shape))
        return base, rest

    def _of_base(self, what: str, q: Vector) -> np.ndarray:
        if self._double and np.ndim(q) == 2:
            rows = [self._of_base(what, one) for one in np.asarray(q, dtype=float).T]
            return np.moveaxis(np.array(rows), 0, -1)
        with self._numbers.working():
            return self._given(_of_base(self._s, what, self._numbers)(self._base(q, None), self._p))

    def _plain(self, q: Vector, p: Vector) -> bool:
        return self._double and type(q) is type(p) is np.ndarray and q.dtype == p.dtype == float

    def _base(self, q: Vector, t: Number | None) -> list[Number]:
        """Return q in this arithmetic, followed by the time if the scene depends on it."""
        x = self._list(q)
        if not self._clocked:
            return x
        return [*x, *self._list([self.t if t is None else t])]

    def _list(self, given: Numbers) -> list[Number]:
        if self._double:
            return np.asarray(given, dtype=float).tolist()
        return [self._numbers.number(e) for e in np.ravel(given)]

    def _given(self, found: Any) -> Any:
        """Return a result in the box's kind of number."""
        if self._kind is not None:
            return np.asarray(found, dtype=self._kind)[()]
        if self._double:
            return found
        shown = self._numbers.public(np.asarray(found, dtype=object))
        return shown if shown.shape else shown[()]


def several(q: Vector, p: Vector) -> bool:
    """Return True if these are many states at once, each a column."""
    return getattr(q, "ndim", 1) == 2 or getattr(p, "ndim", 1) == 2


@lru_cache(maxsize=512)
def _of_states(s: SceneSymbols, what: str, numbers: Arithmetic, columns: bool = False) -> Function:
    """Return a quantity as a function of (x, μ, parameters), or of (x, ξ, μ, parameters)."""
    closed = closed_velocity(s)
    letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
    known: list[Assignment] = []
    if closed is not None:
        del letters["u"]
        known = [(list(s.u), list(closed))]
    return numeric(letters, [_formula(s, what)], numbers, known, columns)


def _formula(s: SceneSymbols, what: str) -> Expression:
    if what == "f":
        field = list(rates(s))
        return field[: s.n] + field[len(s.x) :]  # without the rate of the time
    if what == "H":
        return energy(s)
    if what == "gradient":
        return list(energy_gradient(s)[0])[: s.n]
    if what == "velocity":
        return list(s.u)
    assert what == "force"
    return list(s.force) if s.forced else [sympy.Integer(0)] * len(s.mu)


@lru_cache(maxsize=128)
def _tensor(s: SceneSymbols, numbers: Arithmetic, columns: bool = False) -> Function:
    """Return the Poisson tensor of (x, μ): that of the groupoid, or Dirac's."""
    whole = poisson_tensor(s, s.x, s.mu)
    if s.clocked:  # without the time
        whole.row_del(s.n)
        whole.col_del(s.n)
    letters = {"x": s.x, "mu": s.mu, "p": s.parameter_list}
    return numeric(letters, [whole], numbers, columns=columns)


@lru_cache(maxsize=128)
def _momentum(s: SceneSymbols, numbers: Arithmetic, columns: bool = False) -> Function:
    letters = {"x": s.x, "u": s.u, "p": s.parameter_list}
    return numeric(letters, [list(momentum(s))], numbers, columns=columns)


@lru_cache(maxsize=128)
def _of_base(s: SceneSymbols, what: str, numbers: Arithmetic) -> Function:
    phi = constraint(s, s.x)
    result: Expression = list(phi) if what == "constraint" else jacobian(phi, s.position)
    return numeric({"x": s.x, "p": s.parameter_list}, [result], numbers)
