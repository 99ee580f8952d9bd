"""No command deletes or changes a file that is not ours, whatever its name, age and place."""

import os
import subprocess
import sys

import pytest

from tests.foreign_files import check_untouched, files_in, foreign_files

ORDER = "order harmonic --rule midpoint --digits 16"
#: what reads or writes the cache, results, history, baselines, references, checkpoints
COMMANDS = (
    f"{ORDER} --save-baseline thesis", f"{ORDER} --baseline thesis", f"{ORDER} --baseline other",
    f"{ORDER} --fresh", "reference harmonic --time 1/3", "run harmonic --rule midpoint --steps 4",
    "checkpoint",
)  # fmt: skip
PROGRAM = """
import sys
from discmech.studies.command.entry import main
for words in sys.argv[1:]:
    if words == "checkpoint":
        from discmech import Scheme, midpoint
        from discmech.integrators import scenes
        flow = Scheme(scenes.get("harmonic"), midpoint).flow("1/10")
        flow.trajectory(4, checkpoint="run")
    elif code := main(words.split()):
        sys.exit(f"{words} ends with {code}")
"""


@pytest.mark.slow
@pytest.mark.parametrize("days", [0, 1000])
def test_other_peoples_files_survive_every_command(tmp_path, days):
    before = foreign_files(tmp_path, days)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *COMMANDS], cwd=tmp_path, capture_output=True, text=True,
        env=os.environ | {"DISCMECH_CACHE": "."},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    check_untouched(tmp_path, before)
    ours = {name.split("/")[0] for name in set(files_in(tmp_path)) - set(before)}
    assert {name for name in ours if "run" not in name} == {"discmech-cache", "discmech-baselines"}
