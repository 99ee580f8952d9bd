"""pyAT: a quadrupole as the harmonic oscillator, one element of the length h for each step.

Lengths are in units of 16 m, since pyAT takes what is 1 m off the axis for lost.
"""

from __future__ import annotations

from typing import Any

import at
import numpy as np


def run(method: str, q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h along the axis, in the plane y = 0."""
    strength = system.parameters.stiffness
    magnet = at.Multipole("magnet", h, [0, 0], [0, strength], NumIntSteps=1, PassMethod=method)
    z, rows = np.zeros((6, 1), order="F"), [(q, p)]
    z[0], z[1] = q / 16, p / 16
    for _ in range(steps // every):
        z = at.lattice_track([magnet], z, nturns=every)[0][:, :, 0, -1].copy(order="F")
        rows.append((z[0] * 16, z[1] * 16))
    return tuple(np.array(part) for part in zip(*rows, strict=True))
