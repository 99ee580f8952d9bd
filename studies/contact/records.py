"""The records of laws of contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from ..core.records import OPTIONAL
from ..core.single_steps import SingleSteps


@dataclass(frozen=True, slots=True)
class Laws:
    """The largest defect of each law along a run, its impacts, and the rises of the energy."""

    penetration: float | None = None
    pull: float | None = None
    complementarity: float | None = None
    cone: float | None = None
    slip: float | None = None
    impact_energy: float | None = None
    jump: float | None = None
    restitution: float | None = None
    course: float | None = None
    friction: float | None = None
    impact_friction: float | None = None
    rises: Sequence[float] = ()
    impacts: int | None = None


@dataclass(frozen=True, slots=True)
class Form:
    """The defects of Ω across an impact at h, h/2 and h/8; None if it is not demanded."""

    across: Sequence[float | None] | None = None


@dataclass(frozen=True, slots=True)
class Back:
    """A way back through the impact at a time, at 40 digits: how far it misses its start.

    missed: over the sizes of x and of μ. steep: how fast the gap could close over how fast it does.
    """

    time: float = 0.0
    missed: float = 0.0
    steep: float = 1.0


@dataclass(frozen=True, slots=True)
class Measured:
    """The laws of a stepped and of a located run, and the order and error of located impacts.

    late: the delay of the first stepped impact, in steps. rests: True if a gap stays closed.
    touched: False if none closes. scaled, apart: sentences on gaps that are no distances, and on
    impacts of one run alone. unsure: gaps whose round-off hides whether they were met. back: ways
    back of a rule that claims to be reversible; none where impacts have none.
    """

    stepped: Laws = field(default_factory=Laws)
    located: Laws = field(default_factory=Laws)
    order: float | None = None
    time_error: float | None = None
    late: float | None = None
    rests: bool = False
    touched: bool = True
    scaled: Sequence[str] = ()
    apart: str = ""
    unsure: Sequence[int] = ()
    local: SingleSteps = field(default_factory=SingleSteps)
    form: Form = field(default_factory=Form)
    back: Sequence[Back] | None = field(default=None, metadata=OPTIONAL)

    @property
    def modes(self) -> Sequence[tuple[str, Laws]]:
        """The two runs by their names."""
        return ("stepped", self.stepped), ("located", self.located)
