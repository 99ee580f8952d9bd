"""PAPER.md, written from the table."""

from __future__ import annotations

from collections import Counter

from .misprints import Misprint
from .rows import ACTIONS, CAYLEY, DEFINITION, EVERYWHERE, MATRIX, SYMBOLIC, Row
from .table import DISPLAYS, MISPRINTS, ROWS, SECTIONS

INTRODUCTION = """\
# The paper, equation by equation

J. C. Marrero, D. Martín de Diego, E. Martínez, *The local description of discrete mechanics*,
sections 2 to 4. Written by `make paper` from the table in `tests/paper/`, which pytest runs: what
is said to hold here is asserted there.

{displays} displayed formulas and {text} statements of the text: {checked} checked ({symbolic}
symbolically, {numeric} at 40 digits), {definitions} definitions; {misprints} misprints.

How a formula is checked:

- **symbolic**: both sides cancel identically, with generic functions and letters for the data.
- **40 digits**: at points with rational coordinates, over all groupoids of `tests/objects/` to
  which the formula applies: pair groupoids, matrix groups and their actions, groupoids given by
  hand, among them one that is not unimodular and one whose structure functions depend on the point.
  Numbers are exact, or rational to 240 digits; derivatives are difference quotients over
  $10^{{-40}}$. $L_d$ is a cubic polynomial on the groupoid, made to have an exact solution $(g,h)$.
- Every check can fail. Each function that it reads ($b$, $p$, $\\iota$, $\\rho$, $L$, $R$, $C$,
  $\\tau$, $L_d$ and its derivatives) is made wrong by $10^{{-30}}$, and the check has to see it;
  where the identity holds whatever that function is, the row says so in its data. Of a symbolic
  identity a term is dropped.
- A printed formula that is wrong is shown to be wrong by the test of its row, which shows the
  corrected one to hold.

Upper index of a matrix: row. $h$ is the step, and also an arrow, as in the paper.
"""

CONCLUSIONS = """\
## 5 Conclusions and future work

No displayed formula. What the last paragraph hopes for, and what of it runs here:

- forced or dissipative systems: on every groupoid, by the displacement of a fraction of an arrow
  (`docs/forces-and-time.md`);
- explicitly time-dependent systems: each point of a rule has its time (`docs/forces-and-time.md`);
- holonomic and nonholonomic constraints: on every groupoid, by rules without stages
  (`docs/constraints.md`);
- discrete optimal control: on every groupoid, by the forced equations and the cost of one rule
  (`docs/optimal-control.md`);
- frictional contact: on every groupoid with a base, by every rule (`docs/contact.md`);
- multisymplectic field theories: not yet.
"""

OVER = {
    EVERYWHERE: "40 digits, all groupoids",
    MATRIX: "40 digits, matrix groups and actions",
    CAYLEY: "40 digits, the same with Cayley",
    ACTIONS: "40 digits, actions",
    SYMBOLIC: "symbolic",
    DEFINITION: "–",
}


def page() -> str:
    """The text of PAPER.md."""
    count = Counter(row.how for row in ROWS)
    introduction = INTRODUCTION.format(
        displays=len(DISPLAYS),
        text=len(ROWS) - len(DISPLAYS),
        checked=len(ROWS) - count[DEFINITION],
        symbolic=count[SYMBOLIC],
        numeric=len(ROWS) - count[DEFINITION] - count[SYMBOLIC],
        definitions=count[DEFINITION],
        misprints=len(MISPRINTS),
    )
    parts = [introduction, _misprints(), *map(_section, SECTIONS), CONCLUSIONS]
    return "\n".join(parts)


def _misprints() -> str:
    lines = [
        "## Misprints",
        "",
        "`[misprint: tag]` marks in the code where the corrected formula is used.",
        "",
        "| tag | where | printed | corrected | why |",
        "|---|---|---|---|---|",
    ]
    return "\n".join([*lines, *map(_misprint, MISPRINTS), ""])


def _misprint(m: Misprint) -> str:
    where = ", ".join(_full_place(row) for row in ROWS if m.tag in row.misprints)
    why = m.why + (" (a slip of the pen)" if m.slip else "")
    return f"| `{m.tag}` | {where} | {m.printed} | {m.corrected} | {why} |"


def _section(number: str) -> str:
    heading = f"{'#' * (2 + number.count('.'))} {number} {SECTIONS[number]}"
    rows = [row for row in ROWS if row.section == number]
    head = ["| place | what it says | checked | result |", "|---|---|---|---|"]
    above = any(other.startswith(number + ".") for other in SECTIONS)
    none = [] if above else ["No displayed formula.", ""]
    return "\n".join([heading, "", *([*head, *map(_row, rows), ""] if rows else none)])


def _row(row: Row) -> str:
    return f"| {_place(row)} | {row.says} | {OVER[row.how]} | {_result(row)} |"


def _result(row: Row) -> str:
    tags = ", ".join(f"[{tag}](#misprints)" for tag in row.misprints)
    slips = {m.tag for m in MISPRINTS if m.slip}
    if row.how == DEFINITION:
        return "definition" + (f"; misprint {tags}" if tags else "")
    if not tags:
        return "holds"
    return f"holds; misprint {tags}" if set(row.misprints) <= slips else f"**corrected** {tags}"


def _place(row: Row) -> str:
    """The printed number and label, or the count in its section."""
    for display in DISPLAYS:
        if display.place == row.place:
            label = f" `{display.label}`" if display.label else ""
            number = f"({display.number})" if display.number else "display " + _count(row)
            return number + label
    return _count(row)


def _full_place(row: Row) -> str:
    return f"{row.section} {_place(row)}"


def _count(row: Row) -> str:
    return row.place.partition("-")[2]
