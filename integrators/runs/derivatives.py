"""Derivatives of a run by its start and by parameters, and of a function of its rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RunDerivatives:
    """Derivatives of the rows z_k = (x_k, μ_k) of a run, exact for its steps.

    start: by the start, (rows, N, N), N = n + m, by (x₀, μ₀), or (x₀, v₀) if v₀ was held.
    parameters: by each parameter, (rows, N, …) with the parameter's own shape behind.
    """

    start: np.ndarray
    parameters: dict[str, np.ndarray]


@dataclass(frozen=True)
class RunGradient:
    """The gradient of a function of a run's rows by what the run began with.

    x0 (n,), mu0 (m,): by the start; mu0 is the gradient by v₀ if v₀ was held. parameters: by each
    parameter, of the parameter's own shape.
    """

    x0: np.ndarray
    mu0: np.ndarray
    parameters: dict[str, np.ndarray]
