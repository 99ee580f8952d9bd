"""A lattice by a rule: sums over sites and bonds, in double precision."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators.errors import CannotMeasure, StepFailure
from discmech.integrators.extensions.lattices import scene_of

from ..core.case import Progress
from ..core.parts import is_built_in
from .following import LongRun, followed
from .known import Known, known_of
from .lattice_modified import has_modified_energy, lattice_changes
from .lattice_work import is_changed, is_worked, less_work
from .modified_change import Change
from .quantities import change, energies, momentum, of_symmetries
from .reference import field_of, solution
from .residual import step_defects
from .system import End, Ladder, SiteMomentum, System

RUNGS, MOST_RUNGS = 5, 8
COARSE, HIGHER = 32, 8  # steps of the coarsest run, and the divisor of them from order 4 on
#: from order 6 on, where halved steps reach round-off after three levels: steps of the coarsest
#: run, and the largest error that it may have before the time is doubled
STEEP, COARSEST, LARGE_ERROR = 6, 3, 1e-4
#: round-off of some hundred steps, as a share of the largest number of a kind of values
LEAST = 2.0**-46
DRAWN = 16  # states of `rates`, and faults of `moved`
FAINT = 8  # the power of 1/2 of the fault of `moved` that is nearest to the run
PAIRS = 2  # pairs of variations that test the form at a state
#: more digits: steps of the coarsest run, and coordinates up to which a series ends within seconds
FEW, COORDINATES = 8, 40
#: lattices whose form takes a quarter of a minute to derive, done only with --thorough
LATER = ("beam", "spaghetti")
STEP_KINDS = ("residual", "constraint", "hidden")
Pair = tuple[np.ndarray, np.ndarray]


class LatticeSystem(System):
    """A scheme of a lattice; see `System`."""

    #: the energy of many sites may change slowly and return. If a run does not decide, one eight
    #: times as long is made, and then no other
    slower = (1, 8, 64)

    @property
    def lattice(self) -> Any:
        """The lattice."""
        return self.case.scene

    @cached_property
    def known(self) -> Known:
        """Known facts of a lattice of the bench."""
        return known_of(self.lattice)

    @cached_property
    def momenta(self) -> tuple[SiteMomentum, ...]:  # type: ignore[override]
        """The momenta of the lattice's symmetries; under contact those that nothing changes: no row
        tells where in a step impulses act.
        """
        parts, gaps = of_symmetries(self.lattice).items(), self.lattice.has_contact
        return tuple(SiteMomentum(name, part) for name, part in parts
                     if not (gaps and is_changed(self.scheme, part)))  # fmt: skip

    @property
    def energy_changes(self) -> bool:
        """By a force, in time and at impacts."""
        lattice = self.lattice
        return lattice.forced or lattice.timed or lattice.has_contact

    @property
    def form_kinds(self) -> tuple[str, ...]:  # type: ignore[override]
        """The Poisson form, and a step's defects in its equations and constraints."""
        tied = self.lattice.constraint is not None
        return ("poisson", *(STEP_KINDS if tied else STEP_KINDS[:1]))

    @cached_property
    def lacks(self) -> dict[str, str]:  # type: ignore[override]
        """The reason why no form is derived in time."""
        reasons = {"modified_energy": "a lattice's energy is judged by its run first"}
        if self.lattice.name in LATER and is_built_in(self.lattice) and not self.case.thorough:
            reasons["form_defect"] = "its derivatives take a quarter of a minute: --thorough"
        return reasons

    @cached_property
    def ladder(self) -> Ladder:
        """The ladder of halved steps; for a steep rule each is 1/√2 of the one before.

        A steep rule's ladder needs an end that is known: without one, changes lie on a line only
        where each step is the same part of the one before.
        """
        if self.case.digits > 16:
            first = self.case.steps or FEW
            more = int(self.end(FEW * self.lattice.step, self.case.digits).x is None)
            return Ladder(FEW * self.lattice.step, lambda k: first * 2**k, 4 + more, 6 + more)
        T, order, asked = self._duration, self.case.order or 0, self.case.steps
        if order >= STEEP and not asked and self.end(T, 16).x is not None:
            counts = lambda k: round(COARSEST * 2 ** (k / 2))  # noqa: E731
            return Ladder(T, counts, 2 * RUNGS - 1, 2 * MOST_RUNGS - 1)
        coarsest = asked or (COARSE if order < 4 else COARSE // HIGHER)
        more = int(self.end(T, 16).x is None)  # the finest run has no error of its own
        return Ladder(T, lambda k: coarsest * 2**k, RUNGS + more, MOST_RUNGS + more)

    @cached_property
    def _duration(self) -> Fraction:
        """The duration of the order's runs; it is longer for a steep rule.

        It is doubled until the coarsest run has a large error.
        """
        T: Fraction = COARSE * self.lattice.step
        if (self.case.order or 0) >= STEEP:
            while self.lattice.duration >= 2 * T and self._coarse_error(2 * T) < LARGE_ERROR:
                T *= 2
        return T

    def _coarse_error(self, T: Fraction) -> float:
        """Return the coarsest run's difference from one of half steps; inf without runs."""
        ends = []
        for count in (COARSEST, 2 * COARSEST):
            try:
                run = self.flow(T / count).trajectory(count, count)
            except StepFailure:
                return math.inf
            ends.append((run.x[-1], run.mu[-1]))
        return max(map(_apart, *ends))

    def end(self, time: Any, digits: int) -> End:
        """Return the end by a closed form, by the equations of motion, or without x and μ."""
        if time not in self._ends:
            by_scene = self.case.digits > 16
            self._ends[time] = self._of_scene(time, digits) if by_scene else self._end(time)
        return self._ends[time]

    def _of_scene(self, time: Any, digits: int) -> End:
        """Return the end in more digits by the certified reference of the lattice as a scene."""
        lattice, why = self.lattice, ""
        if int(lattice.free.sum()) * lattice.groupoid.dim_x > COORDINATES:
            why = f"as a scene it has more than {COORDINATES} coordinates"
        if lattice.constraint is not None:
            why = "the series of a scene with so many constraints takes more than ten minutes"
        if why:
            about = {"held_against": "its own runs", "why_not": why, "known": 10.0**-digits}
            return End(None, None, digits, about)
        state = reference.solution(scene_of(lattice), time, digits=digits)
        x, mu = (np.array(e, dtype=object) for e in lattice.start)
        mu[:] = 0
        for whole, part in ((x, state.x), (mu, state.mu)):
            whole[lattice.free] = np.array([*part], dtype=object).reshape(-1, whole.shape[1])
        about = {"held_against": "Taylor series of its scene", "known": 10.0**-state.certain_digits}
        return End(x, mu, state.certain_digits, about)

    @cached_property
    def _ends(self) -> dict[Any, End]:
        return {}

    def _end(self, time: Any) -> End:
        if self._exact is not None:
            flow = self.flow(time)
            x, v = (e[:, None] for e in self._exact(self.lattice, float(time)))
            mu = np.where(self.lattice.free[:, None], flow.momenta(x, v), 0)
            return End(x, mu, _certain(LEAST), {"held_against": "closed form", "known": LEAST})
        try:
            x, mu, known = solution(self.scheme, float(time))
        except CannotMeasure as error:
            about = {"held_against": "its own runs", "why_not": str(error), "known": LEAST}
            return End(None, None, _certain(LEAST), about)
        return End(x, mu, _certain(known), {"held_against": "equations of motion", "known": known})

    @property
    def _exact(self) -> Any:
        return self.known.exact if self.known.refined is None else None

    def error(self, x: Any, mu: Any, end: Any) -> tuple[float, float | None, float | None]:
        """Return the largest error of x or μ at a site, each over its largest, and both parts.

        With a closed form the ends of a chain are left out, which it does not have.
        """
        tenth = self.lattice.sites // 10
        inner = slice(tenth, -tenth) if self._exact is not None else slice(None)
        of_x, of_mu = _apart(x, end.x, inner), _apart(mu, end.mu, inner)
        return max(of_x, of_mu), of_x, of_mu

    def single_steps(self) -> Any:
        """Return the scheme itself."""
        return self.scheme

    def usual_steps(self, claimed: bool = True) -> int:
        """Return enough steps of a known lattice to show slow changes; those of the duration under
        contact, where each impact is found in Python.
        """
        most = self.steps_for(self.lattice.step) if self.lattice.has_contact else self.known.steps
        return min(most, self.known.steps)

    def long_run(self, steps: int, progress: Progress) -> LongRun:
        """Return the run by `following.followed`, with momenta only for the shortest run."""
        progress(f"{self.lattice.name} {self.case.label}: {steps} steps", 0.0)
        first = steps <= (self.case.steps or self.usual_steps())
        return _run(self.scheme, steps, first)

    def energy(self, run: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the energy per row, and for its terms the largest of all rows."""
        if isinstance(run, LongRun):
            return run.energy, np.full(len(run.t), run.size)
        values, size = energies(self.scheme, run)
        return values, np.full(len(values), size)

    def energy_errors(self, run: Any) -> np.ndarray:
        """Return the energy's errors over the largest sum of its absolute terms."""
        values, terms = self.energy(run)
        return (values - values[0]) / (terms[0] or 1)

    def modified_changes(self, steps: int) -> list[Change]:
        """Return the changes along a run of the lattice's step, on pairs without constraints."""
        if not has_modified_energy(self.lattice):
            return []
        changes = lattice_changes(self.scheme, steps)
        return [] if changes is None else changes.rows(_run(self.scheme, steps, True).size)

    def rates(self, run: LongRun) -> dict[str, float]:
        """Return the largest |dJ/dt| of the momenta of a lattice's symmetries, over their terms.

        It is by the equations of motion without forces at DRAWN states, near to those of a run and
        beside them; states where the equations are not real are left out. Constraints would be left
        by such states: it is empty.
        """
        parts, lattice, scheme = of_symmetries(self.lattice), self.lattice, self.scheme
        if not parts or lattice.constraint is not None:
            return {}
        if lattice.forced:
            scheme = self.case.scheme_on(replace(lattice, force=None, bond_force=None))
        drawn, (x0, near) = np.random.default_rng(0), lattice.start
        fields = [field_of(scheme, x0.shape, near, part=e) for e in (np.asarray, abs)]
        worst = dict.fromkeys(parts, 0.0)
        for _, *row in itertools.islice(itertools.cycle(run.states), DRAWN):
            t, (x, mu) = drawn.uniform(0, run.t[-1]), self._beside(run.states, row, drawn)
            with np.errstate(all="ignore"), suppress(CannotMeasure):
                rates, sizes = (
                    [e.reshape(len(x), -1) for e in np.split(of(t, np.r_[x.ravel(), mu.ravel()]),
                                                             [x.size])] for of in fields
                )  # fmt: skip
                for name, part in parts.items():
                    one = change(scheme, part, (x, mu), rates, sizes)
                    worst[name] = max(worst[name], one if math.isfinite(one) else 0.0)
        return worst

    def _beside(self, states: Sequence[Any], row: Sequence[Any], drawn: Any) -> list[Any]:
        """Return a row's x and μ, changed by drawn shares of their size; x only on pairs."""
        lattice, share = self.lattice, 2.0 ** -drawn.uniform(1, FAINT)
        most = [max(float(abs(at[k]).max(initial=0)) for at in states) or 1.0 for k in (1, 2)]
        most[0] *= lattice.groupoid.canonical
        return [e + share * size * lattice.free[:, None] * drawn.uniform(-1, 1, e.shape)
                for e, size in zip(row, most, strict=True)]  # fmt: skip

    def worked(self, name: str) -> bool:
        """Return True if forces of sites, or of bonds on both of their ends, change a momentum."""
        return self.lattice.forced and is_worked(self.scheme, of_symmetries(self.lattice)[name])

    def less_work(
        self, names: Sequence[str], steps: int, rows: int
    ) -> list[tuple[float, dict[str, float]]]:
        """Return `lattice_work.less_work` of steps from rows of a run, and from states beside them.

        Constraints would be left by such states: with these they are of the run alone.
        """
        every, of_all = max(1, steps // rows), of_symmetries(self.lattice)
        parts, flow = {name: of_all[name] for name in names}, self.flow(self.lattice.step)
        drawn, gaps = np.random.default_rng(0), list[tuple[float, dict[str, float]]]()
        for block in flow.blocks(steps, every, size=1) if parts else ():
            row = float(block.t[0]), block.x[0], block.mu[0]
            states = [row]
            if self.lattice.constraint is None:
                states.append((row[0], *self._beside([row], row[1:], drawn)))
            made = [less_work(flow, parts, *state) for state in states]
            gaps.append((row[0], {name: max(one[name] for one in made) for name in parts}))
        return gaps

    def moved(self, name: str, state: Pair, size: float) -> float:
        """Return the largest change of a momentum, over its terms, by DRAWN faults of x and μ.

        Each moves each entry by that share of its size, up or down.
        """
        drawn, part = np.random.default_rng(0), of_symmetries(self.lattice)[name]
        faults = [state] + [[e * (1 + size * drawn.choice((-1, 1), e.shape)) for e in state]
                            for _ in range(DRAWN)]  # fmt: skip
        values, terms = momentum(self.scheme, part, *map(np.stack, zip(*faults, strict=True)))
        return float(abs(values - values[:, :1]).max() / (terms[:, 0].max() or 1.0))

    def states(self, progress: Progress) -> list[tuple[float, Any, Any]]:
        """Return some states of a long run, including the first and the last."""
        return self.long_run(self.case.steps or self.usual_steps(), progress).states

    def form_defect(
        self, flow: Any, x: Any, mu: Any, u: Any = None, seed: int = 0, t: float = 0
    ) -> float | None:
        """Return the form's defect by random variations."""
        if "form_defect" in self.lacks:
            return None
        return float(flow.poisson_defect(x, mu, t=t, pairs=PAIRS, seed=seed))

    def step_defects(
        self, flow: Any, x: Any, mu: Any, taken: Any = None, u: Any = None, t: float = 0
    ) -> dict[str, float | None]:
        """Return `residual.step_defects`, of a composition the largest of its substeps."""
        return {**step_defects(flow, x, mu, t)}


@lru_cache(maxsize=8)  # energy, momentum and symplecticity share one run
def _run(scheme: Any, steps: int, with_momenta: bool) -> LongRun:
    lattice = scheme.lattice
    parts = of_symmetries(lattice) if with_momenta else {}
    return followed(scheme, scheme.flow(lattice.step), steps, parts)


def _certain(known: float) -> float:
    """Return the `End.certain` for errors down to `known`."""
    return 2 - math.log10(known)


def _apart(one: Any, other: Any, inner: slice = slice(None)) -> float:
    return float(abs(one - other)[inner].max() / (abs(other).max() or 1))
