#!/usr/bin/env python3
"""Speed of a settling sphere over that in unbounded fluid, by the gap over the radius.

Exact series of slow flow: a sphere that moves towards a plane wall, and two equal spheres that move
towards each other (Brenner, Chem. Eng. Sci. 16 (1961) 242) or one behind the other (Stimson &
Jeffery, Proc. R. Soc. A 111 (1926) 110). If one of two spheres is fixed, the motion is half of
each, so the resistance of the moving one is the mean of both.

    python3 series.py > mobility.csv
"""

from math import acosh, cosh, sinh


def series(bracket, alpha):
    total, n = 0.0, 1
    while (2 * n + 1) * alpha < 300:
        weight = n * (n + 1) / ((2 * n - 1) * (2 * n + 3))
        total += weight * bracket(2 * n + 1, alpha)
        n += 1
    return 4 / 3 * sinh(alpha) * total


def towards_wall(m, a):
    above = 2 * sinh(m * a) + m * sinh(2 * a)
    return above / (4 * sinh(m * a / 2) ** 2 - (m * sinh(a)) ** 2) - 1


def towards_sphere(m, a):
    above = 4 * cosh(m * a / 2) ** 2 + (m * sinh(a)) ** 2
    return above / (2 * sinh(m * a) - m * sinh(2 * a)) - 1


def behind_sphere(m, a):
    above = 4 * sinh(m * a / 2) ** 2 - (m * sinh(a)) ** 2
    return 1 - above / (2 * sinh(m * a) + m * sinh(2 * a))


def main():
    print("# Speed over that in unbounded fluid; written by series.py, which names the sources.")
    print("gap_over_radius,onto_wall,onto_fixed_sphere")
    for k in range(0, 49):
        gap = 10 ** (-2.2 + k / 24)
        wall = series(towards_wall, acosh(1 + gap))
        alpha = acosh(1 + gap / 2)
        pair = (series(towards_sphere, alpha) + series(behind_sphere, alpha)) / 2
        print(f"{gap:.6f},{1 / wall:.6f},{1 / pair:.6f}")


if __name__ == "__main__":
    main()
