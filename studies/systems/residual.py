"""Compare the step that runs with its equations: sums of the maps of sites and of bonds.

F⁻(x, u) = hμ at the u of a run, and at its end x′ = b(x, u) and hμ′ = F⁺(x, u), each a sum over a
site and its bonds, in `running_error` numbers. The kernels add other forces (kicks, and the gain
F⁺ − F⁻), in another order: so the run itself is measured, and not only its formulas.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators.extensions.lattices import LatticeRun
from discmech.integrators.extensions.lattices.lattice_run import segments_of
from discmech.integrators.numbers import Double, numeric_text, rounded, with_running_errors

from .joints import Joints, Sums

MOST_SITES = 1_000  # a site takes a tenth of a millisecond
NAMES = ("minus", "plus", "stages", "target")


def step_defects(flow: Any, x: np.ndarray, mu: np.ndarray, t: float = 0) -> dict[str, float]:
    """Return {"residual"}, the largest defect of a step from (x, μ) at t over its bound, ε if it is
    one.

    With constraints on bonds also {"constraint", "hidden"}, φ and A ξ at the step's end. Of a large
    lattice some sites are used, with all their bonds (`_asked`).

    The bounds are of first order: every operation rounds, as do the terms of a sum, and unknowns
    are off by a round-off of the largest of a site, u also of x/h, where the solver stops.
    Velocities, multipliers and impulses have different units, so each has its own largest value.
    Of a composition they are the largest of its substeps. Raises `StepFailure` without a step.
    """
    worst: dict[str, float] = {}
    for part in flow.parts:
        run = LatticeRun.from_row(part, x, mu, t)
        defects = _defects(run, x, t)
        worst = {name: np.maximum(value, worst.get(name, 0.0)) for name, value in defects.items()}
        x, mu, t = run.x, run.mu, t + float(part.step)
    return {name: float(value) for name, value in worst.items()}


def _defects(run: LatticeRun, x: np.ndarray, t: float) -> dict[str, float]:
    """Return the defects of the next step of a run that stands at x; it makes that step."""
    flow, scheme, h, m = run.flow, run.flow.scheme, float(run.flow.step), run.mu.shape[1]
    # with constraints a row has the projected μ, and the run continues with the earlier one
    momenta = "nu" if scheme.constraints else "mu"
    before, w = getattr(run, momenta).copy(), run.stepped()
    after = getattr(run, momenta)
    asked, moving = _asked(flow.lattice), w[:, :m] if scheme.constraints else w
    size = _largest(moving) + _largest(x) / abs(h)
    sums = _summed(flow, x, moving, h, size, asked, t)
    minus, bound = sums["minus"]
    moved = sums["target"][1] + abs(x) + abs(run.x)
    defects, gaps = {}, [(sums["target"][0] - run.x, moved), sums["stages"]]
    if scheme.constraints:
        joints, (v, impulses) = Joints(scheme, asked), run.projected
        multipliers = w[flow.lattice.pairs[:, 1], m:]
        pull, of_pull = joints.forces((x, 0 * x), multipliers, _largest(multipliers))
        minus, bound = minus - h * pull, bound + abs(h) * of_pull
        push, of_push = joints.forces((run.x, moved), impulses, _largest(impulses))
        gaps.append((run.mu - after - push, of_push + abs(run.mu) + abs(after)))
        misses = joints.missed((run.x, moved), v, _largest(v))
        defects = dict(zip(("constraint", "hidden"), misses, strict=True))
    # μ′ is μ plus a step's gain, so an error of F⁻ is one of F⁺ too
    bound = bound + abs(h * before)
    gaps += [(minus - h * before, bound),
             (sums["plus"][0] - h * after, sums["plus"][1] + bound + abs(h * after))]  # fmt: skip
    worst = [0.0]
    for gap, allowed in gaps:
        gap, allowed = abs(gap)[asked], allowed[asked]
        with np.errstate(divide="ignore", invalid="ignore"):
            worst.append(np.max(np.where(gap == 0, 0, gap / allowed), initial=0))
    return {"residual": float(np.max(worst)), **defects}


def _largest(rows: np.ndarray) -> float:
    """Return the largest sum of a row's absolute numbers."""
    return float(np.max(abs(rows).sum(axis=1)))


def _asked(lattice: Any) -> np.ndarray:
    """Return which moving sites are used, (N,): all, or a selection of many.

    Of many they are those where runs of bonds begin and end, which kernels treat by themselves, and
    others at random, MOST_SITES of each kind.
    """
    asked = lattice.free.copy()
    if lattice.sites <= MOST_SITES:
        return asked
    random = np.random.default_rng(0)
    segments = segments_of(lattice.pairs)[1]
    ends = np.unique(np.concatenate([segments[:, :2], segments[:, :2] + segments[:, 2:3] - 1]))
    some = [random.choice(sites, min(MOST_SITES, len(sites)), replace=False)
            for sites in (ends, np.flatnonzero(asked))]  # fmt: skip
    chosen = np.zeros_like(asked)
    chosen[np.concatenate(some)] = True
    return asked & chosen


def _summed(
    flow: Any, x: np.ndarray, w: np.ndarray, h: float, size: float, asked: np.ndarray, t: float
) -> dict[str, Sums]:
    """Return for each of NAMES the sums over sites and bonds, of values, errors and absolute terms.

    size: round-offs of w; asked: the sites that are used.
    """
    lattice, scheme, m = flow.lattice, flow.scheme, flow.lattice.groupoid.dim_u
    pairs = lattice.pairs
    # a bond's letters: u of both ends, then each stage of both
    both = w[pairs].reshape(len(pairs), 2, -1, m).swapaxes(1, 2).reshape(len(pairs), -1)
    ends = x[pairs].reshape(len(pairs), -1)
    widths = {"minus": m, "plus": m, "stages": w.shape[1] - m, "target": x.shape[1]}
    sums = {name: (np.zeros((len(x), k)), np.zeros((len(x), k))) for name, k in widths.items()}
    at = (scheme.equations.site, x, w), (scheme.equations.bond, ends, both)
    for (_, p, sites), (equations, places, unknowns) in zip(scheme.terms_at(t), at, strict=True):
        digits, f = _maps(equations)
        q = np.stack([np.broadcast_to(e, len(places)) for e in (h, *p, *digits)])
        for k in np.flatnonzero(asked[sites].any(axis=1)):
            place, unknown, numbers, at_ends = places[k], unknowns[k], q[:, k], sites[k]
            parts = f(place, rounded(unknown, size), rounded(numbers))
            for name, part in zip(NAMES, parts, strict=True):
                if name == "target" and sites is pairs:
                    continue  # x of both ends moves by itself
                block = np.array([part.value, part.error + abs(part.value)])
                if name == "stages":
                    block = block.reshape(2, -1, len(at_ends), m).swapaxes(1, 2)
                for total, rows in zip(sums[name], block, strict=True):
                    total[at_ends] += rows.reshape(len(at_ends), -1)
    return sums


@lru_cache(maxsize=32)
def _maps(equations: Any) -> tuple[list[float], Any]:
    """Return the numbers of the rule, and F⁻, F⁺, ∂L_d/∂s, b with errors."""
    maps, s = equations.discrete, equations.s
    made = [maps.minus, maps.plus, maps.stage_equations, maps.target[: s.n, :]]
    time = s.x[s.n :]  # behind the parameters, as in `LatticeScheme.terms_at`
    letters = {"x": s.position, "w": equations.w,
               "q": [s.h, *s.parameter_list, *time, *s.constants]}  # fmt: skip
    text = numeric_text(letters, [list(e) for e in made], graph=maps.of.graph)
    digits = [float(of(20)) for of in s.constants.values()]
    return digits, with_running_errors(text, Double())
