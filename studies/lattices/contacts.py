"""Contact of a lattice: the laws of its rows and impacts, its energy, its cost against N."""

from __future__ import annotations

from typing import Any

import numpy as np

from discmech.integrators.runs import Trajectory

from ..contact import measuring as contact
from ..core.case import Case, Progress
from ..evidence.measuring import single_steps
from ..systems.known import known_of
from ..systems.quantities import energies
from .cost import costs, slopes

STEPS = 400
SIZES = (10_000, 30_000, 100_000)  # sites; with fewer, the constant part of a step is most of it


def measure(case: Case, label: str, progress: Progress, timed: bool) -> dict[str, Any]:
    """Return rows {run: time, energy; cost}; measured: "contact" {law: defect}, rises, impacts,
    grows.

    rises: H − the least H before, over the largest sum of its terms (`contact.falling`).
    free_steps: the mean number of free steps of the whole lattice per step.
    """
    lattice: Any = case.scene
    steps = case.steps or STEPS
    progress(f"{label}: laws", 0.0)
    flow: Any = case.scheme.flow(lattice.step)
    run = flow.trajectory(steps)
    H, size = energies(case.scheme, run)

    def finer(part: int) -> float:
        made = case.scheme.flow(lattice.step / part).trajectory(part * steps)
        return contact.rise(energies(case.scheme, made)[0]) / size

    parts = contact.FINER[:1] if lattice.forced or lattice.timed else contact.FINER
    rises = contact.falling(contact.rise(H) / size, finer, 16, parts)
    progress(f"{label}: single steps", 0.4)
    rows = [{"kind": "run", "time": float(t), "error": float(e - H[0]) / size}
            for t, e in zip(run.t, H, strict=True)]  # fmt: skip
    measured = {"contact": defects(flow, run), "rises": rises,
                "impacts": len(run.impacts.t), "pushed": bool((impulses_of(flow, run) > 0).any()),
                "free_steps": run.newton_mean, "grows": None,
                "local": single_steps(case, least=case.order or 1)}  # fmt: skip
    sized = known_of(lattice).sized
    if timed and sized is not None:
        progress(f"{label}: cost", 0.5)
        in_turn = costs(sized, case.rule, case.thorough, SIZES)
        measured["grows"] = slopes(in_turn)
        rows += in_turn
    return {"rows": rows, "measured": measured}


def defects(flow: Any, run: Trajectory) -> dict[str, float]:
    """Return the defect of a run with every row in each law, over the largest number of its kind.

    penetration: −φ, over the size that determines its round-off: the terms of φ, its changes with
    the largest coordinate, to which a step's solution is known, and with the way of a step, the
    longest up to the row (a closed gap keeps the round-off of its past). pull: −P. complementarity:
    P of gaps that are open at both ends of a step, times the smaller one over the same.
    restitution: |U⁺ + e U⁻| where an impact pushes. missed: −U of gaps that are closed in a row.
    """
    e, gaps = float(flow.lattice.restitution), flow.gaps
    impulses, phi = impulses_of(flow, run), gaps.phi(run.x)
    hard = abs(impulses).max() or 1.0
    open_by = np.minimum(phi[:-1], phi[1:])
    impacts = run.impacts
    fast, missed, ways = abs(impacts.approach).max(initial=0.0), 0.0, list[Any]()
    times = run.t if flow.scheme.timed else [()] * len(run.t)
    for k, (x, mu, t) in enumerate(zip(run.x, run.mu, times, strict=True)):
        x = np.append(x, t)
        place, xi = gaps.at_start(x), gaps.velocity(x, mu)
        ways.append(place.own + float(flow.step) * gaps.fastest(place, xi))
        if k == 0:
            continue
        opening = place.normal @ xi
        fast = max(fast, abs(opening).max())
        missed = max(missed, -opening[place.closed].min(initial=0.0))
    wide = np.maximum.accumulate(ways)
    wide[wide == 0] = 1.0
    inside = (-phi / wide).max(initial=0.0)
    products = impulses[:-1] * open_by / (hard * wide[:-1])
    return {
        "penetration": float(inside),
        "pull": float(max(0.0, -impulses.min()) / hard),
        "complementarity": float(products.max(initial=0.0)),
        "restitution": float(abs(impacts.rebound + e * impacts.approach).max(initial=0.0) / fast),
        "missed": float(missed / fast),
    }


def impulses_of(flow: Any, run: Trajectory) -> np.ndarray:
    """Return the impulses of all gaps that move, (r, gaps)."""
    impulses: np.ndarray = flow.gaps.listed(site=run.impulses, bond=run.bond_impulses)
    return impulses
