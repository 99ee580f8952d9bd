"""Solitons of Toda's chain after ten thousand crossings, and the chain's integrals against N.

A hundred solitons go right, a hundred left; each is to cross each of the others' direction, and be
where the closed form's shifts leave it. How far they are off has the order of the rule.

    python examples/toda_solitons.py             # a minute
"""

from __future__ import annotations

import numpy as np

from discmech import Lattice, Scheme, pair, trapezoidal
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.rules import gauss
from discmech.reference.closed_forms.lattice_waves import (
    toda_places,
    toda_shift,
    toda_solitons,
    toda_traces,
)

APART = 30  # sites between two solitons, where they feel each other by 1e-11


def trains(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """κ and the place at first of `count` solitons to each side, faster ones ahead; and all sites.

    (2·count,), (2·count,) and (N,): room for all that they will do.
    """
    kappa = np.linspace(0.9, 1.1, count)
    place = APART * np.arange(1.0, count + 1)
    sites = np.arange(-1.6 * APART * count - 100, 3.6 * APART * count + 200)
    places = np.r_[place, (2 * count + 2) * APART - place]
    return np.r_[kappa, -kappa], places, sites


def crossed(count: int, rule, step: float) -> float:
    """By how many sites the worst of 2·count solitons is off after count² crossings."""
    kappa, places, sites = trains(count)
    x, v = np.zeros((2, len(sites)))
    for k, at in zip(kappa, places, strict=True):
        near = abs(sites - at) < 20 / abs(k)
        alone = toda_places(toda_solitons(np.arange(-30.0, 31), 0, [k], [0])[0], [k], [30.0])[0]
        one = toda_solitons(sites[near] - at + alone - 30, 0, [k], [0])
        x[near] += one[0]
        v[near] += one[1]
        x[(sites < at) & ~near] += one[0][0]  # a soliton is a chain compressed by 2|κ|
    speed = np.sinh(kappa) / abs(kappa)
    slowest = abs(speed).min()
    T = step * np.ceil(((2 * count + 2) * APART / (2 * slowest) + 2 * APART) / step)
    steps = round(T / step)
    run = Scheme(systems.toda(x, v), rule).flow(step).trajectory(steps, steps)
    right, left = np.arange(count), np.arange(count, 2 * count)
    shifts = [np.sign(kappa[i]) * toda_shift(kappa[i], kappa[left if i < count else right]).sum()
              for i in range(2 * count)]  # fmt: skip
    wanted = places + speed * T + shifts - sites[0]
    found = toda_places(run.x[-1, :, 0], kappa, wanted)
    return float(abs(found - wanted).max())


def integrals(sites: int, rule, step: float, steps: int = 20_000, most: int = 8) -> np.ndarray:
    """The most by which tr Lᵐ of a ring changes, over tr |L|ᵐ at first, m = 1 … most; (most,)."""
    random = np.random.default_rng(0)
    x0, v0 = random.normal(size=(2, sites, 1)) / 2
    ring = Lattice("toda-ring", pair(1), sites, {}, lambda x, v, p: v[0] ** 2 / 2,
                   systems.toda().on_bond, "ring", x0, v0 - v0.mean())  # fmt: skip
    run = Scheme(ring, rule).flow(step).trajectory(steps, steps // 50)
    rows = np.array([toda_traces(x[:, 0], p[:, 0], most)
                     for x, p in zip(run.x, run.mu, strict=True)])  # fmt: skip
    sizes = toda_traces(run.x[0, :, 0], abs(run.mu[0, :, 0]), most)
    return abs(rows - rows[0]).max(axis=0) / sizes


def main(count: int = 100) -> dict[str, dict[float, float]]:
    """Print, and give back, the errors of places after count² crossings by rule and step."""
    found: dict[str, dict[float, float]] = {}
    for rule, steps in ((trapezoidal, (0.1, 0.05)), (gauss(2), (0.4, 0.2))):
        for step in steps:
            off = crossed(count, rule, step)
            found.setdefault(rule.name, {})[step] = off
            print(f"{rule.name:12} h = {step:<5} {count**2} crossings: off by {off:.3g} sites")
    for sites in (32, 128, 512, 2048, 8192):
        drift = integrals(sites, trapezoidal, 0.1)
        print(f"N = {sites:<5} tr L² … tr L⁸ change by {', '.join(f'{d:.1e}' for d in drift[1:])}")
    return found


if __name__ == "__main__":
    main()
