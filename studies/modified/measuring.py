"""Measure how far runs keep the modified Hamiltonian truncated after each power of the step.

Along a run the energy H of a method of order p errs by O(h^p), and H + … + h^j H_{j+1} by
O(h^(j+1)), j ≥ p, as it contains no later power. The error is the largest less the smallest value
along runs to one time by steps that are halved; its slope, log₂ of the ratio for the last two steps
above round-off, is compared with the power. The terms below the order have to be 0 around the
motion, too, since these few steps may miss a part of it.
"""

from __future__ import annotations

import itertools
import math
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators import Scheme, StepFailure
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions.expansions import ModifiedEquation
from discmech.integrators.numbers import Matrix

from ..core.case import Verdict
from ..evidence.cloud import around
from ..systems.modified_energy import dual_of

#: steps of the coarsest run, halvings, and states of each run that are looked at
STEPS, HALVINGS, STATES = 16, 5, 32
LARGER = 4  # times the scene's step, where that leaves round-off
#: of a step's power, by which a slope may miss it: half way to the power that a wrong term leaves
NEAR = 0.5
#: of two successive slopes, by which they differ where the errors follow their power
SETTLED = 0.25
DIGITS = 34  # of the terms below the order, which are 0 to as many in an exact formula
#: round-offs of the energy's terms, for each of them and for the steps of the run
ROUNDED = 64


@dataclass
class Kept:
    """The errors of H + … + h^j H_{j+1} along runs, j = 0, 1, …, order.

    steps (s,); errors: for each j the errors at these steps, in units of H; floor: below it they
    are round-off, (s,); wanted: for each j the power of the first omitted term; below: for
    the powers j below the order the largest share that h^j B dH_{j+1} has of the field, and the
    state where it has.
    """

    order: int
    first: int
    steps: list[float]
    errors: list[list[float]]
    floor: list[float]
    wanted: list[int] = field(default_factory=list)
    below: dict[int, tuple[float, str]] = field(default_factory=dict)

    def slopes(self, j: int) -> list[float]:
        """Return log₂ of the ratios of errors at successive steps that are no round-off."""
        pairs = zip(self.errors[j], self.floor, strict=True)
        above = [error if error > ROUNDED * floor else math.nan for error, floor in pairs]
        ratios = (a / b for a, b in itertools.pairwise(above))
        return [math.log2(ratio) for ratio in ratios if math.isfinite(ratio)]


def kept(scheme: Scheme, order: int, digits: int = 16) -> Kept:
    """Measure how far the modified Hamiltonian of a scheme is kept along runs.

    The largest step is the scene's, or `LARGER` of it where errors are round-off at smaller ones.
    Raises `CannotMeasure` where there is none (`ModifiedEquation`), and for a scheme without an
    order, or of a higher one.
    """
    record = _kept(scheme, order, digits, 1)
    if not all(record.slopes(j) for j in range(record.first, order + 1)):
        with suppress(StepFailure):  # so large a step may have no solution
            return replace(_kept(scheme, order, digits, LARGER), below=record.below)
    return record


def _kept(scheme: Scheme, order: int, digits: int, larger: int) -> Kept:
    equation = ModifiedEquation(scheme, order, digits)
    equation.check_hamiltonian()
    first = scheme.order
    if first is None:
        raise CannotMeasure(
            f"{scheme.rule.name} declares no order: write @discretisation(order=…)."
        )
    if order < first:
        raise CannotMeasure(
            f"{scheme.rule.name} is of order {first}: its modified Hamiltonian begins with "
            f"h^{first}, so ask for --order {first} or more."
        )
    dual = dual_of(scheme.scene)
    assert dual is not None  # there is one wherever there is a modified Hamiltonian
    record = Kept(order, first, [], [[] for _ in range(order + 1)], [])
    record.wanted = [first if j < first else j + 1 for j in range(order + 1)]
    eps = float(equation.numbers.eps)
    for k in range(HALVINGS):
        flow = scheme.flow(larger * scheme.scene.step / 2**k, digits)
        run = flow.trajectory(STEPS * 2**k, max(1, STEPS * 2**k // STATES))
        z = np.hstack([run.x, run.mu])
        terms = dual(z.astype(float))[1].max()
        H = equation.hamiltonian(z)
        if not k and first > 1 and larger == 1:
            record.below = _below(scheme, first, z.astype(float))
        record.steps.append(float(flow.step))
        record.floor.append(eps * float(terms) * math.sqrt(STEPS * 2**k))
        for j in range(order + 1):
            values = equation.at_step(H[: j + 1], flow.step)
            record.errors[j].append(float(values.max() - values.min()))
    return record


def _below(scheme: Scheme, order: int, z: Matrix) -> dict[int, tuple[float, str]]:
    """Return `Kept.below` at rows (r, n+m) of a run, and at states around the motion.

    A field counts in units of each entry's size over the fastest of the motion's own.
    """
    scale = np.abs(z).max(axis=0)
    with suppress(reference.ReferenceFailure):
        cloud = around(scheme)
        z, scale = np.vstack([z, cloud.z]), cloud.scale
    scale = np.where(scale > 0, scale, scale.max(initial=0.0) or 1.0)
    fields = np.abs(ModifiedEquation(scheme, order - 1, DIGITS).field(z)).astype(float) / scale
    known = np.isfinite(fields).all(axis=(0, 2))  # not outside the scene's domain
    z, (own, *lower) = z[known], fields[:, known]
    below = dict[int, tuple[float, str]]()
    for j, part in enumerate(lower, 1):
        k = int(part.max(axis=1).argmax())
        x, mu = (", ".join(f"{e:.4g}" for e in each) for each in np.split(z[k], [scheme.s.n]))
        share = part[k].max() / own.max() * float(scheme.scene.step) ** j
        below[j] = float(share), f"x = ({x}), mu = ({mu})"
    return below


def below_order(record: Kept) -> str:
    """Return how the energy shows that the method has not the order that it says; "" if not."""
    slopes = record.slopes(0)
    if (
        len(slopes) > 1
        and slopes[-1] < record.first - NEAR
        and abs(slopes[-1] - slopes[-2]) <= SETTLED
    ):
        return (
            f"the energy changes along runs as h^{slopes[-1]:.2f}, and a method of order "
            f"{record.first} leaves h^{record.first}: the order that it declares is not its own "
            "(discmech order says why)."
        )
    # weights that are floats leave round-offs of doubles, in whatever digits
    for j, (size, state) in record.below.items():
        if size > ROUNDED * 2.0**-53:
            return (
                f"H_{j + 1} is not 0: at {state} it is {size:.1e} of the motion by the scene's "
                f"step, and a method of order {record.first} has no such term (discmech order says "
                "why)."
            )
    return ""


def judge(record: Kept) -> Verdict:
    """Return whether each sum from the order of the method on is kept to the power left out.

    H alone is kept to the method's order, or it is not of that order.
    """
    expected = {f"through h^{j}": record.wanted[j] for j in range(record.first, record.order + 1)}
    if reason := below_order(record):
        return Verdict("fail", reason, {"through h^0": record.first, **expected})
    unknown = ""
    for j in range(record.first, record.order + 1):
        wanted, slopes = record.wanted[j], record.slopes(j)
        if record.errors[j][0] <= ROUNDED * record.floor[0]:
            continue  # kept to round-off by the largest step
        said = f"H̃ up to h^{j} changes along runs"
        if not slopes:
            unknown = unknown or f"{said} by round-off at all steps but one: take --digits 50."
            continue
        if slopes[-1] >= wanted - NEAR:
            continue
        said += f" as h^{slopes[-1]:.2f}, where h^{wanted} or a higher power is wanted"
        if len(slopes) > 1 and abs(slopes[-1] - slopes[-2]) <= SETTLED:
            return Verdict("fail", f"{said}: the steps follow no such Hamiltonian.", expected)
        unknown = unknown or f"{said}, and the slope has not settled: take --digits 50."
    return Verdict("inconclusive" if unknown else "pass", unknown, expected)


def as_rows(record: Kept) -> list[dict[str, Any]]:
    """Return the errors at each step, as rows of JSON."""
    return [
        {"step": h, "floor": record.floor[k],
         **{f"through h^{j}": record.errors[j][k] for j in range(record.order + 1)}}
        for k, h in enumerate(record.steps)
    ]  # fmt: skip
