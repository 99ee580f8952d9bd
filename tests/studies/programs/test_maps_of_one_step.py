"""Maps of one step, which have no h: their form, way back and volume alone are judged."""

import numpy as np
import pytest

from discmech import BadInput, Scheme, black_box, scenes
from discmech.studies.command.entry import main
from discmech.studies.core.case import Case
from discmech.studies.symplecticity import in_numbers
from discmech.studies.symplecticity.judging_numbers import judge
from discmech.studies.symplecticity.places import looks

from .judging import judged

RING = """
import numpy as np

from discmech import black_box

C, S = np.cos(1.3), np.sin(1.3)
BOX = [-0.3, -0.3], [0.3, 0.3]

def turned(q, p, kept):
    p = p - q**2
    return C * q + S * p, kept * (C * p - S * q)

@black_box(step=1, symplectic=True, states=BOX)
def turn(q, p):
    return turned(q, p, 1)

@black_box(step=1, symplectic=True, states=BOX, name="by-name")
def damped(q, p):
    return turned(q, p, 1 - 1e-9)

@black_box(step=1, keeps="volume", states=BOX)
def shrinks(q, p):
    return turned(q, p, 1 - 1e-9)
"""


@pytest.mark.parametrize(
    ("name", "code"), [("turn", 0), ("damped", 1), ("by-name", 1), ("shrinks", 1)]
)
def test_a_map_without_a_scene_is_judged_in_its_box_of_states(name, code, tmp_path, capsys):
    file = tmp_path / "ring.py"
    file.write_text(RING)
    assert main(["symplecticity", f"{file}:{name}"]) == code
    capsys.readouterr()


@pytest.mark.parametrize("words", [("symplecticity", ""), ("symplecticity", "--rule"), ("verify",)])
def test_the_maps_of_a_file_are_each_judged_in_their_own_box(words, tmp_path, capsys):
    file = tmp_path / "ring.py"
    file.write_text(RING)
    words = [*filter(None, words), str(file), "--fresh", "--jobs", "1"]
    assert main(words) == 1
    said = capsys.readouterr().out
    for name, verdict in (("turn", "pass"), ("by-name", "fail"), ("shrinks", "fail")):
        assert said.count(f"{verdict}: states-of-{name}, {name}, 16 digits") == (
            "verify" not in words
        )
        again = f"symplecticity {file}:states-of-{name} --rule {file}:{name} --digits 16"
        assert again in said or verdict == "pass" or "verify" not in words
    assert "no command" not in said and "by-name, turn" not in said and "its steps" not in said
    assert "✓ energy" not in said and "? order" not in said
    assert main(["energy", f"{file}:turn"]) == 2
    assert "only its form, volume and way back are judged" in capsys.readouterr().err


def test_a_pass_says_how_fine_its_box_was_looked_at():
    box = black_box(step=1, symplectic=True, states=([-1, -1], [1, 1]))(kicked(1))
    case = Case("symplecticity", box.own_scene, box, 16)
    told = judge(case, in_numbers.measure(case, lambda *_: None))
    assert told.verdict == "pass" and "from 4096 drawn states, one to 0.016 of each" in told.reason


def kicked(h):
    """Return Verlet of the pendulum's field turned by another force, which is another motion."""

    def step(q, p):
        p = p - h / 2 * q**3
        q = q + h * p
        return q, p - h / 2 * q**3

    return step


@pytest.mark.slow
def test_the_form_of_another_motion_is_judged_alone():
    box = black_box(step="0.1", symplectic=True, reversible=True)(kicked(0.1))
    found = judged("symplecticity", "pendulum", box, causes=False)
    assert found["verdict"] == "pass" and "not held against a scene's" in found["reason"]
    assert judged("reversibility", "pendulum", box, causes=False)["verdict"] == "pass"
    lossy = black_box(step="0.1", reversible=True)(lambda q, p: (q + 0.1 * p, p - 0.1 * q))
    found = judged("reversibility", "pendulum", lossy, causes=False)
    assert found["verdict"] == "fail" and "two turns of all momenta" in found["reason"]


def test_a_map_with_states_of_its_own_is_looked_at_on_the_scene_that_is_named():
    box = black_box(step=1, states=([-1, -1], [1, 1]))(kicked(1))
    assert {len(look.z) for look in looks(Scheme(box.own_scene, box))[0]} == {2}
    assert {len(look.z) for look in looks(Scheme(scenes.get("kepler"), box))[0]} == {4}


def test_it_has_no_order_and_makes_no_other_step():
    box = black_box(step="0.1", name="fixed")(kicked(0.1))
    found = judged("order", "pendulum", box, causes=False)
    assert found["verdict"] == "inconclusive" and "makes none of" in found["reason"]


@pytest.mark.parametrize(("given", "said"), [
    ({"step": 0}, "positive number"),
    ({"step": 1, "order": 2}, "without an order"),
    ({"step": 1, "runs": True}, "without an order"),
    ({"states": ([0, 0], [1, 1])}, "of a map with step"),
    ({"step": 1, "states": ([0, 0, 0], [1, 1, 1])}, "two lists of 2n numbers"),
    ({"step": 1, "states": ([0, 1], [1, 1])}, "below that of the second"),
])  # fmt: skip
def test_other_words_for_a_map_are_one_sentence(given, said):
    with pytest.raises(BadInput, match=said):
        black_box(**given)(lambda q, p: (np.sin(q), p))
