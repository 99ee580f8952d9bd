"""Colours and markers (Okabe–Ito): a rule looks the same in every figure."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from hashlib import blake2b
from itertools import product
from typing import Any

from ..core.study import BY_TOLERANCE

INK, MUTED, GRID, PAPER = "#1a1a1a", "#606060", "#d4d4d4", "#ffffff"
# Okabe–Ito without yellow, which is invisible on white; each has a darker colour for words
BLUE, VERMILLION, GREEN, PURPLE = "#0072b2", "#d55e00", "#009e73", "#cc79a7"
SKY, ORANGE = "#56b4e9", "#e69f00"
WORDS = {BLUE: "#005c8f", VERMILLION: "#a84a00", GREEN: "#00694d", PURPLE: "#98467a"}
WORDS |= {SKY: "#1b6a96", ORANGE: "#855c00", INK: "#1a1a1a", MUTED: "#606060"}
#: the page's CSS variable for each colour of a drawing
THEME = {INK: "ink", MUTED: "muted", GRID: "grid", PAPER: "paper", BLUE: "blue", SKY: "sky"}
THEME |= {VERMILLION: "vermillion", GREEN: "green", PURPLE: "purple", ORANGE: "orange"}
THEME |= {dark: f"{THEME[colour]}-words" for colour, dark in WORDS.items() if dark != colour}
THEME |= {"#000000": "ink"}
_FIXED = {"rectangle": (VERMILLION, "s"), "midpoint": (BLUE, "o"), "trapezoidal": (GREEN, "^")}
# rules that appear together in one figure of the report
_FIXED |= {"imex": (PURPLE, "D"), "gauss-2": (ORANGE, "v"), "gauss-3": (SKY, "P")}
_FIXED |= {"gauss-4": (INK, "X"), "gauss-8": (PURPLE, "<"), "lobatto-3": (SKY, ">")}
_FIXED |= {"triple-jump:midpoint": (BLUE, "P"), "triple-jump:trapezoidal": (GREEN, "P")}
_FIXED |= {"suzuki:midpoint": (BLUE, "X"), "suzuki:trapezoidal": (GREEN, "X")}
_FIXED |= {"kahan-li-8:midpoint": (INK, "p"), "kahan-li-8:trapezoidal": (ORANGE, "p")}
_FIXED |= {"average-vector-field": (PURPLE, "v"), "stoermer-verlet": (GREEN, "v")}
# other people's integrators are grey and dashed, so that colours belong to the rules
_PEERS = {
    "DOP853": (MUTED, "d"),
    "Radau": (MUTED, "v"),
    "LSODA": (MUTED, "p"),
    "heyoka": (INK, "*"),
    "diffrax": (INK, "h"),
    "diffrax-tsit5": (INK, "p"),
    "diffrax-symplectic": (MUTED, "H"),
    "WHFast": (MUTED, "8"),
    "IAS15": (INK, "d"),
}
#: looks of other rules, chosen by name so that a rule keeps its mark; without the colours of
#: midpoint, trapezoidal and gauss-2, which are usually drawn beside them
_COLOURS = (INK, VERMILLION, PURPLE, SKY)
_MARKERS = ("D", "v", "P", "X", "<", ">", "h", "p")
_OTHERS = [
    look for look in product(_COLOURS, _MARKERS)
    if look not in (*_FIXED.values(), *_PEERS.values())
]  # fmt: skip


@dataclass(frozen=True)
class Mark:
    """The look of one rule, the same in every figure of a report."""

    colour: str
    marker: str
    dash: str | tuple[int, tuple[float, ...]] = "-"
    hollow: bool = False

    @property
    def face(self) -> str:
        """The colour inside a mark."""
        return PAPER if self.hollow else self.colour

    @property
    def words(self) -> str:
        """The colour for text, dark enough on paper."""
        return WORDS.get(self.colour, self.colour)


def marks(rules: Iterable[str]) -> dict[str, Mark]:
    """Return colour and marker of each rule, from its name alone while no other has both.

    "NAME, exp" is NAME with dashes, "NAME, tolerance" dotted with hollow marks. Two rules of one
    figure may get one colour, never with one marker; a label stands at the end of each line.
    """
    found: dict[str, Mark] = {}
    for rule in rules:
        steps = rule.removesuffix(", exp")
        base = steps.removesuffix(BY_TOLERANCE)
        dash: Any = (0, (1.0, 1.2)) if base != steps else (0, (4.0, 1.6)) if base != rule else "-"
        if base in _PEERS:
            dash = (0, (2.0, 1.2))
        taken = {(mark.colour, mark.marker) for name, mark in found.items() if name != base}
        own = (found[base].colour, found[base].marker) if base in found else None
        colour, marker = own or _FIXED.get(base) or _PEERS.get(base) or _by_name(base, taken)
        found.setdefault(base, Mark(colour, marker, dash if base == rule else "-"))
        found[rule] = Mark(colour, marker, dash, hollow=base != steps)
    return found


def _by_name(rule: str, taken: Collection[tuple[str, str]]) -> tuple[str, str]:
    """Return the colour and marker of the name's letters, or the next that are not taken."""
    number = int.from_bytes(blake2b(rule.encode(), digest_size=4).digest(), "big")
    places = [(number + k) % len(_OTHERS) for k in range(len(_OTHERS))]
    return next((_OTHERS[k] for k in places if _OTHERS[k] not in taken), _OTHERS[places[0]])
