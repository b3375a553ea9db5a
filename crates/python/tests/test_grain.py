"""Grains: constructors, measures, files and refused input."""

import pickle
import warnings

import numpy as np
import pytest

import grainwake as gw

CUBE_VERTICES = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
CUBE_FACES = np.array([
    [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5], [0, 1, 5], [0, 5, 4],
    [2, 6, 7], [2, 7, 3], [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6],
])


def ball(diameter=20, size=28):
    """Binary image of a sphere with the axes (z, y, x)."""
    at = np.arange(size) - (size - 1) / 2 + 0.13
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    return x**2 + y**2 + z**2 < (diameter / 2) ** 2


def test_a_sphere_has_its_closed_form():
    sphere = gw.Grain.sphere("2 mm")
    assert sphere.volume == pytest.approx(np.pi / 6 * 8e-9)
    assert sphere.krumbein_sphericity == pytest.approx(1)
    assert sphere.distance([[0, 0, 0], [0.002, 0, 0]]) == pytest.approx([-1e-3, 1e-3])
    assert sphere.nodes.shape == (len(sphere.node_areas), 3)
    assert sphere.node_areas.sum() == pytest.approx(np.pi * 4e-6)


def test_units_are_numbers_in_si_or_strings():
    assert gw.Grain.sphere(0.002) == gw.Grain.sphere("2 mm") == gw.Grain.sphere("0.2 cm")
    assert gw.Grain.sphere(np.float32(0.5)).equivalent_diameter == pytest.approx(0.5)


@pytest.mark.parametrize("value, words", [
    ("2 kg", ["diameter", "is a mass", "expected a length"]),
    ("2 mmm", ["unknown unit `mmm`", "did you mean `mm`?"]),
    (float("nan"), ["found NaN"]),
    ([1], ["found a value of type list"]),
    (True, ["found a value of type bool"]),
    (-1e-3, ["diameter = -0.001", "must be finite and positive"]),
    (1e-10, ["diameter = 1e-10", "a length must lie between"]),
])
def test_a_wrong_length_is_refused(value, words):
    with pytest.raises(gw.CaseError) as refused:
        gw.Grain.sphere(value)
    assert all(word in str(refused.value) for word in words), str(refused.value)


def test_closed_forms_have_their_extents():
    ellipsoid = gw.Grain.ellipsoid("3 mm", "2 mm", "1 mm", cells=40)
    assert (ellipsoid.a, ellipsoid.b, ellipsoid.c) == pytest.approx((3e-3, 2e-3, 1e-3), rel=0.01)
    box = gw.Grain.rounded_box("2 mm", "2 mm", "1 mm", radius="0.2 mm", cells=40)
    assert box.roundness == pytest.approx(0.4, abs=0.1)
    assert gw.Grain.cylinder("1 mm", "2 mm", cells=32).a == pytest.approx(2e-3, rel=0.02)
    assert gw.Grain.capsule("1 mm", "1 mm", cells=32).a == pytest.approx(2e-3, rel=0.02)
    for exponents in ((1, 1), [1, 1], np.array([1.0, 1.0])):
        quadric = gw.Grain.superquadric("2 mm", "2 mm", "2 mm", exponents=exponents, cells=32)
        assert quadric.wadell_sphericity == pytest.approx(1, abs=0.01)
    for exponents in ((1, 1, 1), 1, "ab"):
        with pytest.raises(gw.CaseError, match="exponents: found .*; expected 2 numbers"):
            gw.Grain.superquadric("2 mm", "2 mm", "2 mm", exponents=exponents)


@pytest.mark.parametrize("make", [
    lambda: gw.Grain.sphere(2),
    lambda: gw.Grain.ellipsoid(3, 2, 2, cells=24),
    lambda: gw.Grain.rounded_box(2, 2, 1, radius=0.2, cells=24),
    lambda: gw.Grain.cylinder(1, 2, cells=24),
    lambda: gw.Grain.capsule("0.5 um", "0.5 um", cells=24),
    lambda: gw.Grain.superquadric(2, 2, 2, exponents=(1, 1), cells=24),
])
def test_a_closed_form_of_implausible_size_is_refused(make, tmp_path, cli):
    with pytest.raises(gw.CaseError) as refused:
        make()
    message = refused.value.problems[0].message
    assert "the grain has an equivalent diameter of" in message
    assert message.endswith("accepted are 1 um to 1 m")
    assert 'a string has its unit, such as "2 mm"' in refused.value.problems[0].help
    told = cli("grain", "make", "sphere", "2", "-o", tmp_path / "x.grain", code=2).stderr
    assert "the grain has an equivalent diameter of 2 m; accepted are 1 um to 1 m" in told


def test_a_grain_of_any_size_is_made_by_scaling():
    assert gw.Grain.sphere(1).scaled(2).equivalent_diameter == pytest.approx(2)


def test_a_family_grain_has_its_targets():
    stone = gw.Grain.family(0.7, 0.4, "3 mm", seed=3)
    assert stone.equivalent_diameter == pytest.approx(3e-3)
    assert stone.krumbein_sphericity == pytest.approx(0.7, abs=0.02)
    assert stone.roundness == pytest.approx(0.4, abs=0.05)
    with pytest.raises(gw.CaseError, match="must lie between 0.3 and 0.97"):
        gw.Grain.family(1.2, 0.4)


def test_a_grain_survives_files_and_pickling(tmp_path, cli):
    grain = gw.Grain.ellipsoid("3 mm", "2 mm", "1 mm", cells=24)
    file = tmp_path / "pebble.grain"
    grain.save(file)
    assert gw.Grain.load(file) == grain == pickle.loads(pickle.dumps(grain))
    assert hash(gw.Grain.load(file)) == hash(grain)
    with pytest.raises(gw.CaseError, match="exists already"):
        grain.save(file)
    grain.save(file, force=True)
    with pytest.raises(gw.CaseError, match="does not end in .grain"):
        grain.save(tmp_path / "pebble.stl")
    with pytest.raises(FileNotFoundError):
        gw.Grain.load(tmp_path / "none.grain")
    file.write_bytes(file.read_bytes()[:-40])
    with pytest.raises(gw.CaseError, match="pebble.grain"):
        gw.Grain.load(file)


def test_python_and_the_command_line_make_the_same_grain(tmp_path, cli):
    file = tmp_path / "e.grain"
    cli("grain", "make", "ellipsoid", "3 mm", "2 mm", "1 mm", "-o", file)
    assert gw.Grain.load(file).digest == gw.Grain.ellipsoid("3 mm", "2 mm", "1 mm").digest


def test_a_mesh_of_arrays_becomes_a_grain():
    cube = gw.Grain.from_mesh((CUBE_VERTICES, CUBE_FACES), unit="mm", cells=32)
    assert cube.volume == pytest.approx(1e-9, rel=0.01)
    # Other orders and types of arrays are converted.
    other = gw.Grain.from_mesh(
        (np.asfortranarray(CUBE_VERTICES.astype(np.float32)), CUBE_FACES.astype(np.uint16)),
        unit="1 mm", cells=32,
    )
    assert other.digest == cube.digest
    # Triangles without shared vertices are merged.
    soup = CUBE_VERTICES[CUBE_FACES].reshape(-1, 3), np.arange(36).reshape(12, 3)
    assert gw.Grain.from_mesh(soup, unit="mm", cells=32).volume == pytest.approx(cube.volume)


@pytest.mark.parametrize("mesh, words", [
    ((CUBE_VERTICES[:, :2], CUBE_FACES), ["vertices", "(8, 2)", "(n, 3)"]),
    ((CUBE_VERTICES, CUBE_FACES[:, :2]), ["faces", "(12, 2)", "(m, 3)"]),
    ((CUBE_VERTICES, CUBE_FACES[1:]), ["edge"]),
    ((CUBE_VERTICES, CUBE_FACES + 1), ["has vertex 8"]),
    ((CUBE_VERTICES, CUBE_FACES - 1), ["-1 is not the index"]),
    ((CUBE_VERTICES, CUBE_FACES + 0.5), ["faces", "not whole"]),
    ((CUBE_VERTICES * np.nan, CUBE_FACES), ["not a finite number"]),
    ((CUBE_VERTICES * 1j, CUBE_FACES), ["holds no real numbers"]),
    ((CUBE_VERTICES, CUBE_FACES[:, ::-1]), ["inside out", "flip=True"]),
    (42, ["expected a path, a pair (vertices, faces)"]),
])
def test_a_bad_mesh_is_refused(mesh, words):
    with pytest.raises(gw.CaseError) as refused:
        gw.Grain.from_mesh(mesh, unit="mm")
    assert all(word in str(refused.value) for word in words), str(refused.value)


def test_a_wrong_unit_is_noticed():
    with pytest.raises(gw.CaseError, match="(?s)accepted are 1 um to 1 m.*check unit"):
        gw.Grain.from_mesh((CUBE_VERTICES, CUBE_FACES), unit="km", cells=16)
    with pytest.raises(gw.CaseError, match="unit: it is missing"):
        gw.Grain.from_mesh("cube.stl")


def test_meshes_go_to_pyvista_and_back():
    pyvista = pytest.importorskip("pyvista")
    grain = gw.Grain.ellipsoid("3 mm", "2 mm", "1 mm", cells=32)
    mesh = grain.mesh()
    assert isinstance(mesh, pyvista.PolyData)
    assert mesh.is_manifold
    assert mesh.volume == pytest.approx(grain.volume, rel=0.02)
    again = gw.Grain.from_mesh(mesh, cells=32)
    assert again.a == pytest.approx(grain.a, rel=0.02)
    with pytest.raises(gw.CaseError, match='expected "pyvista" or "trimesh"'):
        grain.mesh("blender")


def test_meshes_go_to_trimesh_and_back():
    trimesh = pytest.importorskip("trimesh")
    grain = gw.Grain.ellipsoid("3 mm", "2 mm", "1 mm", cells=32)
    mesh = grain.mesh("trimesh")
    assert isinstance(mesh, trimesh.Trimesh)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(grain.volume, rel=0.02)
    assert mesh.center_mass == pytest.approx([0, 0, 0], abs=1e-6)
    assert gw.Grain.from_mesh(mesh, cells=32).a == pytest.approx(grain.a, rel=0.02)
    box = trimesh.creation.box(extents=(2e-3, 1e-3, 1e-3))
    assert gw.Grain.from_mesh(box, cells=32).volume == pytest.approx(2e-9, rel=0.02)


def test_counts_are_whole_numbers():
    grain = gw.Grain.sphere("1 mm", nodes=np.int64(100))
    assert len(grain.nodes) == 100
    for call, words in [
        (lambda: gw.Grain.sphere("1 mm", nodes=-5), "nodes: found -5; expected a whole number from 1"),
        (lambda: gw.Grain.sphere("1 mm", nodes=0), "nodes: found 0; expected a whole number from 1"),
        (lambda: gw.Grain.sphere("1 mm", nodes=2**200), f"nodes: {2**200} is too large"),
        (lambda: gw.Grain.ellipsoid("1 mm", "1 mm", "1 mm", cells=-1), "cells: found -1; expected a"),
        (lambda: gw.Grain.family(0.7, 0.4, seed=-1), "seed: found -1; expected a whole number from 0"),
        (lambda: gw.Grain.family(0.7, 0.4, cells=-1), "cells: found -1"),
        (lambda: gw.scan(ball(), voxel="50 um", label=-1), "label: found -1"),
        (lambda: gw.scan(ball(), voxel="50 um", label=2**32), "label: 4294967296 is too large"),
        (lambda: grain.picture(-1), "pixels: found -1; expected a whole number from 16 on"),
        (lambda: grain.picture(pixels=10**5), "pixels: found 100000; expected 16 to 4096"),
    ]:
        with pytest.raises(gw.CaseError, match=words):
            call()
    for call, words in [
        (lambda: gw.Grain.ellipsoid(1e-3, 1e-3, 1e-3, cells=20.5),
         "cells: found 20.5 of type float; expected a whole number"),
        (lambda: gw.Grain.sphere("1 mm", nodes=True), "nodes: found True of type bool"),
        (lambda: gw.Grain.family(0.7, 0.4, seed="1"), "seed: found 1 of type str"),
        (lambda: gw.Grain.family("0.7", 0.4), "sphericity: found '0.7' of type str; expected a num"),
        (lambda: gw.scan(ball(), voxel=1, separate="1"), "separate: found '1' of type str"),
        (lambda: gw.scan(ball(), voxel=1, median=1), "median: found 1 of type int; expected True or"),
    ]:
        with pytest.raises(TypeError, match=words):
            call()


def test_sets_are_no_vectors():
    with pytest.raises(gw.CaseError, match="exponents: found {"):
        gw.Grain.superquadric("1 mm", "1 mm", "1 mm", exponents={1.0, 1.5})
    entry = gw.Grain.sphere("1 mm").at({1e-3, 2e-3, 3e-3}, density=2500)
    with pytest.raises(gw.CaseError, match="grain.0.position: found a set, which has no order"):
        gw.Case.new(size=["4 mm"] * 3, end=1, grains=[entry])


def test_an_entry_has_one_shape():
    sphere = gw.Grain.sphere("2 mm")
    for key in ("file", "shape"):
        with pytest.raises(gw.CaseError, match=f"{key}: the grain itself is the shape"):
            sphere.at([0, 0, 0], density=2500, **{key: "x"})
    assert sphere.at([0, 0, 0], density=2500, motion="fixed")["file"] is sphere


def test_arrays_of_a_grain_are_read_only():
    grain = gw.Grain.sphere("2 mm")
    for array in (grain.nodes, grain.node_areas, grain.inertia):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 9


def test_a_scan_of_an_array_becomes_a_grain():
    image = ball()
    exact = image.sum() * (50e-6) ** 3
    grain = gw.Grain.from_scan(image, voxel="50 um", roundness=False)
    assert grain.volume == pytest.approx(exact, rel=0.01)
    # Labels of other types and orders give the same grain.
    other = gw.Grain.from_scan(
        np.asfortranarray(image.astype(np.int16)), voxel=50e-6, roundness=False
    )
    assert other.digest == grain.digest


def test_the_axes_of_an_image_are_z_y_x():
    # A block that is long along z: the last axis of the array is x.
    image = np.zeros((40, 20, 24), dtype=np.uint8)
    image[6:34, 6:14, 7:17] = 1
    scan = gw.scan(image, voxel="0.1 mm", roundness=False)
    assert scan.labels.shape == image.shape
    assert (scan.labels == image).all()
    grain = scan[1]
    assert (grain.a, grain.b, grain.c) == pytest.approx((2.8e-3, 1.0e-3, 0.8e-3), rel=0.06)


def test_a_scan_of_several_grains():
    image = np.zeros((28, 28, 60), dtype=np.int32)
    image[:, :, :28][ball()] = 4
    image[:, :, 32:][ball(16)] = 7
    image[0, 0, 0] = 9
    scan = gw.scan(image, voxel="0.1 mm", roundness=False)
    assert list(scan.grains) == [4, 7] and len(scan) == 2
    assert list(scan.rejected) == [9]
    assert scan.voxels[4] == (image == 4).sum()
    assert scan[4].volume > scan[7].volume
    for label in (9, -1):
        with pytest.raises(KeyError, match=f"label {label}"):
            scan[label]
    assert list(scan) == [4, 7] and 7 in scan and 9 not in scan and "x" not in scan
    assert scan[np.int64(7)] == scan[7]
    with pytest.raises(gw.CaseError, match="cells: found 0; expected a whole number from 1 on"):
        gw.scan(image, voxel="0.1 mm", cells=0)
    with pytest.raises(gw.CaseError, match="holds 3 grains"):
        gw.Grain.from_scan(image, voxel="0.1 mm", roundness=False)
    one = gw.Grain.from_scan(image, voxel="0.1 mm", label=7, roundness=False)
    assert one.digest == scan[7].digest


def test_grey_images_need_a_threshold():
    image = 1.0 + 2.0 * ball().astype(np.float64)
    with pytest.raises(gw.CaseError, match='threshold="otsu"'):
        gw.scan(image, voxel="50 um")
    scan = gw.scan(image, voxel="50 um", threshold="otsu", roundness=False)
    assert 1 < scan.threshold < 3 and len(scan) == 1
    with pytest.raises(gw.CaseError, match='found "mean"'):
        gw.scan(image, voxel="50 um", threshold="mean")


def test_a_median_needs_a_threshold(tmp_path, cli):
    labels = ball().astype(np.uint8)
    for read in (gw.scan, gw.Grain.from_scan):
        with pytest.raises(gw.CaseError) as refused:
            read(labels, voxel="50 um", median=True)
        problem = refused.value.problems[0]
        assert problem.message.startswith("the median filters grey values before the threshold")
        assert 'add threshold="otsu" or a grey value, or omit median=True' in problem.help
    np.save(tmp_path / "ball.npy", labels)
    told = cli("grain", "from-scan", tmp_path / "ball.npy", "--voxel", "50 um", "--median",
               "-o", tmp_path / "x.grain", code=2).stderr
    assert problem.message in told and "add --threshold otsu" in told


def test_voxels_without_a_value_are_refused():
    image = ball().astype(np.float32)
    masked = np.ma.masked_less(image, 0.5)
    with pytest.raises(gw.CaseError, match="masked array"):
        gw.scan(masked, voxel="50 um", threshold=0.5)
    image[3, 4, 5] = np.nan
    with pytest.raises(gw.CaseError, match=r"found NaN at the voxel \[3, 4, 5\]"):
        gw.scan(image, voxel="50 um", threshold=0.5)


def test_a_grain_without_voxels_free_of_blur_gives_a_warning():
    z, y, x = np.meshgrid(*[np.arange(n) - n / 2 + 0.3 for n in (24, 40, 48)], indexing="ij")
    depth = np.minimum(np.minimum(14 - abs(x), 10 - abs(y)), 2 - abs(z))
    image = 60 + 100 * np.clip(0.5 + 0.3 * depth, 0, 1)
    image += np.random.default_rng(1).normal(0, 3, image.shape)
    with pytest.warns(gw.CaseWarning, match="grey value of the solid is uncertain for 1 grain"):
        gw.scan(image, voxel="50 um", threshold="otsu", roundness=False)


def test_a_mesh_that_needs_more_cells_is_refused_with_their_number():
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    with pytest.raises(gw.CaseError, match="cells=70 resolves it"):
        gw.Grain.from_mesh((corner, faces), unit="mm")


def test_a_stated_voxel_size_is_compared(tmp_path):
    file = tmp_path / "ball.nrrd"
    header = (
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 28 28 28\nspacings: 0.02 0.02 0.02\n"
        'units: "mm" "mm" "mm"\nencoding: raw\n\n'
    )
    file.write_bytes(header.encode() + ball().astype(np.uint8).tobytes())
    with pytest.warns(gw.CaseWarning, match="states voxels of 0.02 mm, unlike voxel = 5e-5 m"):
        other = gw.Grain.from_scan(file, voxel="50 um", roundness=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        same = gw.Grain.from_scan(file, voxel="20 um", roundness=False)
    assert other.volume == pytest.approx(2.5**3 * same.volume)


@pytest.mark.parametrize("image, words", [
    (np.zeros((4, 4), dtype=int), ["(4, 4)", "(z, y, x)"]),
    (np.zeros((4, 4, 0), dtype=int), ["at least one voxel"]),
    (np.zeros((4, 4, 4), dtype=int), ["no solid voxel"]),
    (np.array([["a"]]), ["no real numbers"]),
])
def test_a_bad_image_is_refused(image, words):
    with pytest.raises(gw.CaseError) as refused:
        gw.scan(image, voxel="50 um")
    assert all(word in str(refused.value) for word in words), str(refused.value)


def test_a_picture_is_a_png():
    picture = gw.Grain.sphere("2 mm").picture(64)
    assert picture.startswith(b"\x89PNG")
