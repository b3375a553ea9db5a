"""Writes sleeve.obj: a spherical sleeve of revolution about y, with openings at the poles.

    python sleeve.py
    grainwake grain from-mesh sleeve.obj --unit "1 mm" --cells 24 --nodes 1000 -o sleeve.grain
"""

from math import cos, pi, radians, sin, sqrt

INNER, OUTER = 0.625, 0.925
OPENING = radians(12)
AROUND, ALONG = 128, 64

# The polygon around the axis has the area of the circle.
scale = sqrt(2 * pi / AROUND / sin(2 * pi / AROUND))
angles = [OPENING + (pi - 2 * OPENING) * i / (ALONG - 1) for i in range(ALONG)]
profile = [(OUTER * sin(t) * scale, OUTER * cos(t)) for t in angles]
profile += [(INNER * sin(t) * scale, INNER * cos(t)) for t in reversed(angles)]
count = len(profile)
with open("sleeve.obj", "w") as out:
    for i in range(AROUND):
        turn = 2 * pi * i / AROUND
        for radius, y in profile:
            out.write(f"v {radius * cos(turn):.6f} {y:.6f} {-radius * sin(turn):.6f}\n")
    for i in range(AROUND):
        here, there = i * count, (i + 1) % AROUND * count
        for p in range(count):
            q = (p + 1) % count
            a, b, c, d = here + p + 1, here + q + 1, there + q + 1, there + p + 1
            out.write(f"f {a} {b} {c}\nf {a} {c} {d}\n")
