"""The Pythagorean problem of three bodies to T = 63 by reversible steps, with its time.

Run `python examples/pythagorean.py`. Beside it stand heyoka and IAS15 of rebound, if they are
installed, and what is published of IRKGL16: 3.7 ms (Antoñana, Makazaga, Murua, on their machine).
The bodies meet at 4·10⁻⁴ of their distances, so equal steps would have to be as small as the least.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from discmech import Scheme, scenes, vary
from discmech.integrators.rules import get

T = 63
PUBLISHED = 3.7  # ms, of IRKGL16
SCENE = scenes.get("pythagorean")
MASSES = np.array([3.0, 4.0, 5.0])


def energy(x: Any, mu: Any) -> Any:
    """Return H of rows (r, 6)."""
    x, mu = (part.reshape(-1, 3, 2) for part in (x, mu))
    found = (mu**2 / (2 * MASSES[:, None])).sum(axis=(1, 2))
    for i, j in ((0, 1), (0, 2), (1, 2)):
        found -= MASSES[i] * MASSES[j] / np.sqrt(((x[:, i] - x[:, j]) ** 2).sum(axis=1))
    return found


def best(call: Any, times: int = 7) -> float:
    """Return the shortest time of some calls, in ms."""
    found = []
    for _ in range(times):
        begun = time.perf_counter()
        call()
        found.append(1e3 * (time.perf_counter() - begun))
    return min(found)


def reversible(rule: str = "kahan-li-8:trapezoidal", step: str = "1/128") -> dict[str, Any]:
    """Return {steps, ms, end, largest}: relative energy errors at the end, and of all steps."""
    flow = Scheme(SCENE, vary(get(rule))).flow(step)
    run = flow.until(T)
    H = energy(run.x, run.mu)
    off = abs(H / H[0] - 1)
    ms = best(lambda: flow.trajectory(run.steps, run.steps))
    return {"steps": run.steps, "ms": ms, "end": float(off[-1]), "largest": float(off.max())}


def peers() -> dict[str, dict[str, Any]]:
    """Return the same of heyoka and of IAS15, as far as they are installed."""
    found: dict[str, dict[str, Any]] = {}
    x = np.array([float(e) for e in SCENE.x0])
    try:
        import heyoka

        v = heyoka.make_vars(*(f"{e}{i}" for e in "xv" for i in range(6)))
        place, speed = v[:6], v[6:]
        pull = [heyoka.expression(0.0)] * 6
        for i, j in ((0, 1), (0, 2), (1, 2)):
            way = [place[2 * j + k] - place[2 * i + k] for k in range(2)]
            cube = (way[0] * way[0] + way[1] * way[1]) ** -1.5
            for k in range(2):
                pull[2 * i + k] = pull[2 * i + k] + MASSES[j] * way[k] * cube
                pull[2 * j + k] = pull[2 * j + k] - MASSES[i] * way[k] * cube
        system = [*zip(place, speed, strict=True), *zip(speed, pull, strict=True)]
        begin = [*x, *[0.0] * 6]
        ta = heyoka.taylor_adaptive(system, begin)

        def taylor() -> None:
            ta.time, ta.state[:] = 0.0, begin
            ta.propagate_until(float(T))

        ms = best(taylor)
        mu = np.repeat(MASSES, 2) * ta.state[6:]
        H = energy(np.array([x, ta.state[:6]]), np.array([0 * mu, mu]))
        found["heyoka"] = {"ms": ms, "end": float(abs(H[1] / H[0] - 1))}
    except ImportError:
        pass
    try:
        import rebound

        start = rebound.Simulation()
        start.integrator = "ias15"
        for m, at in zip(MASSES, x.reshape(3, 2), strict=True):
            start.add(m=m, x=at[0], y=at[1])
        ends = []

        def radau() -> None:
            simulation = start.copy()
            simulation.integrate(float(T))
            ends.append(simulation.energy())

        ms = best(radau)
        found["IAS15"] = {"ms": ms, "end": abs(ends[-1] / start.energy() - 1)}
    except ImportError:
        pass
    return found


if __name__ == "__main__":
    ours = reversible()
    print(f"reversible Kahan-Li 8: {ours['ms']:.1f} ms, {ours['steps']} steps, energy error "
          f"{ours['end']:.1e} at the end, {ours['largest']:.1e} at most")  # fmt: skip
    print(f"IRKGL16, published: {PUBLISHED} ms")
    others = peers()
    for name, told in others.items():
        print(f"{name}: {told['ms']:.1f} ms, energy error {told['end']:.1e} at the end")
    for name in {"heyoka", "IAS15"} - {*others}:
        print(f"{name}: not installed")
