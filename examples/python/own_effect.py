# %% [markdown]
# # An effect of your own
# An effect that the catalogue lacks is a Python function. It is called once and gives a formula: units are checked,
# derivatives are exact, and no Python runs while a model is evaluated.

# %%
import pathlib
import types

import numpy as np

import sparflow

data = pathlib.Path(__file__).resolve().parents[2] / "problems"
machine = sparflow.Machine.load(data / "machines/loader_crane.yaml")
log, test = data / "logs/loader_crane_friction_train.csv", data / "logs/loader_crane_friction_test.csv"

# %% [markdown]
# The friction of a seal, as a force on the rod. Bounds and a typical value have the parameter's unit.


# %%
@sparflow.effect(stage="force", at="cylinder",
                 parameters={"Fc": dict(unit="N", bounds=[0, 20000], typical=3000),
                             "v0": dict(unit="mm/s", bounds=[0.5, 50], typical=5)})
def seal_friction(s, p):
    "Seal friction of the rod"
    return p.Fc * np.tanh(s.v / p.v0)


print(seal_friction)

# %% [markdown]
# The function itself still works on numbers.

# %%
speeds = types.SimpleNamespace(v=np.array([-0.02, 0.0, 0.02]))
print(seal_friction(speeds, types.SimpleNamespace(Fc=5000.0, v0=0.005)))

# %% [markdown]
# It takes part in a diagnosis beside the catalogue's effects.

# %%
model = sparflow.fit(machine, log).model
why = sparflow.diagnose(model, log, test=test, candidates=["seal_friction", "viscous_friction"], effects=seal_friction)
print(why.headline)
print(why.to_frame()[["id", "at", "probability"]])

# %% [markdown]
# The extended model contains it, file and all, and so do motions that are optimised with that model.

# %%
better = sparflow.extend(model, log, "seal_friction:boom", test, effects=seal_friction)
print(better.headline)
print(better.model.effect("seal_friction:boom"))
states = np.array([[0.4, -1.2, 1.2]]), np.array([[0.03, 0.0, 0.0]])
force = [sparflow.evaluate(m, *states, payload_kg=300)["total_force"][0, 0] for m in (model, better.model)]
print(f"extending, the boom then needs {abs(force[1] - force[0]) / 1e3:.1f} kN more")
