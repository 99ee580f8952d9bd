"""Seeded faults that must be caught, and random valid rules that must not be."""

from discmech.studies.core.options import Option, refuse
from discmech.studies.core.study import StudyFolder


def _unit(text: str) -> int:
    try:
        power = int(text)
    except ValueError:
        power = 1000
    if abs(power) > 150:
        refuse(f"--unit is {text!r}: give a whole number from -150 to 150.")
    return power


def _seed(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 19):
        refuse(f"--seed is {text!r}: give a whole number from 0 on, of 18 digits at most.")
    return int(text)


STUDY = StudyFolder(
    name="power",
    package=__name__,
    of_the_bench=True,
    place=10,
    title="The power of the bench",
    summary="seeded faults that must be caught, and random valid rules that must not be",
    asks="does the bench catch seeded faults?",
    measured="seeded faults in rules, groupoids, equations and the solver; random valid rules",
    judged="every fault caught or proved to be none, no false alarm",
    about=(
        "The bench itself is tested: seeded faults in rules, groupoids, retractions, derived "
        "equations, coefficients of compositions and the solver (a sign, a factor, a missing or "
        "wrong power, an index, a transposed matrix, a stale value, the misprints of the paper) "
        "each go through the studies, and so do random rules that are valid. A fault has to be "
        "caught by one study at least, or proved to be none; no valid rule may be refused. It "
        "can mislead: runs are short, on four scenes, so a fault that only shows "
        "after a million steps survives here and is caught by the whole studies; and faults are "
        "as many as somebody thought of."
    ),
    usual=False,
    of_systems=False,
    options=(
        Option("--thorough", "all faults and 200 rules, not one in 12"),
        Option("--unit", "faults alone, on scenes with an action 10^K times as large", "K", _unit),
        Option(
            "--seed",
            "faults at other places, another sample, other rules: of numbers nobody has seen",
            "S",
            _seed,
        ),
        Option(
            "--only", "faults and rules whose name holds these; 'valid rule': all of these", "WORDS"
        ),
    ),
)
