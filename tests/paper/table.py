"""The table: all displays of sections 2 to 4 in the paper's order, and the rows on them."""

from __future__ import annotations

import csv
import hashlib
import re
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from .misprints import MISPRINTS
from .rows import ROWS

#: the rows register themselves when imported, here in the paper's order
for _name in (
    "section_2_groupoids",
    "section_2_mechanics",
    "section_3_local",
    "section_3_equations",
    "section_3_bench",
    "section_3_pair",
    "section_3_group",
    "section_3_so3",
    "section_3_action",
    "section_3_heavy_top",
    "section_4_bisections",
    "section_4_evolution",
):
    import_module(f"{__package__}.{_name}")

__all__ = ["DISPLAYS", "MISPRINTS", "ROWS", "SECTIONS", "Display", "displays_of"]

SECTIONS = {
    "2": "Groupoids and discrete mechanics",
    "2.1": "Lie groupoids",
    "2.2": "Discrete Euler–Lagrange equations",
    "2.3": "Discrete Poincaré–Cartan sections",
    "2.4": "Discrete Lagrangian evolution operator",
    "2.5": "Discrete Legendre transformations",
    "2.6": "Discrete regular Lagrangians",
    "3": "Discrete Euler–Lagrange equations: symmetric neighborhoods",
    "3.1": "Symmetric neighborhoods",
    "3.2": "Local coordinate expressions of structural maps",
    "3.3": "Invariant vector fields",
    "3.4": "The Lie algebroid of G",
    "3.5": "Discrete Euler–Lagrange equations",
    "3.6": "Examples",
    "3.6.1": "Pair or banal groupoid",
    "3.6.2": "Lie groups",
    "3.7": "Transformation or action Lie groupoid",
    "4": "Bisections and discrete Euler–Lagrange evolution operators",
    "4.1": "Bisections of a Lie groupoid",
    "4.2": "General discrete Euler–Lagrange evolution operators",
    "4.3": "Application",
}


class Display(NamedTuple):
    """A displayed formula: section-count, its printed number, its label, TeX form, fingerprint."""

    place: str
    number: str
    label: str
    form: str
    fingerprint: str


def _read() -> tuple[Display, ...]:
    with (Path(__file__).parent / "displays.csv").open(encoding="utf-8", newline="") as file:
        return tuple(Display(*row) for row in list(csv.reader(file))[1:])


DISPLAYS = _read()

_MARK = re.compile(
    r"\\(?P<head>section|subsection|subsubsection)\{"
    r"|\\begin\{(?P<env>equation|align|gather|multline|eqnarray)(?P<star>\*?)\}"
    r"|(?P<bracket>\\\[)(?!\d)|(?P<dollars>\$\$)"
)


def displays_of(tex: str) -> tuple[Display, ...]:
    """The displays of sections 2 to 4 of the paper's TeX source, for comparison with DISPLAYS."""
    tex = re.sub(r"(?<!\\)%.*", "", tex)
    levels, printed, position = [0, 0, 0], 0, 0
    found: list[Display] = []
    while mark := _MARK.search(tex, position):
        position = mark.end()
        if mark["head"]:
            level = ("section", "subsection", "subsubsection").index(mark["head"])
            levels[level:] = [levels[level] + 1, *[0] * (2 - level)]
            continue
        end = {"\\[": "\\]", "$$": "$$"}.get(
            mark.group(), "\\end{" + f"{mark['env']}{mark['star']}" + "}"
        )
        body = tex[position : tex.index(end, position)]
        position += len(body) + len(end)
        number = ""
        if mark["env"] and not mark["star"]:
            lines = 1 if mark["env"] in ("equation", "multline") else body.count("\\\\") + 1
            number = "–".join(str(printed + k + 1) for k in range(lines))
            printed += lines
        section = ".".join(str(k) for k in levels if k)
        if levels[0] in (2, 3, 4):
            count = sum(d.place.startswith(section + "-") for d in found) + 1
            form = f"{mark['env']}{mark['star']}" if mark["env"] else mark.group()
            digest = hashlib.sha256("".join(body.split()).encode()).hexdigest()[:8]
            label = ", ".join(re.findall(r"\\label\{([^}]*)\}", body))
            form = "[]" if form == "\\[" else form
            found.append(Display(f"{section}-{count}", number, label, form, digest))
    return tuple(found)
