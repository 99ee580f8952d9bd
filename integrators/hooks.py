"""What a room asks of rooms above it, and the core of extensions: they fill these hooks.

The core names no extension and runs without any. A hook is filled with a function that loads what
it stands for, so that a scene loads nothing that it does not need.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any, TypeVar

from .errors import CannotMeasure


class Hook:
    """A function of a room above, called as that function is, and loaded at its first call.

    what: what it gives, for the sentence of the `CannotMeasure` that an empty hook raises.
    """

    def __init__(self, what: str) -> None:
        self.what = what
        self._load: Callable[[], Callable[..., Any]] | None = None

    def fill(self, load: Callable[[], Callable[..., Any]]) -> None:
        """Take the function that loads what this hook stands for."""
        self._load = load

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        if self._load is None:
            raise CannotMeasure(f"{self.what}: that extension is not a part of this copy.")
        return self._load()(*arguments, **named)


Get = TypeVar("Get", bound=Callable[[str], Any])
#: functions that return a built-in rule, scene or lattice by its name, of the rooms that are loaded
getters: list[Callable[[str], Any]] = []
#: built-in systems beside scenes: the room's name in `scenes` → (the kind of its systems, a
#: function that loads it)
rooms_of_systems: dict[str, tuple[str, Callable[[], ModuleType]]] = {}


def getter(get: Get) -> Get:
    """Mark a function that returns a built-in object by its name; other processes call it, too."""
    getters.append(get)
    return get


# filled by the face
compose = Hook("the composition of a rule")
scheme = Hook("the scheme of a scene by a rule")

# filled by the studies, which know the files of users
scene_named = Hook("a scene by a word such as FILE.py:NAME")

# filled by extensions
check_gaps = Hook("a scene with contact")
contact_flow = Hook("the flow of a scene with contact")
modified_equation = Hook("a modified equation")
proven_flow = Hook("a flow whose runs are proven")
run_differentiated = Hook("the derivatives of a run")
source_text = Hook("a scheme as the source text of a program")
