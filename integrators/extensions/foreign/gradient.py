"""A gradient in numbers, held against its function: along the motion, beside it, at every scale.

On each piece of a way the function changes by the integral of its gradient, H(b) − H(a) = ∫ dH. The
way follows the motion roughly, for a piece may lie anywhere, and leaves it in drawn directions. A
piece on which both sides differ is halved where the integral is not known yet, as at a kink.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...equations import SceneSymbols
from ...errors import BadInput, shown
from ...numbers import Vector, arithmetic
from ...scene import Scene, remembered
from .differences import FARTHEST, derivative, noise_of
from .scene_in_numbers import NumericScene

#: pieces along the motion, and those beside it, by a share of the motion's size
PIECES, BESIDE, SHARES = 400, 64, (1e-3, 0.2)
PLACES = 8  # places at which the noise of H and its gradient is measured
#: nodes of Lobatto's rule of order 10, with both ends: a kink beside an end is not overlooked
_P5 = np.polynomial.legendre.Legendre.basis(5)
NODES = np.concatenate([[-1.0], np.sort(_P5.deriv().roots()), [1.0]])
WEIGHTS = 1 / (15 * _P5(NODES) ** 2)
#: the share of a change that no reference in numbers claims to know (`reference`)
SHARE = 2.0**-40
ROUNDINGS = 64  # of the values of H, and of the places where it is asked
DEEPEST = 60  # halvings of a piece
#: in so many halvings an integral changes by less than this share of the gap, or is not known yet
LEVELS, KNOWN = 5, 1 / 16
#: parts are not alike: the errors of two kinks cancel in parts that lie evenly about them
SKEW = 1.25


@remembered(maxsize=64)
def check_gradient(scene: Scene) -> None:
    """Raise `BadInput` for functions of other shapes, and for a gradient that is not that of H."""
    n = scene.groupoid.dim_x
    z = np.array([float(e) for e in (*scene.x0, *(scene.mu0 or ()))])
    _check_shapes(scene, z, n)
    way = _Way(scene, n)
    points = _motion(scene, z)
    size = np.ptp(points, axis=0)  # of an entry at rest, a part of the others', or of the state
    most = size.max(initial=0.0) or np.abs(z).max(initial=0.0) or 1.0
    size = np.maximum(size, most / 10)
    way.listen(points, size / 16)
    for i, axis in enumerate(np.diag(size / 16)):
        if gap := way.gap(z, z + axis):
            name = f"q[{i}]" if i < n else f"p[{i - n}]"
            of = derivative(lambda y: way.energy(z + y), 1, size / 16, way.noise)
            raise BadInput(
                f"{scene.name}: gradient= is not that of numeric_hamiltonian=: by {name} it gives "
                f"{way.slopes(z)[i]:.12g} at the start, and differences of H give "
                f"{of.value[0, i]:.12g}; over the next {axis[i]:.3g} they are {abs(gap):.2g} apart."
            )
    drawn = np.random.default_rng(0)
    at = drawn.integers(len(points), size=BESIDE)
    least, most = np.log(SHARES)
    shares = np.exp(drawn.uniform(float(least), float(most), BESIDE))
    ways = drawn.standard_normal((BESIDE, len(z))) * size * shares[:, None]
    pieces = [*itertools.pairwise(points), *zip(points[at], points[at] + ways, strict=True)]
    for a, b in pieces:
        if gap := way.gap(a, b):
            change = float(way.energy(b)[0] - way.energy(a)[0])
            raise BadInput(
                f"{scene.name}: gradient= is not that of numeric_hamiltonian=: from (q, p) = "
                f"{_told(a)} to {_told(b)} the function changes by {change:.6g}, and its gradient "
                f"says {change - gap:.6g}, {abs(gap):.2g} beside it."
            )


class _Way:
    """The user's functions on pieces of a way."""

    def __init__(self, scene: Scene, n: int) -> None:
        self.scene, self.n = scene, n
        self.of_energy: Any = 0.0
        self.of_slopes: Any = 0.0

    def energy(self, z: Vector) -> Vector:
        return np.asarray(_asked(self.scene.numeric_hamiltonian, z, self.n), float).reshape(1)

    def slopes(self, z: Vector) -> Vector:
        parts = _asked(self.scene.gradient, z, self.n)
        return np.concatenate([np.ravel(np.asarray(e, dtype=float)) for e in parts])

    def listen(self, points: Any, scale: Vector) -> None:
        """Measure the noise of both functions at places of the motion."""
        for k in np.linspace(0, len(points) - 1, PLACES).astype(int):
            self.noise = noise_of(self.energy, points[k], scale, 2.0**-53)
            of_slopes = noise_of(self.slopes, points[k], scale, 2.0**-53)
            self.of_energy = max(self.of_energy, float(self.noise.level[0]))
            self.of_slopes = np.maximum(self.of_slopes, of_slopes.level)

    def gap(self, a: Vector, b: Vector, depth: int = 0) -> float:
        """Return what is left of H(b) − H(a) less the integral of its gradient; 0 for round-off.

        It counts where the integral is known: in so many halvings (`LEVELS`) it no longer changes.
        Otherwise, as at a kink, each half is looked at.
        """
        with np.errstate(all="ignore"):
            left, known = self._left(a, b, 1)
            if not abs(left) > known or depth == DEEPEST:  # also where it is no number
                return 0.0
            if all(abs(self._left(a, b, 2**k)[0] - left) <= KNOWN * abs(left)
                   for k in range(1, LEVELS + 1)):  # fmt: skip
                return left
            middle = (a + b) / 2
            return self.gap(a, middle, depth + 1) or self.gap(middle, b, depth + 1)

    def _left(self, a: Vector, b: Vector, parts: int) -> tuple[float, float]:
        """Return (H(b) − H(a) less the integral in so many parts, the round-off of that)."""
        low, high = (float(self.energy(z)[0]) for z in (a, b))
        edges = (np.arange(parts + 1) / parts) ** SKEW
        widths = np.diff(edges)[:, None]
        shares = (edges[:-1, None] + widths * (1 + NODES) / 2).ravel()
        slopes = np.array([self.slopes(a + share * (b - a)) for share in shares])
        terms = (widths * WEIGHTS / 2).ravel()[:, None] * slopes * (b - a)
        known = 2 * FARTHEST * self.of_energy + FARTHEST * float(self.of_slopes @ abs(b - a))
        ends = abs(low) + abs(high) + abs(slopes[0]) @ abs(a) + abs(slopes[-1]) @ abs(b)
        known += SHARE * abs(terms).sum() + ROUNDINGS * 2.0**-53 * float(ends)
        return high - low - float(terms.sum()), known


def _motion(scene: Scene, z: Vector) -> Any:
    """Return states along the motion, by the classical method of Runge and Kutta; (r, n+m)."""
    system = NumericScene(SceneSymbols(scene), scene, arithmetic(16))

    def rates(z: Vector) -> Vector:
        return np.concatenate(system.f(z[: system.n], z[system.n :]))

    h, states = float(scene.duration) / PIECES, [z]
    h = min(h, 4 * float(scene.step))  # of a long motion the first part
    with np.errstate(all="ignore"):
        for _ in range(PIECES):
            a = rates(z)
            b = rates(z + h / 2 * a)
            c = rates(z + h / 2 * b)
            z = z + h / 6 * (a + 2 * b + 2 * c + rates(z + h * c))
            if not np.isfinite(z).all():
                break
            states.append(z)
    return np.array(states)


def _check_shapes(scene: Scene, z: Vector, n: int) -> None:
    m = len(z) - n
    value, slopes = _asked(scene.numeric_hamiltonian, z, n), _asked(scene.gradient, z, n)
    if np.size(value) != 1 or not np.isfinite(np.asarray(value, dtype=float)).all():
        raise BadInput(
            f"{scene.name}: numeric_hamiltonian= gives {shown(value)}, but must give a number."
        )
    sizes = [np.size(e) for e in slopes] if isinstance(slopes, tuple | list) else []
    if sizes != [n, m]:
        raise BadInput(
            f"{scene.name}: gradient= gives {_shape(slopes)}, but must give the pair "
            f"(∂H/∂q, ∂H/∂p) of {n} and {m} numbers."
        )


def _asked(function: Any, z: Vector, n: int) -> Any:
    try:
        return function(z[:n].copy(), z[n:].copy())
    except Exception as error:
        raise BadInput(
            f"a function of the scene in numbers raises {type(error).__name__} on its motion: "
            f"{' '.join(str(error).split())[:160]}"
        ) from error


def _shape(value: ArrayLike) -> str:
    if isinstance(value, tuple | list):
        return f"{len(value)} parts of {', '.join(str(np.size(e)) for e in value)} numbers"
    return f"an array of {np.size(value)} numbers"


def _told(z: Vector) -> str:
    more = ", …" if len(z) > 4 else ""
    return f"({', '.join(f'{e:.6g}' for e in z[:4])}{more})"
