"""`discmech control`: one problem of optimal control is solved and printed, or written as JSON."""

from __future__ import annotations

import argparse
import time
from importlib import import_module
from typing import Any

from discmech.integrators import retractions

from ..core import lookup
from ..core.options import whole
from .options import add_rule, rule_asked
from .output import DERIVED, progress_shown, write_json, write_run


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "control", help="a scene steered to its end at the least cost",
        epilog="Exit codes: 0 a local minimum was found, 2 bad input or an end out of reach, "
        "3 no minimum was found, which does not show that there is none.",
    )  # fmt: skip
    parser.add_argument(
        "problem", nargs="?", metavar="SCENE",
        help="a name, or FILE.py:VARIABLE (default: list the names)",
    )  # fmt: skip
    add_rule(parser, "; default: midpoint")
    parser.add_argument("--steps", default="100", metavar="N", help="default: 100")
    parser.add_argument("--retraction", metavar="NAME")
    parser.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    parser.set_defaults(action=_control)


def _control(options: argparse.Namespace) -> int:
    problems = import_module("discmech.integrators.extensions.control.scenes")
    if options.problem is None:
        for name in problems.NAMES:
            print(f"{name:<24} {problems.get(name).scene.title}")
        return 0
    return steer(options, lookup.control(options.problem))


def steer(options: argparse.Namespace, problem: Any) -> int:
    """Solve the problem as the options say, and show it; returns the exit code."""
    with progress_shown("deriving") as show:
        show("deriving", 0.0)
        if options.retraction:
            chart = retractions.get(options.retraction)
            problem = problem.with_values(scene=problem.scene.with_retraction(chart))
        rule = lookup.rule(rule_asked(options, "midpoint"))
        steps = whole("--steps")(options.steps or "100")
        problem.stages(rule)
        show("steering", DERIVED)
        begun = time.perf_counter()
        best = problem.solve(steps, rule)
    scene = problem.scene
    data = {
        "schema": 1, "scene": scene.name, "rule": rule.name,
        "retraction": scene.groupoid.retraction, "steps": steps, "cost": best.cost,
        "iterations": best.iterations, "seconds": time.perf_counter() - begun,
        **{key: getattr(best, key).tolist() for key in (
            "t", "x", "mu", "u", "controls", "control_times", "node_controls", "costates")},
    }  # fmt: skip
    if options.json:
        write_json(options.json, data)
    if getattr(options, "folder", None):
        write_run(options.folder, data, best)
    if options.json != "-":
        print(f"{scene.name} by {rule.name}: {steps} steps, cost {best.cost:.12g} (a local "
              "minimum: others, from another path=, may cost less), Newton's method "
              f"{best.iterations} corrections, {data['seconds']:.3g} s")  # fmt: skip
        rows = ("x", "mu", "node_controls", "costates")
        for at in (0, -1):
            print(f"t = {best.t[at]:.6g}: " + "; ".join(
                f"{name.replace('_', ' ')} " + " ".join(f"{v:.6g}" for v in getattr(best, name)[at])
                for name in rows if getattr(best, name).size))  # fmt: skip
    return 0
