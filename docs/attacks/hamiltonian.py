"""Scenes by their Hamiltonians, sound and unsound methods: the second table of verdicts.md."""

import sympy

from discmech import (
    Conserved,
    Scene,
    action,
    black_box,
    discrete_hamiltonian,
    one_step,
    pair,
    so,
)

kepler = Scene(
    name="kepler-by-h", groupoid=pair(2), x0=["0.4", 0], mu0=[0, 2], duration=10, step="0.01",
    hamiltonian=lambda x, mu, p: mu.dot(mu) / 2 - 1 / sympy.sqrt(x.dot(x)),
    symmetries=[Conserved("L", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0])],
)  # fmt: skip
#: no Lagrangian in closed form: one-step maps and boxes alone
swift = Scene(
    name="swift", groupoid=pair(1), x0=[1], mu0=["1/2"], duration=10, step="1/50",
    hamiltonian=lambda x, mu, p: sympy.sqrt(1 + mu[0] ** 2) + x[0] ** 2 / 2,
)  # fmt: skip
#: linear in μ, so that ∂²H/∂μ² is singular
linear = Scene(
    name="linear", groupoid=pair(2), x0=[1, "1/3"], mu0=["1/2", "1/5"], duration=5, step="1/50",
    hamiltonian=lambda x, mu, p: x[1] * mu[0] - sympy.sin(x[0]) * mu[1],
)  # fmt: skip
top = Scene(
    name="top-by-h", groupoid=action(so(3)), x0=["3/5", 0, "4/5"], mu0=[1, "1/2", 2], duration=5,
    hamiltonian=lambda x, mu, p: mu[0] ** 2 / 2 + mu[1] ** 2 / 3 + mu[2] ** 2 / 4 + x[2],
    symmetries=[Conserved("|x|²", lambda x, mu, p: x.dot(x), "Casimir", value=1),
                Conserved("x·μ", lambda x, mu, p: x.dot(mu))],
)  # fmt: skip


@one_step(order=2, implicit=True)
def slow_half(s, z, Z, h):
    """The implicit midpoint of a field whose forces are too small by a millionth."""
    x, mu = s.split(s.f((z + Z) / 2))
    return Z - z - h * s.join(x, mu * (1 - sympy.Rational(1, 10**6)))


@discrete_hamiltonian(order=1)
def too_fast(H, x, mu, h):
    """Symplectic, and a millionth too fast."""
    return mu.dot(x) + h * H(x, mu) * (1 + sympy.Rational(1, 10**6))


@discrete_hamiltonian(order=2, stages=1)
def verlet(H, x, mu, h, s):
    """Störmer and Verlet's method by its generating function of type II."""
    ((end, half),) = s
    return mu.dot(end) - half.dot(end - x) + h * (H(x, half) + H(end, half)) / 2


@black_box(order=2, symplectic=True)
def euler(q, p, h, system):
    """Said to be of order 2 and symplectic, and explicit Euler."""
    slope, speed = system.gradient(q, p), system.velocity(q, p)
    return q + h * speed, p - h * slope
