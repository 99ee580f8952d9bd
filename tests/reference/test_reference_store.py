"""Answers that are kept: files, tables, the cache; and how far a run has come."""

import json
import os
from dataclasses import fields, replace
from fractions import Fraction
from types import SimpleNamespace

import gmpy2
import mpmath
import pytest
import sympy
from mpmath import mpf

from discmech.integrators.files import prune
from discmech.reference import ReferenceFailure
from discmech.reference.answer import cache, store
from discmech.reference.answer.result import Solution
from discmech.reference.equations import exact
from discmech.reference.failures import Damaged
from discmech.reference.progress import progress_to, tell
from tests.foreign_files import check_untouched, foreign_files

TENTH = Fraction(1, 10)


def row(t=TENTH, digits=50, turned=True, **more):
    with mpmath.workdps(digits + 6):
        numbers = [mpf(1) / 3, mpf("1.5e-9"), mpf("-2e12"), mpf("0.004")]
        attitude = mpmath.matrix([numbers[:2], numbers[2:]]) if turned else None
        made = Solution(t, numbers, numbers[:1], [], attitude, digits, "a", "μ kept to 50 digits")
        return replace(made, **more)


def test_a_file_holds_what_was_written_and_nobody_else_may_change_it(tmp_path):
    table = store.Table("name", "key", (row(bound=mpf("1.25e-60"), certainty="enclosure"),
                                        row(turned=False, digits=20)))  # fmt: skip
    path = tmp_path / "new" / "folder" / "table.json"
    for _ in range(2):
        store.write(path, table)
    assert os.stat(path).st_mode & 0o777 == 0o644 and os.listdir(path.parent) == ["table.json"]
    assert "μ kept" in path.read_text(encoding="utf-8")  # for people
    found, text = store.read(path), path.read_text(encoding="utf-8")
    store.write(path, found)
    assert path.read_text(encoding="utf-8") == text  # nothing is lost by reading
    for old, new in zip(table.rows, found.rows, strict=True):
        for field in fields(Solution):
            before, after = getattr(old, field.name), getattr(new, field.name)
            if field.name in ("x", "mu", "v", "attitude") and before is not None:
                pairs = zip(before, after, strict=True)
                unit = mpf(10) ** -(old.certain_digits + 2)
                with mpmath.workdps(80):
                    assert all(abs(b - a) <= unit * abs(b) for b, a in pairs)
            elif field.name == "bound" and before is not None:
                assert mpmath.nstr(before, 3) == mpmath.nstr(after, 3)
            else:
                assert before == after


def each_change(content):
    """The content with one thing in it changed, at whatever depth."""
    if isinstance(content, dict | list):
        places = content if isinstance(content, dict) else range(len(content))
        for place in places:
            for new in each_change(content[place]):
                changed = content.copy()
                changed[place] = new
                yield changed
        if isinstance(content, dict):
            for name in content:
                yield {other: value for other, value in content.items() if other != name}
        yield content * 2 if content and isinstance(content, list) else [content]
    else:
        yield None if content is not None else 1
        yield f"{content}0" if isinstance(content, str) else 2


def test_a_file_in_which_anything_was_changed_is_not_believed(tmp_path):
    path = tmp_path / "table.json"
    store.write(path, store.Table("name", "key", (row(bound=mpf("1e-60")),)))
    content = json.loads(path.read_text(encoding="utf-8"))
    changes = list(each_change(content))
    assert len(changes) > 40
    for changed in changes:
        path.write_text(json.dumps(changed), encoding="utf-8")
        with pytest.raises(Damaged, match=r"^table\.json "):
            store.read(path)
    content.pop("checksum")
    for schema in (store.SCHEMA - 1, store.SCHEMA + 1):
        other = content | {"schema": schema}
        path.write_text(json.dumps(other | {"checksum": store.checksum(other)}), encoding="utf-8")
        with pytest.raises(Damaged, match=f"has the schema {schema} instead of {store.SCHEMA}"):
            store.read(path)


@pytest.mark.parametrize(
    "text", ["", "{}", "[1]", "3", '"text"', "null", "\x00", '{"checksum": 1}']
)
def test_what_is_no_table_is_damaged(tmp_path, text):
    path = tmp_path / "table.json"
    with pytest.raises(Damaged, match=r"table\.json cannot be read \(FileNotFound"):
        store.read(path)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(Damaged, match=r"table\.json cannot be read \("):
        store.read(path)


def test_a_table_answers_with_the_row_that_has_what_was_asked_for():
    plain, turned = row(turned=False, digits=60), row(digits=50)
    later = row(Fraction(3), turned=False, digits=30)
    table = store.Table("name", "key", (later,)).with_rows([turned, plain])
    assert table.with_rows([]).rows == table.rows == (turned, plain, later)
    assert table.with_rows([replace(later, certain_digits=31)]).rows[:2] == (turned, plain)
    assert store.Table("name", "key", (plain, turned)).row(TENTH, 50, True) == turned
    assert table.row(TENTH, 51, True) is None and table.row(Fraction(2), 1, False) is None
    assert table.row(TENTH, 60, False) == plain and table.row(TENTH, 61, False) is None
    assert table.row(TENTH, 20, True) == turned.limited_to(20, True)
    assert table.row(TENTH, 20, False) == turned.limited_to(20, False)
    assert table.row(Fraction(3), 30, True) is None


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="rights are no bits")
def test_a_file_that_others_can_write_is_not_believed(own_references, caplog):
    cache.keep("name", "key", [row()])
    (path,) = own_references.glob("name_*.json")
    path.chmod(0o666)
    assert cache.kept("name", "key").rows == () and "was damaged" in caplog.text
    cache.keep("name", "key", [row()])
    assert len(cache.kept("name", "key").rows) == 1


@pytest.mark.parametrize("days", [0, 1000])
def test_of_old_files_only_tables_go(own_references, days):
    before = foreign_files(own_references, days)
    cache.keep("name", "key", [row()])
    (path,) = own_references.glob("name_*.json")
    copy = own_references / "copy.json"
    copy.write_bytes(path.read_bytes())
    for old in (path, copy):
        os.utime(old, (0, 0))
    (own_references / "pruned").unlink()
    prune.cache_clear()
    cache.keep("other", "key", [row()])
    assert not path.exists() and copy.exists()
    del before["pruned"]
    check_untouched(own_references, before)


def test_the_cache_keeps_what_has_the_key(own_references, monkeypatch):
    assert cache.kept("name", "key").rows == ()
    cache.keep("name", "key", [row()])
    cache.keep("name", "key", [row(Fraction(3))])
    assert [r.t for r in cache.kept("name", "key").rows] == [TENTH, 3]
    assert cache.kept("name", "other").rows == cache.kept("other", "key").rows == ()
    names = cache.name_of("name", "key"), cache.name_of("name", "other")
    one, other = (own_references / name for name in names)
    for key in ("another", "zzz"):  # before it and after it in the alphabet
        store.write(other, replace(store.read(one), key=key))
        assert cache.kept("name", "other").rows == ()
    monkeypatch.setattr(cache, "_program", lambda: "other code")
    assert cache.name_of("name", "key") != one.name
    monkeypatch.setattr(cache, "write", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        cache.keep("name", "key", [row()])

    def full(*_):
        raise OSError("no space left")

    monkeypatch.setattr(cache, "write", full)
    cache.keep("name", "key", [row()])


def test_progress_is_a_share_of_the_way_either_way():
    seen = []
    tell("nobody listens", gmpy2.mpq(1), gmpy2.mpq(2))
    with progress_to(lambda label, share: seen.append((label, share))):
        for now, goal in ((1, 4), (-1, -4), (5, 4), (0, 0)):
            tell("a", gmpy2.mpq(now), gmpy2.mpq(goal))
    tell("nobody listens", gmpy2.mpq(1), gmpy2.mpq(2))
    assert [share for _, share in seen] == [0.25, 0.25, 1, 1]
    assert seen[0][0] == "a, t = 1.0"


def test_no_parameters_are_an_empty_space():
    scene = SimpleNamespace(name="s", parameters={"k": "1/2"})
    assert exact.parameter_values(scene).k == sympy.Rational(1, 2)
    with pytest.raises(ReferenceFailure, match="parameter k of scene s = None is not"):
        exact.parameter_values(SimpleNamespace(name="s", parameters={"k": None}))
