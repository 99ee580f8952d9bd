"""The text of a lattice's kernels, of one site and of one bond, and of their driver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ...compiler import UNSEEN, KernelText, Step, pivot_rows, texts_of, with_names
from ...numbers import Coefficients, Nodes, coefficients_text, function_text, with_tables
from ...numbers.nodes import CALL
from ...numbers.statements import Arguments
from ...numbers.types import Letters
from .sparse_steps import FADED, MOST_SWEEPS

HERE = Path(__file__).parent
BLOCK = 1024  # number of bonds whose sites fit into the processor's first cache
MOST = 60  # a force with fewer operations is computed twice rather than one bond at a time


@dataclass(frozen=True, eq=False)
class Kicks:
    """Forces F⁻/h and F⁺/h, at the same x, of a term without velocities; `own`: its letters.

    They are nodes of one graph; whole: F⁺/h of one step minus F⁻/h of the next.
    """

    name: str
    x: Letters
    own: Letters
    minus: Nodes
    plus: Nodes
    whole: Nodes


@dataclass(frozen=True, eq=False)
class LatticeSystem:
    """One step of a lattice as data: of one site, and of one bond.

    q: h, then the parameters that all sites share and the rule's numbers. site: the terms of one
    site by itself, with its own letters `own` (after `q` in site.q). kicks: (of a site's potential,
    of a bond), if no bond contains unknowns. Otherwise bond: the Step of one bond, with x, u, w
    and rows of both ends one after the other, and its letters `bond_own`. adjoint: the adjoint's
    system, if some substeps of a composition are steps of it. timed: True if q holds the time,
    behind h; coefficients are then computed anew in each substep.
    """

    name: str
    q: Letters
    site: Step
    own: Letters
    bond_own: Letters
    kicks: tuple[Kicks | None, Kicks] | None = None
    bond: Step | None = None
    adjoint: LatticeSystem | None = None
    timed: bool = False


def lattice_text(system: LatticeSystem, shape: str, composed: bool) -> str:
    """Return the text of a lattice's kernels and driver; shape: "chain", "ring" or "list"."""
    kinds = [system] if system.adjoint is None else [system, system.adjoint]
    made = [_Kernels(s, suffix) for s, suffix in zip(kinds, ("", "_of_adjoint"))]  # noqa: B905
    local, s = system.kicks is not None, len(system.site.w)
    facts = [
        f"n, m, S = {len(system.site.x)}, {len(system.site.u)}, {len(system.site.w)}",
        f"MIXED, LOCAL, SPLIT = {len(made) > 1}, {local}, {made[0].cheap}",
        f"RING, LISTED, LATER = {shape == 'ring'}, {shape == 'list'}, {int(shape == 'ring')}",
        f"COMPOSED, TIMED, GIVEN = {composed}, {system.timed}, {2 + len(system.q)}",
        f"SITES, BONDS, BLOCK = {len(system.own)}, {len(system.bond_own)}, {BLOCK}",
        f"FADED, MOST_SWEEPS = {FADED}, {MOST_SWEEPS}",
        f"MOVING = {s - system.site.multipliers}",
        f"UNSEEN = {UNSEEN}",
        "ALONE = False",
        *_places([k for k in kinds if k.bond is not None], s),
        f"WIDTH = {max(k.width for k in made)}",
        "WIDTHS = dict(x=n, nu=m, mu=m, p=SITES, q=BONDS, given=GIVEN, "
        f"w=S, w1=S, w2=S, w3=S, work={s * s * (2 if shape == 'ring' else 1) + s}, "
        "ties=2 * S * S, coefficients=WIDTH)",
        f"ORDER = {tuple(pivot_rows(system.site))}",
        *(f"{name} = {k.record}" for name, k in zip(("RULE", "ADJOINT"), made)),  # noqa: B905
        # a composition of a rule and its adjoint begins with the latter
        f"FIRST = {'ADJOINT' if len(made) > 1 else 'RULE'}",
        f"SYSTEMS = RULE,{' ADJOINT' if len(made) > 1 else ''}",
    ]
    own = (HERE / name for name in ("lattice_driver", "lattice_newton", "lattice_elimination"))
    driver = texts_of(*own, "newton_iteration", "tuple_operations")
    texts = (k.text for k in made)
    return with_tables("\n\n".join([f"# {system.name}", *texts, "\n".join(facts), driver]))


def _places(kinds: Sequence[LatticeSystem], S: int) -> list[str]:
    """Return where each block of a bond's slope has entries (`lattice_elimination`)."""
    blocks = {"HERE": (0, 0), "AHEAD": (0, 1), "BEHIND": (1, 0), "THERE": (1, 1)}
    tables = {
        name: tuple(i * S + j for i in range(S) for j in range(S)
                    if any(k.bond.slope[a * S + i][b * S + j] for k in kinds if k.bond))
        for name, (a, b) in blocks.items()
    }  # fmt: skip
    columns = {p % S for p in tables["AHEAD"]}  # columns that multiply a site's own equations
    tables["ELIMINATED"] = tuple(p for p in range(S * S) if p % S in columns)
    return [f"{name} = {places}" for name, places in tables.items()]


class _Kernels:
    """The kernels of a lattice's rule, or of its adjoint; they share their coefficients."""

    def __init__(self, system: LatticeSystem, suffix: str) -> None:
        self.system, self.suffix = system, suffix
        coefficients = Coefficients(system.q)
        coefficients.symbol(system.q[0])
        words = ("solver" if system.kicks else "equations", "update")
        site = _of_term(system.site, suffix, coefficients, words, system.own)
        parts = [site.text]
        self.affine = bool(system.kicks) and site.affine
        kicks = [k for k in system.kicks or () if k is not None]
        parts += [_kick_text(k, f"{k.name}{suffix}", coefficients) for k in kicks]
        if system.bond is not None:
            words = ("equations", "gain")
            bond = _of_term(system.bond, f"_of_bond{suffix}", coefficients, words, system.bond_own)
            parts.append(bond.text)
        parts.append(coefficients_text(f"prepare{suffix}", coefficients))
        self.text, self.width = "\n\n".join(parts), len(coefficients.values)
        #: True if a bond's forces are cheap
        self.cheap = (
            bool(kicks)
            and sum(map(parts[-2].count, "+-*/")) < MOST
            and not any(e.kind == CALL for e in kicks[-1].minus[0].graph.order(kicks[-1].minus))
        )

    @property
    def record(self) -> str:
        """The record that the driver is given, as text."""
        s, system = self.suffix, self.system
        entries = {"prepare": f"prepare{s}", "affine": self.affine, "update": f"update{s}"}
        if system.kicks is not None:
            entries |= {"solver": f"solver{s}", "potential": None}
            for kick in system.kicks:
                if kick is not None:
                    name = f"{kick.name}{s}"
                    entries[kick.name] = (
                        f"Record(minus=minus_{name}, plus=plus_{name}, whole=whole_{name})"
                    )
        else:
            entries |= {"equations": f"equations{s}", "bond_equations": f"equations_of_bond{s}",
                        "bond_gain": f"gain_of_bond{s}"}  # fmt: skip
        return f"Record({', '.join(f'{k}={v}' for k, v in entries.items())})"


def _of_term(
    step: Step, suffix: str, coefficients: Coefficients, parts: tuple[str, ...], own: Letters
) -> KernelText:
    """Return the kernels of a site or of a bond, which have no edge and hand nothing on."""
    return KernelText(replace(step, extents=()), suffix, ("carried",), coefficients, parts, own)


def _kick_text(kick: Kicks, name: str, coefficients: Coefficients) -> str:
    texts = []
    for word in ("minus", "plus", "whole"):
        column = getattr(kick, word)
        arguments: Arguments = {"x": kick.x, "c": coefficients, "own": kick.own}
        text = function_text(f"{word}_{name}", arguments, [column], coefficients)
        texts.append(f"@kernel\n{with_names(text, kick.own)}")
    return "\n\n".join(texts)
