"""A number of a rule or a scene with several values: words, curves, and formulas in its letter."""

import inspect
from fractions import Fraction
from types import SimpleNamespace

import pytest

from discmech import Scheme, discretisation, one_step, scenes
from discmech.integrators import BadInput
from discmech.integrators.rules import midpoint, of_scene, with_parameters
from discmech.studies.command.entry import main
from discmech.studies.core import lookup
from discmech.studies.core.options import values_of
from discmech.studies.order.plot_varied import sketches
from discmech.studies.order.records import constant, curves, sentences
from tests.studies.proof.test_proof import eighths

MINE = """from discmech import Scene, discretisation, pair

@discretisation(parameters=("w",))
def mixed(L, G, x, u, h, w):
    return h * ((1 - w) * L(x, u) + w * L(G.target(x, u, h), u))

@discretisation(parameters={"w": "1/2"})
def halved(L, G, x, u, h, w):
    return h * ((1 - w) * L(x, u) + w * L(G.target(x, u, h), u))

def family(w):
    @discretisation(name=f"at-{float(w)}")
    def rule(L, G, x, u, h):
        return h * L(G.target(x, u, w * h), u)
    return rule

spring = Scene("spring", pair(1), lambda x, v, p: v[0] ** 2 / 2 - p.k * x[0] ** 2 / 2,
               parameters={"k": 1}, x0=[1], v0=[0], duration=1)
"""


@pytest.fixture
def mine(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(MINE)
    return str(file)


def test_values_are_exact():
    assert values_of("w=0:1/2:4") == ("w", ["0", "1/6", "1/3", "1/2"])
    assert values_of("k=0.1,2,1e1") == ("k", ["0.1", "2", "1e1"])
    assert values_of("w=0:0.5:6") == ("w", ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"])
    assert values_of("w=0:0.5:4") == ("w", ["0.0", "1/6", "1/3", "0.5"])
    assert values_of("w=1/5,sqrt(3)/6") == ("w", ["1/5", "sqrt(3)/6"])
    for text in ("w", "w=", "w=0:1", "w=0:1:1", "w=a:b:3", "=1,2"):
        with pytest.raises(BadInput, match=r"--vary .* names no number with its values: write"):
            values_of(text)


def test_a_number_of_a_rule_a_factory_or_a_scene_takes_the_values(mine):
    some = ["1/3", "1/2"]
    at, rules = lookup.varied(["harmonic"], [f"{mine}:mixed", "midpoint"], "w", some)
    assert [rule.name for rule in rules] == ["mixed:w=1/3", "mixed:w=1/2", "midpoint"]
    assert at == (scenes.get("harmonic"),) and rules[2] is midpoint
    _, made = lookup.varied(["harmonic"], [f"{mine}:family"], "w", some)
    assert [rule.name for rule in made] == ["family:w=1/3", "family:w=1/2"]
    springs, _ = lookup.varied([f"{mine}:spring"], ["midpoint"], "k", ["1", "4"])
    assert [scene.parameters["k"] for scene in springs] == [1, 4]
    assert [scene.name for scene in springs] == ["spring.k-1", "spring.k-4"]
    with pytest.raises(BadInput, match="no rule that is named leaves z open, and no scene"):
        lookup.varied(["harmonic"], [f"{mine}:mixed"], "z", some)


def test_a_rule_with_a_value_is_the_rule_written_with_it(mine):
    def written(L, G, x, u, h):
        return h * (L(x, u) / 2 + L(G.target(x, u, h), u) / 2)

    plain = Scheme(scenes.get("pendulum"), discretisation(name="plain")(written))
    wanted = plain.flow("0.1").trajectory(5).x
    for word in ("mixed:w=1/2", "halved"):
        scheme = Scheme(scenes.get("pendulum"), lookup.rule(f"{mine}:{word}"))
        assert (scheme.flow("0.1").trajectory(5).x == wanted).all(), word

    @one_step(order=1, parameters=("w",))
    def euler(s, z, h, w):
        return z + w * h * s.f(z)

    half = Scheme(scenes.get("pendulum"), with_parameters(euler, {"w": "1/2"})).flow("0.2")
    whole = Scheme(scenes.get("pendulum"), with_parameters(euler, {"w": 1})).flow("0.1")
    assert abs(half.trajectory(5).x - whole.trajectory(5).x).max() < 1e-15
    with pytest.raises(BadInput, match='no open number of euler "v"'):
        with_parameters(euler, {"v": 1})
    scene = scenes.get("pendulum")
    assert "leaves w open" in euler.refusal(scene)
    assert "FILE.py:euler:w=1/3, in --vary w=0:1:11" in euler.refusal(scene)
    assert not of_scene(euler).refusal(scene)


def case(w, order, size, digits=50, end=2.5):
    rows = [SimpleNamespace(used=True, step=h, error=size * h**order) for h in (0.2, 0.1)]
    measured = SimpleNamespace(order=order + 1e-4)
    details = SimpleNamespace(duration=end, whole=10 if end < 10 else None)
    return SimpleNamespace(rule=f"mine:w={w}", named=None, scene="pendulum", digits=digits,
                           measured=measured, rows=rows, passed=True, details=details)  # fmt: skip


def test_the_best_value_has_the_highest_order_and_then_the_least_constant():
    few = [case("1/4", 2, 0.1), case("1/6", 4, 0.3), case("0", 2, 0.01), case("1/5", 4, 0.2)]
    (curve,) = curves(few)
    assert [value for value, _ in curve.cases] == [0, *(Fraction(1, k) for k in (6, 5, 4))]
    assert curve.best[0] == Fraction(1, 5) and curve.usual == 2
    assert constant(curve.best[1].rows, curve.best[1].measured.order) == pytest.approx(0.2)
    assert "the best, w = 1/5, has the order 4, which 2 of them have" in curve.sentence
    assert curves(few[:1]) == [] and list(sketches(few[:1])) == []
    (two,) = curves([case("0.1", 2, 0.2), case("0.25", 2, 0.1)])
    assert "of 2 values of w the best, w = 0.25, has the order 2" in two.sentence
    (sketch,) = sketches(few)
    lines = [_drawn(panel).lines[0].get_linestyle() for panel in sketch.panels]
    assert lines == ["None", "-"]  # an order has no values between two of them
    assert [panel.subtitle for panel in sketch.panels] == ["order", "C of error ≈ C h² at t = 2.5"]
    assert constant(few[0].rows, None) is None


def _drawn(panel):
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    panel.draw(axes)
    return axes


@pytest.mark.parametrize(("sizes", "word"), [
    ((0.1, 0.1, 0.1001), "w makes no difference, as all of 3 values have the order 2"),
    ((0.1, 0.2, 0.3),
     "w = 0, has the order 2; its error constant is 0.1 at t = 2.5. It is an end of the range"),
    ((0.1, 0.2), "Two values are no range: others may be better."),
    ((0.2, 0.1, 0.3), "w = 1, has the order 2; its error constant is 0.1 at t = 2.5."),
])  # fmt: skip
def test_a_best_value_at_the_end_and_none_at_all_are_said(sizes, word):
    (curve,) = curves(case(str(w), 2, size) for w, size in enumerate(sizes))
    assert word in curve.sentence
    assert ("an end" in curve.sentence) == ("an end" in word)


def test_one_best_value_is_named_that_of_the_longest_runs():
    """A constant is that of one time: at a fortieth of the run another value may be the best."""
    short = [case(str(w), 2, size) for w, size in enumerate((0.2, 0.1, 0.3))]
    long = [case(str(w), 2, size, 16, 10) for w, size in enumerate((0.3, 0.2, 0.1))]
    (said,) = sentences(short)
    assert "w = 1, has the order 2" in said
    assert "This is so at t = 2.5; another may be the best later" in said
    assert "ends at t = 10: ask with --digits 16." in said
    (said,) = sentences([*short, *long])
    assert "16 digits" in said and "w = 2, has the order 2" in said and "later" not in said
    (said,) = sentences([*short, case("4", 4, 0.1)])  # a higher order is one at any time
    assert "w = 4" in said and "later" not in said


def test_an_order_is_shown_as_a_curve_with_the_best_value(mine, tmp_path, capsys):
    words = ["order", "harmonic", "--rule", f"{mine}:mixed", "--vary", "w=1/3,1/2,2/3"]
    folder = tmp_path / "figure"
    assert main([*words, "--digits", "16", "--steps", "64", "--folder", str(folder)]) == 0
    told = capsys.readouterr().out
    assert "of 3 values of w the best, w = 1/2, has the order 2, which 1 of them has" in told
    assert "Error constant" in told and "at t = 10." in told
    assert (folder / "figures" / "order-varied.svg").is_file()
    assert "--vary w=1/3,1/2,2/3" in (folder / "index.html").read_text("utf-8")


def test_two_values_are_rules_like_others_and_labels_may_name_their_file(mine, tmp_path):
    rules = [f"{mine}:mixed:w={value}" for value in ("1/2", "1/3")]
    words = ["order", "harmonic", *(part for rule in rules for part in ("--rule", rule))]
    words += ["--label", f"{rules[0]}=b = 1/2", "--digits", "16", "--steps", "64"]
    assert main([*words, "--folder", str(tmp_path)]) == 0
    assert not (tmp_path / "figures" / "order-varied.svg").exists()
    assert "$b = 1/2$ &" in (tmp_path / "tables" / "order-paper.tex").read_text("utf-8")
    assert (tmp_path / "figures" / "order-16.svg").is_file()


def test_a_value_of_a_lower_order_has_no_place_on_the_curve_of_the_constant():
    (sketch,) = sketches([case("0", 0, 9.0), *(case(f"{k}", 2, 0.1) for k in (1, 2, 3))])
    drawn = [[*_drawn(panel).lines[0].get_xdata()] for panel in sketch.panels]
    assert drawn == [[0, 1, 2, 3], [1, 2, 3]]


@pytest.mark.parametrize(("label", "row", "title"), [
    ("mixed=Mixed", "Mixed:w=1/2", "Mixed on Harmonic"),
    ("mixed:w=1/2=the middle = 1/2", "the middle = 1/2", "mixed on Harmonic"),
])  # fmt: skip
def test_a_rule_or_one_of_its_values_has_a_label_and_its_curve(mine, tmp_path, label, row, title):
    words = ["order", "harmonic", "--rule", f"{mine}:mixed", "--vary", "w=1/3,1/2,2/3"]
    words += ["--digits", "16", "--steps", "64", "--label", label, "--folder", str(tmp_path)]
    assert main(words) == 0
    table = (tmp_path / "tables" / "order-paper.tex").read_text("utf-8")
    assert f"\n{row} & 2.000" in table and "harmonic, C" in table and "$h^{2}$ at $t = 10$" in table
    assert title.lower() in (tmp_path / "figures" / "order-varied.svg").read_text("utf-8").lower()


def test_verify_has_a_row_for_each_value_of_a_rule_a_factory_or_a_scene(mine, capsys):
    asked = ["--study", "order", "--digits", "16", "--steps", "64"]
    for word, vary, rows in (
        (":mixed", "w=1/3,1/2", ("mixed:w=1/3", "mixed:w=1/2")),
        (":family", "w=1/3,1/2", ("family:w=1/3", "family:w=1/2")),
        (":spring", "k=1,4", ("spring.k-1", "spring.k-4")),
    ):
        scene = [] if "spring" in word else ["--scene", "harmonic"]
        assert main(["verify", f"{mine}{word}", "--vary", vary, *scene, *asked]) == 0
        told = capsys.readouterr().out
        assert all(f"│ {row} " in told or f" {row} │" in told for row in rows), told
    assert main(["verify", f"{mine}:none", "--vary", "w=1,2"]) == 2
    assert "mine.py has no rule" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["c", "L"])
def test_a_letter_of_rules_is_no_name_of_an_open_number(name):
    with pytest.raises(BadInput, match=f"but {name} is one of the letters"):
        discretisation(parameters=("w", name))(lambda L, G, x, u, h: h * L(x, u))


def test_coefficients_with_an_open_number_are_one_fraction_each(tmp_path, capsys):
    """Of 25 terms with (8w + 1)⁻¹ to (8w + 1)⁻⁶ two are left."""
    file = tmp_path / "eighths.py"
    head = "from fractions import Fraction\nfrom discmech import discretisation\n\n"
    file.write_text(head + inspect.getsource(eighths.formula), "utf-8")
    assert main(["modified", "pendulum", f"{file}:eighths", "--order", "2"]) == 0
    third = capsys.readouterr().out.partition("H₃ = ")[2].partition("\n\n")[0]
    assert third.count("8·w + 1") == 1 and "(4·w − 1)" in third and len(third) < 120


def test_a_modified_hamiltonian_has_the_letter_of_an_open_number(mine, capsys):
    file = mine.replace("mine.py", "second.py")
    text = MINE.replace('parameters=("w",)', 'order=1, parameters=("w",)')
    with open(file, "w", encoding="utf-8") as second:
        second.write(text)
    assert main(["modified", "harmonic", f"{file}:mixed", "--order", "1"]) == 0
    told = capsys.readouterr().out
    assert "(2·w − 1)" in told.partition("H₂ = ")[2].partition("\n")[0]
    assert "hold for every value; the runs that check them have w = 1/7" in told
