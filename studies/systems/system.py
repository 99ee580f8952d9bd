"""What a system has of what studies ask for; the answers of one that has nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from ..core.case import Case, Progress


@dataclass(frozen=True)
class End:
    """Where the motion is at a time, by a method that knows no rule; x is None where none does.

    certain: errors below 10^(2 − certain) are not those of what is judged. about: what a result
    says of it. answer: the reference's own record. agreed: digits in which two references of a
    scene in numbers agree, where nothing else is known.
    """

    x: Any
    mu: Any
    certain: float
    about: Mapping[str, Any] = field(default_factory=dict)
    answer: Any = None
    agreed: int | None = None


@dataclass(frozen=True)
class Ladder:
    """Runs to one time: how many steps the k-th has, and how many runs there are, and at most."""

    duration: Fraction
    steps: Callable[[int], int]
    rungs: int
    most: int


@dataclass(frozen=True)
class SiteMomentum:
    """A momentum that is a sum over sites: the part of a site, a list of functions of (x, μ, p)."""

    name: str
    part: Callable[[Any, Any, Any], list[Any]]
    attitude: bool = False
    stretch: int | None = None


class System:
    """A case's scene or lattice with its rule.

    lacks: of what the system has none, a sentence that says why. The names are those of the methods
    and attributes below, which then give None.
    """

    lacks: Mapping[str, str] = {}
    #: momenta and their parts, where they are sums over sites; else a scene's symmetries say them
    momenta: tuple[SiteMomentum, ...] | None = None
    #: the kinds of defects that are asked for in `states`
    form_kinds: tuple[str, ...] | None = None
    #: times the steps of a long run, until it is told whether a drift of the energy goes on; of a
    #: system with a modified energy one is enough
    slower: tuple[int, ...] = (1,)

    def __init__(self, case: Case) -> None:
        self.case = case

    @property
    def scheme(self) -> Any:
        """The scene or lattice discretised by the rule."""
        return self.case.scheme

    def flow(self, step: Any) -> Any:
        """The flow at a step size, in the case's digits."""
        return self.scheme.flow(step, self.case.digits)

    def runs_at(self, digits: int) -> bool:
        """Whether there are runs in so many digits."""
        raise NotImplementedError

    @property
    def ladder(self) -> Ladder | None:
        """The runs that tell the order, where the system says them itself."""
        return None

    def end(self, time: Any, digits: int) -> End:
        """Where the motion is at a time; raises where no method can follow it."""
        raise NotImplementedError

    def error(self, x: Any, mu: Any, end: Any) -> tuple[float, float | None, float | None]:
        """The relative error of a state beside an end: of all, of x and of μ."""
        raise NotImplementedError

    def single_steps(self) -> Any:
        """The scheme whose single steps stand for the system's (`studies.evidence`), or None."""
        raise NotImplementedError

    def usual_steps(self, claimed: bool = True) -> int:
        """The steps of a long run in double precision."""
        raise NotImplementedError

    def long_run(self, steps: int, progress: Progress) -> Any:
        """So many steps of the usual size, of which `t` and the energy are kept."""
        raise NotImplementedError

    def energy(self, run: Any) -> tuple[np.ndarray, np.ndarray]:
        """(H, the sum of its absolute terms) per row of a run, (r,) each."""
        raise NotImplementedError

    def rates(self, state: tuple[Any, Any]) -> dict[str, float]:
        """|dJ/dt| of `momenta` of one's own in a state, by the equations, over their terms."""
        return {}

    @property
    def text(self) -> str:
        """What momenta depend on beside the equations of a step."""
        return ""

    def energy_errors(self, run: Any) -> np.ndarray:
        """(H − H₀)/scale per row of a long run, signed."""
        raise NotImplementedError

    def states(self, progress: Progress) -> list[tuple[float, Any, Any]] | None:
        """(t, x, μ) of a long run in which the form is asked for; None where it is in others."""
        return None

    def form_defect(self, flow: Any, x: Any, mu: Any, u: Any = None, seed: int = 0) -> float | None:
        """How far the step from (x, μ) is from a Poisson map; None where that cannot be asked."""
        raise NotImplementedError

    def step_defects(self, flow: Any, x: Any, mu: Any) -> dict[str, float | None]:
        """How far a step that runs is from the equations, and from each constraint, by kind."""
        raise NotImplementedError
