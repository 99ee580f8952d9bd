"""Machine code of a generated text: written by LLVM, stored in the cache, called through ctypes."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from types import FunctionType
from typing import Any

from ..numbers import LazyModule, uncollected
from ..numbers.types import Function, Vector
from .cache import cached, digest, sources
from .layout import STATUSES
from .llvm_values import Array
from .llvm_writer import Module

llvm = LazyModule("llvmlite.binding")
llvmlite = LazyModule("llvmlite")
#: least number of lines of a text that is only simplified: shorter ones (pendulum, Duffing) run
#: 1.05 to 1.1 times as long if the first correction is not peeled off Newton's loop
LONG = 1500


@cache
def _host() -> tuple[str, str, Any]:
    """Return the name and features of this processor, and LLVM's target for it."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features().flatten()
    return llvm.get_host_cpu_name(), features, llvm.Target.from_default_triple()


def _machine() -> Any:
    """Return a new code generator for this processor; an engine takes ownership of it."""
    cpu, features, target = _host()
    return target.create_target_machine(cpu, features, opt=3, reloc="pic", codemodel="jitdefault")


@cache
def vector_width() -> int:
    """Return the number of floats in a vector of this processor."""
    features = _host()[1].split(",")
    return 8 if "+avx512f" in features else 4 if "+avx" in features else 2


def cores() -> int:
    """Return the number of cores that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


@uncollected()
def compiled(
    name: str,
    text: str,
    names: Mapping[str, object],
    arrays: Mapping[str, Array],
    constants: Callable[[], Mapping[str, object]] = dict,
) -> Function:
    """Compile a text's function `advance`; names: the text's own names, run by Python.

    arrays: its arguments that are arrays of contiguous numbers; the others are integers. constants:
    returns further names, called only if the code is not in the cache.
    """
    cpu, features, target = _host()
    host = (llvmlite.__version__, cpu, features, target.triple)
    key = digest(sources(), text, str(arrays), *host)
    parameters = {n: f.__code__.co_varnames[: f.__code__.co_argcount]
                  for n, f in names.items() if isinstance(f, FunctionType)}  # fmt: skip

    def made() -> bytes:
        module = Module(text, {**names, **constants()})
        module.export("advance", parameters["advance"], arrays)
        return _object(module.text(), module.loops)

    code = cached(f"{name}_{key}.o", made)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return _callable(engine, parameters["advance"])


def _object(text: str, loops: bool) -> bytes:
    """Return the object code of an LLVM text, optimised; loops: True if it has loops over integers.

    Such a loop is as fast by level 1, in two thirds of LLVM's time; level 3 makes elimination
    slower (18 unknowns: 1.5 times), but Newton's method faster. Of that level a long text without
    vectors is only simplified: nothing else changes its speed (12 steps: 0.95 to 1.08 times, on
    average 0.99), and its numbers are the same (where functions are called, to round-off).
    """
    module, machine = llvm.parse_assembly(text), _machine()
    module.triple, module.data_layout = llvm.get_default_triple(), str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=1 if loops else 3)
    options.loop_vectorization = True
    # pairs of scalars in one register cost more than they save (Kepler, Störmer–Verlet: 1.4 times)
    options.slp_vectorization = False
    passes = llvm.create_pass_builder(machine, options)
    if loops or " x double>" in text or text.count("\n") < LONG:
        passes.getModulePassManager().run(module, passes)
    else:
        simplify = passes.getFunctionPassManager()
        for function in module.functions:
            if not function.is_declaration:
                simplify.run(function, passes)
    return bytes(machine.emit_object(module))


def _callable(engine: Any, names: Sequence[str]) -> Function:
    """Return an engine's `advance`, which takes arrays (or their addresses) and integers."""
    place = engine.get_function_address("advance")
    # an address has the size of the integers, and is converted in two thirds of their time
    at_places = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * len(names))(place)

    def advance(*arguments: int | Vector) -> tuple[int, int]:
        numbers = (a if isinstance(a, int) else address(a) for a in arguments)
        return divmod(at_places(*numbers), STATUSES)

    advance.engine = engine  # type: ignore[attr-defined]  # it owns the code
    advance.at_places = at_places  # type: ignore[attr-defined]
    return advance


_addressof, _nothing_of = ctypes.addressof, (ctypes.c_char * 0).from_buffer


def address(array: Any) -> int:
    """Return the address of an array's first number."""
    return _addressof(_nothing_of(array))
