"""Cases with a fault that is put in: each has one cause."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Any

from discmech.integrators import Scene, Scheme
from discmech.integrators.compiler import interpreted, kernel_text
from discmech.integrators.flows import Flow, Start
from discmech.studies import get
from discmech.studies.core.case import Case
from discmech.tests.bench.power.catalogue import SOLVER
from tests.studies.as_json import run_case


@dataclass(frozen=True)
class Broken(Case):
    """A case whose flows have a fault that is put in."""

    fault: Any = None

    def scheme_on(self, scene: Scene) -> Scheme:
        sound = super().scheme_on(scene)
        broken = copy(sound)
        fault = self.fault

        def flow(step: Any, digits: int = 16) -> Flow:
            made = sound.flow(step, digits)
            fault(made)
            return made

        broken.flow = flow  # type: ignore[method-assign]
        return broken


def loose(flow):
    """Newton is content with a velocity that is off by a part in ten million."""
    edited(
        flow,
        "better = plus(w, dw)",
        "better = tuple([(a + d) * (1 + R(1) / 10**7) for a, d in zip(w, dw)])",
    )
    edited(flow, "if fine and total == 1 and", "if True or fine and total == 1 and")


def edited(flow, old, new):
    """Kernels run by Python, with another line in their text."""
    text = getattr(flow, "text", None) or kernel_text(flow.system)
    assert old in text
    flow.text = text.replace(old, new)
    flow.__dict__["_kernels"] = interpreted(flow.text, flow.numbers)


def wrong_start(flow):
    """The start has u = v0 instead of μ = ∂l/∂ξ(x0, v0)."""
    scene = flow.scheme.scene
    with flow.numbers.working():
        x, v = flow.context.vectors(scene.x0, scene.v0)
        mu = flow.context.maps_at(x, v)["minus"] / flow.context.h
        flow.starting.__dict__["own"] = Start(x, mu, v)


def damped(flow):
    """F⁺ is a little too small, consistently."""
    for geometry in (flow.context.geometry, flow.context.exactly.geometry):
        for name in ("at", "tracked"):
            setattr(geometry, name, _damped(getattr(geometry, name), geometry.numbers))


def _damped(sound, numbers):
    def at(x, u):
        kept = 1 - numbers.number("1e-6")
        return {k: v * kept if k.endswith("plus") else v for k, v in sound(x, u).items()}

    return at


def drifting(flow):
    """The momentum that is handed on is a little too small; every velocity is solved for."""
    edited(flow, *SOLVER["damped residual"])


def impatient(flow):
    """Newton stops after two corrections."""
    edited(flow, *SOLVER["Newton stops after two corrections"])


def crooked(flow):
    """F⁺ of every substep is a little too small, on a group, where a state is μ alone."""
    for part in {*flow.parts, *flow.context.exactly.parts}:
        part.geometry.parts = _bent(part.geometry.parts, part.numbers)


def _bent(sound, numbers):
    def parts(*state):
        *rows, after, of_w, of_z = sound(*state)
        kept = 1 - numbers.number("1e-6")
        return [*rows, *(e * kept for e in (after, of_w, of_z))]

    return parts


def cause(case):
    found = run_case(get(case.study), case)
    assert found["verdict"] == "fail"
    assert found["diagnosis"]["cause"] in found["reason"]
    return found["diagnosis"]
