"""The change of the symplectic form under a step with a force: the differential of its one-form.

On the dual, in the vectors (b, δμ) with δx = ρ̂ b, ω is −dΘ with Θ = μ·b. A
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
from functools import lru_cache

import numpy as np

from ..equations import SceneSymbols, constraint_matrix, constraint_shift, mass_matrix, momentum
from ..numbers import Arithmetic, Tracked, jacobian, numeric, solve, tracked
from ..numbers.types import Array, Function, Matrix, Number, Vector
from .defects import in_round_offs, over_terms
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


# With holonomic constraints, which may move, ω changes as before, and is preserved on exactly the
# vectors with A b = 0 and d(A ξ − a) = 0, at the time of each end (Marsden, West 2001, 3.5.3).


def restricted_defect(
    geometry: StepMap,
    x: Vector,
    mu: Vector,
    start: Vector,
    sign: int = 1,
    forced: bool = False,
) -> Number:
    """Return the defect of ω under the step from (x, μ), on the vectors that the constraints admit.

    It is the largest entry of |Nᵀ(Pᵀ ω′ P − ω)N| over |N|ᵀ(|P|ᵀ|ω′||P| + |ω|)|N|, where N is a
    basis of these vectors; it does not depend on units. start: Newton's start. sign = −1 flips the
    bracket: a negative control. forced: True if the change should be −dθ_f, with the scene's force
    (`forced_form`).
    """
    numbers, m = geometry.numbers, geometry.m
    u = geometry.unknowns(x, mu, start)[:m]
    xi = geometry.velocities(x[None], mu[None], u[None])[0]
    A, turning, mass, moved, rho = _parts(geometry.equations.s, numbers)(x, xi, geometry.q)
    # A b = 0, and d(A ξ − a) = 0 with M dξ = δμ − ∂p/∂x δx
    of_xi = numbers.solve(mass, np.hstack([-moved @ rho, numbers.identity(m)]))
    still = numbers.zeros(len(A), m)
    conditions = np.vstack([np.hstack([A, still]), np.hstack([turning @ rho, still]) + A @ of_xi])
    N = _null_space(numbers, conditions)
    gap, terms = form_change(geometry, x, mu, start, sign, forced).gap()
    scale = abs(N).T @ terms @ abs(N)
    return in_round_offs((N.T @ gap.value @ N).ravel(), scale.ravel())


def _null_space(numbers: Arithmetic, matrix: Matrix) -> Matrix:
    """Return a basis of {v: matrix v = 0}, where matrix = (A 0; B C) and v = (b, δ).

    The columns that elimination solves for are chosen in doubles, equally many of A and of C, which
    have different units.
    """
    from scipy.linalg import qr

    solved: list[int] = []
    count, size = matrix.shape
    rows, columns = count // 2, size // 2
    for part in (matrix[:rows, :columns], matrix[rows:, columns:]):
        natural = np.asarray(part / max(abs(part).ravel()), dtype=float)
        order = qr(natural, mode="r", pivoting=True)[1]
        solved += [len(solved) // rows * columns + i for i in order[:rows].tolist()]
    free = [i for i in range(size) if i not in solved]
    basis = numbers.zeros(size, size - count)
    basis[solved] = -numbers.solve(matrix[:, solved], matrix[:, free])
    basis[free] = numbers.identity(size - count)
    return basis


@lru_cache(maxsize=64)
def _parts(s: SceneSymbols, numbers: Arithmetic) -> Function:
    """Return a function of (x, ξ): A, ∂(Aξ − a)/∂x, ∂²l/∂ξ², ∂²l/∂ξ∂x and ρ̂."""
    A, g, h = constraint_matrix(s, s.x), s.groupoid, s.h
    turning = jacobian(A * s.u - constraint_shift(s, s.x), s.x)
    parts = [A, turning, mass_matrix(s), jacobian(momentum(s), s.x), g.rho(s.x, h) / h]
    return numeric({"x": s.x, "u": s.u, "q": s.q}, parts, numbers)
