"""The form under a map of numbers: differences and closed curves, with three answers.

A defect beyond all errors is certain, and fails. Where none is, the resolution says how small a
defect would have been seen; a pass needs one far below what a method of this order, that is not
symplectic, would leave. All else is inconclusive.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from discmech.integrators import StepFailure
from discmech.integrators.foreign import (
    constrained_parameters,
    derivative,
    form_defect,
    guarded,
    loop_defect,
    noise_of,
    pulled_back_defect,
    random_curve,
    volume_defect,
)
from discmech.integrators.foreign.differences import Derivative

from ..core.case import Case, Progress, Verdict
from ..core.claims import not_claimed
from .places import Motion, Place, places, seed_of

#: of what is left by a method of that order: a defect below this is none
RESOLVED = 1e-9
LOOPS, REACH = 6, 0.08  # closed curves a place, and their size in parts of the motion
#: one closed curve sees one number of the form, by chance a small one; that all six see less than a
#: tenth of it happens once in a million
UNSEEN = 10
ENOUGH = 3  # places at which the resolution has to be reached
AGAIN = 64  # units of round-off by which a step that is made again may differ


def measure(case: Case, progress: Progress) -> dict[str, Any]:
    """Rows {step, index, time, poisson, certain, resolution, left, loop, volume, again, noise}.

    measured: the worst of poisson (the defect as it is seen) and certain (what of it no error
    explains); resolution, the best that `ENOUGH` places reach, and left, what a method of the order
    that is not symplectic would leave there; noise, the worst that is more than round-off.
    """
    scheme = case.scheme
    progress(f"{case.scene.name} {case.label}: places", 0.0)
    found, moved = places(scheme)
    rows = []
    for k, place in enumerate(found):
        progress(f"{case.scene.name} {case.label}: differences", k / len(found))
        rows.append(_row(case, k, place, moved))
    return {"rows": rows, "measured": _measured(rows), "seed": seed_of(scheme)}


def _row(case: Case, k: int, place: Place, moved: Motion) -> dict[str, Any]:
    scheme: Any = case.scheme
    scale = moved.scale
    flow = scheme.flow(place.step)
    row: dict[str, Any] = {
        "step": float(place.step), "index": k, "time": float(place.time), "pullback": None,
        "poisson": None, "certain": None, "resolution": None, "left": None, "loop": None,
        "volume": None, "again": None, "noise": None, "residual": None, "why_not": "",
        "entry": None, "state": place.z.tolist(),
    }  # fmt: skip
    f = flow.map_of(t0=place.time)
    try:
        after = f(place.z)
    except StepFailure as failure:
        return row | {"why_not": failure.cause}
    size = len(place.z)
    g = guarded(f, size)
    noise = noise_of(g, place.z, scale, scheme.rule.unit(16), k)
    row["again"] = _again(f, place.z, after, scale)
    rough = np.maximum(noise.jump, noise.level * (noise.level > 64 * 2.0**-53 * scale))
    row["noise"] = float((rough / scale).max())
    row["left"] = left_by(case, place)
    n = flow.system.n
    if case.scene.constrained:
        defects = _restricted(flow, g, place, scale, noise)
    else:
        of = _derivative(flow, g, place, scale, noise)
        tensors = (flow.system.tensor(z[:n], z[n:]) for z in (place.z, after))
        defects = [form_defect(of, *tensors)]
        row["volume"] = vars(volume_defect(of))
    row["entry"] = _entry(defects[0].entry, n)
    if case.scene.groupoid.kind == "pair" and not case.scene.constrained:
        random = np.random.default_rng(seed_of(scheme) + k)
        curves = [random_curve(random, place.z, scale, REACH) for _ in range(LOOPS)]
        loops = [loop_defect(g, curve, n, noise) for curve in curves]
        row["loop"] = max(loop.measured for loop in loops)
        defects.append(type(loops[0])(
            max(loop.certain for loop in loops), row["loop"],
            UNSEEN * max(loop.resolution for loop in loops),
        ))  # fmt: skip
    best = min(defects, key=lambda d: d.resolution)
    row["certain"] = max(d.certain for d in defects)
    row["poisson"] = max(row["certain"], min(d.measured for d in defects))
    row["resolution"] = best.resolution
    return row


def _derivative(flow: Any, g: Any, place: Place, scale: Any, noise: Any) -> Derivative:
    """The user's own derivative of a step, or that by differences."""
    own, n = flow.scheme.rule.jacobian, flow.system.n
    if own is None:
        return derivative(lambda y: g(place.z + y), len(place.z), scale, noise)
    given = np.asarray(own(place.z[:n], place.z[n:], flow.h, flow.system), dtype=float)
    return Derivative(given, 64 * 2.0**-53 * np.abs(given))


def _restricted(flow: Any, g: Any, place: Place, scale: Any, noise: Any) -> list[Any]:
    """dq ∧ dp on the states that holonomic constraints leave, in parameters of them."""
    embed, reach = constrained_parameters(flow.system, place.z, scale)
    n = flow.system.n
    form = np.block([[np.zeros((n, n)), np.eye(n)], [-np.eye(n), np.zeros((n, n))]])
    start = derivative(embed, 2 * n, reach, noise_of(embed, 0 * reach, reach, 2.0**-53))
    of = derivative(lambda y: g(embed(y)), 2 * n, reach, noise)
    return [pulled_back_defect(of, start, form)]


def _again(f: Any, z: Any, after: Any, scale: Any) -> float:
    """How far a step made again, after others, is from what it was, relative to the motion."""
    for other in (z + 0.01 * scale, z - 0.02 * scale):
        try:
            f(other)
        except StepFailure:
            continue
    return float((np.abs(f(z) - after) / (np.abs(after) + scale)).max())


def left_by(case: Case, place: Place) -> float:
    """The defect that a method of the order, but not symplectic, would leave: the rest of the
    series of exp(hA) after the power p, A of the rate of the motion there, as that of a Taylor
    method."""
    p = case.scheme.order or 4
    z = float(place.step) * place.rate
    return min(1.0, z ** (p + 1) / math.factorial(p + 1))


def _entry(at: tuple[int, ...], n: int) -> str:
    names = [f"x[{i}]" if i < n else f"mu[{i - n}]" for i in at]
    return f"{{{', '.join(names)}}}" if names else ""


def _measured(rows: list[dict[str, Any]]) -> dict[str, Any]:
    seen = [r for r in rows if r["certain"] is not None]
    if not seen:
        return {"pullback": None, "poisson": None}
    reached = sorted(seen, key=lambda r: r["resolution"] / (r["left"] or math.inf))
    decisive = reached[min(ENOUGH, len(reached)) - 1]
    return {
        "pullback": None,
        "poisson": max(r["poisson"] for r in seen),
        "certain": max(r["certain"] for r in seen),
        "resolution": decisive["resolution"],
        "left": decisive["left"],
        "noise": max(r["noise"] for r in seen),
        "residual": max(r["again"] for r in seen),
    }


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """Fail what is certain, pass what is resolved, and say of the rest what is missing."""
    measured, rows = measurement["measured"], measurement["rows"]
    expected: dict[str, Any] = {"resolved": RESOLVED}
    reason = not_claimed(case.rule, "symplectic")
    if case.scene.force is not None and not reason:
        reason = "forced: the form need not be kept; measured only"
    if reason:
        expected["not_demanded"] = reason
    if measured.get("certain") is None:
        said = "the black box gives no step at any place that was looked at"
        return Verdict("fail", f"{said}: {rows[0]['why_not']}.", expected)
    worst = max((r for r in rows if r["again"] is not None), key=lambda r: r["again"])
    if worst["again"] > max(AGAIN * case.rule.unit(16), 4 * worst["noise"]):
        return Verdict(
            "fail",
            f"the same step made twice differs by {worst['again']:.2g} of the motion: it is no "
            "map of (q, p) and h, but keeps something between calls, or is random; a method with "
            "memory is a class with start, step and read.",
            expected,
        )  # fmt: skip
    if reason:
        return Verdict("pass", "", expected)
    if measured["certain"] > 0:
        row = max((r for r in rows if r["certain"]), key=lambda r: r["certain"])
        said = (
            f"the form is not kept: its defect is {row['certain']:.2g} beyond every error of the "
        )
        said += f"differences, in {row['entry']} at step {row['step']:.3g}, t = {row['time']:.3g}"
        return Verdict("fail", f"{said}{_rough(measured)}.", expected)
    if measured["resolution"] <= RESOLVED * measured["left"]:
        expected["resolution"] = measured["resolution"]
        return Verdict("pass", "", expected)
    said = f"no defect is seen, but one of {measured['resolution']:.1e} could be hidden, where a "
    said += f"method of this order that is not symplectic would leave {measured['left']:.1e}"
    return Verdict("inconclusive", f"{said}{_rough(measured)}.", expected)


def _rough(measured: dict[str, Any]) -> str:
    noise = measured["noise"]
    if not noise:
        return ""
    return (
        f"; the box is not smooth: it jumps by {noise:.1e} of the motion, as an iteration with a "
        "loose stop does"
    )
