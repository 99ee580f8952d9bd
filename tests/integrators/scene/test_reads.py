"""What a user's function reads may be any object: it is read, or opaque, and never a crash."""

from __future__ import annotations

import ctypes
import functools
import weakref
from types import FunctionType

import numpy as np
import pytest

from discmech.integrators.scene import Opaque, reads, remembered


def an_object(*, bases: tuple[type, ...] = (), meta: type = type, **has: object):
    """Make objects, each with its number, of a class that has these attributes."""

    def made(number):
        thing = meta("Odd", bases, has)()
        object.__setattr__(thing, "number", number)
        return thing

    return made


def fails(*given: object):
    raise RuntimeError("nobody may ask")


class Lying(type):
    __module__ = property(fails)


class Slotted:
    __slots__ = ("number",)

    def __init__(self, number):
        self.number = number


class Point(ctypes.Structure):
    _fields_ = (("number", ctypes.c_int),)


def in_turn(number):
    yield number


def compiled(number):
    """Return a function in C of a package that nobody knows."""
    return ctypes.CFUNCTYPE(ctypes.c_int)(lambda: number)


ODD = {
    "a property that raises": an_object(size=property(fails)),
    "an attribute that raises": an_object(__getattr__=fails),
    "every attribute raises": an_object(__getattribute__=fails),
    "each attribute is the object": an_object(__getattr__=lambda self, name: self),
    "it cannot be compared": an_object(__eq__=fails, __hash__=lambda self: 1),
    "it is equal to nothing": an_object(__eq__=lambda self, other: False, __hash__=None),
    "equality is an array": an_object(__eq__=lambda a, b: np.zeros(2), __hash__=lambda self: 1),
    "it has no hash": an_object(__hash__=None),
    "its hash raises": an_object(__hash__=fails),
    "it cannot be copied": an_object(__reduce__=fails, __reduce_ex__=fails, __getstate__=fails),
    "its class is said to be list": an_object(__class__=property(lambda self: list)),
    "its class is said to be a function": an_object(__class__=property(lambda self: FunctionType)),
    "its class is said to be a class": an_object(__class__=property(lambda self: type)),
    "its class raises": an_object(__class__=property(fails)),
    "its repr raises": an_object(__repr__=fails, __str__=fails),
    "a float whose repr raises": an_object(bases=(float,), __repr__=fails),
    "a list that cannot be read": an_object(bases=(list,), __iter__=fails, __len__=fails),
    "a dict that cannot be read": an_object(bases=(dict,), items=fails, __len__=fails),
    "its class has no name of a module": an_object(meta=Lying),
    "its module is a number": an_object(__module__=3),
    "its module is None": an_object(__module__=None),
    "its module is a slot": lambda number: type("Odd", (), {"__slots__": ("__module__",)}),
    "its attributes cannot be listed": an_object(__dict__=property(fails), __dir__=fails),
    "slots": Slotted,
    "a weak reference": lambda number: weakref.ref(ODD["slots"].__class__),
    "a generator": in_turn,
    "an array of C": Point,
    "a pointer": lambda number: ctypes.pointer(ctypes.c_int(number)),
    "memory": lambda number: memoryview(bytes([number])),
    "a function in C": compiled,
    "an object of C": lambda number: ctypes.c_int(number),
    "a wrapper that wraps itself": an_object(__wrapped__=property(lambda self: self)),
    "a part of a function": lambda number: functools.partial(in_turn, number),
}  # fmt: skip


def seen(thing: object) -> str | None:
    try:
        return reads(thing)
    except Opaque:
        return None


@pytest.mark.parametrize("odd", ODD.values(), ids=ODD)
def test_an_odd_object_is_read_or_opaque(odd):
    one, two = odd(1), odd(2)

    def rule():
        return one

    for held in (one, type(one), rule, [one], {"k": one}, (one,), functools.partial(rule, one)):
        assert seen(held) is None or seen(held) == seen(held)
    other = seen(two)
    assert seen(one) is None or seen(one) != other or isinstance(one, type)
    answer = remembered(8)(lambda *given: given)
    for _ in range(2):
        assert all(a is b for a, b in zip(answer(one, 1), (one, 1), strict=True))


def test_what_cython_compiled_is_opaque():
    cython = pytest.importorskip("yaml._yaml", reason="PyYAML was built without libyaml")

    def imports_a_class():
        from yaml._yaml import CParser

        return CParser

    for thing in (cython.get_version_string, cython.CParser, imports_a_class):
        with pytest.raises(Opaque, match=r"compiled|name is known"):
            reads(thing, pure=True)


def test_arguments_that_have_no_hash_are_remembered_by_what_they_hold():
    asked = []
    length = remembered(8)(lambda given: asked.append(0) or len(given))
    given = [1, 2]
    assert (length(given), length([1, 2]), len(asked)) == (2, 2, 1)
    given.append(3)
    assert (length(given), length([1, 2])) == (3, 2)
