"""The page of crossovers says who is fastest, from races that were made up."""

import pytest

from tests.benchmarks import crossovers as page


def case(rule, kind, *runs):
    rows = [
        {"seconds": s, "error": e, "energy-max": e, "momentum-max": None, "setting": f"{s}"}
        for s, e in runs
    ]
    return {
        "scene": "pendulum",
        "rule": rule,
        "kind": kind,
        "rows": rows,
        "duration": 10.0,
        "floor": {"error": 1e-16},
        "crossovers": [{"error": 1e-6, "tighter": "rule"}],
    }


RACE = [
    case("gauss-8", "rule", (2e-5, 1e-9), (3e-5, 1e-13)),
    case("trapezoidal", "rule", (1e-5, 1e-5)),
    case("heyoka", "peer", (1.5e-5, 1e-5), (6e-5, 1e-13)),
    case("slow", "peer", (1.0, 1e-13)),
]


def test_a_cell_has_the_fastest_of_each_kind_and_their_ratio():
    assert page._cell(RACE, 1e-4, "error") == "trapezoidal 10 µs, heyoka 15 µs: **1.5**"
    assert page._cell(RACE[1:3], 1e-12, "error") == "—, heyoka 50.5 µs"
    assert page._cell(RACE[:1], 1e-8, "error") == "gauss-8 20 µs, —"
    slower = page._cell([RACE[0], case("quick", "peer", (1e-5, 1e-9))], 1e-8, "error")
    assert slower.endswith(": 0.5")


def test_lines_say_where_the_fastest_change_places():
    head, rule, line = page._accuracies([RACE]).splitlines()
    assert head.count("|") == rule.count("|") == line.count("|") == 7
    assert line.startswith("| pendulum, T = 10 |") and "10⁻⁶: rule below" in line
    assert page._accuracies([RACE], "energy-max").splitlines()[2].count("|") == 6
    kept = page._kept([RACE]).splitlines()[2]
    assert "10⁻¹³ (gauss-8)" in kept and kept.endswith("| — | — |")


@pytest.mark.slow
def test_the_command_writes_the_page(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "BUDGETS", dict.fromkeys(page.BUDGETS, 0.005))
    monkeypatch.setattr(page, "PERIODS", 20)
    file = tmp_path / "crossovers.md"
    page.main([str(file), "pendulum"])
    text = file.read_text("utf-8")
    assert text.count("| pendulum, T = ") == 4 and "/" not in page._where()
    assert str(tmp_path) not in text
