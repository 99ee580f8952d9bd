"""The paper's propositions, lemma and theorems, and the version of it that was read."""

from __future__ import annotations

from typing import NamedTuple

#: of the TeX source
DIGEST = "22a50f4976f2df45ac990d521cb649a9e692c635b691f579264d8df4e7a463dd"

VERSION = f"""\
What was read is the TeX source of
arXiv:1303.4047 with the SHA-256 `{DIGEST[:16]}…`; a test compares each displayed
formula with it (`DISCMECH_PAPER` set to its path). The printed version may differ."""


class Statement(NamedTuple):
    """Its number, what it says, its rows here, other tests, modules of the bench."""

    name: str
    says: str
    rows: tuple[str, ...]
    tests: tuple[str, ...]
    modules: tuple[str, ...]


_BISECTIONS = "tests/integrators/bisections/test_bisections.py"
_OPERATOR = "tests/integrators/bisections/test_evolution_operator.py"
_MODULE = "integrators/bisections"

STATEMENTS = (
    Statement("section 2.6",
        "equivalent: $L_d$ regular; $F^-L_d$ a local diffeomorphism; $F^+L_d$ one",
        ("2.6-text",), (), ("integrators/equations/arrows.py",)),
    Statement("section 2.6",
        r"near a solution there is one evolution operator, a diffeomorphism; it keeps $\Omega$",
        ("3.5-Proposition 3.2", "4.2-18", "2.3-symplecticity"), ("tests/laws/test_flow_laws.py",),
        ("integrators/flows/flow.py",)),
    Statement("Proposition 3.1",
        "symmetric neighborhoods exist",
        ("3.1-Proposition 3.1", "3.1-Cayley"),
        ("tests/integrators/groupoids/test_symmetric_neighbourhoods.py",),
        ("integrators/groupoids/chart_margin.py", "integrators/retractions/retraction.py")),
    Statement("Proposition 3.2",
        r"regularity at $h_0$ by $FL_d$, $\Omega$ and $F^-$, and the local evolution operator",
        ("2.6-text", "3.5-5", "3.5-7", "3.5-9", "3.5-Proposition 3.2"),
        ("tests/laws/test_flow_laws.py",),
        ("integrators/flows/newton_step.py",)),
    Statement("Propositions 4.2, 4.4",
        r"a (local) bisection has the sections $\Sigma_\alpha$ and $\Sigma_\beta$",
        ("4.1-1",), (_BISECTIONS,), (f"{_MODULE}/bisection.py",)),
    Statement("Lemma 4.5",
        "two subspaces of equal dimension have a common complement; checked in 4 = 1+1+1+1",
        ("4.1-Lemma 4.5",), (_BISECTIONS,), (f"{_MODULE}/bisection.py",)),
    Statement("Proposition 4.6",
        "a local bisection passes through every arrow",
        ("4.1-Proposition 4.6", "4.1-1"), (_BISECTIONS,), (f"{_MODULE}/bisection.py",)),
    Statement("Theorem 4.8",
        "the discrete Euler–Lagrange equations through bisections",
        ("4.2-7", "4.2-4", "4.2-5", "4.2-6"), (_OPERATOR,), (f"{_MODULE}/evolution_operator.py",)),
    Statement("Theorem 4.9",
        r"regularity at $h_0$, and the general local evolution operator",
        ("4.2-Theorem 4.9", "4.2-9", "4.2-12", "4.2-13", "4.2-18"), (_OPERATOR,),
        (f"{_MODULE}/evolution_operator.py",)),
    Statement("Theorem 4.10",
        r"regularity at both arrows, and $\Psi$ a diffeomorphism; false with (40) as printed",
        ("4.2-Theorem 4.10", "4.2-counterexample", "4.2-16", "4.2-18"), (_OPERATOR,),
        (f"{_MODULE}/evolution_operator.py",)),
)  # fmt: skip
