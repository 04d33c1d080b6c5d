"""From the log of a CAN bus (MDF 4 with raw frames, and its DBC file) to an energy-optimal motion.

    PYTHONPATH=build/python /usr/bin/python3 examples/bus_log_to_motion.py MACHINE.yaml LOG.mf4 TEST.mf4 MAPPING.yaml GOAL.yaml FOLDER

MAPPING.yaml names the database and says which of its signals is which column (docs/recordings.md).
"""
# %%
import pathlib
import sys

import sparflow

machine_file, log_file, test_file, mapping, goal, folder = sys.argv[1:7]
folder = pathlib.Path(folder)

# %% The machine and its logs: the database decodes the frames, the mapping gives the columns their names.
machine = sparflow.Machine.load(machine_file)
log = sparflow.Log.load(log_file, machine, mapping=mapping)
test = sparflow.Log.load(test_file, machine, mapping=mapping)
print(log)

# %% A first model, judged on the log that it has not seen.
fitted = sparflow.fit(machine, log, test=test)
print(fitted.headline)
print(sparflow.compare(fitted.model, test).to_frame())

# %% Which physical effect is missing?
why = sparflow.diagnose(fitted.model, log, test=test)
print(why.headline)
print(why.to_frame())

# %% Effects are added for as long as the error on unseen data falls.
better = sparflow.improve(fitted.model, log, test=test)
print(better.headline)
print("effects of the model:", *better.model.effects)
better.model.save(folder / "model.json")
better.report(folder / "improved.html")

# %% The motion of least energy with the improved model.
problem = sparflow.Problem.load(goal, better.model)
optimum = sparflow.optimize(problem)
print(optimum.headline)
(folder / "motion.csv").write_text(optimum.motion_csv())
