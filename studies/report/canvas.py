"""What every figure shares: type, the grid of panels, log axes and their ticks."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any

from .palette import GRID, INK, MUTED, PAPER
from .svg import inline_panels
from .wording import in_tens

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RC: Any = {
    "svg.fonttype": "path",
    "svg.hashsalt": "discmech",
    "font.family": ["STIXGeneral", "DejaVu Serif"],
    "text.parse_math": False,
    "font.size": 8.5,
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
}


@dataclass(frozen=True)
class Panel:
    """One small multiple: its heading, what its axes show, how it is drawn."""

    title: str
    subtitle: str
    xlabel: str
    spoken: str
    draw: Callable[[Axes], None]


@dataclass(frozen=True)
class Sheet:
    """Sizes in inches of a panel and its margins, and how many stand side by side."""

    width: float = 3.0
    height: float = 2.45
    left: float = 0.46
    right: float = 0.98
    top: float = 0.42
    bottom: float = 0.42
    columns: int = 3


@dataclass(frozen=True)
class Drawing:
    """A rendered figure: whole as SVG and PNG, and its panels for the page."""

    svg: bytes
    png: bytes
    panels: list[str]
    width: float
    columns: int


def round_off(digits: int) -> float:
    """The unit of round-off: the largest relative error of a rounding at a precision."""
    return 2.0**-53 if digits <= 16 else 10.0 ** (1 - digits) / 2


def render(panels: Sequence[Panel], sheet: Sheet, definitions: dict[str, str]) -> Drawing:
    """Draw the panels on one sheet. Markers and styles of the page go into `definitions`."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = max(1, min(sheet.columns, len(panels)))
    width, height = columns * sheet.width, math.ceil(len(panels) / columns) * sheet.height
    cells, scales = [], []
    with matplotlib.rc_context(_RC):
        figure = Figure(figsize=(width, height), facecolor=PAPER)
        FigureCanvasAgg(figure)
        for index, panel in enumerate(panels):
            line, column = divmod(index, columns)
            x, y = column * sheet.width, height - (line + 1) * sheet.height
            rectangle = (
                (x + sheet.left) / width,
                (y + sheet.bottom) / height,
                (sheet.width - sheet.left - sheet.right) / width,
                (sheet.height - sheet.top - sheet.bottom) / height,
            )
            axes = figure.add_axes(rectangle)
            _dress(axes, panel, sheet)
            panel.draw(axes)
            scales.append(_scales(axes))
            cells.append((72 * x, 72 * line * sheet.height, 72 * sheet.width, 72 * sheet.height))
        svg, words, png = BytesIO(), BytesIO(), BytesIO()
        about = {"Date": None, "Creator": "discmech"}
        figure.savefig(svg, format="svg", metadata=about)
        quick = {"compress_level": 4}  # for 1 % of the size
        figure.savefig(png, dpi=200, metadata={"Software": "discmech"}, pil_kwargs=quick)
        with matplotlib.rc_context({"svg.fonttype": "none"}):  # the page has fonts of its own
            figure.savefig(words, format="svg", metadata=about)
    spoken = [panel.spoken for panel in panels]
    inline = inline_panels(words.getvalue(), cells, spoken, scales, definitions)
    return Drawing(svg.getvalue(), png.getvalue(), inline, sheet.width, columns)


def _scales(axes: Axes) -> str:
    """Of x and y: [first place, last place, number there, number there, logarithmic], as JSON.

    Places are in points of the sheet, downwards from its upper edge as SVG has them.
    """
    box, point = axes.bbox, 72 / axes.figure.dpi
    top = axes.figure.bbox.height
    found = []
    for axis, places, ends in (
        (axes.xaxis, (box.x0, box.x1), axes.get_xlim()),
        (axes.yaxis, (top - box.y0, top - box.y1), axes.get_ylim()),
    ):
        numbers = [float(f"{end:.7g}") for end in ends]
        log = int(axis.get_scale() == "log")
        found.append([*(round(point * place, 2) for place in places), *numbers, log])
    return json.dumps(found, separators=(",", ":"))


def _dress(axes: Axes, panel: Panel, sheet: Sheet) -> None:
    """Headings, spines and background of a panel."""
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
    axes.annotate(panel.title, xytext=(shift, 17), **at, **place)
    small: dict[str, Any] = {"xy": (0, 1), "fontsize": 8, "color": MUTED}
    axes.annotate(panel.subtitle, xytext=(shift, 7), **small, **place)
    axes.set_xlabel(panel.xlabel, fontsize=8, color=MUTED, labelpad=1.5)
    tall = 72 * (sheet.height - sheet.top - sheet.bottom)
    axes.xaxis.set_label_coords(0.5, -15.5 / tall)  # fixed: matplotlib need not measure the ticks
    axes.yaxis.set_label_coords(0, 0.5)
    axes.tick_params(labelsize=7.5, pad=2)


def log_limits(values: Iterable[float], pad: float = 0.07, least: float = 1.0) -> Any:
    """Limits around positive values on a log axis, at least `least` decades apart."""
    logs = [math.log10(value) for value in values if value > 0] or [-1.0, 0.0]
    low, high = min(logs), max(logs)
    if high - low < least:
        middle = (low + high) / 2
        low, high = middle - least / 2, middle + least / 2
    space = pad * (high - low)
    return 10.0 ** (low - space), 10.0 ** (high + space)


def log_axis(axes: Axes, which: str, limits: tuple[float, float], most: int = 5) -> None:
    """A log axis with few, round ticks: decades where there are two, else 1–2–5."""
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
    """A remark in the middle of a panel that has nothing to draw."""
    import textwrap

    axes.set_xticks([])
    axes.set_yticks([])
    text = textwrap.fill(words, 34)
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=MUTED)
