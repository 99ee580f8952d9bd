"""What a report says: digits, headlines, the terminal's tables, formulas."""

from __future__ import annotations

import io
import math
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from typing import Any

import pytest

from discmech.studies.core.outcome import OF_STEPS
from discmech.studies.core.result import AnyResult, result_of
from discmech.studies.report import formulas, plot_drift, tables, wording
from discmech.studies.report.palette import Mark
from discmech.studies.report.summary import headline, merged
from discmech.studies.report.verdicts import line
from discmech.studies.report.wording import whys
from tests.studies.as_json import read
from tests.studies.fake_results import spoiled


def test_terminal_table_ends_with_the_failures() -> None:
    from rich.console import Console

    console = Console(width=150, file=io.StringIO())
    with console.capture() as capture:
        tables.print_result(console, read(*spoiled())[0])
    shown = capture.get()
    assert shown.index("inconclusive") < shown.index("Newton stopped") > shown.rindex("2.00")


def test_values_of_a_number_stay_in_their_order_in_the_terminal_s_table() -> None:
    cases = [{"scene": "pendulum", "rule": f"mine:w={w}", "verdict": said, "measured": {"order": 2}}
             for w, said in ((0, "fail"), (1, "pass"), (2, "fail"))]  # fmt: skip
    for command, order in (("discmech order --vary w=0:2:3 pendulum", "012"), ("", "102")):
        (result,) = read({"study": "order", "command": command, "cases": cases})
        rules = tables.terminal_table(result).columns[0].cells
        assert [str(cell)[-1] for cell in rules] == [*order]


def test_what_all_rows_of_a_table_share_is_told_once_and_a_peer_is_said_to_be_one() -> None:
    from rich.console import Console

    race = {"with": ["midpoint", "DOP853"], "date": "2026-01-01T10:00:00+00:00"}
    cases = [
        {"scene": "pendulum", "rule": rule, "digits": 16, "verdict": said, "kind": kind,
         "duration": 10.0, "race": race, "expected": {"limit": 1.5e-8},
         "measured": {"x": "seconds", "y": "error", "best": best, "cost": {"1e-04": best}}}
        for rule, said, kind, best in (("midpoint", "pass", "rule", 1e-10),
                                       ("DOP853", "inconclusive", "peer", 1e-5))
    ]  # fmt: skip
    (result,) = read({"study": "work-precision", "verdict": "pass", "cases": cases})
    console = Console(width=100, file=io.StringIO())
    with console.capture() as capture:
        console.print(tables.terminal_table(result))
    shown = " ".join(capture.get().split())
    shared = ("pendulum", "T = 10", "10:00:00", "that falls with the work", "1.5×10⁻⁸")
    assert all(shown.count(words) == 1 for words in shared)
    assert "inconclusive (peer)" in shown and "peers do not count" in shown
    assert "pass (peer)" not in shown


def test_terminal_summary_has_a_line_a_study_and_the_cases_that_did_not_pass() -> None:
    from rich.console import Console

    from discmech.studies.report.summary import print_summary

    console = Console(width=150, file=io.StringIO())
    with console.capture() as capture:
        print_summary(console, read(*spoiled()))
    shown = capture.get()
    cases = [case for study in merged(read(*spoiled())) for case in study.cases]
    bad = [case for case in cases if not case.passed]
    assert bad and shown.count("\n  discmech ") == len(bad)
    assert all(case.command in shown and case.reason in shown for case in bad)
    assert len(shown.splitlines()) < 8 + len(spoiled()) + 2 * len(bad)


@pytest.mark.parametrize("value", [0, 2.0001, -0.25, 999.4, 3.1e-16, 1e-13, -7.5e12, 1e300])
def test_numbers_are_read_from_the_words_they_were_written_in(value: float) -> None:
    (found,) = wording.numbers_in(f"|μ|² of gauss4: {wording.scientific(value, 4)}, at hω")
    assert found == pytest.approx(value, rel=1e-4)
    assert wording.numbers_in("2, −1.5 and 1e-13; 10⁻³ to 2×") == [2, -1.5, 1e-13, 1e-3, 2]


@pytest.mark.parametrize(("value", "interval", "text"), [
    (2.0004, [1.998, 2.002], "2.000 ± 0.003"),
    (2.0, [2.0, 2.0], "2.000000 ± 0.000001"),
    (1.98765, [1.90, 2.05], "1.988 ± 0.088"),
    (2.00001234, [2.00001, 2.00002], "2.000012 ± 0.000008"),
    (1.5, None, "1.500"),
    (1.07e-11, [-2.28e-9, 2.30e-9], "(0.0 ± 2.3)×10⁻⁹"),
    (-2.6808971e-18, [-2.6810207e-18, -2.6807736e-18], "(−2.6809 ± 0.0002)×10⁻¹⁸"),
    (-9e-10, [-9.9e-10, -8.9e-10], "(−9.0 ± 0.9)×10⁻¹⁰"),
    (686546.590, [96416.57, 1276676.61], "(6.9 ± 6.0)×10⁵"),
    (0.0, [0.0, 0.0], "0"),
    (None, [0, 1], "—"),
    (math.nan, [0, 1], "—"),
])  # fmt: skip
def test_orders_have_the_digits_they_deserve(value: Any, interval: Any, text: str) -> None:
    assert wording.plus_minus(value, interval) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(3.14e-16, "3.1×10⁻¹⁶"), (1e-13, "10⁻¹³"), (0, "0"), ("2e-60", "2.0×10⁻⁶⁰"), (None, "—")],
)
def test_small_numbers(value: Any, text: str) -> None:
    assert wording.scientific(value) == text


def test_words_for_latex() -> None:
    assert tables.tex("≤ 3.1×10⁻¹⁶, |Γ|²") == r"$\le$ 3.1$\times$10$^{-16}$, $|\Gamma|^{2}$"
    assert tables.tex("50 % of a_b, 3×2") == r"50 \% of a\_b, 3$\times$2"
    assert tables.tex("0.24 h⁴ at t = 20") == r"0.24 $h^{4}$ at $t = 20$"
    assert tables.tex("3×10⁻³ h⁴") == r"3$\times$10$^{-3}$ $h^{4}$"


def test_an_order_that_is_none_has_no_sign_and_one_text() -> None:
    assert wording.order_of(-1.2e-4) == wording.order_of(-1.2e-4, 3) == "0.000"
    assert (wording.order_of(1.99996), wording.order_of(-1.5, 3)) == ("2.0000", "−1.500")
    assert wording.plus_minus(-1e-9, [-0.01, 0.01]) == "0.000 ± 0.011"


@pytest.mark.parametrize(("verdicts", "controls", "text"), [
    (["pass"], [], "The only case passes."),
    (["fail", "pass"], ["pass"], "1 of 2 cases fails; the only control was caught."),
    (["inconclusive"] * 2, [], "All 2 cases are inconclusive."),
    (["fail"] * 2 + ["inconclusive"], [], "2 of 3 cases fail; 1 is inconclusive."),
    (["measured"], [], "The only case is measured, where no claim is judged."),
    (
        ["pass"] * 2 + ["measured"],
        [],
        "2 of 3 cases pass; 1 is measured, where no claim is judged.",
    ),
    (["measured", "fail"], [], "1 of 2 cases fails; 1 is measured, where no claim is judged."),
    ([], ["pass", "fail", "fail"], "1 of 3 controls was caught."),
    ([], ["fail", "fail"], "None of 2 controls were caught."),
])  # fmt: skip
def test_headline_is_english(verdicts: list[str], controls: list[str], text: str) -> None:
    cases = [{"verdict": word} for word in verdicts]
    cases += [{"verdict": word, "control": True} for word in controls]
    assert headline(read({"study": "order", "verdict": "pass", "cases": cases}))["text"] == text


def test_only_the_quantity_that_drifts_is_said_to_fail() -> None:
    given = {"rule": "midpoint", "verdict": "fail", "expected": {"limit": 1e-12}}
    case = result_of("momentum", given | {"measured": {"drift": {"μ₃": 0.0, "|Γ|²": 2e-12}}})
    assert plot_drift.drifted(case, "|Γ|²") == "midpoint  2×10⁻¹²\n(fail)"
    free = replace(case, verdict="measured")
    assert plot_drift.drifted(free, "|Γ|²") == "midpoint  2×10⁻¹²\n(measured)"
    assert plot_drift.drifted(case, "μ₃") == "midpoint  0"
    assert plot_drift.drifted(result_of("momentum", given), "μ₃") == "midpoint\n(fail)"


def test_a_run_without_an_end_has_no_line_of_an_energy_that_is_kept() -> None:
    from matplotlib.figure import Figure

    rows = [{"time": 0.0, "error": -1.0}, {"time": 1.0, "error": 1.0}]
    figures = {"drift": -0.06, "band": 0.1}
    whole = result_of("energy", {"rule": "midpoint", "verdict": "pass", "rows": rows,
                                 "measured": figures})  # fmt: skip
    ended = result_of("energy", {"rule": "own", "verdict": "fail", "rows": []})
    marks, axes = {"midpoint": Mark("k", "o"), "own": Mark("k", "o")}, Figure().subplots()
    panel = plot_drift.energy("", [whole, ended], marks, 16, lambda case: case is whole)
    panel.draw(axes)
    assert "midpoint drift −0.06" in panel.spoken
    assert len(axes.lines) == 1 and len(axes.get_yticks()) == 3  # zero and both ends of one
    assert any("own\n(fail)" in text.get_text() for text in axes.texts)


def words(formula: str) -> str:
    """A formula's letters, a times sign as a space."""
    return re.sub("<[^>]*>", "", formula).replace("\u2062", " ")


def test_formulas_are_collected_and_stay_exact() -> None:
    from sympy import Rational, cancel, symbols

    h, a, b, u, w, x, z = symbols("h a b u w x z")
    square = h**2 * u**2 + 16
    body = a * u * (h**2 * u**2 / 4 + 1) + b * w * (h**2 * u * w / 4 - h * u / 2)
    force = -8 * h * b * (u * z - w * x) / square + h**3 * u * b * x * z / (2 * square)
    named: dict[Any, Any] = {}
    terms = formulas.ascending(body + force, h, {x, z}, named)
    assert cancel(sum(terms).xreplace(named) - body - force) == 0
    assert [*named.values()] == [square]
    assert cancel(sum(formulas.ascending(body + force, h, {x, z})) - body - force) == 0
    letters = {u: "u_1", w: "u_2", next(iter(named)): "Δ(u)"}
    shown = formulas.Typesetter(letters).equation([u], terms)
    assert words(shown) == (
        "u1=a u1−b h u1 u22+h2 u1 (a u12+b u22)4+8 b h (-u1 z+u2 x)Δ(u)+b h3 u1 x z2 Δ(u)"
    )
    apart = ((x - z) ** 2 + (u - w) ** 2) ** Rational(-3, 2)
    terms = formulas.ascending(a * u + h * b * (x - z) * apart, h, {x, z})
    assert terms[-1].has(apart) and cancel(sum(terms) - a * u - h * b * (x - z) * apart) == 0
    minus = formulas.Typesetter({}).sum([-(a + b), -(a - b) / 2, u ** (a / 2)])
    assert words(minus) == "-a-b+(-a2+b2)+ua2"


def test_squares_of_sine_and_cosine_are_added() -> None:
    """A Lagrangian by places of bodies is full of them; of unequal factors both stay."""
    from sympy import cos, sin, symbols

    h, m, u, x, z = symbols("h m u x z")
    sphere = (cos(x) * cos(z)) ** 2 + (cos(x) * sin(z)) ** 2 + sin(x) ** 2
    assert formulas.ascending(m * u**2 * sphere / 2 + h * m * u * sphere, h, {x, z}) == [
        m * u**2 / 2, h * m * u,
    ]  # fmt: skip
    assert formulas.ascending(cos(x) ** 2 * (u + sin(x) ** 2 / cos(x) ** 2 * u), h, {x}) == [u]
    for rest in (2 * m * cos(x) ** 2 + m * sin(x) ** 2, cos(x) ** 2 + sin(z) ** 2, cos(x) ** -2):
        assert (sum(formulas.ascending(rest, h, {x, z})) - rest).expand() == 0


def test_equations_of_a_scheme_are_typeset() -> None:
    from discmech.integrators import Scheme, scenes
    from discmech.integrators import rules as discretisations
    from discmech.studies.command.equations import equations_of

    for scene, lines in (("kepler", 2), ("rigid-body", 3)):
        found = equations_of(Scheme(scenes.get(scene), discretisations.midpoint))
        assert len(found["residual_mathml"]) == len(found["momentum_mathml"]) == lines
        for key in ("residual_mathml", "momentum_mathml", "points_mathml"):
            for formula in found[key]:
                assert ElementTree.fromstring(formulas.display(formula)).tag == "math"
                assert not re.search("_|after|z0", words(formula))
    held = equations_of(Scheme(scenes.get("suslov"), discretisations.midpoint))
    assert words(held["constraints_mathml"][0]) == "u3=0"
    assert words(held["constrained_momentum_mathml"][2]).startswith("μ3+h λ2=")
    assert words(held["constrained_residual_mathml"][0]).endswith("=μ′1")
    assert words(found["residual_mathml"][2]).startswith(
        "inertia3 u3+h u1 u2 (inertia1-inertia2)2+"
    )


def test_a_cause_is_told_once_with_its_figures() -> None:
    def case(scene: str, reason: str, study: str = "order") -> AnyResult:
        return result_of(study, {"scene": scene, "rule": "r", "digits": 16, "reason": reason})

    said = whys([case("a", "order 1.1. Cause: gauge, of 2e-4."), case("b", "1/0"),
                 case("c", "order 1.2. Cause: gauge, of 2e-4."), case("d", "1/0"),
                 case("e", "order 1.3. Cause: weights, of 3."), case("f", ""),
                 case("a", "It drifts. Cause: gauge, of 2e-4.", "energy"),
                 case("g", "order 1.4. Cause: gauge, of 3e-5.")])  # fmt: skip
    assert said[2:] == ["order 1.2. Cause: as of a, r, 16 digits.", "As b, r, 16 digits.",
                        "order 1.3. Cause: weights, of 3.", "",
                        "It drifts. Cause: as of a, r, 16 digits, in order.",
                        "order 1.4. Cause: gauge, of 3e-5."]  # fmt: skip


@pytest.mark.parametrize(("why", "words"), [
    *((why, why) for why in OF_STEPS), (None, "5.0×10⁻¹⁶"),
])  # fmt: skip
def test_a_cross_stands_beside_what_it_is_for(why, words):
    """A figure within its limit is not the reason why a verdict fails."""
    case = {"verdict": "fail", "reason": "a sentence", "why": why, "measured": {"pullback": 5e-16}}
    assert tables.short(result_of("symplecticity", case)) == words


def test_the_drift_that_is_wanted_has_the_unit_of_the_one_that_is_measured():
    case = {"measured": {"drift": 9.5e-7, "band": 1e-3}, "expected": {"slope_limit": 8.1e-8},
            "duration": 100.0}  # fmt: skip
    shown = result_of("energy", case)
    assert tables.wanted(shown) == "no drift: at most 8.1×10⁻⁶ over the run"
    assert "a drift of 9.5×10⁻⁷" in tables.got(shown)


def test_a_drift_above_its_limit_that_passes_is_told_with_why():
    """The mean of the band wanders between edges that are steady; else it stands without."""
    case: dict[str, Any] = {
        "verdict": "pass", "expected": {"slope_limit": 8.1e-8}, "duration": 10.0,
        "measured": {"drift": 9.5e-7, "band": 8.1e-6, "edge_slopes": [-3.8e-8, 6.1e-8]},
    }  # fmt: skip
    shown = result_of("energy", case)
    assert "whose edges rise by at most 6.1×10⁻⁷: its mean wanders" in tables.got(shown)
    assert tables.short(shown) == "oscillates by 8.1×10⁻⁶"
    for other in ({"verdict": "fail"}, {"measured": case["measured"] | {"drift": 8e-7}}):
        assert "edges" not in tables.got(result_of("energy", case | other))


def test_a_line_of_trouble_has_its_reason_or_a_word_for_it_and_is_never_only_measured() -> None:
    entries = {"scene": "pendulum", "rule": "heun", "digits": 16, "verdict": "fail",
               "reason": "steps lose energy.", "expected": {"not_demanded": "it claims none"},
               "measured": {"drift": 0.1, "band": 0.2, "slope": 0.0}}  # fmt: skip
    case = result_of("energy", entries)
    assert "steps lose energy." in line(case) and "only measured" not in line(case)
    assert line(case, {case.reason}).endswith("as above")
    assert "only measured" in line(result_of("energy", entries | {"verdict": "measured"}))
