"""Kernels of a lattice: those of a site and of a bond, and their driver."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from ...compiler import (
    KNOWN_ZEROS,
    LatticeStages,
    at_nodes,
    cached_text,
    file_name,
    of_each,
    run_kernels,
    text_key,
    text_of_stages,
)
from ...numbers import Arithmetic, Number, Numbers
from ...numbers.types import Namespace
from .lattice_text import LatticeSystem, lattice_text


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


@lru_cache(maxsize=512)
def compile_lattice(
    system: LatticeSystem, shape: str, composed: bool, numbers: Arithmetic
) -> LatticeKernels:
    """Return the kernels and the driver of a lattice, like `compile` for a system.

    shape: "chain", "ring" or "list", the arrangement of the bonds; composed: True if a step has
    several substeps.
    """
    path = f"{file_name(system)}_lattice_{text_key(system, shape, composed)}.py"
    text = cached_text(path, lambda: lattice_text(system, shape, composed))
    return _lattice_kernels(run_kernels(system, text, numbers, KNOWN_ZEROS))


@lru_cache(maxsize=512)
def compile_lattice_stages(system: LatticeStages, numbers: Arithmetic) -> LatticeKernels:
    """Return the kernels of a lattice's collocation; raises `NoShortForm` like `compile_stages`."""
    source = system.source
    path = f"{file_name(source)}_lattice_stages_{text_key(*system.key)}.py"
    text = cached_text(path, lambda: text_of_stages(system.site, system))
    return _lattice_kernels(run_kernels(source, text, numbers, *at_nodes(source, numbers)))


def _lattice_kernels(names: Namespace) -> LatticeKernels:
    affine = all(of_each("affine", names))
    return LatticeKernels(
        names["advance"], of_each("prepare", names), names["WIDTHS"], affine, names["HUGE"]
    )
