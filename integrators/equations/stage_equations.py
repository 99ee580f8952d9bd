"""Rules with stages on Gauss nodes, as collocation in canonical coordinates of the chart.

Arrows (x, w) from x form a manifold with coordinates w, on which the Lagrangian is
Λ_x(w, ẇ) = l(z, ξ) with z = b(x, w; 1) and ẇ = L(x, w) ξ. With π = ∂Λ/∂ẇ, that is μ_z = Lᵀπ at z,

    ẇ = L ξ,   π̇ = F − ∂_w(π·L ξ),   F = L⁻ᵀ (ρ̂(z)ᵀ ∂l/∂x + force)(z, ξ),   ∂l/∂ξ (z, ξ) = μ_z,

for ∂z/∂w = ρ̂(z) L⁻¹ (e← moves the end of an arrow by ρ). A Galerkin rule with a polynomial of
degree s on s Gauss nodes is the Gauss collocation of this field (Marsden, West 2001, 2.6): it is
stationary in the stages, π at the nodes being π₀ + h Σ a_ij π̇_j. It ends in F⁺ = L₁ᵀ π₁.

But π₀ is not μ. The momentum at the start is the derivative of L_d along e→, which moves x and
with it the chart that the polynomial is written in. e→ keeps z and ξ where it moves w by R(x, w) a,
so that

    F⁻/h = μ = R₁ᵀ π₁ − h Σ b_i f_i,    f = ρ̂(x)ᵀ ∂Λ/∂x = Rᵀ F − ρ̂(x)ᵀ ∂_x(π·L ξ)

f is the rate of the momentum Rᵀπ along e→, and π₀ − μ the error of the quadrature of it: 0 on pairs
(R = 1, f = π̇), of order h^(2s+1) elsewhere. With π₀ = μ the map would not be symplectic.

On s Lobatto nodes the polynomial has the degree s − 1, so the velocities at the nodes are those of
one of degree s − 2. Where μ = M ẋ, that is the pair of methods IIIA for x and IIIB for μ, whose
stages of μ are such a polynomial of themselves (Hairer, Lubich, Wanner, VI.6.2): a_ij for x, and
b_j (1 − a_ji/b_i) for μ. Elsewhere it is not, and Newton's method does all.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache, partial

from ..compiler import StageSource, StageSystem
from ..numbers import Graph, Node, Scope, sympy
from ..numbers.types import Column, Expression, SymbolicMatrix
from ..rules import Nodes
from .step_equations import StepEquations
from .symbols import SceneSymbols, vector
from .terms import difference, placed


def no_stages(equations: StepEquations, nodes: Nodes, alone: bool = True) -> str:
    """Return why a step of a rule on these nodes is no collocation; "" if it is one.

    alone: False if something else acts, so that linear equations do not matter.
    """
    s = equations.s
    if equations.mark or s.given is not None:
        return "the discrete equations are not those of the rule"
    if s.degenerate:
        return "the Lagrangian is linear in the velocity"
    if s.clocked:
        return "the time is one of the coordinates"
    graph = Graph()
    x, u = map(graph.letters, (s.x, s.u))
    (slope,) = Scope(graph).jacobian([graph.read(s.lagrangian)], [*x, *u])
    momenta = slope[len(x) :]
    if _curved(momenta, u):
        return "the Lagrangian is not quadratic in the velocity"
    if alone and s.groupoid.left_is_identity and not _curved(slope, [*x, *u]):
        return "the equations are linear, and one correction solves them"
    still = s.groupoid.canonical and not graph.symbols(momenta) & {*s.x}
    if nodes.family == "lobatto" and not still:
        return "on Lobatto nodes it is collocation where μ is a constant matrix times ẋ alone"
    return ""


def _curved(entries: list[Node], by: list[Node]) -> bool:
    """True if ∂(entries)/∂(letters) contains one of the letters."""
    graph, letters = by[0].graph, {e.args for e in by}
    rows = (Scope(graph).jacobian([e], by)[0] for e in entries)
    return any(graph.symbols(row) & letters for row in rows)


OURS = __name__.split(".")[:1]  # the package's name, for any import path


@lru_cache(maxsize=256)
def stage_source(s: SceneSymbols, nodes: Nodes) -> StageSource:
    """Return the collocation of a scene's Lagrangian, by stages on these nodes, derived on first
    use.

    It is identified by the Lagrangian, the force and the groupoid's maps: the rest is our own text.
    A user's function may have other derivatives later; with one it is identified by itself.
    """
    maps = _Maps.of(s)
    key = (s.name, *(getattr(s, letters) for letters in ("q", "x", "u")), s.lagrangian, s.force)
    derived = cache(partial(_derived, s, nodes, maps))
    holding = (s.lagrangian, *s.force, *maps.L, *maps.target)
    functions = {type(f).__module__ for f in sympy.Tuple(*holding).atoms(sympy.Function)}
    if {str(module).partition(".")[0] for module in functions} <= {"sympy", *OURS}:
        return StageSource(s.name, nodes, (*key, maps), derived)
    return StageSource(s.name, nodes, (derived(),), derived)


@dataclass(frozen=True)
class _Maps:
    """The groupoid's maps at (x, w) for the step 1: ẇ = L ξ, μ = R₁ᵀ π₁ − …, z, ρ̂(z), x′ − x."""

    L: SymbolicMatrix
    R: SymbolicMatrix
    back: SymbolicMatrix
    target: Column
    anchor: SymbolicMatrix
    increment: Column
    extents: tuple[tuple[str, Expression], ...]

    @classmethod
    def of(cls, s: SceneSymbols) -> _Maps:
        g, one, w, z = s.groupoid, sympy.Integer(1), *_places(s)
        return cls(
            g.L(s.x, w, one), g.R(s.x, w, one), g.inverse_left(s.x, w, one),
            g.target(s.x, w, one), g.rho(z, one), g.increment(s.x, w, one),
            tuple(g.extents(s.x, w, one)),
        )  # fmt: skip


def _places(s: SceneSymbols) -> tuple[Column, Column]:
    """Return letters of w and z."""
    return vector("ww0", len(s.u)), vector("zz0", len(s.x))


def _derived(s: SceneSymbols, nodes: Nodes, maps: _Maps) -> StageSystem:
    """Return the field and the ends of a step."""
    m, graph = len(s.u), Graph()
    scope = Scope(graph)
    names = dict(p="pp0", xi="xi0", m="mm0", dp="dp0", turn="tu0")
    letters = {name: tuple(vector(letter, m)) for name, letter in names.items()}
    w, z = map(tuple, _places(s))
    p, xi, mu = (graph.letters(letters[name]) for name in ("p", "xi", "m"))
    L, R, back = map(graph.matrix, (maps.L, maps.R, maps.back))
    target = graph.column(maps.target)
    at = scope.group(z, target, named=False)
    _, (of_x, of_xi), acting = placed(graph, s, at, xi)
    momentum = [graph.hold(e) for e in graph.transposed(L, p)]
    still = graph.rebuilt(of_xi, {e.index: graph.number(0) for e in xi})
    force = graph.transposed(graph.matrix(maps.anchor), of_x, m)
    if s.forced:
        force = graph.plus(force, acting)
    F = graph.transposed(back, [graph.hold(e) for e in force])
    moved = graph.times(L, xi)
    of_w, of_base = (graph.transposed(scope.jacobian(moved, graph.letters(by)), p, len(by))
                     for by in (w, s.x))  # fmt: skip
    rho = graph.matrix(s.groupoid.rho(s.x, sympy.Integer(1)))
    along = None if s.groupoid.left_is_identity else moved
    return StageSystem(
        name=s.name, nodes=nodes, q=tuple(s.q), x=tuple(s.x), w=w, **letters,
        target=target, momentum=momentum, mass=scope.jacobian(of_xi, xi),
        right=graph.minus(momentum, still),
        rates=(moved, graph.minus(F, of_w)),
        turned=graph.minus(graph.transposed(R, F), graph.transposed(rho, of_base, m)),
        moved=along, pulled=None if along is None else graph.transposed(back, mu), right_field=R,
        gain=graph.transposed(difference(graph, L, R), p), increment=graph.column(maps.increment),
        extents=tuple((kind, graph.read(e)) for kind, e in maps.extents),
    )  # fmt: skip
