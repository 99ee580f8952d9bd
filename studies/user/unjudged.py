"""Claims of rules, and momenta that scenes declare, which no case of a result has judged."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from discmech.integrators.rules import Discretisation

from .. import get
from ..core.case import Choice
from ..core.claims import claimed_names, stated
from ..core.records import grouped
from ..core.result import AnyResult
from ..core.study import Study


def unjudged(choice: Choice, asked: Sequence[Study], cases: Sequence[AnyResult]) -> list[str]:
    """Return a sentence for each claim of a rule that no study has judged on any scene, with what
    those say that judge it elsewhere, and for each momentum that it claims on a scene.

    asked: the studies that had a choice of cases.
    """
    said = []
    for rule in choice.rules:
        names = {case.study for case in cases if case.rule == rule.name}
        for word, claim in stated(rule).items():
            judges = [study for study in asked if word in study.claims]
            if rule.is_recorded and word == "symplectic":  # of which the band of the energy tells
                judges = [get("energy")]
            if judges and not names & {study.name for study in judges}:
                why = "; ".join(f"{e.name}: {e.lacks(choice).rstrip('.')}" for e in judges)
                said.append(f"{rule.name} claims {claim}, which nothing judges here ({why}).")
    return [*said, *momenta_of(choice, cases, claimed=True)]


def momenta_of(choice: Choice, cases: Sequence[AnyResult], claimed: bool) -> list[str]:
    """Return a sentence for each momentum of a scene that nothing has judged by some rules.

    claimed: those that rules claim, else those of rules that state no claim.
    """
    study, left = get("momentum"), list[tuple[str, str]]()
    judged = {(case.scene, case.rule) for case in cases if case.study == study.name}
    systems: list[tuple[Any, Discretisation]] = [*choice.pairs()]
    systems += [(lattice, rule) for lattice, rule, _ in choice.on_lattices()]
    for scene, rule in systems:
        of = scene.symmetries
        momenta = [*of] if isinstance(of, dict) else [q.name for q in of if q.to_roundoff]
        asked = claimed_names(rule, momenta)
        states = rule.claims is not None
        if asked and states is claimed and (scene.name, rule.name) not in judged:
            left.append((f"{scene.name} declares {', '.join(asked)}", rule.name))
    return [f"{what}, which nothing judges by {', '.join(rule for _, rule in alike)} "
            f"(momentum: {study.lacks(choice).rstrip('.')})."
            for what, alike in grouped(left, lambda pair: pair[0]).items()]  # fmt: skip
