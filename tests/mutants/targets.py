"""What is mutated, and the fast tests that have to notice."""

from __future__ import annotations

import re
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Target:
    """A module, the tests that concern it, those that notice most first, and which of its functions
    and constants, as a pattern of their names."""

    module: str
    tests: tuple[str, ...]
    names: re.Pattern[str] = field(default=re.compile(""))


JUDGED = ("tests/studies/judges",)


def _study(name: str, *helpers: str, module: str = "judging") -> Target:
    """A study's `judge` and what it asks."""
    found = "|".join(["_?judge.*", *helpers])
    return Target(f"studies/{name}/{module}.py", JUDGED, re.compile(f"^({found})$"))


JUDGES = (
    *(Target(f"studies/{name}/limits.py", JUDGED) for name in
      ("order", "symplecticity", "momentum", "energy", "contact", "stability", "steps",
       "optimality", "work_precision")),
    _study("order"),
    _study("order", "hidden_share", "too_few", "departure", "_local_orders", "not_converging",
           "is_bent", "floor", "NOWHERE", "AWAY", "SPARE", "STRAIGHT", module="window"),
    _study("order", "_with_multipliers", "_of_recorded"),
    _study("order", "_of_.*", "_unresolved", module="judging_steps"),
    _study("energy", "_sinks"),
    _study("energy", "_continues", "_settled", "are_steady", "allowed_rise",
           module="judging_errors"),
    _study("energy", "certain_drift", "_steadiness", "_edge_slopes", "CERTAIN", "PARTS",
           module="errors"),
    _study("energy", "applies", "wanted", module="balance"),
    _study("momentum", "_judge_faults"),
    _study("momentum", "round_off", "walks_of", module="measuring"),
    _study("symplecticity", "_broken", "_seen_in", "demanded"),
    _study("symplecticity", "badness", "worst_row", "_worst_of", "_kinds", module="measuring"),
    _study("reversibility"),
    _study("steps", "_of_order", "_of_back", "_of_form", "_of_energy"),
    _study("stability", "LOOSE"),
    Target("tests/bench/charts/judging.py", JUDGED, re.compile("^_?judge.*$")),
    _study("extremes"),
    _study("extremes", "WRONG", "TRUSTED", module="measuring"),
    _study("optimality"),
    _study("contact", "_broken", "_open_questions"),
    Target("tests/bench/savings/judging.py", JUDGED, re.compile("^_?judge.*$")),
    _study("work_precision"),
    Target("studies/core/fitting.py", ("tests/studies/test_fitting.py", *JUDGED)),
    Target("studies/stability/nonlinear_stability.py", ("tests/studies/test_stability.py",),
           re.compile("^(resonant|limits|NOISE)$")),
    Target("studies/causes/round_off.py",
           ("tests/studies/judges/test_order_judge.py", "tests/studies/test_sound_methods.py")),
)  # fmt: skip


def _reference(module: str, *tests: str) -> Target:
    files = tuple(
        test if "/" in test else f"tests/reference/test_reference_{test}.py"
        for test in (*tests, "package")
    )
    return Target(f"reference/{module}.py", files)


REFERENCE = (
    # what a proven digit rests on
    _reference("taylor/balls", "proof", "bounds"),
    _reference("answer/bounded", "proof", "bounds"),
    _reference("enclosure/majorants", "proof", "bounds"),
    _reference("enclosure/propagation", "proof", "bounds"),
    _reference("enclosure/remainders", "proof", "bounds"),
    _reference("enclosure/tube", "proof", "bounds"),
    # equations, series, and other ways to the same digits
    _reference("equations/algebroid", "equations", "algebroids", "answers"),
    _reference("equations/constrained_start", "constraints", "answers"),
    _reference("equations/elimination", "equations", "constraints"),
    _reference("equations/euler_lagrange", "equations", "constraints", "answers", "bounds"),
    _reference("answer/extrapolation", "integrators", "closed_forms"),
    _reference("answer/frozen", "tables", "equations", "answers"),
    _reference("answer/problem", "answers", "certainty", "equations", "algebroids"),
    _reference("taylor/series", "equations", "answers", "integrators"),
    _reference("answer/states", "answers", "tables", "closed_forms"),
    _reference("taylor/tape", "equations", "answers", "bounds"),
    _reference("taylor/integration", "integrators", "answers"),
    # what is asked of a solution, and what is kept of it
    _reference("answer/agreement", "agreement", "constraints", "integrators", "closed_forms"),
    _reference("answer/cache", "store", "tables", "algebroids", "closed_forms"),
    _reference("answer/certify", "certainty", "closed_forms", "constraints", "tables"),
    _reference("equations/exact", "exact", "answers", "equations"),
    _reference("failures", "answers"),
    _reference("equations/fingerprint", "tables", "algebroids", "answers"),
    _reference("taylor/independence", "constraints", "tables", "closed_forms"),
    _reference("answer/invariants", "certainty", "constraints", "integrators", "closed_forms"),
    _reference("progress", "store", "answers", "closed_forms"),
    _reference("answer/result", "agreement", "answers", "tables"),
    _reference("answer/solution", "tables", "answers", "algebroids", "constraints"),
    _reference("answer/store", "store", "tables", "algebroids"),
    # formulas
    *(_reference(f"closed_forms/{name}", "closed_forms")
      for name in ("form", "__init__", "charged_particle", "harmonic", "pendulum", "rigid_body",
                   "rigid_body_so4", "sl2", "symmetric_top")),
    *(_reference(f"closed_forms/{name}", "closed_forms", "answers", "integrators")
      for name in ("elliptic", "kepler", "rotations")),
    _reference("closed_forms/lattice_waves", "lattice_waves", "tests/laws/test_lattice_laws.py"),
    _reference("closed_forms/moser_veselov",
               "tests/integrators/bisections/test_moser_veselov_reference.py"),
)  # fmt: skip

TARGETS = {"judges": JUDGES, "reference": REFERENCE}
