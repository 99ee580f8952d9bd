"""A scheme's equations as LaTeX, for a notebook."""

from __future__ import annotations

import re

from ..equations import DiscretisedScene, SceneSymbols
from ..errors import DiscmechError
from ..numbers import sympy
from ..numbers.types import Expression, Letter

LARGEST = 400  # an equation with more operations is not shown


def latex_of(scheme: DiscretisedScene) -> str | None:
    """Return $$…$$ with the Lagrangian, L_d, the momentum before the step and the step's equations.

    Equations that are too long to read are left out; the result is None if none remains, as for
    one-step maps.
    """
    lines = []
    equations: list[tuple[str, Expression]] = []
    if scheme.s.hamiltonian is not None and not scheme.s.degenerate:
        equations.append(("H(x, mu)", scheme.s.hamiltonian))
    elif scheme.scene.lagrangian is not None:
        equations.append(("l(x, u)", scheme.s.lagrangian))
    if _has_arrows(scheme):
        momenta = (sympy.expand_mul(e / scheme.s.h) for e in scheme.legendre_minus)
        equations.append(("L_d(x, u)", scheme.discrete_lagrangian))
        equations += [(_letter(mu), e) for mu, e in zip(scheme.s.mu, momenta, strict=True)]
        equations += [("0", e) for e in scheme.residual]
    for left, e in equations:
        if sympy.count_ops(e) <= LARGEST:
            lines.append(f"{left} &= {_latex(e, scheme.s)}")
    if not lines:
        return None
    return "$$\\begin{aligned}\n" + " \\\\\n".join(lines) + "\n\\end{aligned}$$"


def _has_arrows(scheme: DiscretisedScene) -> bool:
    """Return True if F± are formulas in x and u alone."""
    try:
        return bool(scheme.has_arrows and not len(scheme.s.stages) and scheme.residual)
    except DiscmechError:
        return False


def _latex(e: Expression, s: SceneSymbols) -> str:
    names = {letter: _letter(letter) for letter in e.free_symbols}
    if s.clocked:
        names[s.x[-1]] = "t"
    return str(sympy.latex(e, symbol_names=names, mul_symbol=r"\,"))


def _letter(symbol: Letter) -> str:
    """Return x_0 as x_{1}, counted like the terminal output, and whole names upright."""
    name, *index = str(symbol).split("_")
    tail = ",".join(str(int(k) + 1) if k.isdecimal() else k for k in index)
    greek = {"mu": r"\mu", "omega": r"\omega", "gamma": r"\gamma", "theta": r"\theta"}
    if name in greek:
        name = greek[name]
    elif len(name) > 1 and not re.fullmatch(r"[a-zA-Z]\d*", name):
        name = rf"\mathrm{{{name}}}"
    return f"{name}_{{{tail}}}" if tail else name
