#!/usr/bin/env python3
"""Shear and flow between two parallel plane walls along an axis of the grid, with the forcing of
single walls (decision 0018) and that of a gap (decision 0025). Lengths are in cells.

Writes planes.csv: the mean over 20 positions of the walls relative to the cells, over the exact
value. A calculation in one dimension, apart from the program; the unit test
`shear_and_parabola_between_two_plane_walls_are_exact_solutions` has walls at an angle.

    python3 results/narrow-gaps/planes.py
"""

import csv
import math
import pathlib

EPS = 1.25
CENTRE = EPS**2 / 2 * (1 / 6 - 1 / math.pi**2)  # M(0)


def m(d):
    """Open depth."""
    s = max(-1.0, min(1.0, d / EPS))
    band = 0.5 * (1 + s) ** 2 - (1 + math.cos(math.pi * s)) / math.pi**2
    return 0.5 * EPS * band + max(d - EPS, 0.0)


def M(d):
    """Integral of the open depth."""
    s = max(-1.0, min(1.0, d / EPS))
    linear = (1 + s + math.sin(math.pi * s) / math.pi) / math.pi**2
    beyond = max(d - EPS, 0.0)
    return 0.5 * EPS**2 * ((1 + s) ** 3 / 6 - linear) + beyond * (EPS + 0.5 * beyond)


def laplacian(f, d):
    return f(d + 1) + f(d - 1) - 2 * f(d)


def forcing(d, other, gap):
    """Drag of a wall at the distance d; `other` is the distance of the second wall."""
    if d <= -EPS:
        return 1e9
    depth = m(d) - (m(-other) if gap else 0.0)
    return min(laplacian(m, d) / max(depth, 1e-9), 1e9)


def weight(d, other, drags, gap):
    """Pressure weight of a face."""
    if min(d, other) <= -EPS:
        return 0.0
    if gap:
        w = d + other
        f = 0.5 * w * (m(d) + m(other)) - M(d) - M(other) - 0.5 * d * other + 2 * CENTRE
        curvature = 0.5 * w * (laplacian(m, d) + laplacian(m, other)) + 1
        curvature -= laplacian(M, d) + laplacian(M, other)
        return sum(drags) * f - curvature
    single = [laplacian(M, x) - laplacian(m, x) / m(x) * M(x) for x in (d, other)]
    return max(0.0, min(1.0, sum(single) - 1))


def solve(diagonal, right):
    """Solves -u[i-1] + diagonal[i] u[i] - u[i+1] = right[i] with u = 0 beyond the ends."""
    diagonal, right = diagonal[:], right[:]
    for i in range(1, len(right)):
        factor = -1 / diagonal[i - 1]
        diagonal[i] += factor
        right[i] -= factor * right[i - 1]
    u = [0.0] * (len(right) + 1)
    for i in reversed(range(len(right))):
        u[i] = (right[i] + u[i + 1]) / diagonal[i]
    return u[:-1]


def between(width, gap):
    """Shear stress and flow rate over the exact ones, as means over the positions."""
    stress, flow = [], []
    for n in range(20):
        # The last face is deep inside the second wall, so that u = 0 beyond it does not matter.
        y = [i - 7 + n / 20 + 1e-4 for i in range(int(width) + 14)]
        drags = [[forcing(d, width - d, gap), forcing(width - d, d, gap)] for d in y]
        diagonal = [2 + sum(drag) for drag in drags]
        shear = solve(diagonal, [drag[1] for drag in drags])
        stress.append(width * sum(drag[0] * u for drag, u in zip(drags, shear)))
        driven = [weight(d, width - d, drag, gap) for d, drag in zip(y, drags)]
        flow.append(12 / width**3 * sum(solve(diagonal, driven)))
    return [sum(values) / len(values) for values in (stress, flow)]


def main():
    path = pathlib.Path(__file__).with_name("planes.csv")
    with path.open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["width_cells", "shear_single", "shear_gap", "flow_single", "flow_gap"])
        for width in (0.2, 0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0):
            single, gap = between(width, False), between(width, True)
            values = [single[0], gap[0], single[1], gap[1]]
            table.writerow([width] + [f"{value:.3f}" for value in values])


main()
