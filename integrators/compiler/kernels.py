"""Kernels of a step: their text comes from the cache; Python runs it, or LLVM compiles it."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from types import MappingProxyType, SimpleNamespace
from typing import Any

from ..numbers import Arithmetic, Double, Multiple, Number, Numbers, run_text, uncollected
from ..numbers.types import Namespace
from .cache import cached_text, digest, sources
from .elimination import ADJUGATE
from .known_zeros import KNOWN_ZEROS
from .lanes import lane_namespace, tables
from .lattice_text import LatticeSystem, lattice_text
from .layout import INNER, PAST, Entry, Layout, StageLayout, Status
from .llvm_values import Array
from .machine_code import compiled, vector_width
from .module_text import module_text
from .stage_system import LatticeStages, StageSource
from .stage_text import stage_text
from .step import Step, written

#: the arrays among the arguments of a driver that are no rows of floats
ARRAYS = {"state": Array("f"), "totals": Array("f"), "kinds": Array("i"), "counts": Array("i"),
          "ranges": Array("i", columns=2), "segments": Array("i", columns=4)}  # fmt: skip
LONGEST = 60  # longest part of a scene's name in a file name, which the digest makes unique


@dataclass(frozen=True, eq=False)
class LatticeKernels:
    """The functions of a lattice (`lattice_driver`): `advance`, and `prepare` of each system.

    widths: columns of the arrays that `advance` takes. affine: True if a site that is solved by
    itself needs no iteration. huge: a number larger than any size.
    """

    advance: Callable[..., tuple[int, int]]
    prepare: tuple[Callable[[Numbers], Sequence[Number]], ...]
    widths: dict[str, int]
    affine: bool
    huge: Number


@dataclass(frozen=True, eq=False)
class Kernels:
    """The functions of one system in one arithmetic.

    advance: the driver (`driver.advance`). prepare: q ↦ c, and carry: (x, c) ↦ k, one each for the
    rule and for its adjoint. affine: for each, True if one correction solves a substep. huge: a
    number larger than any size. exchanging: returns kernels with row exchanges in each elimination,
    or None if these kernels have them everywhere already.
    """

    advance: Callable[..., tuple[int, int]]
    prepare: tuple[Callable[[Numbers], Sequence[Number]], ...]
    carry: tuple[Callable[[Numbers, Numbers], Sequence[Number]], ...]
    affine: tuple[bool, ...]
    layout: Layout
    huge: Number
    exchanging: Callable[[], Kernels | None] | None = None


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
    return replace(kernels, exchanging=partial(_exchanging, system, numbers, omit))


def _exchanging(system: Step, numbers: Arithmetic, omit: frozenset[str]) -> Kernels | None:
    more = omit | {"order"}
    if len(system.w) <= ADJUGATE or kernel_text(system, more) == kernel_text(system, omit):
        return None
    return compile(system, numbers, more)


@lru_cache(maxsize=16)
def compiled_text(system: Step, text: str) -> Kernels:
    """Compile a text that `kernel_text` made to machine code."""
    return _kernels(_run(system, text, Double()))


def _run(
    system: Step | StageSource | LatticeSystem,
    text: str,
    numbers: Arithmetic,
    given: Mapping[str, object] = MappingProxyType({}),
    constants: Callable[[], Namespace] = dict,
) -> Namespace:
    """Return the names of a text, in double precision with its `advance` as machine code.

    given: names that the text may use; constants: returns more of them, called only if they are
    needed.
    """
    if type(numbers) is not Double:
        return names_of(text, numbers, **given, **constants())
    names = names_of(text, numbers, **given)
    arrays = ARRAYS | {word: Array("f", columns=width) for word, width in names["WIDTHS"].items()}
    advance = compiled(_file_name(system), text, names, arrays, constants)
    return {**names, "advance": advance}


def interpreted(text: str, numbers: Arithmetic, **given: object) -> Kernels:
    """Return kernels that Python runs, from a text of `kernel_text` and additional names."""
    return _kernels(names_of(text, numbers, **given))


@lru_cache(maxsize=512)
@uncollected()
def kernel_text(system: Step, omit: frozenset[str] = frozenset()) -> str:
    """Return the text of a system's kernels and driver, derived if the cache does not hold it."""
    # the constants' values may decide what is omitted (`omissions`)
    constants = [str(value(60)) for value in system.constants.values()]
    path = f"{_file_name(system)}_{text_key(system, *sorted(omit), *constants)}.py"
    return cached_text(path, lambda: module_text(system, omit))


@lru_cache(maxsize=512)
def compile_stages(source: StageSource, numbers: Arithmetic) -> Kernels:
    """Return the kernels of a collocation step, like `compile` for a system.

    Raises `NoShortForm` if the mass matrix couples too many velocities.
    """
    path = f"{_file_name(source)}_stages_{text_key(source.nodes, source.given)}.py"
    text = cached_text(path, lambda: stage_text(source.derived()))
    return _kernels(_run(source, text, numbers, *_at_nodes(source, numbers)))


def _at_nodes(
    source: StageSource, numbers: Arithmetic
) -> tuple[Namespace, Callable[[], Namespace]]:
    """Return the names that lanes need, and a function that returns the tables of the nodes."""
    given = lane_namespace(source.nodes.count, numbers, vector_width())
    return given, partial(tables, source.nodes, source.nodes.count, given["WIDTH"], numbers)


@lru_cache(maxsize=512)
def compile_lattice(
    system: LatticeSystem, shape: str, composed: bool, numbers: Arithmetic
) -> LatticeKernels:
    """Return the kernels and the driver of a lattice, like `compile` for a system.

    shape: "chain", "ring" or "list", the arrangement of the bonds; composed: True if a step has
    several substeps.
    """
    path = f"{_file_name(system)}_lattice_{text_key(system, shape, composed)}.py"
    text = cached_text(path, lambda: lattice_text(system, shape, composed))
    return _lattice_kernels(_run(system, text, numbers, KNOWN_ZEROS))


@lru_cache(maxsize=512)
def compile_lattice_stages(system: LatticeStages, numbers: Arithmetic) -> LatticeKernels:
    """Return the kernels of a lattice's collocation; raises `NoShortForm` like `compile_stages`."""
    source = system.source
    path = f"{_file_name(source)}_lattice_stages_{text_key(*system.key)}.py"
    text = cached_text(path, lambda: stage_text(system.site, system))
    return _lattice_kernels(_run(source, text, numbers, *_at_nodes(source, numbers)))


def text_key(*parts: object) -> str:
    """Return a digest of systems, expressions and words, for the name of a generated file."""
    return digest(sources(), written(*parts))


def _file_name(system: Step | StageSource | LatticeSystem) -> str:
    # the name has no rule in it: on a group all simple rules share their kernels
    return re.sub(r"\W", "_", system.name)[:LONGEST]


def names_of(text: str, numbers: Arithmetic, **more: object) -> Namespace:
    """Run a text with Python and return its functions and constants; more: names it may use."""
    codes = {word: int(e) for kind in (Status, Entry) for word, e in kind.__members__.items()}
    given = {"Layout": Layout, "StageLayout": StageLayout, "Record": SimpleNamespace,
             "PAST": PAST, "INNER": INNER, **codes}  # fmt: skip
    return run_text(text, {**given, **numbers.namespace(), **more})


def _kernels(names: Namespace) -> Kernels:
    return Kernels(
        names["advance"], _of_each("prepare", names), _of_each("carry", names),
        _of_each("affine", names), names["LAYOUT"], names["HUGE"],
    )  # fmt: skip


def _lattice_kernels(names: Namespace) -> LatticeKernels:
    affine = all(_of_each("affine", names))
    return LatticeKernels(
        names["advance"], _of_each("prepare", names), names["WIDTHS"], affine, names["HUGE"]
    )


def _of_each(word: str, names: Namespace) -> tuple[Any, ...]:
    """Return what the rule and its adjoint have by that word."""
    return tuple(getattr(system, word) for system in names["SYSTEMS"])
