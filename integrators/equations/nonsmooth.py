"""Who it is that has no derivative: the scene's Lagrangian, its force or the rule; its line."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from ..errors import BadInput, line_of
from ..numbers import NotComputed, NotSmooth, sympy
from .checks import named
from .discretised_scene import DiscretisedScene

#: what a line that does it holds: one of the functions, or else a power, which a root may be
_WORDS = (r"\b(sqrt|Abs|abs|Max|Min|sign|Heaviside)\b", r"\*\*")


@contextmanager
def blamed(scheme: DiscretisedScene) -> Iterator[None]:
    """Raise what cannot be computed again, with the function of the user's that is to be mended."""
    try:
        yield
    except NotSmooth:
        raise _blame(scheme) from None
    except NotComputed as error:
        which = named(scheme.scene.name, scheme.equations.rule)
        raise BadInput(f"{which}: {error}") from None


def _blame(scheme: DiscretisedScene) -> BadInput:
    scene, rule = scheme.scene, scheme.equations.rule
    what, function = f"the rule {rule.name}", getattr(rule, "formula", None)
    if scene.lagrangian is not None and _breaks(scheme.s.lagrangian):
        what, function = f"the Lagrangian of {scene.name}", scene.lagrangian
    elif scene.force is not None and any(map(_breaks, scheme.s.force)):
        what, function = f"the force of {scene.name}", scene.force
    place = _line(function)
    return BadInput(
        (f"{place}: " if place else "")
        + f"{what} holds Abs (or Max, Min, a step), which has no derivative everywhere: write it "
        "without; the root of a square is one too: sqrt(u**2) is Abs(u)."
    )


def _breaks(e: Any) -> bool:
    """Whether the derivative jumps somewhere."""
    return bool(e.has(sympy.Abs, sympy.Max, sympy.Min, sympy.sign, sympy.Heaviside))


def _line(function: Callable[..., Any] | None) -> str:
    """The first line of a user's function that may do it, else where it begins; "" of ours."""
    place = line_of(function)
    with suppress(OSError, TypeError):
        lines, first = inspect.getsourcelines(function)  # type: ignore[arg-type]
        for words in _WORDS:
            for k, text in enumerate(lines):
                if place and re.search(words, text):
                    return f"{place.rpartition(' ')[0]} {first + k}"
    return place
