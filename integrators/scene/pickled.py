"""How rules, scenes, schemes and flows go to another process: by what they are made of.

Functions do not travel, so a thing goes by its name in the module that defines it; a scene with
other values goes as that of its module and the values.
"""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields
from functools import partial
from importlib import import_module
from typing import Any

#: rooms whose things `get(name)` finds
_ROOMS = ("discmech.integrators.rules", "discmech.integrators.scenes",
          "discmech.integrators.lattices.systems")  # fmt: skip
Again = tuple[Callable[..., Any], tuple[Any, ...]]


def held(module: str, name: str) -> Any:
    """What a module has under a name, such as a class's attribute, A.b."""
    found: Any = import_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    return found


def called(room: str, name: str) -> Any:
    """What a room of discmech's finds under a name; None if it finds nothing."""
    try:
        return import_module(room).get(name)
    except ValueError:  # BadInput
        return None


def with_values(thing: Any, changes: dict[str, Any]) -> Any:
    """A copy with other values."""
    return thing.with_values(**changes)


def composed(base: Any, method: str) -> Any:
    """A composition of a rule."""
    return import_module(_ROOMS[0]).compose(base, method)


def flow_of(scheme: Any, step: Any, digits: int, on_edge: str, more: dict[str, Any]) -> Any:
    """The flow of a scheme, its choice of a step as it was."""
    flow = scheme.flow_at(step, digits, on_edge)
    vars(flow).update(more)
    return flow


def again(thing: Any, functions: Iterable[Any]) -> Again:
    """What makes a rule, a scene or a lattice again, which is given by these functions.

    Raises `pickle.PicklingError`, which says what to do, where nothing does.
    """
    for room in _ROOMS:
        if _same(called(room, thing.name), thing):
            return called, (room, thing.name)
    modules = dict.fromkeys(m for f in functions for m in _modules(f))
    for module in modules:
        for name, other in list(vars(sys.modules[module]).items()):
            if _same(other, thing):
                return held, (module, name)
    base = getattr(thing, "base", None)
    if base is not None and _same(composed(base, thing.method.name), thing):
        return composed, (base, thing.method.name)
    if hasattr(thing, "laws"):
        known = [called(_ROOMS[1], thing.name)]
        known += [other for m in modules for other in list(vars(sys.modules[m]).values())]
        for other in known:
            if type(other) is type(thing) and other.laws == thing.laws:
                return with_values, (other, _changes(other, thing))
    raise pickle.PicklingError(
        f"{thing.name} cannot go to another process: its functions have no place there; give it a "
        "name at the top level of a module, from which the other process can import it."
    )


def _same(one: Any, other: Any) -> bool:
    return one is other or (type(one) is type(other) and bool(one == other))


def _modules(function: Any) -> Iterator[str]:
    """The modules that may define what has the function."""
    while isinstance(function, partial):
        function = function.func
    for f in (function, getattr(function, "formula", None)):
        name = getattr(f, "__module__", None)
        if name in sys.modules:
            yield name


def _changes(one: Any, other: Any) -> dict[str, Any]:
    """The fields of another scene that are not those of the one."""
    found = {f.name: getattr(other, f.name) for f in fields(one)}
    if one.groupoid.retraction == other.groupoid.retraction and (
        one.groupoid.name == other.groupoid.name
    ):
        found.pop("groupoid")  # it holds much that is derived
    return {name: value for name, value in found.items() if value != getattr(one, name)}
