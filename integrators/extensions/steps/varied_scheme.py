"""A scene with a rule whose steps vary."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache
from math import inf, nan
from typing import Any

from ...compiler import Step
from ...equations import DiscretisedScene, SceneSymbols, StepEquations, initial_momentum
from ...errors import BadInput, CannotMeasure, arguments_checked, brief_name
from ...flows import Scheme
from ...numbers import Arithmetic, Double, numeric, sympy
from ...numbers.types import Expression, Function, Given
from ...scene import Scene
from .poincare import (
    ENERGY,
    TIME,
    controlled,
    in_own_time,
    letter,
    logarithmic_rate,
    sigma_of,
    with_columns,
)
from .varied_flow import VariedFlow


class VariedScheme(DiscretisedScene):
    """A scene with a rule whose steps vary; its flow's step is ε, a step of the time τ.

    inner: the scheme of the base rule, for "poincare" on the scene in its own time, where the form
    on (x, μ) is that of the extended phase space at p_t = −E₀. equations: those of inner.
    Raises `BadInput` for another object than a scene, and for a σ of another shape, or that is not
    smooth or not positive at the start; `CannotMeasure` where the rule has no meaning.
    """

    #: a step is a map of (x, μ, t, ζ) and no arrow
    has_arrows = False

    def __init__(self, scene: Any, rule: Any, inner: Scheme | None = None) -> None:
        if not isinstance(scene, Scene):
            raise BadInput(f"{brief_name(scene)} is no scene: give a Scene, or scenes.get(name).")
        if refusal := rule.refusal(scene):
            raise CannotMeasure(refusal)
        if inner is not None:
            self.inner = inner
        elif rule.way == "poincare":
            self.inner = Scheme(in_own_time(scene, rule.sigma_on(scene)), rule.base)
        else:
            self.inner = Scheme(scene, rule.base)
        self.hold(scene, rule, self.inner.equations)
        if self.by_poincare:  # the energy of the scene itself is that of the physical time
            self.s = SceneSymbols(scene)
        self.substeps, self.base = self.inner.substeps, self.inner.base
        self.sigma = sigma_of(self.inner.s, rule.sigma_on(scene), bare=self.by_poincare)

    @property
    def by_poincare(self) -> bool:
        """True if the system is that of K, on the extended phase space."""
        return self.rule.way == "poincare"

    @property
    def controlled(self) -> bool:
        """True if the step density is a part of the state, changed by a controller."""
        return self.rule.way == "reversible"

    @cached_property
    def density0(self) -> float:
        """The step density 1/σ at the scene's start; raises `BadInput` if σ is not positive."""
        numbers, scene = Double(), self.inner.scene
        mu = initial_momentum(self.inner.s, scene, numbers)
        start = self.inner.s.with_time(scene.x0), mu, scene.parameter_values
        x, mu, p = ([numbers.number(e) for e in part] for part in start)
        try:
            sigma = float(self.control(numbers)(x, mu, p)[0])
        except (ArithmeticError, ValueError):
            sigma = nan
        if not 0 < sigma < inf:
            raise BadInput(
                f"{scene.name}: sigma is {sigma:.3g} at the start: give one that is positive."
            )
        return 1 / sigma

    def refused(self, name: str) -> CannotMeasure:
        return CannotMeasure(
            f"{self.rule.name} has steps that vary, of which no {name} is known: ask that of "
            f"{self.rule.base.name}."
        )

    def __deepcopy__(self, memo: object) -> VariedScheme:
        return self  # it never changes

    def __reduce__(self) -> tuple[Any, ...]:
        return VariedScheme, (self.scene, self.rule)

    @property
    def order(self) -> int | None:
        """The order in ε of (x, μ) at the physical times that are reached.

        It is that of the base, whose steps are smooth functions of τ. The naive step has it as
        well.
        """
        return self.inner.order

    @property
    def self_adjoint(self) -> bool:
        """True if a step of −ε undoes one of ε, as a map of (x, μ, t, ζ)."""
        return self.rule.way != "naive" and self.inner.self_adjoint

    def at(self, **values: Any) -> VariedScheme:
        """Return this rule on the scene with other values; raises the errors of `Scheme.at`."""
        if not self.by_poincare:
            inner = self.inner.at(**values)
            return VariedScheme(inner.scene, self.rule, inner)
        scene = self.scene.with_values(**values)
        own = in_own_time(scene, self.rule.sigma_on(scene))
        return VariedScheme(scene, self.rule, Scheme(own, self.rule.base, self.inner.equations))

    def with_energy(self, energy0: Given) -> VariedScheme:
        """Return this "poincare" scheme with E₀ = energy0, for any energy of the start."""
        inner = self.inner.at(parameters={ENERGY: energy0})
        return VariedScheme(self.scene, self.rule, inner)

    @arguments_checked
    def flow(
        self,
        step: Given = None,
        digits: int = 16,
        on_edge: str = "refuse",
        *,
        tolerance: Given = None,
    ) -> VariedFlow:
        """Return the flow at one step ε of τ.

        Raises `BadInput` for another on_edge than "refuse", and for a tolerance, since no step ε is
        chosen for one.
        """
        if step is None or tolerance is not None:
            raise BadInput(
                f"{self.scene.name} with {self.rule.name}: give a step, of the time τ; none is "
                "chosen for a tolerance."
            )
        if on_edge != "refuse":
            raise BadInput(f'{self.rule.name} has steps that vary: leave on_edge="refuse".')
        return VariedFlow(self, step, digits)

    @cached_property
    def system(self) -> Step:
        """Return one step as the data that is compiled; with a composition's adjoint substeps."""
        inner = self.inner
        kinds = [inner.equations]
        if any(part.adjoint for part in inner.substeps):
            kinds.append(inner.adjoint.equations)
        return _system(tuple(kinds), bool(inner.substeps), self.sigma, self.rule.way)

    @lru_cache(maxsize=8)  # noqa: B019 - a scheme has few arithmetics
    def control(self, numbers: Arithmetic) -> Function:
        """Return (σ, G) as a function of (x, μ, parameters), by rows in double precision."""
        s = self.inner.s
        grows = logarithmic_rate(s, self.sigma) if self.controlled else sympy.S.Zero
        letters = {"x": s.x, "mu": s.mu, "p": s.parameter_list}
        return numeric(letters, [self.sigma, grows], numbers, columns=isinstance(numbers, Double))


@lru_cache(maxsize=64)  # schemes that differ in values alone have one
def _system(kinds: tuple[StepEquations, ...], composed: bool, sigma: Expression, way: str) -> Step:
    """Return the system of a step; `KernelsAtStep` calls those of its substeps 0 and 1.

    Where a composition has no adjoint, 1 is the first substep, which alone changes the density.
    """

    def of(equations: Any, leading: bool = True) -> Step:
        system = replace(equations.step, composed=composed)
        if way != "poincare":
            return controlled(system, equations.s, sigma, way, leading)
        passed = equations.arrows.discrete_lagrangian.diff(getattr(equations.s.parameters, ENERGY))
        return with_columns(system, [letter(TIME)], [passed])

    if way != "poincare" and composed and len(kinds) == 1:
        return replace(of(kinds[0], leading=False), adjoint=of(kinds[0]))
    main, *others = map(of, kinds)
    return replace(main, adjoint=others[0]) if others else main
