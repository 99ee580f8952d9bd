"""A scheme's equations as LaTeX, for a notebook."""

from __future__ import annotations

import unicodedata
from collections.abc import Set

from ..equations import DiscretisedScene
from ..errors import DiscmechError
from ..numbers import sympy
from ..numbers.types import Expression, Letter

#: letters that have a meaning on a page of equations, and those of them that have indices
LETTERS = {*"xyzuvwhtslbVLfμλν", "L_d", "t_z", "t_w", "mu", "lambda", "nu"}
INDEXED = {*"xyzuvwsμλν", "mu", "lambda", "nu"}
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
            lines.append(f"{left} &= {_latex(e, scheme)}")
    if not lines:
        return None
    return "$$\\begin{aligned}\n" + " \\\\\n".join(lines) + "\n\\end{aligned}$$"


def _has_arrows(scheme: DiscretisedScene) -> bool:
    """Return True if F± are formulas in x and u alone."""
    try:
        return bool(scheme.has_arrows and not len(scheme.s.stages) and scheme.residual)
    except DiscmechError:
        return False


def _latex(e: Expression, scheme: DiscretisedScene) -> str:
    own, s = parameter_names(scheme), scheme.s
    names = {k: letter(own[k]) if k in own else _letter(k) for k in e.free_symbols}
    if s.clocked:
        names[s.x[-1]] = "t"
    return str(sympy.latex(e, symbol_names=names, mul_symbol=r"\,"))


def parameter_names(
    scheme: DiscretisedScene, taken: Set[str] = frozenset(LETTERS)
) -> dict[Letter, str]:
    """Return how parameters are shown: by their names, entries of lists with indices from 1.

    A name that the page has for something else, one of `taken`, has p. before it.
    """
    names = list[str]()
    for name, value in scheme.scene.parameters.items():
        entries = [name]
        if isinstance(value, tuple):
            entries = [f"{name}_{i}" for i in range(1, len(value) + 1)]
            if value and isinstance(value[0], tuple):
                columns = range(1, len(value[0]) + 1)
                entries = [f"{entry}_{j}" for entry in entries for j in columns]
        names += entries
    names = [
        f"p.{name}" if name in taken or ("_" in name and name.split("_")[0] in INDEXED) else name
        for name in names
    ]
    return dict(zip(scheme.s.parameter_list, names, strict=False))  # the time may come last


def _letter(symbol: Letter) -> str:
    """Return x_0 as x_{1}, counted like the terminal output."""
    name, *index = str(symbol).split("_")
    return letter("_".join([name, *(str(int(k) + 1) if k.isdecimal() else k for k in index)]))


def letter(name: str) -> str:
    """Return a name as LaTeX: x_1 as x_{1}, omega0 and ω_0 as \\omega_{0}, whole words upright.

    What is in brackets is a name too: f_1[x_1] as f_{1}[x_{1}].
    """
    name, bracket, inside = name.removesuffix("]").partition("[")
    if bracket:
        return f"{letter(name)}[{letter(inside)}]"
    word, *index = name.replace("′", "").split("_")
    stem = word.rstrip("0123456789") or word
    tail = ",".join(filter(None, [word.removeprefix(stem), *map(_word, index)]))
    return _word(stem) + "'" * name.count("′") + (f"_{{{tail}}}" if tail else "")


def _word(name: str) -> str:
    from sympy.printing.latex import greek_letters_set, translate

    if len(name) == 1 and (greek := unicodedata.name(name)).startswith("GREEK"):
        name = greek.split()[-1].lower().replace("lamda", "lambda")
        name = name.capitalize() if "CAPITAL" in greek else name
    if name in greek_letters_set or (name.lower() in greek_letters_set and name.istitle()):
        return str(translate(name))
    return name if len(name) < 2 or name.isdecimal() else rf"\mathrm{{{name}}}"
