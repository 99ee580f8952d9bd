"""The Taylor integration with an error bound.

Each step leaves polynomials p with a known defect sup |p' - f(p)| (`remainders`) and a known
rounding error at its end; `propagation` carries both to every later time, by the Jacobian over a
tube around the polynomials. As long as the resulting bounds stay inside the tube, the solution
exists and lies within them. The proof assumes that mpfr, arb and this program are correct. The
choice of stretches and frames is no part of the proof.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import gmpy2
import numpy as np
from flint import arb, arb_mat, arb_poly, fmpq

from ..equations import Equations
from ..failures import Unproven
from ..taylor import STEP_BITS, SeriesProgram, Step, Sweep, TaylorSettings, integrate
from ..taylor.balls import BallRates, around_zero, enclosed, exact, largest, working
from .majorants import upward
from .propagation import STRETCH, Carried, balance, row_norm
from .remainders import SLACK, Remainders

ROOM = 1e-9  # half-width of the tube, relative to the largest component of a block
NEGLIGIBLE = 2.0**-40  # smaller terms of a polynomial only widen the tube
# largest number of stretches of a step; their norms add up to 48, where no bound is left
MOST_STRETCHES = 128
# largest width of the balls of J over a step; a bound grows by e^WIDTH more than the error
WIDTH = 0.1
SHARES = (Fraction(0), Fraction(1, 2), Fraction(1))  # shares of a step at which these are evaluated


@dataclass(frozen=True)
class Enclosed:
    """A sweep and, for each time, bounds of |error| of the states: arb numbers, perhaps not finite.

    ``bounds`` are proven at the times in ``held``, up to which they stayed inside the tube; without
    ``proving`` they carry the same rigorous defects only to first order.
    """

    sweep: Sweep
    bounds: dict[Fraction, list[Any]]
    held: set[Fraction]


@dataclass(frozen=True)
class _Piece:
    """A step in the form that the tube needs."""

    size: Any
    paths: list[Any]  # polynomials in the offset, cut off
    slopes: list[Any]
    tails: list[Any]  # bounds of the cut-off terms
    defect: list[Any]
    jump: list[Any]
    times: list[tuple[Fraction, Fraction]]  # with their shares of the step

    def box(self, share: Fraction, width: Fraction, room: list[Any]) -> list[Any]:
        """Return balls around states from ``share - width/2`` to ``share + width/2`` of a step."""
        middle = self.size * fmpq(share.numerator, share.denominator)
        sway = around_zero(self.size * fmpq(width.numerator, 2 * width.denominator))
        whole = middle + sway
        return [
            path(middle) + slope(whole) * sway + around_zero(tail + wide)
            for path, slope, tail, wide in zip(
                self.paths, self.slopes, self.tails, room, strict=True
            )
        ]


@dataclass
class _Witness:
    """Records the pieces of each step and limits its size."""

    program: SeriesProgram
    settings: TaylorSettings
    pieces: list[_Piece] = field(default_factory=list)
    found: dict[Any, Remainders] = field(default_factory=dict)  # by the size of the next step

    def allowed(self, nodes: list[list[Any]], size: Any) -> Any:
        """Return this step size, or a shorter one with a defect near the tolerance.

        Intermediate values may have nearer poles than the states, above all the pivots of an
        elimination. An ordinary node's coefficients exceed the states' by N^3: those of a rate by
        N, of an acceleration by N^2, and one more for a function of a state.
        """
        order, n = self.settings.order, self.program.size

        def excess(size: Any) -> Any:
            step = Step(nodes, size, [])
            remainders = Remainders(self.program, step, order, self.settings.precision)
            self.found[size] = remainders
            defect = max(remainders.form(form) for form in self.program.rates) * abs(size)
            scale = max(abs(series[0]) for series in nodes[:n]) or 1
            return defect / scale * gmpy2.mpfr(10) ** self.settings.digits / order**3

        self.found.clear()
        with upward():
            now = excess(size)
            if now <= 1:
                return size
            # the cut-off part falls at least with this power; the rounding does not
            shorter = gmpy2.mpfr(size / gmpy2.root(now, order), STEP_BITS)
            return shorter if excess(shorter) <= gmpy2.sqrt(now) else size

    def __call__(self, step: Step) -> None:
        order, n = self.settings.order, self.program.size
        with upward(), working():
            remainders = self.found[step.size]
            states = remainders.known[:n]
            rounding = (2 * order + SLACK) * remainders.unit
            size = gmpy2.mpfr(abs(step.size))
            least = [a.norm * NEGLIGIBLE for a in states]
            low = [
                next((k for k in range(2, order) if a.tails[k] <= e), order)
                for a, e in zip(states, least, strict=True)
            ]
            paths = [
                arb_poly([exact(c) for c in nodes[:k]])
                for nodes, k in zip(step.nodes[:n], low, strict=True)
            ]
            self.pieces.append(
                _Piece(
                    exact(step.size),
                    paths,
                    [path.derivative() for path in paths],
                    [exact(a.tails[k]) for a, k in zip(states, low, strict=True)],
                    [exact(remainders.form(form) * size) for form in self.program.rates],
                    [exact((a.norm + a.slopes().norm) * rounding) for a in states],
                    [(t, _fraction(o) / _fraction(step.size)) for t, o in step.times],
                )
            )


def _fraction(value: Any) -> Fraction:
    return Fraction(*map(int, value.as_integer_ratio()))


def enclose(
    equations: Equations,
    program: SeriesProgram,
    times: Sequence[Fraction],
    settings: TaylorSettings,
    proving: bool = True,
) -> Enclosed:
    """Integrate and bound, forward and backward; raises `Unproven` if a step admits no bound."""
    witness = _Witness(program, settings)
    sweep = integrate(equations, program, [*times, Fraction(0)], settings, watch=witness)
    with working(settings.precision + 32):
        start = [
            (exact(z) - enclosed(wanted)).abs_upper()
            for z, wanted in zip(sweep.states[Fraction(0)], equations.start, strict=True)
        ]
        _check_constants(program, settings)
    proofs = {Fraction(0)}
    with working():
        scale = _scales(equations, witness, sweep)
        bounds = {t: [arb.pos_inf()] * len(start) for t in times} | {Fraction(0): start}
        for forward in (True, False):
            pieces = [piece for piece in witness.pieces if (piece.size > 0) == forward]
            for t, errors, safe in _carry(program, pieces, start, scale, proving):
                bounds[t] = errors
                if safe:
                    proofs.add(t)
    return Enclosed(sweep, bounds, proofs)


def _check_constants(program: SeriesProgram, settings: TaylorSettings) -> None:
    """Check that each constant of the series is as accurate as `remainders` assumes."""
    with gmpy2.context(gmpy2.get_context(), precision=settings.precision):
        constants = program.constants_at(settings.working)
    unit = arb(2) ** (1 - settings.precision)
    for used, number in zip(constants, map(enclosed, program.constants), strict=True):
        if not abs(exact(used) - number) <= unit * abs(number):
            raise Unproven(f"the constant {number} is not known well enough")


def _carry(
    program: SeriesProgram, pieces: list[_Piece], start: list[Any], scale: list[Any], proving: bool
) -> Iterator[tuple[Fraction, list[Any], bool]]:
    """Yield the times until a bound is lost, the bounds there, and True if these are proven."""
    rates = BallRates(program, scale)
    carried = Carried([e / s for e, s in zip(start, scale, strict=True)])
    room = [ROOM * s for s in scale]
    safe = proving
    for piece in pieces:
        weights, norm = _balanced(rates, piece)
        count = _stretches(rates, piece, room, weights, norm)
        source = [d / (s * count) for d, s in zip(piece.defect, scale, strict=True)]
        for i in range(count):
            box = piece.box(Fraction(2 * i + 1, 2 * count), Fraction(1, count), room)
            jacobian = rates(box)[1] * (piece.size / count)
            jacobian = jacobian if proving else jacobian.mid()
            inside = carried.move(jacobian, source, weights).entries()
            if not all(e.is_finite() for e in inside):
                return
            safe = safe and all(e.abs_upper() < ROOM for e in inside)
            for t, share in piece.times:
                if i < share * count <= i + 1:
                    errors = zip(inside, scale, piece.jump, strict=True)
                    yield t, [(e * s).abs_upper() + jump for e, s, jump in errors], safe
        carried.add([jump / s for jump, s in zip(piece.jump, scale, strict=True)])


def _balanced(rates: BallRates, piece: _Piece) -> tuple[list[Any], float]:
    """Return weights of the error during a step, and the norm of its Jacobian in them."""
    n = len(piece.paths)
    boxes = [piece.box(share, Fraction(0), [0] * n) for share in SHARES]
    entries = [(rates(box)[1] * piece.size).mid().entries() for box in boxes]
    return balance(abs(np.array(entries, dtype=float)).max(0).reshape(n, n))


def _stretches(
    rates: BallRates, piece: _Piece, room: list[Any], weights: list[Any], norm: float
) -> int:
    """Return how many stretches make each short with narrow balls; this is no part of the proof."""
    if norm == math.inf:
        return 1
    n, count, before = len(room), math.ceil(norm / STRETCH), math.inf
    while count < MOST_STRETCHES:
        widths = []
        for share in SHARES:
            jacobian = rates(piece.box(share, Fraction(1, count), room))[1] * piece.size
            spread = arb_mat(n, n, [around_zero(e.rad()) for e in jacobian.entries()])
            widths.append(float(row_norm(spread, weights)))
        width = max(widths) if all(map(math.isfinite, widths)) else math.inf
        if width <= WIDTH or before / 2 < width < math.inf:  # the tube's own width stays
            return count
        before, count = width, count * math.ceil(min(4, max(2, width / WIDTH)))
    return MOST_STRETCHES


def _scales(equations: Equations, witness: _Witness, sweep: Sweep) -> list[Any]:
    """Return a power of two for each state, near the largest component of its block at a step."""
    tops = [[path(0) for path in piece.paths] for piece in witness.pieces]
    tops.append([exact(z) for z in sweep.states[Fraction(0)]])
    scale = []
    for block in map(equations.block, ("x", "v", "attitude", "time")):
        parts = [top[block] for top in tops]
        most = largest(z for part in parts for z in part)
        mantissa, exponent = map(int, most.man_exp())
        power = mantissa.bit_length() + exponent if mantissa else 0
        scale += [arb(2) ** power] * len(parts[0])
    return scale
