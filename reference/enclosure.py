"""The Taylor integration with a bound of its error, rounded up throughout.

Each step leaves polynomials p with a known defect sup |p' - f(p)| (`remainders`) and a known
rounding error at its end; `propagation` carries both to every later time, by the nonlinear
variation of constants (Alekseev, Groebner; Hairer, Norsett, Wanner I.14). If the bounds so found
stay inside the tube over which the Jacobian was enclosed, the solution exists and lies within them.
It is assumed that mpfr rounds correctly, that the elementary functions of doubles err by at most
four units in the last place, and that this program does what it says.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from .majorants import upward
from .propagation import ROOM, Carried, growth
from .remainders import SLACK, Remainders
from .taylor import Step, Sweep, TaylorSettings, integrate

if TYPE_CHECKING:
    from .equations import Equations
    from .series import SeriesProgram


@dataclass(frozen=True)
class Enclosed:
    """A sweep and, for each time, bounds of |error| of the states: mpf numbers, perhaps inf.

    ``bounds`` are proven at the times in ``held``, up to which they stayed inside the tube;
    ``estimates`` carry the same rigorous defects to first order only.
    """

    sweep: Sweep
    bounds: dict[Fraction, list[Any]]
    estimates: dict[Fraction, list[Any]]
    held: set[Fraction]


@dataclass
class _Witness:
    """What is kept of each step: in doubles, errors in units of the tolerance."""

    program: SeriesProgram
    settings: TaylorSettings
    series: list[Any] = field(default_factory=list)
    sizes: list[float] = field(default_factory=list)
    defects: list[Any] = field(default_factory=list)
    jumps: list[Any] = field(default_factory=list)
    times: list[list[tuple[Fraction, float]]] = field(default_factory=list)

    def __call__(self, step: Step) -> None:
        import gmpy2
        import numpy as np

        order, n = self.settings.order, self.program.size
        with upward():
            found = Remainders(self.program, step, order, self.settings.precision)
            size = gmpy2.mpfr(abs(step.size))
            in_units = gmpy2.mpfr(10) ** self.settings.digits
            self.defects.append(
                [up(found.form(form) * size * in_units) for form in self.program.rates]
            )
            rounding = (2 * order + SLACK) * found.unit * in_units
            self.jumps.append([up((a.norm + a.slopes().norm) * rounding) for a in found.known[:n]])
            signed, power = gmpy2.mpfr(step.size), gmpy2.mpfr(1)
            rows = []
            for k in range(order + 1):
                rows.append([float(a[k] * power) for a in step.nodes[:n]])
                power *= signed
        self.series.append(np.array(rows))
        self.sizes.append(float(step.size))
        self.times.append([(t, min(1.0, float(o / step.size))) for t, o in step.times])


def up(value: Any) -> float:
    """As a double, no smaller."""
    return float(value) * (1 + 2.0**-50)


def enclose(
    equations: Equations,
    program: SeriesProgram,
    times: Sequence[Fraction],
    settings: TaylorSettings,
) -> Enclosed:
    """Integrate and bound, forward and backward; raises `Unproven` where a step admits no bound."""
    import gmpy2
    import mpmath
    import numpy as np

    witness = _Witness(program, settings)
    sweep = integrate(equations, program, [*times, Fraction(0)], settings, watch=witness)
    scale = _scales(equations, witness, sweep)
    with upward():
        rounding = gmpy2.mpfr(2) ** (1 - settings.precision) * gmpy2.mpfr(10) ** settings.digits
        start = np.array([up(abs(z) * rounding) for z in sweep.states[Fraction(0)]]) / scale
    found = {Fraction(0): (start, start)}
    held = {Fraction(0)}
    signs = np.sign(witness.sizes)
    for direction in (1, -1):
        chosen = np.flatnonzero(signs == direction)
        if len(chosen):
            held |= _carry(witness, chosen, start, scale, found)

    def bounds(which: int) -> dict[Fraction, list[Any]]:
        with mpmath.workdps(15):
            unit = mpmath.mpf(10) ** -settings.digits
            return {
                t: [mpmath.mpf(float(e)) * unit for e in _no_nan(found[t][which] * scale)]
                for t in (*times, Fraction(0))
            }

    return Enclosed(sweep, bounds(0), bounds(1), held)


def _carry(
    witness: _Witness, chosen: Any, start: Any, scale: Any, found: dict[Fraction, Any]
) -> set[Fraction]:
    """Fill in the (proven, estimated) bounds of the chosen steps, scaled; the times that hold."""
    import numpy as np

    series, sizes = np.array(witness.series)[chosen], np.array(witness.sizes)[chosen]
    flow = growth(witness.program, series, sizes, scale)
    proven, estimated = Carried(start), Carried(start)
    limit = ROOM * 10.0 ** min(witness.settings.digits, 300)
    safe = True
    held: set[Fraction] = set()
    for i, place in enumerate(flow.step):
        step = chosen[place]
        first, last = flow.share[i]
        defect = np.array(witness.defects[step]) / scale * (last - first) * (1 + 1e-9)
        jump = np.array(witness.jumps[step]) / scale
        inside = [flow.within[i] @ (carried.now() + defect) for carried in (proven, estimated)]
        safe = safe and bool((inside[0] <= limit).all())
        for t, share in witness.times[step]:
            if first <= share <= last:  # at the seam of two parts the later one counts
                found[t] = tuple(part + 2 * jump for part in inside)
                (held.add if safe else held.discard)(t)
        grown = flow.within[i] @ defect + (jump if last > 1 - 1e-9 else 0)
        proven.move(flow.phi[i], flow.slop[i], grown)
        estimated.move(flow.phi[i], 0 * flow.slop[i], grown)
    return held


def _no_nan(bounds: Any) -> Any:
    """What is not a number bounds nothing."""
    import numpy as np

    return np.nan_to_num(bounds, nan=np.inf, posinf=np.inf)


def _scales(equations: Equations, witness: _Witness, sweep: Sweep) -> Any:
    """A power of two for each state: the largest component that its block ever has."""
    import numpy as np

    n, m = equations.dim_x, equations.dim_u
    sizes = [abs(rows[0]) for rows in witness.series]
    sizes += [np.array([abs(float(z)) for z in sweep.states[Fraction(0)]])]
    most = np.max(sizes, axis=0)
    for block in (slice(0, n), slice(n, n + m), slice(n + m, None)):
        if most[block].size:
            most[block] = 2.0 ** math.ceil(math.log2(most[block].max() or 1.0))
    return most
