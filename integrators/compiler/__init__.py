"""Compile one step, given as plain data, to machine code or to functions at any precision.

`compile(system, numbers, omit)` does all of it; a `KernelsAtStep` runs the result.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..numbers.lazy import on_demand

if TYPE_CHECKING:
    from .cache import Damaged, cached_text, digest, seal, unsealed
    from .kernels import (
        Kernels,
        LatticeKernels,
        compile,
        compile_lattice,
        compile_lattice_stages,
        compile_stages,
        compiled_text,
        interpreted,
        kernel_text,
        names_of,
        text_key,
    )
    from .kernels_at_step import KernelsAtStep, Run
    from .lattice_text import FADED, MOST_SWEEPS, Kicks, LatticeSystem
    from .layout import Entry, Layout, Status
    from .llvm_values import Array
    from .machine_code import address, compiled, cores
    from .module_text import KernelText
    from .omissions import SAVINGS, is_affine
    from .stage_system import LatticeStages, StageSource, StageSystem
    from .stage_text import NoShortForm
    from .stages_at_step import StagesAtStep, taken_over
    from .step import Kind, Step, kinds_of
else:
    __getattr__ = on_demand(
        __name__,
        cache="Damaged cached_text digest seal unsealed",
        kernels="Kernels LatticeKernels compile compile_lattice compile_lattice_stages "
                "compile_stages compiled_text interpreted kernel_text names_of text_key",
        kernels_at_step="KernelsAtStep Run",
        lattice_text="FADED MOST_SWEEPS Kicks LatticeSystem",
        layout="Entry Layout Status",
        llvm_values="Array",
        machine_code="address compiled cores",
        module_text="KernelText",
        omissions="SAVINGS is_affine",
        stage_system="LatticeStages StageSource StageSystem",
        stage_text="NoShortForm",
        stages_at_step="StagesAtStep taken_over",
        step="Kind Step kinds_of",
    )  # fmt: skip

__all__ = [
    "Array", "Damaged", "Entry", "FADED", "KernelText", "Kernels", "KernelsAtStep", "Kicks", "Kind",
    "LatticeKernels", "LatticeStages", "LatticeSystem", "Layout", "MOST_SWEEPS", "NoShortForm",
    "Run", "SAVINGS", "StageSource", "StageSystem", "StagesAtStep", "Status", "Step", "address",
    "cached_text", "compile", "compile_lattice", "compile_lattice_stages", "compile_stages",
    "compiled", "compiled_text", "cores", "digest", "interpreted", "is_affine", "kernel_text",
    "kinds_of", "names_of", "seal", "taken_over", "text_key", "unsealed",
]  # fmt: skip
