"""A step that loses a little momentum: `python modified.py` ends as `discmech modified` does."""

import sys

from discmech import one_step
from discmech.studies.command import main


@one_step(order=2)
def losing(s, z, h):
    """Störmer–Verlet, which then loses h³/1000 of its momentum: no form is kept."""
    x, mu = s.split(z)
    mu = mu - h / 2 * s.split(s.dH(z))[0]
    x = x + h * s.split(s.dH(s.join(x, mu)))[1]
    mu = mu - h / 2 * s.split(s.dH(s.join(x, mu)))[0]
    return s.join(x, (1 - h**3 / 1000) * mu)


if __name__ == "__main__":
    sys.exit(main(["modified", "henon-heiles", f"{__file__}:losing", "--order", "2"]))
