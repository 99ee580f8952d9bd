"""MathML from elsewhere made fit for the page: only presentation elements, no namespaces."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from html import escape, unescape

_ALLOWED = re.compile(
    "math|mrow|mi|mn|mo|mtext|mspace|msqrt|mroot|mfrac|msub|msup|msubsup|munder|mover|munderover|"
    "mmultiscripts|mprescripts|none|mtable|mtr|mtd|mstyle|mpadded|mphantom|mfenced"
)
_KEPT = re.compile(
    "mathvariant|stretchy|fence|separator|columnalign|linethickness|form|lspace|rspace|width|"
    "displaystyle"
)
_ENTITY = re.compile(r"&(?!(?:amp|lt|gt|quot|apos|#\d+|#x[0-9a-fA-F]+);)(\w+);")

_TIMES = '<mo lspace="0.1em" rspace="0.1em">\u2062</mo>'
_INFIX = re.compile(r'(</(?!mspace)\w+>)<mo form="infix">')  # the place says so already


def display(source: str | None) -> str:
    """A displayed formula, or the source as words where it is no presentation MathML."""
    if not source:
        return ""
    text = _ENTITY.sub(lambda match: unescape(match[0]), source)
    try:
        root = ET.fromstring(text)
    except ET.ParseError:
        try:
            root = ET.fromstring(f"<mrow>{text}</mrow>")
        except ET.ParseError:
            return f"<code>{escape(source)}</code>"
    if any(not _ALLOWED.fullmatch(_tag(element)) for element in root.iter()):
        return f"<code>{escape(source)}</code>"
    inner = "".join(_written(child) for child in root) if _tag(root) == "math" else _written(root)
    return f'<math display="block">{inner}</math>'


def inline(formula: str) -> str:
    """A displayed formula as HTML has it, which is shorter; the page's style spaces products."""
    return _INFIX.sub(r"\1<mo>", formula.replace(_TIMES, "<mo class=x>\u2062</mo>"))


def together(formulas: Sequence[str]) -> str:
    """Displayed formulas as one, each on a line of its own."""
    lines = (formula[formula.index(">") + 1 :].removesuffix("</math>") for formula in formulas)
    rows = "".join(f"<mtr><mtd>{line}</mtd></mtr>" for line in lines)
    return f'<math display="block"><mtable displaystyle="true">{rows}</mtable></math>'


def _tag(element: ET.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _written(element: ET.Element) -> str:
    """The element; mfenced, which browsers have dropped, becomes a row with fences."""
    tag, children = _tag(element), [_written(child) for child in element]
    if tag == "mfenced":
        left, right = element.get("open", "("), element.get("close", ")")
        inner = "<mo>,</mo>".join(children)
        return f"<mrow><mo>{escape(left)}</mo>{inner}<mo>{escape(right)}</mo></mrow>"
    text = escape((element.text or "").strip(), quote=False)
    if tag == "mrow" and len(children) == 1 and not text:
        return children[0]
    kept = "".join(f' {k}="{escape(v)}"' for k, v in element.attrib.items() if _KEPT.fullmatch(k))
    return f"<{tag}{kept}>{text}{''.join(children)}</{tag}>"
