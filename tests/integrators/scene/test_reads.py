"""What a user's function reads may be any object: it is read, or opaque, and never a crash."""

from __future__ import annotations

import collections
import ctypes
import dataclasses
import decimal
import functools
import importlib
import sys
import weakref
from types import FunctionType, ModuleType

import gmpy2
import mpmath
import numpy as np
import pytest
import scipy.interpolate
import sympy
from mpmath import mp

from discmech import Scene, Scheme, midpoint, pair
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


#: what a file may hold beside a function `factor`, which gives VALUE: a change has to be noticed
KEEPERS = {
    "an attribute of a function": "def factor():\n    return factor.value\nfactor.value = VALUE",
    "a wrapped function": """
def one(): return 1.0
@functools.wraps(one)
def factor(): return VALUE * one()""",
    "a class that decorates": """
class Scaled:
    def __init__(self, inner, factor):
        functools.update_wrapper(self, inner)
        self.factor = factor
    def __call__(self): return self.factor * self.__wrapped__()
factor = Scaled(lambda: 1.0, VALUE)""",
    "a slot of a base": """
class Base: __slots__ = ("k",)
class Numbers(Base): pass
numbers = Numbers()
numbers.k = VALUE
def factor(): return numbers.k""",
    "an attribute of a dataclass": """
@dataclasses.dataclass
class Numbers: mass: float = 1.0
numbers = Numbers()
numbers.k = VALUE
def factor(): return numbers.k""",
    "a cached property": """
class Numbers:
    @functools.cached_property
    def k(self): return 1.0
numbers = Numbers()
numbers.k = VALUE
def factor(): return numbers.k""",
    "an attribute of a float": """
class Number(float): pass
number = Number(1.0)
number.k = VALUE
def factor(): return number.k""",
    "an attribute of a dictionary": """
class Table(dict): pass
table = Table()
table.k = VALUE
def factor(): return table.k""",
    "a queue": """
class Queue(collections.deque): pass
queue = Queue([VALUE])
def factor(): return queue[0]""",
    "the default of a dictionary": """
table = collections.defaultdict(lambda: VALUE)
def factor(): return table["a"]""",
    "slots of a library": """
class Table(scipy.interpolate.CubicSpline): pass
table = Table([0.0, 1.0, 2.0, 3.0], [VALUE] * 4)
def factor(): return float(table(1.5))""",
    "a function in an object of a library": """
def plain(x): return VALUE * x
vectorized = np.vectorize(plain)
def factor(): return float(vectorized(1.0))""",
    "a function that is made of a text": """
made = sympy.lambdify(sympy.Symbol("x"), sympy.Float(VALUE) * sympy.Symbol("x"))
def factor(): return made(1.0)""",
    "a mask": """
masked = np.ma.array([1.0, 2.0], mask=[VALUE == 2.0, VALUE == 1.0])
def factor(): return float(masked.sum())""",
    "a name that is computed": "ka = VALUE\ndef factor(): return globals()['k' + 'a']",
    "an attribute by a computed name": """
class Numbers: pass
setattr(Numbers, "k1", VALUE)
def factor(): return getattr(Numbers, f"k{1}")""",
    "a bound method of C": "factor = {None: VALUE}.get",
    "a module as an argument": """
conf.k = VALUE
def read(module): return module.k
def factor(): return read(conf)""",
    "a module in a closure": """
conf.k = VALUE
def made(module): return lambda: module.k
factor = made(conf)""",
    "a module as a default": "conf.k = VALUE\ndef factor(module=conf): return module.k",
    "a module by another name": """
conf.k = VALUE
def factor():
    module = conf
    return module.k""",
    "a module in a list": "conf.k = VALUE\nmodules = [conf]\ndef factor(): return modules[0].k",
    "a module in a class": """
class Numbers: module = conf
conf.k = VALUE
def factor(): return Numbers.module.k""",
    "a module from a function": """
conf.k = VALUE
def module(): return conf
def factor(): return module().k""",
    "a module of a module": """
conf.inner = type(conf)("inner")
conf.inner.k = VALUE
def factor(): return conf.inner.k""",
    "a function by the name of a library's": """
@functools.wraps(functools.reduce)
def reduced(): return VALUE
def factor(): return reduced()""",
    "a generator": "stream = iter(lambda: VALUE, None)\ndef factor(): return next(stream)",
    "a default of __call__": """
class Factor:
    def __call__(self, k=VALUE): return k
factor = Factor()""",
    "a name of a class between underscores": """
class Numbers: __k__ = VALUE
def factor(): return Numbers.__k__""",
    "the name by which a class is subscripted": """
class Numbers:
    def __class_getitem__(cls, item): return VALUE
def factor(): return Numbers[0]""",
    "the annotation of a class": """
class Numbers: __annotations__ = {"k": VALUE}
def factor(): return Numbers.__annotations__["k"]""",
    "the documentation of a class": """
class Numbers: __doc__ = "VALUE"
def factor(): return float(Numbers.__doc__)""",
    "metadata of a field": """
@dataclasses.dataclass
class Numbers: mass: float = dataclasses.field(default=1.0, metadata={"k": VALUE})
def factor(): return Numbers.__dataclass_fields__["mass"].metadata["k"]""",
    "a function of an array": """
class Odd(np.ndarray):
    def __array_function__(self, func, types, args, kwargs): return VALUE
odd = np.zeros(2).view(Odd)
def factor(): return np.sum(odd)""",
    "a setter": """
class Numbers:
    @property
    def k(self): return self._k
    @k.setter
    def k(self, value): self._k = VALUE
def factor():
    numbers = Numbers()
    numbers.k = 3.0
    return numbers.k""",
    "a class with the name of a library": """
class Numbers:
    __module__ = "numpy"
    k = VALUE
def factor(): return Numbers.k""",
    "an object of a class with the name of a library": """
class Numbers: pass
Numbers.__module__ = "sympy"
numbers = Numbers()
numbers.k = VALUE
def factor(): return numbers.k""",
    "an attribute of a library's module": """
np.k_of_a_user = VALUE
def factor(): return np.k_of_a_user""",
    "an attribute of a module in a library": """
np.linalg.k_of_a_user = VALUE
def factor(): return np.linalg.k_of_a_user""",
    "an attribute of a library that is imported within": """
np.k_of_a_user = VALUE
def factor():
    from numpy import k_of_a_user
    return k_of_a_user""",
    "a module in a library that is imported within": """
np.linalg.k_of_a_user = VALUE
def factor():
    import numpy.linalg as algebra
    return algebra.k_of_a_user""",
    "a library in a closure": """
np.k_of_a_user = VALUE
def made(library): return lambda: library.k_of_a_user
factor = made(np)""",
    "a library that is handed on": """
np.k_of_a_user = VALUE
def read(library): return library.k_of_a_user
def factor(): return read(np)""",
    "a library as a default": """
np.k_of_a_user = VALUE
def factor(library=np): return library.k_of_a_user""",
    "a library in a list": """
np.k_of_a_user = VALUE
libraries = [np]
def factor(): return libraries[0].k_of_a_user""",
    "a cache with results of earlier values": """
k = VALUE
@functools.cache
def factor(): return k
factor()
k = 3.0""",
    "a bounded cache with results of earlier values": """
k = VALUE
@functools.lru_cache(maxsize=4)
def factor(): return k
factor()
k = 3.0""",
    "a cached property of earlier values": """
k = VALUE
class Numbers:
    @functools.cached_property
    def k(self): return k
    k.func.__module__ = "discmech.integrators"
numbers = Numbers()
numbers.k
k = 3.0
def factor(): return numbers.k""",
}


@pytest.mark.parametrize("keeper", KEEPERS)
def test_a_change_of_anything_that_is_kept_is_noticed(keeper, monkeypatch):
    """Results of a sound method were once remembered for one that was edited on the disk."""

    def seen(value: str) -> str:
        monkeypatch.setitem(sys.modules, "users_file", module := ModuleType("users_file"))
        for library in (np, np.linalg):
            monkeypatch.setattr(library, "k_of_a_user", None, raising=False)
        libraries = (collections, dataclasses, functools, np, scipy, sympy)
        names = vars(module)
        names.update(
            {
                "np": np,
                "conf": ModuleType("conf"),
                **{library.__name__: library for library in libraries},
            }
        )
        exec(KEEPERS[keeper].replace("VALUE", value), names)
        argument = (None,) if "method" in keeper else ()
        assert names["factor"](*argument) == float(value)
        try:
            return reads(names["factor"])
        except Opaque:
            return f"measured anew for {value}"

    assert seen("1.0") != seen("2.0")


def test_a_module_s_own_getattr_counts(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    digests = []
    for value in ("1.0", "2.0"):
        text = f"_values = {{'k': {value}}}\n\ndef __getattr__(name):\n    return _values[name]\n"
        (tmp_path / f"own{value[0]}.py").write_text(text)
        names = {"other": importlib.import_module(f"own{value[0]}"), "__name__": "users_file"}
        exec("def factor(): return other.k", names)
        names["other"].__name__ = "own"
        digests.append(reads(names["factor"]))
    assert len(set(digests)) == 2


class Unasked:
    """A callable that has no signature."""

    @property
    def __signature__(self):
        return fails()

    def __call__(self, x, v, p):
        return v[0] ** 2 / 2 - x[0] ** 2 / 2


def test_a_callable_that_raises_for_its_signature_is_called():
    scene = Scene("s", pair(1), Unasked(), x0=[1], v0=[0], duration=1)
    assert Scheme(scene, midpoint).flow("1/10").trajectory(1).x.shape == (2, 1)


PRECISIONS = {
    "mpmath": (lambda: mpmath.sqrt(2), lambda: mpmath.workdps(30)),
    "mpmath's context": (lambda: mp.dps, lambda: mpmath.workdps(30)),
    "decimal": (lambda: 1 / decimal.Decimal(3), lambda: decimal.localcontext(prec=40)),
    "gmpy2": (lambda: gmpy2.sqrt(2), lambda: gmpy2.context(precision=99)),
}


@pytest.mark.parametrize("package", PRECISIONS)
def test_a_precision_that_is_taken_from_outside_is_noticed(package):
    function, changed = PRECISIONS[package]
    before = reads(function)
    with changed():
        assert reads(function) != before
    assert reads(function) == before


@pytest.mark.skipif(sys.version_info < (3, 14), reason="annotations are evaluated at once")
def test_annotations_of_a_user_are_not_evaluated():
    defined: dict = {}
    exec("def lagrangian(x: Nowhere, v, p):\n    return v[0] ** 2 - x[0] ** 2\n", defined)
    scene = Scene("s", pair(1), defined["lagrangian"], x0=[1], v0=[0], duration=1)
    assert Scheme(scene, midpoint).flow("1/10").trajectory(1).x.shape == (2, 1)
