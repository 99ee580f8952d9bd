"""Frozen tables and the cache: they fit, they are right, and what is not is refused."""

import datetime
import json
import random
import re
import shutil
from dataclasses import replace
from fractions import Fraction

import mpmath
import pytest
import sympy

from discmech.integrators import scenes
from discmech.reference import ReferenceFailure, solution
from discmech.reference.answer import cache, certify, frozen, store
from discmech.reference.answer.problem import Problem
from discmech.reference.answer.solution import forget
from discmech.reference.failures import Uncertain


@pytest.fixture
def copies(tmp_path, monkeypatch):
    """The frozen tables in a folder where they may be spoilt."""
    folder = tmp_path / "tables"
    shutil.copytree(frozen.FOLDER, folder)
    monkeypatch.setattr(frozen, "FOLDER", folder)
    forget()
    yield folder
    forget()


@pytest.mark.parametrize("name", frozen.names())
def test_every_scene_has_a_table_that_fits(name):
    scene = scenes.get(name)
    table = store.read(frozen.file_of(name))
    assert table.scene == name and table.key == Problem.of(scene).key
    assert [row.t for row in table.rows] == frozen.times_of(scene)
    assert len(table.rows) >= 4 and scene.duration in {row.t for row in table.rows}
    for row in table.rows:
        assert row.certain_digits == 50 and row.certainty == "enclosure" and row.bound < 1e-50
        if scene.force is None and not scene.timed:  # else nothing keeps the energy
            assert "energy" in row.evidence
        assert int(re.search(r"extrapolation agrees to (\d+) digits", row.evidence)[1]) >= 50


def test_no_table_is_left_over():
    assert {path.stem for path in frozen.FOLDER.glob("*")} == set(frozen.names())


def test_chaotic_scenes_are_followed_far():
    for name in set(frozen.CHAOTIC) & set(frozen.names()):
        assert max(row.t for row in store.read(frozen.file_of(name)).rows) >= 20


def first(rows):
    return rows[:1]


DEAR = ("outer-solar-system",)  # takes a minute


def test_a_sample_of_the_tables_is_right():
    """Another scene and time each day; the whole of it is the slow test below."""
    seed = datetime.date.today().toordinal()
    print(f"sample of {seed}")
    luck = random.Random(seed)
    name = luck.choice([n for n in frozen.names() if n not in DEAR])

    def one(rows):
        return [luck.choice([row for row in rows if row.t <= 10])]

    assert frozen.check(name, one) >= 49, f"{name}, sample of {seed}"


@pytest.mark.slow
@pytest.mark.parametrize("name", frozen.names())
def test_every_table_is_right(name):
    assert frozen.check(name) >= 49


def spoil(path, change):
    content = json.loads(path.read_text(encoding="utf-8"))
    change(content)
    path.write_text(json.dumps(content), encoding="utf-8")


def wrong_digit(content):
    row = content["rows"][1]
    text = row["mu"][0]
    place = len(text) - 8
    row["mu"][0] = text[:place] + str((int(text[place]) + 5) % 10) + text[place + 1 :]


def test_a_wrong_digit_does_not_fit_the_checksum(copies):
    spoil(copies / "kepler.json", wrong_digit)
    with pytest.raises(ReferenceFailure, match=r"kepler.json does not fit its checksum.*--rebuild"):
        solution("kepler", 5)


def test_a_table_may_be_off_by_two_roundings(monkeypatch):
    (row,) = first(store.read(frozen.file_of("harmonic")).rows)
    assert row.certain_digits % 2 == 0
    monkeypatch.setattr(frozen, "agreement", lambda *_: row.certain_digits - 1)
    assert frozen.check("harmonic", first) == row.certain_digits - 1
    monkeypatch.setattr(frozen, "agreement", lambda *_: row.certain_digits - 2)
    with pytest.raises(ReferenceFailure, match=f"only {row.certain_digits - 2} of its"):
        frozen.check("harmonic", first)


@pytest.mark.slow
def test_a_wrong_digit_with_a_right_checksum_is_found(copies):
    def forge(content):
        content.pop("checksum")
        wrong_digit(content)
        content["checksum"] = store.checksum(content)

    assert frozen.check("kepler") >= 49
    spoil(copies / "kepler.json", forge)
    with pytest.raises(ReferenceFailure, match=r"wrong at t = 5/2: only 4\d of its 50 digits"):
        frozen.check("kepler")


@pytest.mark.slow
def test_a_reference_of_a_perturbed_lagrangian_is_found(copies, monkeypatch):
    """Another force by one part in 1e40: another fingerprint; forged, the digits tell."""
    scene = scenes.get("kepler")

    def lagrangian(x, v, p):
        return scene.lagrangian(x, v, p) + x.dot(x) / 10**40

    perturbed = replace(scene, lagrangian=lagrangian)
    key = Problem.of(scene).key
    assert Problem.of(perturbed).key != key
    assert frozen.fitting("kepler", Problem.of(perturbed).key) is None
    monkeypatch.setattr(frozen, "scene_of", lambda name: perturbed)
    made = frozen.build("kepler")
    monkeypatch.undo()
    monkeypatch.setattr(frozen, "FOLDER", copies)
    with pytest.raises(ReferenceFailure, match=r"made for another kepler.*--rebuild kepler"):
        solution("kepler", 5)
    store.write(frozen.file_of("kepler"), replace(made, key=key))
    with pytest.raises(ReferenceFailure, match=r"kepler.json is wrong at t = .*: only (3|4)\d of"):
        frozen.check("kepler")


def test_no_two_systems_share_a_fingerprint():
    """A force that vanishes at any number of points is still another system."""
    scene = scenes.get("harmonic")

    def key(more=0, **changes):
        force = replace(scene, lagrangian=lambda x, v, p: scene.lagrangian(x, v, p) + more * x[0])
        return Problem.of(force.with_values(**changes)).key

    x = Problem.of(scene).mechanics.x[0]
    points = [
        sympy.Rational(2 * i + 3 * k + 5, 7 * i + 11 + 4 * k) for i in (0, 1) for k in (0, 1, 2)
    ]
    vanishing = sympy.prod(x - point for point in points)
    keys = [key(), key(vanishing), key(abs(x) - x), key(sympy.Rational(1, 10**70)),
            key(x0=[2]), key(v0=["1e-300"]), key(parameters={"stiffness": "1.5"})]  # fmt: skip
    assert len(set(keys)) == len(keys) and key() == Problem.of(scene).key


def test_the_order_of_terms_is_no_other_system():
    scene = scenes.get("kepler")
    turned = replace(
        scene,
        lagrangian=lambda x, v, p: sympy.Add(
            *reversed(sympy.Add.make_args(scene.lagrangian(x, v, p))), evaluate=False
        ),
    )
    assert Problem.of(turned).key == Problem.of(scene).key


@pytest.mark.parametrize(
    "text, reason",
    [("", "cannot be read"), ("{}", "cannot be read"), ("[1]", "cannot be read"), (None, "Decode")],
)
def test_damaged_tables_are_named_with_the_mend(copies, text, reason):
    path = copies / "pendulum.json"
    if text is None:
        path.write_bytes(path.read_bytes()[:500])
    else:
        path.write_text(text, encoding="utf-8")
    with pytest.raises(ReferenceFailure) as failure:
        solution("pendulum", 10)
    assert reason in str(failure.value) and "\n" not in str(failure.value)
    assert str(failure.value).endswith("say discmech reference --rebuild pendulum")


def test_rebuilding_mends(copies):
    path = copies / "harmonic.json"
    right = path.read_text(encoding="utf-8")
    path.write_text("{", encoding="utf-8")
    frozen.build("harmonic")
    assert path.read_text(encoding="utf-8") == right


def test_an_interrupted_write_leaves_the_old_file(copies, monkeypatch):
    path = copies / "harmonic.json"
    right = path.read_text(encoding="utf-8")

    def stopped(*names):
        raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", stopped)
    with pytest.raises(KeyboardInterrupt):
        store.write(path, store.read(path))
    assert path.read_text(encoding="utf-8") == right
    assert not list(copies.glob(".*"))


def nothing_is_computed(*ignored, **named):
    raise AssertionError("this should have been known")


def test_tables_answer_without_computing(monkeypatch):
    forget()
    monkeypatch.setattr(certify, "certified_integration", nothing_is_computed)
    found = solution("heavy-top", 20, digits=40)
    assert found.certain_digits == 40 and found.certainty == "enclosure"
    assert found.attitude is None
    assert solution("heavy-top", 20, attitude=True).attitude.rows == 3
    with pytest.raises(AssertionError):
        solution("heavy-top", 20, digits=51)


def test_what_was_computed_is_kept_until_the_scene_changes(own_references, monkeypatch):
    forget()
    scene = scenes.get("henon-heiles")
    found = solution(scene, "0.3", digits=31)
    forget()
    with monkeypatch.context() as patch:
        patch.setattr(certify, "certified_integration", nothing_is_computed)
        again = solution(scene, Fraction(3, 10), digits=31)
        assert max(abs(a - b) for a, b in zip(again.x, found.x, strict=True)) < 1e-33
        assert again.evidence == found.evidence and again.certainty == found.certainty
        forget()
        with pytest.raises(AssertionError):
            solution(scene.with_values(parameters={"coupling": "1.000000001"}), "0.3", digits=31)
    (file,) = own_references.glob("henon-heiles_*.json")
    file.write_text("nonsense", encoding="utf-8")
    forget()
    assert solution(scene, "0.3", digits=31).x == found.x
    assert cache.kept("henon-heiles", Problem.of(scene).key).rows


def test_what_has_no_proof_is_kept_for_those_who_ask_for_none(own_references, monkeypatch):
    forget()
    found = solution("henon-heiles", "0.3", digits=31, proof=False)
    forget()
    monkeypatch.setattr(certify, "certified_integration", nothing_is_computed)
    again = solution("henon-heiles", "0.3", digits=31, proof=False)
    assert again.evidence == found.evidence and again.certainty == "agreement"
    with pytest.raises(AssertionError):
        solution("henon-heiles", "0.3", digits=31)


@pytest.mark.slow
def test_a_table_is_checked_whole_and_must_be_there(copies):
    """Also its attitude, and only what is in it."""
    name = "rigid-body"
    table = store.read(frozen.file_of(name))

    assert frozen.check(name, first) >= 49
    (row,) = first(table.rows)
    turned = row.attitude.copy()
    turned[1, 2] += mpmath.mpf(10) ** -40
    for wrong in ({"attitude": turned}, {"v": [row.v[0] + mpmath.mpf(10) ** -40, *row.v[1:]]},
                  {"mu": [*row.mu[:2], -row.mu[2]]}):  # fmt: skip
        store.write(frozen.file_of(name), replace(table, rows=(replace(row, **wrong),)))
        with pytest.raises(ReferenceFailure, match=f"{name}.json is wrong at t = {row.t}: only"):
            frozen.check(name)
    store.write(frozen.file_of(name), replace(table, rows=(replace(row, attitude=None),)))
    assert frozen.check(name) >= 49
    frozen.file_of(name).unlink()
    with pytest.raises(ReferenceFailure, match=r"no frozen table of rigid-body.*--rebuild rigid"):
        frozen.check(name)
    assert frozen.fitting("another", "key") is None


def test_a_table_that_is_not_certain_is_not_written(copies, monkeypatch):
    before = frozen.file_of("harmonic").read_text(encoding="utf-8")
    right = Problem.solve

    def poorer(self, times, *given, **more):
        found = right(self, times, *given, **more)
        return found | {times[-1]: replace(found[times[-1]], certain_digits=frozen.DIGITS - 1)}

    monkeypatch.setattr(Problem, "solve", poorer)
    with pytest.raises(Uncertain, match=r"harmonic at t = 10 has only 49 certain .*\(Taylor"):
        frozen.build("harmonic")
    assert frozen.file_of("harmonic").read_text(encoding="utf-8") == before
