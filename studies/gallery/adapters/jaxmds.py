"""jax-md's nve on Hénon–Heiles: one particle in the plane."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax_md import simulate, space

jax.config.update("jax_enable_x64", True)


def energy(R: Any, **_: Any) -> Any:
    """The potential of Hénon–Heiles at positions (1, 2)."""
    x, y = R[0]
    return (x**2 + y**2) / 2 + x**2 * y - y**3 / 3


@partial(jax.jit, static_argnums=3)
def advanced(state: Any, h: Any, every: Any, rows: int) -> Any:
    """The states after each every-th step."""
    step = simulate.nve(energy, space.free()[1], dt=h)[1]

    def stretch(state: Any, _: Any) -> Any:
        state = jax.lax.fori_loop(0, every, lambda _, s: step(s), state)
        return state, (state.position[0], state.momentum[0])

    return jax.lax.scan(stretch, state, None, rows)[1]


def run(q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h."""
    at, start = jnp.asarray(q)[None], (q, p)
    state = simulate.NVEState(at, jnp.asarray(p)[None], -jax.grad(energy)(at), jnp.ones((1, 1)))
    rows = advanced(state, h, every, steps // every)
    return tuple(np.vstack([z, part]) for z, part in zip(start, rows, strict=True))
