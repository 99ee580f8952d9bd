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
from .local_geometry import LocalGeometry, Maps, slopes


def canonical_form(geometry: LocalGeometry, x: Vector, mu: Vector, sign: int = 1) -> Tracked:
    """Return ω at (x, μ) on the vectors (b, δμ), 2m×2m; sign = −1 flips its bracket: a control."""
    numbers, m = geometry.numbers, geometry.m
    zero, one = numbers.zeros(m, m), numbers.identity(m)
    bracket: Array = geometry.contracted(x, mu) * numbers.number(sign)
    return tracked(np.block([[bracket, one], [-one, zero]]))


def work_differential(geometry: LocalGeometry, x: Vector, u: Vector, here: Maps) -> Tracked:
    """Return dθ_f on the sections a e→ + c e← of the arrow (x, u), 2m×2m in the order (a, c).

    here: the maps at the arrow.
    """
    numbers, h, (n, m, k) = geometry.numbers, geometry.q[0], (geometry.n, geometry.m, geometry.k)
    force, slope = geometry.force_and_slopes(x, u)
    none = numbers.zeros
    along: Array = np.block([[-here["rho"], none(n, m)], [here["R"], here["L"]]])
    arrows = np.vstack([along, none(k, 2 * m)])
    stages = np.vstack([none(n + m, k), numbers.identity(k)])
    given = (slope @ np.hstack([arrows, stages])).T * h  # row i: E_i(θ_j)
    y = tracked(here["target"]).value
    start, end = (geometry.contracted(at, f.value) for at, f in
                  ((x, force[:m]), (y, force[m : 2 * m])))  # fmt: skip
    brackets = [start * h * h, end * -h * h, none(k, k)]
    whole = given - given.T + _diagonal(numbers, brackets)
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

    def defect(self, resolution: Number) -> Number:
        """Return the largest entry of |Pᵀω′P − ω + dθ_f| over |P|ᵀ|ω′||P| + |ω| + |dθ_f|.

        resolution: see `entrywise_defect`.
        """
        gap = self.map_.T @ self.after @ self.map_ - self.before + self.work
        size = abs(self.map_.value)
        terms = size.T @ abs(self.after.value) @ size + abs(self.before.value)
        return over_terms(gap, terms + abs(self.work.value), resolution)

    def volume(self, numbers: Arithmetic) -> tuple[Number, Number]:
        """Return (det P, how far its square is from det(ω − dθ_f), relative to their sum).

        det P is the factor by which the step changes a volume of phase space: det ω = 1 everywhere.
        """
        grown = numbers.det(self.map_.value)
        wanted = numbers.det((self.before - self.work).value)
        return grown, abs(grown * grown - wanted) / (grown * grown + abs(wanted))


def form_change(geometry: LocalGeometry, x: Vector, mu: Vector, u: Vector) -> FormChange:
    """Return the change of ω in the step from (x, μ) along the arrow (x, u) with F⁻ = hμ."""
    numbers, h, (n, m) = geometry.numbers, geometry.q[0], (geometry.n, geometry.m)
    zero: Array = numbers.zeros(m, m)
    one: Array = Tracked(numbers.identity(m))
    here = geometry.tracked(x, u)
    natural: Array = here["rho"] / h
    of_x = np.hstack([natural, numbers.zeros(n, m)])
    of_mu = np.hstack([zero, one * h])
    of_u = solve(numbers, here["minus_u"], of_mu - here["minus_x"] @ of_x)
    moved = np.vstack([of_x, of_u])
    turned = np.hstack([here["R"] / h, zero])
    c = solve(numbers, here["L"], of_u + turned)
    map_ = np.vstack([c * h, slopes(here, "plus") @ moved / h])
    arrow = np.vstack([np.hstack([one / -h, zero]), c])
    work = arrow.T @ work_differential(geometry, x, u, here) @ arrow
    after = canonical_form(geometry, here["target"].value, here["plus"].value / h)
    return FormChange(map_, canonical_form(geometry, x, mu), after, work)
