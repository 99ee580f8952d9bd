"""The values that studies ask of a system, and the answers that most systems share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from ..core.case import Case, Progress
from .modified_change import Change


@dataclass(frozen=True)
class End:
    """The state at a time, by a method that knows no rule; x is None if no method gives it.

    certain: errors below 10^(2 − certain) may be this state's own. about: the entries of a result
    about it. answer: the reference's own record. agreed: digits in which two references of a scene
    in numbers agree, if no other bound is known.
    """

    x: Any
    mu: Any
    certain: float
    about: Mapping[str, Any] = field(default_factory=dict)
    answer: Any = None
    agreed: int | None = None


@dataclass(frozen=True)
class Ladder:
    """Runs to one time: the k-th's number of steps, and the usual and largest number of runs."""

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


class System(ABC):
    """A case's scene or lattice with its rule.

    lacks: name of a missing value → a sentence with the reason. The names are those of the methods
    and attributes below, which then give None.
    """

    lacks: Mapping[str, str] = {}
    #: momenta and their parts, if they are sums over sites; otherwise a scene's symmetries give
    #: them
    momenta: tuple[SiteMomentum, ...] | None = None
    #: the kinds of defects that are measured in `states`
    form_kinds: tuple[str, ...] | None = None
    #: factors of the steps of a long run, tried until it is clear whether a drift of the energy
    #: continues; for a system with a modified energy one is enough
    slower: tuple[int, ...] = (1,)

    def __init__(self, case: Case) -> None:
        self.case = case

    @property
    def scheme(self) -> Any:
        """The scene or lattice discretised by the rule."""
        return self.case.scheme

    def flow(self, step: Any, **how: Any) -> Any:
        """Return the flow at a step size, in the case's digits. how: options of flows of scenes."""
        return self.scheme.flow(step, self.case.digits, **how)

    def steps_for(self, step: Any) -> int:
        """Return the number of steps of that size in its duration."""
        return -int(-self.case.scene.duration // step)

    @property
    def ladder(self) -> Ladder | None:
        """The runs that show the order, if the system chooses them itself."""
        return None

    @abstractmethod
    def end(self, time: Any, digits: int) -> End:
        """Return the state at a time; raises if no method can follow the motion."""

    @property
    def energy_changes(self) -> bool:
        """True if something else than a method's error changes the energy along a run."""
        return bool(self.case.scene.contact is not None)

    @abstractmethod
    def error(self, x: Any, mu: Any, end: Any) -> tuple[float, float | None, float | None]:
        """Return the relative error of a state from an end: of all, of x and of μ."""

    @abstractmethod
    def single_steps(self) -> Any:
        """Return the scheme whose steps stand for the system's (`studies.evidence`), or None."""

    @abstractmethod
    def usual_steps(self, claimed: bool = True) -> int:
        """Return the number of steps of a long run in double precision."""

    def modified_changes(self, steps: int) -> list[Change]:
        """Return rows of the change of the modified energy along a run; none where it is unknown.

        Each is over the scale of `energy_errors`.
        """
        return []

    @abstractmethod
    def long_run(self, steps: int, progress: Progress) -> Any:
        """Return a run of so many steps of the usual size, with `t` and the energy."""

    @abstractmethod
    def energy(self, run: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return (H, the sum of its absolute terms) per row of a run, (r,) each."""

    def rates(self, run: Any) -> dict[str, float]:
        """Return the largest |dJ/dt| of its own `momenta` beside a run without forces, over their
        terms.
        """
        return {}

    def worked(self, name: str) -> bool:
        """Return True if a force changes that one of its own `momenta`."""
        return False

    def less_work(
        self, names: Sequence[str], steps: int, rows: int
    ) -> list[tuple[float, dict[str, float]]]:
        """Return (t, change of each in a step less the work of forces) along a run and beside it.

        The changes are over their terms (`momenta`). rows: how many of the run's are taken.
        """
        return []

    def moved(self, name: str, state: Any, size: float) -> float:
        """Return the change of a momentum by a fault of that size, over its terms (`momenta`)."""
        raise NotImplementedError

    @abstractmethod
    def energy_errors(self, run: Any) -> np.ndarray:
        """Return (H − H₀)/scale per row of a long run, signed."""

    def states(self, progress: Progress) -> list[tuple[float, Any, Any]] | None:
        """Return (t, x, μ) of a long run for the form; None if it is measured at other states."""
        return None

    @abstractmethod
    def form_defect(self, flow: Any, x: Any, mu: Any, u: Any = None, seed: int = 0) -> float | None:
        """Return the defect of the step from (x, μ) as a Poisson map; None if unknown."""

    @abstractmethod
    def step_defects(
        self, flow: Any, x: Any, mu: Any, taken: Any = None, u: Any = None
    ) -> dict[str, float | None]:
        """Return the defects of a step in the equations and in each constraint, by kind.

        taken: (x, μ) where it ends in the run, and u that of its row; None if it is made here.
        """
