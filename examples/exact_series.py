"""The exact discrete Lagrangian of a free body as a series: order 10 without internal stages.

Its step is the action S(ξ)/h of the geodesic from e to τ(ξ), ξ = hu. By the Hamilton–Jacobi
equation S is the kinetic energy of its own momentum μ = L(ξ)ᵀ∂S/∂ξ at the end; degree by degree,

    (k − 1) S_k = −½ Σ ⟨μ_a, I⁻¹ μ_b⟩,   a + b = k, S_k itself left out,

in Cayley's chart of SO(3), where L(ξ) = 1 + ξ̂/2 + ξξᵀ/4. Any order is as short as any other.
"""

from sympy import QQ, Matrix, hessian, ring

from integrators import discretisation
from studies import check, show


def series(order):
    @discretisation(order=order, name=f"exact-series-{order}")
    def rule(L, G, x, u, h):
        inertia = hessian(L(x, u), list(u))
        _, *w = ring("w:3", QQ.frac_field(*sorted(inertia.free_symbols, key=str)))
        one = w[0].ring.domain.from_sympy
        total, S, mu = 0, sum(one(inertia[i, i] / 2) * w[i] ** 2 for i in range(3)), {}
        for k in range(2, order + 1, 2):
            if k > 2:
                pairs = [(mu[a], mu[k - a]) for a in mu if k - a in mu]
                known = [one(1 / inertia[i, i]) * sum(a[i] * b[i] for a, b in pairs) for i in range(3)]
                S = -sum(known) / (2 * (k - 1))
            total += S
            slope = [S.diff(e) for e in w]
            along = sum(e * s for e, s in zip(w, slope))
            turned = [(w[i - 1] * slope[i - 2] - w[i - 2] * slope[i - 1]) / 2 for i in range(3)]
            for d, part in enumerate((slope, turned, [e * along / 4 for e in w])):
                before = mu.get(k - 1 + d, [0, 0, 0])
                mu[k - 1 + d] = [a + b for a, b in zip(before, part)]
        return total.as_expr(*(h * u)) / h
    return rule


eight, ten, twelve = map(series, (8, 10, 12))


def main():
    return check("order", scenes=["rigid-body"], rules=[eight], digits=[50])


if __name__ == "__main__":
    show(main())
