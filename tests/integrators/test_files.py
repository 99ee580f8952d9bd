"""A file is written whole, and of drafts only those go that an ended process of ours left."""

import os
import subprocess
import sys
import time

import pytest

from discmech import Scheme, midpoint
from discmech.integrators import files, scenes
from tests.foreign_files import check_untouched, foreign_files

DRAFTS = (
    "import os, sys; from pathlib import Path; from discmech.integrators.files import draft_folder;"
    "(draft_folder(Path(sys.argv[1])) / 'half').write_text('half'); os._exit(9)"
)
LEFT = "import os, sys; from pathlib import Path; os.replace = lambda *_: os._exit(9);" \
       "from discmech.integrators.files import write_atomically as write;" \
       "write(Path(sys.argv[1]) / 'file', 'half')"  # fmt: skip


def killed(program, folder):
    assert subprocess.run([sys.executable, "-c", program, str(folder)]).returncode == 9


@pytest.mark.slow
@pytest.mark.parametrize("days", [0, 1000])
def test_of_all_names_only_drafts_of_ended_processes_go(tmp_path, days):
    before = foreign_files(tmp_path, days)
    own = files.draft_folder(tmp_path)
    killed(DRAFTS, tmp_path)
    killed(LEFT, tmp_path)
    begun = [p for p in tmp_path.glob(f"{files.DRAFT}*-{'?' * 8}") if p != own]
    assert len(begun) == 2
    files.sweep(tmp_path)
    check_untouched(tmp_path, before)
    assert own.exists() and not any(p.exists() for p in begun)


def test_drafts_of_another_machine_go_after_a_day(tmp_path, monkeypatch):
    killed(LEFT, tmp_path)
    (draft,) = tmp_path.iterdir()
    monkeypatch.setattr(files, "_machine", lambda: "01234567")
    files.sweep(tmp_path)
    assert draft.exists()
    os.utime(draft, (time.time() - 2 * files.DAY,) * 2)
    files.sweep(tmp_path)
    assert not draft.exists()


def test_nothing_half_written_stays(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError("disk full")

    files.write_atomically(tmp_path / "kernel.py", "text", 0o640)
    assert (tmp_path / "kernel.py").stat().st_mode & 0o777 == 0o640
    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(OSError, match="disk full"):
        files.write_atomically(tmp_path / "kernel.py", "other text")
    (left,) = tmp_path.iterdir()
    assert left.read_text() == "text"


@pytest.mark.parametrize("days", [0, 1000])
def test_a_checkpoint_takes_nothing_beside_it(tmp_path, days):
    before = foreign_files(tmp_path, days)
    flow = Scheme(scenes.get("harmonic"), midpoint).flow("1/10")
    for steps in (4, 4):
        flow.trajectory(steps, checkpoint=tmp_path / "run")
    check_untouched(tmp_path, before)
