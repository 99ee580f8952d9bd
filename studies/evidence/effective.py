"""The effective order of a rule: the order that it has once it is processed by a change of state.

Φ_h is of effective order q if near-identity symplectic maps χ_h exist with χ⁻¹ Φ χ of order q
(Butcher 1969; Blanes, Casas, Ros 1999): over a long run its errors are then those of order q, but
for oscillating terms. It is judged on scenes H = T(p) + V(x), for which such methods are made.

Two answers are certain. *It has it*: χ is found. Each term h^{j+1} g_j of the error, j = p, …, q −
1, has to be [f, Y] with Y a combination of the nested brackets of j of the fields of T and V; χ is
the flow of Σ h^j Y_j, and the next error is that of one processed step, at states that no method
can know. *It has it not*: were Φ conjugate to a method of order q, the mean of H̃ − H along a
motion, H̃ the modified energy, would be the same for all motions to O(h^q), q ≤ 2p. It differs by
h^j, j < q.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import Scheme, StepFailure
from discmech.integrators.equations import SceneSymbols, mass_matrix, momentum
from discmech.integrators.errors import DiscmechError
from discmech.integrators.numbers import arithmetic, jacobian, numeric, sympy
from discmech.reference import ReferenceFailure, surroundings

from ..core.single_steps import EffectiveOrder
from ..systems.modified_energy import mean_differences
from .places import Place

#: a step is 10^-SMALL of the motion's time; one power more of it remains in each term of an error
SMALL = 20
#: the share of an error, and of the motion's own rate, that counts as none: the next power of the
#: step with a constant of 10⁶, a margin that no float coefficient (10⁻¹⁶) reaches
LEFT, NOTHING = 1e-14, 1e-16
APART = 25  # digits of the difference quotient of a field; its error is the square
GUARD = 60  # digits beyond those that resolve the error of a step
MOST = 6  # the highest effective order that is judged: brackets of more fields are very many
#: largest distance of log₂ of the ratio of differences of means at h and h/2 from the power of h
NEAR = 0.25
BESIDE = 0.25  # share of the way to places beside a motion at which other motions start
FEW = 16  # with so many components of states at two places beside the motion, these are enough
DOUBLE = arithmetic(16)
CLEAR = 8  # a difference of means counts if it exceeds its error so many times

Field = Callable[[Any], Any]


def effective_order_of(scheme: Scheme, places: Sequence[Place]) -> EffectiveOrder:
    """Return the judgement whether a rule has the effective order that it declares.

    It is made from steps at the places. The rule's order on the scene suffices where it is at least
    the effective one.
    """
    first, wanted = scheme.order or 1, scheme.rule.effective
    assert wanted is not None
    if first >= wanted:
        return EffectiveOrder("pass", f"the rule itself is of order {first} here.", first)
    split = _Split.of(scheme.s)
    if split is None or scheme.scene.all_constraints or scheme.scene.timed or scheme.s.forced:
        return EffectiveOrder(
            "",
            f"the effective order {wanted} is judged where L = v·Mv/2 − V(x) with a constant mass "
            "M, and neither forces nor time nor constraints: not on this scene.",
        )
    if wanted > (most := min(MOST, 4 * first)):  # `_changed` is exact enough up to here
        return EffectiveOrder(
            "inconclusive",
            f"of a rule of order {first} effective orders up to {most} are judged, and {wanted} is "
            "declared.",
        )
    try:
        return _Processing(scheme, places, split, first, wanted).judged()
    except (ReferenceFailure, StepFailure, DiscmechError) as failure:
        said = " ".join(str(failure).split()).rstrip(".")
        return EffectiveOrder("inconclusive", f"no processed step could be made: {said}.")


class _Split:
    """The fields of T and V of a scene in numbers: z = (x, μ) ↦ (M⁻¹(μ − a), 0) and (0, −∂V)."""

    def __init__(self, s: SceneSymbols) -> None:
        self.s, self.n = s, len(s.x)

    @classmethod
    def of(cls, s: SceneSymbols) -> _Split | None:
        """Return the split, or None for a scene that is no H = T(p) + V(x) with a quadratic T."""
        if not s.groupoid.canonical or s.clocked:
            return None
        letters = {*s.x, *s.u}
        slope = jacobian([s.lagrangian], s.x)
        mixed = jacobian(momentum(s), s.x)
        if (
            not all(sympy.sympify(e).equals(0) for e in mixed)
            or mass_matrix(s).free_symbols & letters
            or slope.free_symbols & set(s.u)
        ):
            return None
        return cls(s)

    def force(self, z: Any, parameters: Sequence[Any]) -> Any:
        """Return −∂V (n, r) at rows of states, in doubles."""
        letters = {"x": self.s.x, "p": self.s.parameter_list}
        slope = list(jacobian([self.s.lagrangian], self.s.x))
        p = [DOUBLE.number(e) for e in parameters]
        forces = numeric(letters, [slope], DOUBLE, columns=True)(z[:, : self.n].T, p)
        return np.stack([np.broadcast_to(e, len(z)) for e in forces]).astype(float)

    def mass(self, parameters: Sequence[Any]) -> Any:
        """Return M (n, n) in doubles."""
        p = [DOUBLE.number(e) for e in parameters]
        maps = numeric({"p": self.s.parameter_list}, [mass_matrix(self.s)], DOUBLE)
        return np.asarray(maps(p), dtype=float)

    def fields(self, numbers: Any, parameters: Sequence[Any]) -> tuple[Field, Field]:
        """Return (field of T, field of V) in an arithmetic that has to be active."""
        s, n = self.s, self.n
        maps = numeric(
            {"x": s.x, "u": s.u, "p": s.parameter_list},
            [list(jacobian([s.lagrangian], s.x)), mass_matrix(s), list(momentum(s))], numbers,
        )  # fmt: skip
        p = [numbers.number(e) for e in parameters]
        rest = np.array([numbers.number(0)] * n, dtype=object)

        def of_v(z: Any) -> Any:
            return np.concatenate([rest, maps(z[:n], rest, p)[0]])

        def of_t(z: Any) -> Any:
            _, mass, at_rest = maps(z[:n], rest, p)
            return np.concatenate([numbers.solve(mass, z[n:] - at_rest), rest])

        return of_t, of_v


class _Processing:
    """The errors of a processed step at some places, and the processing that removes them."""

    def __init__(
        self, scheme: Scheme, places: Sequence[Place], split: _Split, first: int, wanted: int
    ) -> None:
        self.scheme, self.split, self.first, self.wanted = scheme, split, first, wanted
        beside = [place for place in places if place.beside]
        enough = len(beside) >= 2 and 4 * split.n >= FEW
        self.every = sorted(places, key=lambda place: place.beside)
        self.places = beside[:2] if enough else list(places)
        self.digits = SMALL * (wanted + 1) + GUARD
        self.numbers = arithmetic(self.digits)
        self.n = split.n
        self.time = min(place.length for place in places)
        step = self.time * Fraction(1, 10**SMALL)
        self.flows = [scheme.flow(step / 2**k, self.digits) for k in range(wanted - first)]
        self.terms: list[tuple[int, Any, Field]] = []  # (j, coefficient, Y) of Σ h^j c Y

    def judged(self) -> EffectiveOrder:
        with self.numbers.working():
            self.tau = self.numbers.number(self.time)
            self.of_t, self.of_v = self.split.fields(
                self.numbers, self.scheme.scene.parameter_values
            )
            self.states = [self._state(p.x, p.mu) for p in self.places]
            rates = [abs(self.of_t(z) + self.of_v(z)) * self.tau for z in self.states]
            size = [max(r[i] for r in rates) for i in range(2 * self.n)]
            self.unit = np.array([e if e else max(size) for e in size], dtype=object)
            for j in range(self.first, self.wanted):
                left = self._level(j)
                if left is not None:
                    return self._not_found(j, left)
        brackets = {2: "{T, V}", 1: "V"}.get(self.first, "brackets of T and V")
        return EffectiveOrder(
            "pass",
            f"processed by exp(h^{self.first} X_K) with K made of {brackets}, one step is of order "
            f"{self.wanted}, also beside the motion.",
            self.wanted,
        )

    def _level(self, j: int) -> Any:
        """Return the error of order h^{j+1} that no Y removes, or None and keep the Y that does."""
        target = self._stacked(self._errors(j), j + 1)
        size = _norm(target)
        if size <= NOTHING:
            return None
        fields = [self._nested(word) for word in _words(j)]
        columns = [
            self._stacked([self._bracket(self._whole, y, 1, j)(z) for z in self.states], j + 1)
            for y in fields
        ]
        coefficients, left = _fitted(columns, target)
        if _norm(left) > LEFT * size + NOTHING:
            return target
        self.terms += [(j, c, y) for c, y in zip(coefficients, fields, strict=True) if c]
        return None

    def _errors(self, j: int) -> list[Any]:
        """Return (χ⁻¹ Φ χ(z) − φ(z)) / h^{j+1} at each place, as h goes to 0.

        It is exact to O(h^{q − j}), by Richardson's extrapolation: the remainder enters Y, and does
        not show in later errors.
        """
        rows = [self._errors_at(flow, j) for flow in self.flows[: self.wanted - j]]
        for k in range(1, len(rows)):
            rows = [
                [(2**k * b - a) / (2**k - 1) for a, b in zip(one, other, strict=True)]
                for one, other in itertools.pairwise(rows)
            ]
        return rows[0]

    def _errors_at(self, flow: Any, j: int) -> list[Any]:
        around, errors = surroundings(self.scheme.scene), []
        h = self.numbers.number(flow.step)
        for place, z in zip(self.places, self.states, strict=True):
            x, mu = np.split(self.numbers.public(self._changed(z, h, 1)), [self.n])
            run = flow.trajectory(1, x0=list(x), mu0=list(mu), u0=place.u)
            end = self._state(run.x[-1], run.mu[-1])
            (exact,) = around.after(place.x, place.u, place.t, [flow.step], self.digits)
            wanted = self._state(exact.x, exact.mu)
            errors.append((self._changed(end, h, -1) - wanted) / h ** (j + 1))
        return errors

    def _state(self, x: Any, mu: Any) -> Any:
        return np.array([self.numbers.number(e) for e in (*x, *mu)], dtype=object)

    def _changed(self, z: Any, h: Any, sign: int) -> Any:
        """Return χ(z), or χ⁻¹(z): the flow of Σ h^j c Y for a time ±1, by the Runge–Kutta rule.

        Its error is of the fifth power of h^p, too small for judging orders below 5p.
        """
        if not self.terms:
            return z

        def field(at: Any) -> Any:
            return sign * sum(c * h**j * y(at) for j, c, y in self.terms)

        a = field(z)
        b = field(z + a / 2)
        c = field(z + b / 2)
        d = field(z + c)
        return z + (a + 2 * b + 2 * c + d) / 6

    def _whole(self, z: Any) -> Any:
        return self.of_t(z) + self.of_v(z)

    def _bracket(self, one: Field, other: Field, of_one: int, of_other: int) -> Field:
        """Return [F, G] = DG F − DF G by differences; of_one, of_other: numbers of fields."""

        def along(field: Field, z: Any, v: Any, count: int) -> Any:
            d = self.tau**count / 10**APART
            return (field(z + d * v) - field(z - d * v)) / (2 * d)

        def bracket(z: Any) -> Any:
            return along(other, z, one(z), of_one) - along(one, z, other(z), of_other)

        return bracket

    def _nested(self, word: str) -> Field:
        """Return [A, [B, … [Y, Z]]] of a word of the letters T and V."""
        letters = {"T": self.of_t, "V": self.of_v}
        field = letters[word[-1]]
        for k, letter in enumerate(reversed(word[:-1]), 1):
            field = self._bracket(letters[letter], field, 1, k)
        return field

    def _stacked(self, values: Sequence[Any], count: int) -> Any:
        """Return at all places, in units of the motion, a field made of `count` fields T and V."""
        return np.concatenate([v / self.unit for v in values]) * self.tau**count

    def _not_found(self, j: int, target: Any) -> EffectiveOrder:
        """Return the judgement if the errors h^{j+1} are no [f, Y] of brackets Y."""
        cause, share = self._cause(target) if j == 2 else ("", None)
        here = f"of what one step leaves at h^{j + 1} no processing by brackets of T and V takes"
        at, *others = (np.array([*p.x, *p.mu], dtype=float) for p in self.every)
        nearer = [at + (e - at) * BESIDE for e in others]  # bounded if that motion is
        starts = [at, *nearer, *others]
        denied = f"the effective order is {j} and not {self.wanted}: {here} all away, and"
        if share is not None:
            for one, half, error in mean_differences(self.scheme, starts, share):
                if abs(half) > CLEAR * (error + abs(one - half)):
                    return EffectiveOrder(
                        "fail",
                        f"{denied} the mean along a motion of what is left is not the same for two "
                        "motions, so no processing does.",
                        j, cause,
                    )  # fmt: skip
        for one, half, error in mean_differences(self.scheme, starts) if j < 2 * self.first else []:
            if min(abs(half), abs(one)) > CLEAR * error:
                power = math.log2(abs(one / half))
                if abs(power - j) <= NEAR:
                    return EffectiveOrder(
                        "fail",
                        f"{denied} the means of H̃ − H along two motions differ by h^{power:.2f}, "
                        f"which of a method of effective order {self.wanted} differ by "
                        f"O(h^{self.wanted}).",
                        j, cause,
                    )  # fmt: skip
        return EffectiveOrder(
            "inconclusive",
            f"{here} all away, so the effective order {self.wanted} was not found; but means along "
            "motions did not settle, which would deny every other processing.",
            None, cause,
        )  # fmt: skip

    def _cause(self, target: Any) -> tuple[str, Any]:
        """Return the cause of errors h³, "" if unknown, and their quantity of states in doubles.

        It is β F·M⁻¹F + γ F·F beside a bracket with H, F = −∂V: T and V make no other term.
        """
        n, of_v = self.n, self.of_v

        def massless(z: Any) -> Any:  # the field of |∂V|²/2: (0, −V″ ∂V)
            force = of_v(z)[n:]
            way = np.concatenate([force, 0 * force])
            d = min(self.unit[:n]) / max(map(abs, force)) / 10**APART
            return (of_v(z + d * way) - of_v(z - d * way)) / (2 * d)

        fields = [self._nested("TTV"), self._nested("VTV"), massless]
        columns = [self._stacked([y(z) for z in self.states], 3) for y in fields]
        size = _norm(target)
        for used in (2, 3):  # where M is 1 the third column equals the second
            coefficients, left = _fitted(columns[:used], target)
            if _norm(left) <= LEFT * size + NOTHING:
                break
        else:
            return "", None
        # [f, {T, V}] is the sum of the two brackets, and the third belongs to a force gradient
        shares = [
            float(coefficients[1] - coefficients[0]),
            float(coefficients[2]) if used == 3 else 0.0,
        ]

        mass = self.split.mass(self.scheme.scene.parameter_values)

        def quantity(z: Any) -> Any:
            force = self.split.force(z, self.scheme.scene.parameter_values)
            return (force * (shares[0] * np.linalg.solve(mass, force) + shares[1] * force)).sum(0)

        one = mass[0][0]
        if used == 2 and np.allclose(mass, one * np.eye(n)) and one != 1:
            # h³/48 ∂V·∂V at each end are m times as much as they should be
            used += math.isclose(shares[0] * 24, one - 1, rel_tol=1e-9)
        if used == 2:
            side = "little" if shares[0] < 0 else "much"
            return (
                "a force gradient is missing, or its factor is another: in L_d there is "
                f"{abs(shares[0]) / 2:.6g} h³ ∂V·M⁻¹∂V too {side} at each end of the step",
                quantity,
            )
        return (
            "the mass is forgotten in a force gradient, or some of it: ∂V·∂V is left where "
            "∂V·M⁻¹∂V is wanted",
            quantity,
        )


def _words(count: int) -> list[str]:
    """Return words of T and V whose right-nested brackets span those of `count` fields."""
    if count == 1:
        return ["V"]
    return ["".join(word) + "TV" for word in itertools.product("TV", repeat=count - 2)]


def _norm(vector: Any) -> float:
    return math.sqrt(float(vector.dot(vector)) / len(vector))


def _fitted(columns: Sequence[Any], target: Any) -> tuple[list[Any], Any]:
    """Return the coefficients of least squares, 0 for a dependent column, and the remainder."""
    basis: list[tuple[Any, dict[int, Any]]] = []
    for k, column in enumerate(columns):
        rest, made = column, {k: 1}
        for _ in range(2):
            for q, of in basis:
                share = q.dot(rest)
                rest = rest - share * q
                for i, c in of.items():
                    made[i] = made.get(i, 0) - share * c
        size = rest.dot(rest)
        if not size or float(size) <= 1e-20 * max(float(column.dot(column)), 1e-40):
            continue
        root = size**0.5
        basis.append((rest / root, {i: c / root for i, c in made.items()}))
    coefficients: list[Any] = [0] * len(columns)
    left = target
    for q, of in basis:
        share = q.dot(left)
        left = left - share * q
        for i, c in of.items():
            coefficients[i] = coefficients[i] + share * c
    return coefficients, left
