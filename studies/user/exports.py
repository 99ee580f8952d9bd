"""An exported file beside its original: trajectories, verdicts of the studies, cost.

The file is built and asked for runs as any program is (`external`), so it is judged by what judges
programs of others.
"""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
import timeit
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from discmech.integrators import BadInput, Scheme, StepFailure, external
from discmech.integrators.errors import CouldNotRun
from discmech.integrators.extensions.lattices.lattice_run import LatticeRun
from discmech.integrators.flows import Start
from discmech.integrators.runs import run

from ..core.case import Progress, silent
from .checking import check

STEPS = 10_000
#: steps between two that are compared at least: before, nothing has been seen of the motion
FEWEST = 100
#: A bound that is more of the state than this sees nothing: half of a double's digits are left.
SEEN = 2.0**-26
#: Two runs with roundings of their own differ by the sum of what each is off. One that starts anew
#: from its rounded state at each step stands for either; eight times its largest difference so far
#: is beyond the scatter of one such run, and the floor is the rounding of some operations.
TIMES, FLOOR = 8.0, 64 * 2.0**-53
#: studies that ask a program for few enough runs, and judge what it should have in common with
#: the original
STUDIES = ("order", "symplecticity", "momentum", "energy")
#: what makes C as fast as the kernels, which are compiled for this processor: the first that a
#: compiler takes. A fused sum of a product rounds once, so compensated sums stay what they are.
FAST = ("-O3 -march=native -fno-math-errno -ffp-contract=fast", "-O2")
C = ("-std=c99", "-Wall", "-Wextra", "-pedantic")


def missing(language: str) -> str:
    """Return why a file of a language cannot be run here, or ""."""
    if language == "c":
        return "" if compiler() else "there is no C compiler cc or gcc on the PATH"
    if language == "julia":
        return "" if shutil.which("julia") else "there is no julia on the PATH"
    return "" if find_spec(language) else f"{language} is not installed here"


def compiler() -> str | None:
    """Return the C compiler, or None."""
    return shutil.which("cc") or shutil.which("gcc")


def built(text: str, language: str, folder: Path) -> list[str]:
    """Return the command that answers JSON lines with a file (with its harness), built in a folder.

    Raises `CouldNotRun` if the language is not here, or the compiler says anything.
    """
    if why := missing(language):
        raise CouldNotRun(
            f"{why}, so the file cannot be checked: install it, or leave --check out."
        )
    endings = {"c": "c", "julia": "jl"}
    file = folder / f"exported.{endings.get(language, 'py')}"
    file.write_text(text, encoding="utf-8")
    if language != "c":
        return ["julia" if language == "julia" else sys.executable, str(file)]
    for flags in FAST:
        command = [str(compiler()), *C, *flags.split(), "-o", str(folder / "exported"), str(file),
                   "-lm"]  # fmt: skip
        made = subprocess.run(command, capture_output=True, text=True, check=False)
        if not made.returncode and not made.stderr:
            return [str(folder / "exported")]
    raise CouldNotRun(f"{shlex.join(command)} says: {made.stderr.strip()[:400]}")


@dataclass(frozen=True)
class Beside:
    """The run of an exported file beside the original's.

    verdict, reason: of the comparison. steps: those that were compared, of `asked`. worst: the
    largest difference over its bound, at step `at`; difference, bound: there.
    """

    verdict: str
    reason: str
    asked: int
    steps: int
    worst: float
    at: int
    difference: float
    bound: float


def beside(scheme: Any, box: Any, steps: int = STEPS, progress: Progress = silent) -> Beside:
    """Compare the run of an exported file with that of its scheme, step by step.

    A difference may be as large as round-off makes it (TIMES, FLOOR), and is looked at while that
    is less than SEEN of the state.
    """
    try:
        one = _flow(scheme).trajectory(steps)
    except StepFailure as failure:
        if failure.trajectory is None or len(failure.trajectory.t) < 2:
            raise
        one = failure.trajectory
        steps = len(one.t) - 1
    progress("the exported file", 0.2)
    other = np.concatenate(_asked_for(scheme, box)(steps, 1), axis=1)
    progress("round-off of the original", 0.4)
    own = np.concatenate([e.reshape(len(e), -1) for e in (one.x, one.mu)], axis=1)
    scale = _sizes(one)
    again = _lattice_steps if _lattice(scheme) else _scene_steps
    restarted = _restarted(again(scheme, one.u), own, steps, scale)
    count = len(restarted)
    off = _over(np.abs(restarted - own[:count]), scale)
    bound = TIMES * np.maximum.accumulate(off) + FLOOR
    seen = bound <= SEEN
    count = count if seen.all() else int(np.argmin(seen))
    apart = _over(np.abs(other[:count] - own[:count]), scale)
    ratio = apart / bound[:count]
    at = int(np.argmax(ratio)) if count else 0
    asked = min(FEWEST, steps)
    figures = (steps, count - 1, float(ratio[at]), at, float(apart[at]), float(bound[at]))
    if not ratio[at] <= 1:  # NaN differs
        said = f"step {at} differs by {apart[at]:.1e} of the state; round-off is {bound[at]:.1e}"
        return Beside("fail", said, *figures)
    if not one.u.any() and (own == own[0]).all():
        said = "the scene stays at rest, where steps of any method agree; give it a start that "
        said += "moves (v0, or x0 beside the equilibrium): the file itself takes any start"
        return Beside("inconclusive", said, *figures)
    if count <= asked:
        said = f"round-off grows so fast that nothing can be told after {count - 1} steps"
        return Beside("inconclusive", f"{said}; begin at a calmer state", *figures)
    return Beside("pass", "", *figures)


def _lattice(scheme: Any) -> Any:
    return getattr(scheme, "lattice", None)


def _flow(scheme: Any) -> Any:
    return scheme.flow((_lattice(scheme) or scheme.scene).step)


def _asked_for(scheme: Any, box: Any) -> Callable[[int, int], tuple[np.ndarray, np.ndarray]]:
    """Return a function of steps and every: rows x, mu of the file, from the scheme's own start.

    The program is asked itself: constraints that have no reference refuse boxes, but have runs.
    """
    system, flow = _lattice(scheme) or scheme.scene, _flow(scheme)
    if _lattice(scheme):
        x, mu = flow.own_start
        start, timed = (x.ravel(), mu.ravel()), scheme.timed
    else:
        own, timed = flow.starting.own, scheme.s.clocked
        start = own.x[: scheme.s.n], own.mu
    parts = system.split_parameters if _lattice(scheme) else {"shared": system.parameters}
    values = {name: np.array(value, dtype=float).tolist()
              for part in parts.values() for name, value in part.items()}  # fmt: skip
    h, t = float(system.step), 0.0 if timed else None
    program = box.formula.program
    return lambda steps, every: program.run(*start, h, steps, every, system.name, values, t)


def _sizes(motion: Any) -> np.ndarray:
    """Return the unit of each entry, (n + m,): the largest of x, or of mu, in the run.

    An entry that is 0 but for the round-off of terms that cancel has no size of its own.
    """
    parts = motion.x, motion.mu
    return np.concatenate([np.full(e[0].size, np.abs(e).max(initial=0)) for e in parts])


def _over(differences: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return the largest difference of each row, each entry over its unit."""
    ratios: np.ndarray = (differences / np.where(scale > 0, scale, 1.0)).max(axis=1)
    return ratios


def _restarted(
    again: Callable[[int], np.ndarray], own: np.ndarray, steps: int, scale: np.ndarray
) -> np.ndarray:
    """Return rows of a run that forgets at each step all but its rounded state.

    again: returns the row after step k, from the row that it returned before.
    """
    rows = [own[0]]
    for k in range(steps):
        try:
            rows.append(again(k))
        except StepFailure:
            break
        if TIMES * _over(np.abs(rows[-1:] - own[k + 1]), scale)[0] > SEEN:
            break
    return np.array(rows)


def _beside(values: np.ndarray, drawn: np.random.Generator) -> np.ndarray:
    """Return values moved by a unit in the last place, as a program of other roundings would.

    Steps of the original round as its run does; stiff bonds, and quotients of small differences,
    make much of a unit. A zero stays, since any program has it exactly.
    """
    ends = np.where(values == 0, 0.0, drawn.choice((-np.inf, np.inf), values.shape))
    return np.nextafter(values, ends)


def _scene_steps(scheme: Any, us: np.ndarray) -> Callable[[int], np.ndarray]:
    """Return `again` (`_restarted`) of a scene; us: where Newton's method begins."""
    flow, drawn = _flow(scheme), np.random.default_rng(0)
    at = flow.starting.own

    def again(k: int) -> np.ndarray:
        nonlocal at
        at = at._replace(mu=_beside(at.mu, drawn))
        near = us[k] if flow.context.equations.arrows is not None else at.guess
        done = run(flow.stepper(Start(at.x, at.mu, near, t0=at.t0)), 1)
        at = at._replace(x=done.base[-1], mu=done.mu[-1])
        return np.concatenate([done.x[-1], done.mu[-1]])

    return again


def _lattice_steps(scheme: Any, us: np.ndarray) -> Callable[[int], np.ndarray]:
    """Return `again` (`_restarted`) of a lattice; us: where Newton's method begins."""
    flow, drawn = _flow(scheme), np.random.default_rng(0)
    made = LatticeRun(flow, *flow.own_start)

    def again(k: int) -> np.ndarray:
        for part in made.x, made.mu:
            part[made.free] = _beside(part[made.free], drawn)
        for w in () if made.by_stages else made.past:
            w[:, : us.shape[2]] = us[k]
        made.mu[~made.free] = 0
        made.begin()
        made.stepped()
        return np.concatenate([made.x.ravel(), made.mu.ravel()])

    return again


@dataclass(frozen=True)
class Verdicts:
    """What a study says of the original and of the exported file."""

    study: str
    original: str
    exported: str
    reason: str

    @property
    def alike(self) -> bool:
        """True if the file does not fall behind its original."""
        return self.exported in ("pass", "measured") or self.exported == self.original


def boxed(scheme: Any, command: Sequence[str]) -> Any:
    """Return an exported file as a program that claims what its rule has."""
    if _lattice(scheme):
        return external(list(command), order=scheme.order, files=(), name="exported", seconds=300)
    kept = [q.name for q in scheme.scene.symmetries if q.to_roundoff and not q.attitude]
    forced = scheme.scene.force is not None
    variational = scheme.equations.arrows is not None or bool(scheme.scene.all_constraints)
    symplectic = True if variational and not forced else None
    return external(
        list(command), order=scheme.order, symplectic=symplectic, files=(), name="exported",
        keeps=() if forced or not variational else tuple(kept), seconds=300,
    )  # fmt: skip


def verdicts(
    scheme: Scheme, box: Any, progress: Progress = silent, studies: Sequence[str] = STUDIES
) -> list[Verdicts]:
    """Return what each study says of the scheme and of the exported file, side by side."""
    rows = []
    for i, study in enumerate(studies):
        progress(study, i / len(studies))
        try:
            of_original = _asked(study, scheme.scene, scheme.rule)
            of_file = _asked(study, scheme.scene, box)
        except BadInput as error:  # the study does not apply
            rows.append(Verdicts(study, "not asked", "not asked", str(error)))
            continue
        rows.append(Verdicts(study, of_original[0], *of_file))
    return rows


def _asked(study: str, scene: Any, rule: Any) -> tuple[str, str]:
    answer = check(study, [scene], [rule], digits=[16])
    cases = [case for case in answer["cases"] if not case["control"]]
    worst = next((c for c in cases if c["verdict"] == answer["verdict"]), cases[0])
    return worst["verdict"], worst.get("reason") or ""


def cost(scheme: Any, box: Any, least: float = 0.2) -> tuple[float, float]:
    """Return seconds a step of the exported file, and of the scheme's own kernels.

    Each is the difference of a run and of one of twice the steps, which are many enough to take
    `least` seconds; starting a run and speaking JSON cost the same in both.
    """
    return _seconds(_asked_for(scheme, box), least), _seconds(_flow(scheme).trajectory, least)


def _seconds(made: Callable[[int, int], Any], least: float) -> float:
    count = 1000
    while True:
        once, twice = (
            min(timeit.repeat(partial(made, n, n), number=1, repeat=3)) for n in (count, 2 * count)
        )
        if twice - once >= least or count > 10**8:
            return (twice - once) / count
        count *= 2
