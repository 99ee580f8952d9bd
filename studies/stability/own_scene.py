"""A user's own scene: a step linearised at an equilibrium, and runs from its own start.

The equilibrium of (ẋ, μ̇) = f is the scene's start if that is one, so it can be given; otherwise it
is sought from there. It has to be one at which small motions oscillate (A = Df has imaginary
eigenvalues); ω is the fastest of their frequencies. There a step is a matrix M(h), whose
eigenvalues lie on the unit circle where it is stable.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators import Scene, Scheme, StepFailure
from discmech.integrators.equations import SceneSymbols, momentum
from discmech.integrators.errors import CannotMeasure, DiscmechError
from discmech.integrators.numbers import arithmetic, exact, numeric

from ..core.case import scheme_of
from ..systems.modified_energy import Dual, dual_of, has_dual
from .records import FARTHEST_OWN
from .stiff import Family

PART = 0.05  # spacing of the grid of hω
# half-width of a central difference over a coordinate's size; its error is the square, 10⁻¹¹
WIDTH = 2.0**-18
NOTHING = 1e-13  # share of a state that counts as zero: some hundred round-offs of a step
STILL = 1e-9  # share of the rates at the start, at which a state is at rest
# share of ω: real part that differences leave at a double eigenvalue, √(10⁻¹¹) and more
REAL = 1e-4
GROWS = 1e-4  # excess of an eigenvalue over 1: the same root at double eigenvalues stays below it
#: excess of an eigenvalue over 1 that enlarges a start 10³ times in far fewer steps than `STEPS`
CLEAR = 1e-3
AREA = 1e-7  # tolerance of det M = 1: some differences of 10⁻¹¹ in each of its columns
TRIES = 12  # starts from which an equilibrium is sought
# size of a start beside the equilibrium, and the number of steps of its run
SMALL, STEPS = 1e-6, 20_000
BEYOND = 1.002, 1.01, 1.02, 1.05  # factors of an end, for runs that have to grow
MOST = 40  # the largest number of Newton's corrections, and of halvings of each


@dataclass(frozen=True)
class Equilibrium:
    """A state of rest z = (x, μ) at which small motions oscillate, the fastest with `frequency`.

    given: True if it is the scene's own start. turns: True of a relative equilibrium, at which the
    body turns steadily.
    """

    z: np.ndarray
    frequency: float
    given: bool
    turns: bool


class Near:
    """States near a given one, by coordinates (w, δμ): x moves along the groupoid, within its
    orbit.

    Of a degenerate Lagrangian the states are those with μ = ϑ(x), by w alone; free: with any μ, as
    a rule with a discrete Lagrangian has them.
    """

    def __init__(self, scene: Scene, dual: Dual, free: bool = False) -> None:
        s, numbers = SceneSymbols(scene), arithmetic(16)
        self.dual, self._theta = dual, None
        if s.degenerate and not free:
            letters: dict[str, Any] = {"x": s.x, "p": s.parameter_list}
            self._theta = numeric(letters, [list(s.one_form)], numbers)
        self.m = 0 if self._theta else len(s.mu)
        self.moves = len(s.u) if dual.n else 0
        target = list(s.groupoid.target(s.position, s.u, s.h).subs(s.h, 1)) if dual.n else []
        letters = {"x": s.position, "w": s.u, "p": s.parameter_list}
        self._target = numeric(letters, [target], numbers) if dual.n else None
        self._p = [numbers.number(p) for p in scene.parameter_values]

    def state(self, z: np.ndarray, c: np.ndarray) -> np.ndarray:
        """Return the state at the coordinates c beside z."""
        x, mu = z[: self.dual.n], z[self.dual.n :]
        if self._target is not None:
            x = np.asarray(self._target(x, c[: self.moves], self._p), dtype=float)
        if self._theta is not None:
            return np.concatenate([x, np.asarray(self._theta(list(x), self._p), dtype=float)])
        return np.concatenate([x, mu + c[self.moves :]])

    def slope(
        self, of: Callable[[np.ndarray], np.ndarray], z: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return (∂ of/∂c, ∂z/∂c) at c = 0, by central differences."""
        size = self.moves + self.m
        width = WIDTH * max(1.0, float(np.abs(z).max()))
        ends, moved = [], []
        for k in range(size):
            a, b = (self.state(z, sign * width * np.eye(size)[k]) for sign in (1, -1))
            ends.append((of(a) - of(b)) / (2 * width))
            moved.append((a - b) / (2 * width))
        return np.array(ends).T, np.array(moved).T

    def tangent(self, of: Callable[[np.ndarray], np.ndarray], z: np.ndarray) -> np.ndarray:
        """Return the derivative of a map or field at z on directions in which states can move."""
        ends, moved = self.slope(of, z)
        left, sizes, _ = np.linalg.svd(moved, full_matrices=False)
        basis = left[:, sizes > 1e-6 * sizes[0]]
        return np.asarray(basis.T @ ends @ np.linalg.pinv(moved, rcond=1e-6) @ basis)

    def rest(self, of: Callable[[np.ndarray], np.ndarray], z: np.ndarray) -> np.ndarray:
        """Return the state near z where a field vanishes, by Newton's corrections of least size.

        They are halved until they help, and lie along the symplectic leaf: for a spinning body the
        next axis is found, and not the body at rest.
        """
        left = of(z)
        for _ in range(MOST):
            if np.abs(left).max() <= NOTHING * max(1.0, float(np.abs(z).max())):
                break
            ends, moved = self.slope(of, z)
            ways = np.linalg.pinv(moved, rcond=1e-6)
            if not self.dual.canonical:
                across, sizes, _ = np.linalg.svd(self.dual.tensor(z[None])[0])
                ways = ways @ across[:, sizes > 1e-9 * max(sizes[0], 1e-300)]
            change = -ways @ np.linalg.pinv(ends @ ways, rcond=1e-8) @ left
            for _ in range(MOST):
                new = self.state(z, change)
                after = of(new)
                if np.abs(after).max() < np.abs(left).max():
                    break
                change = change / 2
            else:
                break
            z, left = new, after
        return z


def judged_here(scene: Scene) -> bool:
    """True if a scene has free states (x, μ), and a field f that does not depend on time."""
    return scene.contact is None and has_dual(scene)


def equilibrium(scene: Scene) -> Equilibrium:
    """Return the equilibrium nearest to the start, found from there or from random states beside
    it.

    Raises `CannotMeasure` if none is found, and asks for one.
    """
    dual = dual_of(scene)
    assert dual is not None
    near, start = Near(scene, dual), _start(scene, dual)

    def field(z: np.ndarray) -> np.ndarray:
        return np.asarray(dual(z[None])[2][0])

    rest = _start(scene, dual, still=True)
    drawn = np.random.default_rng(1)
    scale = max(1.0, float(np.abs(start).max()))
    size = near.moves + near.m
    rates = max(float(np.abs(field(start)).max()), float(np.abs(field(rest)).max()), 1e-300)
    candidates: list[tuple[float, Equilibrium]] = []
    for k in range(TRIES):
        z = (start, rest)[k % 2]
        beside = (
            np.zeros(size) if k < 2 else drawn.normal(size=size) * scale * (0.3, 1.0)[k // 2 % 2]
        )
        begun = near.state(z, beside)
        is_start = k == 0 and float(np.abs(field(begun)).max()) <= STILL * rates
        if not is_start:
            begun = near.rest(field, begun)
        if not float(np.abs(field(begun)).max()) <= STILL * rates:
            continue
        values = np.linalg.eigvals(near.tangent(field, begun))
        fastest = float(np.abs(values.imag).max())
        if fastest > 0 and float(np.abs(values.real).max()) <= REAL * fastest:
            away = 0.0 if is_start else float(np.abs(begun - start).max())
            turns = not dual.canonical and np.abs(dual.velocity(begun[None])).max() > REAL * fastest
            candidates.append((away, Equilibrium(begun, fastest, is_start, bool(turns))))
        if is_start and candidates:
            break  # otherwise the nearest of all that are found
    if not candidates:
        raise CannotMeasure(
            f"{scene.name}: no equilibrium at which small motions oscillate was found from its "
            "start; give one: let x0 and v0 of the scene be at rest there."
        )
    return min(candidates, key=lambda each: each[0])[1]


def fastest_along(scene: Scene) -> float:
    """The largest modulus of an eigenvalue of Df along the scene's own motion.

    The motion is the reference's rough one, which no run of a judged rule has a part in. A step
    resolves the motion where it resolves this rate: that at the equilibrium may be far slower.
    """
    from discmech.reference import surroundings

    dual = dual_of(scene)
    assert dual is not None
    near, s = Near(scene, dual), SceneSymbols(scene)
    numbers = arithmetic(16)
    of_v = numeric({"x": s.x, "v": s.u, "p": s.parameter_list}, [list(momentum(s))], numbers)
    p = [numbers.number(e) for e in scene.parameter_values]

    def rate(x: Any, v: Any) -> float:
        x, v = ([float(e) for e in part] for part in (x, v))
        z = np.array([*x, *of_v(x, v, p)], dtype=float)
        slope = near.tangent(lambda at: np.asarray(dual(at[None])[2][0]), z)
        return float(np.abs(np.linalg.eigvals(slope)).max())

    states = surroundings(scene).along(Fraction(scene.duration))
    return max(rate(x, v) for _, x, v in states)


def _start(scene: Scene, dual: Dual, still: bool = False) -> np.ndarray:
    from discmech.integrators.equations import initial_momentum

    numbers = arithmetic(16)
    values = {"v0": (0,) * len(scene.v0), "mu0": None} if still and scene.v0 else {}
    if still and scene.hamiltonian is not None and scene.one_form is None:
        values = {"mu0": (0,) * len(scene.mu0 or ())}
    own = scene.with_values(**values) if values else scene
    x = [float(exact(e, "x0")) for e in own.x0]
    return np.array([*x, *map(float, initial_momentum(SceneSymbols(own), own, numbers))])


class Linearised:
    """A scheme's steps at an equilibrium: M(hω), and runs beside it."""

    def __init__(self, scheme: Scheme, at: Equilibrium) -> None:
        dual = dual_of(scheme.scene)
        assert dual is not None
        # states beside the equilibrium need not have the values that a scene's start must have
        beside = scheme.scene.with_values(symmetries=())
        self.scheme = scheme = scheme_of(beside, scheme.rule)
        self.at, self.dual = at, dual
        self.near = Near(scheme.scene, dual, free=scheme.arrows is not None)
        self._flow = lru_cache(maxsize=1)(lambda z: scheme.flow(Fraction(z / at.frequency)))

    def _run(self, z: float, start: np.ndarray, steps: int, every: int) -> np.ndarray:
        flow = self._flow(z)
        n = self.dual.n
        # Newton begins at the velocity there, and not at the scene's own
        near = np.asarray(self.dual(start[None])[2][0])[:n] if self.dual.canonical else None
        run = flow.trajectory(
            steps, every=every, x0=start[:n] if n else None, mu0=start[n:], u0=near
        )
        return np.hstack([np.asarray(run.x, dtype=float), np.asarray(run.mu, dtype=float)])

    def matrix(self, z: float) -> np.ndarray:
        """Return M in the coordinates of `Near`; raises `StepFailure` where there is no step."""
        return self.near.tangent(lambda at: self._run(z, at, 1, 1)[-1], self.fixed(z))

    def fixed(self, z: float) -> np.ndarray:
        """Return the fixed point of a step near the equilibrium: on a group it moves with h.

        A step from rest at a place such as 2π changes nothing but round-off, which may not end: the
        equilibrium itself then stands for it.
        """
        try:
            return self.near.rest(lambda at: self._run(z, at, 1, 1)[-1] - at, self.at.z)
        except StepFailure:
            return self.at.z

    def eigenvalues(self, z: float) -> np.ndarray:
        """Return the eigenvalues of M; infinite where there is no step."""
        try:
            values = np.asarray(np.linalg.eigvals(self.matrix(z)))
        except (StepFailure, DiscmechError, np.linalg.LinAlgError):
            return np.array([math.inf])
        return values if np.isfinite(values).all() else np.array([math.inf])

    def radius(self, z: float) -> float:
        """Return the largest modulus of an eigenvalue; inf where there is no step."""
        return float(np.abs(self.eigenvalues(z)).max())

    def measured(self) -> dict[str, Any]:
        """Return {stable_to, off_circle, runs}.

        stable_to: None if stable at every hω of the grid. off_circle: a z below it at which det M
        is not 1. runs: True if runs on both sides agree.
        """
        last, end, off = 0.0, None, None
        for z in np.arange(PART, FARTHEST_OWN + PART / 2, PART):
            values = self.eigenvalues(float(z))
            if np.abs(values).max() > 1 + GROWS:
                end = self._between(last, float(z))
                break
            # np.prod(values) is the determinant
            if off is None and abs(np.prod(values) - 1) > AREA:
                off = float(z)
            last = float(z)
        inside = 0.98 * (end or FARTHEST_OWN)
        agree = end == 0 or not self._grows(inside)
        beyond = [end * f for f in BEYOND if end and self.radius(end * f) > 1 + CLEAR]
        if beyond:
            agree = agree and self._grows(beyond[0])
        return {"stable_to": end, "off_circle": off, "runs": agree}

    def _between(self, low: float, high: float) -> float:
        while high - low > 1e-6 * high and high > 1e-9:
            middle = (low + high) / 2
            low, high = (low, middle) if self.radius(middle) > 1 + GROWS else (middle, high)
        return 0.0 if high <= 1e-9 else (low + high) / 2

    def _grows(self, z: float) -> bool:
        size = SMALL * max(1.0, float(np.abs(self.at.z).max()))
        signs = np.array([(-1.0) ** k for k in range(self.near.moves + self.near.m)])
        try:
            still = self.fixed(z)
            begun = self.near.state(still, size * signs)
            z_rows = self._run(z, begun, STEPS, 10)
        except (StepFailure, DiscmechError):
            return True
        away = np.abs(z_rows - still).max(axis=1)
        return not bool(away.max() < 1e3 * away[0])


def family_of(scene: Scene, at: Equilibrium) -> Family:
    """Return the scene's own motion, from its start, as a family of one member for the maps."""
    return Family(
        scene=scene.name, label="amplitude", stiffness=(Fraction(1),), values=lambda _: {},
        frequency=lambda _: at.frequency, title=f"{scene.title or scene.name}, from its start",
    )  # fmt: skip
