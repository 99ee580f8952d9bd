"""What a scene and a lattice share: their features, and what excludes what.

`FEATURES` says how each feature is recognised, and `EXCLUSIONS` what does not go with it. A system
asks `EXCLUSIONS` about itself when it is made; a rule, a flow or a measurement asks it by
`System.refusal_of`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

from ..errors import (
    OF_FILE,
    BadInput,
    CannotMeasure,
    brief_name,
    check_function,
    check_name,
    shown,
)
from ..groupoids import Groupoid
from ..numbers import exact_nested, measure
from .pickled import Again, again
from .quantities import arguments_of

#: what a system may have → the fields and properties of which one has then another value than those
#: of `_UNSET`; "no …" is that it has none of them
FEATURES = {
    "a Lagrangian": ("lagrangian",),
    "a continuous Lagrangian": ("is_continuous",),
    "a discrete Lagrangian": ("discrete_lagrangian",),
    "a Hamiltonian": ("hamiltonian",),
    "a Hamiltonian in numbers": ("numeric_hamiltonian",),
    "a one-form": ("one_form",),
    "a momentum": ("mu0",),
    "a momentum of the start": ("mu0", "one_form"),
    "a fast part": ("fast",),
    "a sigma": ("sigma",),
    "explicit time": ("timed",),
    "a force": ("force", "bond_force"),
    "a force on bonds": ("bond_force",),
    "velocities in bonds": ("bonds_move",),
    "constraints": ("holonomic", "nonholonomic", "constraints", "constraint"),
    "constraints of the base": ("holonomic",),
    "constraints that leave no form": ("no_form",),
    "moving constraints": ("moving_constraints",),
    "contact": ("contact", "bond_contact"),
    "numbers of contact": ("friction", "restitution", "impacts"),
    "a base": ("has_base",),
}
_UNSET: tuple[object, ...] = (
    None,
    False,
    (),
    [],
    "",
    "stepped",
)  # without contact impacts are called stepped

_ENERGIES = ("a Lagrangian", "a discrete Lagrangian", "constraints", "contact", "a fast part")
_NOT_FREE = ("contact", "constraints", "a one-form")
#: (what a system has, or what is asked of it; the features that this excludes; a sentence, with the
#: {system}, its {groupoid}, the {feature} and its {field}, the {own} field of {what} it has and the
#: {value} there, and the asker's own words, such as the {rule})
EXCLUSIONS = (
    # a system by itself
    ("a Hamiltonian in numbers", (*_ENERGIES, "a force"),
     "{system}: {own}= stands alone; leave {field}= out."),
    ("a one-form", (*_ENERGIES, "a Hamiltonian in numbers", "a force", "a sigma"),
     "{system}: one_form= and hamiltonian= stand alone; leave {field}= out."),
    ("a one-form", ("a momentum",), "{system}: mu0 is ϑ(x0), by one_form=; leave mu0= out."),
    ("a Hamiltonian", (*_ENERGIES, "a Hamiltonian in numbers"),
     "{system}: {own}= stands alone; leave {field}= out."),
    *((what, ("no momentum of the start",),
       "{system}: a scene with {own}= begins at x0= and mu0=; give the momentum mu0, in the "
       "natural basis.") for what in ("a Hamiltonian", "a Hamiltonian in numbers")),
    ("a momentum", ("a Lagrangian",),
     "{system}: mu0 follows from v0 by the Lagrangian; give v0 alone."),
    ("a discrete Lagrangian", ("a force", "constraints", "contact"),
     "{system}: {field}= acts beside a lagrangian= alone; a discrete Lagrangian has no points that "
     "it could act at."),
    ("constraints of the base", ("no base",),
     "{system}: {groupoid} has no base for φ(x) = 0; constraints of the velocity are "
     "nonholonomic=."),
    ("contact", ("no base",),
     "{system}: contact= is a function of (x, p), a list of gaps φ(x) ≥ 0 on the base, of which "
     "{groupoid} must have one."),
    ("numbers of contact", ("no contact",), "{system}: {own}={value} needs contact=, the gaps."),
    *((what, features,
       "{system} has {feature} and {what}, which no step takes together; leave one out.")
      for what, features in (("contact", ("constraints", "velocities in bonds")),
                             ("velocities in bonds", ("constraints",)))),
    ("a force on bonds", ("constraints",),
     "{system}: a bond has a constraint or a bond_force, and not both; give a force of the sites "
     "as force=."),
    # a rule on it
    ("a formula", ("a Hamiltonian in numbers",),
     "{system} has {feature}, of which {rule} can derive nothing: only black boxes run on it."),
    ("points of a straight step", ("constraints",),
     "{system} has {feature}, which are met at points of a straight step, and {rule} has none: "
     "take a rule without stages, such as midpoint."),
    ("a one-step map", ("constraints",),
     "{system} has {feature}, which {rule} knows nothing of: take a rule such as midpoint."),
    ("a one-step map", ("no continuous Lagrangian",),
     "{system} has only a discrete Lagrangian, so {rule} has no vector field to follow."),
    ("a map of one-forms", ("no one-form",),
     "{rule} is a method for Lagrangians ϑ(x)·v − H(x), given by one_form= and hamiltonian=, and "
     "that of {system} is none."),
    ("a map of positions", ("a one-form",),
     "{rule} knows positions and momenta, and x of {system} is a phase space: take "
     "implicit-midpoint, or a method for one-forms such as projected-gauss-1."),
    ("a black box", ("contact", "constraints that leave no form", "moving constraints"),
     "{system} has {feature}, of which a black box such as {rule} knows nothing: take a rule such "
     "as midpoint."),
    ("a black box", ("no continuous Lagrangian",),
     "{system} has only a discrete Lagrangian, so there is no motion that the black box {rule} "
     "could approximate."),
    ("steps that vary", (*_NOT_FREE, "a discrete Lagrangian", "a Hamiltonian in numbers"),
     "{system} has {feature}, for which {rule} has no steps that vary."),
    ("steps that vary by Poincaré", ("a force", "explicit time", "no base"),
     '{system} has {feature}, for which {rule} has no steps that vary: take way="reversible".'),
    ("a time of its own", (*_NOT_FREE, "a force", "explicit time", "no Lagrangian", "no base"),
     "{system} has {feature}, so it has no such time of its own."),
    ("control", (*_NOT_FREE, "no Lagrangian", "a discrete Lagrangian"),
     "{system} has {feature}: control needs a scene with a lagrangian= and without constraints, "
     "contact or one_form=, since a force acts at the points where a rule asks for L."),
    # what is asked of a flow
    ("impacts", ("no contact",), "{system} has {feature}: leave impacts= out."),
    ("arrows", ("contact",),
     "{system} has {feature}: a step is a map on (x, mu) with impulses in it, not on arrows (x, "
     "u); use dual_step."),
    ("arrows", ("constraints",),
     "{system} has {feature}: a step is a map on (x, mu), not on arrows (x, u); use dual_step and "
     "flows.restricted_form_defect."),
    ("a modified equation", (*_NOT_FREE, "explicit time", "a discrete Lagrangian"),
     "{system} has {feature}: modified equations are known of free states (x, mu) alone."),
    ("derivatives of a run", _NOT_FREE,
     "{system} has {feature}: derivatives of runs are those of free states (x, mu), on which no "
     "impact acts."),
    ("a step back", ("contact",),
     "{system} has {feature}: an impact has no unique past, so it takes positive steps only."),
    ("edges of charts", ("contact",),
     '{system} has {feature}: leave on_edge="refuse", the default.'),
    ("forms of a lattice", ("constraints",),
     "{system} has {feature}: the form is defined on the vectors that they admit; use "
     "RestrictedStep."),
    ("forms of a lattice", ("contact",),
     "{system} has {feature}: forms are not defined where a step holds impulses, and rows come by "
     "trajectory alone."),
    ("a proof", ("contact",),
     "{system} has {feature}: a proven run is made in balls, without impulses."),
)  # fmt: skip


class System:
    """A mechanical system as data, of which a rule makes a scheme: a `Scene` or a `Lattice`."""

    name: str
    groupoid: Groupoid
    duration: Any
    step: Any
    restitution: Any
    #: its fields that are functions, with their arguments
    functions: ClassVar[Mapping[str, tuple[str, ...]]] = {}

    @property
    def is_continuous(self) -> bool:
        """True if a motion belongs to it, which steps approximate."""
        return True

    def has(self, feature: str) -> str:
        """Return the field by which it has a feature, or lacks it as in "no contact"; else ""."""
        if lacks := feature.startswith("no "):
            feature = next(e for e in FEATURES if e.removeprefix("a ") == feature[3:])
        for field in FEATURES[feature]:
            value = getattr(self, field, None)
            if hasattr(value, "shape") or value not in _UNSET:  # arrays cannot be compared
                return "" if lacks else field
        return feature if lacks else ""

    def refusal_of(self, *asked: str, **words: str) -> str:
        """Return a sentence that says which of its features is excluded by what is asked, or "".

        words: those of the sentence that only the asker knows, such as the rule.
        """
        for what, features, sentence in EXCLUSIONS:
            if what not in asked or not (own := self.has(what) if what in FEATURES else what):
                continue
            for feature in features:
                if field := self.has(feature):
                    value = shown(getattr(self, own, None))
                    words |= {"system": self.name, "own": own, "what": what, "feature": feature}
                    return sentence.format(
                        **words, field=field, value=value, groupoid=self.groupoid.name
                    )
        return ""

    def refuse(self, *asked: str, **words: str) -> None:
        """Raise `CannotMeasure` with the sentence of `refusal_of`, if there is one."""
        if refusal := self.refusal_of(*asked, **words):
            raise CannotMeasure(refusal)

    def check_features(self, *asked: str) -> None:
        """Raise `BadInput` if its features exclude what is asked, or without it one another."""
        if refusal := self.refusal_of(*(asked or FEATURES)):
            raise BadInput(refusal)

    def put(self, **values: object) -> None:
        """Set fields, while it is made."""
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def check_name(self, kind: str, field: str) -> None:
        """Raise `BadInput` unless it has a name, and a groupoid in the field."""
        check_name(kind, self.name, OF_FILE)
        if not isinstance(getattr(self, field), Groupoid):
            raise BadInput(
                f"{self.name}: {field} is {brief_name(getattr(self, field))}; give pair(n), "
                "lie_group(...), action(...), product(...) or a LocalGroupoid."
            )

    def check_functions(self, *needed: str) -> None:
        """Raise `BadInput` unless its functions have their arguments, and the needed ones exist."""
        for word, wanted in self.functions.items():
            if word in needed or getattr(self, word) is not None:
                check_function(getattr(self, word), f"{self.name}: {word}=", *wanted)

    def take_times(self) -> None:
        """Make duration and step exact, the step duration/1000 if it is left out."""
        duration = measure(self.duration, f"{self.name}: duration")
        step = duration / 1000 if self.step is None else self.step
        self.put(duration=duration, step=measure(step, f"{self.name}: step"))
        if self.duration <= 0 or self.step <= 0:
            raise BadInput(f"{self.name}: duration and step must be positive.")

    def take_restitution(self) -> None:
        """Make the restitution exact, one number from 0 to 1."""
        e: Any = exact_nested(self.restitution, f"{self.name}: restitution")
        self.put(restitution=e)
        if isinstance(e, tuple) or not 0 <= e <= 1:
            raise BadInput(f"{self.name}: give a restitution from 0 to 1, one for all contacts.")

    def takes_time(self, word: str) -> bool:
        """Return True if the function of that name has the time as its last argument."""
        count = arguments_of(getattr(self, word))
        return any(w.endswith("t)") and count == w.count(",") + 1 for w in self.functions[word])

    @cached_property
    def timed(self) -> bool:
        """True if one of its functions depends on the time."""
        return any(map(self.takes_time, self.functions))

    @property
    def forced(self) -> bool:
        """True if forces act beside those of L."""
        return bool(self.has("a force"))

    @property
    def has_contact(self) -> bool:
        """True if it has gaps."""
        return bool(self.has("contact"))

    @property
    def has_base(self) -> bool:
        """True if its groupoid has a base."""
        return self.groupoid.dim_x > 0

    def __reduce__(self) -> Again:
        """Return the pickled form; functions are pickled by their place in a module."""
        return again(self, [getattr(self, word) for word in self.functions])

    def __deepcopy__(self, memo: object) -> System:
        return self  # a system is immutable
