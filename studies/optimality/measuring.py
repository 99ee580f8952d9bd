"""Optimal control: one problem solved with steps that are halved from solution to solution.

|s_N − s_2N| = C hᵖ (1 − 2⁻ᵖ) + …, so the change has the order p of s_N itself, without a reference.
Each kind of unknown is compared with its own size on the finest solution.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from discmech.integrators import Scene, Scheme
from discmech.integrators import rules as discretisations
from discmech.integrators.extensions.control import Control, Optimum
from discmech.integrators.extensions.control import scenes as built_in
from discmech.integrators.numbers import sympy, to_sympy, without_text
from discmech.integrators.scene import arguments_of, reads

from ..core import lookup
from ..core.case import Case, Choice, Progress, silent
from ..core.fitting import Window, asymptotic_window, line_of, marks
from ..evidence.measuring import of_scheme

NAME = "optimality"
NEEDS = (
    "it needs a problem of optimal control, in double precision: one that `discmech control` "
    "lists, or the scene of a Control(...) in a file of yours, and a rule of one step that "
    "discretises a Lagrangian."
)
RULES = ("midpoint", "gauss-2")
STEPS = 32
LEVELS, MOST_LEVELS = 5, 8  # halvings; more than five if four changes are not on a line yet
# fewest steps of solutions that are coarser than the first, made if finer ones are round-off
FEWEST = 4
KINDS = ("states", "costates", "controls")
STRAIGHT = 0.012  # as the study of order has it: in log₂ of a change, from the line
#: of the change of an unknown: round-off of a step's own operations, as in the study of order
LEAST = 32 * 2.0**-53


def cases(choice: Choice) -> list[Case]:
    """Return every chosen problem with every rule that has a discrete Lagrangian of one step."""
    if choice.digits and 16 not in choice.digits:
        return []
    asked = choice.rules or tuple(map(discretisations.get, RULES))
    rules = [r for r in asked if r.method is None and r.asks_lagrangian]
    scenes = choice.scenes or [built_in.get(name).scene for name in built_in.NAMES]
    return [
        Case(NAME, chart, rule, 16, choice.steps)
        for scene in scenes
        for name in lookup.problems_of(scene)
        for chart in choice.charts(scene if name == scene.name else scene.with_values(name=name))
        for rule in rules
        if rule.applies(chart)
    ]


def depends_on(case: Case) -> str:
    """Return the text on which a result depends beside the scene and the rule."""
    problem = lookup.problems_of(case.scene)[case.scene.name]
    name = problem.scene.name
    if name in built_in.NAMES and problem is built_in.get(name):
        return ""  # its text is the bench's own, which every result depends on
    return reads(problem, pure=True)


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Return rows {steps, step, cost, error, states, costates, controls, used, why_not}, coarse to
    fine.

    states, costates, controls: the largest change to the next solution, over the size of its kind;
    error: the largest of the three.
    """
    problem = lookup.problems_of(case.scene)[case.scene.name].with_values(scene=case.scene)
    solutions, count = list[Optimum](), case.steps or STEPS
    for k in range(MOST_LEVELS):
        progress(f"{case.scene.name} {case.label}: {count} steps", k / MOST_LEVELS)
        at = 0 if solutions and count < len(solutions[0].t) - 1 else len(solutions)
        near = solutions[min(at, len(solutions) - 1)] if solutions else None  # of one branch
        solutions.insert(at, problem.solve(count, case.rule, near))
        count = 2 * (len(solutions[-1].t) - 1)
        if len(solutions) < LEVELS:
            continue
        rows, floor = _changes(solutions), max(LEAST, *(best.correction for best in solutions))
        windows = {kind: _window(rows, kind, floor) for kind in KINDS}
        exact = [kind for kind in KINDS if max(row[kind] for row in rows) <= floor]
        left = [kind for kind, window in windows.items() if kind not in exact and window is None]
        if not left:
            break
        fewest = (len(solutions[0].t) - 1) // 2
        if not case.steps and fewest >= FEWEST and all(rows[-1][kind] <= floor for kind in left):
            count = fewest  # finer ones are round-off, for a rule of high order
    orders = {k: None if w is None else w.line.slope for k, w in windows.items()}
    lowest = min((k for k, p in orders.items() if p is not None), default=None,
                 key=lambda kind: orders[kind] or 0)  # fmt: skip
    window = None if lowest is None else windows[lowest]
    line = line_of(window)
    for row, mark in zip(rows, marks([row["error"] for row in rows], window, floor), strict=True):
        row |= mark
    return {
        "rows": rows,
        "floor": floor,
        "local": of_scheme(Scheme(_pushed(problem, solutions[-1]), case.rule)),
        "measured": {
            **line,
            "orders": orders,
            "exact": exact,
            "corrections": [best.iterations for best in solutions],
            "cost": solutions[-1].cost,
        },
    }


def _pushed(problem: Control, best: Optimum) -> Scene:
    """Return the scene under its inputs, with controls that are given functions of time.

    Solutions with halved steps converge for any rule: so its steps are compared with the equations
    of motion. The controls are as large as those that were found.
    """
    scene, inputs = problem.scene, problem.inputs
    T, push = problem.duration, inputs or (lambda x, v, f, p: f)
    most = abs(best.controls).max(axis=(0, 1), initial=0)
    sizes = [Fraction(2) ** round(math.log2(e)) if e > 0 else Fraction(1) for e in most]

    def acting(x: Any, v: Any, p: Any, t: Any) -> list[Any]:
        shares = [1 + (-1) ** j * (t / to_sympy(T) - (t / to_sympy(T)) ** 2 / (j + 2))
                  for j in range(len(sizes))]  # fmt: skip
        f = sympy.Matrix([to_sympy(size) * e for size, e in zip(sizes, shares, strict=True)])
        parts = [list(push(x, v, f, p, *((t,) if arguments_of(push) == 5 else ())))]
        if scene.force is not None:
            timed = arguments_of(scene.force) == 4
            parts.append(list(scene.force(x, v, p, *((t,) if timed else ()))))
        exact = without_text(parts, f"a force on {scene.name}")
        return [sum(entries) for entries in zip(*exact, strict=True)]

    return scene.with_values(name=f"{scene.name}-pushed", force=acting, duration=T, symmetries=())


def _changes(solutions: list[Optimum]) -> list[dict[str, Any]]:
    """Return the rows, from solutions coarse to fine."""
    sizes = [[float(abs(part).max(initial=0)) or 1.0 for part in parts]
             for parts in _kinds(solutions[-1])]  # fmt: skip
    rows = []
    for coarse, fine in pairwise(solutions):
        changes = {
            kind: max(float(abs(b[::2] - a).max(initial=0)) / size
                      for a, b, size in zip(*parts, strict=True))
            for kind, *parts in zip(KINDS, _kinds(coarse), _kinds(fine), sizes, strict=True)
        }  # fmt: skip
        rows.append({"steps": len(coarse.t) - 1, "step": float(coarse.t[1]),
                     "cost": coarse.cost, "error": max(changes.values()), **changes})  # fmt: skip
    return rows


def _kinds(best: Optimum) -> list[tuple[np.ndarray, ...]]:
    """Return the parts of each kind, which have sizes of their own."""
    n = best.x.shape[1]
    costates = best.costates[:, :n], best.costates[:, n:]
    return [(best.x, best.mu), costates, (best.node_controls,)]


def _window(rows: list[dict[str, Any]], kind: str, floor: float) -> Window | None:
    changes = [row[kind] if row[kind] > 0 else math.nan for row in rows]
    return asymptotic_window([row["step"] for row in rows], changes, floor, STRAIGHT)
