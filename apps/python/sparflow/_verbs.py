"""The verbs of the program as functions (docs/commands.md). Logs are a Log, a path, or a sequence of these."""

from . import _sparflow as core
from ._errors import UsageError


def fit(machine, logs, test=None, *, threads=0, effects=None, progress=None):
    """Identifies pressure models, margins, standby and valve gains from logs; returns a FitResult.

    test: logs to judge the model on, from which nothing is learned; without any, motions are held out.
    threads: for learning; 0 is one for each processor.
    effects: effects of your own (@sparflow.effect, or paths of YAML files) that the model's file shall contain.
    progress: called as progress(share, words) in this thread.
    Raises InputError where nothing could be learned, UsageError for a log given twice.
    """
    return core.fit(machine, dict(logs=logs, test=test, threads=threads, effects=effects, progress=progress))


def compare(model, logs):
    """Compares a Model with logs at every stage and shows where it fails; returns a CompareResult.

    With a Machine in place of the model, static forces and measured flows alone.
    """
    return core.compare(model, logs)


def diagnose(model, logs, references=None, test=None, *, candidates=None, effects=None, check_data=True, progress=None):
    """Finds which physical effect the model lacks, with evidence; or none, unknown or bad data. Returns a Diagnosis.

    references: logs of the same machine from before the effect. test: logs on which the effects found are judged.
    candidates: keys of effects ('coulomb_friction:boom'; without a place at all places); None is the whole catalogue.
    effects: effects of your own (@sparflow.effect, or paths of YAML files).
    check_data: look for stuck, jumping or noisy channels first.
    """
    return core.diagnose(model, dict(logs=logs, references=references, test=test, candidates=candidates,
                                     effects=effects, check_data=check_data, progress=progress))


def extend(model, logs, add=(), test=None, *, remove="", threads=0, effects=None, progress=None):
    """Adds effects to a model (or removes one), learns the rest again; returns an ExtendResult with errors before and after.

    add: a key or several, e.g. 'coulomb_friction:boom', added in this order. remove: the key of one to remove instead.
    test: logs to judge the error on; without any, motions are held out.
    """
    add = [add] if isinstance(add, str) else list(add)
    if bool(add) == bool(remove):
        raise UsageError("extend: give either add=[EFFECT[:AT], ...] or remove=EFFECT[:AT]")
    return core.extend(model, dict(logs=logs, add=add, test=test, remove=remove, threads=threads, effects=effects,
                                   progress=progress))


def improve(model, logs, references=None, test=None, *, max_steps=8, candidates=None, threads=0, effects=None,
            progress=None):
    """Repeats diagnose and extend until no effect is missing; returns an ExtendResult.

    Only effects that lower the error on data that took no part are kept. After Ctrl-C the exception's `result` has the
    steps done, where the work answered in time.
    """
    return core.improve(model, dict(logs=logs, references=references, test=test, max_steps=max_steps,
                                    candidates=candidates, threads=threads, effects=effects, progress=progress))


def selftest(model, logs, references=None, *, check=6, candidates=None, effects=None, progress=None):
    """Finds what these logs could reveal: injects every effect; returns a Selftest with power and indistinguishable sets.

    check: number of effects for which the whole search is run on injected data.
    """
    return core.selftest(model, dict(logs=logs, references=references, check=check, candidates=candidates,
                                     effects=effects, progress=progress))


def plan(problem, *, paths=8, seconds=5.0, seed=1, progress=None):
    """Finds collision-free paths by OMPL; returns a PlanResult. Raises InfeasibleError where there is none.

    paths: largest number. seconds: time for the search [s]. seed: of the random search.
    """
    return core.plan(problem, dict(paths=paths, seconds=seconds, seed=seed, progress=progress))


def optimize(problem, *, bound=False, start_from=None, paths=8, seconds=5.0, seed=1, intervals=0, processes=0,
             progress=None):
    """Computes the energy-optimal motion of a Problem; returns an OptimizeResult.

    bound: also an estimated lower bound. start_from: a Trajectory for a warm start. paths, seconds [s], seed: of the search
    for paths. intervals: of the mesh, 0 is the problem's. processes: starts solved in parallel, 0 is two.
    Raises InfeasibleError or NotConvergedError, whose `result` is what was tried; after Ctrl-C the exception's `result` has
    the best motion so far, where the work answered in time.
    """
    return core.optimize(problem, dict(bound=bound, start_from=start_from, paths=paths, seconds=seconds, seed=seed,
                                       intervals=intervals, processes=processes, progress=progress))


def evaluate(model, q, qd, qdd=None, *, payload_kg=0.0, oil_C=40.0):
    """The exact law of the Model on N states at once, without Python's lock; returns a dict of arrays, SI.

    q, qd, qdd: [N x joints] positions [rad or m], rates and accelerations of the joints (None: no inertia forces).
    Keys [N x cylinders]: 'speed' of the rods [m/s], 'static_force', 'total_force' with effects [N], 'flow' [m^3/s], working
    'pressure' [Pa, 0 at rest]; [N x pumps]: 'pump_flow', 'pump_pressure'; [N x 1]: 'power' of the pumps [W].
    Raises UsageError for another shape and for a posture in which a linkage cannot close.
    """
    return core.evaluate(model, q, qd, qdd, dict(payload_kg=payload_kg, oil_C=oil_C))
