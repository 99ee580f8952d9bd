"""Words of the bench that a reader may not know, each with a sentence.

The report explains the words that it contains, `discmech list --words` and docs/glossary.md all.
"""

from __future__ import annotations

import re

#: word, a pattern that finds it in a text, meaning
WORDS = (
    ("verdict", "pass|fail", "pass: what was demanded holds; fail: it does not; inconclusive: the "
     "numbers cannot tell, and the reason says what would; measured: nothing was claimed or "
     "demanded, so nothing is judged"),
    ("control", "[Cc]ontrol", "a method that is wrong on purpose; a study has to catch it. In "
     "optimal control it is the force that steers"),
    ("digits", "[Dd]igits", "the number of digits that a run computes with; 16 is double "
     "precision, at 50 the error of the method stands alone"),
    ("scene", "[Ss]cene", "a mechanical system with its parameters, start and duration"),
    ("rule", "[Rr]ule", "a method: a discrete Lagrangian, or a one-step map"),
    ("discrete Lagrangian", "[Dd]iscrete Lagrangian|L_d", "a function of one step that "
     "approximates the action along it; the equations of the method follow from it"),
    ("peer", "[Pp]eer", "an integrator of another project that is measured beside a rule"),
    ("x, u, μ", "μ|momenta|momentum", "base point, velocity of a step, momentum ∂l/∂u; on an "
     "ordinary configuration space x is q and μ is p"),
    ("h", r"\bh\b|step", "the step size"),
    ("groupoid", "[Gg]roupoid", "the structure whose arrows are the steps: pairs (q₀, q₁) of "
     "an ordinary configuration space, elements of a Lie group, or both"),
    ("dual", r"\bdual\b", "the space of (x, μ), where the motion is given by a Hamiltonian; on an "
     "ordinary configuration space it is the phase space of (q, p)"),
    ("Legendre map", "[Ll]egendre", "the map from velocities to momenta, μ = ∂l/∂u; a discrete "
     "Lagrangian has two of them, F⁻ at the start of a step and F⁺ at its end"),
    ("retraction", "[Rr]etraction", "the map from velocities to group elements: cayley or "
     "exponential"),
    ("order", "[Oo]rder", "the power of the step size with which the error vanishes"),
    ("reference", "[Rr]eference", "the solution to more digits than are judged, each of them "
     "certain"),
    ("floor", "[Ff]loor|round-off", "the level below which round-off outweighs the error of the "
     "method; points there are left out"),
    ("Ω", "Ω", "the symplectic form of a discrete Lagrangian, on pairs of neighbouring steps"),
    ("pullback", "[Pp]ullback", "the form Ω of the next step, carried back by the derivative "
     "of a step; a symplectic method leaves it unchanged"),
    ("form defect", "[Ff]orm defect|Ω|[Ss]ymplectic", "by how much a step changes the symplectic "
     "form, relative to the form; 0 but for round-off if the method is symplectic"),
    ("Poisson defect", "Poisson", "the same on the dual: by how much a step changes the brackets "
     "of x and μ"),
    ("self-adjoint", "self-adjoint", "a step back undoes a step, as for the midpoint rule"),
    ("momentum drift", "[Dd]rift", "how far a conserved quantity moves in one direction in a run"),
    ("band", "[Bb]and|oscillat", "the limits between which the energy error oscillates; they "
     "stay narrow for a sound method, however long the run"),
    ("Casimir", "Casimir", "a function of the momenta that every motion keeps, such as |μ|²"),
    ("hω", "hω", "step size times the fastest frequency of small oscillations"),
    ("modified energy", "modified energy", "the energy of the nearby system that the method solves "
     "nearly exactly; a symplectic method keeps it"),
    ("parasitic modes", "[Pp]arasitic", "solutions of a method's equations that are near none of "
     "the motion's, as where a Lagrangian is linear in the velocity; they alternate, and may grow"),
    ("one-form", "[Oo]ne-form", "ϑ of a Lagrangian ϑ(x)·v − H(x), which is linear in the velocity; "
     "dϑ is the symplectic form of its x"),
    ("σ", "sigma|[Ss]teps that vary", "of steps that vary: a step of ε is one of about εσ of the "
     "time"),
    ("baseline", "[Bb]aseline", "results that were saved under a name, to compare later ones with"),
)  # fmt: skip


def met(text: str) -> list[tuple[str, str]]:
    """Return (word, meaning) of the words in a page's text."""
    return [(word, meaning) for word, shown, meaning in WORDS if re.search(shown, text)]


def rows() -> str:
    """Return the rows of docs/glossary.md."""
    cells = ([part.replace("|", "\\|") for part in (word, meaning)] for word, _, meaning in WORDS)
    return "\n".join(f"| {word} | {meaning} |" for word, meaning in cells)
