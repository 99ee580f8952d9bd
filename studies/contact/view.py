"""The page of contact: how measurements are shown."""

from __future__ import annotations

from typing import Any

from ..core.records import AtMost, decoded, number
from ..core.result import NONE, Result
from ..report.view import Column, View, decimals
from ..report.wording import scientific
from .records import Laws, Measured

Case = Result[Measured, AtMost, dict[str, Any]]


def _laws(case: Case) -> list[Laws]:
    """Return the laws of both modes; of a control those of its one run."""
    if "stepped" in case.figures:
        return [laws for _, laws in case.measured.modes]
    return [decoded(Laws, case.figures, True)]


def _worst(case: Case, name: str) -> str:
    """Return the larger defect of both modes, or that of a control."""
    return scientific(max((e for laws in _laws(case) if (e := getattr(laws, name)) is not None),
                          default=None))  # fmt: skip


def _column(name: str, head: str) -> Column:
    return head, lambda case: _worst(case, name)


def _got(case: Case) -> str:
    names = ("penetration", "pull", "slip", "impact_energy", "jump")
    said = [f"{name.replace('_', ' ')} {_worst(case, name)}" for name in names]
    order = case.measured.order
    return ", ".join(said if order is None else [*said, f"impacts of order {order:.2f}"])


def _impacts(case: Case) -> str:
    """Return the impacts of both modes, with the end of the run, which is shorter than a scene's.

    A control has neither times nor two modes.
    """
    counts = ", ".join(str(e.impacts) for e in _laws(case) if e.impacts is not None) or NONE
    ends = [time for row in case.rows if (time := number(row.get("time"))) is not None]
    return f"{counts} to t = {max(ends):.4g}" if ends else counts


VIEW = View(
    measured=Measured, expected=AtMost,
    columns=[
        ("Impacts, stepped and located", _impacts),
        ("Order", lambda case: decimals(case.measured.order, 2)),
        _column("penetration", "Penetration"), _column("cone", "Cone"),
        _column("impact_energy", "Energy of impacts"),
        _column("jump", "Momentum of impacts"),
    ],
    got=_got, wanted=lambda case: f"≤ {scientific(case.expected.limit)}",
)  # fmt: skip
