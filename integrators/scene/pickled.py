"""Pickling of rules, scenes, schemes and flows by the names of their parts.

Functions cannot be pickled, so an object is pickled as its name in the module that defines it; a
scene with other values is pickled as that of its module and the values.
"""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields
from fractions import Fraction
from functools import partial
from importlib import import_module
from typing import Any, TypeAlias

from ..hooks import compose, getters

Again = tuple[Callable[..., Any], tuple[Any, ...]]
#: a rule, a scene, a lattice, a scheme or a flow, of rooms that come after this one
Picklable: TypeAlias = Any


def held(module: str, name: str) -> Any:
    """Return the object that a module has under a name, such as a class's attribute, A.b."""
    thing: Any = import_module(module)
    for part in name.split("."):
        thing = getattr(thing, part)
    return thing


def called(get: Callable[[str], Any], name: str) -> Picklable:
    """Return the object that one of `hooks.getters` finds under a name, or None."""
    try:
        return get(name)
    except ValueError:  # BadInput
        return None


def with_values(thing: Picklable, changes: dict[str, Any]) -> Picklable:
    """Return a copy with other values."""
    return thing.with_values(**changes)


def composed(base: Picklable, method: str) -> Picklable:
    """Return a composition of a rule."""
    return compose(base, method)


def flow_of(
    scheme: Picklable, step: Fraction, digits: int, on_edge: str, more: dict[str, Any]
) -> Picklable:
    """Return the flow of a scheme, with its attributes restored."""
    flow = scheme.flow_at(step, digits, on_edge)
    vars(flow).update(more)
    return flow


def again(thing: Picklable, functions: Iterable[object]) -> Again:
    """Return the pickled form of a rule, a scene or a lattice that is given by these functions.

    Raises `pickle.PicklingError`, with the fix, if there is none.
    """
    for get in getters:
        if _same(called(get, thing.name), thing):
            return called, (get, thing.name)
    modules = dict.fromkeys(m for f in functions for m in _modules(f))
    for module in modules:
        for name, other in list(vars(sys.modules[module]).items()):
            if _same(other, thing):
                return held, (module, name)
    base = getattr(thing, "base", None)
    if base is not None and _same(composed(base, thing.method.name), thing):
        return composed, (base, thing.method.name)
    if hasattr(thing, "laws"):
        known = [called(get, thing.name) for get in getters]
        known += [other for m in modules for other in list(vars(sys.modules[m]).values())]
        for other in known:
            if type(other) is type(thing) and other.laws == thing.laws:
                return with_values, (other, _changes(other, thing))
    raise pickle.PicklingError(
        f"{thing.name} cannot go to another process: its functions have no place there; give it a "
        "name at the top level of a module, from which the other process can import it."
    )


def _same(one: object, other: object) -> bool:
    return one is other or (type(one) is type(other) and bool(one == other))


def _modules(function: object) -> Iterator[str]:
    """Yield the modules that may define an object with this function."""
    while isinstance(function, partial):
        function = function.func
    for f in (function, getattr(function, "formula", None)):
        name = getattr(f, "__module__", None)
        if name in sys.modules:
            yield name


def _changes(one: Picklable, other: Picklable) -> dict[str, Any]:
    """Return the fields in which another scene differs from `one`."""
    values = {f.name: getattr(other, f.name) for f in fields(one)}
    if one.groupoid.retraction == other.groupoid.retraction and (
        one.groupoid.name == other.groupoid.name
    ):
        values.pop("groupoid")  # it holds many derived expressions
    return {name: value for name, value in values.items() if value != getattr(one, name)}
