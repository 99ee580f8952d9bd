"""Other people's integrators on the same equations of motion, each as its documentation advises.

scipy is always present; heyoka, diffrax and rebound come with `pip install '.[peers]'`. Only
the comparison studies import them.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from discmech.integrators import BadInput
from discmech.integrators.equations import SceneSymbols, closed_velocity
from discmech.integrators.errors import unknown
from discmech.integrators.scene import Scene, remembered

from ..contestants import Contestant, Problem
from .rebounds import bodies

#: peer → (the package it needs, the class that runs it)
PEERS = {
    "DOP853": ("scipy", "scipys.ScipyContestant"),
    "Radau": ("scipy", "scipys.ScipyContestant"),
    "LSODA": ("scipy", "scipys.ScipyContestant"),
    "heyoka": ("heyoka", "heyokas.HeyokaContestant"),
    "diffrax": ("diffrax", "diffraxes.DiffraxContestant"),
    "diffrax-tsit5": ("diffrax", "diffraxes.DiffraxContestant"),
    "diffrax-symplectic": ("diffrax", "diffraxes.SymplecticContestant"),
    "WHFast": ("rebound", "rebounds.WisdomHolman"),
    "IAS15": ("rebound", "rebounds.ReboundContestant"),
}
#: peers that take the equations of motion as expressions
SYMBOLIC = ("heyoka", "diffrax", "diffrax-tsit5", "diffrax-symplectic")
SPLIT = ("diffrax-symplectic",)  # peers that need ẋ = f(μ), μ̇ = g(x)
BODIES = ("WHFast", "IAS15")  # peers for bodies that attract each other only
NONE = "none"


def chosen(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return (the peers of a race, one sentence for each absent one); all peers if none is named.

    Raises `BadInput` for a name that is not a peer's, and for a named peer that is not installed.
    """
    if list(names) == [NONE]:
        return [], []
    if NONE in names:
        raise BadInput(f"--peer {NONE} leaves out all others: name no other beside it.")
    for name in names:
        if name not in PEERS:
            raise unknown("peer", name, (*PEERS, NONE))
    present = [p for p in names or PEERS if find_spec(PEERS[p][0]) is not None]
    absent = [p for p in names or PEERS if p not in present]
    if names and absent:
        raise BadInput(f"{absent[0]} is not installed: pip install 'discmech[peers]'.")
    return present, [
        f"{name} did not take part: it is not installed (pip install 'discmech[peers]')."
        for name in absent
    ]


def on(scene: Scene, names: Sequence[str]) -> list[str]:
    """Return the peers that can be used on a scene."""
    return [
        name for name in names
        if not (name in SYMBOLIC and scene.lagrangian is not None and not _is_closed(scene))
        and (name not in SPLIT or _splits(scene))
        and (name not in BODIES or bodies(scene) is not None)
    ]  # fmt: skip


@remembered(maxsize=64)
def _is_closed(scene: Scene) -> bool:
    """True if ξ(x, μ) has a short closed form."""
    return closed_velocity(SceneSymbols(scene)) is not None


@remembered(maxsize=64)
def _splits(scene: Scene) -> bool:
    """True if L = T(v) − V(x) on a pair groupoid, without forces or time."""
    if not scene.groupoid.canonical or scene.force is not None or scene.clocked:
        return False
    s = SceneSymbols(scene)
    return all(s.lagrangian.diff(v).diff(x) == 0 for v in s.u for x in s.x)


def peer(name: str, problem: Problem, equations: Any) -> Contestant:
    """Return the peer on a problem with the compiled equations of motion `equations`."""
    module, _, kind = PEERS[name][1].partition(".")
    made: Contestant = getattr(import_module(f".{module}", __name__), kind)(
        name, problem, equations
    )
    return made
