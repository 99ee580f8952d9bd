"""The record of single steps from drawn places: one for all studies, and for every law."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from .records import OPTIONAL

ROW = "row "  # so begins the place of a departure from one recorded row to the next
#: the name of a departure of runs that begin, or step, unlike and end alike
ALIKE = (
    "runs from starts that share x or μ alone, or by steps of two sizes, have one end, so that "
    "what it remembers is known by a part of what it depends on"
)


@dataclass(frozen=True, slots=True)
class Departure:
    """The largest departure of one step from a law, such as that of the form.

    size: that of the departure, None if it is unknown, for the reason `unknown`. limit: the most
    that a sound step leaves. name: of the quantity, or of the kind of form. step, place: those of
    the departure; on_motion: True for a place on the scene's own motion. asked: the number of
    states all along the motion from which the law was looked at by steps of all sizes; of a program
    made again, of the steps of one long run.
    """

    size: float | None = None
    limit: float = 0.0
    name: str = ""
    step: float = 0.0
    place: str = ""
    unknown: str = ""
    on_motion: bool = False
    asked: int = 0

    @property
    def broken(self) -> bool:
        """True if the departure is more than round-off; one that is not a number is."""
        return self.size is not None and not self.size <= self.limit


@dataclass(frozen=True, slots=True)
class Floats:
    """The floats of a rule, and their effect on a step.

    values: the floats. explain: True if their last bits explain an order that is too low. size: the
    error relative to the motion in a step, of the worst component, at least half a unit of the last
    bit.
    """

    values: Sequence[float] = ()
    explain: bool = False
    size: float = 0.0


@dataclass(frozen=True, slots=True)
class EffectiveOrder:
    """The judgement of a declared effective order.

    verdict: "pass", "fail" or "inconclusive", "" on scenes where no effective order is judged;
    reason: one sentence for it. reached: the order for which a processing was found. cause: the
    cause of the remaining error, if known.
    """

    verdict: str = ""
    reason: str = ""
    reached: int | None = None
    cause: str = ""


@dataclass(frozen=True, slots=True)
class SingleSteps:
    """The lowest order of single steps, in a component from a place; or why it is unknown.

    exact: True if every step ends where the motion does. refused: True if the rule makes no single
    step. floats: the floats of a rule whose order is too low. on_motion: the order of steps from
    states of the scene's own motion alone, where it is higher. rate: the error per unit of time
    over h^p. linear: True if the continuous equations are linear. floor, share: the floor of a
    program's own numbers in words, and as a share of the state. laws: the largest departure from
    each law that was measured, by its name. unscanned: why no run of short steps looked for faults
    in narrow parts of the motion, "" if one did. around: the number of states beside the motion
    from which short steps were made; sizes: the least and the largest of these over the scene's.
    """

    order: float | None = None
    component: str = ""
    step: float = 0.0
    place: str = ""
    places: int = 0
    seed: int | None = None
    exact: bool = False
    unknown: str = ""
    refused: bool = False
    floats: Floats = field(default_factory=Floats)
    on_motion: float | None = field(default=None, metadata=OPTIONAL)
    rate: float | None = field(default=None, metadata=OPTIONAL)
    linear: bool = False
    floor: str = ""
    share: float = 0.0
    effective: EffectiveOrder | None = field(default=None, metadata=OPTIONAL)
    laws: Mapping[str, Departure] = field(default_factory=dict)
    unscanned: str = ""
    around: int = 0
    sizes: Sequence[float] = ()
