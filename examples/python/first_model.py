# %% [markdown]
# # A first model
# A machine file says what the machine is; a log says what its pressures were. From both comes a model of the working
# pressures, judged on a log that it has not seen. Run me with `PYTHONPATH=build/python /usr/bin/python3 examples/python/first_model.py`,
# or cell by cell in an editor that knows `# %%`.

# %%
import pathlib
import tempfile

import numpy as np

import sparflow

data = pathlib.Path(__file__).resolve().parents[2] / "problems"
folder = pathlib.Path(tempfile.mkdtemp())

# %% [markdown]
# The machine: joints, cylinders and pumps by name.

# %%
machine = sparflow.Machine.load(data / "machines/loader_crane.yaml")
print(machine)

# %% [markdown]
# Two logs. A signal is a view of the log's memory in SI, not a copy.

# %%
train = sparflow.Log.load(data / "logs/loader_crane_train.csv", machine)
test = sparflow.Log.load(data / "logs/loader_crane_test.csv", machine)
print(train)
pressure = train["pA_boom"]
print(f"bore side of the boom: {np.nanmin(pressure) / 1e5:.0f} to {np.nanmax(pressure) / 1e5:.0f} bar")

# %% [markdown]
# Arrays become a log by the same checks as a file: here the first half of the training log. Names have their units.

# %%
half = len(train) // 2
columns = {"t_s": train.time[:half], "pA_boom_bar": pressure[:half] / 1e5}
columns.update({f"q_{joint}_{'m' if train.unit('q_' + joint) == 'm' else 'rad'}": train["q_" + joint][:half]
                for joint in machine.joints})
print(sparflow.Log.from_arrays(columns, machine, "first half"))

# %% [markdown]
# The model, and how well it predicts the log that it has not seen.

# %%
fitted = sparflow.fit(machine, train, test=test)
print(fitted.headline)
print(fitted.to_frame()[["cylinder", "direction", "samples", "rmse_bar"]])
scores = sparflow.compare(fitted.model, test).to_frame()
print(scores[["stage", "at", "regime", "rmse", "unit", "fit_percent"]])

# %% [markdown]
# A model is one file, a page explains it, and the law can be evaluated for any states at once.

# %%
fitted.model.save(folder / "crane.json")
fitted.report(folder / "crane.html")
model = sparflow.Model.load(folder / "crane.json")
speeds = np.linspace(0.01, 0.05, 5)
q, qd = np.tile([0.4, -1.2, 1.2], (5, 1)), np.outer(speeds, [1.0, 0.0, 0.0])
power = sparflow.evaluate(model, q, qd, payload_kg=300)["power"][:, 0]
slope = sparflow.derivatives(model, q, qd, payload_kg=300)["power"]["qd"][:, 0, 0]
for v, p, s in zip(speeds, power, slope):
    print(f"boom at {v:.2f} rad/s: {p / 1e3:5.2f} kW, and {s / 1e3:6.1f} kW for each rad/s more")
