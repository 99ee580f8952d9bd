"""The retractions that are tested."""

from discmech.integrators import BadInput, cayley, exponential

RETRACTIONS = {r.name: r for r in (cayley, exponential)}


def fits(retraction, algebra):
    """Whether the retraction maps the algebra into its group."""
    try:
        retraction.check(algebra)
    except BadInput:
        return False
    return True
