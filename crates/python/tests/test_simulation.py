"""Simulations in memory: steps, arrays, control, interruption, checkpoints."""

import ast
import gc
import itertools
import os
import signal
import sys
import threading
import time
import types
import warnings

import numpy as np
import pytest

import grainwake as gw


def dry(**keys):
    return gw.Case.new(
        size=["4 mm", "4 mm", "8 mm"],
        cell_size="0.25 mm",
        grains=[gw.Grain.sphere("1 mm").at(["2 mm", "2 mm", "6 mm"], density=2500, **keys)],
        end="10 ms",
    )


def test_a_run_yields_states_at_its_times(sim):
    states = list(sim.run(until="10 ms", every="2 ms", progress=False))
    assert [state.time for state in states] == pytest.approx([0, 2e-3, 4e-3, 6e-3, 8e-3, 10e-3])
    assert states[-1].velocities[0, 2] < -0.02
    assert states[-1].positions.shape == (1, 3) and states[-1].orientations.shape == (1, 4)
    # States are copies.
    assert states[0].velocities[0, 2] == 0
    assert sim.time == pytest.approx(0.01) and sim.steps == states[-1].steps


def test_a_refined_box_follows_a_grain(case_file):
    refined = gw.Case.load(case_file, {"domain.refinement": 2})
    coarse, fine = gw.Simulation(gw.Case.load(case_file)), gw.Simulation(refined)
    for simulation in (coarse, fine):
        simulation.advance_to("10 ms")
    # Half the step; arrays have the cells of the whole box.
    assert fine.steps > 1.5 * coarse.steps
    assert fine.fluid_velocity("z").shape == coarse.fluid_velocity("z").shape
    difference = fine.velocities[0, 2] / coarse.velocities[0, 2] - 1
    assert 0 < abs(difference) < 0.05
    keywords = dict(size=[1, 1, 2], cell_size=0.125, end=1,
                    fluid={"density": 1, "viscosity": 0.1},
                    grains=[gw.Grain.sphere(0.5).at([0.5, 0.5, 1], density=2)])
    assert "refinement = 2" in gw.Case.new(refinement=2, **keywords).resolved
    wide = gw.Case.new(refinement=2, refinement_margin=[0.4, 0.4, 0.5], **keywords)
    assert "refinement_margin = [0.4, 0.4, 0.5]" in wide.resolved
    with pytest.raises(gw.CaseError, match="at least 3 cells"):
        gw.Case.new(refinement=2, refinement_margin=0.1, **keywords)
    with pytest.raises(gw.CaseError, match="found 3"):
        gw.Case.new(refinement=3, **keywords)


def test_states_continue_after_a_break(sim):
    for state in sim.run(every="2 ms", progress=False):
        if state.time > 3e-3:
            break
    later = [state.time for state in sim.run(until="8 ms", every="2 ms", progress=False)]
    assert later == pytest.approx([4e-3, 6e-3, 8e-3])


def test_steps_and_times_are_checked(sim):
    step = sim.step()
    assert step == sim.time_step == sim.time
    assert sim.step(horizon="1 ms") <= 1e-3
    for call, words in [
        (lambda: sim.step(horizon=0), "expected a positive time"),
        (lambda: sim.step(horizon=1e-9), "expected at least 1 us, a thousandth of the last step"),
        (lambda: sim.advance_to("2 mm"), "is a length"),
        (lambda: sim.run(every=-1), "expected a positive time"),
        (lambda: sim.run(until=-1), "until: found -1 s, which is before the present time"),
        (lambda: sim.run(until=0.5 * sim.time), "which is before the present time"),
        (lambda: sim.run(progress=3), "progress: found a value of type int; expected True, False"),
    ]:
        with pytest.raises(gw.CaseError, match=words):
            call()


def test_a_time_just_ahead_is_reached(sim):
    sim.advance_to("1 ms")
    time, steps = sim.time, sim.steps
    sim.advance_to(time * (1 + 1e-8))
    assert (sim.time, sim.steps) == (time, steps)


def test_a_run_may_end_at_the_present_time(sim):
    sim.advance_to("1 ms")
    assert [state.time for state in sim.run(until="1 ms", progress=False)] == [sim.time]


def test_copies_of_the_state_are_read_only(sim):
    sim.advance_to("1 ms")
    names = ("positions", "orientations", "velocities", "angular_velocities", "forces", "torques",
             "masses")
    state = sim.state()
    arrays = [getattr(sim, name) for name in names] + list(sim.contacts().values())
    arrays += [getattr(state, name) for name in names[:-1]]
    for array in arrays:
        assert not array.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        sim.positions[0, 0] = 9
    assert sim.positions.copy().flags.writeable


def test_the_bits_do_not_depend_on_threads_and_on_python(case):
    one, two = gw.Simulation(case, threads=1), gw.Simulation(case, threads=2)
    assert (one.threads, two.threads) == (1, 2)
    one.advance_to("4 ms")
    while two.time < 4e-3 * (1 - 1e-9):
        two.step(horizon=4e-3 - two.time)
    assert one.time == two.time
    assert (one.velocities == two.velocities).all()
    assert (one.fluid_velocity("z") == two.fluid_velocity("z")).all()


def test_a_simulation_beyond_the_memory_is_refused(case_file):
    huge = {"domain.cell_size": None, "domain.cells": [4000, 4000, 4000], "domain.size": [1, 1, 1]}
    case = gw.Case.load(case_file, huge)
    with pytest.raises(gw.CaseError, match="GB of memory and .* are free"):
        gw.Simulation(case)


def test_fields_are_shown_without_a_copy(sim, case):
    nx, ny, nz = case.cells
    sim.advance_to("2 ms")
    w = sim.fluid_velocity("z")
    assert w.shape == (nz + 1, ny, nx) and w.dtype == np.float64
    assert not w.flags.writeable and not w.flags.owndata
    assert sim.fluid_velocity("x").shape == (nz, ny, nx + 1)
    assert sim.kinematic_pressure().shape == (nz, ny, nx)
    # Two arrays show the same memory.
    assert np.shares_memory(w, sim.fluid_velocity("z"))
    with pytest.raises(ValueError):
        w[0, 0, 0] = 1
    with pytest.raises(ValueError):
        w.flags.writeable = True
    z, y, x = sim.coordinates("z")
    assert (len(z), len(y), len(x)) == w.shape
    assert z[0] == 0 and z[-1] == pytest.approx(8e-3) and x[0] == pytest.approx(0.125e-3)
    # The walls are at rest, and the fluid is fastest next to the grain.
    assert (w[0] == 0).all()
    at = np.unravel_index(np.argmin(w), w.shape)
    assert np.linalg.norm([z[at[0]] - 6e-3, y[at[1]] - 2e-3, x[at[2]] - 2e-3]) < 1e-3


def test_a_step_is_refused_while_an_array_shows_the_fields(sim):
    sim.step()
    w = sim.fluid_velocity("z")
    before, part = w.copy(), w[2:4, ::2]
    for change in (sim.step, lambda: sim.advance_to("5 ms"),
                   lambda: list(sim.run(progress=False))):
        with pytest.raises(BufferError, match="copy what is needed"):
            change()
    assert (w == before).all()
    # A part of the array keeps the memory as well.
    del w
    with pytest.raises(BufferError, match="1 array still shows"):
        sim.step()
    view = memoryview(part)
    del part
    with pytest.raises(BufferError):
        sim.step()
    view.release()
    del view
    sim.step()
    assert (sim.fluid_velocity("z") != before).any()


def test_an_array_outlives_its_simulation(case):
    sim = gw.Simulation(case)
    sim.step()
    pressure = sim.kinematic_pressure()
    copy = pressure.copy()
    del sim
    gc.collect()
    others = [gw.Simulation(case) for _ in range(3)]
    assert (pressure == copy).all()
    del others


def test_single_precision_shows_its_type(case_file):
    sim = gw.Simulation(gw.Case.load(case_file, {"run.precision": "f32"}))
    sim.step()
    assert sim.fluid_velocity("y").dtype == np.float32


def test_fields_at_cells(sim):
    pytest.importorskip("xarray")
    sim.advance_to("2 ms")
    velocity = sim.cell_field("velocity")
    w = sim.fluid_velocity("z")
    assert velocity[..., 2] == pytest.approx(0.5 * (w[1:] + w[:-1]))
    pressure = sim.cell_field("pressure")
    assert pressure == pytest.approx(1000 * sim.kinematic_pressure())
    fraction = sim.cell_field("solid_fraction")
    volume = fraction.sum() * (0.25e-3) ** 3
    assert volume == pytest.approx(np.pi / 6 * 1.5e-3**3, rel=0.02)
    with pytest.raises(gw.CaseError, match="expected one of velocity"):
        sim.cell_field("density")
    data = sim.to_xarray()
    assert data["velocity"].dims == ("z", "y", "x", "component")
    assert data["pressure"].attrs["units"] == "Pa" and data.attrs["time"] == sim.time
    at = dict(x=2e-3, y=2e-3, z=5.1e-3, method="nearest")
    below = data["velocity"].sel(component="z").sel(**at)
    assert float(below) == velocity[20, 8, 8, 2] < -1e-3


def test_velocity_at_points(sim):
    sim.advance_to("2 ms")
    w, (z, y, x) = sim.fluid_velocity("z"), sim.coordinates("z")
    found = sim.interpolate_velocity([[x[8], y[7], z[20]], [1, 1, 1]])
    assert found[0, 2] == pytest.approx(w[20, 7, 8]) and w[20, 7, 8] < -1e-3
    assert np.isnan(found[1]).all()
    with pytest.raises(gw.CaseError, match=r"\(2, 2\); expected \(n, 3\)"):
        sim.interpolate_velocity(np.zeros((2, 2)))


def test_a_dry_case_has_no_fields():
    sim = gw.Simulation(dry())
    sim.advance_to("5 ms")
    assert sim.velocities[0, 2] == pytest.approx(-9.81 * 5e-3, rel=1e-6)
    for ask in (lambda: sim.fluid_velocity("z"), sim.kinematic_pressure,
                lambda: sim.cell_field("pressure"), lambda: sim.interpolate_velocity([0, 0, 0])):
        with pytest.raises(gw.CaseError, match="has no fluid"):
            ask()


def test_a_controller_holds_a_grain_at_its_height(case):
    """A proportional and integral controller in Python against weight and drag."""
    sim = gw.Simulation(case)
    mass, target, integral = sim.masses[0], sim.positions[0, 2], 0.0
    for _ in range(60):
        error = target - sim.positions[0, 2]
        integral += error * sim.time_step
        lift = 2e3 * mass * (error + 30 * integral) - 100 * mass * sim.velocities[0, 2]
        sim.set_load(0, force=[0, 0, lift + 0.5 * mass * 9.81])
        sim.step()
    assert abs(sim.positions[0, 2] - target) < 2e-5
    free = gw.Simulation(case)
    free.advance_to(sim.time)
    assert target - free.positions[0, 2] > 2e-4


def test_a_prescribed_motion_is_followed_and_released(sim):
    start = sim.positions[0]
    sim.prescribe_motion(0, velocity=["10 mm/s", 0, 0], angular_velocity=[0, 0, "90 deg/s"])
    sim.advance_to("2 ms")
    assert sim.positions[0] == pytest.approx(start + [2e-5, 0, 0])
    assert sim.angular_velocities[0] == pytest.approx([0, 0, np.pi / 2])
    assert sim.forces[0, 0] < 0
    with pytest.raises(gw.CaseError, match="is prescribed; release the grain first"):
        sim.set_velocity(0, [0, 0, 0])
    sim.release(0)
    sim.advance_to("6 ms")
    assert sim.velocities[0, 2] < -0.01 and 0 < sim.velocities[0, 0] < 0.01


def test_a_set_velocity_acts_in_the_next_step():
    sim = gw.Simulation(dry())
    sim.set_velocity(0, velocity=(0.1, 0, 0), angular_velocity=(0, 0, 3))
    sim.advance_to("5 ms")
    assert sim.velocities[0, 0] == pytest.approx(0.1)
    assert sim.positions[0, 0] == pytest.approx(2e-3 + 0.1 * 5e-3)
    assert sim.angular_velocities[0, 2] == pytest.approx(3)


def test_wrong_control_is_refused(sim):
    with pytest.raises(IndexError, match="no grain 3: the simulation has 1 grain, counted from 0"):
        sim.set_load(3, force=[0, 0, 0])
    for call in (sim.set_velocity, sim.prescribe_motion, sim.set_load):
        with pytest.raises(IndexError, match="no grain -1: the simulation has 1 grain"):
            call(-1, [0, 0, 0])
    with pytest.raises(IndexError, match="no grain -1"):
        sim.release(-1)
    with pytest.raises(gw.CaseError, match="force, z.*is a length"):
        sim.set_load(0, force=[0, 0, "2 mm"])
    with pytest.raises(gw.CaseError, match="found 2 components"):
        sim.set_velocity(0, velocity=[0, 0])
    with pytest.raises(gw.CaseError, match="give velocity, angular_velocity or both"):
        sim.prescribe_motion(0)
    sim.prescribe_motion(0, angular_velocity=[0, 0, 1])
    before = sim.state()
    with pytest.raises(gw.CaseError, match="prescribed"):
        sim.set_velocity(0, [0, 0, -0.05], [1, 0, 0])
    assert (sim.state().velocities == before.velocities).all()
    sim.set_load(0, force=[0, 0, "2 uN"], torque=["1 nN m", 0, 0])


def test_sets_and_truth_values_are_refused_as_vectors_and_indices(sim):
    for other in ({1, 2, 3}, frozenset((1, 2, 3)), {1: 1, 2: 2, 3: 3}):
        with pytest.raises(gw.CaseError, match="velocity: found a set or dict, which has no order"):
            sim.set_velocity(0, velocity=other)
    for other in (True, 0.0, "0"):
        with pytest.raises(TypeError, match="grain: found .* expected a whole number"):
            sim.set_load(other)
    with pytest.raises(IndexError, match=f"no grain {2**200}"):
        sim.set_load(2**200)


def test_grains_have_indices_of_numpy(sim):
    sim.set_load(np.int64(0), force=[0, 0, "1 uN"])
    sim.prescribe_motion(np.uint8(0), [0, 0, 0])
    sim.release(np.int32(0))


def test_a_simulation_gives_the_warnings_of_its_case(case_file, tmp_path):
    coarse = gw.Case.load(case_file, {"domain.cell_size": "0.5 mm", "time.end": "1 ms"})
    assert coarse.warnings
    for more in ({}, {"output": tmp_path / "run"}):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            sim = gw.Simulation(coarse, threads=1, **more)
            list(sim.run(progress=False))
        assert [str(each.message) for each in caught] == coarse.warnings
        assert all(each.category is gw.CaseWarning for each in caught)
        assert all(each.filename == __file__ for each in caught)


def test_too_many_threads_are_reduced(case):
    with pytest.warns(gw.CaseWarning, match="1000000 threads are too many"):
        sim = gw.Simulation(case, threads=1_000_000)
    assert sim.threads <= 4 * os.cpu_count()
    with pytest.raises(gw.CaseError, match="threads: found -1; expected a whole number from 0 on"):
        gw.Simulation(case, threads=-1)


def test_contacts_are_listed():
    case = gw.Case.new(
        size=["4 mm", "4 mm", "4 mm"],
        cell_size="0.25 mm",
        grains=[gw.Grain.sphere("1 mm").at(["2 mm", "2 mm", "0.501 mm"], density=2500,
                                           velocity=[0, 0, -0.1])],
        end="10 ms",
        time={"step": "1 us"},
    )
    sim = gw.Simulation(case)
    contacts = sim.contacts()
    assert len(contacts["grain"]) == 0 and contacts["force"].shape == (0, 3)
    while not (contacts["overlap"] > 0).any():
        assert sim.steps < 200
        sim.step()
        contacts = sim.contacts()
    # The lower side along z, as in contacts.csv.
    assert contacts["grain"].tolist() == [0] and contacts["partner"].tolist() == [-5]
    assert contacts["overlap"][0] > 0 and contacts["force"][0, 2] > 0
    assert contacts["point"][0] == pytest.approx([2e-3, 2e-3, 0], abs=2e-5)


def test_diagnostics_are_small(sim):
    sim.advance_to("4 ms")
    found = sim.diagnostics()
    assert found["max_divergence"] < 1e-9 and abs(found["momentum_residual"]) < 1e-9
    assert found["grain_kinetic_energy"] > 0


def test_a_checkpoint_restores_the_bits(case, tmp_path):
    file = tmp_path / "state.ckpt"
    sim = gw.Simulation(case)
    sim.advance_to("2 ms")
    sim.save_checkpoint(file)
    sim.advance_to("4 ms")
    other = gw.Simulation(case)
    other.restore_checkpoint(file)
    assert other.time == pytest.approx(2e-3)
    other.advance_to("4 ms")
    assert (other.velocities == sim.velocities).all() and other.steps == sim.steps
    damaged = tmp_path / "damaged.ckpt"
    content = file.read_bytes()
    damaged.write_bytes(content[:100] + b"x" + content[101:])
    with pytest.raises(gw.CaseError, match="checksum does not match"):
        other.restore_checkpoint(damaged)
    damaged.write_bytes(b"short")
    with pytest.raises(gw.CaseError, match="cut off"):
        other.restore_checkpoint(damaged)
    with pytest.raises(gw.CaseError, match="belongs to another case"):
        gw.Simulation(dry()).restore_checkpoint(file)
    with pytest.raises(FileNotFoundError):
        other.restore_checkpoint(tmp_path / "none")


def test_a_restored_state_has_no_control(case, tmp_path):
    file = tmp_path / "state.ckpt"
    sim = gw.Simulation(case)
    sim.advance_to("2 ms")
    sim.save_checkpoint(file)
    sim.advance_to("4 ms")
    free = sim.state()
    for control in (
        lambda: sim.set_load(0, force=[0, 0, "100 uN"], torque=["1 nN m", 0, 0]),
        lambda: sim.prescribe_motion(0, velocity=[0, 0, 0]),
        lambda: sim.prescribe_motion(0, angular_velocity=[0, 0, 1]),
    ):
        control()
        sim.advance_to(sim.time + 1e-3)
        sim.restore_checkpoint(file)
        sim.advance_to("4 ms")
        assert sim.steps == free.steps
        for name in ("positions", "velocities", "angular_velocities", "forces"):
            assert (getattr(sim, name) == getattr(free, name)).all(), name


def test_a_restored_state_has_the_motions_of_its_case(tmp_path):
    """A formula that was replaced from Python, and a grain that has left since."""
    rising = dry(motion={"velocity": {"formula": ["0", "0", "0.1 * t"]}})
    sim = gw.Simulation(rising)
    sim.save_checkpoint(tmp_path / "state.ckpt")
    sim.advance_to("4 ms")
    z = sim.positions[0, 2]
    sim.release(0)
    sim.restore_checkpoint(tmp_path / "state.ckpt")
    sim.advance_to("4 ms")
    assert sim.positions[0, 2] == z > 6e-3

    leaving = gw.Case.new(
        size=["3 mm", "3 mm", "4 mm"], cell_size="0.25 mm", end="0.1 s",
        fluid={"density": 1000, "viscosity": "1 mPa s"},
        grains=[gw.Grain.sphere("1 mm").at(["1.5 mm", "1.5 mm", "1 mm"], density=2500,
                                           velocity=[0, 0, -0.2])],
        boundaries={"z": ["outflow", "wall"]},
    )
    sim = gw.Simulation(leaving)
    sim.advance_to("1 ms")
    sim.save_checkpoint(tmp_path / "state.ckpt")
    sim.advance_to("2 ms")
    at = sim.positions
    sim.advance_to("0.1 s")
    assert np.isinf(sim.positions).all()
    sim.restore_checkpoint(tmp_path / "state.ckpt")
    sim.advance_to("2 ms")
    assert (sim.positions == at).all()


def test_a_failed_simulation_continues_from_a_checkpoint(case_file, tmp_path):
    file = tmp_path / "state.ckpt"
    case = gw.Case.load(case_file, {"time.step": "0.5 ms", "time.end": "1 s"})
    sim = gw.Simulation(case)
    sim.advance_to("2 ms")
    sim.save_checkpoint(file)
    sim.advance_to("4 ms")
    good = sim.state()
    sim.set_velocity(0, velocity=[0, 0, -10])
    with pytest.raises(gw.SolverError, match="became unstable"):
        sim.advance_to("1 s")
    with pytest.raises(gw.SolverError, match="cannot be continued"):
        sim.set_load(0)
    (tmp_path / "bad.ckpt").write_bytes(b"short")
    with pytest.raises(gw.CaseError, match="cut off"):
        sim.restore_checkpoint(tmp_path / "bad.ckpt")
    with pytest.raises(gw.SolverError, match="cannot be continued"):
        sim.step()
    sim.restore_checkpoint(file)
    sim.advance_to("4 ms")
    assert sim.steps == good.steps
    for name in ("positions", "velocities", "forces", "torques"):
        assert (getattr(sim, name) == getattr(good, name)).all(), name


def test_a_restored_simulation_has_the_stop_condition_of_its_case(case_file, tmp_path):
    """The checkpoint of a case without a stop condition has no state of the events."""
    low = {"time.end": "1 s", "grain.0.position": ["2 mm", "2 mm", "1 mm"]}
    plain = gw.Simulation(gw.Case.load(case_file, low))
    plain.save_checkpoint(tmp_path / "state.ckpt")
    sim = gw.Simulation(gw.Case.load(case_file, {**low, "time.stop": "landing"}))
    last = list(sim.run(progress=False))[-1]
    assert sim.ended == "landing"
    sim.restore_checkpoint(tmp_path / "state.ckpt")
    sim.prescribe_motion(0, velocity=[0, 0, "10 mm/s"])
    sim.advance_to(last.time + 1e-3)
    assert sim.ended is None


def test_a_state_is_not_restored_under_an_array(sim, tmp_path):
    sim.step()
    sim.save_checkpoint(tmp_path / "state.ckpt")
    shown = sim.fluid_velocity("z")
    before = shown.copy()
    with pytest.raises(BufferError, match="1 array still shows"):
        sim.restore_checkpoint(tmp_path / "state.ckpt")
    assert (shown == before).all()


def test_failed_numerics_raise_solver_error(case_file):
    unstable = gw.Case.load(case_file, {"time.step": "20 ms", "time.end": "1 s"})
    sim = gw.Simulation(unstable)
    with pytest.raises(gw.SolverError, match="became unstable.*try"):
        sim.advance_to("1 s")
    with pytest.raises(gw.SolverError, match="cannot be continued"):
        sim.step()
    with pytest.raises(gw.SolverError, match="cannot be continued"):
        sim.save_checkpoint(case_file.with_name("failed.state"))


def test_the_lock_of_the_interpreter_is_released(case_file):
    sim = gw.Simulation(gw.Case.load(case_file, {"time.step": "20 us"}), threads=1)
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    started = time.monotonic()
    sim.advance_to("20 ms")
    wall = time.monotonic() - started
    done.set()
    counter.join()
    # With the lock held, the thread would count at most once per handling of signals, 20 times a
    # second. A busy machine allows about 100.
    assert counted[0] > 40 * wall


def test_another_thread_cannot_step_at_the_same_time(case_file):
    sim = gw.Simulation(gw.Case.load(case_file, {"time.step": "20 us"}))
    running = threading.Thread(target=lambda: sim.advance_to("20 ms"))
    running.start()
    refused = 0
    while running.is_alive():
        try:
            sim.step()
        except RuntimeError as error:
            refused += "only one thread may use a simulation at a time" in str(error)
        time.sleep(0.01)
    running.join()
    assert refused > 0
    assert sim.time >= 0.02 * (1 - 1e-9)


def test_all_of_a_simulation_is_refused_to_another_thread(case_file, tmp_path):
    sim = gw.Simulation(gw.Case.load(case_file, {"time.step": "20 us", "time.end": "1000 s"}))
    stop = threading.Event()
    entered = threading.Event()

    def advance():
        while not stop.is_set():
            entered.set()
            sim.advance_to(sim.time + 0.2)

    uses = {
        "step": sim.step, "advance_to": lambda: sim.advance_to("1 s"),
        "run": lambda: next(sim.run(progress=False)), "state": sim.state, "repr": lambda: repr(sim),
        "diagnostics": sim.diagnostics, "contacts": sim.contacts,
        "set_velocity": lambda: sim.set_velocity(0, [0, 0, 0]),
        "prescribe_motion": lambda: sim.prescribe_motion(0, [0, 0, 0]),
        "release": lambda: sim.release(0), "set_load": lambda: sim.set_load(0),
        "save_checkpoint": lambda: sim.save_checkpoint(tmp_path / "state"),
        "restore_checkpoint": lambda: sim.restore_checkpoint(tmp_path / "state"),
        "fluid_velocity": lambda: sim.fluid_velocity("z"),
        "kinematic_pressure": sim.kinematic_pressure,
        "cell_field": lambda: sim.cell_field("pressure"), "coordinates": sim.coordinates,
        "interpolate_velocity": lambda: sim.interpolate_velocity([0, 0, 0]),
        "to_xarray": sim.to_xarray, "checkpoint": sim.checkpoint, "finish": sim.finish,
        "__exit__": lambda: sim.__exit__(None, None, None), "_advance": lambda: sim._advance(1.0),
    }
    attributes = [name for name, member in vars(gw.Simulation).items()
                  if isinstance(member, types.GetSetDescriptorType)]
    uses.update({name: lambda name=name: getattr(sim, name) for name in attributes})
    methods = {name for name, member in vars(gw.Simulation).items() if callable(member)}
    assert methods - set(uses) <= {"__new__", "__enter__", "__repr__", "__doc__"}
    assert len(attributes) > 10

    running = threading.Thread(target=advance)
    running.start()
    try:
        entered.wait()
        for name, use in uses.items():
            # Between two calls of the other thread the simulation is free for a moment.
            for attempt in range(100):
                try:
                    use()
                except RuntimeError as error:
                    assert type(error) is RuntimeError, (name, error)
                    assert "in use by another call" in str(error), (name, error)
                    break
                except (gw.CaseError, FileNotFoundError):
                    pass
                time.sleep(0.001)
            else:
                pytest.fail(f"{name} was never refused")
    finally:
        stop.set()
        running.join()


@pytest.mark.skipif(sys.platform == "win32", reason="no signals of this kind")
def test_an_interrupt_stops_at_a_step(case_file):
    sim = gw.Simulation(gw.Case.load(case_file, {"time.end": "1000 s"}))
    threading.Timer(0.5, lambda: signal.raise_signal(signal.SIGINT)).start()
    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        sim.advance_to("1000 s")
    assert time.monotonic() - started < 5
    at = sim.time
    assert 0 < at < 1000
    sim.step()
    assert sim.time > at


def test_progress_goes_to_a_callable(sim, capfd, monkeypatch):
    # Every reading of this clock is a second after the last one.
    clock = types.SimpleNamespace(monotonic=itertools.count().__next__)
    monkeypatch.setattr("grainwake._simulation.clock", clock)
    seen = []
    for _ in sim.run(until="6 ms", every="2 ms", progress=seen.append):
        clock.monotonic()
    assert [each["time"] for each in seen] == pytest.approx([2e-3, 4e-3, 6e-3])
    assert seen[-1]["end"] == pytest.approx(6e-3)
    # The time of the caller between the states does not count.
    assert [each["wall_s"] for each in seen] == [1, 2, 3]
    assert capfd.readouterr().err == ""
    list(sim.run(until="8 ms", every="2 ms", progress=True))
    assert "100 %" in capfd.readouterr().err


def test_a_grain_that_has_left_is_at_infinity_and_out_of_the_table():
    pytest.importorskip("pandas")
    case = gw.Case.new(
        size=["3 mm", "3 mm", "4 mm"],
        cell_size="0.25 mm",
        fluid={"density": 1000, "viscosity": "1 mPa s"},
        grains=[gw.Grain.sphere("1 mm").at(["1.5 mm", "1.5 mm", "1 mm"], density=2500,
                                           velocity=[0, 0, -0.2])],
        boundaries={"z": ["outflow", "wall"]},
        end="0.1 s",
    )
    sim = gw.Simulation(case)
    states = list(sim.run(every="1 ms", progress=False))
    assert np.isinf(states[-1].positions).all()
    table = gw.frame(states)
    assert 0 < len(table) < len(states) and np.isfinite(table["z"]).all()
    with pytest.raises(gw.CaseError, match="grain 0 has left the box"):
        sim.set_load(0, force=[0, 0, 1e-6])


def test_states_become_a_table(sim):
    pandas = pytest.importorskip("pandas")
    table = gw.frame(sim.run(until="4 ms", every="2 ms", progress=False))
    assert isinstance(table, pandas.DataFrame)
    assert list(table["grain"]) == [0, 0, 0]
    assert table["vz"].is_monotonic_decreasing


def test_states_are_compared_by_identity(sim):
    first, second = sim.state(), sim.state()
    assert first == first and first != second
    assert {first, second, first} == {second, first} and first in [second, first]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_simulation_is_refused_in_a_process_made_by_fork(case):
    sim = gw.Simulation(case)
    sim.step()
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        # A step of its own would wait forever for threads that do not exist.
        signal.alarm(20)
        told = []
        for call in (sim.step, sim.diagnostics, lambda: sim.advance_to(1)):
            try:
                call()
            except RuntimeError as error:
                told.append(str(error))
        os.write(writer, repr((told, sim.positions.tolist())).encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as pipe:
        told, positions = ast.literal_eval(pipe.read())
    assert os.waitpid(child, 0)[1] == 0
    assert len(told) == 3 and all('start method "spawn"' in text for text in told)
    assert positions == sim.positions.tolist()
    sim.step()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_process_made_by_fork_has_threads_of_its_own(case):
    # The parent has started the threads that build grains and cases.
    make = lambda: gw.Grain.ellipsoid("2 mm", "1.6 mm", "1 mm", cells=24)
    grain = make()
    child = os.fork()
    if child == 0:
        signal.alarm(20)
        same = make() == grain
        entry = make().at(["2 mm", "2 mm", "4 mm"], density=2500)
        gw.Simulation(gw.Case.new(size=["4 mm", "4 mm", "8 mm"], end=1, grains=[entry])).step()
        os._exit(0 if same else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert make() == grain
