"""Steps that vary: any rule in a time of its own, in which the motion is even."""

from typing import TYPE_CHECKING

from ...numbers.lazy import on_demand

if TYPE_CHECKING:
    from .poincare import ENERGY, in_own_time
    from .varied import WAYS, Varied, vary
    from .varied_flow import VariedFlow
    from .varied_scheme import VariedScheme
else:
    __getattr__ = on_demand(
        __name__,
        poincare="ENERGY in_own_time",
        varied="WAYS Varied vary",
        varied_flow="VariedFlow",
        varied_scheme="VariedScheme",
    )

__all__ = [
    "ENERGY", "WAYS", "Varied", "VariedFlow", "VariedScheme", "in_own_time", "vary",
]  # fmt: skip
