"""Opens the pictures of a run folder with PyVista and prints what it finds as JSON."""

import json
import pathlib
import sys

import pyvista

run = pathlib.Path(sys.argv[1])
found = {"fields": {}, "grains": {}, "times": []}

field = pyvista.read(run / "fields" / "fields_000001.vti")
found["fields"] = {
    "dimensions": list(field.dimensions),
    "spacing": list(field.spacing),
    "arrays": {name: list(field.cell_data[name].shape) for name in field.cell_data.keys()},
    "pressure_at_5_3_7": float(field.cell_data["pressure"][(7 * 8 + 3) * 8 + 5]),
    "time": float(field.field_data["TimeValue"][0]),
}

grains = pyvista.read(run / "grains" / "grains_000002.vtp")
one = grains.threshold([0, 0], scalars="grain", preference="cell").extract_surface(algorithm="dataset_surface")
found["grains"] = {
    "triangles": int(grains.n_cells),
    "closed": bool(one.n_open_edges == 0),
    "volume_of_0": float(one.volume),
    "centre_of_0": [float(c) for c in one.center],
    "velocity": list(grains.point_data["velocity"].shape),
}

reader = pyvista.get_reader(run / "run.pvd")
found["times"] = list(reader.time_values)
reader.set_active_time_value(reader.time_values[-1])
found["parts_at_the_end"] = len(reader.read())

print(json.dumps(found))
