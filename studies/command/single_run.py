"""`discmech run`: one trajectory, or a problem of control solved, printed or as JSON."""

from __future__ import annotations

import argparse
import sys
import time
from math import isfinite
from typing import TYPE_CHECKING, Any

from discmech.integrators import BadInput, StepFailure

from ..core import lookup
from ..core.options import digits_in, whole
from .control import steer
from .options import add_rule, rule_asked, scene_asked
from .output import DERIVED, progress_shown, write_json, write_run

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..systems import System

MOST_SHOWN = 24  # numbers or sites of a row; of more the first and last are shown


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    said = "one trajectory of a scene or lattice; a problem of optimal control is solved"
    parser = commands.add_parser("run", help=said)
    parser.add_argument("scene")
    add_rule(parser, "; default: trapezoidal, of a one-form a Gauss method for it")
    parser.add_argument(
        "--step", metavar="H", help='exact: "0.01" is 1/100 (default: the scene\'s)'
    )
    parser.add_argument(
        "--tolerance",
        metavar="E",
        help="instead of --step: choose it for this error over the scene's duration",
    )
    parser.add_argument("--steps", metavar="N", help="default: the scene's duration")
    parser.add_argument("--every", metavar="K", default="1", help="keep every K-th row (default 1)")
    parser.add_argument(
        "--digits", metavar="D", default="16", help="16 is double precision, 7 single"
    )
    parser.add_argument("--retraction", metavar="NAME")
    parser.add_argument(
        "--on-edge",
        metavar="WHAT",
        default="refuse",
        help="if a step leaves its chart: refuse (default), bisect or shrink",
    )
    parser.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    parser.add_argument(
        "--folder", metavar="DIR", help="write it here, as JSON, rows (CSV) and figures"
    )
    parser.set_defaults(action=run_scene)


def run_scene(options: argparse.Namespace) -> int:
    """Return exit code 0; a failing step is raised after its part of the run is written.

    A problem of control is solved; with --step its scene runs without controls.
    """
    import mpmath

    from ..core.parts import parts_of

    if options.step is None and (problem := lookup.problem_named(options.scene)) is not None:
        return steer(options, problem)
    with progress_shown("deriving and compiling") as show:
        system, flow, run, failure, seconds = _measured(options, show)
        choice, digits = getattr(flow, "choice", None), system.case.digits
        off = _energy_error(system, run)
    scene, rule, step = system.case.scene, system.case.rule, flow.step

    def numbers(array: Any) -> Any:
        if digits <= 16:
            return array.tolist()
        if array.ndim > 1:
            return [numbers(row) for row in array]
        return [mpmath.nstr(value, digits, min_fixed=-5, max_fixed=15) for value in array]

    impacts = getattr(run, "impacts", None)
    data = {
        "schema": 1, "scene": scene.name, "rule": rule.name,
        "retraction": scene.groupoid.retraction, "digits": digits,
        "step": float(step), "steps": run.steps,
        "chosen": None if choice is None else {**vars(choice), "step": str(choice.step)},
        "t": numbers(run.t), "x": numbers(run.x), "u": numbers(run.u), "mu": numbers(run.mu),
        "newton": {"mean": run.newton_mean, "max": run.newton_max,
                   "solver": getattr(run, "solver", "Newton")},
        "margin": getattr(run, "margin", 1.0), "edges": getattr(run, "edges", 0),
        "energy_error": None if off is None or not isfinite(off) else off,
        "impacts": None if impacts is None else numbers(impacts.t),
        "seconds": seconds, "failure": None if failure is None else str(failure),
    }  # fmt: skip
    if options.json:
        write_json(options.json, data)
    if options.folder and len(run.t):
        write_run(options.folder, data, run)
    if options.json != "-":
        if choice is not None:
            print(f"chosen: {choice}")
        _print_run(data, getattr(scene, "impacts", "stepped"))
    if failure is not None:
        raise failure
    if scene.contact is not None and "sites" not in parts_of(scene):
        _print_doubts(flow)
    from ..report.wording import RESOLVED

    if off is not None and not off <= RESOLVED:
        told = f"is off by {off:.2g} of its terms" if isfinite(off) else "is no number any more"
        print(
            f"discmech: the energy {told}: steps of {float(step):.6g} do not resolve this motion; "
            "take smaller ones (--step).",
            file=sys.stderr,
        )
    return 0


def _measured(
    options: argparse.Namespace, show: Callable[[str, float], None]
) -> tuple[System, Any, Any, StepFailure | None, float]:
    """Return the system, its flow, the run (up to a failure), the failure and the seconds."""
    from discmech.integrators.numbers import exact_rational

    from ..core.case import Case
    from ..core.parts import parts_of
    from ..systems import system_of

    scene: Any = scene_asked(options, lattices=True)
    digits, every = digits_in(options.digits, single=True), whole("--every")(options.every)
    usual = "trapezoidal"
    if getattr(scene, "one_form", None) is not None:  # by which that rule leaves μ = ϑ(x)
        half = lookup.rule("degenerate-gauss-1").applies(scene)
        usual = "degenerate-gauss-1" if half else "projected-gauss-1"
    system = system_of(Case("run", scene, lookup.rule(rule_asked(options, usual)), digits))
    show(f"{scene.name}: deriving", 0.0)
    _ = system.scheme
    show(f"{scene.name}: compiling", DERIVED)
    step = options.step
    if step is None and options.tolerance is None:
        step = scene.step
    size = None if step is None else exact_rational(step, "--step")
    how = {"on_edge": options.on_edge, "tolerance": options.tolerance}
    if "sites" in parts_of(scene):
        if how != {"on_edge": "refuse", "tolerance": None}:
            raise BadInput(f"{scene.name} is a lattice: --on-edge and --tolerance are for scenes.")
        how = {}
    flow = system.flow(size, **how)
    steps = whole("--steps")(options.steps) if options.steps else system.steps_for(abs(flow.step))
    failure = None
    begun = time.perf_counter()
    try:
        run = flow.trajectory(
            steps, every, progress=lambda done: show(f"{scene.name}: {done} steps", done / steps)
        )
    except StepFailure as error:
        if error.trajectory is None:
            raise
        run, failure = error.trajectory, error
    return system, flow, run, failure, time.perf_counter() - begun


def _energy_error(system: System, run: Any) -> float | None:
    """Return the largest error of the energy in the run's rows over its terms, or None."""
    import numpy as np

    if system.energy_changes or not len(run.t):
        return None
    with np.errstate(all="ignore"):
        return float(np.abs(system.energy_errors(run)).max())


def _print_doubts(flow: Any) -> None:
    """Print warnings about gaps that are no distances, or that round-off hides."""
    from discmech.integrators.extensions.contact import scaled_gaps, unsure_gaps

    unsure = sorted(flow.unsure_gaps)
    said = scaled_gaps(flow.scheme.s, flow.scheme.scene)
    for doubt in [*said, *([unsure_gaps(unsure)] if unsure else [])]:
        print(f"discmech: {doubt}", file=sys.stderr)


def _print_run(run: dict[str, Any], how: str) -> None:
    print(f"{run['scene']} by {run['rule']}: {run['steps']} steps of {run['step']:.6g} "
          f"in {run['seconds']:.3g} s (with compilation, if it was the first time)")  # fmt: skip
    newton = run["newton"]  # with contact corrections are not counted
    counted = f", corrections a step: {newton['mean']:.3f} mean, {newton['max']} most"
    print(newton["solver"] + (counted if run["impacts"] is None else ""))
    if run["margin"] < 1:
        met = f"; its edge was met {run['edges']} times" if run["edges"] else ""
        print(f"smallest margin to the edge of the chart: {run['margin']:.3g}{met}")
    if run["impacts"] is not None:
        first = f", the first at t = {float(run['impacts'][0]):.6g}" if run["impacts"] else ""
        skips = "; a gap has at most one in a step, others are skipped" * (how == "stepped")
        print(f"impacts ({how}): {len(run['impacts'])}{first}{skips}")
    if run["energy_error"] is not None:
        print(f"largest energy error: {run['energy_error']:.2e} of the energy's terms")
    if not run["t"]:
        return
    for name in ("x", "u", "mu"):
        if last := run[name][-1]:
            shown = last if len(last) <= MOST_SHOWN else [*last[:3], "…", *last[-3:]]
            print(f"{name:>3} at t = {float(run['t'][-1]):.6g}: " + "  ".join(map(str, shown)))
