"""The work of a step's kernel: its savings, and its number of operations."""

from __future__ import annotations

import ast

from discmech.integrators.compiler import kernel_text
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.flows import Flow


def savings_made(flow: Flow) -> dict[str, bool]:
    """Return {saving: True if the flow's kernels make it} for `SAVINGS`."""
    kernels = flow._kernels
    return {"direct": kernels.affine[0], "carried": kernels.layout.reused > 0, "coefficients": True}


def operations(flow: Flow) -> tuple[int, int]:
    """Return (of one correction, of one update): operations and functions in the kernel."""
    text = kernel_text(flow.system, flow.without)
    counts = {}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and node.name in ("solver", "update"):
            counts[node.name] = sum(isinstance(n, ast.BinOp | ast.Call) for n in ast.walk(node))
    if len(counts) < 2:
        raise CannotMeasure("the kernel's operations cannot be counted.")
    return counts["solver"], counts["update"]
