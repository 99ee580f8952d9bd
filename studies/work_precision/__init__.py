"""Error against run time, beside other people's integrators."""

from collections.abc import Callable, Iterable

from ..core.options import THOROUGH, Option, refuse, seconds, whole
from ..core.study import StudyFolder
from .limits import LIMITS
from .records import ERRORS, WORK

MOST_PERIODS = 10**12


def _peer(name: str) -> str:
    from .peers import chosen

    chosen((name,))
    return name


def _one_of(flag: str, known: Iterable[str]) -> Callable[[str], str]:
    def read(name: str) -> str:
        if name not in known:
            refuse(f'{flag} is "{name}": choose {", ".join(known)}.')
        return name

    return read


STUDY = StudyFolder(
    name="work-precision",
    package=__name__,
    limits=LIMITS,
    place=4,
    example=("pendulum", 50),
    title="Work and precision",
    summary="error against run time, beside other people's integrators",
    asks="what does an accurate digit cost?",
    measured=(
        "error in x, μ, energy and momentum against run time, steps, evaluations and Newton "
        "corrections; scipy's methods in the same race, heyoka, diffrax and rebound if installed"
    ),
    judged="not judged on time; a method that ends above its floor fails",
    about=(
        "All methods solve the same equations of motion from the same start, each on a ladder "
        "of step sizes or tolerances, and all runs are timed in one race: round by round, in "
        "changing order, until the median of each is known or the budget is spent. What is "
        "timed is a call from start to end with everything compiled; compiling stands apart, "
        "and with machine code from an earlier session it is short. The table tells what 10⁻⁴, "
        "10⁻⁸ and 10⁻¹² cost, in brackets as a multiple of the best peer's cost in the same run; a "
        "dash where no run within the budget was as accurate. A method that changed is timed again "
        "in turn with the peer that was fastest at each accuracy, the others keep their times: the "
        "last column has the run of each ratio. Other people's integrators take part in the "
        "form that their documentation advises for speed: scipy with a right-hand side and a "
        "Jacobian in machine code, heyoka and diffrax compiled whole, rebound's WHFast with its "
        "corrector. It can mislead: a call "
        "costs tens of microseconds in Python, whatever it does, so the left end of a curve is "
        "the price of a call and not of a method; error at the end of a run says nothing about "
        "the way there (choose another axis with --x and --y); and a method that is fastest "
        "over one period need not be so over a million. No verdict depends on time: a method "
        "fails only if its errors do not sink."
    ),
    alone=True,
    options=(
        Option(
            "--peer",
            "DOP853, Radau, LSODA, heyoka, diffrax, diffrax-tsit5, diffrax-symplectic, WHFast, "
            "IAS15 or none (default: those installed)",
            "P",
            _peer,
            repeated=True,
        ),
        Option("--x", "seconds, steps, evaluations, iterations", "WORK", _one_of("--x", WORK)),
        Option("--y", "error, error-x, energy-max, ...", "ERROR", _one_of("--y", ERRORS)),
        Option(
            "--periods", "run over P characteristic periods", "P", whole("--periods", MOST_PERIODS)
        ),
        Option(
            "--budget",
            "of timing, a method (default: a fraction of a second)",
            "SECONDS",
            seconds("--budget"),
        ),
        THOROUGH,
    ),
)
