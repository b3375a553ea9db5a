#!/usr/bin/env python3
"""A 16-bit volume of 512^3 voxels with 6^3 irregular grains that touch: the load of the timing of scans.

Spheres of 77 to 86 voxels with six smooth bumps of up to 5 %, blurred by 1 voxel, with 5 % noise.
Needs NumPy, SciPy and tifffile. Usage: touching-grains.py OUT.tif
"""

import sys

import numpy as np
import tifffile
from scipy.ndimage import gaussian_filter

SIZE, ACROSS = 512, 6
rng = np.random.default_rng(5)
volume = np.zeros((SIZE,) * 3, np.float32)
for place in np.ndindex((ACROSS,) * 3):
    centre = (np.array(place) + 0.5) * SIZE / ACROSS + rng.uniform(-2, 2, 3)
    radius = rng.uniform(38.5, 43)
    lower = np.maximum(np.floor(centre - 1.25 * radius), 0).astype(int)
    upper = np.minimum(np.ceil(centre + 1.25 * radius), SIZE).astype(int)
    axes = [np.arange(lower[i], upper[i]) + 0.5 - centre[i] for i in range(3)]
    x = np.stack(np.meshgrid(*axes, indexing="ij"))
    distance = np.sqrt((x**2).sum(axis=0)) + 1e-6
    surface = np.full(distance.shape, radius, np.float32)
    for bump in range(6):
        along = rng.normal(size=3)
        along /= np.linalg.norm(along)
        mu = np.tensordot(along, x, 1) / distance
        surface += radius * rng.uniform(-0.05, 0.05) * (1.5 * mu**2 - 0.5 if bump % 2 else mu**3)
    inside = np.clip(0.5 + surface - distance, 0, 1)
    box = volume[tuple(slice(a, b) for a, b in zip(lower, upper))]
    np.maximum(box, inside, out=box)
volume = gaussian_filter(volume, 1.0)
volume += rng.normal(scale=0.05, size=volume.shape).astype(np.float32)
tifffile.imwrite(sys.argv[1], np.clip(12000 + 30000 * volume, 0, 65535).astype(np.uint16))
