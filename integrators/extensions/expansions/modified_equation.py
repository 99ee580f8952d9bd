"""The modified equation of a scheme: the field whose flow its steps follow, by powers of the step.

Φ_h is, but for terms smaller than every power of h, the flow for the time h of

    f̃ = f₁ + h f₂ + h² f₃ + …,    h f̃ = log Φ_h = Σ_k (−1)^(k+1)/k Δ^k,
    Δ^k = Σ_j (−1)^(k−j) C(k, j) Φ_h^j

(Hairer, Lubich, Wanner, Geometric Numerical Integration, IX.1). Δ^k is O(h^k), so K iterates of the
step, expanded in h, give f₁, …, f_K; f₁ is the scene's own field.

Of a rule with a discrete Lagrangian f̃ = B dH̃, B the Poisson tensor (IX.3). H̃ needs no integral:
the action Σ L_d of successive steps and their arrow g = g₁ g₂ ⋯ are carried along, and their
derivatives by the time at 0, by the same series, are the modified Lagrangian L̃ and velocity ξ̃:

    L_d = ∫ (⟨μ, ξ̃⟩ − H̃) dt along the flow of f̃,    so   H̃ = ⟨μ, ξ̃⟩ − L̃

which is the way of Engle, Skeel, Drees (J. Comput. Phys. 206 (2005), 432) on any groupoid. Of a
one-step map on T*Q, which has no L_d, H̃ is the integral of its slope along ways between states.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import comb
from typing import Any

import numpy as np

from ...errors import BadInput, CannotMeasure, shown
from ...geometry import StepContext, composed_arrows, map_text
from ...numbers import Arithmetic, arithmetic, run_text
from ...numbers.types import Given, Numbers, Rows, Scalar, Scalars
from .laurent import Atoms
from .series import NotKnown, Series, series_namespace
from .step_series import StepSeries

MOST = 12  # the highest power of the step: the sums of differences lose a digit with each
MOST_LOST = 4  # powers that quotients take from series, at the most
WAY, FEWER = 24, 16  # Gauss nodes of a straight way between states, and those of a check
#: of the sum over H₁'s terms, by which both may differ: errors of n nodes are C ρ^(−2n), so the
#: better sum errs by the power 3/2 of that, 3·10⁻¹⁷. Later terms have their singularities where f₁
#: has its own, but more noise, so H₁ alone decides
RESOLVED = 1e-11
HALVINGS = 8  # of a way that passes near a singularity


@dataclass(frozen=True)
class Terms:
    """The first terms of a modified equation at some states.

    field: f₁, …, f_K, each a list of n+m columns; hamiltonian: H₁, …, H_K, or None where a rule has
    no discrete Lagrangian; lagrangian: L₁, …, L_K at (x, μ), likewise. The j-th has the factor
    h^(j−1).
    """

    field: list[list[Scalar]]
    hamiltonian: list[Scalar] | None
    lagrangian: list[Scalar] | None


class ModifiedEquation:
    """The modified equation of a scheme up to a power of the step, at states or as formulas.

    scheme: of a scene without constraints, contact and time. order: the last power of h. digits: of
    the numbers. Raises `BadInput` for another order, and `CannotMeasure` for a scene or rule whose
    steps have no series in h.
    """

    def __init__(self, scheme: Any, order: int = 4, digits: int = 16) -> None:
        if type(order) is not int or not 1 <= order <= MOST:
            raise BadInput(
                f"order is {shown(order)}: give the last power of the step, from 1 to {MOST}."
            )
        self.scheme, self.order = scheme, order
        if refusal := _refusal(scheme):
            raise CannotMeasure(refusal)
        self.numbers = arithmetic(digits)
        self._lost = 0
        self.flow = scheme.flow(scheme.scene.step, digits)
        self.n, self.m = len(scheme.equations.s.x), len(scheme.equations.s.mu)

    def field(self, z: Numbers | Rows) -> np.ndarray:
        """Return f₁, …, f_K at rows z = (x, μ), (K, r, n+m), K = order + 1."""
        return self._shown(self._field(self._rows(z)))

    def hamiltonian(self, z: Numbers | Rows) -> np.ndarray:
        """Return H₁, …, H_K at rows z = (x, μ), (K, r).

        H₁ is the energy. Of a one-step map each is known but for a constant, and is 0 at the first
        row: it is integrated along the straight ways from there, to double precision, or over the
        row half as far where a singularity is near. A way along the run itself would tell nothing:
        no field does work along its own flow. Raises `CannotMeasure` for a map on another
        groupoid, for a force, and where a singularity lies on all ways.
        """
        rows = self._rows(z)
        self.check_hamiltonian()
        if not self.has_action:
            return self._shown(self._along_ways(rows))
        terms = self._terms(rows, True).hamiltonian
        assert terms is not None
        return self._shown(np.array([np.broadcast_to(e, len(rows)) for e in terms]))

    def at_step(self, terms: np.ndarray, step: Given) -> np.ndarray:
        """Return Σ h^(j−1) e_j of terms e₁, e₂, … at a step."""
        with self.numbers.working():
            h = self.numbers.number(step)
            own = self.numbers.own(terms.astype(object))
            return self._shown(sum((e * h**k for k, e in enumerate(own)), start=0 * own[0]))

    @property
    def has_action(self) -> bool:
        """True if H̃ comes from a discrete Lagrangian."""
        return not (self.scheme.equations.arrows is None or self.scheme.s.forced)

    def check_hamiltonian(self) -> None:
        """Raise `CannotMeasure` where there is no H̃, or where it is not known."""
        scene, rule = self.scheme.scene, self.scheme.rule
        if self.scheme.equations.s.forced:
            raise CannotMeasure(
                f"{scene.name} has a force, so there is no modified Hamiltonian: only the field is "
                "known."
            )
        if not self.has_action and not scene.groupoid.canonical:
            raise CannotMeasure(
                f"{rule.name} has no discrete Lagrangian, so its modified Hamiltonian is known on "
                "pair groupoids only: the field is, everywhere."
            )

    def _shown(self, values: np.ndarray) -> np.ndarray:
        with self.numbers.working():
            return self.numbers.public(values)

    def _field(self, rows: np.ndarray) -> np.ndarray:
        columns = self._terms(rows, False).field
        whole = [[np.broadcast_to(e, len(rows)) for e in term] for term in columns]
        return np.array(whole).swapaxes(1, 2)

    def _rows(self, z: Numbers | Rows) -> np.ndarray:
        rows = np.atleast_2d(np.asarray(z, dtype=self.numbers.dtype))
        if rows.ndim != 2 or rows.shape[1] != self.n + self.m:
            raise BadInput(
                f"{self.scheme.scene.name}: states are rows (x, mu) of {self.n + self.m} numbers, "
                f"not an array of the shape {np.shape(z)}."
            )
        with self.numbers.working():
            return self.numbers.own(rows.astype(object))  # each is checked

    def _terms(self, rows: np.ndarray, action: bool) -> Terms:
        with self.numbers.working(), np.errstate(all="ignore"):
            parts = self.flow.parts
            shares = [part.q[0] / self.flow.context.q[0] for part in parts]
            constants = [part.q[1:] for part in parts]
            columns = [np.ascontiguousarray(e) for e in rows.T]
            return self._expanded(columns, shares, constants, self.numbers, action)

    def _along_ways(self, rows: np.ndarray) -> np.ndarray:
        integrals, size, good = self._between(np.broadcast_to(rows[0], rows.shape), rows)
        bad = np.flatnonzero(~good)
        if len(bad):  # a finer sum, or a way round by the row half as far
            half = bad // 2
            finer = self._between(np.broadcast_to(rows[0], rows[bad].shape), rows[bad], HALVINGS)
            leg = self._between(rows[half], rows[bad], HALVINGS)
            for i, (k, j) in enumerate(zip(bad, half, strict=True)):  # j < k is known already
                integrals[:, k], size[k], good[k] = finer[0][:, i], finer[1][i], finer[2][i]
                longer = size[j] + leg[1][i]
                if good[j] and leg[2][i] and not (good[k] and size[k] <= longer):
                    integrals[:, k], size[k], good[k] = integrals[:, j] + leg[0][:, i], longer, True
        if not good.all():
            raise CannotMeasure(
                f"{self.scheme.scene.name} with {self.scheme.rule.name}: a singularity lies on the "
                "ways between the states, along which the modified Hamiltonian of a one-step map "
                "is integrated: begin elsewhere, or take a shorter run."
            )
        return integrals

    def _between(
        self, first: np.ndarray, last: np.ndarray, halvings: int = 0
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the integrals along straight ways, (K, r), with Σ|H₁'s terms| and a bool, (r,).

        The bool is True where the sum is resolved (`RESOLVED`); other ways are halved, so often at
        the most.
        """
        across = last - first
        rules = [np.polynomial.legendre.leggauss(nodes) for nodes in (WAY, FEWER)]
        points = np.concatenate([points for points, _ in rules])
        at = first + (points[:, None, None] + 1) / 2 * across  # (nodes, r, n+m)
        f = self._field(at.reshape(-1, at.shape[-1]))
        slope = np.concatenate([-f[..., self.n :], f[..., : self.n]], axis=-1)
        rates = (slope.reshape(len(f), *at.shape) * across).sum(axis=-1)
        integrals = np.einsum("krn,r->kn", rates[:, :WAY], rules[0][1] / 2)
        coarse = np.einsum("rn,r->n", rates[0, WAY:], rules[1][1] / 2)
        size = np.einsum("rn,r->n", abs(rates[0, :WAY]), rules[0][1] / 2)
        good = abs(integrals[0] - coarse) <= RESOLVED * size
        bad = np.flatnonzero(~good)
        if halvings and len(bad):
            middle, count = first[bad] + across[bad] / 2, len(bad)
            parts = self._between(
                np.concatenate([first[bad], middle]), np.concatenate([middle, last[bad]]),
                halvings - 1,
            )  # fmt: skip
            integrals[:, bad] = parts[0][:, :count] + parts[0][:, count:]
            size[bad] = parts[1][:count] + parts[1][count:]
            good[bad] = parts[2][:count] & parts[2][count:]
        return integrals, size, good

    @cached_property
    def formulas(self) -> Terms:
        """The terms as sympy expressions in the letters x, mu of the scene and its parameters.

        Of a one-step map without H̃. Raises `CannotMeasure` where there is no closed form, and
        `TooLong` (a `BadInput`) where they would take minutes.
        """
        s, parts = self.scheme.equations.s, self.flow.parts
        shares = [part.step / self.flow.step for part in parts]
        long = any(share.denominator > 10**12 for share in shares)
        atoms = Atoms(exact=not (long or any(p.equations.s.constants for p in parts)))
        with atoms.working():
            constants = [
                [*map(atoms.letter, s.parameter_list),
                 *map(atoms.decimal, p.equations.s.constant_values(60).values())] for p in parts
            ]  # fmt: skip
            z = [atoms.letter(e) for e in (*s.x, *s.mu)]
            fractions = [atoms.number(share) for share in shares]
            series = self._expanded(z, fractions, constants, atoms, self.has_action)
            write = atoms.written
            field = [[write(e) for e in term] for term in series.field]
            scalars = [
                None if terms is None else [write(e) for e in terms]
                for terms in (series.hamiltonian, series.lagrangian)
            ]
        return Terms(field, *scalars)

    def _expanded(self, *arguments: Any) -> Terms:
        """Return the terms; where quotients are 0/0 at h = 0, from series of more powers."""
        for lost in range(self._lost, MOST_LOST):
            try:
                terms = self._expanded_with(lost, *arguments)
            except NotKnown:
                continue
            self._lost = lost
            return terms
        return self._expanded_with(MOST_LOST, *arguments)

    def _expanded_with(
        self,
        lost: int,
        z: list[Scalar],
        shares: Scalars,
        constants: Sequence[Scalars],
        numbers: Arithmetic | Atoms,
        action: bool,
    ) -> Terms:
        """Return the terms from K iterates of the step, each a series in h."""
        K, n = self.order + 1, self.n
        h = Series.variable(K + lost + 1, numbers.number(1))
        steps = [_Part(p, numbers, action) for p in self.flow.parts]
        qs = [[h * share, *own] for share, own in zip(shares, constants, strict=True)]
        x, mu = z[:n], z[n:]
        v0 = self.scheme.scene.v0
        near = [] if isinstance(numbers, Atoms) else [numbers.number(e) for e in v0]
        count = len(self.scheme.equations.s.parameter_list)
        w = [
            s.step.start(x, mu, own[:count], near) for s, own in zip(steps, constants, strict=True)
        ]
        carried: list[list[Scalar]] = [[*z]]
        along = [numbers.number(1) if e else 0 for e in steps[0].begin] if action else []
        tracks = [along]
        for _ in range(K):
            for k, (part, q) in enumerate(zip(steps, qs, strict=True)):
                before = x
                x, mu, unknowns = part.step(x, mu, q, w[k], K, lost)
                w[k] = [e.coefficient(0) if isinstance(e, Series) else e for e in unknowns]
                if action:
                    along = part.carried(along, before, unknowns, z[:n], q)
            carried.append([*x, *mu])
            tracks.append(along)
        weights = _of_logarithm(K)

        def terms(rows: list[list[Scalar]]) -> list[list[Scalar]]:
            """Return the derivative by the time of each entry of K + 1 rows of series, K terms."""
            return [
                [_combined(weights, [row[i] for row in rows], j, numbers)
                 for i in range(len(rows[0]))] for j in range(1, K + 1)
            ]  # fmt: skip

        field = terms(carried)
        if not action:
            return Terms(field, None, None)
        hamiltonian, lagrangian = [], []
        for derivative in terms(tracks):
            L, xi = derivative[0], steps[0].velocity(z[:n], derivative[1:], qs[0])
            lagrangian.append(L)
            pairs = zip(z[n:], xi, strict=True)
            hamiltonian.append(sum((m * v for m, v in pairs), start=0) - L)
        return Terms(field, hamiltonian, lagrangian)


class _Part:
    """A substep, and what its action and its arrow add to those of the steps before."""

    def __init__(self, context: StepContext, numbers: Arithmetic | Atoms, action: bool) -> None:
        self.step = StepSeries(context, numbers)
        if not action:
            return
        names, space = ("action", "velocity"), series_namespace(numbers)
        texts = (map_text(context.equations, name) for name in names)
        self.action, self.velocity = (run_text(text, space)["function"] for text in texts)
        self.begin = [0, *composed_arrows(context.equations.groupoid).begin]

    def carried(
        self, along: list[Scalar], x: Scalars, w: Scalars, x0: Scalars, q: Scalars
    ) -> list[Scalar]:
        """Return the action and the arrow of the steps before with those of a step."""
        action, arrow = self.action(x, w, x0, along[1:], q)
        return [along[0] + q[0] * action, *arrow]


def _of_logarithm(K: int) -> list[Fraction]:
    """Return c_j with h f̃ = Σ c_j Φ_h^j + O(h^(K+1)), j = 0, …, K."""
    return [
        sum(
            (Fraction((-1) ** (k + 1) * (-1) ** (k - j) * comb(k, j), k)
             for k in range(max(1, j), K + 1)), start=Fraction(0),
        )
        for j in range(K + 1)
    ]  # fmt: skip


def _combined(
    weights: Sequence[Fraction], rows: Scalars, power: int, numbers: Arithmetic | Atoms
) -> Scalar:
    total: Scalar = 0
    for weight, e in zip(weights, rows, strict=True):
        if isinstance(e, Series) and weight:
            c = e.coefficient(power)
            total = total + numbers.number(weight) * c
    return total


def _refusal(scheme: Any) -> str:
    """Return why a scheme has no modified equation of this form, a sentence; "" if it has one."""
    rule = scheme.rule.name
    if "inner" in vars(scheme):
        return f"{rule} takes steps that vary, which have no such series: ask for its base rule's."
    if not scheme.rule.is_formula:
        return f"{rule} is a program, which has no series in the step."
    refusal: str = scheme.scene.refusal_of("a modified equation")
    return refusal
