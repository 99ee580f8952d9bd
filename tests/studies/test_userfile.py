"""A user's file: what is found in it, by which words, and what is said of a wrong one."""

import pickle
import re
import subprocess
import sys

import pytest

from discmech.integrators import BadInput, Scheme, scenes
from discmech.integrators import rules as discretisations
from discmech.studies.command.entry import main
from discmech.studies.core import lookup, words
from discmech.studies.core.case import Case, Choice, in_chart
from discmech.studies.core.userfile import load, stamps

RULE = '''"""Mine."""
from discmech.integrators import discretisation, midpoint
from discmech.integrators.rules import compose


@discretisation(order=2)
def two_thirds(L, G, x, u, h):
    return h * L(G.target(x, u, h / 3), u) / 2 + h * L(G.target(x, u, 2 * h / 3), u) / 2
'''
SCENE = """import sympy
from discmech.integrators import Scene, pair

mine = Scene(
    name="my-pendulum", groupoid=pair(1), x0=[2], v0=[0], duration=10, step="1/50",
    lagrangian=lambda x, v, p: v[0] ** 2 / 2 + sympy.cos(x[0]),
)
"""


@pytest.fixture
def file(tmp_path, monkeypatch):
    """Writes a file in an empty folder, which is made the current one, and returns its name."""
    monkeypatch.chdir(tmp_path)

    def write(text, name="mine.py"):
        (tmp_path / name).write_text(text, encoding="utf-8")
        return name

    return write


def test_rules_and_scenes_of_a_file_are_found_and_those_of_others_are_not(file):
    found = load(file(RULE + SCENE))
    assert list(found.rules) == ["two-thirds"] and list(found.scenes) == ["my-pendulum"]


def test_a_text_is_run_once_and_a_changed_one_anew(file):
    first = load(file(RULE))
    assert load("mine.py") is first
    again = load(file(RULE.replace("order=2", "order=1")))
    assert again.rules["two-thirds"].order == 1 and again.digest != first.digest
    older, newer = (pickle.dumps(f.rules["two-thirds"]) for f in (first, again))
    assert stamps(newer) == (("mine.py", again.digest),) and not stamps(b"midpoint yours.py:it")
    with pytest.raises(pickle.PicklingError, match="was changed"):
        stamps(older)
    assert load(file(RULE)) is first and stamps(older) == (("mine.py", first.digest),)


def test_words_name_things_and_things_have_words(file):
    name = file(RULE + SCENE)
    rule = lookup.rule(f"{name}:two_thirds")
    assert lookup.rule(f"{name}:two-thirds") is rule and lookup.rules([name]) == (rule,)
    composed = lookup.rule(f"triple-jump:{name}:two_thirds")
    assert lookup.named(f"triple-jump:{name}:two_thirds") == ((composed,), ())
    for word, said in (
        (f"triple-jump:{name}:none", 'mine.py has no rule "none"'),
        (f"triple-jmp:{name}:two_thirds", "did you mean triple-jump?"),
    ):
        for ask in (lookup.rule, lookup.named):
            with pytest.raises(BadInput, match=re.escape(said)):
                ask(word)
    for thing, word in (
        (rule, "mine.py:two-thirds"),
        (composed, "triple-jump:mine.py:two-thirds"),
        (discretisations.get("kahan-li-8:midpoint"), "kahan-li-8:midpoint"),
        (lookup.scene("mine.py:my-pendulum"), "mine.py:my-pendulum"),
        (scenes.get("kepler"), "kepler"),
    ):
        assert words.address_of(thing) == word
        found = lookup.rule(word) if hasattr(thing, "formula") else lookup.scene(word)
        assert found == thing
    assert lookup.rules([name, "midpoint", name])[1].name == "midpoint"


def test_a_problem_of_control_is_named_by_its_variable(file):
    name = file(
        SCENE
        + """
from discmech import Control
stop = Control(mine, cost=lambda x, v, f, p: f.dot(f), end=([0], [0]))
"""
    )
    assert lookup.control(f"{name}:stop").scene.name == "my-pendulum"
    assert lookup.control("oscillator").scene.name == "oscillator"
    with pytest.raises(BadInput, match=r'no Control.* "mine": there is stop'):
        lookup.control(f"{name}:mine")


def test_a_choice_of_a_file_can_be_sent_and_a_case_said(file):
    name = file(RULE + SCENE)
    choice = Choice(scenes=lookup.scenes_of([name, "kepler"]), rules=lookup.rules([name]))
    packed = pickle.dumps(choice)
    assert pickle.loads(packed) == choice
    assert [path for path, _ in stamps(packed)] == ["mine.py"]
    case = Case("order", choice.scenes[0], choice.rules[0], 16)
    assert case.command == (
        "discmech order mine.py:my-pendulum --rule mine.py:two-thirds --digits 16"
    )
    top = in_chart(scenes.get("heavy-top"), "exponential")
    assert words.address_of(top) == "heavy-top"


def test_what_a_file_prints_does_not_go_to_standard_output(file, capsys):
    load(file(RULE + "print('hello')\n"))
    shown = capsys.readouterr()
    assert shown.out == "" and "hello" in shown.err


@pytest.mark.parametrize(("text", "message"), [
    ("x = (", r"^mine.py, line 1: '\(' was never closed"),
    (RULE + "x = y\n", r"^mine.py, line 9: NameError: name 'y' is not defined"),
    (RULE + "import not_there\n", "^mine.py, line 9: ModuleNotFoundError"),
    (RULE + "raise SystemExit(3)\n", "^mine.py, line 9: SystemExit: 3"),
    (RULE + "raise GeneratorExit\n", "^mine.py, line 9: GeneratorExit"),
    (RULE.replace("order=2", "order=0"), "^mine.py, line 6: the order of a rule"),
    (RULE.replace("u, h):", "u):"), "^mine.py, line 6: rule two-thirds: .* 4 arguments"),
    ("x = 1\n", "^mine.py defines no rule and no scene"),
    (SCENE.replace("x0=[2]", "x0=[2, 3]"), "^mine.py, line 4: my-pendulum: x0"),
    ("\0", "^mine.py"),
])  # fmt: skip
def test_a_wrong_file_is_said_with_its_line(file, text, message):
    with pytest.raises(BadInput, match=message):
        lookup.named(file(text))


def test_a_name_that_is_taken_blocks_nothing(file):
    other = RULE.replace("order=2", 'name="two-thirds"').replace("def two_", "def other_")
    name = file(RULE + other + RULE.replace("two_thirds", "midpoint"))
    names = sorted(rule.name for rule in lookup.rules([name]))
    assert names == ["midpoint", "other_thirds", "two-thirds"]
    assert lookup.rule(f"{name}:midpoint") != discretisations.midpoint
    assert words.address_of(lookup.rule(f"{name}:midpoint")) == "mine.py:midpoint"
    assert words.address_of(discretisations.midpoint) == "midpoint"
    assert lookup.rule(f"{name}:other_thirds").order is None


def test_an_object_that_is_refused_blocks_no_other_and_is_told(file, capsys):
    bad = SCENE.replace("x0=[2]", "x0=[2, 3]") + "later = mine.with_values(duration=1)\n"
    name = file(bad + RULE)
    assert lookup.rule(f"{name}:two_thirds").order == 2 and lookup.left_out() == []
    for ask in (f"{name}:mine", f"{name}:later"):
        with pytest.raises(BadInput, match=r"^mine.py, line 4: my-pendulum: x0 has 2"):
            lookup.scene(ask)
    with pytest.raises(BadInput, match=r"^mine.py, line 4"):
        lookup.rule(name)
    assert lookup.named(name)[0] and len(lookup.left_out()) == 1
    asked = ["order", "harmonic", "--rule", name, "--digits", "16", "--steps", "8"]
    assert main(asked) == 2
    told = capsys.readouterr()
    assert "two-thirds" in told.out and "mine.py, line 4: my-pendulum: x0 has 2" in told.err


def test_a_step_that_reads_what_could_not_be_made_is_refused_with_the_line_that_could_not(file):
    name = file(
        "from discmech import black_box\nweights = open('none.txt')\n\n"
        "@black_box(order=2)\ndef step(q, p, h, s):\n    return q + h * weights[0], p\n\n"
        "@black_box(order=2)\ndef other(q, p, h, s):\n    weights = [0]\n    return q, p\n"
    )
    assert [rule.name for rule in lookup.rules([f"{name}:other"])] == ["other"]
    with pytest.raises(BadInput, match=r"step needs weights, .* line 2: .*none\.txt.*; mend that"):
        lookup.rules([f"{name}:step"])


@pytest.mark.parametrize("entries", ["[made(0), made(1), made(None)]",
                                     "{'a': made(0), 'b': made(1), 'c': made(None)}"])  # fmt: skip
def test_an_entry_that_cannot_be_made_blocks_no_other(file, entries):
    made = "x0=[2] if k else [1 / 0] if k is None else [2, 3]"
    text = SCENE.replace("mine =", "def made(k):\n    return").replace("x0=[2]", made)
    name = file(text + f"SCENES = {entries}\nlast = made(None)\n" + RULE)
    for ask in (name, f"{name}:SCENES"):
        assert len(lookup.scenes_of([ask])) == 1
        first, second, *_ = lookup.left_out()
        assert "x0 has 2" in first and "ZeroDivisionError" in second
    with pytest.raises(BadInput, match="ZeroDivisionError"):
        lookup.scene(f"{name}:last")


def test_rules_of_one_name_are_called_by_their_files(file):
    plain = RULE.replace("two_thirds", "step")
    anna, bert = file(plain, "anna.py"), file(plain.replace("/ 3", "/ 5"), "bert.py")
    found = lookup.rules([anna, f"{bert}:step", "midpoint"])
    assert [rule.name for rule in found] == ["anna-step", "bert-step", "midpoint"]
    assert [words.address_of(rule) for rule in found[:2]] == ["anna.py:step", "bert.py:step"]
    assert lookup.rules([anna, anna]) == (lookup.rule(anna),)


FAMILY = """from discmech import Scene, discretisation, midpoint, pair

def family(w, n=2):
    @discretisation(order=n, name=f"at-{w}")
    def rule(L, G, x, u, h):
        return h * L(G.target(x, u, h / w), u)
    return rule

def spring(k):
    return Scene("spring", pair(1), lambda x, v, p: v[0] ** 2 / 2 - k * x[0] ** 2 / 2,
                 x0=[1], v0=[0], duration=1)

@discretisation(order=2, parameters=("w",))
def mixed(L, G, x, u, h, w):
    return h * (1 - w) * L(x, u) + h * w * L(G.target(x, u, h), u)
"""


@pytest.mark.parametrize(
    ("word", "name"),
    [("family:w=3", "at-3"), ("family:w=4,n=1", "at-4"), ("mixed:w=1/3", "mixed:w=1/3")],
)
def test_a_word_gives_values_to_what_makes_a_rule(file, word, name):
    place = file(FAMILY)
    rule = lookup.rule(f"{place}:{word}")
    assert rule.name == name and words.address_of(rule) == f"{place}:{word}"
    assert lookup.rule(f"{place}:{word}") is rule


def test_a_word_gives_values_to_a_scene_and_a_scene_has_that_word(file):
    place = file(FAMILY)
    spring = lookup.scene(f"{place}:spring:k=4")
    assert words.address_of(spring) == f"{place}:spring:k=4"
    short = scenes.get("pendulum").with_values(duration=1, parameters={"length": "1/3"})
    assert words.address_of(short) == "pendulum:duration=1,length=1/3"
    again = lookup.scene("pendulum:duration=1,length=1/3")
    assert again.parameters == short.parameters and again.duration == 1
    with pytest.raises(BadInput, match="has no 'weight'"):
        lookup.scene("pendulum:weight=1")
    with pytest.raises(
        BadInput, match=r"parameters are mass, length, gravity: did you mean length\?$"
    ):
        lookup.scene("pendulum:lenght=1")
    with pytest.raises(BadInput, match=r"family is a plain function: .* mine.py:family:w=1\.$"):
        lookup.rule(f"{place}:family")
    with pytest.raises(BadInput, match=r'no open number of mixed "v"'):
        lookup.rule(f"{place}:mixed:v=1")


SCRIPT = (
    FAMILY
    + """
if __name__ == "__main__":
    from discmech import scenes
    from discmech.studies.core.words import address_of
    inside = family(5)
    few = [scenes.get("pendulum").with_values(x0=["1/7"], name="seventh")]
    for thing in (inside, family(7), few[0], scenes.get("kepler").with_values(duration=1)):
        print(address_of(thing))
"""
)


@pytest.mark.slow
def test_what_a_script_makes_has_words_that_another_process_understands(file, monkeypatch):
    name = file(SCRIPT, "made.py")
    done = subprocess.run([sys.executable, name], capture_output=True, text=True)
    told = done.stdout.splitlines()
    assert len(told) == 4, done.stderr
    family, place = [word.rpartition("/")[2] for word in told[:2]], told[2]
    assert family == ["made.py:family:w=5", "made.py:family:w=7"]
    assert place.endswith(".py:seventh") and "made.py" not in place
    assert lookup.scene(place).x0 == scenes.get("pendulum").with_values(x0=["1/7"]).x0
    assert told[3] == "kepler:duration=1"
    assert [lookup.rule(word).name for word in told[:2]] == ["at-5", "at-7"]


@pytest.mark.parametrize(("ask", "message"), [
    (lambda: load("other.py"), "other.py cannot be read .*No such file"),
    (lambda: lookup.rule("mine.py:two_thrids"), 'no rule "two_thrids": did you mean two-t'),
    (lambda: lookup.scene("mine.py:a"), "mine.py defines no scene, but a rule: say --rule mine.py, "
     "beside a scene such as pendulum"),
    (lambda: lookup.scene("mine.py:two_thirds"), "two-thirds is a rule, where a scene is"),
    (lambda: lookup.rule("two.py"), "several rules .*say two.py:a"),
    (lambda: lookup.rule("midpont"), "did you mean midpoint"),
])  # fmt: skip
def test_wrong_words_have_a_message(file, ask, message):
    file(RULE)
    file(RULE.replace("two_thirds", "a") + RULE.replace("two_thirds", "b"), "two.py")
    file(RULE.replace("two_thirds", "a").replace("/ 3", "/ 5"), "three.py")
    with pytest.raises(BadInput, match=message):
        ask()


@pytest.mark.parametrize(("body", "message"), [
    (
        "y = x[0] + nothing\n    return h * L(x, u)",
        "^mine.py, line 5: kepler: rule mine .*NameError.*nothing",
    ),
    ("return [h, h]", r"^mine.py, line 3: kepler: rule mine is \[h, h\], not an expression"),
    ("h * L(x, u)", "^mine.py, line 3: .* is None.*return"),
    ("return h * u", r"^mine.py, line 3: .* is a matrix \(2, 1\)"),
    ("return h * L(x)", "^mine.py, line 5: .*TypeError"),
    ("return h * L.parameters.mass * L(x, u)", "^mine.py, line 5: .* asks for what is not there"),
    ("return h * x[0]", "^mine.py, line 3: .*does not depend on u"),
    ("return h * G.target(x, u, h)[7]", "^mine.py, line 5: .*IndexError"),
    ("return h * (u[0] + x[0])", "^mine.py, line 3: kepler with mine: FL is singular"),
])  # fmt: skip
def test_a_rule_that_fails_on_symbols_is_said_with_its_line(file, body, message):
    text = "from discmech import discretisation\n\n@discretisation()\ndef mine(L, G, x, u, h):\n"
    rule = lookup.rule(file(f"{text}    {body}\n"))
    with pytest.raises(BadInput, match=message):
        Scheme(scenes.get("kepler"), rule)


def test_a_lagrangian_that_fails_is_said_with_its_line(file):
    scene = lookup.scene(file(SCENE.replace("cos(x[0])", "cos(angle)").replace("sympy.", "")))
    with pytest.raises(BadInput, match=r"^mine.py, line 6: my-pendulum: its Lagrangian .*NameErr"):
        Scheme(scene, discretisations.midpoint)


GROUPOID = """from discmech import LocalGroupoid, MatrixAlgebra, Scene, action, lie_group, sl

def of(groupoid, **more):
    return Scene("mine", groupoid, lambda x, v, p: v.dot(v) / 2, v0=[0] * groupoid.dim_u,
                 step="1/9", **more)

"""


@pytest.mark.parametrize(("groupoid", "message"), [
    (
        "LocalGroupoid(0, 2, target=lambda x, u, h: x,\n"
        "product=lambda x, u, v, h: [u[0] + 2 * v[0], u[1] + v[1]])",
        r"^mine.py, line 8: local groupoid is not a groupoid: p\(x, 0, v\) = v",
    ),
    (
        "LocalGroupoid(0, 1, target=lambda x, u, h: x,\nproduct=lambda x, u, v, h: u + w)",
        "^mine.py, line 8: local groupoid: product could not be evaluated .*NameError",
    ),
    (
        "LocalGroupoid(0, 1, target=lambda x, u, h: x,\nproduct=lambda x, u, v, h: [1, 2])",
        "^mine.py, line 8: local groupoid: product returned 2 entries",
    ),
    (
        "action(sl(2), right_action=lambda x, g: [2 * x[0]], dim_x=1), x0=[1]",
        r"^mine.py, line 7: action\(sl\(2\), lambda\) is not a groupoid: .*a right action has",
    ),
    (
        "lie_group(MatrixAlgebra('open', (((0, 1, 0), (0, 0, 0), (0, 0, 0)), "
        "((0, 0, 0), (0, 0, 1), (0, 0, 0)))))",
        "^algebra open: the commutator of basis matrices 1 and 2 is not .* add it",
    ),
])  # fmt: skip
def test_a_wrong_groupoid_is_said_with_its_line(file, groupoid, message):
    scene = lookup.scene(file(f"{GROUPOID}mine = of({groupoid})\n"))
    with pytest.raises(BadInput, match=message):
        Scheme(scene, discretisations.midpoint)


def test_messages_of_our_own_rules_name_no_line():
    scene = scenes.get("kepler").with_values(lagrangian=lambda x, v, p: v[0] ** 2 + v[7])
    with pytest.raises(BadInput, match=r"test_userfile.py, line \d+") as caught:
        Scheme(scene, discretisations.midpoint)
    assert "discretisations.py" not in str(caught.value)


def test_plain_functions_are_named_and_a_line_is_said_once(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plain.py").write_text("def midrule(L, G, x, u, h):\n    return h * L(x, u)\n")
    with pytest.raises(BadInput, match="no rule and no scene: midrule is a plain function: dec"):
        lookup.rule("plain.py")
    (tmp_path / "short.py").write_text(
        "from discmech import Scene, pair\n"
        "Scene('short', pair(1), lambda x, v, p: v[0] ** 2, force=lambda x, v: [1], x0=[0], v0=[0])"
    )
    with pytest.raises(BadInput, match=r"^short\.py, line 2: short: force= is a function of"):
        load("short.py")


def test_of_files_that_share_one_beside_them_no_digest_depends_on_the_turn(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shared = "from shared_values import HALF\n"
    found = []
    for number, names in enumerate((("one.py", "two.py"), ("two.py", "one.py"))):
        folder = tmp_path / str(number)  # another folder, whose files were never loaded
        folder.mkdir()
        for name in names:
            (folder / name).write_text(shared + RULE, encoding="utf-8")
        (folder / "shared_values.py").write_text("HALF = 1\n", encoding="utf-8")
        found.append({name: load(str(folder / name)).digest for name in names})
    assert found[0] == found[1]
    (folder / "shared_values.py").write_text("HALF = 2\n", encoding="utf-8")
    (folder / "one.py").write_text(shared + RULE + "\n", encoding="utf-8")
    (folder / "three.py").write_text(shared + RULE, encoding="utf-8")
    assert load(str(folder / "three.py")).digest != found[0]["two.py"]


def test_two_rules_of_one_name_in_files_of_one_name_are_told_where_to_name_them(file, tmp_path):
    (tmp_path / "beside").mkdir()
    words = [f"{file(RULE)}:two-thirds",
             f"{file(RULE.replace('h / 3', 'h / 4'), 'beside/mine.py')}:two-thirds"]  # fmt: skip
    with pytest.raises(BadInput, match=r'called mine-two-thirds: give one .* name="..."'):
        lookup.rules(words)


def test_what_other_libraries_leave_among_the_modules_is_no_error(monkeypatch):
    monkeypatch.setitem(sys.modules, "odd", object())
    own = discretisations.discretisation(1, name="nowhere")(lambda L, G, x, u, h: h * L(x, u))
    assert words.address_of(own) == "nowhere"


HELPED = """
from helper import G
from discmech import discretisation

@discretisation(order=2, name="{name}")
def step(L, Q, x, u, h):
    return h * L(Q.target(x, u, h / 2), G * u)
"""


def test_files_of_two_folders_have_each_the_helper_beside_it(tmp_path):
    for folder, number in (("ann", 1), ("bob", 2)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "helper.py").write_text(f"G = {number}")
        (tmp_path / folder / "step.py").write_text(HELPED.format(name="same"))
    ann, bob = (load(str(tmp_path / folder / "step.py")) for folder in ("ann", "bob"))
    assert (ann.variables["G"], bob.variables["G"]) == (1, 2)
    assert load(str(tmp_path / "ann" / "step.py")) is ann


def test_a_helper_that_was_changed_is_run_again(tmp_path):
    """Also one that only another helper imports."""
    (tmp_path / "helper.py").write_text("from numbers_of import G")
    (tmp_path / "numbers_of.py").write_text("G = 1")
    file = tmp_path / "mine.py"
    file.write_text(HELPED.format(name="mine"))
    first = load(str(file))
    (tmp_path / "numbers_of.py").write_text("G = 25")
    again = load(str(file))
    assert (first.variables["G"], again.variables["G"]) == (1, 25)
    assert again.digest != first.digest


@pytest.mark.parametrize("name", ["tabnanny", "statistics"])  # one is loaded, the other is not
def test_a_neighbour_of_a_standard_module_s_name_is_refused(name, tmp_path):
    """Which of the two was imported depended on what the process had loaded before."""
    (tmp_path / f"{name}.py").write_text("K = 1")
    (tmp_path / "mine.py").write_text(f"from {name} import K")
    with pytest.raises(BadInput, match=f"{name}.py has the name of a standard module.*rename it"):
        load(str(tmp_path / "mine.py"))
