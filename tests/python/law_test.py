"""The exact law on arrays gives the rows of MOTION.csv, and refuses arrays of another shape."""

import csv
import io

import numpy as np
import pytest

import sparflow
from conftest import DATA


def test_the_law_on_arrays_gives_the_rows_of_an_optimised_motion():
    model = sparflow.Model.load(DATA / "models/loader_crane.json")
    problem = sparflow.Problem.load(DATA / "reaches/loader_crane_lift.yaml", model)
    motion = sparflow.optimize(problem, intervals=20)
    rows = list(csv.DictReader(io.StringIO(motion.motion_csv())))
    column = lambda name: np.array([float(row[name]) for row in rows])
    joints = [("q_boom_rad", "qd_boom_rad_s", "qdd_boom_rad_s2"), ("q_jib_rad", "qd_jib_rad_s", "qdd_jib_rad_s2"),
              ("q_extension_m", "qd_extension_m_s", "qdd_extension_m_s2")]
    q, qd, qdd = (np.column_stack([column(names[k]) for names in joints]) for k in range(3))
    payload = float(rows[0]["payload_kg"])
    law = sparflow.evaluate(model, q, qd, qdd, payload_kg=payload)
    # The text has some nine digits; a pump's pressure jumps where a cylinder comes to rest, at the rows of rest itself.
    moving = np.abs(qd).max(axis=1) > 1e-3
    assert moving.sum() > 10
    assert np.allclose(law["power"][moving, 0], column("power_W")[moving], rtol=1e-5, atol=1e-2)
    assert np.allclose(law["pump_pressure"][moving, 0], 1e5 * column("p_main_bar")[moving], rtol=1e-5)
    # One row at a time is the same.
    one = sparflow.evaluate(model, q[7:8], qd[7:8], qdd[7:8], payload_kg=payload)
    assert all(np.array_equal(one[key][0], law[key][7]) for key in law)
    # Rest needs no flow and no power.
    rest = sparflow.evaluate(model, q, 0 * qd, payload_kg=payload)
    assert not rest["power"].any() and not rest["flow"].any() and rest["static_force"].any()


def test_other_shapes_are_refused():
    model = sparflow.Model.load(DATA / "models/loader_crane.json")
    q = np.zeros((4, 3))
    with pytest.raises(sparflow.UsageError, match=r"qd has the shape \(4, 2\), expected \(4, 3\)"):
        sparflow.evaluate(model, q, q[:, :2])
    with pytest.raises(sparflow.UsageError, match=r"q has the shape \(3\)"):
        sparflow.evaluate(model, q[0], q[0])


def test_derivatives_are_those_of_the_law():
    model = sparflow.Model.load(DATA / "models/loader_crane.json")
    generator = np.random.default_rng(7)
    # The middle half of the joints' ranges, and rates at which every cylinder moves.
    q = np.array([0.4, -1.2, 1.2]) + generator.uniform(-0.25, 0.25, (40, 3))
    qd = generator.uniform(0.02, 0.08, (40, 3)) * generator.choice([-1.0, 1.0], (40, 3))
    qdd = np.zeros_like(q)
    exact = sparflow.derivatives(model, q, qd, qdd, payload_kg=300)
    step = 1e-6
    for variable, (at, rate) in dict(q=(1, 0), qd=(0, 1)).items():
        for joint in range(3):
            move = np.zeros(3)
            move[joint] = step
            after = sparflow.evaluate(model, q + at * move, qd + rate * move, qdd, payload_kg=300)
            before = sparflow.evaluate(model, q - at * move, qd - rate * move, qdd, payload_kg=300)
            for quantity, value in after.items():
                numeric = (value - before[quantity]) / (2 * step)
                ours = exact[quantity][variable][:, :, joint]
                # Central differences: their error is some 1e-10 of the value over the step, and the second derivative's part.
                scale = np.abs(value).max() + np.abs(numeric).max()
                assert np.allclose(ours, numeric, rtol=1e-5, atol=1e-6 * scale), (quantity, variable, joint)
    assert np.abs(exact["power"]["qd"]).min(axis=2).max() > 0 and not exact["power"]["qdd"].any()


def test_derivatives_at_rest_are_those_of_rest():
    model = sparflow.Model.load(DATA / "models/loader_crane.json")
    q = np.array([[0.4, -1.2, 1.2]])
    rest = sparflow.derivatives(model, q, 0 * q, payload_kg=300)
    assert not rest["power"]["qd"].any() and not rest["flow"]["qd"].any() and rest["static_force"]["q"].any()
    assert rest["speed"]["qd"].any()
    with pytest.raises(sparflow.UsageError, match="derivatives: qd has the shape"):
        sparflow.derivatives(model, q, q[:, :2])
