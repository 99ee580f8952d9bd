"""All words of an exported figure are inside it, and none covers a neighbour's axes or words."""

import re
from itertools import combinations

import matplotlib
import pytest
from matplotlib.text import Text

from discmech import check
from discmech.studies.core.result import result_of
from discmech.studies.core.study import every_study
from discmech.studies.report import canvas
from discmech.studies.report.palette import ALIKE, marks
from tests.studies.cached_results import SMALL, charts_slowly
from tests.studies.fake_results import results

#: the longest names that built-in rules and scenes have
LONG = "kahan-li-8:average-vector-field"
TITLE = "Chain of Fermi, Pasta, Ulam and Tsingou, of stiff and of soft springs in turn"


def boxes(axes, renderer):
    """The box of each text that is shown; ticks outside of the axes' range are not."""
    hidden = set()
    for axis in (axes.xaxis, axes.yaxis):
        low, high = sorted(axis.get_view_interval())
        near = 1e-9 * (high - low)
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
            if not low - near <= tick.get_loc() <= high + near:
                hidden |= {tick.label1, tick.label2}
    shown = (t for t in axes.findobj(Text) if t.get_visible() and t.get_text().strip())
    return {t.get_text(): t.get_window_extent(renderer) for t in shown if t not in hidden}


def misplaced(sketch):
    """Words of a figure that are cut, that cover another panel's axes, or one another."""
    with matplotlib.rc_context(canvas._RC):
        columns = min(sketch.sheet.columns, len(sketch.panels))
        figure, _ = canvas._laid_out(sketch.panels, sketch.sheet, columns)
        figure.canvas.draw()
        words = [boxes(axes, figure.canvas.get_renderer()) for axes in figure.axes]
    found = []
    for own, texts in enumerate(words):
        for text, box in texts.items():
            if not (box.x0 >= 0 and box.y0 >= 0 and figure.bbox.x1 >= box.x1
                    and figure.bbox.y1 >= box.y1):  # fmt: skip
                found.append(f"{text!r} is cut")
            for other, axes in enumerate(figure.axes):
                if other != own and box.overlaps(axes.bbox):
                    found.append(f"{text!r} covers another panel")
        for (one, a), (two, b) in combinations(texts.items(), 2):
            wide = min(a.x1, b.x1) - max(a.x0, b.x0)
            high = min(a.y1, b.y1) - max(a.y0, b.y0)
            if wide > 1 and high > 2:  # pixels, of 100 an inch: letters have a little air
                found.append(f"{one!r} covers {two!r}")
    return found


def with_long_names(cases):
    """Results in which rules and scenes have long names."""
    return [{**case, "rule": f"{LONG}-{k}" if k else LONG} for k, case in enumerate(cases)]


def sketches(study, cases):
    shown = [result_of(study, case) for case in cases]
    known = marks(dict.fromkeys(case.method for case in shown))
    titles = {case.scene: TITLE for case in shown}
    return every_study()[study].view.sketches(shown, known, titles)


def all_misplaced(study, cases):
    return {s.name: wrong for s in sketches(study, cases) if s.panels and (wrong := misplaced(s))}


@pytest.mark.dear("order", "momentum")
@pytest.mark.parametrize("made", results(), ids=lambda made: made["study"])
def test_words_of_made_up_results_are_inside(made):
    by_scene = {}
    for case in made["cases"]:
        by_scene.setdefault((case["scene"], case["digits"]), []).append(case)
    some = [*by_scene.values()][:2]  # the scenes that follow have the same words
    assert not all_misplaced(made["study"], [c for own in some for c in with_long_names(own)])
    assert not all_misplaced(made["study"], [c for own in some for c in own])


@pytest.mark.slow
@pytest.mark.parametrize("study", [charts_slowly(name) for name in SMALL])
def test_words_of_measured_results_are_inside(study):
    scene, steps = SMALL[study]
    way = "reversible:" if study == "steps" else ""
    rules = [f"{way}midpoint", f"{way}trapezoidal"]
    found = check(study, [scene], rules, [16], steps=steps)
    assert not all_misplaced(study, with_long_names(found["cases"]))


def test_a_word_that_is_cut_is_seen():
    (made, *_) = results()
    (sketch, *_) = sketches(made["study"], with_long_names(made["cases"][:3]))
    fitted = canvas._laid_out
    try:  # the margins as they were asked for, whatever the words need
        canvas._laid_out = lambda *given: (fitted(*given)[0], given[1])
        figure, _ = fitted(sketch.panels, sketch.sheet, 1)
        canvas._place(figure, sketch.sheet, 1, len(sketch.panels))
        canvas._laid_out = lambda *given: (figure, given[1])
        assert any("is cut" in words for words in misplaced(sketch))
    finally:
        canvas._laid_out = fitted


@pytest.mark.slow
def test_text_of_an_exported_figure_is_text():
    (made, *_) = results()
    (sketch, *_) = sketches(made["study"], made["cases"])
    drawn = canvas.render(sketch.panels[:1], sketch.sheet, {}, formats=canvas.FORMATS).files
    svg = drawn["svg"].decode()
    assert re.search(r"<text[^>]*>midpoint", svg) and "Times New Roman" in svg
    assert drawn["pdf"].startswith(b"%PDF") and drawn["png"].startswith(b"\x89PNG")


def test_a_rule_keeps_its_mark_while_its_colour_is_free():
    alone = marks([LONG])[LONG]
    like = (alone.colour, ALIKE.get(alone.colour))
    free = [n for n in (f"my-rule-{k}" for k in range(9)) if marks([n])[n].colour not in like]
    assert marks([*free[:2], LONG])[LONG] == alone


@pytest.mark.parametrize("first", ["midpoint", "stoermer-verlet", "rectangle"])
def test_colours_of_five_rules_are_clearly_different(first):
    """Whatever their names: no two of them are both blue, or both of the reds."""
    usual = ["midpoint", "stoermer-verlet", "rectangle"]
    for k in range(40):
        names = list(dict.fromkeys([first, f"rule-{k}", f"other-{k}", *usual]))[:5]
        colours = [mark.colour for mark in marks(names).values()]
        assert len({min(c, ALIKE.get(c, c)) for c in colours}) == len(names) == 5


def test_no_two_rules_of_a_figure_have_one_colour_and_one_mark():
    """Whatever their names, while there are marks: of 26 rules some share letters' numbers."""
    names = [f"rule-{k}" for k in range(20)] + ["midpoint", "gauss-4", "gauss-8", "heyoka", "imex"]
    looks = {(mark.colour, mark.marker) for mark in marks(names).values()}
    assert len(looks) == len(names)


def test_rules_share_a_colour_only_when_all_are_used_and_then_have_other_dashes():
    """Also with a name that has a colour of its own; the dash is what a line without marks has."""
    names = ["midpoint", *(f"rule-{k}" for k in range(6))]
    assert len({mark.colour for mark in marks(names).values()}) == len(names)
    many = [*names, *(f"other-{k}" for k in range(14)), "midpoint, exp", "triple-jump:midpoint"]
    assert len({(mark.colour, mark.dash) for mark in marks(many).values()}) == len(many)
    alike = marks(["midpoint", "gauss-3", "lobatto-3", "rectangle", "gauss-2"]).values()
    pairs = {(min(mark.colour, ALIKE.get(mark.colour, mark.colour)), mark.dash) for mark in alike}
    assert len(pairs) == 5
