"""An integrator as a function of numbers: numpy only, and judged by what it claims.

    discmech verify FILE --scene pendulum --scene kepler
    discmech order kepler --rule FILE:NAME

q (n,) and p (m,) are arrays; system gives the scene in numbers: f, H, gradient, velocity, force,
momentum, parameters, t. Give new arrays, and leave the arguments as they are.
"""

from discmech import black_box


@black_box(order=2, symplectic=True, reversible=True)  # what you claim is judged, all else measured
def starter(q, p, h, system):
    p = p - h / 2 * system.gradient(q, p)
    q = q + h * system.velocity(q, p)
    return q, p - h / 2 * system.gradient(q, p)
