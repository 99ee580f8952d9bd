"""Frozen records of measurements, and the dictionaries of JSON from which they are read."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

Record = TypeVar("Record")
Key = TypeVar("Key")
Of = TypeVar("Of")
Reader = Callable[[Any], Any]
Json = Mapping[str, Any]
#: metadata of a field that is left out of JSON while it is None, of one that is never in it, and of
#: a field with a mapping of all entries that are no other field's
OPTIONAL, HIDDEN, SPREAD = {"optional": True}, {"key": ""}, {"key": "*"}


@dataclass(frozen=True, slots=True)
class AtMost:
    """The expectation of a study that has one limit."""

    limit: float | None = None


def grouped(things: Iterable[Of], key: Callable[[Of], Key]) -> dict[Key, list[Of]]:
    """Return the things that have a key in common, by this key, all in the order of their first."""
    groups: dict[Key, list[Of]] = {}
    for thing in things:
        groups.setdefault(key(thing), []).append(thing)
    return groups


def decoded(kind: type[Record], content: Any, finite: bool = False) -> Record:
    """Return the record with the entries of a dictionary; a missing entry has its default.

    kind: a dataclass whose fields have defaults; any other type returns the content. Entries that
    are records, or lists and dictionaries of them, are read alike. A field whose key is no Python
    name has it in its metadata, {"key": ...}. finite: True if a float that is not finite counts as
    None.
    """
    if not is_dataclass(kind):
        return kind() if content is None else content
    entries = content if isinstance(content, Mapping) else {}
    made, readers = {}, _readers(kind, finite)
    for name, key, read in readers:
        if key == "*":
            others = {key for _, key, _ in readers}
            made[name] = read({k: value for k, value in entries.items() if k not in others})
        elif key in entries:
            made[name] = read(entries[key])
    return kind(**made)


def read(hint: Any, content: Any) -> Any:
    """Return the value of a type, such as a list of records, from JSON (`decoded`)."""
    return _reader(hint, False)(content)


def encoded(thing: Any) -> Any:
    """Return a record, or what holds records, as dictionaries that JSON can hold.

    A field that is `optional` is left out while it is None.
    """
    if (kind := type(thing)) in _SCALARS:  # most are, and a result has a million
        return thing
    if is_dataclass(kind):
        made: dict[str, Any] = {}
        for name, key, optional in _keys_of(kind):
            value = getattr(thing, name)
            if key == "*":
                made |= encoded(value)
            elif key and not (optional and value is None):
                made[key] = value if type(value) in _SCALARS else encoded(value)
        return made
    if isinstance(thing, Mapping):
        return {key: encoded(value) for key, value in thing.items()}
    if isinstance(thing, list | tuple):
        return [e if type(e) in _SCALARS else encoded(e) for e in thing]
    return thing


_SCALARS = frozenset((bool, float, int, str, NoneType))


@cache
def _keys_of(kind: Any) -> list[tuple[str, str, bool]]:
    """Return (name, key, True if it is left out while it is None) of each field."""
    return [(one.name, one.metadata.get("key", one.name), bool(one.metadata.get("optional")))
            for one in fields(kind)]  # fmt: skip


@cache
def _readers(kind: Any, finite: bool) -> list[tuple[str, str, Reader]]:
    """Return (name, key, function that reads the entry) of each field."""
    hints = get_type_hints(kind)
    return [(one.name, one.metadata.get("key", one.name), _reader(hints[one.name], finite))
            for one in fields(kind)]  # fmt: skip


def _reader(hint: Any, finite: bool) -> Reader:
    """Return the function that reads an entry of that type."""
    parts = get_args(hint)
    if get_origin(hint) in (Union, UnionType):
        others = [part for part in parts if part is not NoneType]
        inner = _reader(others[0], finite) if len(others) == 1 else _as_given
        return lambda value: None if value is None else inner(value)
    if is_dataclass(hint):
        return lambda value: decoded(hint, value, finite)  # type: ignore[arg-type]
    if get_origin(hint) in (list, Sequence):
        inner = _reader(parts[0], finite)
        if inner is _as_given:
            return lambda values: list(values or ())
        return lambda values: [inner(value) for value in values or ()]
    if get_origin(hint) in (dict, Mapping):
        inner = _reader(parts[1], finite)
        return lambda values: {key: inner(value) for key, value in (values or {}).items()}
    return number if hint is float and finite else _as_given


def _as_given(value: Any) -> Any:
    return value


def number(value: Any) -> float | None:
    """Return a finite float, or None for anything else (None, NaN, infinities, words)."""
    if value is None or isinstance(value, bool):
        return None
    try:
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        return None
    return result if math.isfinite(result) else None
