"""The rows of a run, of whatever kind, with its counters and events."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np

from ..errors import BadInput
from ..numbers import Arithmetic, Matrix, Vector
from ..numbers.types import Array, DType

#: a column of rows by its name: (the shape of one row, the type of its numbers)
Columns: TypeAlias = Mapping[str, tuple[tuple[int, ...], DType]]
#: a function that makes `count` rows of zeros of such columns, in memory or on disk
Allocate: TypeAlias = Callable[[Columns, int], dict[str, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Rows of a run: the first is the start, then every `every`-th step.

    t (r,), x (r, n), u (r, m), mu (r, m): row k holds x_k, μ_k = F⁻/h in the natural basis, and the
    u that leaves x_k; for a one-step map, which has no arrows, ξ(x_k, μ_k). A lattice of N sites
    has x (r, N, n), u and mu (r, N, m), with u and mu 0 at fixed sites. base: x, with the time as
    last column if the equations contain it: the form that the flow's own functions take.
    multipliers (r, k): λ of the constraints at the start of that row's step, in the natural basis;
    of a lattice's bonds (r, B, k); with contact (r, K), the normal impulse of each gap in that step
    divided by h. step: the step size, exact; steps: how many were made. scheme: the scheme that
    ran.

    Counters. iterations (r,): Newton corrections of that row's step. newton_mean and newton_max:
    over all steps, with or without a row (of a lattice whose sites are solved separately: per
    site); newton_residual: size of the last correction. margin: the smallest of all steps in the
    charts of groups (`chart_margin.Position`; 1 if there is no edge; a lower bound for the
    exponential without a closed form). solver: how steps were solved ("fixed point", "Newton", or
    both with the number of steps by Newton); for a fixed point, iterations are its sweeps, and
    contraction is the factor by which a sweep reduces an error, in the step with most sweeps.
    newton_since: the step of a lattice's run from which Newton's method replaced a fixed point of
    the stages that failed or was slower; else None.

    Events. edges: how often a chart's edge was met and passed; translates (r,): the number of the
    cover's element B with g = τ(hu) B, 0 for e. With contact: impulses (r, K, 1 + D) of the step
    that leaves a row, the normal ones and those of friction along the coordinates of the plane (D =
    0 if no gap has friction; of a lattice (r, N, K)); gaps (r, K): φ, of a lattice (r, N, K);
    impacts: all impacts, whether their step has a row or not (`Impacts`); bond_impulses, bond_gaps
    (r, B, K): those of a lattice's bonds. With steps that vary:
    density (r,), the step density of each row, 1/σ (by "reversible" ζ, which is 1/σ to O(ε²)); step
    is then ε, of the time τ, t the physical time, and u the velocity in t, by "poincare" in τ.
    proof: what is proven of a run with `proven=True` (`proven_flow.Proof`).
    """

    t: Vector
    x: Matrix
    u: Matrix
    mu: Matrix
    iterations: Vector
    newton_mean: float
    newton_max: int
    newton_residual: float
    steps: int
    step: Fraction
    margin: float
    edges: int
    translates: Vector
    base: Matrix
    multipliers: Matrix
    solver: str
    contraction: float
    scheme: Any = field(kw_only=True, repr=False)
    impulses: Array = field(kw_only=True, default=None, repr=False)
    gaps: Array = field(kw_only=True, default=None, repr=False)
    impacts: Any = field(kw_only=True, default=None, repr=False)
    bond_impulses: Array = field(kw_only=True, default=None, repr=False)
    bond_gaps: Array = field(kw_only=True, default=None, repr=False)
    density: Array = field(kw_only=True, default=None, repr=False)
    newton_since: int | None = field(kw_only=True, default=None, repr=False)
    proof: Any = field(kw_only=True, default=None, repr=False)

    @classmethod
    def of_rows(cls, t: Vector, x: Matrix, u: Matrix, mu: Matrix, **more: object) -> Trajectory:
        """Return the trajectory of these rows, without counters and events except those given."""
        count = np.zeros(len(t), dtype=np.int64)
        defaults: dict[str, Any] = {
            "iterations": count, "translates": count.copy(), "base": x, "multipliers": mu[:, :0],
            "newton_mean": 0.0, "newton_max": 0, "newton_residual": 0.0, "margin": 1.0, "edges": 0,
            "solver": "Newton", "contraction": 0.0,
        }  # fmt: skip
        return cls(t=t, x=x, u=u, mu=mu, **{**defaults, **more})

    @classmethod
    def begun(cls, later: Callable[..., dict[str, Any]], *arguments: Any) -> Trajectory:
        """Return a trajectory whose fields are computed when they are read.

        later: returns, for `arguments` and a name, the field of that name, perhaps others. Most
        short runs are asked for their states alone, which costs less than all the counters.
        """
        made = object.__new__(cls)
        made.__dict__["_later"] = later, arguments
        return made

    def __getattr__(self, name: str) -> Any:
        own = vars(self)
        if "_later" not in own or name not in self.__dataclass_fields__:
            raise AttributeError(f"a Trajectory has no {name}")
        later, arguments = own["_later"]
        own.update({**later(*arguments, name), **own})
        return own[name]

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields without the scheme, whose functions may not be picklable."""
        return {f.name: getattr(self, f.name) for f in fields(self)} | {"scheme": None}


def allocated(columns: Columns, count: int, numbers: Arithmetic) -> dict[str, np.ndarray]:
    """Return `count` rows of zeros of each column; raises `BadInput` if memory does not hold them.

    Columns of whole numbers have the type int; all others hold numbers of the arithmetic.
    """
    try:
        return {
            name: np.zeros((count, *shape), kind) if kind is int else numbers.zeros(count, *shape)
            for name, (shape, kind) in columns.items()
        }
    except (MemoryError, ValueError):  # ValueError: more entries than an array can have
        raise BadInput(
            f"{count} rows do not fit into memory: keep fewer (every=, --every)."
        ) from None


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
