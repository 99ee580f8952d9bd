"""Runs whose every step is proven to exist, with a bound of its distance from the exact run."""

from typing import TYPE_CHECKING

from ...numbers.lazy import on_demand

if TYPE_CHECKING:
    from .proven_flow import Proof, ProvenFlow
else:
    __getattr__ = on_demand(__name__, proven_flow="Proof ProvenFlow")

__all__ = ["Proof", "ProvenFlow"]
