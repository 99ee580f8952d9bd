"""The source of a missing derivative: the Lagrangian, the force or the rule, and its line."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from ..errors import BadInput, line_of
from ..numbers import NotComputed, NotSmooth, sympy
from ..numbers.types import Expression, Function, Letter
from .checks import named

if TYPE_CHECKING:
    from ..scene import Scene
    from .symbols import SceneSymbols

#: possible causes in a line: one of the functions, or otherwise a power, which may be a root
_WORDS = (r"\b(sqrt|Abs|abs|Max|Min|sign|Heaviside|Piecewise)\b", r"\*\*")


@contextmanager
def blamed(scheme: Any) -> Iterator[None]:
    """Raise an uncomputable expression again, with the user's function that has to be changed."""
    try:
        yield
    except NotSmooth:
        raise _blame(scheme) from None
    except NotComputed as error:
        which = named(scheme.scene.name, scheme.equations.rule)
        raise BadInput(f"{which}: {error}") from None


def _blame(scheme: Any) -> BadInput:
    scene, rule = scheme.scene, scheme.equations.rule
    what, function = f"the rule {rule.name}", getattr(rule, "formula", None)
    if scene.force is not None and any(map(_breaks, scheme.s.force)):
        what, function = f"the force of {scene.name}", scene.force
    return _refusal(what, function)


def check_finite(scene: Scene, s: SceneSymbols) -> tuple[str, Expression]:
    """Raise `BadInput` if the Lagrangian (or Hamiltonian) is not finite and real.

    Returns its name, and the expression.
    """
    H = s.hamiltonian
    noun, value = ("Lagrangian", s.lagrangian) if H is None else ("Hamiltonian", H)
    s.scalars([value], f"its {noun}", scene.lagrangian)
    if s.degenerate:
        _ = s.one_form
    return noun, value


def check_smooth(scene: Scene, s: SceneSymbols) -> None:
    """Raise `BadInput` as `check_finite` does, and if the energy or the force is not smooth.

    It may not be made of pieces in x, u, μ or t: no rule has an order across a jump in the slope of
    its gradient.
    """
    noun, value = check_finite(scene, s)
    refuse_pieces([value], s, f"the {noun} of {scene.name}", scene.lagrangian)
    if s.degenerate:
        refuse_pieces(s.one_form, s, f"the one-form of {scene.name}", scene.one_form)
    refuse_pieces(s.force, s, f"the force of {scene.name}", scene.force)


def refuse_pieces(
    values: Iterable[Expression], s: SceneSymbols, what: str, function: Function | None
) -> None:
    """Raise `BadInput` if one of the values is made of pieces in x, u, μ or t."""
    if any(_breaks(e, {*s.x, *s.u, *s.mu}) for e in values):
        raise _refusal(what, function)


def _refusal(what: str, function: Function | None) -> BadInput:
    place = _line(function)
    return BadInput(
        (f"{place}: " if place else "")
        + f"{what} holds Abs (or Max, Min, Piecewise, a step), so that its gradient has no "
        "derivative everywhere: write it without; the root of a square is one too: sqrt(u**2) is "
        "Abs(u). A switch can be smooth, as (1 + tanh(x/w))/2."
    )


def _breaks(e: Expression, letters: set[Letter] | None = None) -> bool:
    """True if the expression is made of pieces, of functions of the letters if some are given."""
    pieces = e.atoms(sympy.Abs, sympy.Max, sympy.Min, sympy.sign, sympy.Heaviside, sympy.Piecewise)
    return any(letters is None or part.free_symbols & letters for part in pieces)


def _line(function: Function | None) -> str:
    """Return the first possible line of a user's function, or its start; "" for ours."""
    place = line_of(function)
    with suppress(OSError, TypeError):
        lines, first = inspect.getsourcelines(function)  # type: ignore[arg-type]
        for words in _WORDS:
            for k, text in enumerate(lines):
                if place and re.search(words, text):
                    return f"{place.rpartition(' ')[0]} {first + k}"
    return place
