"""The change of the symplectic form under a step with a force: the differential of its one-form.

On the dual, in the vectors (b, δμ) with δx = ρ̂ b, ω of `restricted_form` is −dΘ with Θ = μ·b. A
step maps b to b′; the displacement of its arrow is a = −b/h, c = b′/h, and

    Θ′ − Θ = h(μ′·c + μ·a) = dL_d + θ_f,    θ_f = h(f⁻·a + f⁺·c),

where f± are the force's parts of F±/h; stages s have a part h f_s·δs of their own, and depend on x
and u. So ω′ − ω = −dθ_f along the step (Marsden, West 2001, 3.2: without a force nothing changes).
With the sections [e→_μ, e→_ν] = −C^θ_{μν} e→_θ at the start and [e←_μ, e←_ν] = C^θ_{μν} e←_θ at the
end,

    dθ(E_i, E_j) = E_i(θ_j) − E_j(θ_i) − θ([E_i, E_j]).

f± come from the displacement of points (`virtual_work`), P from the Legendre maps: so the two sides
are independent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numbers import Arithmetic, Tracked, solve, tracked
from ..numbers.types import Array, Number, Vector
from .defects import over_terms
from .step_map import Maps, StepMap


def canonical_form(geometry: StepMap, x: Vector, mu: Vector, sign: int = 1) -> Tracked:
    """Return ω at (x, μ) on the vectors (b, δμ), 2m×2m; sign = −1 flips its bracket: a control."""
    numbers, m = geometry.numbers, geometry.m
    zero, one = numbers.zeros(m, m), numbers.identity(m)
    bracket: Array = geometry.contracted(x, mu) * numbers.number(sign)
    return tracked(np.block([[bracket, one], [-one, zero]]))


def work_differential(geometry: StepMap, x: Vector, u: Vector, here: Maps) -> Tracked:
    """Return dθ_f on the sections a e→ + c e← of the arrow (x, u), 2m×2m in the order (a, c).

    here: the maps at the arrow.
    """
    numbers, h, (n, m, k) = geometry.numbers, geometry.q[0], (geometry.n, geometry.m, geometry.k)
    force, slope = geometry.force_and_slopes(x, u)
    none = numbers.zeros
    along: Array = np.block([[-here["rho"], none(n, m)], [here["R"], here["L"]]])
    arrows = np.vstack([along, none(k, 2 * m)])
    stages = np.vstack([none(n + m, k), numbers.identity(k)])
    derivatives = (slope @ np.hstack([arrows, stages])).T * h  # row i: E_i(θ_j)
    y = tracked(here["target"]).value
    start, end = (geometry.contracted(at, f.value) for at, f in
                  ((x, force[:m]), (y, force[m : 2 * m])))  # fmt: skip
    brackets = [start * h * h, end * -h * h, none(k, k)]
    whole = derivatives - derivatives.T + _diagonal(numbers, brackets)
    if not k:
        return whole
    pulled = np.vstack([numbers.identity(2 * m), here["follow"] @ along])
    return pulled.T @ whole @ pulled


def _diagonal(numbers: Arithmetic, blocks: list[Array]) -> Array:
    """Return the block-diagonal matrix of square blocks."""
    sizes = [block.shape[0] for block in blocks]
    return np.block([
        [blocks[i] if i == j else numbers.zeros(a, b) for j, b in enumerate(sizes)]
        for i, a in enumerate(sizes)
    ])  # fmt: skip


@dataclass(frozen=True)
class FormChange:
    """A step on the vectors (b, δμ) at its start, with matrices 2m×2m.

    `map_` maps them to its end, `before` and `after` are ω at both ends, `work` is dθ_f pulled back
    to the start.
    """

    map_: Array
    before: Array
    after: Array
    work: Array

    def then(self, later: FormChange) -> FormChange:
        """Return this step followed by a later one, which starts at its end."""
        work = self.work + self.map_.T @ later.work @ self.map_
        return FormChange(later.map_ @ self.map_, self.before, later.after, work)

    def gap(self) -> tuple[Tracked, Vector]:
        """Return Pᵀω′P − ω + dθ_f, and |P|ᵀ|ω′||P| + |ω| + |dθ_f|, its terms."""
        gap = self.map_.T @ self.after @ self.map_ - self.before + self.work
        size = abs(self.map_.value)
        terms = size.T @ abs(self.after.value) @ size + abs(self.before.value)
        return gap, terms + abs(self.work.value)

    def defect(self, resolution: Number) -> Number:
        """Return the largest entry of `gap` over its terms; resolution: see `entrywise_defect`."""
        return over_terms(*self.gap(), resolution)

    def volume(self, numbers: Arithmetic) -> tuple[Number, Number]:
        """Return (det P, how far its square is from det(ω − dθ_f), relative to their sum).

        det P is the factor by which the step changes a volume of phase space: det ω = 1 everywhere.
        """
        grown = numbers.det(self.map_.value)
        wanted = numbers.det((self.before - self.work).value)
        return grown, abs(grown * grown - wanted) / (grown * grown + abs(wanted))


def form_change(
    geometry: StepMap, x: Vector, mu: Vector, start: Vector, sign: int = 1, forced: bool = True
) -> FormChange:
    """Return the change of ω in the step from (x, μ), by Newton from a start.

    sign = −1 flips the bracket of ω: a negative control. forced: False without the force's dθ_f.
    """
    numbers, e, h = geometry.numbers, geometry.equations, geometry.q[0]
    n, m = geometry.n, geometry.m
    free = geometry if e.free is None else StepMap(e.free, numbers, geometry.q)
    u = geometry.unknowns(x, mu, start)[:m]
    here = free.tracked(x, u)
    zero: Array = numbers.zeros(m, m)
    one: Array = Tracked(numbers.identity(m))
    lift = np.block([[here["rho"] / h, numbers.zeros(n, m)], [zero, one]])
    _, slope, by_z, end, of_w, of_z = geometry.parts(x, mu, start)
    along = -solve(numbers, slope, by_z @ lift)
    c = solve(numbers, here["L"], along[:m] + np.hstack([here["R"] / h, zero]))
    map_ = np.vstack([c * h, (of_z @ lift + of_w @ along)[n:]])
    arrow = np.vstack([np.hstack([one / -h, zero]), c])
    work = tracked(numbers.zeros(2 * m, 2 * m))
    if forced and e.s.forced:
        work = arrow.T @ work_differential(free, x, u, here) @ arrow
    after = canonical_form(geometry, end.value[:n], end.value[n:], sign)
    return FormChange(map_, canonical_form(geometry, x, mu, sign), after, work)
