"""Convert matplotlib's SVG for the page: separate panels, theme colours, shared styles."""

from __future__ import annotations

import hashlib
import re
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Sequence
from html import escape

from .palette import THEME

_COLOUR = re.compile(r"#[0-9a-fA-F]{6}\b")
_NUMBER = re.compile(r"-?\d+\.\d+(?:e-?\d+)?")
_COMMAND = re.compile(r"([MLCQz])([^MLCQz]*)")
_STEP = re.compile(r" (?=-)")
_QUOTED = re.compile("[\\s\"'=<>`&]")  # characters that HTML must quote
SMALL = 1000  # longest path, in letters, that counts as a mark and not as a region
_REFERENCE = re.compile(r"#([^)]+)")
_NAME = re.compile("\ue000[0-9a-f]{10}")  # begins with a letter that no text contains


def inline_panels(
    svg: bytes,
    cells: Sequence[tuple[float, float, float, float]],
    spoken: Sequence[str],
    scales: Sequence[str],
    definitions: dict[str, str],
) -> list[str]:
    """Return the n-th axes of the drawing as an SVG, cropped to the n-th cell (in points).

    scales: conversions from places on its axes to numbers, as JSON. Words in the drawing stay text.
    Marks, styles and clipping paths are moved to `definitions` (name → element) and named by their
    content, so that a page contains each once and no two panels conflict. Marks are `use` elements
    outside of axes, from whose places numbers can be read; lines are accurate to 0.05 points, a
    tenth of a pixel.
    """
    root = ET.fromstring(svg)
    groups = {element.get("id"): element for element in root.iter()}
    drawings = []
    for index, (cell, words, scale) in enumerate(zip(cells, spoken, scales, strict=True), 1):
        box = " ".join(f"{edge:g}" for edge in cell)
        head = f'<svg class="plot" viewBox="{box}" role="img" data-axes="{scale}" '
        body = _joined(_written(groups[f"axes_{index}"], definitions))
        drawings.append(f'{head}aria-label="{escape(words)}">{body}</svg>')
    for element in root.findall(".//{*}defs"):
        _written(element, definitions)
    return drawings


def short_names(page: str) -> str:
    """Return the page with the shortest possible names of styles, marks and clipping paths."""
    often = Counter(_NAME.findall(page)).most_common()
    names = {name: f"k{k}" for k, (name, _) in enumerate(often)}
    return _NAME.sub(lambda match: names[match[0]], page)


def _written(element: ET.Element, definitions: dict[str, str], defined: bool = False) -> list[str]:
    """Return the drawing of an element without superfluous groups; move its definitions away."""
    tag, attributes = element.tag.rpartition("}")[2], {}
    if tag == "defs":
        for shape in element:
            if name := shape.get("id"):
                definitions[_name(name)] = "".join(_written(shape, definitions, defined=True))
        return []
    for key, value in element.attrib.items():
        if key == "style":
            name = attributes["class"] = _name(value)
            definitions[name] = f"<style>.{name}{{{_COLOUR.sub(_themed, value)}}}</style>"
        elif key == "id":
            if defined:
                attributes["id"] = _name(value)
            elif value.startswith("matplotlib.axis"):
                attributes["class"] = "axis"
        elif key.endswith(("href", "clip-path")):
            attributes[key.rpartition("}")[2]] = _REFERENCE.sub(lambda m: f"#{_name(m[1])}", value)
        elif key == "d":
            attributes[key] = _route(value, 100 if defined and len(value) < SMALL else 10)
        elif not value.startswith("rotate(-0 "):
            attributes[key] = _NUMBER.sub(lambda m: _short(float(m[0])), value)
    inner = [part for child in element for part in _written(child, definitions, defined)]
    if tag == "g":
        if not attributes:
            return inner
        if attributes.get("class") == "axis":  # no part of it covers another part
            inner.sort()
        heads = {part.partition(" href=")[0] for part in inner}
        if len(heads) == 1 and (head := heads.pop()).startswith("<use class="):
            attributes["class"] = head.partition("=")[2]
            inner = [part.replace(head, "<use", 1) for part in inner]
    text = escape((element.text or "").strip(), quote=False) + _joined(inner)
    drawn = f"<{tag}" + "".join(
        f' {key}="{escape(value)}"' if key == "d" or _QUOTED.search(value) else f" {key}={value}"
        for key, value in sorted(attributes.items())
    )
    if text:
        return [f"{drawn}>{text}</{tag}>"]
    return [drawn + ("/>" if drawn.endswith('"') else " />")]


def _joined(parts: Sequence[str]) -> str:
    """Join neighbouring paths of one style."""
    paths: list[str] = []
    for part in parts:
        head, d, route = part.partition(' d="')
        if paths and head.startswith("<path") and paths[-1].startswith(head + d):
            paths[-1] = paths[-1].removesuffix('"/>') + route
        else:
            paths.append(part)
    return "".join(paths)


def _name(content: str) -> str:
    return "\ue000" + hashlib.sha256(content.encode()).hexdigest()[:10]


def _themed(match: re.Match[str]) -> str:
    name = THEME.get(match[0].lower())
    return f"var(--{name})" if name else match[0]


def _route(d: str, unit: int) -> str:
    """Return a path in relative steps, with `unit` steps to a point."""
    path, before, start = "", (0, 0), (0, 0)
    for letter, rest in _COMMAND.findall(d):
        if letter == "z":
            path, before = path + "z", start
            continue
        numbers = [round(unit * float(n)) for n in rest.split()]
        steps = [(n - before[k % 2]) / unit for k, n in enumerate(numbers)]
        before = (numbers[-2], numbers[-1])
        if letter == "M":
            steps, start = [n / unit for n in numbers], before
        path += letter if letter == "M" else letter.lower()
        path += _STEP.sub("", " ".join(map(_short, steps)))
    return path


def _short(value: float) -> str:
    """Return a number with at most two decimals, as short as possible."""
    return re.sub(r"^(-?)0\.", r"\1.", f"{round(value, 2):g}") if value else "0"
