"""Derivatives of a run by its start and by parameters: tangent and adjoint, exact for its steps.

Each step z′ = Φ(z; p) is differentiated by the implicit function theorem on the rows that it
solves, as its power series to first order in what z and p have; no difference quotient is taken.
All steps are expanded at once. Between rows that are several steps apart the steps are taken anew.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ...equations import mass_matrix, momentum
from ...errors import BadInput, CannotMeasure, shown
from ...numbers import jacobian, numeric
from ...numbers.types import Number, Numbers, Rows
from ...runs import RunDerivatives, RunGradient, Trajectory
from .series import Series
from .step_series import StepSeries

ENTRIES = 2**22  # of the derivatives of steps that are held at once


class RunDifferentiated:
    """The steps of a flow along one of its runs, differentiated.

    held: "mu0" or "v0", which of them stays when x₀ and the parameters change. Raises
    `CannotMeasure` for scenes with constraints or contact, for discrete Lagrangians on the group,
    and for a run that left its chart.
    """

    def __init__(self, flow: Any, run: Trajectory, held: str) -> None:
        self.flow, self.run = flow, run
        if held not in ("mu0", "v0"):
            raise BadInput(f'held is {shown(held)}: give "mu0" or "v0".')
        self._check()
        self.held, self.numbers = held, flow.numbers
        self.s = flow.scheme.equations.s
        self.n, self.m = len(self.s.x), len(self.s.mu)
        self.size = self.n + self.m
        self.count = len(self.s.parameter_list)
        with self.numbers.working():
            columns = [*np.asarray(run.base).T, *np.asarray(run.mu).T]
            self.z = [self.numbers.own(e) for e in columns]
            self.u = [self.numbers.own(e) for e in np.asarray(run.u).T]

    def tangent(self) -> RunDerivatives:
        """Return the derivatives of all rows."""
        with self.numbers.working():
            total = self._begun()
            rows = [total]
            for M in self._steps():
                total = M[:, : self.size] @ total
                total[:, self.size :] += M[:, self.size :]
                rows.append(total)
            derivatives = self.numbers.public(np.array(rows))
        start, others = derivatives[:, :, : self.size], derivatives[:, :, self.size :]
        return RunDerivatives(start, self._by_name(np.moveaxis(others, 2, 0)))

    def adjoint(self, slope: Numbers | Rows) -> RunGradient:
        """Return the gradient of G by the start and the parameters.

        slope: ∂G/∂z of the last row, (N,), or of each row, (rows, N).
        """
        rows = len(self.run.mu)
        try:
            slope = np.asarray(slope, dtype=self.numbers.dtype)
        except (TypeError, ValueError):
            raise BadInput(
                f"{self.flow.scheme.scene.name}: the slope is {shown(slope)}: give numbers."
            ) from None
        if slope.shape not in ((self.size,), (rows, self.size)):
            raise BadInput(
                f"{self.flow.scheme.scene.name}: the slope has the shape {slope.shape}: give "
                f"({self.size},) for the last row, or ({rows}, {self.size}) for all."
            )
        with self.numbers.working():
            slopes = self.numbers.own(slope.astype(object))  # each is checked
            at = slopes if slopes.ndim == 1 else slopes[-1]
            of_parameters = self.numbers.zeros(self.count)
            steps = list(self._steps())
            for k in reversed(range(len(steps))):
                of_parameters = of_parameters + steps[k][:, self.size :].T @ at
                at = steps[k][:, : self.size].T @ at
                if slopes.ndim == 2:
                    at = at + slopes[k]
            begun = self._begun()
            of_parameters = of_parameters + begun[:, self.size :].T @ at
            at = self.numbers.public(begun[:, : self.size].T @ at)
            named = self._by_name(self.numbers.public(of_parameters))
        return RunGradient(at[: self.n], at[self.n :], named)

    def _check(self) -> None:
        scene, rule = self.flow.scheme.scene, self.flow.scheme.rule
        scene.refuse("derivatives of a run")
        if any(self.run.translates):
            raise CannotMeasure(
                f"the run of {scene.name} with {rule.name} left its chart: take smaller steps."
            )

    def _begun(self) -> np.ndarray:
        """Return the derivative of (x₀, μ₀) by what is varied, (N, N + parameters)."""
        derivative = self.numbers.zeros(self.size, self.size + self.count)
        derivative[:, : self.size] += self.numbers.identity(self.size)
        if self.held == "v0":
            s, letters = self.s, (self.s.x, self.s.u, self.s.parameter_list)
            if s.hamiltonian is not None:
                raise CannotMeasure(f'{s.name} is given by its Hamiltonian: say held="mu0".')
            parts = [jacobian(momentum(s), e) for e in (s.x, s.parameter_list) if len(e)]
            of = numeric(dict(zip("xup", letters, strict=True)), [*parts, mass_matrix(s)],
                         self.numbers)  # fmt: skip
            x, mu = ([e[0] for e in part] for part in (self.z[: self.n], self.z[self.n :]))
            parameters = list(self.flow.parts[0].q[1 : 1 + self.count])
            near = [self.numbers.number(e) for e in self.flow.scheme.scene.v0]
            at = (np.array([e], self.numbers.dtype) for e in (x, mu, near))
            velocity = list(self.flow.parts[0].geometry.velocities(*at)[0])
            values = of(x, velocity, parameters)
            values = list(values) if isinstance(values, tuple) else [values]
            mass = values.pop()
            if self.n:
                derivative[self.n :, : self.n] = values.pop(0)
            if self.count:
                derivative[self.n :, self.size :] = values.pop(0)
            derivative[self.n :, self.n : self.size] = mass
        return np.asarray(derivative)

    def _steps(self) -> Iterator[np.ndarray]:
        """Yield the derivative of each row by the row before and by the parameters."""
        rows = len(self.run.mu) - 1
        if not rows:
            return
        every = round(float((self.run.t[1] - self.run.t[0]) / float(self.flow.step)))
        width = self.size + self.count
        chunk = max(1, ENTRIES // (self.size * width))
        parts = [StepSeries(part, self.numbers) for part in self.flow.parts]
        for first in range(0, rows, chunk):
            last = min(rows, first + chunk)
            try:
                yield from self._expanded(parts, slice(first, last), every)
            except ValueError:  # a text decides by size or sign, and rows differ in it
                for k in range(first, last):
                    yield from self._expanded(parts, slice(k, k + 1), every)

    def _expanded(self, parts: Sequence[StepSeries], rows: slice, every: int) -> np.ndarray:
        """Return the derivatives of some rows, (r, N, N + parameters)."""
        width = self.size + self.count

        def varied(value: Number, k: int) -> Series:
            unit = self.numbers.zeros(1, width)
            unit[0, k] = self.numbers.number(1)
            return Series((value, unit), 0, 2)

        columns = [e[rows, None] for e in self.z]
        after = [e[rows.start + 1 : rows.stop + 1, None] for e in self.z]
        z = [varied(e, k) for k, e in enumerate(columns)]
        x, mu = z[: self.n], z[self.n :]
        qs = []
        for part in self.flow.parts:
            own = list(part.q[1:])
            own[: self.count] = [varied(e, self.size + k) for k, e in enumerate(own[: self.count])]
            qs.append([part.q[0], *own])
        span = self.numbers.number(self.flow.step) * every
        rates = [(b - a) / span for a, b in zip(columns, after, strict=True)]
        w = parts[0].near([e[rows, None] for e in self.u], rates)
        for _ in range(every):
            for part, q in zip(parts, qs, strict=True):
                x, mu, unknowns = part(x, mu, q, w, 1)
                w = [e.coefficient(0) if isinstance(e, Series) else e for e in unknowns]
        count = rows.stop - rows.start
        entries = [np.broadcast_to(e.coefficient(1), (count, width)) for e in (*x, *mu)]
        return np.stack(entries, axis=1)

    def _by_name(self, columns: np.ndarray) -> dict[str, np.ndarray]:
        """Return entries of the flat list of parameters by name, the parameter's shape last."""
        parts, at = dict[str, np.ndarray](), 0
        for name, value in self.flow.scheme.scene.parameters.items():
            shape = np.shape(np.array(value, dtype=object))
            count = int(np.prod(shape, dtype=int))
            part = columns[at : at + count]
            parts[name] = np.moveaxis(part, 0, -1).reshape((*part.shape[1:], *shape))
            at += count
        return parts
