"""The grid on which all numbers of a program lie: decimals, fixed point, few digits or bits.

A program that gives out 13 decimals has a floor of 10⁻¹³ of its own, which is no error of its
method. Such a floor is a grid that every output lies on, not an amount of error: of doubles of size
1 a share of 10⁻² lies on that grid by chance, and of many outputs not all do.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discmech.integrators.numbers import Matrix, Vector

#: units of the last bit by which a number on the grid may be off: it was rounded there, and a
#: product of the unit rounds it again
ULPS = 4
#: probability that doubles lie on a grid by chance, log₁₀, over all grids that are tried
CHANCE = -15
FEWEST = 8  # fewest different numbers of a component: one that rests lies on any grid
LOGARITHM = {2: np.log2, 10: np.log10}
# digits that are tried: up to these a grid is coarser than that of doubles
DIGITS = {10: range(16), 2: range(53)}


@dataclass(frozen=True)
class Grid:
    """Multiples of base^-digits, or if relative numbers with so many digits.

    unit: the size of another grid, in place of a power of the base. single: True if single
    precision gives it, of numbers that sums and differences have left on the grid of the largest.
    """

    base: int
    digits: int
    relative: bool = False
    unit: float = 0.0
    single: bool = False

    @property
    def words(self) -> str:
        """The grid as a phrase, such as `numbers rounded to 13 decimals`."""
        if self.unit:
            return f"multiples of {self.unit:.6g}"
        if self.relative and self.base == 2:
            single = self.digits == 24
            return "numbers of single precision" if single else f"numbers of {self.digits} bits"
        if self.relative:
            return f"numbers of {self.digits} significant digits"
        if self.digits == 0:
            return "whole numbers"
        if self.base == 10:
            return f"numbers rounded to {self.digits} decimal{'s' * (self.digits > 1)}"
        of = ", numbers of single precision" if self.single else ""
        return f"multiples of 2^-{self.digits}{of}"

    def units(self, values: Vector) -> Vector:
        """Return the distance of neighbours on the grid at each number that is not 0."""
        if self.unit or not self.relative:
            return np.full(len(values), self.unit or float(self.base) ** -self.digits)
        sizes = np.floor(LOGARITHM[self.base](np.abs(values)))
        return np.asarray(float(self.base) ** (sizes + 1 - self.digits))

    def chance(self, values: Vector) -> float:
        """Return log₁₀ of the probability that doubles of such sizes all lie on the grid.

        It is 0 if one of the numbers does not.
        """
        unit, ulp = self.units(values), np.spacing(np.abs(values))
        if (np.abs(np.rint(values / unit) * unit - values) > ULPS * ulp).any():
            return 0.0
        return float(np.log10(np.minimum(1.0, (2 * ULPS + 1) * ulp / unit)).sum())


@dataclass(frozen=True)
class Floor:
    """The floor of a program's own numbers: its size, and as a share of the state; and in words."""

    size: float
    share: float
    words: str

    def __str__(self) -> str:
        return f"{self.size:.1g} ({self.words})"


def grids_of(outputs: Sequence[Vector] | Matrix) -> list[Grid | None]:
    """Return the grid of each column of a program's outputs (r, k), or None for plain doubles."""
    return [_grid_of(column) for column in np.asarray(outputs, dtype=float).T]


def units_of(grids: Sequence[Grid | None], values: Vector) -> Vector:
    """Return the distance of neighbours on the grids at each number; 0 without a grid."""
    return np.array([0.0 if grid is None else grid.units(np.array([value or 1.0]))[0]
                     for grid, value in zip(grids, values, strict=True)])  # fmt: skip


def _grid_of(column: Vector) -> Grid | None:
    values = np.unique(column[np.isfinite(column) & (column != 0)])
    if len(values) < FEWEST:
        return None
    chances = {grid: grid.chance(values) for grid in _candidates(values)}
    grid = min(chances, key=lambda each: chances[each], default=None)  # the first of equal ones
    if grid is None or chances[grid] > CHANCE:
        return None
    if grid.base == 2 and not grid.relative and not grid.unit and (values == single(values)).all():
        largest = np.spacing(np.float32(np.abs(values).max()))
        return replace(grid, single=bool(2.0**-grid.digits <= largest))
    return grid


def single(values: Vector) -> Vector:
    """Return the numbers as single precision has them."""
    return np.asarray(values, dtype=np.float32).astype(float)


def _candidates(values: Vector) -> Iterator[Grid]:
    """Yield of each family the coarsest grid that all numbers lie on."""
    for base, relative in ((10, False), (2, False), (10, True), (2, True)):
        for digits in DIGITS[base]:
            if (digits or not relative) and (grid := Grid(base, digits, relative)).chance(values):
                yield grid
                break
    if unit := _common_unit(values):
        yield Grid(10, 0, unit=unit)


def _common_unit(values: Vector) -> float:
    """Return the largest number of which all differences are multiples, by Euclid; 0 without one.

    Round-off grows with the multiples, so the smallest differences come first, and each one makes
    the unit more certain for the next.
    """
    gaps = np.sort(np.diff(values))
    noise = ULPS * float(np.spacing(np.abs(values).max()))
    least, unit = math.sqrt(noise * float(gaps[FEWEST - 2])), 0.0
    for gap in map(float, gaps):
        rest = gap
        while rest > least:
            unit, rest = rest, abs(unit - round(unit / rest) * rest)
        if not unit > least:
            return 0.0
        unit = gap / max(1, round(gap / unit))
    whole = float(np.abs(values).max())
    return whole / max(1, round(whole / unit))
