"""Closed-form solutions, found by scene name and used only where they apply.

A form is used when the scene's Lagrangian, with the scene's parameters in it, is the form's own
Lagrangian up to a constant, on the form's own algebroid: a scene of the same name with another
Lagrangian falls to the Taylor integrator.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .form import ClosedForm, Motion

if TYPE_CHECKING:
    from ..equations import Mechanics


def registry() -> dict[str, ClosedForm]:
    """Return the closed forms by scene name."""
    from . import (
        charged_particle,
        harmonic,
        kepler,
        mathews_lakshmanan,
        morse,
        pendulum,
        rigid_body,
        rigid_body_so4,
        sl2,
        vortex_pair,
    )
    from . import symmetric_top as top

    modules = (harmonic, pendulum, kepler, charged_particle, rigid_body, rigid_body_so4, sl2, top,
               morse, mathews_lakshmanan, vortex_pair)  # fmt: skip
    forms = (*(module.FORM for module in modules), top.PENDULUM)
    return {form.name: form for form in forms}


def closed_form_of(scene: Any, mechanics: Mechanics) -> ClosedForm | None:
    """Return the closed form that solves exactly this scene, or None."""
    import sympy

    from ..equations import parameter_values

    form, structure = registry().get(scene.name), mechanics.structure
    if form is None or form.kind != scene.groupoid.kind:
        return None
    if form.basis is not None and structure.basis != form.basis():
        return None
    n, parameters = structure.dim_x, parameter_values(scene)
    try:
        own = form.lagrangian(mechanics.x, mechanics.v, parameters)
    except (AttributeError, IndexError, TypeError, ValueError):
        return None  # it has other parameters or dimensions
    if sympy.simplify(sympy.expand(mechanics.lagrangian - own)).free_symbols:
        return None
    start = mechanics.start
    return form if form.applies(parameters, start[:n], start[n:]) else None


__all__ = ["ClosedForm", "Motion", "closed_form_of", "registry"]
