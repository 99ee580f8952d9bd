"""An integration with an error bound; the precision is raised until the bound is small enough."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import mpmath

from ..enclosure import Enclosed, enclose
from ..equations import Equations
from ..failures import Unproven
from ..taylor import SeriesProgram, Sweep, TaylorSettings
from ..taylor.balls import exact, largest, upper, working
from .agreement import EXACT, Blocks
from .result import Certainty, Finding
from .states import BlockBounds, all_blocks

ATTEMPTS = 3
PILOT = 18  # digits of the first run, which measures how many digits the bound loses
MOST_LOST = 150  # digits that a bound may lose; beyond this, agreement is the better choice
PRICE = 30  # digits that a proof may lose beyond the first-order estimate


def bounded_integration(
    equations: Equations, program: SeriesProgram, times: list[Fraction], digits: int
) -> tuple[dict[Fraction, Finding], Sweep, TaylorSettings]:
    """Return findings at the times and at 0, from one sweep; raises `Unproven` if too costly."""
    bounds = BlockBounds(equations)

    def run(settings: TaylorSettings, proving: bool) -> tuple[dict[Fraction, Finding], Enclosed]:
        enclosure = enclose(equations, program, times, settings, proving)
        return _findings(equations, bounds, enclosure, settings), enclosure

    pilot = TaylorSettings(PILOT)
    lost, proving = _lost(run(pilot, True)[0], pilot), True
    if lost > PRICE:
        guess = _lost(run(pilot, False)[0], pilot)
        if not lost <= guess + PRICE:
            lost, proving = guess, False
    if not lost <= MOST_LOST:
        raise Unproven(f"it would cost {lost:.0f} digits")
    settings, more = TaylorSettings(digits + math.ceil(lost) + 1), 0
    #: digits requested and obtained at the last attempt: with many components the bound loses some
    #: of each
    before: tuple[int, int] | None = None
    for _ in range(ATTEMPTS):
        settings = TaylorSettings(settings.digits + more)
        findings, enclosure = run(settings, proving)
        worst = min(finding.certain for finding in findings.values())
        proof = not proving or len(enclosure.held) == len(findings)
        if worst >= digits and proof:
            break
        more = max(2, digits - worst + 1) if proof else 15
        if proof and before is not None and worst > before[1]:
            gained = Fraction(worst - before[1], settings.digits - before[0])
            more = math.ceil(more / min(gained, Fraction(1)))
        before = settings.digits, worst
    return findings, enclosure.sweep, settings


def _lost(findings: dict[Fraction, Finding], settings: TaylorSettings) -> float:
    """Return the number of digits between the tolerance and the largest bound."""
    worst = max(finding.bound for finding in findings.values())
    return max(0.0, float(mpmath.log10(worst)) + settings.digits) if worst else 0.0


def _findings(
    equations: Equations, bounds: BlockBounds, enclosure: Enclosed, settings: TaylorSettings
) -> dict[Fraction, Finding]:
    blocks = all_blocks(equations, enclosure.sweep, settings.working)
    findings = {}
    for t, errors in enclosure.bounds.items():
        with working(settings.precision + 32):
            each = bounds.of(errors, blocks[t])
            worst = _relative(each, blocks[t], blocks[Fraction(0)])
            bound, certain = upper(worst), whole_digits(worst)
        proven = t in enclosure.held
        how = (
            "their error is enclosed" if proven
            else "their defect is bounded, its growth estimated to first order"
        )  # fmt: skip
        evidence = (
            f"Taylor polynomials {settings.said}: {how}, "
            f"at most {mpmath.nstr(bound, 2)} of the largest component"
        )
        certainty: Certainty = "enclosure" if proven else "defect bound"
        findings[t] = Finding(t, blocks[t], certain, certainty, "Taylor series", evidence, bound)
    return findings


def _relative(bounds: dict[str, Any], here: Blocks, start: Blocks) -> Any:
    """Return the worst block's bound over its largest component at the start or here."""
    parts = []
    for name, bound in bounds.items():
        scale = largest(exact(b) for b in (*here[name], *start.get(name, ())))
        parts.append(bound / (scale if scale > 0 else 1))
    return largest(parts)


def whole_digits(error: Any) -> int:
    """Return the largest D with |error| <= 10^-D for certain, or 0; `EXACT` without error."""
    end = error.abs_upper()
    if end == 0:
        return EXACT
    if not end < 1:
        return 0
    return int((-end.log_base(10)).lower().floor().unique_fmpz())
