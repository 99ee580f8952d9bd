"""The table of the report: what is proven of built-in rules, class by class."""

from __future__ import annotations

from functools import partial
from typing import Any

from discmech.integrators import rules

from ..core.case import Progress, silent
from ..core.fingerprint import of_proof
from ..core.outcome import said_of_law
from ..core.store import Store
from .leading import of_rule
from .proving import prove

#: rules of each kind; the others take longer, and have the same command
RULES = ("rectangle", "midpoint", "trapezoidal", "gauss-2", "triple-jump:midpoint",
         "explicit-euler", "heun", "runge-kutta-4", "implicit-midpoint",
         "stoermer-verlet")  # fmt: skip
KINDS = ("separable", "time")
#: the classes of these kinds, each for rules with L and for maps of H
CLASSES = ("T − V, n = 2", "T quadratic, n = 2", "with time, n = 1")
LAWS = ("symplectic", "self-adjoint")
ABOUT = (
    "What is proven of built-in rules for every Lagrangian of a class, or of maps for every "
    "Hamiltonian, by evaluation modulo random primes: the order, and that the next power of h "
    "differs; the leading error of L_d; and the last power of h to which a law holds, with time. "
    "The command of a rule asks for these classes; without --groupoid it asks for more, on Lie "
    "groups too, and takes longer; so do other rules."
)


def proof_table(progress: Progress = silent, store: Store | None = None) -> dict[str, Any]:
    """Return the table, {"title", "about", "heads", "lines"}: some 25 seconds, and then kept."""
    lines = []
    for i, name in enumerate(RULES):
        progress(f"{name}: for every Lagrangian", i / len(RULES))
        make, key = partial(_told, name), of_proof(rules.get(name), "table")
        told = make() if store is None else store.remembered("answer", key, make)
        lines.append(_line(told))
    heads = ["Rule", *CLASSES, "Leading error", *map(str.capitalize, LAWS),
             "Wrong with a chance of", "Seconds", "Command"]  # fmt: skip
    return {"title": "Proofs", "about": ABOUT, "heads": heads, "lines": lines}


def _told(name: str) -> dict[str, Any]:
    """Return the answer of a rule as JSON, its laws on the class with time alone."""
    rule = rules.get(name)
    plain, timed = KINDS
    data = prove(rule, groupoid=timed, laws=LAWS).to_json()
    data["classes"] = prove(rule, groupoid=plain, laws=()).to_json()["classes"] | data["classes"]
    error = of_rule(rule) if rule.asks_lagrangian and rule.method is None else {}
    return data | {"leading": {name: str(c) for name, c in error.items()}}


def _line(told: dict[str, Any]) -> list[str]:
    answers = [*told["classes"].values()]
    every = [a for part in (told["classes"], *told["laws"].values()) for a in part.values()]
    laws = [said_of_law(told["laws"][law])[0].partition(" for ")[0].rstrip(",") for law in LAWS]
    kinds = " ".join(f"--groupoid {kind}" for kind in KINDS)
    return [
        told["rule"], *(f"{a['verdict']}: order {a['order']}" for a in answers),
        " + ".join(f"({c}) {e}" for e, c in told["leading"].items()) or "—", *laws,
        f"{max(a['chance'] or 0 for a in answers):.0e}", f"{sum(a['seconds'] for a in every):.1f}",
        f"discmech prove {told['rule']} {kinds}",
    ]  # fmt: skip
