"""Maps of one step, which have no h: their form, way back and volume alone are judged."""

import numpy as np
import pytest

from discmech import BadInput, Scheme, black_box, scenes
from discmech.studies.command.entry import main
from discmech.studies.core.case import Case, silent
from discmech.studies.symplecticity import in_numbers
from discmech.studies.symplecticity.judging_numbers import cause_in_box, judge
from discmech.studies.symplecticity.jumps import jumps_of
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

@black_box(step=1, symplectic=True, states=BOX, vectorised=True)
def turn(q, p):
    return turned(q, p, 1)

@black_box(step=1, symplectic=True, states=BOX, name="by-name", vectorised=True)
def damped(q, p):
    return turned(q, p, 1 - 1e-9)

@black_box(step=1, keeps="volume", states=BOX, vectorised=True)
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


@pytest.mark.dear("words1")
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
    box = in_a_box(kicked(1), [-1, -1], [1, 1])
    case = Case("symplecticity", box.own_scene, box, 16)
    told = judge(case, in_numbers.measure(case, lambda *_: None))
    assert told.verdict == "pass" and "from 4096 drawn states, one to 0.016 of each" in told.reason


def in_a_box(step, low, high):
    return black_box(step=1, symplectic=True, states=(low, high), vectorised=True)(step)


def turned(q, p, side=0, jump=(0, 0)):
    p = p - q**2 + jump[0] * side
    return np.cos(1.3) * q + np.sin(1.3) * p, np.cos(1.3) * p - np.sin(1.3) * q + jump[1] * side


def bounced(q, p):
    q = q + p / 5
    inside = (q > 0) & (q < 1)
    return np.where(inside, q, 2 * (q > 1) - q), np.where(inside, p, -p)


def cut_off(q, p):
    pushed = 3 * q * ((q * q).sum(axis=0) < 0.04)
    return q + p + pushed, p + pushed


#: maps that jump, their boxes, and the share of the jump that is not along the surface's image
JUMPS = {
    "none": (lambda q, p: turned(q, p), 0.3, None),
    "angle": (lambda q, p: ((q + p) % (2 * np.pi), p), 6.0, None),
    "angle within a turn": (lambda q, p: (np.arctan2(np.sin(q + p), np.cos(q + p)), p), 3.0, None),
    "unit torus": (lambda q, p: ((2 * q + p) % 1, (q + p) % 1), 1.0, None),
    "kink": (lambda q, p: turned(q, p, q > 0.1, (1e-7, 0)), 0.3, 0),
    "wall": (bounced, 1.0, 0),
    "cut off": (cut_off, 0.3, 0),
    "shift": (lambda q, p: turned(q, p, q > 0.1, (0, 1e-7)), 0.3, 1),
    "slanted kick": (lambda q, p: turned(q, p, q + p / 2 > 0.1, (1e-9, 0)), 0.3, 0.5),
    "part of a jump": (lambda q, p: turned(q, p, q + p / 20 > 0.1, (1e-7, 0)), 0.3, 0.05),
}  # fmt: skip


@pytest.mark.sampled
@pytest.mark.parametrize("name", JUMPS)
@pytest.mark.parametrize("degrees", [1, 2])
def test_a_jump_is_along_its_surface_or_across(name, degrees):
    step, side, wanted = JUMPS[name]
    if degrees == 2 and name != "cut off":
        one = step

        def step(q, p):
            ends = [one(q[k : k + 1], p[k : k + 1]) for k in range(2)]
            return tuple(np.concatenate(part) for part in zip(*ends, strict=True))

    made = in_a_box(step, 2 * degrees * [-side], 2 * degrees * [side])
    case = Case("symplecticity", made.own_scene, made, 16)
    jumps = jumps_of(case, np.full(2 * degrees, side))
    assert bool(jumps) == (wanted is not None)
    if jumps:
        across = np.median([jump.across for jump in jumps if jump.across is not None])
        assert across < 1e-3 if wanted == 0 else 0.3 * wanted < across


@pytest.mark.dear("shift")
@pytest.mark.parametrize(("name", "verdict"), [("shift", "fail"), ("kink", "pass")])
def test_a_map_that_is_not_one_to_one_fails_and_a_kick_is_named(name, verdict):
    step, side, _ = JUMPS[name]
    box = in_a_box(step, [-side] * 2, [side] * 2)
    found = judged("symplecticity", box.own_scene, box)
    assert found["verdict"] == verdict and " jumps by 3." in found["reason"]
    assert verdict == "pass" or found["diagnosis"]["cause"] == "jump"


A = np.array([1.3, 2.0])


def turned_by(q, p):
    return np.cos(A) * q + np.sin(A) * p, np.cos(A) * p - np.sin(A) * q


def untwinned(q, p):
    q, p = turned_by(q, p)
    return q + np.array([1e-6 * p[1], 0]), p


def damped_in_a_part(q, p):
    return turned_by(q, p * (1 - 1e-5 * (q > 0).all()))


def damped_in_one(q, p):
    return turned_by(q, p * np.array([1, 1 - 1e-6]))


@pytest.mark.parametrize(("step", "cause", "said"), [
    (lambda q, p: (p + np.sin(q), q), "turned form", "without a sign"),
    (lambda q, p: turned_by(q, p + 1e-6 * np.round(30 * p)), "jump", "between states close by"),
    (untwinned, "no gradient", "in {x[1], x[0]}, at 6 of 6 states"),
    (damped_in_one, "volume", "planes not alike"),
    (damped_in_a_part, "volume", "every plane by 1 − 1e-05, at "),
])  # fmt: skip
def test_what_a_map_makes_of_the_form_is_told(step, cause, said):
    box = black_box(step=1, symplectic=True, states=([-1] * 4, [1] * 4), name="box")(step)
    case = Case("symplecticity", box.own_scene, box, 16)
    told = cause_in_box(case, in_numbers.measure(case, silent))
    assert told["cause"] == cause and said in told["sentence"]


def test_a_run_ends_where_its_orbit_leaves_the_box():
    box = in_a_box(lambda q, p: (1 - 1.4 * q**2 + p, -q), [-2, -2], [2, 2])
    found = judged("symplecticity", box.own_scene, box, causes=False)
    assert found["verdict"] == "pass"
    box = in_a_box(lambda q, p: (q + p, p), [1, 1], [2, 2])
    found = judged("symplecticity", box.own_scene, box, causes=False)
    assert found["verdict"] == "pass" and "orbits leave the box after 1 step" in found["reason"]


def kicked(h):
    """Return Verlet of the pendulum's field turned by another force, which is another motion."""

    def step(q, p):
        p = p - h / 2 * q**3
        q = q + h * p
        return q, p - h / 2 * q**3

    return step


@pytest.mark.parametrize(("off", "turns", "verdict"), [
    (0, 0, "pass"), (1e-7, 0, "fail"), (0, 1, "fail"),
])  # fmt: skip
def test_a_map_of_an_angle_goes_back_but_for_whole_turns(off, turns, verdict):
    """One that moves each state by a turn knows on which turn it is."""

    def standard(q, p):
        q = q + p / 2
        p = p + 0.9 * np.sin(q)
        q = q + p / 2 + off * (p > 0)
        return q + 2 * np.pi if turns else np.mod(q, 2 * np.pi), p

    box = black_box(step=1, reversible=True, states=([-3, -2], [3, 2]))(standard)
    assert judged("reversibility", box.own_scene, box, causes=False)["verdict"] == verdict


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
    ({"step": 1, "keeps": ("volume", "energy")}, "and nothing else that it keeps: leave it out"),
    ({"step": 1, "states": ([0, 0, 0], [1, 1, 1])}, "two lists of 2n numbers"),
    ({"step": 1, "states": ([0, 1], [1, 1])}, "below that of the second"),
])  # fmt: skip
def test_other_words_for_a_map_are_one_sentence(given, said):
    with pytest.raises(BadInput, match=said):
        black_box(**given)(lambda q, p: (np.sin(q), p))


def test_the_middle_of_a_box_may_have_no_value():
    @black_box(step=1, symplectic=True, states=([-1, -1], [1, 1]))
    def singular(q, p):
        with np.errstate(all="ignore"):
            p = p - 0.001 / q
        return q + 0.001 * p, p

    told = judged("symplecticity", singular.own_scene, singular, causes=False)
    assert told["verdict"] == "pass", told["reason"]
