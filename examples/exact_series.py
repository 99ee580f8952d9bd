"""The exact discrete Lagrangian of a free body, as a series: any even order without stages.

L_d(u; h) = S(hu)/h, where S(ξ) is the action of the geodesic from e to exp ξ in time 1. By the
Hamilton–Jacobi equation S(ξ) is the kinetic energy of its own momentum at the end, μ = L(ξ)ᵀ ∂S/∂ξ.
In the exponential's chart L(ξ)ᵀ = Σ B_d/d! (ad ξᵀ)^d with Bernoulli's numbers, so for the terms of
degree k

    (k − 1) S_k = −½ Σ ⟨μ_a, I⁻¹ μ_b⟩,   a + b = k, without what S_k itself adds to μ.

Written for SO(3), where ad ξᵀ v = v × ξ, and for principal axes; another Lagrangian is refused. In
Cayley's chart it is another series (and this one of order 2): use the scene below, or
--retraction exponential.
"""

from sympy import QQ, bernoulli, factorial, hessian, ring

from discmech import BadInput, check, discretisation, exponential, lie_group, scenes, show, so

body = scenes.get("rigid-body").with_values(
    name="free-body", groupoid=lie_group(so(3), exponential)
)


def series(order):
    @discretisation(order=order, name=f"exact-series-{order}")
    def rule(L, G, x, u, h):
        inertia = hessian(L(x, u), list(u)).diagonal()
        kinetic = sum(m * e**2 for m, e in zip(inertia, u, strict=True)) / 2
        if len(u) != 3 or (L(x, u) - kinetic).expand() != 0:
            raise BadInput(f"exact-series-{order} is for a free body of SO(3) in principal axes.")
        R, *xi = ring("xi:3", QQ.frac_field(*sorted(inertia.free_symbols, key=str)))
        moments = [R.domain.from_sympy(e) for e in inertia]
        S = total = sum(m * e**2 for m, e in zip(moments, xi, strict=True)) / 2
        mu = {}  # its terms by degree
        for k in range(2, order + 1, 2):
            if k > 2:
                pairs = ((mu[a], mu[k - a]) for a in mu if k - a in mu)
                known = sum(a[i] * b[i] / moments[i] for a, b in pairs for i in range(3))
                S = -known / (2 * k - 2)
                total += S
            turned = [S.diff(e) for e in xi]
            for d in range(order - k + 1):
                weight = R.domain.from_sympy(bernoulli(d, 1) / factorial(d))  # B₁ = ½
                before = mu.get(k - 1 + d, (0, 0, 0))
                mu[k - 1 + d] = [b + weight * t for b, t in zip(before, turned, strict=True)]
                turned = [turned[i - 2] * xi[i - 1] - turned[i - 1] * xi[i - 2] for i in range(3)]
        return total.as_expr(*(h * u)) / h

    return rule


eighth, tenth = series(8), series(10)


def main():
    return check("order", scenes=[body], rules=[eighth], digits=[50])


if __name__ == "__main__":
    show(main())
