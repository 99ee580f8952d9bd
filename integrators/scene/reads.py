"""A digest of everything that a user's object depends on: its fields, and what its functions read.

A function of a scene, a rule or a groupoid may read a global, a list, a variable of its file or a
value of the enclosing function. Results for such an object are remembered under this digest too, so
that a changed value is noticed.

An object is read only if all that it is made of was read: its class, its attributes, the slots of
every base, and what a base that is written in C keeps. Any other object is opaque, and so is a
function that makes names while it runs: what it reads cannot be told from its text. Of a module
those attributes are read that code names beside the name of the module; one that code hands on, or
that is met in any other way, as an argument or in a list, is opaque. So is a cache that keeps
results of a user's function, which may be those of earlier values.
"""

from __future__ import annotations

import hashlib
import inspect
import pickle
import sys
import sysconfig
from collections import deque
from collections.abc import Callable, Iterator, Set
from dataclasses import fields, is_dataclass
from fractions import Fraction
from functools import cached_property, lru_cache, partial, wraps
from io import BytesIO
from types import (
    BuiltinFunctionType,
    CodeType,
    EllipsisType,
    FunctionType,
    GetSetDescriptorType,
    MappingProxyType,
    MemberDescriptorType,
    MethodDescriptorType,
    MethodType,
    ModuleType,
    WrapperDescriptorType,
)
from typing import Any, TypeVar

import numpy as np

from ..files import encoded
from ..numbers import LazyModule
from .names import attributes_in, imported_in, names_in, packages

_Made = TypeVar("_Made", bound=Callable[..., Any])

#: packages whose functions are known by name: their versions or texts are part of other keys
_LIBRARIES = sys.stdlib_module_names - {"__main__"} | {
    "discmech", "flint", "gmpy2", "jax", "jaxlib", "llvmlite", "matplotlib", "mpmath",
    "numba", "numpy", "scipy", "sympy", "torch",
}  # fmt: skip
#: with these a function can read objects that its text does not name
_ANYTHING = frozenset((
    "__dict__", "__import__", "attrgetter", "eval", "exec", "getattr", "globals", "import_module",
    "input", "locals", "modules", "open", "read_bytes", "read_text", "vars",
))  # fmt: skip
#: the results of these may change while everything visible here stays the same
_CHANGING = frozenset((
    "io", "os", "posix", "random", "secrets", "socket", "sqlite3", "subprocess", "time", "urllib",
))  # fmt: skip
#: so may the results of these functions of numpy and scipy
_OF_FILES = frozenset((
    "fromfile", "genfromtxt", "load", "loadmat", "loadtxt", "memmap", "random",
))  # fmt: skip
#: the precision that these take from where they are called, beside their arguments
_PRECISION: dict[str, Callable[[Any], object]] = {
    "mpmath": lambda mpmath: mpmath.mp.prec,
    "decimal": lambda decimal: (decimal.getcontext().prec, decimal.getcontext().rounding),
    "gmpy2": lambda gmpy2: gmpy2.get_context().precision,
}
_SLOTS = (GetSetDescriptorType, MemberDescriptorType)
#: what the class of an object of C has in place of functions
_OF_C = (MethodDescriptorType, WrapperDescriptorType)
_FUNCTIONS = (FunctionType, MethodType, BuiltinFunctionType)
#: where what a class wraps has its functions
_WRAPPED = {classmethod: ("__func__",), staticmethod: ("__func__",), cached_property: ("func",),
            property: ("fget", "fset", "fdel")}  # fmt: skip
#: what Python writes into a class, from its place in a text or of what the other parts say
_OF_PYTHON = frozenset((
    "__annotations_cache__", "__firstlineno__", "__module__", "__static_attributes__", "_abc_impl",
))  # fmt: skip
_IN_MEMORY = 1 << 9  # the flag of a class that Python made, or that is made as Python makes them
_STANDARD = tuple({sysconfig.get_path(of) for of in ("stdlib", "platstdlib")})
#: types whose repr() shows all that their objects keep
_PLAIN = (
    type(None), bool, int, float, complex, Fraction, str, bytes, bytearray, range, slice,
    EllipsisType,
)  # fmt: skip
#: types of C that keep objects
_HOLDERS = (dict, MappingProxyType, set, frozenset, list, tuple, deque)
MOST = 20_000  # largest number of parts of an object that is remembered
#: a program's step may call anything in these packages except what reads files, clocks or chance
_PURE = frozenset((
    "__future__", "_operator", "abc", "builtins", "cmath", "collections", "copyreg", "dataclasses",
    "decimal", "discmech", "enum", "fractions", "functools", "gmpy2", "itertools", "math", "mpmath",
    "numbers", "numpy", "operator", "scipy", "statistics", "sympy", "types", "typing",
))  # fmt: skip
_OUTSIDE = frozenset((
    "ctypeslib", "datasets", "default_rng", "fromfile", "genfromtxt", "input", "io", "load",
    "loadmat", "loadtxt", "memmap", "open", "rand", "random", "randn", "standard_normal",
))  # fmt: skip


class Opaque(Exception):
    """An object for which a change cannot be detected; its argument says what it is."""


class _Asked:
    """Arguments of a function with their digest; equal ones have both equal."""

    def __init__(self, seen: str, arguments: tuple[Any, ...]) -> None:
        self.seen, self.given = seen, arguments

    def __hash__(self) -> int:
        return hash(self.seen)

    def __eq__(self, other: object) -> bool:
        try:
            return isinstance(other, _Asked) and bool(
                self.seen == other.seen and self.given == other.given
            )
        except Exception:  # an object of a user compares as it likes
            return False


def reads(*things: object, pure: bool = False) -> str:
    """Return the digest; raises `Opaque` for an object that hides its content.

    pure: True to refuse also functions that may read something outside of objects: files, clocks,
    chance or compiled code, of which only the name is known.
    """
    return _Reader(pure).digest(things)


def remembered(maxsize: int) -> Callable[[_Made], _Made]:
    """Decorator: `lru_cache` whose key includes what functions among the arguments read.

    Results for arguments that are opaque or cannot be compared are computed anew each time.
    """

    def decorate(function: _Made) -> _Made:
        @lru_cache(maxsize=maxsize)
        def made(asked: _Asked) -> Any:
            return function(*asked.given)

        @wraps(function)
        def asked(*arguments: Any) -> Any:
            try:
                seen = reads(*arguments)
            except Opaque:
                return function(*arguments)
            return made(_Asked(seen, arguments))

        asked.cache_clear = made.cache_clear  # type: ignore[attr-defined]
        return asked  # type: ignore[return-value]

    return decorate


class _Reader:
    """One walk over an object; a part that was seen before is replaced by its number."""

    def __init__(self, pure: bool = False) -> None:
        self.pure = pure
        self.whole, self.seen, self.kept = hashlib.sha256(), dict[int, int](), list[object]()

    def digest(self, thing: object) -> str:
        try:
            self.add(thing)
        except Opaque:
            raise
        except Exception as error:  # attributes, comparison and repr may raise anything
            raise Opaque(f"an object that raises {type(error).__name__} when it is read") from None
        return self.whole.hexdigest()

    def say(self, *words: object) -> None:
        for word in words:
            said = word if isinstance(word, bytes) else encoded(str(word))
            self.whole.update(said + b"\0")

    def add(self, thing: Any) -> None:
        """Add any object to the digest, by its type: what it says of itself may be anything."""
        kind = type(thing)
        if kind in _PLAIN:
            self.content(thing, kind)
            return
        if id(thing) in self.seen:
            self.say("again", self.seen[id(thing)])
            return
        self.seen[id(thing)] = len(self.seen)
        self.kept.append(thing)  # keeps the object alive, so that its id stays unique
        if len(self.seen) > MOST:
            raise Opaque("a thing of too many parts")
        if issubclass(kind, (*_FUNCTIONS, partial)):
            self.function(thing)
        elif issubclass(kind, ModuleType):
            raise Opaque(f"the module {thing.__name__}, any attribute of which may be read")
        elif kind is LazyModule:
            self.say("module", thing._name)
            self.known(thing._name)
        elif issubclass(kind, type):
            self.of_class(thing)
        elif kind is CodeType:
            self.code(thing)
        elif _library_of(kind) and hasattr(thing, "__wrapped__"):  # by a cache
            self.add(thing.__wrapped__)
            cached = hasattr(thing, "cache_info") and thing.cache_info().currsize
            if cached and not _library_of(thing.__wrapped__):
                raise Opaque(f"a cache that keeps results of {thing.__qualname__}")
            self.attributes(thing)
        else:
            self.instance(thing)

    def content(self, thing: Any, kind: Any) -> None:
        """Add what a type of C keeps in an object of it, or of a class made of it."""
        if kind is int:
            self.say("int", int.__format__(thing, "x"))  # long integers are not written in decimal
        elif kind in _PLAIN:
            self.say(kind.__name__, kind.__repr__(thing))
        elif kind in (np.ndarray, np.generic) and thing.dtype.kind != "O":
            self.say("array", thing.dtype.str, thing.shape, np.ascontiguousarray(thing).tobytes())
        elif kind in (dict, MappingProxyType):
            self.say("mapping", len(items := list(kind.items(thing))))
            for key, value in items:
                self.add(key)
                self.add(value)
        elif kind in (set, frozenset):
            self.say("set", *sorted(reads(e, pure=self.pure) for e in kind.__iter__(thing)))
        else:
            self.say(kind.__name__, getattr(thing, "shape", len(thing)))
            for entry in kind.__iter__(thing):
                self.add(entry)

    def function(
        self, thing: FunctionType | MethodType | BuiltinFunctionType | partial[Any]
    ) -> None:
        """Add a function: its bytecode, its defaults, and the outside values that it reads."""
        if isinstance(thing, partial):
            self.add([thing.func, thing.args, thing.keywords])
            return
        if isinstance(thing, MethodType):
            self.add([thing.__func__, thing.__self__])
            return
        known = _library_of(thing)
        self.say("function", known, thing.__qualname__)
        if known or not isinstance(thing, FunctionType):
            self.known(known or thing.__qualname__, {thing.__name__})
        if not isinstance(thing, FunctionType):
            if not _is_library(thing.__module__):
                raise Opaque(f"{thing.__qualname__}, which is compiled")
            if not isinstance(thing.__self__, ModuleType):  # of a method of C, such as {}.get
                self.add(thing.__self__)
            return
        self.add([thing.__defaults__, thing.__kwdefaults__])
        free = thing.__code__.co_freevars
        for name, cell in zip(free, thing.__closure__ or (), strict=True):
            try:
                self.named(cell.cell_contents, thing.__code__, name)
            except ValueError:  # the cell is still empty
                self.say("empty")
        if known:
            if hasattr(thing, "__wrapped__"):
                self.add(thing.__wrapped__)
        else:
            self.add(vars(thing))
            self.code(thing.__code__)
            names = names_in(thing.__code__)
            if hidden := names & (_ANYTHING | _OUTSIDE if self.pure else _ANYTHING):
                raise Opaque(f"{thing.__qualname__}, which may read anything by {min(hidden)}")
            for level, name in sorted(imported_in(thing.__code__)):
                if level or not _is_library(name):
                    raise Opaque(f"{thing.__qualname__}, which imports {name or 'its package'}")
                self.known(name, names)
                for module in packages(name):
                    self.of_module(module, thing.__code__, names)
            for name in sorted(names & thing.__globals__.keys()):
                self.named(thing.__globals__[name], thing.__code__, name)

    def known(self, name: str, asked: Set[str | None] = frozenset()) -> None:
        """Add the precision that it is called with, since nothing but its name is known.

        Raises `Opaque` if that is not enough.

        asked: the attributes of it that are read.
        """
        package = name.partition(".")[0]
        if package in _PRECISION and package in sys.modules:
            self.say("precision", _PRECISION[package](sys.modules[package]))
        if package in _CHANGING or (self.pure and package not in _PURE):
            raise Opaque(f"{name}, of which nothing but the name is known")
        if package in ("numpy", "scipy") and (read := _OF_FILES & asked):
            raise Opaque(f"{min(read)} of {name}, which reads what may change")

    def named(self, thing: object, code: CodeType, name: str, inside: bool = False) -> None:
        """Add the value of a name in code; of a module the attributes that the code reads.

        inside: True for the name of an attribute of a module.
        """
        self.say(name)
        if not isinstance(thing, ModuleType):
            self.add(thing)
            return
        asked = attributes_in(code, name, inside)
        if None in asked:
            raise Opaque(f"the module {thing.__name__}, which a function hands on")
        self.of_module(thing, code, asked)

    def of_module(self, module: ModuleType, code: CodeType, asked: Set[str | None]) -> None:
        """Add those attributes of a module, also of a library's, that code asks for."""
        self.say("module", module.__name__)
        if _is_library(module.__name__):
            self.known(module.__name__, asked)
        for attribute in sorted(vars(module).keys() & {*asked, "__getattr__"}):
            self.named(vars(module)[attribute], code, attribute, inside=True)

    def code(self, code: CodeType) -> None:
        """Add instructions and constants of code, without comments and line numbers."""
        self.say("code", code.co_code, code.co_names, code.co_varnames, code.co_freevars)
        self.say(code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount)
        self.say(code.co_flags & (inspect.CO_VARARGS | inspect.CO_VARKEYWORDS))
        self.say(code.co_exceptiontable)
        for constant in code.co_consts:
            self.add(constant)

    def of_class(self, thing: type) -> None:
        """Add everything that a class and its bases contain."""
        known = _library_of(thing)
        self.say("class", known, thing.__qualname__)
        if known:
            self.known(known)
            return
        if _is_compiled(thing):
            raise Opaque(f"{thing.__qualname__}, which is compiled")
        self.add([type(thing), *thing.__bases__])
        for name, value in vars(thing).items():
            if name not in _OF_PYTHON and not isinstance(value, _SLOTS):
                self.say(name)
                if name == "__annotations__":  # types, also those that only a string names
                    self.say(repr(value))
                    continue
                wrapped = _WRAPPED.get(type(value))
                self.add([getattr(value, word) for word in wrapped] if wrapped else value)

    def instance(self, thing: object) -> None:
        """Add an instance: its class, its attributes and slots, and what its bases of C keep."""
        kind = type(thing)
        self.add(kind)
        # the class of an undefined function f(x) of sympy has no module
        named = kind.__module__ or type(kind) is type
        package = _library_of(kind if named else type(kind)).partition(".")[0]
        bases = [base for base in kind.__mro__[:-1] if base in _KEEPERS]
        if package == "discmech" and is_dataclass(thing):  # all fields, including new ones
            for field in fields(thing):
                self.say(field.name)
                self.add(getattr(thing, field.name))
        elif package == "mpmath" and hasattr(thing, "_mpf_"):
            self.add(thing._mpf_)
        elif package in ("sympy", "gmpy2", "mpmath"):
            try:
                self.say(repr(thing))
            except ValueError:  # a number with too many digits
                raise Opaque(f"{kind.__name__}") from None
        elif package not in ("", "discmech") and not bases:
            self.pickled(thing)
        else:
            hidden = [
                c for c in kind.__mro__[:-1] if _is_compiled(c) and c not in _KEEPERS
                and not (_library_of(c) and issubclass(c, tuple(bases)))
            ]  # fmt: skip
            if hidden:
                raise Opaque(f"{kind.__name__}, a {hidden[0].__name__}, which is compiled")
            if bases:
                self.content(thing, bases[0])
            self.attributes(thing)

    def attributes(self, thing: object) -> None:
        """Add the attributes of an object, and the slots of all its bases, with their names."""
        for name, value in _attributes_of(thing):
            self.say(name)
            self.add(value)

    def pickled(self, thing: object) -> None:
        """Add an object of a library by its pickle, in which objects of the user are read."""
        written = BytesIO()
        try:
            _Pickler(written, self).dump(thing)
        except Opaque:
            raise
        except Exception:  # a lock, a file, a generator
            raise Opaque(f"{type(thing).__name__}") from None
        self.say(written.getvalue())


class _Pickler(pickle.Pickler):
    """A pickler that reads what is not of a library, where others write its name alone."""

    def __init__(self, file: BytesIO, reader: _Reader) -> None:
        super().__init__(file)
        self.reader = reader

    def persistent_id(self, part: Any) -> str | None:
        if type(part) is not MappingProxyType and _library_of(
            part if isinstance(part, (*_FUNCTIONS, type)) else type(part)
        ):
            return None
        self.reader.add(part)
        return "read"


#: types of C whose content `_Reader.content` adds
_KEEPERS = (*_PLAIN, *_HOLDERS, np.ndarray, np.generic)


def _attributes_of(thing: object) -> Iterator[tuple[str, Any]]:
    """Yield names and values, but those of cached properties of ours: others make them."""
    kind: type = type(thing)
    for name, value in sorted(getattr(thing, "__dict__", {}).items()):
        if not _is_made(kind, name):
            yield name, value
    for name, slot in _slots_of(kind):
        try:
            yield name, slot.__get__(thing, kind)
        except AttributeError:  # nothing was ever put there
            yield name, None


@lru_cache(maxsize=4096)
def _is_made(kind: type, name: str) -> bool:
    """Whether an attribute of that name is a cached property of ours."""
    made = inspect.getattr_static(kind, name, None)
    return isinstance(made, cached_property) and "discmech." in _library_of(made.func)


@lru_cache(maxsize=4096)
def _slots_of(kind: type) -> list[tuple[str, MemberDescriptorType]]:
    """Return the slots of a class and of its bases, which only its making gives it."""
    return [(name, slot) for base in kind.__mro__ for name, slot in vars(base).items()
            if isinstance(slot, MemberDescriptorType)]  # fmt: skip


def _is_library(module: object) -> bool:
    """Whether the module, as an object names it, is one of a known library.

    A file of a user may have the name of a standard module.
    """
    name = "builtins" if module is None else module
    top = name.partition(".")[0] if type(name) is str else ""
    file = getattr(sys.modules.get(top), "__file__", None) or _STANDARD[0]
    of_user = top in sys.stdlib_module_names and not file.startswith(_STANDARD)
    return top in _LIBRARIES and not of_user


def _library_of(thing: Any) -> str:
    """Return the library whose text defines a class or a function; empty for those of a user.

    The name that a function gives of its module may be of another one, that it wraps; a class may
    give any name.
    """
    if isinstance(thing, FunctionType):
        name = str(thing.__globals__.get("__name__"))
        own = getattr(sys.modules.get(name), "__dict__", None) is thing.__globals__
    else:
        name, own = thing.__module__, True
        if issubclass(type(thing), type) and thing.__flags__ & _IN_MEMORY and _is_library(name):
            part: Any = sys.modules.get(name)
            for word in thing.__qualname__.split("."):
                part = getattr(part, word, None)
            own = part is thing
    return str(name) if own and name and _is_library(name) else ""


@lru_cache(maxsize=4096)
def _is_compiled(kind: type) -> bool:
    """Whether a class is written in C, so that the content of its objects is not to be seen."""
    return any(type(e) in _OF_C and e.__objclass__ is kind for e in vars(kind).values())
