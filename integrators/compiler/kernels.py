"""Kernels of a step: their text comes from the cache; Python runs it, or LLVM compiles it."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from types import SimpleNamespace
from typing import Any

from ..numbers import Arithmetic, Double, Multiple, Number, Numbers, run_text
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
    return _compiled(system, text, names_of(text, Double()))


def _compiled(
    system: Step | StageSource,
    text: str,
    names: dict[str, Any],
    constants: Callable[[], dict[str, Any]] = dict,
) -> Kernels:
    advance = compiled(_file_name(system), text, names, _arrays(names["LAYOUT"]), constants)
    return _kernels(names, advance)


def _arrays(at: Layout) -> dict[str, Array]:
    """Return the arrays among the arguments of `advance`."""
    arrays = {"state": Array("f"), "totals": Array("f"), "kinds": Array("i"), "counts": Array("i")}
    columns = {"coefficients": at.width, "xs": at.n, "us": at.row_width, "mus": at.m}
    return arrays | {name: Array("f", columns=width) for name, width in columns.items()}


def interpreted(text: str, numbers: Arithmetic, **given: Any) -> Kernels:
    """Return kernels that Python runs, from a text of `kernel_text` and additional names."""
    names = names_of(text, numbers, **given)
    return _kernels(names, names["advance"])


@lru_cache(maxsize=512)
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
    nodes = source.nodes
    path = f"{_file_name(source)}_stages_{text_key(nodes, source.given)}.py"
    text = cached_text(path, lambda: stage_text(source.derived()))
    given = lane_namespace(nodes.count, numbers, vector_width())
    of_nodes = partial(tables, nodes, nodes.count, given["WIDTH"], numbers)
    if isinstance(numbers, Multiple):
        return interpreted(text, numbers, **given, **of_nodes())
    return _compiled(source, text, names_of(text, numbers, **given), of_nodes)


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
    return _of_lattice(_file_name(system), text, names_of(text, numbers, **KNOWN_ZEROS), numbers)


@lru_cache(maxsize=512)
def compile_lattice_stages(system: LatticeStages, numbers: Arithmetic) -> LatticeKernels:
    """Return the kernels of a lattice's collocation; raises `NoShortForm` like `compile_stages`."""
    source = system.source
    path = f"{_file_name(source)}_lattice_stages_{text_key(*system.key)}.py"
    text = cached_text(path, lambda: stage_text(system.site, system))
    given = lane_namespace(source.nodes.count, numbers, vector_width())
    of_nodes = partial(tables, source.nodes, source.nodes.count, given["WIDTH"], numbers)
    if type(numbers) is not Double:
        given |= of_nodes()
    names = names_of(text, numbers, **given)
    return _of_lattice(_file_name(source), text, names, numbers, of_nodes)


def _of_lattice(
    name: str,
    text: str,
    names: dict[str, Any],
    numbers: Arithmetic,
    constants: Callable[[], dict[str, Any]] = dict,
) -> LatticeKernels:
    arrays = {word: Array("i", columns=width) for word, width in
              (("ranges", 2), ("segments", 4))}  # fmt: skip
    arrays |= {"kinds": Array("i"), "totals": Array("f")}
    n, m = names["n"], names["m"]
    widths = {
        "given": names.get("GIVEN", 0),
        "x": n,
        "nu": m,
        "mu": m,
        "p": names["SITES"],
        "q": names["BONDS"],
        **names["WIDTHS"],
    }
    arrays |= {word: Array("f", columns=width) for word, width in widths.items()}
    advance = names["advance"]
    if type(numbers) is Double:
        advance = compiled(name, text, names, arrays, constants)
    prepare = tuple(kind.prepare for kind in names["SYSTEMS"])
    affine = all(getattr(kind, "affine", False) for kind in names["SYSTEMS"])
    return LatticeKernels(advance, prepare, widths, affine, names["HUGE"])


def text_key(*parts: Any) -> str:
    """Return a digest of systems, expressions and words, for the name of a generated file."""
    return digest(sources(), written(*parts))


def _file_name(system: Step | StageSource | LatticeSystem) -> str:
    # the name has no rule in it: on a group all simple rules share their kernels
    return re.sub(r"\W", "_", system.name)[:LONGEST]


def names_of(text: str, numbers: Arithmetic, **more: Any) -> dict[str, Any]:
    """Run a text with Python and return its functions and constants; more: names it may use."""
    codes = {word: int(e) for kind in (Status, Entry) for word, e in kind.__members__.items()}
    given = {"Layout": Layout, "StageLayout": StageLayout, "Record": SimpleNamespace,
             "PAST": PAST, "INNER": INNER, **codes}  # fmt: skip
    return run_text(text, {**given, **numbers.namespace(), **more})


def _kernels(names: dict[str, Any], advance: Callable[..., tuple[int, int]]) -> Kernels:
    prepare, carry, affine = (tuple(getattr(system, name) for system in names["SYSTEMS"])
                              for name in ("prepare", "carry", "affine"))  # fmt: skip
    return Kernels(advance, prepare, carry, affine, names["LAYOUT"], names["HUGE"])
