"""Lagrangians linear in the velocity, sound and unsound methods: second table of verdicts.md."""

import sympy

from discmech import Scene, black_box, one_step, pair

#: predators and prey, by a one-form of which half vanishes
prey = Scene(
    name="prey", groupoid=pair(2), x0=[1, "3/2"], duration=5, step="1/10",
    one_form=lambda x, p: [sympy.log(x[1]) / x[0], 0],
    hamiltonian=lambda x, p: sympy.log(x[0]) + 2 * sympy.log(x[1]) - x[0] - x[1],
)  # fmt: skip
#: ẏ = −1/y, which ends at t = 1/2, where dϑ is singular
ending = Scene(
    name="ending", groupoid=pair(2), x0=[1, 1], duration=2, step="1/100",
    one_form=lambda x, p: [x[1] ** 2 / 2, 0], hamiltonian=lambda x, p: x[0] + x[1],
)  # fmt: skip
#: dϑ = 0: a gradient is no form
gradient = prey.with_values(name="gradient", one_form=lambda x, p: [x[1], x[0]])


@one_step(order=2, implicit=True, symplectic=True)
def claimed(s, z, Z, h):
    """The midpoint rule of the vector field, which keeps no dϑ but a constant one."""
    return Z - z - h * s.f((z + Z) / 2)


@one_step(order=2, stages=3, one_form="any", symplectic=True)
def half_projected(s, z, h, K):
    """The projected midpoint rule without the λ after the step: claimed symplectic, and is not."""
    stage, multiplier, end = K
    lam, new = multiplier - s.f(z), z + h * end
    before = s.dtheta(z).T * lam
    at = z + h * (lam + stage / 2)
    slope = s.dtheta(at).T * stage - s.dH(at)
    kept = (s.theta(new) - s.theta(z)) / h - before - slope - s.dtheta(new).T * lam / 2
    middle = (s.theta(at) - s.theta(z)) / h - before - slope / 2
    return new, [middle, kept, end - lam - stage - lam / 2]


@black_box(order=4)
def runge_kutta(q, p, h, system):
    """On x alone; the momentum is ϑ(x) again."""

    def f(x):
        return system.f(x, p)[0]

    a = f(q)
    b = f(q + h / 2 * a)
    c = f(q + h / 2 * b)
    q = q + h / 6 * (a + 2 * b + 2 * c + f(q + h * c))
    return q, system.momentum(q, 0 * q)
