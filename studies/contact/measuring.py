"""Contact: the laws of a step, energy, times of impacts, and Ω between and across elastic ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from math import isnan
from typing import Any

import numpy as np

from discmech.integrators import rules as discretisations
from discmech.integrators import scenes
from discmech.integrators.extensions.contact import TOUCHING, scaled_gaps
from discmech.integrators.numbers import first_violation
from discmech.integrators.rules import Discretisation
from discmech.integrators.runs import run as run_of
from discmech.integrators.scene import Scene

from ..core.case import Case, Choice, Progress, plain_cases, silent
from ..core.claims import keeps_energy, keeps_volume, not_claimed
from ..core.controls import chosen_controls
from ..core.fitting import orders_between
from ..evidence.laws import ENERGY, FORM, VOLUME, WAY_BACK, Law
from ..evidence.measuring import single_steps
from .faults import CONTROLS, flow_with
from .judging_rises import asks_finer, is_round_off
from .laws import defects, energies
from .pieces import off_course
from .records import Back

NAME = "contact"
NEEDS = "it needs a scene with contact, such as bouncing-ball."
DIGITS = (16,)
RULES = ("midpoint", "trapezoidal")
MODES = ("stepped", "located")
STEPS = 200
#: a step across an impact is differentiated by central differences of DELTA of the size of x, and
#: of μ: their error of a defect in these units is DELTA²
FORM_DIGITS, DELTA = 40, "1e-12"
#: parts of the step that are tried: the defect depends on the place of an impact in its step, and
#: is 0 at some shares, so one step is not compared with another, but two with a much finer one
ACROSS = 1, 2, 8
ROWS = 3  # so many steps later at most, an impact on a row has happened from all starts nearby
FINER = 2, 8  # parts of the step at which a rise of the energy is measured again
# share of its size and the way of a step: a gap is open, and stays so if DELTA moves it
AWAY = 1e-9
#: impacts of a gap that are less than so many steps apart accumulate: their number depends on the
#: step
DENSE = 3
LATER = 1.1  # share by which first impacts may be later with another step


def cases(choice: Choice) -> list[Case]:
    """Return every scene with contact with two rules, or the chosen ones, and the controls."""
    chosen = choice.scenes or tuple(scenes.with_contact())
    rules = choice.rules or tuple(map(discretisations.get, RULES))
    own = replace(choice, scenes=chosen, rules=rules)
    all_cases = [] if choice.controls else plain_cases(NAME, own, DIGITS)
    if choice.rules and not choice.controls:
        return all_cases
    by_control = [Case(NAME, scenes.get(name), rules[0], digits, choice.steps, control)
                  for control, (name, _) in CONTROLS.items()
                  for digits in choice.digits or DIGITS]  # fmt: skip
    return all_cases + chosen_controls(choice, by_control, by_rules=True)


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Return rows {mode, time, energy}; measured: for each mode the defects, rises and impacts.

    Defects are those of `laws`, rises those of `falling`; also the orders of times, and the defects
    of Ω. rises: H − the least H before, over the largest sum of its terms. late: the delay of the
    first impact in steps, stepped. order: that of the times of the first two impacts (of the last
    place, if there is none) with h and h/2 compared with h/8, located; None if they are round-off.
    """
    steps = case.steps or min(STEPS, case.scene.steps_for(case.scene.step))
    if case.control is not None:
        values = {"impacts": "located", **CONTROLS[case.control][1]}
        scheme = case.scheme_on(case.scene.with_values(**values))
        faulty: Any = flow_with(case.control, scheme, case.scene.step, case.digits).trajectory(
            steps
        )
        return {"measured": defects(scheme, faulty, case.digits),
                "rows": [{"impacts": len(faulty.impacts.t)}]}  # fmt: skip
    measured: dict[str, Any] = {}
    rows, runs, unsure = [], {}, set[int]()
    for part, mode in enumerate(MODES):
        progress(f"{case.scene.name} {case.label}: {mode}", part / 4)
        flow = _flow(case, 1, mode)
        run: Any = flow.trajectory(steps)
        H, sizes = energies(case.scheme, run, case.digits)
        finer = partial(_rise_at, case, mode, steps)
        parts = FINER if _free_of_work(case) else FINER[:1]
        rises = falling(rise(H, sizes), finer, case.digits, parts)
        runs[mode] = run
        again = _flow(case, 1, mode)
        unsure |= flow.unsure_gaps
        measured[mode] = {**defects(case.scheme, run, case.digits), "rises": rises,
                          "course": off_course(again, run, mode == "located"),
                          "impacts": len(run.impacts.t)}  # fmt: skip
        rows += [{"mode": mode, "time": float(t), "energy": float(e)}
                 for t, e in zip(run.t, H, strict=True)]  # fmt: skip
    progress(f"{case.scene.name} {case.label}: times of impacts", 0.5)
    located = runs["located"]
    last = float(located.impacts.t[:2][-1]) if len(located.impacts.t) else None
    measured |= {"late": _lateness(runs["stepped"], located), "rests": _rests(located, last)}
    measured["touched"] = any(abs(r.impulses).max(initial=0) > 0 or len(r.impacts.t) > 0
                              for r in runs.values())  # fmt: skip
    measured |= {"apart": _apart(*runs.values()),
                 "scaled": scaled_gaps(case.scheme.s, case.scene),
                 "unsure": sorted(unsure)}  # fmt: skip
    count = min(2, len(located.impacts.t))
    measured |= _times(case, last, count, steps, _unsure_times(flow, located, count))
    progress(f"{case.scene.name} {case.label}: single steps between impacts", 0.7)
    measured["local"] = single_steps(case, *laws_of(case), least=case.order, run=located)
    measured["form"] = {"across": _across(case, located)}
    if claims_way_back(case.rule):
        measured["back"] = [asdict(back) for back in ways_back(case, located)]
    return {"measured": measured, "rows": rows}


def laws_of(case: Case) -> list[Law]:
    """Return the laws of steps between impacts: those that the rule claims, or the form."""
    laws: list[Law] = [] if not_claimed(case.rule, "symplectic") else [FORM]
    laws += [VOLUME] if keeps_volume(case.rule) and case.scene.force is None else []
    laws += [WAY_BACK] if claims_way_back(case.rule) else []
    exact = keeps_energy(case.rule) and _free_of_work(case)
    return laws + ([ENERGY[case.digits == 16]] if exact else [])


def claims_way_back(rule: Discretisation) -> bool:
    """True if a rule claims to be reversible."""
    return bool(rule.claims and rule.claims.reversible)


def _flow(case: Case, part: int, mode: str, digits: int | None = None) -> Any:
    """Return the flow at a part of the scene's step, with the case's digits or others."""
    return case.scheme.flow(case.scene.step / part, digits or case.digits, impacts=mode)


def rise(H: np.ndarray, sizes: Any = 0) -> float:
    """Return the largest rise of the energy of a row above the least before.

    It is relative to the sizes of its own terms and those of the start, if given.
    """
    own = sizes + np.atleast_1d(sizes)[0]
    return float(((H - np.minimum.accumulate(H)) / np.where(own > 0, own, 1)).max())


def _free_of_work(case: Case) -> bool:
    """True if only the contact changes the energy."""
    return case.scene.force is None and not case.scene.timed


def falling(
    first: float, finer: Callable[[int], float], digits: int, parts: tuple[int, ...] = FINER
) -> list[float]:
    """Return the rise of the energy with h (the first), h/2 and, if that is no less, h/8.

    The size of a rise depends on where in their steps impacts fall, so one step may have little by
    chance. For a rise that is round-off, or not a number, only the first is returned.
    """
    rises = [first]
    for part in parts:
        if not asks_finer(rises, digits):
            break
        rises.append(finer(part))
    return rises


def _rise_at(case: Case, mode: str, steps: int, part: int) -> float:
    run: Any = _flow(case, part, mode).trajectory(part * steps)
    return rise(*energies(case.scheme, run, case.digits))


def _lateness(stepped: Any, located: Any) -> float | None:
    """Return the delay of the first impact in steps, stepped; None if it is not the same one."""
    if not len(stepped.impacts.t) or not len(located.impacts.t):
        return None
    i, j = (int(run.impacts.impulses[0, :, 0].argmax()) for run in (stepped, located))
    if i != j:
        return None
    return float(stepped.impacts.t[0] - located.impacts.t[0]) / float(located.step)


def _apart(stepped: Any, located: Any) -> str:
    """Return a sentence on an impact of one of two runs that the other lacks, while they go
    together.

    Impacts of a gap that accumulate count once. Each may be late by a step, and so rebound faster
    or slower by the effect of its force in a step; that changes the time to each later one by twice
    as much, so that after m of them the next is late by (m + 1)² steps at most. A gap that pushes
    in that time without an impact is touched too. Later parts, after the runs have separated by
    more than such delays explain, belong to other motions.
    """
    h, runs = float(located.step), (stepped, located)
    both = [_clusters(run) for run in runs]
    impacts = sorted((t, i, whose) for whose in (0, 1) for i, times in both[whose].items()
                     for t in times)  # fmt: skip
    for k, (t, i, whose) in enumerate(impacts):
        late = (k // 2 + 1) ** 2 * h * (1 + 1e-6)
        other = runs[1 - whose]
        near = abs(np.array(other.t, dtype=float) + h / 2 - t) <= late + h / 2
        at_once = any(w == whose and j != i and abs(s - t) <= h for s, j, w in impacts)
        if at_once:  # the order of two gaps in one step depends on the step
            return ""
        if (other.impulses[near, i, 0] > 0).any():
            continue
        if t + late >= float(located.t[-1]) or _gone_apart(stepped, located, t, k):
            return ""
        return (
            f"the {MODES[whose]} run has an impact of gap {i} at t = {t:.4g}, the "
            f"{MODES[1 - whose]} run has none, though both have gone together up to there"
        )
    return ""


def _clusters(run: Any) -> dict[int, list[float]]:
    """Return for each gap the times of its impacts; of those that accumulate only the first."""
    clusters: dict[int, list[float]] = {}
    last: dict[int, float] = {}
    for t, P in zip(run.impacts.t, run.impacts.impulses, strict=True):
        strong = abs(P[:, 0]).max()
        for i in map(int, np.flatnonzero(P[:, 0] > 1e-9 * strong)):
            if float(t) - last.get(i, -np.inf) > DENSE * float(run.step):
                clusters.setdefault(i, []).append(float(t))
            last[i] = float(t)
    return clusters


def _gone_apart(stepped: Any, located: Any, t: float, before: int) -> bool:
    """True if two runs are further apart at t than so many impacts, late by a step, explain."""
    h = float(located.step)
    k = max(0, min(int((t - float(located.t[0])) / h), len(located.x) - 1))
    way = np.abs(np.diff(np.array(located.x[: k + 1], dtype=float), axis=0)).max(initial=0)
    return bool(np.abs(np.array(stepped.x[k] - located.x[k], dtype=float)).max() > 2 * before * way)


def _rests(run: Any, last: float | None) -> bool:
    """True if a gap stays closed for a step without an impact before that time."""
    struck = {int((t - run.t[0]) // float(run.step)) + e for t in run.impacts.t for e in (-1, 0, 1)}
    pushed = (run.impulses[:-1, :, 0] > 0).any(axis=1)
    return any(p and k not in struck and (last is None or run.t[k] < last)
               for k, p in enumerate(pushed))  # fmt: skip


def _unsure_times(flow: Any, run: Any, count: int) -> float:
    """Return the largest effect of round-off on the times of the first `count` impacts.

    A gap is closed within `TOUCHING` round-offs of its size and of the way of a step, which it
    passes at its rate: each of two runs may be off by so much. A gap that is no distance may be
    slow where it closes.
    """
    each, gaps, most = run.impacts, flow.gaps, 0.0
    with flow.numbers.working():
        for j in range(count):
            k = min(int((each.t[j] - run.t[0]) // float(run.step)), len(run.u) - 1)
            x = np.array([*each.x[j], *([each.t[j]] if run.base.shape[1] > run.x.shape[1] else [])])
            place, xi = gaps.at(x), gaps.velocity(x, each.before[j], run.u[k])
            i = int(each.impulses[j, :, 0].argmax())
            steepest = np.maximum(abs(place.normal[i]), abs(gaps.at(run.base[k]).normal[i]))
            size = place.own[i] + steepest @ abs(flow.context.h * xi)
            rate = abs(place.normal[i] @ xi)
            most = max(most, float(2 * TOUCHING * flow.numbers.eps * size / rate) if rate else 0.0)
    return most


def _times(case: Case, last: float | None, count: int, steps: int, unsure: float) -> dict[str, Any]:
    """Return {"order", "time_error"} of the times of the first `count` impacts, or of the last
    place.

    unsure: the effect of round-off on these times, below which their errors have no order.
    """
    size = float(case.scene.step)
    if last is not None:  # with other steps they may be a little later
        steps = int(LATER * last / size) + 4

    def asked(part: int) -> np.ndarray:
        run = _flow(case, part, "located").trajectory(part * steps, part * steps)
        first = run.x[-1] if last is None else run.impacts.t[:count]
        return np.array([float(e) for e in first])

    best, errors = asked(8), list[float]()
    for part in (1, 2):
        times = asked(part)
        if len(times) != len(best):
            return {"order": None, "time_error": None}
        errors.append(float(abs(times - best).max()))
    if is_round_off(errors[-1], float(abs(best).max()), unsure, case.digits):
        return {"order": None, "time_error": errors[-1]}
    (order,) = orders_between((2.0, 1.0), errors)
    if isnan(order):  # the longer step meets the first impacts exactly
        return {"order": None, "time_error": None}
    return {"order": order, "time_error": errors[-1]}


def _across(case: Case, located: Any) -> list[float | None] | None:
    """Return the defects of Ω of a step with an elastic impact, at h, h/2 and h/8.

    None if it is not demanded: friction, a force, e < 1, no impact. An entry is None for a step
    without a first impact from open gaps.
    """
    asked = _is_elastic(case.scene) and not not_claimed(case.rule, "symplectic")
    if not (asked and len(located.impacts.t)):
        return None
    steps = int((located.impacts.t[0] - located.t[0]) / float(located.step)) + 2
    return [_across_one(case, steps * part, part) for part in ACROSS]


def _is_elastic(scene: Scene) -> bool:
    """True if impacts lose no energy, and nothing else does work."""
    smooth = not any(np.atleast_1d(np.array(scene.friction) > 0))
    return bool(scene.restitution == 1 and scene.force is None and smooth)


def ways_back(case: Case, located: Any) -> list[Back]:
    """Return steps with impacts and back, at 40 digits: from their end with reversed momenta.

    They are those of the first impact, the last and one between them, with the Lagrangian
    L(x, −v). Empty where an impact has no way back, or where the time tells forth from back.
    """
    each, made = located.impacts, list[Back]()
    if not _is_elastic(case.scene) or case.scene.timed or not len(each.t):
        return made
    flow = _flow(case, 1, "located", FORM_DIGITS)
    turned = _flow(replace(case, scene=_reversed(case)), 1, "located", FORM_DIGITS)
    gaps, number, step = flow.gaps, flow.numbers.number, float(located.step)
    with flow.numbers.working():
        for j in sorted({0, len(each.t) // 2, len(each.t) - 1}):
            last = int((each.t[j] - located.t[0]) // step)
            if (row := _open_row(flow, located, last)) is None:
                continue
            k, z, sizes = row
            n = len(located.base[k])
            for count in range(last - k + 1, last - k + 2 + ROWS):
                end, pushed = _after(flow, count, z[:n], z[n:])
                there = gaps.at(end[:n])
                if pushed and all(there.phi > number(AWAY) * there.own):
                    break
            else:
                continue
            back, _ = _after(turned, count, end[:n], -end[n:])
            off = max(abs(np.concatenate([back[:n], -back[n:]]) - z) / sizes)
            steep = [_steepness(gaps, located, i) for i, t in enumerate(each.t)
                     if k <= (t - located.t[0]) / step <= k + count]  # fmt: skip
            made.append(Back(float(each.t[j]), float(off), max(steep)))
    return made


def _steepness(gaps: Any, run: Any, i: int) -> float:
    """Return how fast an impact could be over how fast its gap closes: it magnifies round-off."""
    each, k = run.impacts, int((run.impacts.t[i] - run.t[0]) // float(run.step))
    x, mu, u = (gaps.numbers.array([gaps.numbers.number(float(e)) for e in part], -1)
                for part in (each.x[i], each.before[i], run.u[k]))  # fmt: skip
    place, xi = gaps.at(x), gaps.velocity(x, mu, u)
    struck = int(each.impulses[i, :, 0].argmax())
    return float(gaps.fastest(place, xi)[struck] / abs(place.normal[struck] @ xi))


def _reversed(case: Case) -> Scene:
    """Return the scene with L(x, −v), on which a motion goes back; the same where L is even."""
    s, L = case.scheme.s, case.scene.lagrangian
    assert L is not None
    back = s.lagrangian.xreplace({u: -u for u in s.u})
    if first_violation([s.lagrangian - back], [*s.u]) is None:
        return case.scene
    return case.scene.with_values(lagrangian=lambda x, v, p: L(x, -v, p))


def _across_one(case: Case, steps: int, part: int) -> float | None:
    """Return the defect of M Π Mᵀ = Π′ of the step with the first impact, by differences at 40
    digits.

    It is in units of the sizes of x and μ there, so that it is the same in any units. An impact on
    a row is in the step before it from some starts nearby and in the step after it from others, so
    the step has no derivative. Then M is of as many steps as all starts need for the same impacts.
    None if there is no impact from an open gap, or none that all starts have in `ROWS` more steps.
    """
    run = _flow(case, part, "located").trajectory(steps)
    if not len(run.impacts.t):
        return None
    last = int((run.impacts.t[0] - run.t[0]) // float(run.step))
    flow = _flow(case, part, "located", FORM_DIGITS)
    numbers = flow.numbers
    with numbers.working():
        if (row := _open_row(flow, run, last)) is None:
            return None  # a start on a gap cannot be moved to its other side
        k, z, sizes = row
        n = run.base.shape[1]
        if not all(sizes > 0):
            return None
        delta, action = numbers.number(DELTA), sizes[0] * sizes[-1]
        ways = delta * numbers.identity(len(z)) * sizes
        starts = [z, *(z + way for way in ways), *(z - way for way in ways)]
        for count in range(last - k + 1, last - k + 2 + ROWS):
            ends, struck = zip(*(_after(flow, count, at[:n], at[n:]) for at in starts), strict=True)
            if struck[0] and len({*struck}) == 1:
                break
        else:
            return None
        forth, back = (np.array(ends[i : i + len(z)]) for i in (1, 1 + len(z)))
        M = ((forth - back) / (2 * delta) / sizes).T
        unit = np.outer(sizes, sizes) / action
        first, final = (flow.geometry.poisson_tensor(at[:n], at[n:]).value / unit
                        for at in (z, ends[0]))  # fmt: skip
        off = abs(M @ first @ M.T - final).max() / abs(M).max() ** 2
        return float(off)


def _open_row(flow: Any, run: Any, last: int) -> tuple[int, Any, Any] | None:
    """Return (number, (x, μ), the sizes of its entries) of a row with open gaps, or None.

    It is row `last`, which may be on the gap, or the one before.
    """
    numbers, n = flow.numbers, run.base.shape[1]
    for k in range(last, max(last - 2, -1), -1):
        z = numbers.array([numbers.number(float(e)) for row in (run.base[k], run.mu[k])
                           for e in row], -1)  # fmt: skip
        place = flow.gaps.at(z[:n])
        xi = flow.gaps.velocity(z[:n], z[n:], numbers.array(
            [numbers.number(float(e)) for e in run.u[k]], -1))  # fmt: skip
        way = flow.context.h * flow.gaps.fastest(place, xi)
        if all(place.phi > numbers.number(AWAY) * (place.own + way)):
            moved = abs(flow.context.h * (place.rho @ xi)).max()
            return k, z, numbers.array([max(abs(z[:n]).max(), moved)] * n
                                       + [abs(z[n:]).max()] * (len(z) - n), -1)  # fmt: skip
    return None


def _after(flow: Any, count: int, x: Any, mu: Any) -> tuple[Any, tuple[tuple[int, ...], ...]]:
    """Return (the state after so many steps, the gaps that push in each of their impacts)."""
    numbers, rows = flow.numbers, run_of(flow.stepper(flow.starting.at(x, mu)), count, count)
    end = [numbers.number(e) for e in (*rows.base[-1], *rows.mu[-1])]
    pushing = (tuple(np.flatnonzero(P[:, 0]).tolist()) for P in rows.impacts.impulses)
    return numbers.array(end, -1), tuple(pushing)
