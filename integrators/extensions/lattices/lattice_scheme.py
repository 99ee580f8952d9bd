"""A lattice discretised by a rule: its equations with values, and its flows."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from typing import cast

import numpy as np

from ...compiler import LatticeStages
from ...equations import SceneSymbols
from ...errors import BadInput, CannotMeasure
from ...geometry import order_of_step
from ...hooks import source_text
from ...numbers import Arithmetic, Double, Number, flatten, working_digits
from ...numbers.types import Exact, Given
from ...rules import Discretisation, Substep, adjoint, check_rule
from ...scene import Again
from .bond_constraints import BondConstraints, check_constraints
from .contact_lattice import ContactLatticeFlow
from .lattice import Lattice
from .lattice_equations import LatticeEquations
from .lattice_flow import LatticeFlow
from .lattice_text import LatticeSystem


class LatticeScheme:
    """A lattice with a rule, the result of `Scheme(lattice, rule)`.

    Raises `BadInput` if the lattice's functions cannot be evaluated or FL is singular everywhere,
    `CannotMeasure` for one-step maps and for a rule that is no weighted sum of values of L.
    """

    def __init__(self, lattice: Lattice, rule: Discretisation) -> None:
        check_rule(rule)
        of_step = rule.of_step
        if not of_step.asks_lagrangian:
            raise CannotMeasure(f"{lattice.name}: lattices run by rules, and {rule.name} is a "
                                f"{of_step.kind}.")  # fmt: skip
        self.lattice, self.rule = lattice, rule
        self.equations = LatticeEquations(lattice, of_step)
        if self.constraints:
            self.check_start(*lattice.start)

    def __reduce__(self) -> Again:
        """Return the pickled form: equations are derived again, or read from the cache."""
        return LatticeScheme, (self.lattice, self.rule)

    def __deepcopy__(self, memo: object) -> LatticeScheme:
        return self  # a scheme is immutable

    def export(self, language: str, harness: bool = False) -> str:
        """Return one file of code, with loops over sites and bonds."""
        return str(source_text(self, language, harness))

    @property
    def constraints(self) -> BondConstraints | None:
        """The rows and multipliers of the bonds' constraints, or None."""
        return self.equations.constraints

    def check_start(self, x: np.ndarray, v: np.ndarray, eps: float = Double.eps) -> None:
        """Raise `BadInput` unless x (N, n) and v (N, m) satisfy independent constraints.

        eps: the round-off of the numbers that they come from; they are checked as doubles.
        """
        x, v, eps = x.astype(float), v.astype(float), max(float(eps), float(Double.eps))
        check_constraints(self.lattice, *self.terms[1][:2], x, v, eps)

    @cached_property
    def projection(self) -> LatticeScheme:
        """This scheme with the projection of momenta in place of a step."""
        other = copy(self)
        for name in ("substeps", "_parts"):  # a projection is one step, even for a composition
            vars(other).pop(name, None)
        other.rule, other.system = self.equations.rule, self.equations.projection
        return other

    @property
    def timed(self) -> bool:
        """True if a term depends on the time."""
        return self.equations.timed

    @property
    def local(self) -> bool:
        """True if each site is solved separately, as by the rectangle and the trapezoidal rule."""
        return self._parts[0].local and self._parts[-1].local

    @cached_property
    def order(self) -> int | None:
        """The order in (x, μ) of the rule on this lattice, or None if the rule states none."""
        equations = self.equations
        of_base = order_of_step(equations.rule, equations.site, lambda: equations.self_adjoint)
        if of_base is None or (method := self.rule.method) is None:
            return of_base
        return cast(int, method.order_over(of_base, equations.self_adjoint))

    @cached_property
    def substeps(self) -> tuple[Substep, ...]:
        """The substeps of a composition; () for a rule of one step."""
        method = self.rule.method
        return () if method is None else method.substeps(self.equations.self_adjoint)

    @property
    def kinds(self) -> list[int]:
        """For each substep 1 if it is the adjoint, else 0."""
        return [int(s.adjoint) for s in self.substeps] or [0]

    @cached_property
    def _parts(self) -> list[LatticeEquations]:
        """The equations of the rule and, if some substeps are its adjoint's, of the adjoint."""
        if not any(self.kinds):
            return [self.equations]
        return [self.equations, LatticeEquations(self.lattice, adjoint(self.equations.rule))]

    @cached_property
    def system(self) -> LatticeSystem:
        """One step as the data that is compiled."""
        systems = [e.system for e in self._parts]
        if len({s.kicks is None for s in systems}) > 1:
            raise CannotMeasure(f"{self.lattice.name}: {self.rule.name} has an adjoint of another "
                                "kind; compose another rule.")  # fmt: skip
        return replace(systems[0], adjoint=systems[1] if len(systems) > 1 else None)

    @cached_property
    def stages(self) -> LatticeStages | None:
        """One step as collocation, or None (`LatticeEquations.stages`)."""
        return None if self.substeps else self.equations.stages

    def q_values(
        self, step: Fraction, numbers: Arithmetic, of_stages: bool = False
    ) -> list[list[Number]]:
        """Return the values of `LatticeSystem.q`, a row per substep: its step, parameters, numbers.

        of_stages: True for the values of `LatticeStages.q`.
        """
        shared = flatten(tuple(self.lattice.split_parameters["shared"].values()))
        digits, rows = numbers.digits + 24, []
        for j, kind in enumerate(self.kinds):
            size = step
            if self.substeps:
                with working_digits(digits):
                    size = self.substeps[j].coefficient(digits) * step.numerator / step.denominator
            equations = self._parts[kind]
            constants = {} if of_stages else equations.constants
            time = [0] if self.timed else []  # runs put the time there
            values = [size, *time, *shared, *(c(digits) for c in constants.values())]
            rows.append([numbers.number(v) for v in values])
        return rows

    def own_rows(self, order: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the parameters of sites (N, ·), and of bonds (B, ·) in that order.

        Their columns are those of `LatticeSystem`.
        """
        lattice = self.lattice
        parts, pairs = lattice.split_parameters, lattice.pairs[order]
        N, B = lattice.sites, len(pairs)
        sites = [a.reshape(N, -1) for a in parts["site"].values()]
        bonds = [a[order].reshape(B, -1) for a in parts["bond"].values()]
        bonds += [a[pairs].reshape(B, -1) for k, a in parts["site"].items()
                  if k not in parts["bond"]]  # fmt: skip
        if self.constraints:
            free, tied = lattice.free, lattice.free[pairs].any(axis=1)
            bound = np.zeros(N, dtype=bool)
            bound[pairs[:, 1]] = tied
            sites += [free[:, None], bound[:, None]]
            bonds += [free[pairs], tied[:, None]]
        rows = [np.concatenate([np.zeros((length, 0)), *columns], axis=1)
                for length, columns in ((N, sites), (B, bonds))]  # fmt: skip
        return np.ascontiguousarray(rows[0]), np.ascontiguousarray(rows[1])

    @property
    def terms(self) -> list[tuple[SceneSymbols, list[Number], np.ndarray]]:
        """The `terms_at` the time 0, for terms that do not depend on it."""
        return self.terms_at(0)

    def terms_at(
        self, t: Number, number: Callable[[Exact], Number] = float
    ) -> list[tuple[SceneSymbols, list[Number], np.ndarray]]:
        """Return the terms of the sites and of the bonds at a time.

        Each is (symbols, parameter values as numbers or columns (r,), ends (r, 1 or 2)). The time
        is the last parameter of a term that depends on it. number: makes a number of an exact one.
        """
        return [
            (s, [e if np.ndim(e) else number(e) for e in values] + [t] * timed, ends)
            for s, values, ends, timed in self._terms
        ]

    @cached_property
    def _terms(self) -> list[tuple[SceneSymbols, list[Exact], np.ndarray, bool]]:
        equations, lattice = self.equations, self.lattice
        shared = flatten(tuple(lattice.split_parameters["shared"].values()))
        terms = []
        for s, own, rows, ends in zip(
            (equations.site.s, equations.bond_symbols),
            equations.own_letters,
            self.own_rows(np.arange(len(lattice.pairs))),
            (np.arange(lattice.sites)[:, None], lattice.pairs),
            strict=True,
        ):
            letters = [*(p for p in s.parameter_list if p not in own), *own]
            values = dict(zip(letters, [*shared, *rows.T], strict=True))
            parameters = [values[p] for p in s.parameter_list]
            terms.append((s.with_time_as_parameter(), parameters, ends, s.clocked))
        return terms

    def flow(self, step: Given | None = None, digits: int = 16, **others: object) -> LatticeFlow:
        """Return the flow at one step size; digits: see `LatticeFlow`. Other choices raise
        `BadInput`.
        """
        if step is None or others:
            words = "".join(f"{word}= is for scenes; " for word in others)
            raise BadInput(f"{self.lattice.name}: {words}a lattice has flow(step), of one size.")
        kind = ContactLatticeFlow if self.lattice.has_contact else LatticeFlow
        return kind(self, step, digits)
