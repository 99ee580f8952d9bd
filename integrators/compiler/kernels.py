"""Kernels of a step: their text comes from the cache; Python runs it, or LLVM compiles it."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from types import MappingProxyType, SimpleNamespace
from typing import Any, Protocol

from ..numbers import Arithmetic, Double, Multiple, Number, Numbers, run_text, uncollected
from ..numbers.types import Namespace
from .cache import cached_text, digest, sources
from .lanes import lane_namespace, tables
from .layout import INNER, PAST, Entry, Layout, StageLayout, Status
from .llvm_values import Array
from .machine_code import compiled, vector_width
from .module_text import CAREFUL, module_text
from .stage_system import StageSource
from .stage_text import text_of_stages
from .step import Step, written

#: the arrays among the arguments of a driver that are no rows of floats
ARRAYS = {"state": Array("f"), "totals": Array("f"), "kinds": Array("i"), "counts": Array("i"),
          "ranges": Array("i", columns=2), "segments": Array("i", columns=4)}  # fmt: skip
LONGEST = 60  # longest part of a scene's name in a file name, which the digest makes unique


@dataclass(frozen=True, eq=False)
class Kernels:
    """The functions of one system in one arithmetic.

    advance: the driver (`driver.advance`). prepare: q ↦ c, and carry: (x, c) ↦ k, one each for the
    rule and for its adjoint. affine: for each, True if one correction solves a substep. huge: a
    number larger than any size. careful: returns kernels with row exchanges in each elimination and
    with bounds of the rows' round-off, or None if these kernels are the same.
    """

    advance: Callable[..., tuple[int, int]]
    prepare: tuple[Callable[[Numbers], Sequence[Number]], ...]
    carry: tuple[Callable[[Numbers, Numbers], Sequence[Number]], ...]
    affine: tuple[bool, ...]
    layout: Layout
    huge: Number
    careful: Callable[[], Kernels | None] | None = None


class Named(Protocol):
    """What has a name, which its generated files bear."""

    @property
    def name(self) -> str:
        """Of the scene or lattice."""


@lru_cache(maxsize=512)
def compile(system: Step, numbers: Arithmetic, omit: frozenset[str] = frozenset()) -> Kernels:
    """Return a system's kernels: machine code in double precision, else Python functions.

    omit: see `KernelText`.
    """
    text = kernel_text(system, omit)
    if type(numbers) is not Double:
        # Newton ends when the sum of |w| shows no change, but velocities beside impulses, which
        # have another unit, may still change: hence the wide margin
        wide = isinstance(numbers, Multiple) and bool(system.multipliers)
        more = {"MARGIN": numbers.number(2**120)} if wide else {}
        kernels = interpreted(text, numbers, **more)
    else:
        kernels = compiled_text(system, text)
    return replace(kernels, careful=partial(_careful, system, numbers, omit))


def _careful(system: Step, numbers: Arithmetic, omit: frozenset[str]) -> Kernels | None:
    more = omit | {CAREFUL}
    return None if more == omit else compile(system, numbers, more)


@lru_cache(maxsize=16)
def compiled_text(system: Step, text: str) -> Kernels:
    """Compile a text that `kernel_text` made to machine code."""
    return _kernels(run_kernels(system, text, Double()))


def run_kernels(
    system: Named,
    text: str,
    numbers: Arithmetic,
    namespace: Mapping[str, object] = MappingProxyType({}),
    constants: Callable[[], Namespace] = dict,
) -> Namespace:
    """Return the names of a text, in double precision with its `advance` as machine code.

    namespace: what the text may use; constants: returns more of it, called only if they are
    needed.
    """
    if type(numbers) is not Double:
        return names_of(text, numbers, **namespace, **constants())
    names = names_of(text, numbers, **namespace)
    arrays = ARRAYS | {word: Array("f", columns=width) for word, width in names["WIDTHS"].items()}
    advance = compiled(file_name(system), text, names, arrays, constants)
    return {**names, "advance": advance}


def interpreted(text: str, numbers: Arithmetic, **names: object) -> Kernels:
    """Return kernels that Python runs, from a text of `kernel_text` and additional names."""
    return _kernels(names_of(text, numbers, **names))


@lru_cache(maxsize=512)
@uncollected()
def kernel_text(system: Step, omit: frozenset[str] = frozenset()) -> str:
    """Return the text of a system's kernels and driver, derived if the cache does not hold it."""
    # the constants' values may decide what is omitted (`omissions`)
    constants = [str(value(60)) for value in system.constants.values()]
    path = f"{file_name(system)}_{text_key(system, *sorted(omit), *constants)}.py"
    return cached_text(path, lambda: module_text(system, omit))


@lru_cache(maxsize=512)
def compile_stages(source: StageSource, numbers: Arithmetic) -> Kernels:
    """Return the kernels of a collocation step, like `compile` for a system.

    Raises `NoShortForm` if the mass matrix couples too many velocities.
    """
    path = f"{file_name(source)}_stages_{text_key(source.nodes, source.given)}.py"
    text = cached_text(path, lambda: text_of_stages(source.derived()))
    return _kernels(run_kernels(source, text, numbers, *at_nodes(source, numbers)))


def at_nodes(source: StageSource, numbers: Arithmetic) -> tuple[Namespace, Callable[[], Namespace]]:
    """Return the names that lanes need, and a function that returns the tables of the nodes."""
    names = lane_namespace(source.nodes.count, numbers, vector_width())
    return names, partial(tables, source.nodes, source.nodes.count, names["WIDTH"], numbers)


def text_key(*parts: object) -> str:
    """Return a digest of systems, expressions and words, for the name of a generated file."""
    return digest(sources(), written(*parts))


def file_name(system: Named) -> str:
    """Return the beginning of the names of a system's generated files."""
    # the name has no rule in it: on a group all simple rules share their kernels
    return re.sub(r"\W", "_", system.name)[:LONGEST]


def names_of(text: str, numbers: Arithmetic, **more: object) -> Namespace:
    """Run a text with Python and return its functions and constants; more: names it may use."""
    codes = {word: int(e) for kind in (Status, Entry) for word, e in kind.__members__.items()}
    names = {"Layout": Layout, "StageLayout": StageLayout, "Record": SimpleNamespace,
             "PAST": PAST, "INNER": INNER, **codes}  # fmt: skip
    return run_text(text, {**names, **numbers.namespace(), **more})


def _kernels(names: Namespace) -> Kernels:
    return Kernels(
        names["advance"], of_each("prepare", names), of_each("carry", names),
        of_each("affine", names), names["LAYOUT"], names["HUGE"],
    )  # fmt: skip


def of_each(word: str, names: Namespace) -> tuple[Any, ...]:
    """Return what the rule and its adjoint have by that word, in the names of a text."""
    return tuple(getattr(system, word) for system in names["SYSTEMS"])
