"""The flying spaghetti: a beam of a thousand rigid bodies on SE(3), a hundred thousand steps.

Its energy stays in a band, its momenta change by round-off, and an element costs under a
microsecond a step.

    python examples/flying_spaghetti.py          # two minutes
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from discmech import Scheme, trapezoidal
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.studies.momentum.limits import LIMITS
from discmech.studies.systems.following import Momentum
from discmech.studies.systems.quantities import energies, of_symmetries


def main(elements: int = 1000, steps: int = 100_000) -> dict[str, Any]:
    """Print and give back {"microseconds", "bands", "rolled", momenta: drift over limit}.

    bands: (lowest, highest) error of the energy, over H, in each fifth of the run; rolled: by how
    many radians the beam turns from end to end at most. The step is half of what a wave of stretch
    takes from site to site.
    """
    lattice = systems.spaghetti(elements + 1)
    step = 1 / (20 * elements)
    scheme = Scheme(lattice, trapezoidal)
    flow = scheme.flow(step)
    flow.trajectory(1)  # compiled before the clock runs
    begun = time.process_time()
    run = flow.trajectory(steps, steps // 200)
    seconds = time.process_time() - begun
    H, _ = energies(scheme, run)
    errors = H / H[0] - 1
    R = run.x.reshape(len(run.t), -1, 4, 4)[:, :, :3, :3]
    cosines = (np.einsum("taij,taij->ta", R[:, 1:], R[:, :-1]) - 1) / 2
    found: dict[str, Any] = {
        "microseconds": seconds / steps / elements * 1e6,
        "bands": [(float(part.min()), float(part.max())) for part in np.array_split(errors, 5)],
        "rolled": float(np.arccos(np.clip(cosines, -1, 1)).sum(axis=1).max()),
    }
    print(f"{elements} elements, {steps} steps to t = {run.t[-1]:g}")
    print(f"{found['microseconds']:.2f} µs an element and step")
    bands = ", ".join(f"{low:.1e} to {high:.1e}" for low, high in found["bands"])
    print(f"energy error, in fifths of the run: {bands}")
    print(f"it rolls up by {found['rolled']:.1f} radians")
    for name, part in of_symmetries(lattice).items():
        total = Momentum(lattice.sites)
        total.add(scheme, part, run, list(range(0, len(run.t), 40)))
        a_step, a_value = total.units  # what round-off does, as `discmech momentum` allows it
        limit = 2.0**-53 * (LIMITS["walk"] * np.sqrt(steps / 3) * a_step + 2 * a_value)
        drift = total.drifts.max()
        found[name] = drift / limit
        print(f"{name}: drift {drift:.1e} of its terms, round-off may leave {limit:.1e}")
    return found


if __name__ == "__main__":
    main()
