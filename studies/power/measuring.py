"""Each fault, and each valid rule, through the studies: what said no, and what did not."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from discmech.integrators import BadInput, scenes
from discmech.integrators import rules as discretisations

from .. import get
from ..core.case import Case
from ..core.cluster import Cluster
from ..core.environment import environment
from ..core.fingerprint import of_work
from ..core.one_case import run_case
from ..core.record import provenance
from ..core.store import Store
from ..core.workers import worker_pool
from .catalogue import everything
from .equivalents import proof
from .faults import Fault, NoPlace, scene_of
from .sites import FaultyCase, faulty_scheme
from .valid import ValidCase, built_on, random_rule

#: (study, digits, steps): short runs, for schemes are run uncompiled
STUDIES = (
    ("order", 16, 12), ("order", 50, 16), ("symplecticity", 16, 24), ("symplecticity", 50, 8),
    ("momentum", 16, 1000), ("momentum", 50, 20), ("energy", 16, 1500),
)  # fmt: skip
#: the scenes of the valid rules, in turn
SCENES = ("pendulum", "rigid-body", "kepler", "pendulum", "rigid-body", "heavy-top")
Result = dict[str, Any]
Asked = partial[Any]
BATCH = 100  # faults or rules that a pool of processes does


def of_fault(index: int, unit: int = 0, seed: int = 0) -> Result | None:
    """One of `everything(unit, seed)` through the studies; None where there is no such fault.

    {"name", "scene", "rule", "site", "what", "found": {study: {"verdict", "reason", "seconds"}},
    "caught", "equivalent", "seconds"}; `caught` names the studies that said no.

    Studies have their digits in the name; where the bench refuses the object, the only one is
    "refused". `equivalent` is the proof, of those that nothing caught.
    """
    fault = everything(unit, seed)[index]
    begun = time.process_time()
    try:
        found = _studied(fault)
        caught = any(one["verdict"] == "fail" for one in found.values())
        said = "" if caught else proof(fault)
    except NoPlace:
        return None
    about = {"scene": fault.scene, "rule": fault.rule, "site": fault.site, "what": fault.what}
    return _told(fault.name, about, found, said, begun)


def _told(
    name: str, about: dict[str, str], found: dict[str, Any], equivalent: str, begun: float
) -> Result:
    return {
        "name": name, **about, "found": found,
        "caught": [study for study, one in found.items() if one["verdict"] == "fail"],
        "equivalent": equivalent,
        "seconds": time.process_time() - begun, "measured_at": provenance(),
    }  # fmt: skip


def _studied(fault: Fault) -> dict[str, Any]:
    try:
        scene = faulty_scheme(fault).scene
    except BadInput as refusal:
        return _refused(str(refusal))
    rule = discretisations.get(fault.rule)
    return _through_studies(FaultyCase("", scene, rule, 16, fault=fault))


def _refused(why: str) -> dict[str, Any]:
    return {"refused": {"verdict": "fail", "reason": why, "seconds": 0.0}}


def scene_for(seed: int) -> str:
    """The scene of a valid rule."""
    return SCENES[seed // 6 % len(SCENES)]


def of_rule(seed: int) -> Result:
    """The same of a valid rule drawn at random: whatever is in `caught` is a false alarm."""
    begun = time.process_time()
    scene, rule = scene_of(scene_for(seed)), random_rule(seed)
    found = _through_studies(ValidCase("", scene, rule, 16))
    about = {"scene": scene.name, "rule": rule.name, "site": "valid rule", "what": rule.source}
    return _told(f"{scene.name} {rule.name}", about, found, "", begun)


def _through_studies(any_case: Case) -> dict[str, Any]:
    """Per study what it says, or "refused" alone."""
    found = {}
    for name, digits, steps in STUDIES:
        case = replace(any_case, study=name, digits=digits, steps=steps)
        if name == "momentum" and not case.scene.symmetries:
            continue
        begun = time.process_time()
        result = run_case(get(name), case, causes=False)  # whether it is seen is all that counts
        if result.get("unusable"):  # bad input, by which `verify` ends
            return _refused(result["reason"])
        found[f"{name} {digits}"] = {
            "verdict": result["verdict"], "reason": result["reason"],
            "seconds": time.process_time() - begun,
        }  # fmt: skip
    return found


def measure(
    faults: Sequence[int],
    rules: Sequence[int],
    jobs: int | Cluster,
    progress: Callable[[str, float], None],
    store: Store | None = None,
    unit: int = 0,
    seed: int = 0,
) -> tuple[list[Result], list[Result]]:
    """(results of the faults of these indices that exist, results of the rules of these seeds).

    unit, seed: the faults' (`everything`).
    A store keeps each as it is finished, and what it has already is not measured again.
    """
    of_faults: list[Asked] = [partial(of_fault, n, unit, seed) for n in faults]
    of_rules: list[Asked] = [partial(of_rule, n) for n in rules]
    names = {ask: _name(ask.args[0], unit, seed) for ask in of_faults}
    names |= {ask: f"valid rule {ask.args[0]}" for ask in of_rules}
    results: dict[Asked, Result | None] = {}
    keys = {} if store is None else {ask: _key(ask, name) for ask, name in names.items()}
    for ask, key in keys.items():
        if store is not None and (earlier := store.find(key)) is not None:
            results[ask] = earlier["found"]
    left = [ask for ask in names if ask not in results]
    left.sort(key=lambda ask: ask.func is of_fault)  # rules take longer: so none is left at the end
    for part in range(0, len(left), BATCH):
        # a new pool each time, so that memory stays bounded: max_tasks_per_child can hang
        # (CPython issue 115634)
        batch = left[part : part + BATCH]
        with _own_cache(), worker_pool(jobs) as pool:
            for ask, result in zip(batch, pool.map(_asked, batch), strict=True):
                results[ask] = result
                if store is not None:
                    store.keep(keys[ask], {"found": result})
                progress(names[ask], len(results) / len(names))
    faulty, valid = ([r for ask in asked if (r := results[ask]) is not None]
                     for asked in (of_faults, of_rules))  # fmt: skip
    return faulty, valid


def _asked(ask: Asked) -> Result | None:
    return ask()


def _name(index: int, unit: int, seed: int) -> str:
    return everything(unit, seed)[index].name + (f" in units of 10^{unit}" if unit else "")


def _key(ask: Asked, name: str) -> str:
    """The fingerprint of a fault's or valid rule's result: the studies' text, its scene and rules.

    Its name, and the text of this folder, say all else.
    """
    files = [Path(__file__), *(Path(str(get(study).measuring.__file__)) for study, *_ in STUDIES)]
    if ask.func is of_fault:
        fault = everything(*ask.args[1:])[ask.args[0]]
        scene, rules = fault.scene, [discretisations.get(fault.rule)]
    else:
        scene, rules = scene_for(ask.args[0]), built_on(random_rule(ask.args[0]))
    return of_work(["power", name], dict.fromkeys(files), scenes.get(scene), rules)


@contextmanager
def _own_cache() -> Iterator[None]:
    """Kernels of faulty schemes are kept nowhere."""
    with (tempfile.TemporaryDirectory(prefix="discmech-power-") as folder,
          environment({"DISCMECH_CACHE": folder})):  # fmt: skip
        yield
