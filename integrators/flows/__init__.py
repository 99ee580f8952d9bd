"""Schemes and their flows: starts, steps, runs, failures."""

from .scheme import Scheme

__all__ = ["Scheme"]
