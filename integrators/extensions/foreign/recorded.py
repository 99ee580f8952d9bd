"""Runs made elsewhere as an integrator: the runs are judged, and no further step is made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, NoReturn

import numpy as np

from ...equations import initial_momentum
from ...errors import BadInput, CannotMeasure, arguments_checked, shown
from ...flows import StepChoice, Trajectory
from ...hooks import scene_named
from ...numbers import arithmetic, exact_rational, mpmath, whole_number
from ...numbers.types import Given, Number, Numbers, Vector
from ...rules import Claims
from ...scene import Scene
from .box import BlackBox, black_box, given_name
from .box_flow import BoxFlow
from .box_scheme import BoxScheme
from .caller import folder_of_caller
from .recordings import Recording, recordings

#: the studies that need only runs; all others make their own steps
MEASURED_BY = ("order", "momentum", "energy")
DIGITS = 40  # number of digits to which the velocity of a recorded start is solved for
#: tolerance relative to the start, for roundings on its way into a program and out, in any units
ALIKE = 2.0**-45


@dataclass(frozen=True)
class Recorded(BlackBox):
    """Runs of a method at several steps; see `recorded`."""

    recordings: tuple[Recording, ...] = ()
    #: the name of the scene of the runs; if empty, any scene that they fit
    scene: str = ""
    #: True if no name was given: a file's variable names the runs then
    unnamed: bool = False
    is_recorded: ClassVar[bool] = True

    def unmeasured(self, study: str) -> str:
        """Return the reason why a study cannot measure runs: it makes steps of its own."""
        if study in MEASURED_BY:
            return ""
        return (
            f"the study {study} makes steps of its own, and {self.name} are runs that were "
            "recorded: order, momentum and energy judge these."
        )

    def unit(self, digits: int) -> float:
        """Return the unit of round-off, or of the written digits, relative to the motion."""
        return max(super().unit(digits), *(run.unit for run in self.recordings))

    @property
    def scene_name(self) -> str:
        """The name of their scene, which may be given as FILE.py:NAME; "" if it is not given."""
        return scene_named(self.scene).name if ".py:" in self.scene else self.scene

    def refusal(self, scene: Scene) -> str:
        """Return a sentence that says why the runs cannot be those of the scene, or ""."""
        if self.scene_name not in ("", scene.name):
            return f"{self.name} are runs of {self.scene_name}, not of {scene.name}."
        run = self.recordings[0]
        here = run.x.shape[1], run.mu.shape[1]
        there = scene.groupoid.dim_x, scene.groupoid.dim_u
        if here != there:
            return (
                f"{run.path.name} has {here[0]} coordinates and {here[1]} momenta, but "
                f"{scene.name} has {there[0]} and {there[1]}."
            )
        return super().refusal(scene)

    def begins_at(self, scene: Scene) -> bool:
        """Return True if the runs fit the scene and begin at its start."""
        return not self.refusal(scene) and RecordedScheme(scene, self).begins_there

    def discretise(self, scene: Scene) -> RecordedScheme:
        """Return the runs on a scene, the result of `Scheme(scene, runs)`."""
        scheme = RecordedScheme(scene, self)
        if not scheme.begins_there:
            scheme.scene = scheme.moved()
        return scheme

    @property
    def digest(self) -> str:
        """The key of these runs."""
        return " ".join((self.said, *(run.digest for run in self.recordings)))


def _no_step(q: Vector, p: Vector, h: Number, steps: int, every: int) -> NoReturn:
    raise CannotMeasure("recorded runs are all there is: no further step can be made.")


@arguments_checked
def recorded(
    files: str | Path | Sequence[str | Path],
    order: int | None = None,
    *,
    scene: Scene | str = "",
    state: str = "qp",
    name: str | None = None,
    **claims: Any,
) -> Recorded:
    """Judge runs that were made elsewhere, one per file: CSV, npz or parquet, columns by name.

    files: a pattern such as "runs/*.csv", or several, relative to the folder of the calling file.
    The columns are t, q1, …, p1, … (or x1, …, mu1, …), evenly spaced in t; with state="qv" v1, … in
    place of momenta; a column h gives the step if not every step has a row. All runs begin at the
    same state. scene: the scene of the runs, itself, by its name, or as FILE.py:NAME; without it
    they belong to any scene that they fit (`verify` takes those that begin at the same state).
    order and claims (symplectic, keeps, source): as for `black_box`, but none of a step
    back and none of volume.

    Order, momenta and energy are judged; studies that need further steps are left out. Raises
    `BadInput` for files that are not such runs, and for claims of which they tell nothing.
    """
    folder = folder_of_caller()
    runs = recordings(files, folder, state)
    pattern = str(files if isinstance(files, str | Path) else files[0])
    label = given_name(name, "-".join(filter(None, ["recorded", Path(pattern).parent.name])))
    made = black_box(order, runs=True, state=state, name=label,
                     **{"source": f"recorded: {pattern}", **claims})(_no_step)  # fmt: skip
    said = made.claims or Claims()
    if said.reversible or "volume" in said.keeps:
        raise BadInput(
            f"{label}: rows of runs from one start tell of no step back and of no volume, so "
            'nothing could judge reversible=True or keeps="volume"; leave it out, or claim it of '
            "the program itself, by black_box or external."
        )
    if isinstance(scene, Scene):
        scene = scene.name
    if not isinstance(scene, str):
        raise BadInput(f"recorded(scene={shown(scene)}): give a scene, or the name of one.")
    if ".py:" in scene:
        scene = str(folder / scene)
    return Recorded(**vars(made), recordings=runs, scene=scene, unnamed=not name)


class RecordedScheme(BoxScheme):
    """A scene with recorded runs; as `discretise` makes it, its `scene` begins where they begin.

    Raises `CannotMeasure` for runs that do not fit the scene, and `BadInput` for runs whose starts
    differ.
    """

    rule: Recorded

    def __init__(self, scene: Scene, rule: Recorded) -> None:
        super().__init__(scene, rule)
        first = rule.recordings[0]
        numbers = arithmetic(DIGITS)
        with numbers.working():
            own = [float(v) for v in initial_momentum(self.s, scene, numbers, first.start)]
        starts: list[Numbers] = [self.scene.x0, own]
        near = max(ALIKE, 8 * rule.unit(16))
        parts = [[getattr(run, name) for run in self.runs] for name in ("x", "mu")]
        sizes = [np.abs(part[0]).max(initial=0.0) for part in parts]
        self.begins_there = all(
            np.abs(part[0][0] - np.array([float(v) for v in start])).max(initial=0.0) <= near * size
            for part, start, size in zip(parts, starts, sizes, strict=True)
        )
        for k, run in enumerate(rule.recordings[1:], 1):
            gap = max(np.abs(part[k][0] - part[0][0]).max(initial=0.0) / (size or 1.0)
                      for part, size in zip(parts, sizes, strict=True))  # fmt: skip
            if gap > near or run.start != first.start:
                raise BadInput(
                    f"{first.path.name} and {run.path.name} begin at different states, {gap:.2g} "
                    "of the motion apart, or times: an order is told from runs of one start."
                )

    def moved(self) -> Scene:
        """Return the scene with the runs' start; raises `BadInput` if it cannot begin there."""
        first, numbers = self.rule.recordings[0], arithmetic(DIGITS)
        system = self.in_numbers(numbers)
        x, second = (np.array(part[0].tolist(), object) for part in (first.x, first.mu))
        if self.s.clocked:
            system.t = first.t[0]
        with numbers.working():
            of_v = self.rule.form.second == "v"
            if self.scene.in_numbers:  # it begins at a momentum
                begins = {"mu0": system.momentum(x, second) if of_v else second}
            else:
                begins = {"v0": second if of_v else system.velocity(x, second)}
            written = {name: [mpmath.nstr(mpmath.mpf(v), DIGITS) for v in values]
                       for name, values in begins.items()}  # fmt: skip
        there = self.scene.with_values(x0=first.x[0].tolist(), **written)
        return BoxScheme(there, self.rule).scene  # this checks the start

    @cached_property
    def runs(self) -> tuple[Trajectory, ...]:
        """The runs as trajectories, the largest step first."""
        runs = []
        for run in self.rule.recordings:
            flow = BoxFlow(self, run.step)
            mus = run.mu
            if self.rule.form.second == "v":
                flow.system.t = run.t[0]
                mus = np.array([flow.system.momentum(*row) for row in zip(run.x, mus, strict=True)])
            runs.append(flow._rows(run.x, mus, run.steps, run.every, run.start))
        return tuple(runs)

    def flow(
        self, step: Given | None = None, digits: int = 16, on_edge: str = "refuse", *,
        tolerance: Given | None = None,
    ) -> Any:  # fmt: skip
        """Return the recorded run with that step; raises `CannotMeasure` if there is none."""
        if step is None or tolerance is not None:
            raise BadInput(f"{self.rule.name}: give the step of a run that was recorded.")
        if digits != 16:
            raise CannotMeasure(f"{self.rule.name} was recorded in machine numbers: digits=16.")
        size = exact_rational(step, "step")
        for run in self.runs:
            if abs(run.step - size) <= 1e-9 * abs(size):
                return RecordedFlow(self, run)
        there = ", ".join(f"{float(run.step):.6g}" for run in self.runs)
        raise CannotMeasure(
            f"{self.rule.name} has no run of the step {float(size):.6g}; recorded are {there}."
        )


class RecordedFlow:
    """A recorded run in the place of a flow: `trajectory` gives its rows."""

    choice: StepChoice | None = None

    def __init__(self, scheme: RecordedScheme, run: Trajectory) -> None:
        self.scheme, self.step, self.digits, self._run = scheme, run.step, 16, run

    @arguments_checked
    def trajectory(self, steps: int, every: int = 1, **start: Any) -> Trajectory:
        """Return the rows of the first `steps` steps, every `every`-th.

        Raises `CannotMeasure` if these were not recorded, or for another start.
        """
        steps, every = whole_number("steps", steps, 0), whole_number("every", every, 1)
        run, apart = self._run, self._run.steps // (len(self._run.t) - 1)
        start.pop("progress", None)
        if any(value is not None and value != 0 for value in start.values()):
            raise CannotMeasure(f"{self.scheme.rule.name} was recorded from one start alone.")
        if steps > run.steps or every % apart:
            raise CannotMeasure(
                f"{self.scheme.rule.name} has {run.steps} steps of {float(run.step):.6g}, each "
                f"{apart}. of them a row: no others can be had."
            )
        at = slice(0, steps // apart + 1, every // apart)
        rows = {name: value[at] for name, value in vars(run).items()
                if isinstance(value, np.ndarray)}  # fmt: skip
        return Trajectory(**{**vars(run), **rows, "steps": steps})
