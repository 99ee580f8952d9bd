"""Colours and markers (Okabe–Ito): a rule looks the same in every figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from typing import TypeAlias

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
_FIXED |= {"average-vector-field": (PURPLE, "v"), "stoermer-verlet": (INK, "v")}
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
#: looks of other rules: a colour that is free, then a mark and a dash that are free in it
_COLOURS = (VERMILLION, PURPLE, SKY, INK, BLUE, GREEN, ORANGE)
#: colours in turn of curves and bodies that are no rules
CYCLE = (BLUE, VERMILLION, GREEN, PURPLE, SKY, ORANGE, INK)
#: colours that are told apart only side by side, and whose words are not
ALIKE = {BLUE: SKY, SKY: BLUE, VERMILLION: ORANGE, ORANGE: VERMILLION}
_MARKERS = ("D", "v", "P", "X", "<", ">", "h", "p")
Dash: TypeAlias = str | tuple[int, tuple[float, ...]]
SHORT, LONG, DOTS = (0, (2.0, 1.2)), (0, (4.0, 1.6)), (0, (1.0, 1.2))
_DASHES: tuple[Dash, ...] = ("-", LONG, (0, (5.0, 1.3, 1.0, 1.3)), SHORT, DOTS, (0, (9.0, 2.0)))


@dataclass(frozen=True)
class Mark:
    """The look of one rule, the same in every figure of a report."""

    colour: str
    marker: str
    dash: Dash = "-"
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
    """Return the look of each rule of a report, no two with one colour, marker and dash.

    "NAME, exp" is NAME with dashes, "NAME, tolerance" dotted with hollow marks. Other rules than
    the known ones have the colour and marker of their names, or the next ones where another rule
    has that colour: all colours are used before one is used again. Lines of one colour, or of two
    that are alike, differ in their dashes too, since not every figure has marks.
    """
    looks: dict[str, Mark] = {}
    names = [(rule, rule.removesuffix(", exp").removesuffix(BY_TOLERANCE)) for rule in rules]
    known = _FIXED | _PEERS
    for rule, base in sorted(names, key=lambda pair: (pair[1] not in known, pair[0] != pair[1])):
        others = [mark for name, mark in looks.items() if name != base]
        own = (looks[base].colour, looks[base].marker) if base in looks else known.get(base)
        colour, marker = own or _by_name(base, others)
        near = (colour, ALIKE.get(colour))
        taken = {mark.dash for mark in looks.values() if mark.colour in near}
        steps = rule.removesuffix(", exp")
        wished = DOTS if base != steps else LONG if base != rule else _DASHES[0]
        wished = SHORT if base in _PEERS else wished
        dash = next((each for each in (wished, *_DASHES) if each not in taken), wished)
        looks[rule] = Mark(colour, marker, dash, hollow=base != steps)
    return looks


def _by_name(rule: str, others: Collection[Mark]) -> tuple[str, str]:
    """Return the least used colour, and a marker free in it, from those of the name's letters.

    While there are others it is none that is like a colour in use: five rules differ clearly.
    """
    number = int.from_bytes(blake2b(rule.encode(), digest_size=4).digest(), "big")
    used: Counter[str | None] = Counter(mark.colour for mark in others)
    colour = min(_turned(_COLOURS, number), key=lambda each: (used[each], used[ALIKE.get(each)]))
    taken = {mark.marker for mark in others if mark.colour == colour}
    markers = _turned(_MARKERS, number // len(_COLOURS))
    return colour, next((each for each in markers if each not in taken), markers[0])


def _turned(looks: Sequence[str], number: int) -> list[str]:
    first = number % len(looks)
    return [*looks[first:], *looks[:first]]
