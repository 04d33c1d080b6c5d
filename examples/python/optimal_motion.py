# %% [markdown]
# # An energy-optimal motion
# The same move from rest to rest in the same time can take very different energy. Which motion takes least, how much does it
# save against what operators do, and how does that depend on the time?

# %%
import pathlib

import numpy as np

import sparflow

data = pathlib.Path(__file__).resolve().parents[2] / "problems"
model = sparflow.Model.load(data / "models/hmf_2020_k4_load_sensing_plant.json")
problem = sparflow.Problem.load(data / "reaches/hmf_lift.yaml", model)
print(f"{problem.name}, {problem.payload:.0f} kg")

# %% [markdown]
# The optimum. The notebook uses a coarse mesh; leave `intervals` out for the problem's own.

# %%
optimum = sparflow.optimize(problem, intervals=30)
motion = optimum.motion
print(optimum.headline)
print(f"{optimum.energy_exact_J / 1e3:.2f} kJ in {optimum.duration_s:.1f} s, {len(motion)} rows")

# %% [markdown]
# The law on all rows at once: when is the power needed, and where does it go?

# %%
law = sparflow.evaluate(model, motion.q, motion.qd, motion.qdd, payload_kg=problem.payload)
power = law["power"][:, 0]
print(f"largest power {power.max() / 1e3:.2f} kW at {motion.t[power.argmax()]:.1f} s")
print(f"energy by the trapezoidal rule over the rows: {np.trapz(power, motion.t) / 1e3:.2f} kJ")
cylinders = law["flow"] * law["pressure"]
for name, share in zip(model.machine.cylinders, np.trapz(cylinders, motion.t, axis=0)):
    print(f"  {share / 1e3:6.2f} kJ reach cylinder {name}")

# %% [markdown]
# Against other strategies in equal time.

# %%
strategies = sparflow.strategies(problem, orders=1, paths=1, intervals=20)
print(strategies.headline)
print(strategies.to_frame()[["strategy", "feasible", "energy_J", "duration_s"]])

# %% [markdown]
# The least energy as a function of the duration; which duration is best depends on what idling takes.

# %%
curve = sparflow.pareto(problem, points=4, longest=3, idle_kW=[5], paths=1, intervals=20)
print(curve.headline)
print(curve.to_frame()[["duration_s", "energy_J"]])
best = curve.to_dict()["idle"]
print(f"idling at 5 kW, {best[0]['duration_s']:.2f} s is the best duration")

# %% [markdown]
# And on the dynamic plant, of whose log the model was learned? It has what the model does not know: valves and a pump that take time,
# and a payload that swings; docs/benchmark.md compares over many moves.

# %%
run = sparflow.simulate(model.machine, track=motion, seconds=motion.duration, payload_kg=problem.payload)
print(f"{run.energy_J / 1e3:.2f} kJ went into the valves; the model said {optimum.energy_exact_J / 1e3:.2f} kJ")
