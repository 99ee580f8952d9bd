"""The cause of a failed order, with its evidence.

An order that is too low has its cause in the discrete Lagrangian, in a gauge term, in the chart, or
otherwise in the runs that measured it, or in their reference. Each cause shows in a number that the
others do not change.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators import BadInput, Discretisation, Scheme, retractions, scenes
from discmech.integrators.extensions.lattices import Lattice, scene_of
from discmech.integrators.flows import Flow
from discmech.integrators.numbers import mpmath, sympy
from discmech.integrators.rules import discretisation, midpoint

from ..core.case import Case, Measurement, in_chart, scheme_of
from ..core.outcome import named
from ..evidence import NEAR as BESIDE
from ..evidence import evidence_of
from ..evidence.own_rules import WITNESS
from ..systems.runs import gap
from . import one_step, recorded
from .exact_path import COARSEST, HALVINGS, SHORTER, Truncation, settled_truncation, truncation
from .points import MEANT, mean_of_points, sum_of_weights
from .round_off import ROWS, residuals, size, unit

NEAR = 0.25  # an order this close to another one counts as equal
#: a share of the usual error of a lower order: a coefficient that is off by δ of itself leaves 1 to
#: 11 δ (a node, a weight and a point on three scenes), or a higher power of δ; and two fractions
#: that are meant differ by 1/`MEANT`² at least
ROUNDED = 1 / MEANT**2
#: times as large a share in another part of the states, more than rates change along a motion, the
#: states along it that are asked and how many may be as bad (a part of the motion), and digits of
#: such a place
FAR_MORE, ALONG, BAD, OF_PLACE = 100, 8, 2, 30
FLAT = "pendulum"  # a scene on a pair groupoid, where the derivative of coordinates is the velocity
#: the parts of a `Truncation` that are shown beside the cause
SHOWN = ("steps", "lagrangian", "legendre", "residual", "order_of_legendre", "order_of_points")
Told = tuple[str, str]  # cause, sentence


def of_order(
    case: Case, measurement: Measurement, duration: Fraction, at_50_digits: Callable[[], Any]
) -> dict[str, Any] | None:
    """Return {"cause", "sentence", "evidence"} of an order below the expected one, or None.

    The runs lasted `duration`; `at_50_digits` measures the order anew. Raises the errors of
    references and runs.
    """
    scheme = case.scheme.base
    wanted = scheme.order
    if wanted is None or scheme.arrows is None:  # there is no L_d(x, u) to test
        return None
    local = measurement.get("local") or {}
    low = local.get("order") is not None and local["order"] < wanted - NEAR
    errors = settled_truncation(scheme)
    told: Told | None = None
    if low and errors.order >= wanted - NEAR:  # by so little that only the smallest steps show it
        if (local.get("floats") or {}).get("explain"):
            told = _of_floats(scheme, local["floats"])
        else:
            for k in range(2, 10, 2):
                errors = truncation(scheme, Fraction(scheme.scene.step) / 2 ** (HALVINGS * k))
                if errors.order < wanted - NEAR and errors.settled:
                    break
    along = errors.order < wanted - NEAR
    # the tail of a fault that lies elsewhere has no power of the step along the motion
    clear = along and errors.settled and errors.order > -NEAR
    if told is None and low and not clear and (there := _elsewhere(scheme, errors)):
        beside = settled_truncation(there)
        low = beside.order < wanted - NEAR
        apart = low and _apart(scheme, there, beside.order)[-1]
        where = "not in most of" if apart else "not near the start of"
        where = f"at {_place(there)}, and {where} the motion, "
        if low and (apart or not along):
            return _named(case, wanted, beside, there, where)
    if told is None and along:
        return _named(case, wanted, errors)
    evidence: dict[str, Any] = {name: getattr(errors, name) for name in SHOWN}
    if told is not None:
        evidence["float"] = local["floats"]["values"]
    told = told or _of_runs(case, measurement, duration, at_50_digits, errors, evidence, low)
    return told and named(*told, evidence)


def of_law(case: Case, measurement: Measurement, law: str) -> dict[str, Any] | None:
    """Return the cause of a law that is broken, in the step itself, as `of_order` tells it, or
    None.

    law: the name of the study. L_d of a formula is to blame only if its steps are not consistent.
    """
    if case.rule.is_recorded:
        return recorded.of_rows(case)
    if case.scheme.arrows is None:
        return one_step.of_step(case, law)
    order = (measurement.get("local") or {}).get("order")
    scheme = case.scheme.base
    if order is None or order >= 1 - BESIDE or scheme.arrows is None:
        return None
    errors = settled_truncation(scheme)
    if errors.order >= 1 - NEAR:
        return None
    return _named(case, scheme.order or 1, errors)


def _named(
    case: Case, wanted: int, errors: Truncation, at: Scheme | None = None, where: str = ""
) -> dict[str, Any]:
    """Return the cause in L_d, which is below the wanted order, there (`_elsewhere`)."""
    scheme = at or case.scheme.base
    evidence: dict[str, Any] = {name: getattr(errors, name) for name in SHOWN}
    cause, sentence = _of_rule(scheme, wanted, errors, evidence, beside=not at)
    inside = f"in the rule {scheme.rule.name}: " if case.scheme.substeps else ""
    return named(cause, inside + where + sentence, evidence)


def of_part(lattice: Lattice, rule: Discretisation) -> dict[str, Any] | None:
    """Return the cause of `of_order` in a rule on a lattice, by the two ends of a bond, or None.

    The other sites rest: L_d of a lattice is the sum of those of its sites and bonds. Raises the
    errors of references.
    """
    if lattice.constraint or lattice.has_contact:  # two sites are another system there
        return None
    moving, speeds = set(np.flatnonzero(lattice.free).tolist()), np.abs(lattice.start[1])
    bonds = [sorted(moving & set(pair)) for pair in lattice.pairs.tolist()]
    ends = max(bonds, key=lambda sites: (len(sites), speeds[sites].sum()))  # at rest none is seen
    scheme = scheme_of(scene_of(lattice, ends), rule).base
    errors = settled_truncation(scheme)
    wanted = scheme.order
    if wanted is None or errors.order >= wanted - NEAR or not np.isfinite(errors.factors).all():
        return None
    evidence: dict[str, Any] = {name: getattr(errors, name) for name in SHOWN}
    cause, sentence = _of_rule(scheme, wanted, errors, evidence)
    sites = " and ".join(f"site {site + 1}" for site in ends)
    return named(cause, f"on {sites} alone, the others at rest: {sentence}", evidence)


def _of_floats(scheme: Scheme, floats: dict[str, Any]) -> Told:
    """Return floats whose last bits explain the order, with the fraction probably meant."""
    ends = f"counts with its binary value, so errors end at {floats['size']:.1g} of a step"
    for value in floats["values"]:
        number = Fraction(value)
        meant = number.limit_denominator(MEANT)
        off = float(abs(number - meant))
        if 0 < off <= 2.0**-52 * value:
            return (
                "float",
                f"{scheme.rule.name} holds {value!r} as a float, which is off {meant} by "
                f"{off:.1e}, and {ends}: write sympy.Rational({meant.numerator}, "
                f"{meant.denominator}).",
            )
    values = ", ".join(map(repr, floats["values"][:3]))
    return (
        "float",
        f"{scheme.rule.name} holds floats ({values}); such a number {ends}: write them exactly, or "
        "with G.constant.",
    )


def _of_rule(
    scheme: Scheme, wanted: int, errors: Truncation, evidence: dict[str, Any], beside: bool = True
) -> Told:
    """Return the cause of an L_d below its order: scene, gauge, retraction or L_d itself.

    beside: True to look where single steps decided, too.
    """
    off = f"‖F±/h − μ‖ on exact arrows is {errors.legendre[-1]:.1e}"
    if errors.order < errors.order_of_legendre:
        off = f"‖F⁺ − F⁻‖/h where exact arrows meet is {errors.residual[-1]:.1e}, relative to ‖μ‖,"
    off += f" at h = {errors.steps[-1]:.2g}"
    for name in retractions.BUILT_IN:
        if scheme.scene.groupoid.retraction in (None, name) or scheme.equations.element is not None:
            continue
        try:
            other = truncation(scheme_of(in_chart(scheme.scene, name), scheme.rule))
        except BadInput:  # that retraction does not fit the algebra
            continue
        evidence[f"order_of_legendre_{name}"] = other.order_of_legendre
        if other.order > wanted - NEAR and _has_order(scheme, name, wanted):
            return (
                "retraction",
                f"in the {scheme.scene.groupoid.retraction} chart L_d is of order "
                f"{errors.order:.2f}, with --retraction {name} of order {_figure(other.order)}: "
                "the rule takes u for more than this chart makes of it.",
            )
    power = errors.power
    left = min(errors.order_of_points - power, errors.order_over_factor)
    c = _fraction(*errors.factors_of_power[-2:])
    if errors.order_of_legendre < 1 - NEAR < left and (power or c != "1"):
        evidence["factors"] = errors.factors
        rest = f" Without it the rule is of order {_figure(left)}, not {wanted}."
        rest = rest if left < wanted - NEAR else ""
        if power:
            of_h, by_h = ("h" if n == 1 else f"h^{n}" for n in (power, abs(power)))
            more = of_h if c == "1" else f"{c}·{of_h}"
            mend = f"{'divide' if power > 0 else 'multiply'} it by {by_h}.{rest}"
            known = "it has to be h·L(x, u) + O(h²)"
            return "factor", f"L_d is {more} times a consistent one ({off}): {known}, so {mend}"
        return (
            "factor",
            f"L_d is {c} times a consistent one: its points are those of L, its momenta {c} times "
            f"theirs ({off}): {_of_weights(scheme)}{rest}",
        )
    if scheme.scene.discrete_lagrangian is not None and errors.order_of_legendre < 1 - NEAR:
        return (
            "scene",
            "the scene's discrete_lagrangian is none of its lagrangian: "
            f"{off} and does not sink as of a discretisation of order 1; mend either.",
        )
    if errors.order > 1 - NEAR and (share := _share(scheme, errors)) < ROUNDED:
        evidence["share"], lower = share, f"of order {round(errors.order)}"
        cause = f"and in the end the method is {lower}: a number in the rule has too few digits, a "
        cause += "term is too small to be meant, or a small part of L is taken at another place or "
        cause += "time; write numbers exactly, or in G.constant to all digits."
        there = _elsewhere(scheme, errors) if beside else None
        larger, along, apart = _apart(scheme, there, errors.order) if there else (0.0, 0.0, False)
        if there and apart:  # too few digits are so everywhere
            evidence["share_there"] = larger
            cause = f"but by about {larger:.1g} at {_place(there)}, and {along:.1g} in most of "
            cause += f"the motion, so that the method is {lower} in a part of the states: look for "
            cause += "what depends on the place there."
        return (
            "discrete Lagrangian",
            f"L_d differs from one of order {wanted} by O(h^{round(errors.order) + 1}), by about "
            f"{share:.1g} of what is usual for that power ({off}), {cause}",
        )
    # on a motion of so much symmetry that all points are exact momenta alone show an order
    gauge = wanted - NEAR < errors.order_of_points < math.inf
    order = round(errors.order, 2)
    if math.isfinite(order) and abs(order - round(order)) < NEAR:  # 1.98 is 2
        order = round(order)
    mend = f"mend the rule, or declare order {order:.3g}."
    if gauge:
        mend = f"take it out, or declare order {order:.3g}."
    mean = mean_of_points(scheme) if abs(errors.order - 1) < NEAR else ""
    if mean not in ("", "1/2"):
        middle = truncation(scheme_of(scheme.scene, midpoint)).order
        evidence |= {"mean_of_points": mean, "order_of_midpoint": middle}
        off_middle = abs(Fraction(mean) - Fraction(1, 2))
        few = off_middle < 1 / MEANT and _is_of_mean(scheme, errors, mean)
        if abs(middle - 2) < NEAR and few:
            return (
                "few digits",
                f"the weighted mean of the points where it asks for L lies at {mean} of the step "
                f"on this scene, {float(off_middle):.1g} beside the middle, which explains all of "
                f"the error of order 1 ({off}): write 1/2 exactly, or declare order 1.",
            )
        if abs(middle - 2) < NEAR:
            mend = (
                f"the weighted mean of the points where it asks for L lies at {mean} of the step, "
                "which makes order 1, and in the middle 2: move them, or declare order 1."
            )
    if gauge:
        if errors.order < 1 - NEAR and (whole := sum_of_weights(scheme)) not in ("", "1"):
            said = f"its weights sum to {whole}, and have to sum to 1 ({off})."
            return "factor", f"its points are those of L, but its momenta are not: {said}"
        return (
            "gauge",
            f"L_d differs from one of order {wanted} by what the discrete Euler–Lagrange equations "
            "do not see, such as f(b(x, u)) − f(x): points would be of order "
            f"{_figure(errors.order_of_points)}, but momenta are of order {errors.order:.2f} "
            f"({off}); {mend}",
        )
    if errors.order < 1 - NEAR:
        return (
            "discrete Lagrangian",
            f"the rule is not consistent: {off} and does not sink as of a rule of order 1; L_d has "
            "to be h·L(x, u) + O(h²), so look for a factor, or a part of L, that is missing.",
        )
    if scheme.rule.stages and scheme.scene.groupoid.retraction is not None:
        flat = truncation(scheme_of(scenes.get(FLAT), scheme.rule))
        evidence["order_on_a_pair_groupoid"] = flat.order
        if flat.order > wanted - NEAR:
            return (
                "velocity in the chart",
                f"L_d is of order {errors.order:.2f} here and of order {_figure(flat.order)} on "
                f"{FLAT}, whose chart is flat ({off}): {_of_velocity(scheme.rule)}",
            )
    return (
        "discrete Lagrangian",
        f"L_d differs from the exact discrete Lagrangian by O(h^{order + 1:.3g}), not "
        f"O(h^{wanted + 1}) ({off}): the method is of order {order:.3g} (Marsden, West, "
        f"theorem 2.3.1); {mend}",
    )


def _is_of_mean(scheme: Scheme, errors: Truncation, mean: str) -> bool:
    """True if one point at that fraction of the step has the same error of L_d."""

    @discretisation(order=1)
    def one_point(L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
        return h * L(G.target(x, u, sympy.Rational(mean) * h), u)

    same = truncation(scheme_of(scheme.scene, one_point), Fraction(errors.steps[0]))
    return abs(same.legendre[-1] - errors.legendre[-1]) <= NEAR * errors.legendre[-1]


def _share(scheme: Scheme, errors: Truncation) -> float:
    """Return an error of L_d over what is usual for its power of the step, by the midpoint rule.

    Its own error is a step squared, in units of the motion.
    """
    by_points = errors.order < errors.order_of_legendre
    error = (errors.residual if by_points else errors.legendre)[-1]
    first = Fraction(errors.steps[0])
    usual = truncation(scheme_of(scheme.scene, midpoint), first).legendre[-1]
    return error / usual ** (errors.order / 2) if usual else math.inf


def _elsewhere(scheme: Scheme, errors: Truncation) -> Scheme | None:
    """Return the scheme from where single steps are below the order, or None."""
    place, scene = evidence_of(scheme).order.place, scheme.scene
    if place is None or scene.clocked or not scene.groupoid.canonical:
        return None
    return _started(scheme, place.x, place.u, Fraction(errors.steps[0]))


def _started(scheme: Scheme, x: Any, v: Any, first: Fraction) -> Scheme:
    """Return the scheme from that state; the longest of its arrows are `first`."""
    x0, v0 = ([mpmath.nstr(e, OF_PLACE) for e in part] for part in (x, v))
    scene = scheme.scene.with_values(x0=x0, v0=v0, step=first / COARSEST)
    return scheme_of(scene, scheme.rule).base


def _place(scheme: Scheme) -> str:
    return f"x = ({', '.join(f'{float(e):.4g}' for e in scheme.scene.x0)})"


def _apart(scheme: Scheme, there: Scheme, order: float) -> tuple[float, float, bool]:
    """Return the share `there`, the largest in most of the motion, and True if it is far smaller.

    Of the same order, at steps so short that terms of higher orders do not count. What one formula
    does everywhere differs less.
    """
    shortest = Fraction(scheme.scene.step) * COARSEST / 2 ** (HALVINGS * SHORTER)
    first = min(Fraction(there.scene.step) * COARSEST, shortest)

    def share(at: Scheme) -> float:
        errors, usual = truncation(at, first), scheme_of(at.scene, midpoint)
        unit_of = truncation(usual, first).legendre[-1] ** 0.5  # a step, in units of the motion
        if not unit_of:
            return math.inf
        return max(errors.legendre[-1], errors.residual[-1] / unit_of) / unit_of**order

    times = [scheme.scene.duration * Fraction(2 * k + 1, 2 * ALONG) for k in range(ALONG)]
    states = reference.solutions(scheme.scene, times, OF_PLACE)
    shares = sorted(share(_started(scheme, state.x, state.v, first)) for state in states)
    along = shares[-1 - BAD]
    return share(there), along, FAR_MORE * along < share(there) < math.inf


def _has_order(scheme: Scheme, retraction: str, wanted: int) -> bool:
    """True if single steps in that retraction have the order from all places, not on one motion.

    A turn about one axis is the exponential of its velocity, whatever the rule.
    """
    local = evidence_of(scheme_of(in_chart(scheme.scene, retraction), scheme.rule)).order
    return local.exact or (local.order is not None and local.order > wanted - BESIDE)


def _of_weights(scheme: Scheme) -> str:
    """Return a sentence on the source of a factor: the weights, or the velocities."""
    whole = sum_of_weights(scheme)
    velocity = "what L is given for a velocity has to be one (the derivative of the curve)."
    if whole == "1":
        return f"its weights sum to 1, so {velocity}"
    if whole:
        return f"its weights sum to {whole}, and have to sum to 1."
    return f"weights have to sum to 1, and {velocity}"


def _of_velocity(rule: Any) -> str:
    """Return a sentence on a rule's wrong velocities: coordinates in their place, or others."""
    asked = getattr(getattr(rule.formula, "__code__", None), "co_names", ())
    if "velocity" in asked:
        return ("what it gives G.velocity(x, w, dw, h) has to be a curve w from 0 to u and its "
                "derivative dw by the fraction of the step.")  # fmt: skip
    return ("the derivative of a curve's coordinates is no velocity in this chart; give L the "
            "velocity G.velocity(x, w, dw, h).")  # fmt: skip


def _of_runs(
    case: Case, measurement: Measurement, duration: Fraction, at_50_digits: Callable[[], Any],
    errors: Truncation, evidence: Any, low: bool = False,
) -> Told | None:  # fmt: skip
    """Return the cause in the runs (start, Newton, reference or round-off), or None.

    L_d has its declared order, so the runs are tested. low: single steps with 50 digits have a
    lower order, so round-off is no cause.
    """
    rows = [row for row in measurement.rows if row["error"] is not None]
    best = min(rows, key=lambda row: row["error"])
    wanted = case.scheme.base.order
    flow = case.scheme.flow(duration / best["steps"], case.digits)
    fine = f"L_d is of order {errors.order:.2f}, as declared, but "
    start = _start_gap(case, flow)
    evidence["start"] = start
    if start > 1e3 * unit(case.digits):
        return (
            "starting momentum",
            f"{fine}the runs start with a μ that is off by {start:.1e}, relative to ∂l/∂ξ(x0, v0).",
        )
    residual, noise = residuals(flow)
    evidence |= {"residual_of_steps": residual, "noise": noise}
    # what is left adds up over the steps, and the motion may enlarge it a thousand times
    reached = residual > best["error"] / (1e3 * best["steps"])
    if residual > 100 * max(noise, unit(case.digits)) and reached:
        return (
            "Newton",
            f"{fine}the steps are solved to {residual:.1e} only, where F± are right to "
            f"{max(noise, unit(case.digits)):.1e}: errors stop at {best['error']:.1e}; solve the "
            "equations of a step to round-off.",
        )
    off, own = _witness(case, duration)
    evidence |= {"reference_gap": off, "witness_error": own}
    if off > 1e3 * max(own, unit(30)) and off > best["error"] / 1e3:
        return (
            "reference",
            f"{fine}the reference is {off:.1e} from {WITNESS.name} at 30 digits, whose own error "
            f"is {own:.1e}: errors cannot sink below {off:.1e}; discmech reference --check.",
        )
    if case.digits == 16 and not low:
        more = at_50_digits()
        evidence["order_at_50_digits"] = more
        if more is not None and abs(more - wanted) < NEAR:
            return (
                "round-off",
                f"{fine}errors stop at {best['error']:.1e} in double precision, where F± are right "
                f"to {evidence.get('noise', 0):.1e} only; with 50 digits the order is {more:.3f}: "
                "look for differences of nearly equal numbers.",
            )
    return None


def _start_gap(case: Case, flow: Flow) -> float:
    """Return ‖μ₀ of the run − μ₀ of the reference‖ over the largest ‖μ‖ of a few steps."""
    run, exact = flow.trajectory(ROWS), reference.solution(case.scene, 0, case.digits + 15)
    with mpmath.workdps(case.digits + 15):
        off, _ = gap(run.mu[0], exact.mu)
        return float(off) / size(run.mu)


def _witness(case: Case, duration: Fraction) -> tuple[float, float]:
    """Return (relative gap of reference and witness, the witness's own change by halving)."""
    scheme = scheme_of(case.scene, WITNESS)
    steps = max(8, round(duration / Fraction(case.scene.step)))
    ends = []
    for count in (steps, 2 * steps):
        run = scheme.flow(duration / count, 30).trajectory(count, every=count)
        ends.append([*run.x[-1], *run.mu[-1]])
    exact = reference.solution(case.scene, duration, 30)
    with mpmath.workdps(45):
        off, whole = gap(ends[1], [*exact.x, *exact.mu])
        own, _ = gap(ends[1], ends[0])
        return float(off / whole), float(own / whole)


def _fraction(before: float, factor: float) -> str:
    """Return the limit under halving, such as 2/3 for 0.6668 after 0.6672, if its denominator is
    small."""
    near, known = Fraction(factor).limit_denominator(12), 2 * abs(factor - before)
    if abs(factor - near) <= known:
        return str(near)
    digits = max(4, math.ceil(-math.log10(known / abs(factor)))) if known else 16
    return f"{factor:.{digits}g}"


def _figure(order: float) -> str:
    return "beyond measure" if order == float("inf") else f"{order:.2f}"
