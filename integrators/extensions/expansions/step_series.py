"""One step of a scheme on power series: in the step itself, or in what start and parameters have.

The rows of a step are those that its kernels solve. Their solution at the constant terms comes from
Newton's method; each further power of the small quantity from one more correction with the
derivative that the rows have there.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NoReturn, TypeAlias

import numpy as np

from ...equations import SceneSymbols, StepEquations, closed_velocity, legendre_inverse, rates
from ...errors import CannotMeasure
from ...geometry import StepContext, map_text
from ...numbers import (
    Arithmetic,
    Double,
    PrimeField,
    numeric_text,
    over,
    run_text,
)
from ...numbers.types import Function, Scalar, Scalars
from .laurent import Atoms
from .series import Series, series_namespace

#: the kinds of coefficients
Kind: TypeAlias = Arithmetic | Atoms | PrimeField
MOST = 60  # corrections of Newton's method, as of `numbers.newton`
#: terms of the series with which constant terms are found: a row may be divided by h² at the most
FEW = 4


class NotExpanded(CannotMeasure):
    """A step has no series: Newton found no step of length 0, or its rows are singular there."""


class NoStep(NotExpanded):
    """The rows of a step of length 0 are singular."""


class NotConsistent(NotExpanded):
    """A step of length 0 is not the identity: the rows of a step have a pole at h = 0."""


class StepSeries:
    """The step of a context's equations on series of one kind of coefficient.

    numbers: an arithmetic, whose coefficients are columns (r,), `Atoms` for formulas, or a
    `PrimeField`.
    Raises `CannotMeasure` for a discrete Lagrangian that is given on the group itself.
    """

    def __init__(self, context: StepContext, numbers: Kind) -> None:
        self.equations: Any = context.equations
        self.numbers, self.context = numbers, context
        if self.equations.element is not None:
            raise CannotMeasure(
                f"{context.scene.name} gives its discrete Lagrangian on the group itself, so its "
                "steps are no series."
            )
        self.rows = _function(self.equations, "step", numbers)
        self.slope = _function(self.equations, "rows", numbers)
        self.n = len(self.equations.x)

    def __call__(
        self, x: Scalars, mu: Scalars, q: Scalars, start: Scalars, power: int, lost: int = 0
    ) -> tuple[list[Scalar], list[Scalar], list[Scalar]]:
        """Return (x′, μ′, w) of a step from (x, μ) up to a power; start: near w's constant terms.

        q: h, the parameters and the rule's constants. Some of these, or of x and μ, are `Series`,
        known up to `lost` powers more, which quotients take away that are 0/0 at h = 0; so are the
        results, which are taken for polynomials. Raises `NotKnown` where more are taken away.
        """
        at, momentum = ([_constant(e) for e in part] for part in (x, mu))
        few = [_cut(e, FEW) for e in q]
        w = self._newton(at, momentum, few, list(start))
        self.inverse = inverse = self._inverse(at, momentum, w, few)
        end = power + 1 + lost
        for k in range(1, power + 1):
            part = [[_until(e, k + 1 + lost) for e in entries] for entries in (x, mu, w)]
            rows, _ = self.rows(*part, [_until(e, k + 2 + lost) for e in q])
            change = _times(inverse, rows)
            w = [_polynomial(e - step, k, end) for e, step in zip(w, change, strict=True)]
        rows, grown = self.rows(x, mu, w, q)
        if isinstance(self.numbers, PrimeField) and any(
            e.coefficient(k) != 0 for e in rows if isinstance(e, Series) for k in range(power + 1)
        ):
            raise CannotMeasure(
                f"{self.context.scheme.rule.name}: its rows have no derivative at h = 0 that "
                "leads to their solution."
            )
        after = [_polynomial(a + b, power, end) for a, b in zip((*x, *mu), grown, strict=True)]
        return after[: self.n], after[self.n :], w

    def derivative(self, x: Scalars, mu: Scalars, w: Scalars, q: Scalars, power: int) -> np.ndarray:
        """Return ∂(x′, μ′)/∂(x, μ) up to a power, (n+m)×(n+m), of the step with the unknowns w.

        Raises `NotKnown` where quotients 0/0 take powers away (`__call__`: lost), and `NotExpanded`
        where it has a pole at h = 0.
        """
        text = _function(self.equations, "one_step", self.numbers)
        _, slope, by_start, _, by_w, by_z = text(x, mu, w, q)
        matrices = [slope, by_start, by_w, by_z]
        if any(_has_pole(e) for matrix in matrices for row in matrix for e in row):
            raise self._refused("the derivative of a step has a pole at h = 0.")
        slope, by_start, by_w, by_z = (
            np.array([[_regular(e, power) for e in row] for row in matrix], dtype=object)
            for matrix in matrices
        )
        inverse = _inverted([[_constant(e) for e in row] for row in slope], self.numbers)
        moved = 0 * by_start  # −∂w/∂z; each correction is right to one power more
        for _ in range(power + 1):
            moved = moved + inverse @ (by_start - slope @ moved)
        return np.eye(len(by_z), dtype=int).astype(object) + by_z - by_w @ moved

    def _newton(self, x: Scalars, mu: Scalars, q: Scalars, w: list[Scalar]) -> list[Scalar]:
        before = np.inf
        for _ in range(MOST):
            residual = self.rows(x, mu, w, q)[0]
            if isinstance(self.numbers, PrimeField) and any(map(_has_pole, residual)):
                self._refuse_pole(x, mu, q, w)
            rows = [_constant(e) for e in residual]
            inverse = self._inverse(x, mu, w, q)
            change = _times(inverse, rows)
            w = [e - step for e, step in zip(w, change, strict=True)]
            if isinstance(self.numbers, Atoms | PrimeField):
                # what is linear in the unknowns is solved at once
                left = [_constant(e) for e in self.rows(x, mu, w, q)[0]]
                if all(_is_zero(e, self.numbers) for e in left):
                    return w
                raise self._refused("a step of length 0 has no closed form.")
            size, scale = map(_largest, (change, w))
            unit = float(self.numbers.eps) * scale
            if over(size, before, 4 * unit, size, size <= 2**12 * unit):
                return w
            if not size < np.inf:
                break
            before = size
        raise self._refused("Newton found no step from there.")

    def _refuse_pole(self, x: Scalars, mu: Scalars, q: Scalars, w: list[Scalar]) -> NoReturn:
        """Raise `NotConsistent` for a pole at all values of stages, else `NotExpanded`.

        Of a consistent step the other unknowns are those of the motion at h = 0, but stages may be
        anything.
        """
        moved = w
        if self.equations.rule.stages:
            free = [kind != "velocity" for kind, e in self.equations.unknowns for _ in e]
            moved = [e * e + 7 * k + 1 if f else e
                     for k, (e, f) in enumerate(zip(w, free, strict=True))]  # fmt: skip
        one, other = (self.rows(x, mu, e, q)[0] for e in (w, moved))
        if all(map(_same_pole, one, other)):
            raise NotConsistent("a step of length 0 is not the identity.")
        raise self._refused("a step of length 0 has a pole where its stages are looked for.")

    def _refused(self, why: str, kind: type[NotExpanded] = NotExpanded) -> NotExpanded:
        return kind(f"{self.context.scene.name} with {self.context.scheme.rule.name}: {why}")

    def _inverse(self, x: Scalars, mu: Scalars, w: Scalars, q: Scalars) -> np.ndarray:
        """Return (∂rows/∂w)⁻¹ of the constant terms, an m×m array of coefficients."""
        slope = self.slope(x, mu, w, q)[1]
        entries = [[_constant(e) for e in row] for row in slope]
        try:
            return _inverted(entries, self.numbers)
        except (ZeroDivisionError, np.linalg.LinAlgError):
            raise self._refused("the equations of a step are singular there.", NoStep) from None

    def start(self, x: Scalars, mu: Scalars, parameters: Scalars, near: Scalars) -> list[Scalar]:
        """Return where Newton starts from constants (x, μ): at ξ(x, μ), f(x, μ), or 0."""
        equations, s = self.equations, self.equations.s
        if isinstance(self.numbers, Atoms):
            closed = closed_velocity(s)
            if closed is None:
                raise NotExpanded(f"{s.name}: there is no short closed form of ξ(x, μ).")
            text = numeric_text({"x": s.x, "mu": s.mu, "p": s.parameter_list}, [list(closed)])
            xi = list(series_function(text, self.numbers)(x, mu, parameters))
        else:
            xi = self.velocity(x, mu, parameters, near)
        if equations.free is not None:
            raise NotExpanded(f"{s.name} has constraints, so a step of length 0 is singular.")
        f: list[Scalar] = []
        if equations.arrows is None:
            f = list(_rates(s, self.numbers)(x, xi, mu, parameters))
        return self._at(
            {"velocity": xi, "slope": f, "stage": [0 * mu[0]] * len(equations.s.stages)}
        )

    def _at(self, starts: dict[str, list[Scalar]]) -> list[Scalar]:
        """Return where Newton starts: the values for the unknowns of each kind, block by block."""
        return [e for kind, _ in self.equations.unknowns for e in starts.get(kind, [])]

    def velocity(self, x: Scalars, mu: Scalars, parameters: Scalars, near: Scalars) -> list[Scalar]:
        """Return ξ(x, μ) at columns of numbers, from velocities nearby."""
        momenta = np.stack(np.broadcast_arrays(*mu), axis=-1)
        at = np.stack(np.broadcast_arrays(*x), axis=-1) if len(x) else momenta[:, :0]
        numbers: Any = self.numbers
        first = np.broadcast_to(np.array(near, dtype=numbers.dtype), momenta.shape)
        inverse = legendre_inverse(self.equations.s, numbers)
        return list(inverse(at, momenta, list(parameters), first).T)

    def near(self, u: Scalars, rates: Scalars) -> list[Scalar]:
        """Return where Newton starts near a step of a run: at its u, and at the rates of z."""
        none = [0 * u[0]] * len(self.equations.s.stages)
        return self._at({"velocity": list(u), "slope": list(rates), "stage": none})


def _is_zero(e: Scalar, numbers: Atoms | PrimeField) -> bool:
    return numbers.is_zero(e) if isinstance(numbers, Atoms) else bool(e == 0)


def _has_pole(e: Scalar) -> bool:
    return isinstance(e, Series) and any(e.coefficient(k) != 0 for k in range(e.start, 0))


def _same_pole(a: Scalar, b: Scalar) -> bool:
    start = min((e.start for e in (a, b) if isinstance(e, Series)), default=0)
    return all(_at(a, k) == _at(b, k) for k in range(start, 0))


def _at(e: Scalar, k: int) -> Scalar:
    return e.coefficient(k) if isinstance(e, Series) else 0


def _constant(e: Scalar) -> Scalar:
    return e.coefficient(0) if isinstance(e, Series) else e


def _polynomial(e: Scalar, power: int, end: int) -> Scalar:
    """Return a series up to a power, taken for exact: later powers are still looked for."""
    if not isinstance(e, Series):
        return e
    return Series([e.coefficient(j) for j in range(power + 1)], 0, end)


def _regular(e: Scalar, power: int) -> Scalar:
    """Return a series without a pole up to a power; raises `NotKnown` if it is known to less."""
    if not isinstance(e, Series):
        return e
    return Series([e.coefficient(k) for k in range(power + 1)], 0, power + 1)


def _until(e: Scalar, end: int) -> Scalar:
    """Return a series without its powers from `end` on."""
    return Series(e.c, e.start, min(e.end, end)) if isinstance(e, Series) else e


def _largest(values: Scalars) -> float:
    return float(max((np.max(np.abs(e), initial=0.0) for e in values), default=0.0))


def _cut(e: Scalar, terms: int) -> Scalar:
    return Series(e.c[:terms], e.start, min(e.end, e.start + terms)) if isinstance(e, Series) else e


def _times(matrix: np.ndarray, vector: Scalars) -> list[Scalar]:
    return [sum((a * e for a, e in zip(row, vector, strict=True)), start=0) for row in matrix]


def _inverted(entries: list[list[Scalar]], numbers: Kind) -> np.ndarray:
    size = len(entries)
    matrix = np.empty((size, size), dtype=object)
    if isinstance(numbers, Atoms | PrimeField):
        matrix[:] = _eliminated(entries, numbers)
        return matrix
    flat = np.broadcast_arrays(
        *[np.asarray(e, dtype=numbers.dtype) for row in entries for e in row]
    )
    shape = flat[0].shape
    stack = np.moveaxis(np.stack(flat).reshape(size, size, -1), -1, 0)
    if isinstance(numbers, Double):
        inverse = np.linalg.inv(stack)
    else:
        inverse = np.stack([numbers.solve(e, numbers.identity(size)) for e in stack])
    for i in range(size):
        for j in range(size):
            matrix[i, j] = inverse[:, i, j].reshape(shape)
    return matrix


def _eliminated(entries: list[list[Scalar]], numbers: Atoms | PrimeField) -> list[list[Scalar]]:
    """Return the inverse of a matrix of formulas or residues; pivots are the shortest entries."""
    size = len(entries)
    rows = [[*row, *(int(i == j) for j in range(size))] for i, row in enumerate(entries)]
    for p in range(size):
        left = [i for i in range(p, size) if hasattr(rows[i][p], "terms") or rows[i][p] != 0]
        if not left:
            raise ZeroDivisionError("singular matrix")
        best = min(left, key=lambda i: len(getattr(rows[i][p], "terms", ())))
        rows[p], rows[best] = rows[best], rows[p]
        inverse = numbers.number(1) / rows[p][p]
        rows[p] = [inverse * e for e in rows[p]]
        rows = [
            row if i == p else [e - row[p] * lead for e, lead in zip(row, rows[p], strict=True)]
            for i, row in enumerate(rows)
        ]
    return [row[size:] for row in rows]


@lru_cache(maxsize=256)
def _rates(s: SceneSymbols, numbers: Kind) -> Function:
    """Return f(x, ξ, μ, p) of coefficients."""
    letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
    return series_function(numeric_text(letters, [list(rates(s))]), numbers)


@lru_cache(maxsize=256)
def _function(equations: StepEquations, what: str, numbers: Kind) -> Function:
    return series_function(map_text(equations, what), numbers)


def series_function(text: str, numbers: Kind) -> Function:
    """Return the function of a text that `numeric_text` wrote, on series."""
    space = series_namespace(numbers)
    names = run_text(text, space)
    # the text's own function of a matrix asks for a norm, which a field has not
    names |= {name: space[name] for name in {"matrix_function"} & space.keys()}
    return names["function"]
