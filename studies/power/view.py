"""How the mutation study is shown: its cases are faults, not precisions."""

from __future__ import annotations

from typing import Any

from ..report.view import View
from ..report.wording import NONE, mapping


def _got(measured: dict[str, Any]) -> str:
    return ", ".join(measured["caught"]) or NONE


VIEW = View(
    whole=True,
    columns=[
        ("Scene", lambda case: str(case.get("scene") or NONE)),
        ("Rule", lambda case: str(case.get("rule") or NONE)),
        ("In", lambda case: str(mapping(case, "measured").get("site") or NONE)),
        ("What", lambda case: str(mapping(case, "measured").get("what") or NONE)),
        ("Caught by", lambda case: _got(mapping(case, "measured"))),
    ],
    got=_got,
    wanted=lambda expected: str(expected["wanted"]),
)
