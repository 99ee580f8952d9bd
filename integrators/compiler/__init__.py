"""Compile one step, given as plain data, to machine code or to functions at any precision.

`compile(system, numbers, omit)` does all of it; a `KernelsAtStep` runs the result.
"""

from typing import TYPE_CHECKING

from ..numbers.lazy import on_demand

if TYPE_CHECKING:
    from .cache import Damaged, cached_text, digest, seal, unsealed
    from .kernels import (
        Kernels,
        at_nodes,
        compile,
        compile_stages,
        compiled_text,
        file_name,
        interpreted,
        kernel_text,
        names_of,
        of_each,
        run_kernels,
        text_key,
    )
    from .kernels_at_step import KernelsAtStep, Run, StagesAtStep, taken_over
    from .known_zeros import KNOWN_ZEROS
    from .layout import Entry, Layout, Status
    from .llvm_values import Array
    from .machine_code import address, compiled, cores
    from .module_text import KernelText, texts_of, with_names
    from .omissions import SAVINGS, is_affine, pivot_rows
    from .stage_system import LatticeStages, StageSource, StageSystem
    from .stage_text import UNSEEN, NoShortForm, text_of_stages
    from .step import Kind, Step, kinds_of
else:
    __getattr__ = on_demand(
        __name__,
        cache="Damaged cached_text digest seal unsealed",
        kernels="Kernels at_nodes compile compile_stages compiled_text file_name interpreted "
                "kernel_text names_of of_each run_kernels text_key",
        kernels_at_step="KernelsAtStep Run StagesAtStep taken_over",
        layout="Entry Layout Status",
        llvm_values="Array",
        machine_code="address compiled cores",
        module_text="KernelText texts_of with_names",
        omissions="SAVINGS is_affine pivot_rows",
        stage_system="LatticeStages StageSource StageSystem",
        stage_text="UNSEEN NoShortForm text_of_stages",
        known_zeros="KNOWN_ZEROS",
        step="Kind Step kinds_of",
    )  # fmt: skip

__all__ = [
    "Array", "Damaged", "Entry", "KNOWN_ZEROS", "KernelText", "Kernels", "KernelsAtStep",
    "Kind", "LatticeStages", "Layout", "NoShortForm", "Run", "SAVINGS", "StageSource",
    "StageSystem", "StagesAtStep", "Status", "Step", "UNSEEN", "address", "at_nodes",
    "cached_text", "compile", "compile_stages", "compiled", "compiled_text", "cores", "digest",
    "file_name", "interpreted", "is_affine", "kernel_text", "kinds_of", "names_of", "of_each",
    "pivot_rows", "run_kernels", "seal", "taken_over", "text_key", "text_of_stages", "texts_of",
    "unsealed", "with_names",
]  # fmt: skip
