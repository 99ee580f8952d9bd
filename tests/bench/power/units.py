"""The same scene in another unit of action: no verdict may change with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import Any

import sympy

from discmech.integrators.numbers import to_sympy
from discmech.integrators.scene import Conserved, Scene


def in_unit_of_action(scene: Scene, power: int) -> Scene:
    """Return the scene with its Lagrangian and its force times 10^power, and the same quantities.

    Momenta are as many times larger; at 10^±150 products of two of them are no doubles.
    """
    scale = sympy.Integer(10) ** power

    def times(function: Callable[..., Any] | None) -> Any:
        if function is None:
            return None

        @wraps(function)  # with or without the time
        def scaled(*at: Any) -> Any:
            value = function(*at)
            return [scale * e for e in value] if isinstance(value, (list, tuple)) else scale * value

        return scaled

    def of_momentum(quantity: Conserved) -> Conserved:
        @wraps(quantity.formula)
        def formula(x: Any, mu: Any, *rest: Any) -> Any:
            return quantity.formula(x, mu / scale, *rest)

        return replace(quantity, formula=formula)

    def hamiltonian(x: Any, mu: Any, *rest: Any) -> Any:
        return scale * scene.hamiltonian(x, mu / scale, *rest)  # type: ignore[misc]

    own: dict[str, Any] = {"lagrangian": times(scene.lagrangian)}
    if scene.one_form is not None:
        own = {"one_form": times(scene.one_form), "hamiltonian": times(scene.hamiltonian)}
    elif scene.hamiltonian is not None:
        started = [scale * to_sympy(e) for e in scene.mu0 or ()]
        own = {"hamiltonian": wraps(scene.hamiltonian)(hamiltonian), "mu0": started}
    return scene.with_values(
        name=f"{scene.name}-in-{power}",
        **own,
        force=times(scene.force),
        symmetries=[*map(of_momentum, scene.symmetries)],
        fast=None,
    )
