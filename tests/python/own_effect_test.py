"""An effect written as a Python function is the same as one of a YAML file, in diagnosis too; what is no formula is refused."""

import math
import types

import numpy as np
import pytest

import sparflow
from conftest import DATA

TRAIN, TEST = DATA / "logs/loader_crane_friction_train.csv", DATA / "logs/loader_crane_friction_test.csv"
PARAMETERS = {"Fc": dict(unit="N", bounds=[0, 20000], typical=3000), "v0": dict(unit="mm/s", bounds=[0.5, 50], typical=5)}


@sparflow.effect(stage="force", at="cylinder", parameters=PARAMETERS)
def python_friction(s, p):
    """Friction by a function"""
    return p.Fc * np.tanh(s.v / p.v0)


def test_the_formula_is_the_function():
    assert python_friction.law == "(Fc * tanh((v / v0)))"
    at = types.SimpleNamespace(v=np.array([-0.01, 0.0, 0.02]))
    values = python_friction(at, types.SimpleNamespace(Fc=2.0, v0=0.01))
    assert np.allclose(values, [2 * math.tanh(-1), 0, 2 * math.tanh(2)])

    @sparflow.effect(stage="pressure", parameters={"k": dict(unit="bar/(l/min)", bounds=[0, 1], typical=0.1)})
    def hose(s, p):
        cold = sparflow.positive(sparflow.quantity(40, "degC") - s.oil) / sparflow.quantity(10, "K")
        return p.k * s.Q * cold**2 * sparflow.step(s.v > 0) * (1 - abs(np.sin(s.q.boom))) * np.maximum(-2.5, 1.5)

    assert hose.law == ("(((((k * Q) * ((positive((40.0[degC] - oil)) / 10.0[K]) ^ 2.0)) * step(v > 0.0)) * "
                        "(1.0 - abs(sin(q.boom)))) * 1.5)")


def test_tables_and_cases_of_numpy_become_formulas(machine):
    """The formula, worked out by Python, has NumPy's values; the program takes its units and its parameter."""
    speeds, forces = [-0.3, -0.05, 0.0, 0.1, 0.4], [2.0, 1.0, 0.0, 1.5, 1.8]

    def law(s, p):
        ratio = s.v / sparflow.quantity(1, "m/s") if isinstance(s.v, sparflow.Formula) else s.v
        return p.Fc * (np.interp(ratio, speeds, forces) + np.where(ratio > 0.2, 3.0, 0.5) + np.clip(ratio, -0.1, 0.2))

    keys = dict(Fc=dict(unit="N", bounds=[0, 20000], typical=3000))
    made = sparflow.effect(stage="force", parameters=keys, id="table")(law)
    v = np.linspace(-0.5, 0.6, 111) + 1e-4  # not at kinks
    text = made.law.replace("[m/s]", "").replace("^", "**")
    words = dict(positive=lambda x: np.maximum(x, 0), step=lambda x: np.asarray(x, float), max=np.maximum, min=np.minimum)
    by_formula = eval(text, words, dict(v=v, Fc=7.0))
    assert np.allclose(by_formula, law(types.SimpleNamespace(v=v), types.SimpleNamespace(Fc=7.0)), rtol=0, atol=1e-12)
    better = sparflow.fit(machine, TRAIN, effects=made)  # units and linear parameter are accepted
    assert better.model is not None


def test_diagnosis_names_it_and_finds_what_the_yaml_text_finds(machine, tmp_path):
    off = sparflow.fit(machine, TRAIN).model
    ours = sparflow.diagnose(off, TRAIN, test=TEST, candidates=["python_friction"], effects=python_friction).to_dict()
    (tmp_path / "text.yaml").write_text(
        "effects: [{id: text_friction, stage: force, law: Fc * tanh(v / v0), parameters: {Fc: {unit: N, bounds: [0, 20000], "
        "typical: 3000}, v0: {unit: mm/s, bounds: [0.5, 50], typical: 5}}}]\n")
    text = sparflow.diagnose(off, TRAIN, test=TEST, candidates=["text_friction"], effects=tmp_path / "text.yaml").to_dict()
    (a,), (b,) = ours["effects"], text["effects"]
    assert a["id"] == "python_friction" and a["at"] == b["at"] == "boom"
    for mine, other in zip(a["parameters"], b["parameters"]):
        assert mine["value"] == pytest.approx(other["value"], rel=1e-6)  # one formula, written in two ways
    better = sparflow.extend(off, TRAIN, "python_friction:boom", TEST, effects=[python_friction])
    assert better.model.effects == ["python_friction:boom"]


def test_what_is_no_formula_is_refused(machine):
    def refused(words, function):
        with pytest.raises(sparflow.UsageError, match=words):
            sparflow.effect(stage="force", parameters=PARAMETERS)(function)

    refused("cannot branch", lambda s, p: p.Fc if s.v > 0 else -p.Fc)
    refused("not those of `math`", lambda s, p: p.Fc * math.tanh(s.v / p.v0))
    refused("no arctan", lambda s, p: p.Fc * np.arctan(s.v / p.v0))
    refused("no convolve; it has interp", lambda s, p: p.Fc * np.convolve(s.v, [1, 2]))
    refused("xp that increases", lambda s, p: p.Fc * np.interp(s.v / p.v0, [1, 0], [0, 1]))
    refused("no parameter Fd", lambda s, p: p.Fd)
    wrong = sparflow.effect(stage="force", parameters=PARAMETERS, id="wrong_unit")(lambda s, p: p.Fc * s.v / p.v0**2)
    with pytest.raises(sparflow.InputError, match=r"own_effect_test.py, <lambda>\(\) in line \d+.*the unit of stage force"):
        sparflow.fit(machine, TRAIN, effects=wrong)
