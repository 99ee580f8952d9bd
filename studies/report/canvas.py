"""Common parts of all figures: type, the grid of panels, log axes and their ticks."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from html import unescape
from io import BytesIO
from typing import TYPE_CHECKING, Any

from .labels import broken
from .palette import CYCLE, GRID, INK, MUTED, PAPER
from .svg import inline_panels
from .wording import in_tens

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: the formats of a figure's files, by their endings
FORMATS = ("svg", "pdf", "png")
#: names and values of matplotlib's rcParams
Style = Sequence[tuple[str, Any]]
#: inches kept free beside the longest word, since other fonts are a little wider
SPARE = 0.06
LINE = 1.2  # of the size of type: the distance of matplotlib's lines
LEAST = 1.2  # least width of axes in inches, in a figure with a requested width
#: the fonts of a figure, and common fonts with the same widths for SVG text
_FAMILIES = (
    "'STIXGeneral', 'DejaVu Serif'",
    "STIXGeneral, 'STIX Two Text', 'Times New Roman', Times, 'Liberation Serif', Tinos, "
    "'DejaVu Serif', serif",
)
_TEXT = re.compile(r'<text style="([^"]*)"([^>]*)>([^<]*)<')

_RC: Any = {
    "svg.fonttype": "none",  # text stays text: it can be searched, edited and read aloud
    "pdf.fonttype": 42,  # as TrueType, for the same reason
    "svg.hashsalt": "discmech",
    "font.family": ["STIXGeneral", "DejaVu Serif"],
    "text.parse_math": False,
    "font.size": 8.5,
    "axes.prop_cycle": f"cycler(color={CYCLE})",
    "axes.linewidth": 0.6,
    "axes.edgecolor": MUTED,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "path.simplify": False,
    "axes.formatter.limits": (-3, 4),  # beyond, ticks have a power of ten in common,
    "axes.formatter.useoffset": False,  # and never a number that is added
}


@dataclass(frozen=True)
class Panel:
    """One small multiple: heading, axis label, spoken description, drawing function."""

    title: str
    subtitle: str
    xlabel: str
    spoken: str
    draw: Callable[[Axes], None]


@dataclass(frozen=True)
class Sheet:
    """Sizes in inches of a panel and its margins, and the number of columns."""

    width: float = 3.0
    height: float = 2.45
    left: float = 0.46
    right: float = 0.98
    top: float = 0.42
    bottom: float = 0.42
    columns: int = 3


@dataclass(frozen=True)
class Drawing:
    """A rendered figure: whole, as files by their endings, and its panels for the page."""

    files: dict[str, bytes]
    panels: list[str]
    width: float
    columns: int


def round_off(digits: int) -> float:
    """Return the unit of round-off: the largest relative error of a rounding at a precision."""
    return 2.0**-53 if digits <= 16 else 10.0 ** (1 - digits) / 2


def our_style(style: Style = ()) -> AbstractContextManager[None]:
    """Return a context in which matplotlib draws in our style, or with these entries instead."""
    import matplotlib

    return matplotlib.rc_context(_RC | dict(style))


def figure_of(panels: Sequence[Panel], sheet: Sheet, style: Style = ()) -> Figure:
    """Return the panels as a matplotlib figure with a canvas, to be changed or saved."""
    with our_style(style):
        return _laid_out(panels, *_sized(panels, sheet, style))[0]


def render(
    panels: Sequence[Panel],
    sheet: Sheet,
    definitions: dict[str, str],
    style: Style = (),
    formats: Sequence[str] = FORMATS[:1],
) -> Drawing:
    """Draw the panels on one sheet. Markers and styles of the page go into `definitions`.

    style: entries of matplotlib's rcParams that replace ours; only the width of figure.figsize is
    used, as that of a paper's column. formats: SVG, of which the panels are made, and any other.
    """
    with our_style(style):
        sheet, columns, room = _sized(panels, sheet, style)
        figure, fitted = _laid_out(panels, sheet, columns, room)
        scales = [_scales(axes) for axes in figure.axes]
        files = _files_of(figure, formats)
    width, height = 72 * fitted.width, 72 * fitted.height
    cells = [
        (width * (k % columns), height * (k // columns), width, height) for k in range(len(panels))
    ]
    spoken = [panel.spoken for panel in panels]
    inline = inline_panels(files["svg"], cells, spoken, scales, definitions)
    files["svg"] = _for_any_serif(files["svg"])
    return Drawing(files, inline, fitted.width, columns)


def files_of(figure: Figure) -> dict[str, bytes]:
    """Return a figure in our style as the files of a study's figure, by their endings."""
    with our_style():
        files = _files_of(figure, FORMATS)
    return files | {"svg": _for_any_serif(files["svg"])}


def _for_any_serif(svg: bytes) -> bytes:
    """Return an SVG whose words fit where its reader has none of our fonts.

    Each text says how wide it is in the font that it was laid out with: a viewer without that font
    makes its letters narrower, in place of words that are cut at an edge.
    """
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    def wide(match: re.Match[str]) -> str:
        style, rest, words = match.groups()
        font = FontProperties(
            family=re.findall(r"font-family: ([^;]+)", style)[0].replace("'", "").split(", "),
            style="italic" if "font-style: italic" in style else "normal",
            weight=700 if "font-weight: 700" in style else 400,
            size=float(re.findall(r"font-size: ([0-9.]+)px", style)[0]),
        )
        width = text_to_path.get_text_width_height_descent(unescape(words), font, False)[0]
        return (
            f'<text style="{style}"{rest} textLength="{width:.1f}" '
            f'lengthAdjust="spacingAndGlyphs">{words}<'
        )

    return _TEXT.sub(wide, svg.decode()).replace(*_FAMILIES).encode()


def _files_of(figure: Figure, formats: Sequence[str]) -> dict[str, bytes]:
    """Return the figure in these formats, without dates."""
    settings: dict[str, Any] = {
        "svg": {"metadata": {"Creator": "discmech", "Date": None}},
        "pdf": {"metadata": {"Creator": "discmech", "CreationDate": None}},
        # that level of compression costs 1 % of the size
        "png": {"metadata": {"Software": "discmech"}, "dpi": 200,
                "pil_kwargs": {"compress_level": 4}},
    }  # fmt: skip
    files = {ending: BytesIO() for ending in formats}
    for ending, file in files.items():
        figure.savefig(file, format=ending, **settings[ending])
    return {ending: file.getvalue() for ending, file in files.items()}


def _sized(panels: Sequence[Panel], sheet: Sheet, style: Style) -> tuple[Sheet, int, float | None]:
    """Return the sheet, the number of columns and the room for words beside the axes.

    They are fitted to the width that the style requests. Words keep their size, so axes shrink,
    down to `LEAST`; then words are broken, and a figure with longer ones is wider.
    """
    columns = max(1, min(sheet.columns, len(panels)))
    asked = dict(style).get("figure.figsize")
    if asked is None:
        return sheet, columns, None
    room = math.inf
    fitted = _laid_out(panels, sheet, columns, room)[1]
    least = fitted.left + fitted.right + LEAST
    if least > asked[0]:
        room = asked[0] - fitted.left - LEAST - SPARE
        fitted = _laid_out(panels, sheet, columns, room)[1]
        least = fitted.left + fitted.right + LEAST
    columns = max(1, min(len(panels), int(asked[0] / least)))
    return replace(fitted, width=max(least, asked[0] / columns)), columns, room


def _laid_out(
    panels: Sequence[Panel], sheet: Sheet, columns: int, room: float | None = None
) -> tuple[Figure, Sheet]:
    """Return the panels drawn on a sheet whose margins fit every word, and that sheet.

    The size of the axes is fixed, so the drawing does not change when the margins grow: words are
    measured once, after everything is drawn. room: inches for words beside the axes, if the width
    of the sheet is requested; headings are then broken to that width.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from .shown_figure import Figure

    lines = math.ceil(len(panels) / columns)
    figure = Figure(facecolor=PAPER)
    figure.room = math.inf if room is None else room
    canvas = FigureCanvasAgg(figure)
    for index in range(len(panels)):
        figure.add_axes((0, 0, 1, 1), label=str(index))
    _place(figure, sheet, columns, lines)
    for axes, panel in zip(figure.axes, panels, strict=True):
        title, subtitle = _dress(axes, panel, sheet)
        panel.draw(axes)
        _tell_powers(axes, panel, subtitle)
        if room is not None:
            _break_headings(title, subtitle, sheet)
    low = figure.tall / 72 - (sheet.height - sheet.top - sheet.bottom)
    if low > 0.01:  # words need higher axes, in which all is drawn anew
        return _laid_out(panels, replace(sheet, height=sheet.height + low), columns, room)
    needed = [_margins(axes, canvas.get_renderer()) for axes in figure.axes]
    named = ("left", "right", "top", "bottom")
    most = [max(sides) for sides in zip(*needed, strict=True)]
    grown = {side: max(getattr(sheet, side), at) for side, at in zip(named, most, strict=True)}
    fitted = replace(
        sheet, **grown,
        width=sheet.width + grown["left"] + grown["right"] - sheet.left - sheet.right,
        height=sheet.height + grown["top"] + grown["bottom"] - sheet.top - sheet.bottom,
    )  # fmt: skip
    _place(figure, fitted, columns, lines)
    return figure, fitted


def _place(figure: Figure, sheet: Sheet, columns: int, lines: int) -> None:
    """Give the figure the sheet's size and every axes its cell, line by line."""
    width, height = columns * sheet.width, lines * sheet.height
    figure.set_size_inches(width, height)
    for index, axes in enumerate(figure.axes):
        x = index % columns * sheet.width + sheet.left
        y = height - (index // columns + 1) * sheet.height + sheet.bottom
        size = (sheet.width - sheet.left - sheet.right, sheet.height - sheet.top - sheet.bottom)
        axes.set_position((x / width, y / height, size[0] / width, size[1] / height))


def _margins(axes: Axes, renderer: Any) -> tuple[float, float, float, float]:
    """Return the space in inches that an axes needs at its left, right, upper and lower side."""
    figure: Any = axes.figure
    cell = axes.get_position(original=True).transformed(figure.transFigure)
    shown = axes.get_tightbbox(renderer)
    if shown is None:
        return 0.0, 0.0, 0.0, 0.0
    beyond = (cell.x0 - shown.x0, shown.x1 - cell.x1, shown.y1 - cell.y1, cell.y0 - shown.y0)
    left, right, top, bottom = (most / figure.dpi + SPARE for most in beyond)
    return left, right, top, bottom


def _scales(axes: Axes) -> str:
    """Return, for x and y, [first place, last place, number there, number there, logarithmic] as
    JSON.

    Places are in points of the sheet, downwards from its upper edge as in SVG.
    """
    box, point = axes.bbox, 72 / axes.figure.dpi
    top = axes.figure.bbox.height
    scales = []
    for axis, places, ends in (
        (axes.xaxis, (box.x0, box.x1), axes.get_xlim()),
        (axes.yaxis, (top - box.y0, top - box.y1), axes.get_ylim()),
    ):
        numbers = [float(f"{end:.7g}") for end in ends]
        log = int(axis.get_scale() == "log")
        scales.append([*(round(point * place, 2) for place in places), *numbers, log])
    return json.dumps(scales, separators=(",", ":"))


def _dress(axes: Axes, panel: Panel, sheet: Sheet) -> Any:
    """Draw headings, spines and background of a panel; return its title and its subtitle."""
    axes.set_facecolor("none")
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    place: dict[str, Any] = {
        "xycoords": "axes fraction",
        "textcoords": "offset points",
        "va": "baseline",
    }
    at: dict[str, Any] = {"xy": (0, 1), "fontsize": 9.5, "fontweight": "bold"}
    shift = -0.75 * 72 * sheet.left if sheet.left < 1 else -72 * sheet.left + 4
    title = axes.annotate(panel.title, xytext=(shift, 17), **at, **place)
    small: dict[str, Any] = {"xy": (0, 1), "fontsize": 8, "color": MUTED}
    subtitle = axes.annotate(panel.subtitle, xytext=(shift, 7), **small, **place)
    axes.set_xlabel(panel.xlabel, fontsize=8, color=MUTED, labelpad=1.5)
    tall = 72 * (sheet.height - sheet.top - sheet.bottom)
    # fixed, so that matplotlib need not measure the ticks
    axes.xaxis.set_label_coords(0.5, -15.5 / tall)
    axes.yaxis.set_label_coords(0, 0.5)
    axes.tick_params(labelsize=7.5, pad=2)
    return title, subtitle


def _break_headings(title: Any, subtitle: Any, sheet: Sheet) -> None:
    """Break the headings of a panel to its width; the title rises by the subtitle's lines."""
    for text in (title, subtitle):
        room = sheet.width - sheet.left - text.xyann[0] / 72 - SPARE
        font = {"fontsize": text.get_fontsize(), "fontweight": text.get_fontweight()}
        text.set_text(broken(text.figure, text.get_text(), room, **font))
    lines = subtitle.get_text().count("\n")
    shift, rise = title.xyann
    title.xyann = shift, rise + lines * subtitle.get_fontsize() * LINE


def _tell_powers(axes: Axes, panel: Panel, subtitle: Any) -> None:
    """Write what the ticks of an axis have in common beside its name, clear of all other words."""
    axes.apply_aspect()
    for axis, name, label in (
        (axes.xaxis, panel.xlabel, axes.xaxis.label),
        (axes.yaxis, panel.subtitle, subtitle),
    ):
        form: Any = axis.get_major_formatter()
        form.set_locs(axis.get_majorticklocs())
        axis.get_offset_text().set_visible(False)
        if power := form.get_offset().replace("−", "-"):
            label.set_text(f"{name}, in {in_tens(float(power))}")


def log_limits(values: Iterable[float], pad: float = 0.07, least: float = 1.0) -> Any:
    """Return limits around positive values on a log axis, at least `least` decades apart."""
    logs = [math.log10(value) for value in values if value > 0] or [-1.0, 0.0]
    low, high = min(logs), max(logs)
    if high - low < least:
        middle = (low + high) / 2
        low, high = middle - least / 2, middle + least / 2
    space = pad * (high - low)
    return 10.0 ** (low - space), 10.0 ** (high + space)


def log_axis(axes: Axes, which: str, limits: tuple[float, float], most: int = 5) -> None:
    """Make a log axis with few, round ticks: decades if there are two, else 1–2–5."""
    low, high = limits
    getattr(axes, f"set_{which}scale")("log")
    getattr(axes, f"set_{which}lim")(low, high)
    first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
    if last - first >= 1:
        for stride in (1, 2, 3, 4, 5, 10, 20, 50, 100):
            ticks = [10.0**k for k in range(first, last + 1) if k % stride == 0]
            if len(ticks) <= most:
                break
    else:
        ticks = [m * 10.0**k for k in range(first - 1, last + 1) for m in (1, 2, 5)]
        ticks = [tick for tick in ticks if low <= tick <= high]
    axis = getattr(axes, f"{which}axis")
    plain = all(0.01 <= tick < 10000 for tick in ticks)
    axis.set_ticks(ticks, labels=[f"{tick:g}" if plain else in_tens(tick) for tick in ticks])
    axis.set_ticks([], minor=True)
    axis.grid(visible=True, color=GRID, linewidth=0.4)
    axes.set_axisbelow(True)


def note(axes: Axes, words: str) -> None:
    """Write a remark in the middle of a panel that has nothing to draw."""
    import textwrap

    axes.set_xticks([])
    axes.set_yticks([])
    text = textwrap.fill(words, 34)
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=MUTED)
