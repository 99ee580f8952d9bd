"""PAPER.md, written from the table."""

from __future__ import annotations

from collections import Counter

from .misprints import FORMULA, NOTATION, SLIP, Misprint
from .rows import ACTIONS, CAYLEY, DEFINITION, EVERYWHERE, MATRIX, SYMBOLIC, Row
from .statements import STATEMENTS, VERSION
from .table import DISPLAYS, MISPRINTS, ROWS, SECTIONS

INTRODUCTION = """\
# The paper, equation by equation

J. C. Marrero, D. Martín de Diego, E. Martínez, *The local description of discrete mechanics*,
sections 2 to 4. Written by `make paper` from the table in `tests/paper/`, which pytest runs: what
is said to hold here is asserted there. {version}

{displays} displayed formulas and {text} statements of the text: {checked} checked ({symbolic}
symbolically, {numeric} at 40 digits), {definitions} definitions. {formulas} formulas are false as
printed; {slips} slips of the pen and {notations} remarks on notation change none.

How a formula is checked:

- **symbolic**: both sides cancel identically, with generic functions and letters for the data.
- **40 digits**: at points with rational coordinates, over all groupoids of `tests/objects/` to
  which the formula applies: pair groupoids, matrix groups and their actions, products, groupoids
  given by hand, among them one that is not unimodular and one whose structure functions depend on
  the point. The fast tests take one of at most four dimensions for each row, products among them;
  the slow tests all, near the identities, in the middle and near the edge of the chart, and in the
  middle those of many dimensions too (SE(3), SO(4), Sp(4)). Numbers are exact, or rational to 240
  digits; derivatives are difference quotients over $10^{{-40}}$. $L_d$ is a cubic polynomial on the
  groupoid, made to have an exact solution $(g,h)$.
- Every check can fail, and every claim that it makes. Each function that it reads ($b$, $p$,
  $\\iota$, $\\rho$, $L$, $R$, $C$, $\\tau$, $L_d$ and its derivatives) is made wrong by
  $10^{{-30}}$, and the check has to see it; where the identity holds whatever that function is, the
  row says so in its data. Each claim has to fail for one of these errors. What holds by the choice
  of coordinates, as $\\alpha(x,u)=x$, is said and not checked. In a symbolic identity each entry in
  turn loses a term.
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
- multisymplectic field theories: fields on a grid, as lattices of any groupoid, with the
  multisymplectic law on patches of space and time (`docs/lattices.md`).
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
    kinds = Counter(m.kind for m in MISPRINTS)
    introduction = INTRODUCTION.format(
        version=VERSION, displays=len(DISPLAYS), text=len(ROWS) - len(DISPLAYS),
        checked=len(ROWS) - count[DEFINITION], symbolic=count[SYMBOLIC],
        numeric=len(ROWS) - count[DEFINITION] - count[SYMBOLIC], definitions=count[DEFINITION],
        formulas=kinds[FORMULA], slips=kinds[SLIP], notations=kinds[NOTATION],
    )  # fmt: skip
    parts = [introduction, _statements(), _misprints(), *map(_section, SECTIONS), CONCLUSIONS]
    return "\n".join(parts)


def _statements() -> str:
    lines = [
        "## Propositions and theorems",
        "", "The rows below, other tests, and the module that does it on the bench.", "",
        "| statement | what it says | rows | tests | module |", "|---|---|---|---|---|",
    ]  # fmt: skip
    places = {row.place: _full_place(row) for row in ROWS}
    for s in STATEMENTS:
        rows = "; ".join(places[place] for place in s.rows)
        tests = ", ".join(f"`{test.partition('/')[2]}`" for test in s.tests) or "–"
        modules = ", ".join(f"`{module}`" for module in s.modules)
        lines.append(f"| {s.name} | {s.says} | {rows} | {tests} | {modules} |")
    return "\n".join([*lines, ""])


def _misprints() -> str:
    lines = [
        "## Misprints",
        "",
        "`[misprint: tag]` marks in the code where a corrected formula is used.",
    ]
    for kind, heading, head in (
        (FORMULA, "Formulas that are false as printed", "tag | where | printed | corrected | why"),
        (SLIP, "Slips of the pen", "tag | where | printed | meant | why"),
        (NOTATION, "Remarks on notation", "tag | where | printed | read as | why"),
    ):
        last = " | consequence" if kind == FORMULA else ""
        rule = "|---" * (head.count("|") + 1 + bool(last)) + "|"
        of_kind = [m for m in MISPRINTS if m.kind == kind]
        lines += ["", f"### {heading}", "", f"| {head}{last} |", rule, *map(_misprint, of_kind)]
    return "\n".join([*lines, ""])


def _misprint(m: Misprint) -> str:
    where = m.where or ", ".join(_full_place(row) for row in ROWS if m.tag in row.misprints)
    last = f" {m.then} |" if m.kind == FORMULA else ""
    return f"| `{m.tag}` | {where} | {m.printed} | {m.corrected} | {m.why or '–'} |{last}"


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
    if row.how == DEFINITION:
        return "definition" + (f"; see {tags}" if tags else "")
    if not tags:
        return "holds"
    formulas = {m.tag for m in MISPRINTS if m.kind == FORMULA}
    return f"**corrected** {tags}" if formulas & set(row.misprints) else f"holds; see {tags}"


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
