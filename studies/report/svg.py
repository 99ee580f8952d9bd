"""From matplotlib's SVG to SVG for the page: panels apart, colours of the theme, shared styles."""

from __future__ import annotations

import hashlib
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from html import escape

# Colours of the drawing and the CSS variables that take their place on the page.
THEME = {
    "#1a1a1a": "ink",
    "#606060": "muted",
    "#d4d4d4": "grid",
    "#ffffff": "paper",
    "#0072b2": "blue",
    "#d55e00": "vermillion",
    "#009e73": "green",
    "#cc79a7": "purple",
    "#56b4e9": "sky",
    "#e69f00": "orange",
    "#005c8f": "blue-words",
    "#a84a00": "vermillion-words",
    "#00694d": "green-words",
    "#98467a": "purple-words",
    "#1b6a96": "sky-words",
    "#855c00": "orange-words",
    "#000000": "ink",
}
FONTS = re.compile(r"\s*font-family: [^;]*;?")  # the page has its own
_COLOUR = re.compile(r"#[0-9a-fA-F]{6}\b")
_DECIMAL = re.compile(r"-?\d+\.\d+")
_TRANSLATE = re.compile(r"translate\([^)]*\)")
_REFERENCE = re.compile(r"url\(#([^)]+)\)")
_HREF = "{http://www.w3.org/1999/xlink}href"


def inline_panels(
    svg: bytes,
    cells: Sequence[tuple[float, float, float, float]],
    spoken: Sequence[str],
    scales: Sequence[str],
    library: dict[str, str],
) -> list[str]:
    """The n-th axes of the drawing as an SVG of its own, cropped to the n-th cell (in points).

    scales: how places on its axes become numbers, as JSON. The drawing has its words as text.
    Markers and styles are moved to `library` (id → element), named by their content, so that a
    page holds each of them once and no two panels quarrel about a name.
    """
    root = ET.fromstring(svg)
    defined = {e.get("id", ""): e for d in root.iter(f"{_ns(root)}defs") for e in d}
    groups = {e.get("id"): e for e in root.iter() if (e.get("id") or "").startswith("axes_")}
    found = []
    for index, (cell, words, scale) in enumerate(zip(cells, spoken, scales, strict=True)):
        writer = _Writer(defined, library, f"{index} {words}")
        body = writer.text(groups[f"axes_{index + 1}"])
        own = f"<defs>{''.join(writer.own.values())}</defs>" if writer.own else ""
        box = " ".join(_round(f"{edge:.3f}") for edge in cell)
        head = f'<svg class="plot" viewBox="{box}" role="img" data-axes="{scale}" '
        head += f'aria-label="{escape(words)}">'
        found.append(f"{head}{own}{body}</svg>")
    return found


class _Writer:
    """Writes elements without namespaces, ids and superfluous groups."""

    def __init__(self, defined: dict[str, ET.Element], library: dict[str, str], panel: str) -> None:
        self.defined = defined
        self.library = library
        self.panel = panel
        self.own: dict[str, str] = {}

    def text(self, element: ET.Element) -> str:
        """An element and what it holds; definitions are dropped here and fetched when used."""
        tag = element.tag.rpartition("}")[2]
        if tag in ("defs", "metadata", "style"):
            return ""
        if tag == "text":
            return self._words(element)
        attributes = dict(element.attrib)
        attributes.pop("id", None)
        if _HREF in attributes:
            attributes["href"] = "#" + self._shared(attributes.pop(_HREF)[1:])
        if "clip-path" in attributes:
            attributes["clip-path"] = _REFERENCE.sub(self._clip, attributes["clip-path"])
        inner = "".join(self.text(child) for child in element)
        if tag == "g" and (not attributes or not inner):
            return inner
        return _element(tag, self._styled(attributes), inner)

    def _styled(self, attributes: dict[str, str]) -> dict[str, str]:
        """The attributes with a class of the page in place of the style."""
        style = _tidy("style", FONTS.sub("", attributes.pop("style", ""))).strip("; ")
        if not style:
            return attributes
        name = "s" + _digest(style)[:6]
        self.library[name] = f"<style>.{name}{{{style}}}</style>"
        return {"class": name, **attributes}

    def _words(self, element: ET.Element) -> str:
        """A text; of the letters of a formula those with one style on one line stand together.

        Matplotlib writes letter by letter, sorted by style: what is raised comes last.
        """
        attributes = dict(element.attrib)
        if re.match(r"rotate\(-?0 ", attributes.get("transform", "")):
            del attributes["transform"]
        spans: list[tuple[dict[str, str], str]] = []
        for child in sorted(element, key=lambda letter: float(letter.get("x", 0))):
            here = {k: child.get(k, "") for k in ("style", "y")}
            if spans and here == {k: spans[-1][0].get(k) for k in here}:
                spans[-1] = (spans[-1][0], spans[-1][1] + (child.text or ""))
            else:
                spans.append(({"x": child.get("x", "0"), **here}, child.text or ""))
        inner = escape(element.text or "") if not spans else ""
        inner += "".join(_element("tspan", self._styled(a), escape(words)) for a, words in spans)
        return _element("text", self._styled(attributes), inner)

    def _shared(self, name: str) -> str:
        """The page-wide name of a glyph or a marker."""
        content = dict(self.defined[name].attrib)
        content.pop("id", None)
        tag = self.defined[name].tag.rpartition("}")[2]
        key = "d" + _digest(_element(tag, content, ""))
        self.library[key] = _element(tag, {"id": key, **content}, "")
        return key

    def _clip(self, match: re.Match[str]) -> str:
        """The name of a clipping path, which stays in the panel: it is fixed to its place."""
        inner = "".join(self.text(child) for child in self.defined[match[1]])
        key = "c" + _digest(self.panel + inner)
        self.own[key] = _element("clipPath", {"id": key}, inner)
        return f"url(#{key})"


def _ns(root: ET.Element) -> str:
    return root.tag.rpartition("}")[0] + "}"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:10]


def _element(tag: str, attributes: dict[str, str], inner: str) -> str:
    written = "".join(f' {key}="{escape(_tidy(key, v))}"' for key, v in attributes.items())
    return f"<{tag}{written}>{inner}</{tag}>" if inner else f"<{tag}{written}/>"


def _tidy(key: str, value: str) -> str:
    """Shorter numbers, and colours of the theme instead of fixed ones."""
    if key == "style":
        value = value.replace("; ", ";").replace(": ", ":")
        return _COLOUR.sub(_themed, value)
    if key == "d":
        return " ".join(_DECIMAL.sub(lambda m: _round(m[0]), value).split())
    if key == "transform":
        return _TRANSLATE.sub(lambda m: _DECIMAL.sub(lambda n: _round(n[0]), m[0]), value)
    if key in ("x", "y", "width", "height"):
        value = " ".join(value.split()[:1])  # one place for the first letter of a span
        return _DECIMAL.sub(lambda m: _round(m[0]), value)
    return value


def _themed(match: re.Match[str]) -> str:
    name = THEME.get(match[0].lower())
    return f"var(--{name})" if name else match[0]


def _round(decimal: str) -> str:
    text = f"{float(decimal):.2f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
