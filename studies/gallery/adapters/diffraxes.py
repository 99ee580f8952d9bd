"""diffrax with constant steps, on Hénon–Heiles written for JAX."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

jax.config.update("jax_enable_x64", True)


def force(q: Any) -> Any:
    """−∂V/∂q of Hénon–Heiles."""
    return jnp.stack([-q[0] - 2 * q[0] * q[1], -q[1] - q[0] ** 2 + q[1] ** 2])


@lru_cache(maxsize=64)
def compiled(method: str, rows: int) -> Any:
    """A run of so many rows, each every-th step, as machine code."""
    terms: Any = diffrax.ODETerm(lambda t, z, a: (z[1], force(z[0])))
    if method == "SemiImplicitEuler":
        terms = diffrax.ODETerm(lambda t, p, a: p), diffrax.ODETerm(lambda t, q, a: force(q))

    def run(z: Any, h: Any, every: Any) -> Any:
        times = jnp.arange(rows) * every * h
        return diffrax.diffeqsolve(
            terms, getattr(diffrax, method)(), 0.0, times[-1], h, z, max_steps=None,
            saveat=diffrax.SaveAt(ts=times), adjoint=diffrax.ForwardMode(),
        ).ys  # fmt: skip

    return jax.jit(run)


def run(method: str, q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h."""
    return tuple(map(np.array, compiled(method, steps // every + 1)((q, p), h, every)))
