"""From matplotlib's SVG to SVG for the page: panels apart, colours of the theme, shared styles."""

from __future__ import annotations

import hashlib
import re
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
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
OWN = ("font-family",)  # properties for which the page has a value of its own
AREA = 100  # numbers in a shape from which on it is a band or a region, not a mark
_COLOUR = re.compile(r"#[0-9a-fA-F]{6}\b")
_NUMBER = re.compile(r"-?[\d.]+(?:e-?\d+)?")
_COMMAND = re.compile(r"([MLCQz])([^MLCQz]*)")
_REFERENCE = re.compile(r"url\(#([^)]+)\)")
_LEVELS = re.compile("([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+|[₀₁₂₃₄₅₆₇₈₉]+)")
_RAISED = "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"
_FLAT = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹₀₁₂₃₄₅₆₇₈₉", "−01234567890123456789")
_HREF = "{http://www.w3.org/1999/xlink}href"
_NAME = re.compile("\ue000[0-9a-f]{10}")  # begins with a letter that no text has


def inline_panels(
    svg: bytes,
    cells: Sequence[tuple[float, float, float, float]],
    spoken: Sequence[str],
    scales: Sequence[str],
    definitions: dict[str, str],
) -> list[str]:
    """The n-th axes of the drawing as an SVG of its own, cropped to the n-th cell (in points).

    scales: how places on its axes become numbers, as JSON. The drawing has its words as text.
    Marks, styles and clipping paths are moved to `definitions` (name → element), named by their
    content, so that a page holds each of them once and no two panels quarrel about a name. The
    marks of a series are the corners of one path of the class "marks", from which numbers can be
    read; lines are true to 0.05 points, a tenth of a pixel.
    """
    root = ET.fromstring(svg)
    defined = {e.get("id", ""): e for d in root.iter(f"{_ns(root)}defs") for e in d}
    groups = {e.get("id"): e for e in root.iter() if (e.get("id") or "").startswith("axes_")}
    found = []
    for index, (cell, words, scale) in enumerate(zip(cells, spoken, scales, strict=True)):
        x, y, *size = cell
        body = _Writer(defined, definitions, x, y).panel(groups[f"axes_{index + 1}"])
        box = " ".join(_short(edge) for edge in size)
        head = f'<svg class="plot" viewBox="0 0 {box}" role="img" data-axes="{scale}" '
        found.append(f'{head}aria-label="{escape(words)}">{body}</svg>')
    return found


def short_names(page: str) -> str:
    """The page with names of styles, marks and clipping paths as short as it allows."""
    often = Counter(_NAME.findall(page)).most_common()
    names = {name: f"k{k}" for k, (name, _) in enumerate(often)}
    return _NAME.sub(lambda match: names[match[0]], page)


@dataclass
class _Item:
    """Something that is drawn. joins: what is drawn next in the same style may become its part."""

    tag: str
    attributes: dict[str, str]
    inner: str
    joins: bool = False

    def text(self) -> str:
        if self.tag == "path":
            return _element("path", {**self.attributes, "d": self.inner}, "")
        return _element(self.tag, self.attributes, self.inner)


@dataclass
class _Writer:
    """Writes what is drawn, measured from a corner, without superfluous groups."""

    defined: Mapping[str, ET.Element]
    definitions: dict[str, str]
    left: float
    top: float

    def panel(self, group: ET.Element) -> str:
        """All that is in a group; neighbouring lines or marks of one style are one path."""
        found: list[_Item] = []
        for item in self._items(group, {}, axis=False):
            last = found[-1] if found else None
            if last and last.joins and item.joins and last.attributes == item.attributes:
                last.inner += item.inner
            else:
                found.append(item)
        return "".join(item.text() for item in found)

    def _items(self, element: ET.Element, outer: dict[str, str], axis: bool) -> Iterator[_Item]:
        """What an element draws in the style that it inherits; definitions draw nothing."""
        tag = _tag(element)
        style = outer | _style(element)
        if clip := _REFERENCE.search(element.get("clip-path", "")):
            style["clip-path"] = f"url(#{self._clip(clip[1])})"
        if tag == "path":
            yield self._path(element.get("d", ""), style)
        elif tag == "use":
            yield self._used(element, style, axis)
        elif tag == "text":
            yield _Item(tag, self._class(style) | self._placed(element), self._words(element))
        elif tag == "g" and "transform" in element.attrib:  # the letters of a formula
            inner = _Writer(self.defined, self.definitions, 0, 0)
            body = "".join(inner.panel(child) for child in element)
            yield _Item(tag, self._class(style) | self._placed(element), body)
        elif tag == "g":
            whole = (element.get("id") or "").startswith("matplotlib.axis")
            inside = (i for child in element for i in self._items(child, style, axis or whole))
            # nothing of an axis covers anything else of it
            yield from sorted(inside, key=lambda i: str(i.attributes)) if whole else inside

    def _path(self, d: str, style: dict[str, str], x: float = 0, y: float = 0) -> _Item:
        """Lines with their first corner at (x, y) if it is at the origin of `d`."""
        lucid = style.get("fill") != "none" or "opacity" in style  # it is seen where two overlap
        return _Item("path", self._class(style), route(d, x - self.left, y - self.top), not lucid)

    def _used(self, element: ET.Element, style: dict[str, str], axis: bool) -> _Item:
        """A mark; what is no mark is drawn where it stands: ticks, and areas that are used once."""
        shape = self.defined[element.get(_HREF, "")[1:]]
        x, y = float(element.get("x", 0)), float(element.get("y", 0))
        d, own = shape.get("d", ""), _style(shape)
        if axis or len(_NUMBER.findall(d)) > AREA:
            return self._path(d, {"fill": "none", **style, **own} if axis else style | own, x, y)
        clip = {key: style.pop(key) for key in ("clip-path",) if key in style}
        drawn = _element("path", {"d": route(d, 0, 0, 0.01), "style": _css(style | own)}, "")
        name = _name(drawn)
        marker = _element("marker", {"id": name, "markerUnits": "userSpaceOnUse"}, drawn)
        self.definitions[name] = marker
        kind = self._class({"fill": "none", "marker": f"url(#{name})", **clip})
        kind["class"] += " marks"
        return _Item("path", kind, f"M{_short(x - self.left)} {_short(y - self.top)}", True)

    def _class(self, style: dict[str, str]) -> dict[str, str]:
        """The class of the page that stands for a style."""
        css = _css(style)
        if not css:
            return {}
        name = _name(css)
        self.definitions[name] = f"<style>.{name}{{{css}}}</style>"
        return {"class": name}

    def _clip(self, name: str) -> str:
        """The name of a clipping path, measured from the panel's corner."""
        (shape,) = self.defined[name]
        box = dict(shape.attrib) | self._placed(shape)
        inner = _element(_tag(shape), box, "")
        key = _name(inner)
        self.definitions[key] = _element("clipPath", {"id": key}, inner)
        return key

    def _placed(self, element: ET.Element) -> dict[str, str]:
        """Where an element stands, and how it is turned."""
        found = {}
        for key, edge in (("x", self.left), ("y", self.top)):
            if first := element.get(key, "").split()[:1]:  # a place for each letter: the first's
                found[key] = _short(float(first[0]) - edge)
        kind, _, rest = element.get("transform", "").partition("(")
        numbers = [float(n) for n in _NUMBER.findall(rest)]
        if kind == "translate":
            found["transform"] = f"translate({_short(numbers[0] - self.left)} "
            found["transform"] += f"{_short(numbers[1] - self.top)})"
        elif kind == "rotate" and numbers[0]:
            found["transform"] = f"rotate({_short(numbers[0])} {found['x']} {found['y']})"
        return found

    def _words(self, element: ET.Element) -> str:
        """A text; of the letters of a formula those with one style on one line stand together.

        Matplotlib writes a formula letter by letter, sorted by style: what is raised comes last.
        """
        if element.text and element.text.strip():
            return _levels(element.text)
        spans: list[tuple[dict[str, str], str]] = []
        for child in sorted(element, key=lambda letter: float(letter.get("x", 0))):
            place = self._placed(child)
            here = self._class(_style(child)) | {"y": place.get("y", "0")}
            if spans and here.items() <= spans[-1][0].items():
                spans[-1] = (spans[-1][0], spans[-1][1] + (child.text or ""))
            else:
                spans.append(({"x": place.get("x", "0"), **here}, child.text or ""))
        return "".join(_element("tspan", a, escape(words)) for a, words in spans)


def _ns(root: ET.Element) -> str:
    return root.tag.rpartition("}")[0] + "}"


def _tag(element: ET.Element) -> str:
    return element.tag.rpartition("}")[2]


def _name(content: str) -> str:
    return "\ue000" + hashlib.sha256(content.encode()).hexdigest()[:10]


def _element(tag: str, attributes: Mapping[str, str], inner: str) -> str:
    written = "".join(f' {key}="{escape(value)}"' for key, value in attributes.items())
    return f"<{tag}{written}>{inner}</{tag}>" if inner else f"<{tag}{written}/>"


def _style(element: ET.Element) -> dict[str, str]:
    """Properties of an element, without those that are the page's."""
    pairs = (entry.partition(":") for entry in element.get("style", "").split(";"))
    found = {key.strip(): value.strip() for key, _, value in pairs}
    return {key: value for key, value in found.items() if value and key not in OWN}


def _css(style: Mapping[str, str]) -> str:
    """Properties as a page has them, in colours of the theme."""
    return _COLOUR.sub(_themed, ";".join(f"{k}:{v}" for k, v in sorted(style.items())))


def _themed(match: re.Match[str]) -> str:
    name = THEME.get(match[0].lower())
    return f"var(--{name})" if name else match[0]


def _levels(text: str) -> str:
    """Words with what is raised or lowered as the page sets it: few fonts have such letters."""
    found, after = "", ""
    for word in filter(None, _LEVELS.split(text)):
        if _LEVELS.fullmatch(word):
            shift, after = ("-.5em", ".35em") if word[0] in _RAISED else (".3em", "-.21em")
            found += _element("tspan", {"class": "level", "dy": shift}, word.translate(_FLAT))
        else:
            found += _element("tspan", {"dy": after}, escape(word)) if after else escape(word)
            after = ""
    return found


def route(d: str, dx: float, dy: float, unit: float = 0.1) -> str:
    """A path moved by (dx, dy): straight lines as steps of whole units, curves to hundredths."""
    found: list[tuple[str, list[float]]] = []
    x, y = 0, 0
    for letter, rest in _COMMAND.findall(d):
        numbers = [float(n) + (dx, dy)[k % 2] for k, n in enumerate(_NUMBER.findall(rest))]
        before = (x, y)
        if numbers:
            x, y = (round(n / unit) for n in numbers[-2:])
        across, down = unit * (x - before[0]), unit * (y - before[1])
        if letter == "M":
            found.append(("M", [unit * x, unit * y]))
        elif letter != "L":
            found.append((letter, numbers))
        elif across and down:
            found.append(("l", [across, down]))
        elif across or down:
            way, step = ("h", across) if across else ("v", down)
            if found[-1][0] == way and found[-1][1][0] * step > 0:
                step += found.pop()[1][0]
            found.append((way, [step]))
    text, last = "", ""
    for letter, numbers in found:
        text += "" if letter == last and letter == "l" else letter
        for word in map(_short, numbers):
            text += word if text[-1].isalpha() or word[0] == "-" else f" {word}"
        last = letter
    return text


def _short(value: float) -> str:
    """A number of at most two decimals, as short as it can be written."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else re.sub(r"^(-?)0\.", r"\1.", text)
