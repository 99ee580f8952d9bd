"""Kernels of compositions: those of a rule, and of its adjoint, under the composed driver.

One module serves all compositions of a rule on a scene: the substeps are data.
"""

from __future__ import annotations

import inspect
import re
from typing import TYPE_CHECKING

from . import composed_driver
from .edge_guard import watch_text
from .kernels import KernelBuilder, solver_text
from .tuple_operations import memory_text, whole_state_text

if TYPE_CHECKING:
    from ..equations.discrete_equations import DiscreteEquations

_SUFFIX = "_of_adjoint"


def composed_text(schemes: list[DiscreteEquations]) -> str:
    """The module's text for [rule] (self-adjoint) or [rule, its adjoint]."""
    builders = [KernelBuilder(scheme) for scheme in schemes]
    units = [_unit(builder) for builder in builders]
    shapes = [builder.shape for builder in builders]
    if len(units) == 2:
        units[1] = _renamed(units[1])
    else:
        units.append(f"substep{_SUFFIX}, prepare{_SUFFIX} = substep, prepare\n")
        shapes.append(shapes[0])
    n, m = shapes[0]["dim_x"], shapes[0]["dim_u"]
    return "\n\n".join(
        [
            f"SHAPES = {shapes}",
            *units,
            whole_state_text(n, m, *(shape["carried"] for shape in shapes)),
            f"@entry\n{inspect.getsource(composed_driver.advance)}",
        ]
    )


def _unit(builder: KernelBuilder) -> str:
    """Kernels, vectors, solver and `substep` of one scheme."""
    watch = watch_text(builder)  # before the texts, for it asks for coefficients too
    texts, affine = builder.texts, builder.affine
    return "\n\n".join(
        [
            *texts.nodes,
            *texts.solving,
            f"@kernel\n{texts.carry}",
            *texts.elimination,
            texts.vectors,
            *watch,
            memory_text(builder.shape["solved"], texts.width, affine),
            *solver_text(affine),
            f"@aside\n{inspect.getsource(composed_driver.substep)}",
            texts.carry.replace("def carry(", "def carry_at_start("),  # called from outside
            texts.prepare,
        ]
    )


def _renamed(text: str) -> str:
    """The text with a suffix on every function it defines."""
    names = re.findall(r"^def (\w+)\(", text, re.M)
    return re.sub(rf"\b({'|'.join(names)})\b", rf"\1{_SUFFIX}", text)
