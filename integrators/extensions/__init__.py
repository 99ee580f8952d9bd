"""What a scene may need and most do not. No file of the core imports it, and none needs it.

Each extension says here what it has: its public names, the hooks of the core that it fills, and its
built-in systems. All is loaded when it is first used.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ..hooks import (
    check_gaps,
    contact_flow,
    modified_equation,
    proven_flow,
    rooms_of_systems,
    run_differentiated,
    source_text,
)
from ..numbers.lazy import on_demand

if TYPE_CHECKING:
    from .control import Control
    from .foreign import black_box, external, recorded
    from .lattices import Lattice
    from .steps import in_own_time, vary
else:
    __getattr__ = on_demand(
        __name__,
        contact="",
        control="Control",
        expansions="",
        export="",
        foreign="black_box external recorded",
        lattices="Lattice",
        proven="",
        steps="in_own_time vary",
    )

__all__ = ["Control", "Lattice", "black_box", "external", "in_own_time", "recorded", "vary"]


def _of(room: str, name: str) -> Callable[[], Any]:
    """Return a function that loads a name of an extension."""
    return lambda: getattr(import_module(f".{room}", __name__), name)


check_gaps.fill(_of("contact", "check_gaps"))
contact_flow.fill(_of("contact", "ContactFlow"))
modified_equation.fill(_of("expansions", "ModifiedEquation"))
proven_flow.fill(_of("proven", "ProvenFlow"))
run_differentiated.fill(_of("expansions", "RunDifferentiated"))
source_text.fill(_of("export", "export"))
rooms_of_systems["lattices"] = "lattice", lambda: import_module(".lattices.scenes", __name__)
rooms_of_systems["control"] = (
    "problem of control", lambda: import_module(".control.scenes", __name__)
)  # fmt: skip
