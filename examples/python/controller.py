# %% [markdown]
# # A controller in Python
# A controller is a function of the state that returns levers. It drives the dynamic plant, first alone, then in the benchmark
# against the program's own controllers.

# %%
import pathlib
import tempfile

import sparflow

data = pathlib.Path(__file__).resolve().parents[2] / "problems"
machine = sparflow.Machine.load(data / "machines/loader_crane.yaml")

# %% [markdown]
# The shortest one: lift the boom to 0.3 rad. The state has the keys of docs/benchmark.md.

# %%
run = sparflow.simulate(machine, seconds=8, start={"boom": 0.1, "jib": -1.2}, payload_kg=300,
                        controller=lambda state: {"boom": 5.0 * (0.3 - state["q"]["boom"])})
print(run.headline)
print(f"the boom ends at {run.log['q_boom'][-1]:.3f} rad")

# %% [markdown]
# For the benchmark, one that is told its goal: every rod on a straight line, with the learned speed ahead and feedback.


# %%
class Straight:
    """Straight lines of the rods with feedback."""

    def begin(self, task):
        self.task, self.first = task, None

    def __call__(self, state):
        self.first = self.first or state
        time = 0.9 * self.task["duration_s"]
        share = min(1.0, (state["t_s"] - self.first["t_s"]) / time)
        levers = {}
        for rod, goal in self.task["goal"]["length_m"].items():
            way = goal - self.first["length_m"][rod]
            error = self.first["length_m"][rod] + share * way - state["length_m"][rod]
            levers[rod] = self.lever(rod, (way / time if share < 1 else 0.0) + 2.0 * error)
        return levers

    def lever(self, rod, speed):
        if abs(speed) < 0.002:
            return 0.0
        valve, way = self.task["valves"][rod], "extend" if speed > 0 else "retract"
        dead, part = valve["dead_" + way], abs(speed) / valve[way + "_m_s"]
        return (1 if speed > 0 else -1) * min(1.0, dead + (1.0 - dead) * part)


# %% [markdown]
# A scenario: where the machine stands, where the load shall go, how long that may take.

# %%
scenario = pathlib.Path(tempfile.mkdtemp()) / "lift.yaml"
scenario.write_text(f"""id: lift
machine: {data}/machines/loader_crane.yaml
start: {{q: {{boom: 0.2, jib: -1.2, extension: 0.6}}}}
payload_kg: 200
goals: [{{q: {{boom: 0.3, jib: -1.1, extension: 0.7}}, duration_s: 8}}]
tolerance_m: 0.2
""")
result = sparflow.benchmark(scenario, ["joint_pi", "sequential_operator"], functions={"straight": Straight},
                            model=data / "models/loader_crane.json", bound=False, seeds=2)
print(result.headline)
print(result.to_frame()[["controller", "seed", "status", "energy_J", "time_s", "tip_error_end_m"]])
