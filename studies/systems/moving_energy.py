"""The energy that moves in a scene: the scale of errors of energy.

A constant in the potential changes no motion, and the terms of H that do not move do not depend on
the method; so the scale is the kinetic energy, at its largest along the motion itself. It is
computed without any run of a method that is judged.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators import Scene
from discmech.integrators.equations import SceneSymbols, energy_gradient, momentum
from discmech.integrators.errors import DiscmechError
from discmech.integrators.numbers import numeric
from discmech.integrators.scene import remembered

from .modified_energy import NUMBERS, dual_of, has_dual

PRECISE = 1e-6  # relative tolerance of the motion: a scale is not a figure
MOST = 300  # largest number of its steps
TIMES = 32  # number of times on a certified motion, if there is no plain field


@remembered(maxsize=256)
def moving_energy(scene: Scene) -> float:
    """Return half the largest Σ |(μ − μ⁰)_i ξ_i| along the motion over the scene's duration.

    μ⁰ = ∂l/∂ξ(x, 0). It is the kinetic energy if that is a sum of squares. It is 0 if nothing
    moves, or if no motion is known. On a phase space, half the largest Σ |∂H/∂xⁱ (xⁱ − x̄ⁱ)|, x̄ the
    middle of the motion, which knows neither a constant nor a gauge: the same for an oscillator.
    """
    if scene.lagrangian is None:
        return 0.0
    s = SceneSymbols(scene)
    if s.degenerate:
        return _exchanged(scene, s)
    motions = [_start(scene)] if scene.mu0 is None else []
    with suppress(DiscmechError, reference.ReferenceFailure):
        motions.append(motion(scene))
    states = [np.vstack(part) for part in zip(*motions, strict=True)] if motions else []
    if not states:
        return 0.0
    x, mu, xi = states
    still = s.u.xreplace(dict.fromkeys(s.u, 0 * s.h))
    rest = (
        0 * s.mu
        if not scene.has_lagrangian
        else momentum(s).xreplace(dict(zip(s.u, still, strict=True)))
    )
    at = numeric({"x": s.x, "p": s.parameter_list}, [list(rest)], NUMBERS, columns=True)
    with np.errstate(all="ignore"):
        parameters = [NUMBERS.number(p) for p in scene.parameter_values]
        momenta = np.asarray(at(x.T, parameters), dtype=float).reshape(len(rest), -1)
        momenta = np.broadcast_to(momenta, mu.T.shape)
        own = np.where(np.isfinite(momenta.T), momenta.T, 0.0)
        sizes = np.abs((mu - own) * xi).sum(axis=1) / 2
    sizes = sizes[np.isfinite(sizes)]
    return float(sizes.max(initial=0.0))


def _exchanged(scene: Scene, s: SceneSymbols) -> float:
    """Return half the largest Σ |∂H/∂xⁱ (xⁱ − x̄ⁱ)| along the motion, or 0 if none is known."""
    try:
        x = motion(scene)[0]
    except (DiscmechError, reference.ReferenceFailure):
        return 0.0
    letters = {"x": s.x, "p": s.parameter_list}
    slope = numeric(letters, [list(energy_gradient(s)[0])], NUMBERS, columns=True)
    parameters = [NUMBERS.number(p) for p in scene.parameter_values]
    slopes = (np.broadcast_to(e, len(x)) for e in slope(x.T, parameters))
    middle = (x.max(axis=0) + x.min(axis=0)) / 2
    return float((np.abs(np.array(list(slopes)).T * (x - middle)).sum(axis=1) / 2).max())


def _start(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (x, μ, ξ) at the start, one row each, x with its time if it has one."""
    s = SceneSymbols(scene)
    x, xi = ([float(NUMBERS.number(e)) for e in part]
             for part in (s.with_time(scene.x0, 0), scene.v0))  # fmt: skip
    at = numeric({"x": s.x, "u": s.u, "p": s.parameter_list}, [list(momentum(s))], NUMBERS)
    with NUMBERS.working():
        mu = at(x, xi, [NUMBERS.number(p) for p in scene.parameter_values])
    rows = (np.array([part], dtype=float).reshape(1, -1) for part in (x, mu, xi))
    x_row, mu_row, xi_row = rows
    return x_row, mu_row, xi_row


def motion(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (x, μ, ξ) along the motion, a row each."""
    dual = dual_of(scene)
    if dual is not None and scene.mu0 is None:
        z, _ = _followed(scene)
        return (*dual.split(z), dual.velocity(z))
    s = SceneSymbols(scene)
    times = [scene.duration * k / TIMES for k in range(TIMES + 1)]
    states = reference.solutions(scene, times, 15, proof=False)
    rows = ([s.with_time(e.x, t) for e, t in zip(states, times, strict=True)],
            [e.mu for e in states], [e.v for e in states])  # fmt: skip
    x, mu, xi = (np.array([[float(v) for v in row] for row in part]).reshape(len(times), -1)
                 for part in rows)  # fmt: skip
    return x, mu, xi


def may_end(scene: Scene) -> bool:
    """True if the rough motion stops before the scene's duration, perhaps in a singularity.

    There more energy moves than a scale should contain: errors after it look small.
    """
    if not has_dual(scene) or scene.mu0 is not None:
        return False
    try:
        return _followed(scene)[1] < float(scene.duration)
    except DiscmechError:  # no motion is known, so no scale comes from one
        return False


@remembered(maxsize=64)
def _followed(scene: Scene) -> tuple[np.ndarray, float]:
    """Return the motion's (x, μ), a row each, and the time that it reached.

    It is computed by a Runge–Kutta method of order 8, with at most `MOST` steps.
    """
    dual = dual_of(scene)
    assert dual is not None
    from scipy.integrate import DOP853

    x, mu, _ = _start(scene)
    start = np.hstack([x, mu])[0]

    def field(_: float, z: Any) -> np.ndarray:
        return np.asarray(dual(np.asarray(z)[None])[2][0])

    def largest(part: np.ndarray) -> np.ndarray:
        return np.full_like(part, np.abs(part[np.isfinite(part)]).max(initial=0.0))

    rows = [start]
    with np.errstate(all="ignore"):
        reach = np.abs(start) + float(scene.step) * np.abs(field(0.0, start))
        sizes = np.hstack([*map(largest, dual.split(reach[None]))])[0]  # x and μ share no unit
        sizes = np.where(sizes > 0, sizes, 1.0)
        run = DOP853(field, 0.0, start, float(scene.duration), rtol=PRECISE,
                     atol=PRECISE**2 * sizes)  # fmt: skip
        while run.status == "running" and len(rows) < MOST:
            run.step()
            rows.append(run.y.copy())
    z = np.array(rows)
    return z[np.isfinite(z).all(axis=1)], float(run.t)
