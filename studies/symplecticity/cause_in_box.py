"""The cause of a form that the map of a box does not keep, by the derivative of one step.

There is no motion to hold it against; but M Π Mᵀ says of itself what has become of Π.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from discmech.integrators.extensions.foreign import derivative, guarded, noise_of, shifted

from ..causes.first_terms import Told
from ..core.case import Case
from .form_in_numbers import form_defect, volume_defect
from .places import map_of, scale_of
from .records import OfNumbers

ALIKE = 0.1  # of what Π has lost in all planes alike, a tenth may be another in one of them


def of_box(case: Case, row: OfNumbers, share: str) -> Told | None:
    """Return what one step from the state of a row makes of the form, or None if it keeps it.

    share: how many of all states show the same, in words.
    """
    scheme: Any = case.scheme
    flow, scale, z = scheme.flow(scheme.scene.step), scale_of(scheme), np.array(row.state)
    f = shifted(guarded(map_of(flow, 1), len(z)), z)
    noise = noise_of(f, 0 * scale, scale, scheme.rule.unit(16))
    if (jump := float((noise.jump / scale).max())) > 0:
        return "jump", (
            f"a step jumps by {jump:.1e} of the box between states close by: look for a "
            "comparison, a rounding, a table's cell, or an iteration that stops early."
        )
    of = derivative(f, len(z), scale, noise)
    before, after = (flow.system.tensor(*np.split(e, 2)) for e in (z, z + f(0 * z)))
    if not form_defect(of, before, after).certain:
        return None
    unit = np.outer(scale, scale)  # planes of all sizes count alike
    wanted, got = after / unit, of.value @ before @ of.value.T / unit
    c = float((got * wanted).sum() / (wanted * wanted).sum())
    rest = float(np.abs(got - c * wanted).max() / np.abs(wanted).max())
    if rest <= ALIKE * min(abs(c + 1), abs(c - 1)) or rest + abs(c + 1) < ALIKE:
        if c < 0:
            return "turned form", (
                "a step turns the form into its negative: two coordinates are exchanged, or one is "
                "reversed, without a sign of its momentum."
            )
        return "volume", (
            f"a step multiplies the area of every plane by 1 {'+' if c > 1 else '−'} "
            f"{abs(c - 1):.2g}, {share}: something damps or feeds all momenta alike."
        )
    volume = volume_defect(of)
    if volume.certain:
        return "volume", (
            f"a step changes volume by {volume.measured:.2g}, {share}, and planes not alike: look "
            "for a damping, or for what moves a coordinate by itself."
        )
    return "no gradient", (
        f"a step keeps volume, but not the form, in {row.entry}, {share}: as where a coordinate is "
        "moved by another without its twin; kicks have to be gradients of one function, and drifts."
    )
