"""An integration with a bound of its error: the precision is raised until that is small enough."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from .agreement import Blocks
from .enclosure import Enclosed, enclose
from .majorants import Unproven
from .result import Certainty, Finding
from .states import BlockBounds, all_blocks
from .taylor import Sweep, TaylorSettings

if TYPE_CHECKING:
    from .equations import Equations
    from .series import SeriesProgram

ATTEMPTS = 3
PILOT = 18  # digits of the run that finds out how many the bound will lose
MOST_LOST = 150  # digits that a bound may cost before agreement is the better choice
PRICE = 30  # digits that a proof may cost more than its first-order estimate


def bounded_integration(
    equations: Equations, program: SeriesProgram, times: list[Fraction], digits: int
) -> tuple[dict[Fraction, Finding], Sweep, TaylorSettings]:
    """Findings at the times and at 0, from one sweep; raises `Unproven` if that is too dear."""
    bounds = BlockBounds(equations)
    pilot = TaylorSettings(PILOT)
    first = enclose(equations, program, times, pilot)
    lost = _lost(first.bounds, pilot)
    guess = _lost(first.estimates, pilot)
    proving = lost <= guess + PRICE
    lost = lost if proving else guess
    if not lost <= MOST_LOST:
        raise Unproven(f"it would cost {lost:.0f} digits")
    settings = TaylorSettings(digits + math.ceil(lost) + 1)
    for _ in range(ATTEMPTS):
        found = enclose(equations, program, times, settings)
        findings = _findings(equations, bounds, found, settings, proving)
        worst = min(finding.certain for finding in findings.values())
        held = not proving or len(found.held) == len(findings)
        if worst >= digits and held:
            break
        more = max(2, digits - worst + 1) if held else 15
        settings = TaylorSettings(settings.digits + more)
    return findings, found.sweep, settings


def _lost(bounds: dict[Fraction, list[Any]], settings: TaylorSettings) -> float:
    """Digits between the tolerance and the largest bound."""
    import mpmath

    worst = max(max(errors) for errors in bounds.values())
    if not mpmath.isfinite(worst):
        return math.inf
    return max(0.0, float(mpmath.log10(worst or 1)) + settings.digits)


def _findings(
    equations: Equations,
    bounds: BlockBounds,
    found: Enclosed,
    settings: TaylorSettings,
    proving: bool,
) -> dict[Fraction, Finding]:
    """What the bounds say at each time."""
    import mpmath

    blocks = all_blocks(equations, found.sweep, settings.digits + settings.guard)
    findings = {}
    for t, state in found.sweep.states.items():
        proven = proving and t in found.held
        errors = (found.bounds if proving else found.estimates)[t]
        each = bounds.of(state, errors, blocks[t], settings.precision)
        bound = _relative(each, blocks[t], blocks[Fraction(0)])
        certain = math.floor(-mpmath.log10(bound)) if 0 < bound < 1 else 0
        how = (
            "their error is enclosed" if proven
            else "their defect is bounded, its growth estimated to first order"
        )  # fmt: skip
        evidence = (
            f"Taylor polynomials of order {settings.order} (tolerance 1e-{settings.digits}, "
            f"{settings.digits + settings.guard} digits): {how}, "
            f"at most {mpmath.nstr(bound, 2)} of the largest component"
        )
        certainty: Certainty = "enclosure" if proven else "defect bound"
        findings[t] = Finding(t, blocks[t], certain, certainty, "Taylor series", evidence, bound)
    return findings


def _relative(bounds: Blocks, here: Blocks, start: Blocks) -> Any:
    """The worst block's bound over its largest component at the start or here."""
    import mpmath

    with mpmath.workdps(15):
        return max(
            bound[0] / (max((abs(b) for b in (*here[name], *start.get(name, ()))), default=0) or 1)
            for name, bound in bounds.items()
        )
