"""Kepler's problem at eccentricity 0.99 over ten thousand periods, by steps that vary.

Run `python examples/eccentric_orbit.py`. In the pericentre a body is two hundred times as fast as
in the apocentre. A step is a part of r^(3/2), and the energy keeps its band: the mean of the last
tenth of the run is that of the first.
"""

from __future__ import annotations

import sys
import time
from math import pi
from typing import Any

import numpy as np
import sympy

from discmech import Scheme, scenes, vary
from discmech.integrators.rules import get

#: e = 0.99: from the pericentre 1 − e with the speed √((1 + e)/(1 − e)), period 2π
SCENE = scenes.get("kepler").with_values(name="comet", x0=["1/100", 0], v0=[0, sympy.sqrt(199)])


def drift(way: str, periods: int, step: str = "1/16") -> dict[str, Any]:
    """Return {steps, seconds, band, shift}: of the relative energy error over the periods."""
    flow = Scheme(SCENE, vary(get("kahan-li-8:trapezoidal"), way=way)).flow(step)
    begun = time.perf_counter()
    run = flow.until(2 * pi * periods, every=7)
    seconds = time.perf_counter() - begun
    energy = (run.mu**2).sum(axis=1) / 2 - 1 / np.sqrt((run.x**2).sum(axis=1))
    error = energy / energy[0] - 1
    tenth = len(error) // 10
    shift = abs(error[-tenth:].mean() - error[:tenth].mean())
    return {"steps": run.steps, "seconds": seconds, "band": float(np.ptp(error)), "shift": shift}


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    for way in ("reversible", "poincare"):
        told = drift(way, count)
        print(f"{way}: {count} periods in {told['steps']} steps, {told['seconds']:.1f} s, band of "
              f"the energy {told['band']:.1e}, its mean moves by {told['shift']:.1e}")  # fmt: skip
