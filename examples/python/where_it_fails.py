# %% [markdown]
# # Where a model fails, and why
# These logs come from a crane whose boom cylinder has dry friction, which the model does not know. The comparison shows where
# it fails, the diagnosis which physical effect is missing, and the extended model that it was that.

# %%
import pathlib

import numpy as np

import sparflow

data = pathlib.Path(__file__).resolve().parents[2] / "problems"
machine = sparflow.Machine.load(data / "machines/loader_crane.yaml")
log = sparflow.Log.load(data / "logs/loader_crane_friction_train.csv", machine)
test = sparflow.Log.load(data / "logs/loader_crane_friction_test.csv", machine)
model = sparflow.fit(machine, log).model

# %% [markdown]
# Every stage has its scores: the static force, the flow, the working pressure, the pump.

# %%
compared = sparflow.compare(model, test)
print(compared.headline)
forces = compared.to_frame().query("stage == 'force'")
print(forces[["at", "regime", "rmse", "unit", "fit_percent"]])

# %% [markdown]
# The boom's force is the worst. Its error has the sign of its speed: that is what friction looks like.

# %%
time, measured, predicted = compared.series("force", "boom")
speed = sparflow.Signals(machine, test).cylinders[machine.cylinders.index("boom")].speed
error = predicted - measured
for name, side in (("extending", speed > 0.01), ("retracting", speed < -0.01)):
    print(f"boom {name}: the model is {np.nanmedian(error[side]) / 1e3:+.1f} kN off (median)")

# %% [markdown]
# The diagnosis says which effect is missing, with a probability and its parameters; here three candidates take part. Leave
# `candidates` out, and the whole catalogue does.

# %%
candidates = ["coulomb_friction", "viscous_friction", "pressure_offset"]
why = sparflow.diagnose(model, log, test=test, candidates=candidates)
print(why.headline)
print(why.to_frame()[["id", "at", "probability"]])

# %% [markdown]
# Added to the model, it lowers the error on the log that took no part.

# %%
better = sparflow.extend(model, log, why.named, test)
print(better.headline)
print(better.model.effect("coulomb_friction:boom"))
after = sparflow.compare(better.model, test).to_frame().query("stage == 'force' and at == 'boom'")
print(after[["at", "regime", "rmse", "unit", "fit_percent"]])
