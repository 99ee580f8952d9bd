"""Defects of a step's forms, and the effect of round-off on a step, independent of units.

Both are judged entry by entry, relative to the sum of the absolute terms of the entry. So neither a
unit of mass, length or time nor a large block beside a small one hides an error.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from ..numbers import Tracked, finite, tracked
from ..numbers.types import Array, Number, Vector
from .step_map import Maps, StepMap

#: (x′, μ′) and the derivative of (x, μ) ↦ (x′, μ′), plain or `Tracked`
Step: TypeAlias = tuple[Array, Array, Array]


def entrywise_defect(map_: Array, form: Array, wanted: Array, resolution: Number) -> Number:
    """Return the largest entry of |M Π Mᵀ − Π′| over |M||Π||Mᵀ| + |Π′|; 0 if both are 0.

    map_: M (k×l), form: Π (l×l), wanted: Π′ (k×k), plain or `Tracked`. If the terms of an entry are
    zeros known only to round-off, its error bound is added, times `resolution`: 1 if numbers have
    the digits that are judged, √ε if they have twice as many (`over_terms`).
    """
    map_, form, wanted = map(tracked, (map_, form, wanted))
    gap = map_ @ form @ map_.T - wanted
    of_map, of_form, of_wanted = (abs(e.value) for e in (map_, form, wanted))
    terms = of_map @ of_form @ of_map.T + of_wanted
    return over_terms(gap, terms, resolution)


def over_terms(gap: Tracked, terms: np.ndarray, resolution: Number) -> Number:
    """Return the largest entry of a `Tracked` gap over its terms plus its bound times `resolution`.

    The bound can only reduce the result, and costs more than all values. So with twice the digits
    it is not computed if every gap is below √ε of its terms alone: then there is no such zero.
    """
    ratio = in_round_offs(gap.value.ravel(), terms.ravel())
    if ratio <= resolution < 1:
        return ratio
    return in_round_offs(gap.value.ravel(), (terms + resolution * gap.error).ravel())


def pullback_defect(
    geometry: StepMap, here: Maps, there: Maps, tangent: Array, resolution: Number = 1
) -> Number:
    """Return the `entrywise_defect` of PΨᵀ Ω PΨ = Ω for TΨ = tangent, (n+m)×(n+m), at arrows."""
    p = geometry.prolongation(here, there, tangent)
    before, after = geometry.omega(here), geometry.omega(there)
    return entrywise_defect(p.T, after, before, resolution)


def poisson_defect(
    geometry: StepMap,
    x: Vector,
    mu: Vector,
    step: Step,
    bracket_sign: int = 1,
    resolution: Number = 1,
) -> Number:
    """Return the `entrywise_defect` of M Π Mᵀ = Π′ for a step (x′, μ′, M) from (x, μ).

    M is the derivative of the step.
    """
    after_x, after_mu, m = step
    before = geometry.poisson_tensor(x, mu, bracket_sign)
    after = geometry.poisson_tensor(after_x, after_mu, bracket_sign)
    return entrywise_defect(m, before, after, resolution)


def in_round_offs(gap: Vector, bound: Vector) -> Number:
    """Return the largest |gap| over its bound, entry by entry; 0 without a gap, 1 without a bound.

    It is nan if the bound of a gap is not finite: an infinite one would excuse any gap.
    With a `StepMap.step_round_off` as bound it is at most ε if only round-off caused the gap.
    """
    triples = zip(abs(gap), bound, finite(bound), strict=True)
    ratios = [g / (b if b else g) if known else np.nan for g, b, known in triples if g != 0]
    return max(ratios, key=lambda d: (d != d, d), default=0 * abs(gap).sum())
