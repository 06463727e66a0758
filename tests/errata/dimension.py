"""Exact dimensions: exponents of kilogram, metre, second and of the number of people."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True)
class Dimension:
    """kg^a m^b s^c ped^d with rational exponents; products, quotients, powers and equality."""

    kg: Fraction = Fraction(0)
    m: Fraction = Fraction(0)
    s: Fraction = Fraction(0)
    ped: Fraction = Fraction(0)

    def __mul__(self, other: Dimension) -> Dimension:
        return Dimension(
            self.kg + other.kg, self.m + other.m, self.s + other.s, self.ped + other.ped
        )

    def __truediv__(self, other: Dimension) -> Dimension:
        return self * other**-1

    def __pow__(self, exponent: float | Fraction) -> Dimension:
        power = Fraction(exponent)
        return Dimension(self.kg * power, self.m * power, self.s * power, self.ped * power)


NUMBER = Dimension()
KG, M, S = Dimension(kg=Fraction(1)), Dimension(m=Fraction(1)), Dimension(s=Fraction(1))
PED = Dimension(ped=Fraction(1))

SPEED = M / S
FORCE = KG * M / S**2
IMPULSE = FORCE * S
ENERGY = FORCE * M

# a crowd in the plane: mass for each area, force for each length
DENSITY = KG / M**2
PRESSURE = FORCE / M
STRAIN_RATE = SPEED / M
GRADIENT = M**-1
