"""One case of a box, judged."""

from discmech import scenes
from discmech.studies.core.case import Case
from discmech.studies.core.claims import claiming
from discmech.studies.core.study import every_study
from tests.studies.as_json import run_case


def judged(study, scene, box, steps=None, causes=True, digits=16):
    scene = scenes.get(scene) if isinstance(scene, str) else scene
    case = Case(study, scene, box, digits, steps)
    return run_case(every_study()[study], case, causes=causes)


def verdicts(scene, box, *studies):
    steps = {"energy": 5000}
    return [
        judged(s, scene, claiming(box, s), steps.get(s), causes=False)["verdict"] for s in studies
    ]
