"""Discrete Hamiltonians of type II and III as rules: generating functions of a step on T*Q.

    type II    H_d⁺(x, μ′):   μ = ∂H_d⁺/∂x,      x′ = ∂H_d⁺/∂μ′
    type III   H_d⁻(x′, μ):   x = −∂H_d⁻/∂μ,     μ′ = −∂H_d⁻/∂x′

(Leok, Zhang, IMA J. Numer. Anal. 31 (2011), 1497; Lall, West, J. Phys. A 39 (2006), 5509). With
internal stages H_d is the stationary value in these, as of a Galerkin method. Whatever the formula
is, the step is symplectic; of the exact H_d it would be the motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import wraps

from ..errors import BadInput, arguments_checked, shown
from ..numbers import jacobian, sympy
from ..numbers.types import Column, Expression, Function, Letter
from .discretisation import checked, described
from .one_step import DualSystem, OneStepMap, Staged


class Asked:
    """H in the form that a formula gets: each value is a letter, and the states are recorded."""

    def __init__(self, n: int) -> None:
        self.n = n
        self.values: list[Letter] = []
        self.states: list[Column] = []

    def __call__(self, x: Column | Expression, mu: Column | Expression) -> Letter:
        state = [e for part in (x, mu) for e in (part if hasattr(part, "__len__") else [part])]
        if len(state) != 2 * self.n:
            raise BadInput(
                f"H is asked at {len(state)} numbers: give x and mu, {self.n} numbers each."
            )
        self.states.append(sympy.Matrix(2 * self.n, 1, state))
        self.values.append(sympy.Dummy("H", real=True))
        return self.values[-1]


@arguments_checked
def discrete_hamiltonian(
    order: int | None = None,
    *,
    kind: str = "II",
    stages: int = 0,
    name: str | None = None,
    source: str = "",
) -> Callable[[Function], OneStepMap]:
    """Decorator: make a one-step map of a discrete Hamiltonian (H, x, mu, h).

    The function gives H_d as an expression in x and mu, sympy columns n×1, h and values H(x, mu) of
    the scene's energy at any states. kind "II": x is that of the start and mu that of the end;
    "III": x is that of the end and mu that of the start. With stages=k it is (H, x, mu, h, s), s a
    list of k pairs (x, mu) of columns, in which H_d is stationary.

    It serves pair groupoids, scenes by their Lagrangian or their Hamiltonian. Raises `BadInput` for
    another kind, order or number of stages, and other arguments.
    """
    if kind not in ("II", "III"):
        raise BadInput(f'discrete_hamiltonian: kind={shown(kind)}; say "II" or "III".')
    checked("discrete_hamiltonian", "discrete Hamiltonian", order, stages, "pair")
    wanted = "(H, x, mu, h, s)" if stages else "(H, x, mu, h)"

    def make(function: Function) -> OneStepMap:
        label, about = described("discrete Hamiltonian", function, wanted, name, source)

        @wraps(function)
        def formula(s: DualSystem, z: Column, h: Letter, K: list[Column]) -> Staged:
            return _equations(function, kind, s, z, h, K)

        del formula.__dict__["__wrapped__"]
        return OneStepMap(label, formula, order, about, stages + 1, groupoids=("pair",))

    return make


def _equations(
    function: Function, kind: str, s: DualSystem, z: Column, h: Letter, K: list[Column]
) -> Staged:
    """Return the new state z + h K₀, and equations that vanish there and at stages z + h K_j."""
    if s.n != s.m or any(s.force(z)):
        raise BadInput("a discrete Hamiltonian knows no time and no force: take another method.")
    letters = [_letters(s.n) for _ in K]  # (x, μ) on which H_d depends, and the stages
    (x, mu), *inside = letters
    asked = Asked(s.n)
    result = function(asked, x, mu, h, *([inside] if inside else []))
    if getattr(result, "shape", None) == (1, 1):
        result = result[0, 0]
    value = None if result is None or hasattr(result, "shape") else sympy.sympify(result)
    if not isinstance(value, sympy.Expr):
        what = "a matrix" if hasattr(result, "shape") else shown(result)
        raise BadInput(f"a discrete Hamiltonian gives {what}: return one expression.")
    _check_identity(value, kind, h, letters)
    (start_x, start_mu), new = s.split(z), z + h * K[0]
    end_x, end_mu = s.split(new)
    of = (start_x, end_mu) if kind == "II" else (end_x, start_mu)
    swap = dict(zip([*x, *mu], [e for part in of for e in part], strict=True))
    for (own_x, own_mu), slope in zip(inside, K[1:], strict=True):
        swap |= dict(zip([*own_x, *own_mu], z + h * slope, strict=True))
    # dH at the recorded states, and H itself if H_d is not linear in it, or has it times a state
    slopes = [s.dH(state.xreplace(swap)) for state in asked.states]
    weights = [value.diff(e) for e in asked.values]
    if any(w.free_symbols - {h} for w in weights):
        swap |= {e: s.H(state.xreplace(swap)) for e, state in
                 zip(asked.values, asked.states, strict=True)}  # fmt: skip

    def derivative(by: Iterable[Letter]) -> Column:
        by = list(by)
        result = jacobian([value], by).T.xreplace(swap)
        for weight, state, slope in zip(weights, asked.states, slopes, strict=True):
            result += weight.xreplace(swap) * jacobian(list(state), by).T.xreplace(swap) * slope
        return result

    by_x, by_mu = derivative(x), derivative(mu)
    if kind == "II":
        rows = [end_x - by_mu, start_mu - by_x]
    else:
        rows = [start_x + by_mu, end_mu + by_x]
    residuals = [rows[0].col_join(rows[1])]
    residuals += [derivative([*own_x, *own_mu]) for own_x, own_mu in inside]
    # divided by h term by term, so that no row is small if the step is
    return new, [part.applyfunc(lambda e: _over(e, h)) for part in residuals]


def _check_identity(
    value: Expression, kind: str, h: Letter, letters: list[tuple[Column, Column]]
) -> None:
    """Raise `BadInput` where H_d is not μ·x, or −μ·x, at h = 0 and at stages of no length."""
    (x, mu), *inside = letters
    at = {h: 0} | {a: b for part in inside
                   for a, b in zip([*part[0], *part[1]], [*x, *mu], strict=True)}  # fmt: skip
    begun = sympy.expand(value.subs(at))
    wanted, words = (mu.dot(x), "mu·x") if kind == "II" else (-mu.dot(x), "−mu·x")
    if not begun.has(sympy.nan, sympy.zoo) and (begun - wanted).equals(0) is False:
        raise BadInput(
            f'a discrete Hamiltonian of kind "{kind}" is {words} at h = 0, where nothing moves; '
            f"this one is {str(begun).replace('_', '')[:80]}."
        )


def _over(e: Expression, h: Letter) -> Expression:
    return sympy.Add(*[term / h for term in sympy.Add.make_args(sympy.expand(e))])


def _letters(n: int) -> tuple[Column, Column]:
    x, mu = (sympy.Matrix([sympy.Dummy(f"{letter}_{i}", real=True) for i in range(n)])
             for letter in ("x", "mu"))  # fmt: skip
    return x, mu
