"""The Poisson form, the symplectic form and volume under a map of numbers, with certain defects."""

from __future__ import annotations

import numpy as np

from discmech.integrators.extensions.foreign.differences import EPS, Derivative, Map, Noise, images
from discmech.integrators.numbers.types import Matrix, Rows, Vector

from .records import Defect

LOOP = 64  # usual number of points of a closed curve
# the points do not resolve a curve with a larger share of its amplitudes at high frequencies
UNRESOLVED = 1e-3


def form_defect(of: Derivative, before: Matrix, after: Matrix) -> Defect:
    """Return how far M Π Mᵀ is from Π′, M (k, l), Π before (l, l), Π′ after (k, k).

    Each entry is relative to the sum of its absolute terms, or, if that is larger, to the natural
    unit of the pair, which M and Π′ themselves determine, so that bodies of very different mass are
    all seen.
    """
    M, E = of.value, of.error
    gap, size = _form_gap(M, before, after)
    half = E @ np.abs(before) @ (np.abs(M) + E / 2).T
    unsure = half + half.T + 4 * len(before) * EPS * size
    return _worst(gap, unsure, np.maximum(size, _natural(size)))


def form_gaps(M: Matrix, before: Matrix, after: Matrix) -> Vector:
    """Return the `measured` of `form_defect` for many derivatives at once, (r, k, l)."""
    gap, size = _form_gap(M, before, after)
    size = np.maximum(size, _natural(size))
    shares = np.where(np.isfinite(gap), gap / np.where(size > 0, size, 1.0), 0.0)
    return np.asarray(shares.max(axis=(1, 2)))


def _form_gap(M: Matrix, before: Matrix, after: Matrix) -> tuple[Matrix, Matrix]:
    """Return |M Π Mᵀ - Π′| and the sum of its absolute terms."""
    turned = np.swapaxes(M, -1, -2)
    size = np.abs(M) @ np.abs(before) @ np.abs(turned) + np.abs(after)
    return np.abs(M @ before @ turned - after), size


def pulled_back_defect(of: Derivative, start: Derivative, form: Rows) -> Defect:
    """Return how far Dᵀ ω D is from Nᵀ ω N.

    D and N, (2n, l) each, are the derivatives of a map and of its start by parameters of the
    submanifold on which ω = dq ∧ dp is tested.
    """
    w, absolute = np.asarray(form), np.abs(form)
    gap = np.abs(of.value.T @ w @ of.value - start.value.T @ w @ start.value)
    size = unsure = np.zeros_like(gap)
    for part in (of, start):
        a, e = np.abs(part.value), part.error
        size = size + a.T @ absolute @ a
        half = e.T @ absolute @ (a + e / 2)
        unsure = unsure + half + half.T
    return _worst(gap, unsure + 4 * len(w) * EPS * size, np.maximum(size, _natural(size)))


def volume_defect(of: Derivative) -> Defect:
    """Return how far |det M| is from 1; the error uses the inverse of M."""
    value = abs(float(np.linalg.det(of.value)))
    try:
        inverse = np.abs(np.linalg.inv(of.value))
    except np.linalg.LinAlgError:
        return Defect(1.0, 1.0, float("inf"))
    unsure = value * float(np.trace(inverse @ of.error)) + 8 * len(of.value) * EPS * value
    gap = abs(value - 1.0)
    return Defect(max(0.0, gap - unsure), gap, unsure)


def _natural(size: Matrix) -> Matrix:
    """Return the natural unit of each pair of entries.

    It is a thousandth of the geometric mean of the largest values of both; a smaller entry is no
    part of the motion.
    """
    most = np.sqrt(size.max(axis=-1))
    return np.asarray(1e-3 * most[..., None] * most[..., None, :])


def _worst(gap: Matrix, unsure: Matrix, size: Matrix) -> Defect:
    with np.errstate(all="ignore"):
        size = np.where(size > 0, size, 1.0)
        certain = np.maximum(gap - unsure, 0) / size
        certain[~np.isfinite(certain)] = 0.0
        shares = np.where(np.isfinite(unsure), unsure / size, np.inf)
        measured = np.where(np.isfinite(gap), gap / size, 0.0)
    at = np.unravel_index(int((certain if certain.max() else measured).argmax()), gap.shape)
    return Defect(
        float(certain.max(initial=0.0)),
        float(measured.max(initial=0.0)),
        float(shares.max(initial=0.0)),
        tuple(map(int, at)),
    )


def loop_defect(f: Map, curve: Matrix, n: int, noise: Noise | None = None) -> Defect:
    """Return how far ∮ p·dq over a closed curve of starts (r, 2n) is from that over its image by f.

    Without the noise of f that of the image is taken (`noise_along`). It uses Fourier derivatives,
    which are exact for a curve that its points resolve, and no derivative of the map (Poincaré's
    integral invariant). It is relative to ∮ |p·dq| about the mean of p, per degree of freedom.
    Every second point shows whether the curve is resolved.
    """
    image = images(f, curve)
    if not np.isfinite(image).all():
        return Defect(0.0, 0.0, float("inf"))
    integrals = [_integral(rows, n) for rows in (curve, image)]
    coarse = [_integral(rows[::2], n) for rows in (curve, image)]
    size = max(integrals[0][1], integrals[1][1])
    rough = (noise or noise_along(image)).rough(image)
    dq = np.abs(np.diff(image[:, :n], axis=0, append=image[:1, :n])).max(axis=0)
    p = np.abs(image[:, n:] - image[:, n:].mean(axis=0)).max(axis=0)
    # each value's noise, weighted by the other's derivative; the noise of 64 points is independent
    of_noise = float((rough[n:] * dq + rough[:n] * p * np.pi).sum()) * len(curve) ** 0.5
    tails = max(a[2] for a in integrals)
    if tails > UNRESOLVED:
        return Defect(0.0, 0.0, float("inf"))
    beyond = sum(abs(a[0] - b[0]) for a, b in zip(integrals, coarse, strict=True))
    # frequencies beyond the highest have a part in it, each weighted by itself: those of a curve
    # with kinks are about as large as the highest, and by chance half the points tell the same
    unsure = of_noise + beyond + size * tails * len(curve) / 2
    gap = abs(integrals[1][0] - integrals[0][0])
    size = size or 1.0
    # an image that is drawn out has a larger area, beside which a loss would look smaller
    return Defect(max(0.0, gap - unsure) / size, gap / size, unsure / (integrals[0][1] or 1.0))


def noise_along(image: Matrix) -> Noise:
    """Return the noise of the points of a closed curve (r, k), from its highest frequencies.

    A curve that its points resolve has no other amplitudes there, and those of noise are as large
    as at all others.
    """
    high = _highest(np.fft.fft(image, axis=0))
    return Noise((np.abs(high) ** 2).mean(axis=0) ** 0.5 / len(image) ** 0.5, 0 * image[0])


def _highest(spectrum: Matrix) -> Matrix:
    return spectrum[len(spectrum) // 2 - 3 : len(spectrum) // 2 + 4]


def _integral(rows: Matrix, n: int) -> tuple[float, float, float]:
    """Return (∮ p·dq, its absolute terms, the share of the curve at the highest frequencies)."""
    p = rows[:, n:] - rows[:, n:].mean(axis=0)
    slopes, tail = slopes_and_tail(np.hstack([rows[:, :n], p]))
    terms = p * slopes[:, :n] * (2 * np.pi / len(rows))
    return float(terms.sum()), float(np.abs(terms).sum()), tail


def slopes_and_tail(rows: Matrix, weights: Vector | None = None) -> tuple[Matrix, float]:
    """Return the derivative (r, l) along a closed curve (r, l) by its Fourier series.

    The second result is the share of the curve at the highest frequencies: the largest of an entry,
    or that of all entries together by their weights (l,) in an integral. In coordinates that are
    more than the curve's dimensions an entry may move as the square of the curve, like a cosine
    near 0: over so small a motion its round-off would be a large share.
    """
    r = len(rows)
    spectrum = np.fft.fft(rows, axis=0)
    k = np.fft.fftfreq(r, 1 / r)
    k[r // 2] = 0
    slopes = np.fft.ifft(1j * k[:, None] * spectrum, axis=0).real
    with np.errstate(all="ignore"):
        high, most = (np.abs(of).max(axis=0) for of in (_highest(spectrum), spectrum[1:]))
        if weights is not None:
            high, most = np.array([weights @ high]), np.array([weights @ most])
        tail = np.nanmax(np.where(high > 0, high / most, 0.0))
    return slopes, float(tail)


def random_curve(
    random: np.random.Generator, z: Vector, scale: Vector, reach: float, points: int = LOOP
) -> Matrix:
    """Return a closed curve of so many points around z, (r, 2n), with three harmonics."""
    t = 2 * np.pi * np.arange(points) / points
    a, b, c = (random.standard_normal(len(z)) * scale * reach for _ in range(3))
    return z + np.outer(np.cos(t), a) + np.outer(np.sin(t), b) + 0.3 * np.outer(np.cos(2 * t), c)
