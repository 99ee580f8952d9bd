"""A study that was interrupted goes on where it stopped; a changed question starts anew."""

from __future__ import annotations

import pytest

from discmech.integrators import scenes
from discmech.integrators.rules import midpoint
from discmech.studies import get, journal
from discmech.studies.case import Choice
from discmech.studies.command import INTERRUPTED, main
from discmech.studies.running import run_study

CHOICE = Choice(scenes=tuple(map(scenes.get, ("kepler", "rigid-body", "heavy-top"))),
                rules=(midpoint,), digits=(16,), steps=10)  # fmt: skip


@pytest.fixture
def study(monkeypatch):
    """The momentum study with a measurement that keeps a list, and can be interrupted."""
    module = get("momentum")
    module_state = {"measured": [], "stop_at": None}

    def measure(case, progress):
        if case.scene.name == module_state["stop_at"]:
            raise KeyboardInterrupt
        module_state["measured"].append(case.scene.name)
        drift = 0.1 * len(module_state["measured"]) / 10**14
        return {"measured": {"drift": {"J": drift}}, "rows": [{"step": 1, "drift": {"J": drift}}],
                "steps": 10}  # fmt: skip

    monkeypatch.setattr(module, "measure", measure)

    def run(stop_at=None, choice=CHOICE):
        """The scenes measured by this run, and its result (None if it was interrupted)."""
        module_state.update(measured=[], stop_at=stop_at)
        try:
            found = run_study(module, choice, keep=True)
        except KeyboardInterrupt:
            found = None
        return module_state["measured"], found

    return run


@pytest.fixture
def kept(tmp_path):
    return lambda: sorted((tmp_path / "cache" / "unfinished").glob("*.jsonl"))


def test_it_goes_on_where_it_stopped(study, kept):
    assert study("rigid-body") == (["kepler"], None)
    assert len(kept()) == 1
    assert study("heavy-top") == (["rigid-body"], None)
    measured, found = study()
    assert measured == ["heavy-top"]
    assert [c["scene"] for c in found["cases"]] == ["kepler", "rigid-body", "heavy-top"]
    assert found["verdict"] == "pass" and not kept()


def test_what_was_kept_is_what_was_measured(study):
    study("rigid-body")
    _, resumed = study()
    _, whole = study()
    first, again = resumed["cases"][0], whole["cases"][0]
    for case in (first, again):
        del case["seconds"]
    assert first == again  # floats too, to the last bit


def test_once_complete_nothing_is_remembered(study, kept):
    assert len(study()[0]) == 3 and not kept()
    assert len(study()[0]) == 3


def test_other_steps_or_digits_start_anew(study):
    study("rigid-body")
    other = Choice(CHOICE.scenes, CHOICE.rules, digits=(16,), steps=20)
    assert study(choice=other)[0] == ["kepler", "rigid-body", "heavy-top"]
    assert study()[0] == ["rigid-body", "heavy-top"]  # the first question is still remembered


def test_changed_sources_start_anew(study, tmp_path, monkeypatch):
    """The key is made of the sources beside the journal's own file."""
    tree = tmp_path / "checkout"
    for name in ("integrators", "reference", "studies"):
        (tree / name / "inner").mkdir(parents=True)
        (tree / name / "inner" / "a.py").write_text("1")
    monkeypatch.setattr(journal, "__file__", str(tree / "studies" / "journal.py"))
    study("rigid-body")
    assert study("heavy-top")[0] == ["rigid-body"]
    for name in ("integrators", "reference", "studies"):
        (tree / name / "inner" / "a.py").write_text(f"2 {name}")
        assert study("heavy-top")[0] == ["kepler", "rigid-body"], name


def test_a_changed_scene_of_the_same_name_is_measured(study):
    study("rigid-body")
    changed = scenes.get("kepler").with_values(parameters={"strength": 2})
    other = Choice((changed, *CHOICE.scenes[1:]), CHOICE.rules, digits=(16,), steps=10)
    assert study(choice=other)[0] == ["kepler", "rigid-body", "heavy-top"]


def test_without_keep_nothing_is_written(study, kept, monkeypatch):
    def measure(case, progress):
        if case.scene.name == "rigid-body":
            raise KeyboardInterrupt
        return {"measured": {"drift": {}}, "rows": [], "steps": 10}

    monkeypatch.setattr(get("momentum"), "measure", measure)
    with pytest.raises(KeyboardInterrupt):
        run_study(get("momentum"), CHOICE)
    assert not kept()


@pytest.mark.parametrize("damage", ['{"key": "half of a li', "", "not JSON at all"])
def test_a_line_that_was_being_written_is_left_out(study, kept, damage):
    study("heavy-top")
    (path,) = kept()
    first = next(line for line in path.read_text(encoding="utf-8").splitlines() if line)
    path.write_text(first + "\n" + damage, encoding="utf-8")
    assert study()[0] == ["rigid-body", "heavy-top"]


def test_what_follows_half_a_line_is_kept(study, kept):
    study("rigid-body")
    (path,) = kept()
    path.write_text(path.read_text(encoding="utf-8") + '{"key": "half', encoding="utf-8")
    assert study("heavy-top")[0] == ["rigid-body"]
    assert study()[0] == ["heavy-top"]


@pytest.mark.parametrize(
    "line",
    ["5", "{}", "[]", '"text"'],
)
def test_a_line_of_something_else_is_left_out(study, kept, line):
    study("rigid-body")
    (path,) = kept()
    with path.open("a", encoding="utf-8") as file:
        file.write(line + "\n")
    assert study()[0] == ["rigid-body", "heavy-top"]


def test_from_the_command_line(study, kept, capsys, monkeypatch):
    words = ["momentum", "kepler", "heavy-top", "--rule", "midpoint", "--digits", "16"]
    module = get("momentum")
    good, asked = module.measure, []

    def measure(case, progress):
        asked.append(case.scene.name)
        if len(asked) == 2:
            raise KeyboardInterrupt
        return good(case, progress)

    monkeypatch.setattr(module, "measure", measure)
    assert main(words) == INTERRUPTED == 130
    assert "goes on where it stopped" in capsys.readouterr().err
    assert len(kept()) == 1
    assert main(words) == 0
    assert asked == ["kepler", "heavy-top", "heavy-top"] and not kept()


def test_the_folder_is_that_of_the_environment(tmp_path, monkeypatch):
    from discmech.integrators.compiler import cache_folder

    monkeypatch.setattr(journal, "cache_folder", cache_folder)
    monkeypatch.setenv("DISCMECH_CACHE", str(tmp_path / "mine"))
    assert journal.Journal("order", CHOICE).path.is_relative_to(tmp_path / "mine")
