"""Variants of a case in memory, and the arguments of Case.new."""

import pickle

import numpy as np
import pytest

import grainwake as gw


def pebbles(**keys):
    """Two grains in memory, in water."""
    pebble = gw.Grain.ellipsoid("2 mm", "1.6 mm", "1.2 mm", cells=32)
    known = dict(
        size=["8 mm", "8 mm", "12 mm"],
        cell_size="0.5 mm",
        fluid={"density": 1000, "viscosity": "1 mPa s"},
        grains=[pebble.at(["4 mm", "4 mm", z], density=1500) for z in ("8 mm", "4 mm")],
        end="50 ms",
    )
    return gw.Case.new(**{**known, **keys})


def test_a_case_varies_in_memory():
    case = pebbles()
    heavy = {"grain.0.density": 2600, "fluid.viscosity": "2 mPa s"}
    variant = case.with_overrides(heavy)
    expected = pebbles(fluid={"density": 1000, "viscosity": "2 mPa s"}, grains=[
        case.grains[0].at(["4 mm", "4 mm", z], density=rho) for z, rho in
        (("8 mm", 2600), ("4 mm", 1500))
    ])
    # Defaults that depend on the density and the viscosity are those of the new values.
    assert variant.resolved == expected.resolved and variant.digest == expected.digest
    assert variant.grains == case.grains
    assert gw.Simulation(variant).step() > 0
    for other in (pickle.loads(pickle.dumps(case)), pickle.loads(pickle.dumps(variant))):
        assert other.with_overrides(heavy).digest == expected.digest
    # Overrides add up, and None removes a key that an earlier one has set.
    longer = variant.with_overrides({"time.end": "1 s", "time.stop": "landing"})
    assert longer.end == 1 and longer.grains == case.grains
    assert "landing" in longer.resolved
    assert longer.with_overrides({"time.stop": None, "time.end": 0.05}).resolved == expected.resolved
    assert case.with_overrides(["-fluid"]).resolved.count("[fluid]") == 0


def test_a_grain_in_memory_is_replaced():
    case, ball = pebbles(), gw.Grain.sphere("1 mm")
    variant = case.with_overrides({"grain.1.file": ball})
    assert variant.grains == [case.grains[0], ball]
    again = pickle.loads(pickle.dumps(variant)).with_overrides({"time.end": 1})
    assert again.grains == variant.grains


def test_a_problem_of_a_variant_is_located(case_file):
    for case in (pebbles(), gw.Case.load(case_file)):
        with pytest.raises(gw.CaseError) as refused:
            case.with_overrides({"time.end": "2 kg"})
        problem = refused.value.problems[0]
        assert (problem.key, problem.file, problem.line) == ("time.end", "overrides", 1)
        with pytest.raises(gw.CaseError, match="the case has no such key"):
            case.with_overrides({"time.ends": None})


def test_the_text_of_a_case_in_memory_says_how_to_vary_it():
    with pytest.raises(gw.CaseError, match="there is no grain file") as refused:
        gw.Case.from_toml(pebbles().resolved)
    assert "vary a case with Case.with_overrides" in refused.value.problems[0].help


def test_a_dry_case_needs_no_cells():
    grains = [gw.Grain.sphere("2 mm").at(["10 mm"] * 3, density=2500)]
    case = gw.Case.new(size=["20 mm"] * 3, end="50 ms", grains=grains)
    same = gw.Case.from_dict(
        {"domain": {"size": ["20 mm"] * 3}, "time": {"end": "50 ms"}, "grain": grains}
    )
    assert case.digest == same.digest
    with pytest.raises(gw.CaseError, match="cell_size"):
        gw.Case.new(size=["20 mm"] * 3, end="50 ms", fluid={"density": 1000, "viscosity": 1})


def test_cells_stand_for_their_size():
    assert pebbles(cell_size=None, cells=[16, 16, 24]).cells == pebbles().cells
    assert pebbles(cell_size=None, cells=np.array([16, 16, 24])).digest == pebbles().digest


def test_all_sides_have_one_word_and_grains_may_come_from_a_generator():
    ball = gw.Grain.sphere("1 mm")
    case = pebbles(boundaries="periodic", grains=(
        ball.at(["4 mm", "4 mm", z], density=np.float32(1500)) for z in ("8 mm", "4 mm")
    ))
    assert len(case.grains) == 2 and case.resolved.count("periodic") >= 3


def test_a_packing_takes_grains():
    rocks = [gw.Grain.family(0.7, 0.4, "1 mm", seed=seed, cells=24) for seed in (1, 2)]
    packing = {"count": 4, "files": rocks, "density": 2650}
    case = pebbles(grains=None, packing=[packing])
    assert case.grains == [rocks[0], rocks[1]] * 2
    with pytest.raises(gw.CaseError, match="packing.0.shapes.0: a Grain stands for the key `file`"):
        pebbles(grains=None, packing=[{"count": 4, "shapes": rocks, "density": 2650}])
