"""Each fault, and each valid rule, through the studies: what said no, and what did not."""

from __future__ import annotations

import time
from typing import Any

from integrators import BadInput, discretisations

from .. import get
from ..running import run_case
from .faults import Fault, FaultyCase, NoPlace, scene_of
from .sites import faulty_scheme

#: (study, digits, steps): short runs, for schemes are run uncompiled
STUDIES = (
    ("order", 16, 12), ("order", 50, 16), ("symplecticity", 16, 48), ("symplecticity", 50, 8),
    ("momentum", 16, 1000), ("momentum", 50, 20), ("energy", 16, 1500),
)  # fmt: skip


def run(fault: Fault) -> dict[str, Any]:
    """{"name", "site", "what", "found": {study: {"verdict", "reason", "seconds"}}}.

    Studies have their digits in the name; where the bench refuses the object, the only one is
    "refused". Raises `NoPlace` if there is no such fault.
    """
    begun = time.process_time()
    found: dict[str, Any] = {}
    try:
        faulty_scheme(fault)
    except BadInput as refusal:
        if isinstance(refusal.__cause__, NoPlace):
            raise refusal.__cause__ from None
        found["refused"] = {"verdict": "fail", "reason": str(refusal)}
    else:
        found = _studied(fault)
    seconds = time.process_time() - begun
    return {"name": fault.name, "site": fault.site, "what": fault.what, "found": found,
            "seconds": seconds}  # fmt: skip


def _studied(fault: Fault) -> dict[str, Any]:
    found = {}
    scene, rule = scene_of(fault.scene), discretisations.get(fault.rule)
    for name, digits, steps in STUDIES:
        study = get(name)
        case = FaultyCase(name, scene, rule, digits, steps, fault=fault)
        if name == "momentum" and not case.scene.symmetries:
            continue
        begun = time.process_time()
        try:
            result = run_case(study, case)
        except BadInput as refusal:
            result = {"verdict": "fail", "reason": f"refused: {refusal}"}
        found[f"{name} {digits}"] = {
            "verdict": result["verdict"], "reason": result["reason"],
            "seconds": time.process_time() - begun,
        }  # fmt: skip
    return found


def caught(result: dict[str, Any]) -> list[str]:
    """The studies that said no."""
    return [name for name, one in result["found"].items() if one["verdict"] == "fail"]
