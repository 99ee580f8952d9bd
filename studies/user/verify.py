"""`discmech verify FILE.py`: every study that judges a rule, on scenes of all kinds of groupoids.

The rule's file names the rules to verify; scenes that it defines are added. Verdicts are printed as
they come.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from hashlib import sha256
from typing import Any

from discmech.integrators import BadInput, Discretisation, Scene, Scheme, scenes
from discmech.integrators.errors import nearest, shown, unknown
from discmech.integrators.scene import Opaque

from .. import NAMES, get
from ..causes.known_steps import known_step
from ..core import lookup
from ..core.apart import apart
from ..core.case import Choice, Progress, silent, worst
from ..core.claims import EVERY, WORDS
from ..core.cluster import Cluster
from ..core.fingerprint import of_proof
from ..core.parts import parts_of
from ..core.record import record
from ..core.result import AnyResult, StudyResult
from ..core.running import Told, about_remembered, run_studies, unheard
from ..core.store import Store
from ..core.study import Study, every_study
from ..core.words import address_of
from ..evidence.cloud import WIDE
from ..proof import prove
from ..proof.result import Answer
from .unjudged import momenta_of, unjudged

#: one of each kind: pair, group of rigid motions, action, connection, group of rotations, product;
#: the quickest first, so that verdicts come soon, then those that take longest
SCENES = ("kepler", "kirchhoff", "heavy-top", "wong", "rigid-body", "rotor-body")
#: one of each kind that pair groupoids have, for rules that exist only on these: separable, with a
#: mass that depends on x, magnetic, with explicit time, stiff, with several bodies
ON_PAIRS = ("kepler", "double-pendulum", "charged-particle", "kapitza-pendulum", "spring-pendulum",
            "outer-solar-system")  # fmt: skip
#: for programs that do not name groupoids: as many p as q, and H is a sum of two parts
PLAIN = ("kepler", "pendulum", "henon-heiles", "spring-pendulum")
#: seconds of processor time for what is proven of a rule, which docs/studies/verify.md promises
BUDGET = 10
#: the rules for a file with scenes but no rule, and those for one-forms, to which others add modes
RULES, OF_ONE_FORMS = ("midpoint", "trapezoidal"), ("projected-gauss-1", "degenerate-gauss-1")


def studies() -> tuple[str, ...]:
    """Return the studies that judge a rule; studies of run times must be named."""
    return tuple(name for name in NAMES if not get(name).alone)


def _rules_for(own: Sequence[Scene]) -> tuple[str, ...]:
    """Return the rules for scenes that come without one."""
    of_forms = bool(own) and all(getattr(e, "one_form", None) is not None for e in own)
    return OF_ONE_FORMS if of_forms else RULES


@dataclass(frozen=True)
class Request:
    """A request to verify: files, and choices; an empty choice means the default."""

    files: tuple[str, ...]
    scenes: tuple[str, ...] = ()
    studies: tuple[str, ...] = ()
    retractions: tuple[str, ...] = ()
    digits: tuple[int, ...] = ()
    steps: int | None = None
    every_scene: bool = False
    vary: tuple[str, Sequence[str]] | None = None  # a number and its values
    peers: tuple[str, ...] = ("none",)  # the peers of work-precision
    also_periods: int | None = None  # periods of a second race of work-precision
    together: bool = False  # True for only scenes that all rules apply to, if none is named
    usual: bool = False  # True if the studies are a command's own, which nobody asked for by name

    def rules(self) -> tuple[Discretisation, ...]:
        """Return the rules of the files or words; for scenes alone two well-known ones.

        Raises `BadInput` if a file without a rule has something that could not be made.
        """
        return self._objects(())[1]

    def _objects(
        self, scenes: tuple[str, ...]
    ) -> tuple[tuple[Scene, ...], tuple[Discretisation, ...]]:
        """Return the scenes of these words, or else of the files, and the rules."""
        asked = lookup.answers(self.files, self._named)
        of_rules = [word for word, (own, _) in asked if own]
        if not of_rules and (lost := lookup.refused_in([word for word, _ in asked])):
            raise BadInput(" ".join(lost))  # it may be the rule that is meant
        of_scenes = scenes or [word for word, (_, own) in asked if own]
        of_rules = of_rules or [*_rules_for([e for _, (_, own) in asked for e in own])]
        if self.vary is None:
            return lookup.scenes_of(of_scenes), lookup.rules(of_rules)
        return lookup.varied(of_scenes, of_rules, *self.vary)

    def _named(self, word: str) -> tuple[tuple[Discretisation, ...], tuple[Scene, ...]]:
        """Return `lookup.named`, of a function that makes a rule or a scene by its first value."""
        try:
            return lookup.named(word)
        except BadInput:
            if self.vary is None or ".py:" not in word:
                raise
            return lookup.named(f"{word}:{self.vary[0]}={self.vary[1][0]}")

    def choice(self) -> Choice:
        """Return the choice in objects; raises `BadInput` for unknown names and wrong files."""
        own, rules = self._objects(())
        if self.scenes:
            chosen, not_meant = self._objects(self.scenes)[0], tuple[tuple[str, str], ...]()
        else:
            asked = lookup.answers(rules, partial(_scenes_recorded, own=own), _is_recorded)
            rules, recorded = tuple(rule for rule, _ in asked), [s for _, of in asked for s in of]
            others = [rule for rule in rules if not rule.is_recorded]
            usual = usual_scenes(others, self.together) if others else ()
            chosen = (*own, *scenes.all_scenes()) if self.every_scene else own
            if not (self.every_scene or (own and rules == lookup.rules(_rules_for(own)))):
                # a file with scenes alone asks about these
                chosen = tuple(dict.fromkeys((*own, *recorded, *usual)))
            not_meant = tuple((scene.name, rule.name) for rule, of in asked for scene in chosen
                              if rule.is_recorded and scene not in of)  # fmt: skip
        return Choice(
            scenes=chosen,
            rules=rules,
            retractions=self.retractions,
            digits=self.digits,
            steps=self.steps,
            own=(
                ("peer", self.peers),
                ("also_periods", self.also_periods),
                ("not_meant", not_meant),
                ("by_name", bool(self.studies) and not self.usual),
            ),
        )


def _is_recorded(rule: Discretisation) -> bool:
    return rule.is_recorded


def _scenes_recorded(rule: Discretisation, own: Sequence[Scene]) -> list[Scene]:
    """Return the scenes of recorded runs; none of a rule.

    They are those of the name that the runs give, or else those, built in or the user's own, that
    begin at the same state. Raises `BadInput` if there is none, or the runs cannot be its own.
    """
    if not rule.is_recorded:
        return []
    runs: Any = rule
    known = [*own, *scenes.all_scenes()]
    name = runs.scene_name
    matches = [s for s in known if (s.name == name if name else runs.begins_at(s))]
    if name and not matches:
        raise BadInput(f"{rule.name}: {unknown('scene', name, [s.name for s in known])}")
    if matches and not any(map(rule.applies, matches)):
        raise BadInput(f"{rule.name}: {rule.refusal(matches[0])}")
    if not matches:
        raise BadInput(
            f"{rule.name}: no scene of discmech or of the file begins at the state at which these "
            'runs begin; name their scene by --scene, or by recorded(..., scene="pendulum"). If '
            "there is none, discmech.studies.own_order compares the runs with one another."
        )
    return matches


def usual_scenes(rules: Sequence[Discretisation], together: bool = False) -> tuple[Scene, ...]:
    """Return the scenes on which rules are tried if none is named: the boxes of maps that have
    them.

    Otherwise they are `SCENES`, as far as a rule applies; with a rule that applies to fewer than
    half of them, `ON_PAIRS` too. together: True for only those to which all rules apply, for a
    comparison.
    """
    wanted = all if together else any
    if boxes := lookup.boxes(rules):
        return boxes
    if all(not rule.is_formula and not rule.groupoids for rule in rules):
        return tuple(s for s in map(scenes.get, PLAIN) if wanted(r.applies(s) for r in rules))

    def of(names: Sequence[str]) -> list[Scene]:
        systems = map(scenes.get, names)
        return [s for s in systems if wanted(rule.applies(s) for rule in rules)]

    some = [sum(rule.applies(s) for s in map(scenes.get, SCENES)) for rule in rules]
    narrow = min(some, default=len(SCENES)) < len(SCENES) / 2
    wide = not narrow or max(some) >= len(SCENES) / 2
    systems = [*(of(SCENES) if wide else ()), *(of(ON_PAIRS) if narrow else ())]
    return tuple({scene.name: scene for scene in systems}.values())


def verify(
    request: Request,
    progress: Progress = silent,
    told: Told = unheard,
    jobs: int | Cluster | None = None,
    store: Store | None = None,
) -> StudyResult:
    """Run the studies; return one result "verify" of all their cases.

    `schemes` gives for each scene and rule whether the method is self-adjoint, which is derived and
    not judged, since no rule declares it; `proofs` what is proven of each rule's order, unless
    studies are named. A claim that no study has judged makes it inconclusive, unless studies are
    named. Raises `BadInput` for wrong files and names, and for rules that no chosen scene can use.
    """
    choice = request.choice()
    not_judged = _names_of_nothing(choice)
    asked = [get(name) for name in request.studies or studies()]
    of_lattices = get("lattices")
    own = () if request.studies else of_lattices.cases(choice)
    # of lattices of one's own it takes no times
    if own and not any(map(of_lattices.timed, own)):
        asked.append(of_lattices)
    if not request.studies and any(r.claims and r.claims.reversible for r in choice.rules):
        asked.append(every_study()["reversibility"])
    judges = [study for study in asked if list(study.cases(choice))]
    if not judges:
        needs = "; ".join(f"{study.name}: {study.lacks(choice).rstrip('.')}" for study in asked)
        nothing = f"no study applies to what was chosen ({needs})."
        said = choice.unheeded() or apart(choice) or [nothing]
        raise BadInput(" ".join(said))
    results, schemes = run_studies(
        judges, choice, progress, store=store, jobs=jobs, told=told, also=about_scheme
    )
    result = joined("verify", results)
    moving = any(rule.follows_motion and not rule.is_recorded for rule in choice.rules)
    beside = [f"Laws are asked along each motion and up to {WIDE:g} of its size beside it: a fault "
              "farther away is not seen."] * moving  # fmt: skip
    if not request.studies and (more := [*not_judged, *unjudged(choice, asked, result.cases)]):
        not_judged = more  # of these nothing could have failed
        result = replace(result, verdict=worst((result.verdict, "inconclusive")))
    declared = [] if request.studies else momenta_of(choice, result.cases, claimed=False)
    notes = [*result.notes, *beside, *not_judged, *declared,
             *_left_out(request, choice, asked, result.cases)]  # fmt: skip
    notes = list(dict.fromkeys(notes))
    proofs = None if request.studies else proofs_of(choice.rules, progress, store)
    return replace(result, notes=notes, schemes=schemes, proofs=proofs)


def proofs_of(
    rules: Sequence[Discretisation], progress: Progress, store: Store | None = None
) -> list[dict[str, Any]]:
    """Return what is proven of the order of each rule that has a series in the step.

    A proof speaks of every Lagrangian of its classes, where scenes are examples. It takes at most
    `BUDGET` seconds of processor time. The store keeps it, and each class as it is answered; not
    for a rule that may read what no digest shows.
    """
    proofs = []
    for rule in rules:
        try:
            answer = _proof(rule, progress, store)
        except BadInput:  # a program, or a rule without a series: scenes alone speak of it
            continue
        command = f"discmech prove {shlex.quote(address_of(rule))}"
        proofs.append(answer | {"command": command, "seconds": BUDGET})
    return proofs


def _proof(rule: Discretisation, progress: Progress, store: Store | None) -> dict[str, Any]:
    def show(label: str, share: float | None) -> None:
        progress(f"{rule.name}: proving, {label}", 1.0)

    ask = partial(prove, rule, laws="symplectic", progress=show, seconds=BUDGET)
    try:
        key = of_proof(rule, f"{BUDGET} s") if store is not None else ""
    except Opaque:
        store = None
    if store is None:
        return ask().to_json()

    def remembered(question: str, make: Callable[[], Answer]) -> Answer:
        name = sha256(f"{key} {question}".encode()).hexdigest()
        return Answer(**store.remembered("answer", name, lambda: asdict(make())))

    return store.remembered("answer", key, lambda: ask(remembered=remembered).to_json())


def _names_of_nothing(choice: Choice) -> list[str]:
    """Return a sentence for each name of keeps= that no chosen scene has, any for "momentum".

    Raises `BadInput` for a name that is almost a known one.
    """
    said, kept = [], {q.name for scene, _ in choice.pairs() for q in scene.symmetries}
    for rule in choice.rules:
        names = () if rule.claims is None else rule.claims.keeps
        for name in names:
            if name == EVERY and not kept:
                said.append(
                    f"{rule.name} claims to keep {name}, and no scene here declares any: it is not "
                    "judged; give a scene symmetries=[Conserved(...)]."
                )
            if name in (*kept, *WORDS):
                continue
            if near := nearest(name, (*kept, *WORDS)):
                raise BadInput(
                    f"{rule.name} says keeps={shown(name)}, which no scene here has: did you mean "
                    f"{shown(near)}?"
                )
            said.append(
                f"{rule.name} claims to keep {name}, which no scene here has: it is not judged; "
                "name a scene that has it by --scene."
            )
    return said


def _left_out(
    request: Request, choice: Choice, asked: Sequence[Study], cases: Sequence[AnyResult]
) -> list[str]:
    """Return notes on scenes that a study leaves out, and on studies that were not requested.

    A scene that only one study judges is mentioned with that study alone.
    """
    lines, scenes = [], {scene.name: scene for scene, _ in choice.pairs()}
    for study in asked:
        seen = {case.scene for case in cases if case.study == study.name}
        own = {study.asks_for, "equations"}
        left = [name for name, scene in scenes.items()
                if name not in seen and own & parts_of(scene)]  # fmt: skip
        if left:
            where = "" if len(left) == len(scenes) else f" on {', '.join(left)}"
            lines.append(f"{study.name}{where}: {study.lacks(choice)}")
    notes = apart(choice)
    if lines:
        notes.append("Left out, since the study does not apply:\n  " + "\n  ".join(lines))
    if not request.studies:  # `apart` has already reported a chosen lattice study
        alone = ", ".join(
            s.name for s in map(get, NAMES) if s.name not in studies() and s.asks_for == "equations"
        )
        notes.append(f"Left out, since they take times: {alone} (--study asks for them).")
    return notes


def about_scheme(scheme: Scheme) -> dict[str, Any] | None:
    """Return {"scene", "rule", "retraction", "self_adjoint", "known"}; None for contact's scenes.

    self_adjoint is None if stages are not found, and of a program: a claim is no answer. known:
    (name, order) of the method whose steps are those of a program, or None.
    """
    from discmech.integrators.geometry import StagesNotFound

    if scheme.scene.contact is not None:  # an impact has no past
        return None
    try:
        self_adjoint: bool | None = scheme.self_adjoint
    except StagesNotFound:
        self_adjoint = None
    return {
        "scene": scheme.scene.name,
        "rule": scheme.rule.name,
        "retraction": scheme.scene.groupoid.retraction,
        "self_adjoint": self_adjoint,
        "known": None if scheme.rule.is_formula else known_step(scheme),
    }


def joined(name: str, results: Sequence[StudyResult]) -> StudyResult:
    """Return the results of several studies as one."""
    counts = [(r.remembered, len(r.cases)) for r in results]
    single = {note for count in counts for note in about_remembered(*count)}
    notes = dict.fromkeys(note for r in results for note in r.notes if note not in single)
    remembered, cases = map(sum, zip(*counts, strict=True))
    return StudyResult(
        study=name,
        verdict=worst(r.verdict for r in results),
        record=record(sum(r.record["seconds"] for r in results), {}),
        remembered=remembered,
        notes=[*notes, *about_remembered(remembered, cases)],
        cases=[case for r in results for case in r.cases],
    )
