"""The words of a page that a reader may not know, each in a sentence."""

from __future__ import annotations

import re

#: word, what shows that a page has it (a pattern), its meaning
WORDS = (
    ("verdict", "pass|fail", "pass: what was demanded holds; fail: it does not; inconclusive: the "
     "numbers cannot tell, and the reason says what would"),
    ("control", "[Cc]ontrol", "a method that is wrong on purpose; a study has to catch it"),
    ("digits", "[Dd]igits", "of the numbers that a run computes with; 16 is double precision, 50 "
     "leaves no round-off in sight"),
    ("scene", "[Ss]cene", "a mechanical system with its parameters, start and duration"),
    ("rule", "[Rr]ule", "a method: a discrete Lagrangian, or a one-step map"),
    ("x, u, μ", "μ|momenta|momentum", "base point, velocity of a step, momentum ∂l/∂u; on an "
     "ordinary configuration space x is q and μ is p"),
    ("h", r"\bh\b|step", "the step size"),
    ("groupoid", "[Gg]roupoid", "what the steps are arrows of: pairs (q₀, q₁) of an ordinary "
     "configuration space, elements of a Lie group, or both"),
    ("retraction", "[Rr]etraction", "the map from velocities to group elements: cayley or "
     "exponential"),
    ("order", "[Oo]rder", "the power of the step size with which the error vanishes"),
    ("reference", "[Rr]eference", "the solution to more digits than are judged, each of them "
     "certain"),
    ("floor", "[Ff]loor|round-off", "where round-off outweighs the error of the method; points "
     "there are left out"),
    ("Form defect", "[Ff]orm defect|Ω|[Ss]ymplectic", "by how much a step changes the symplectic "
     "form, relative to the form; 0 but for round-off if the method is symplectic"),
    ("self-adjoint", "self-adjoint", "a step back undoes a step, as for the midpoint rule"),
    ("momentum drift", "[Dd]rift", "how far a conserved quantity goes to one side over the run"),
    ("band", "[Bb]and|oscillat", "between which limits the energy error goes to and fro; it is "
     "bounded for a sound method, whatever the time"),
    ("Casimir", "Casimir", "a function of the momenta that every motion keeps, such as |μ|²"),
    ("hω", "hω", "step size times the fastest frequency of small oscillations"),
    ("modified energy", "modified energy", "the energy of the nearby system that the method solves "
     "nearly exactly; a symplectic method keeps it"),
)  # fmt: skip


def met(text: str) -> list[tuple[str, str]]:
    """(word, meaning) of the words that a page's text has."""
    return [(word, meaning) for word, shown, meaning in WORDS if re.search(shown, text)]
