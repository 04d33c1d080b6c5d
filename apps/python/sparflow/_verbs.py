"""The verbs of the program as functions (docs/commands.md). Logs are a Log, a path, or a sequence of these."""

import os

from . import _controllers, _inputs
from . import _sparflow as core
from ._errors import UsageError


def propose_mapping(path, machine, *, mapping=None, dbc=(), progress=None):
    """Lists the channels of a log and proposes which of the machine's signals each is; returns a MappingProposal.

    path: a log of any format. machine: a Machine or the path of its file. mapping: path of a mapping file to read it by.
    dbc: path of a database that decodes its CAN frames, or several.
    Nothing uses the proposal unasked: `.save(path)` writes what is sure as a mapping file (docs/mapping_proposal.md).
    progress: called as progress(share, words) in this thread. Raises InputError.
    """
    dbc = [dbc] if isinstance(dbc, (str, os.PathLike)) else list(dbc)
    return core.propose_mapping(path, _inputs.one("propose_mapping", machine, core.Machine), dict(
        mapping="" if mapping is None else os.fspath(mapping), dbc=[os.fspath(d) for d in dbc], progress=progress))


def fit(machine, logs, test=None, *, mapping=None, threads=0, effects=None, progress=None):
    """Identifies pressure models, margins, standby and valve gains from logs; returns a FitResult.

    machine: a Machine or the path of its file. test: logs to judge the model on, from which nothing is learned; without any,
    motions are held out. mapping: path of a mapping file for logs given by their paths (docs/log_format.md).
    threads: for learning; 0 is one for each processor.
    effects: effects of your own (@sparflow.effect, or paths of YAML files) that the model's file shall contain.
    progress: called as progress(share, words) in this thread.
    Raises InputError where nothing could be learned, UsageError for a log given twice.
    """
    machine = _inputs.one("fit", machine, core.Machine)
    return core.fit(machine, dict(logs=_inputs.logs(logs, machine, mapping), test=_inputs.logs(test, machine, mapping),
                                  threads=_inputs.threads("fit", threads), effects=effects, progress=progress))


def compare(model, logs):
    """Compares a Model with logs at every stage and shows where it fails; returns a CompareResult.

    With a Machine in place of the model, static forces and measured flows alone.
    """
    return core.compare(_inputs.one("compare", model, core.Model, core.Machine), logs)


def diagnose(model, logs, references=None, test=None, *, candidates=None, effects=None, check_data=True, progress=None):
    """Finds which physical effect the model lacks, with evidence; or none, unknown or bad data. Returns a Diagnosis.

    references: logs of the same machine from before the effect. test: logs on which the effects found are judged.
    candidates: keys of effects ('coulomb_friction:boom'; without a place at all places); None is the whole catalogue.
    effects: effects of your own (@sparflow.effect, or paths of YAML files).
    check_data: look for stuck, jumping or noisy channels first.
    """
    return core.diagnose(_inputs.one("diagnose", model, core.Model), dict(
        logs=logs, references=references, test=test, candidates=candidates,
        effects=effects, check_data=check_data, progress=progress))


def extend(model, logs, add=(), test=None, *, remove="", threads=0, effects=None, progress=None):
    """Adds effects to a model (or removes one), learns the rest again; returns an ExtendResult with errors before and after.

    add: a key or several, e.g. 'coulomb_friction:boom', added in this order. remove: the key of one to remove instead.
    test: logs to judge the error on; without any, motions are held out.
    """
    add = [add] if isinstance(add, str) else list(add)
    if bool(add) == bool(remove):
        raise UsageError("extend: give either add=[EFFECT[:AT], ...] or remove=EFFECT[:AT]")
    return core.extend(_inputs.one("extend", model, core.Model), dict(
        logs=logs, add=add, test=test, remove=remove, threads=_inputs.threads("extend", threads), effects=effects,
        progress=progress))


def improve(model, logs, references=None, test=None, *, max_steps=12, candidates=None, threads=0, effects=None,
            journal=None, resume=False, progress=None):
    """Repeats diagnose and extend until no effect is missing; returns an ExtendResult.

    Only effects that lower the error on data that took no part are kept. After Ctrl-C the exception's `result` has the
    steps done, where the work answered in time.
    journal: path of a file that takes every finished part at once; a call that ends whole deletes it. resume: take what the
    journal of an earlier call with the same inputs and options has; InputError for one of other inputs.
    """
    return core.improve(_inputs.one("improve", model, core.Model), dict(
        logs=logs, references=references, test=test, max_steps=_inputs.whole("improve", "max_steps", max_steps, 1, 20),
        candidates=candidates, threads=_inputs.threads("improve", threads), effects=effects, journal=journal, resume=bool(resume),
        progress=progress))


def selftest(model, logs, references=None, *, check=6, candidates=None, effects=None, progress=None):
    """Finds what these logs could reveal: injects every effect; returns a Selftest with power and indistinguishable sets.

    check: number of effects for which the whole search is run on injected data.
    """
    return core.selftest(_inputs.one("selftest", model, core.Model), dict(
        logs=logs, references=references, check=_inputs.whole("selftest", "check", check, 0, 10**9), candidates=candidates,
        effects=effects, progress=progress))


def plan(problem, *, paths=8, seconds=5.0, seed=1, progress=None):
    """Finds collision-free paths by OMPL; returns a PlanResult. Raises InfeasibleError where there is none.

    paths: largest number. seconds: time for the search [s]. seed: of the random search.
    """
    return core.plan(_inputs.one("plan", problem, core.Problem), dict(
        paths=paths, seconds=seconds, seed=_inputs.seed("plan", seed), progress=progress))


def optimize(problem, *, bound=False, start_from=None, paths=8, seconds=5.0, seed=1, intervals=0, processes=0,
             progress=None):
    """Computes the energy-optimal motion of a Problem; returns an OptimizeResult.

    bound: also an estimated lower bound. start_from: a Trajectory for a warm start. paths, seconds [s], seed: of the search
    for paths. intervals: of the mesh, 0 is the problem's. processes: starts solved in parallel, 0 is two.
    Raises InfeasibleError or NotConvergedError, whose `result` is what was tried; after Ctrl-C the exception's `result` has
    the best motion so far, where the work answered in time.
    """
    return core.optimize(_inputs.one("optimize", problem, core.Problem), dict(
        bound=bound, start_from=start_from, paths=paths, seconds=seconds, seed=_inputs.seed("optimize", seed),
        intervals=intervals, processes=processes, progress=progress))


def price(motion, *, model=None, problem=None, payload_kg=None, mapping=None):
    """Prices a motion of your own by the exact law, as the verb `evaluate`: energy, losses, limits; returns a PriceResult.

    motion: the path of a motion or log, a Trajectory, a Log, a DataFrame, or arrays by column name. Columns are those of a file:
    't_s' [s] and either 'q_', 'qd_' and 'qdd_' of each joint ('q_boom_rad', 'qd_boom_rad_s', 'qdd_boom_rad_s2'; 'm' in place of
    'rad' where it slides), which are taken as they are, or positions alone, 'q_boom_rad' or strokes 'x_boom_m': then speeds are
    found by smoothing, and a rod slower than 2 mm/s stands. Of a Log only the positions are used.
    model: a Model or the path of its file. problem: a Problem or the path of its file, whose limits, obstacles, payload, duration,
    start and goal judge the motion; without one, the machine's own limits do. For the path of a problem, model replaces the one
    that it names. payload_kg: payload [kg]; None is that of the problem or of the log.
    mapping: path of a mapping file for other column names.
    A limit that is broken is no exception: see `limits_kept` and `to_dict()["limits"]`.
    Raises InputError where the motion cannot be read, UsageError without a model and for a Trajectory of another machine.
    """
    if problem is None and model is None:
        raise UsageError("price: give model=, or problem= whose file names a model")
    if model is not None:
        model = _inputs.one("price", model, core.Model)
    if isinstance(problem, core.Problem) and model is not None:
        raise UsageError("price: give either model= or a Problem, which has its model; Problem.load(path, model) makes one with another")
    if isinstance(problem, (str, os.PathLike)):
        problem, model = core.Problem.load(problem, model), None
    if problem is not None:
        problem = _inputs.one("price", problem, core.Problem)
    return core.price(problem, model, dict(motion=_inputs.motion(motion), payload_kg=payload_kg,
                                           mapping="" if mapping is None else os.fspath(mapping)))


def _several(given, one):
    return [given] if isinstance(given, one) else list(given)


def strategies(problems, *, time="equal", idle_kW=None, paths=8, orders=4, seed=1, intervals=0, processes=0, journal=None,
               resume=False, progress=None):
    """Compares sequential, simultaneous and energy-optimal motions of one Problem or several; returns a StrategiesResult.

    time: 'equal' (the problem's duration), 'own' (the best time of each strategy, with idle power), factors of the shortest
    time, or several of these separated by commas: 'equal,1.1,1.5'. idle_kW: idle power [kW]; None is the problem's.
    paths, seed: of the search for paths. orders: of the cylinders, whose segments are optimised. intervals: of the mesh, 0 is
    the problem's. processes: problems solved in parallel, 0 is one for each processor.
    Raises InfeasibleError where no energy-optimal motion was found; after Ctrl-C the exception's `result` has the problems done.
    journal: path of a file that takes every finished part at once; a call that ends whole deletes it. resume: take what the
    journal of an earlier call with the same inputs and options has; InputError for one of other inputs.
    """
    return core.strategies(_inputs.several("strategies", problems, core.Problem), dict(
        time=str(time), idle_kW=idle_kW, paths=paths, orders=orders, seed=_inputs.seed("strategies", seed), intervals=intervals,
        processes=processes, journal=journal, resume=bool(resume), progress=progress))


def pareto(problem, *, points=14, longest=6.0, idle_kW=(1, 2, 5, 10, 15), paths=8, seed=1, intervals=0, processes=0,
           journal=None, resume=False, progress=None):
    """Computes the least energy over the duration of a Problem; returns a ParetoResult.

    points: number of durations besides those that search for the shortest. longest: the longest duration over the shortest.
    idle_kW: idle powers [kW] for which the best duration is told. paths, seed, intervals: as in optimize. processes: starts
    solved in parallel, 0 is two.
    Raises InfeasibleError where there is no motion; after Ctrl-C the exception's `result` has the points done.
    journal: path of a file that takes every finished part at once; a call that ends whole deletes it. resume: take what the
    journal of an earlier call with the same inputs and options has; InputError for one of other inputs.
    """
    return core.pareto(_inputs.one("pareto", problem, core.Problem), dict(
        points=points, longest=longest, idle_kW=list(idle_kW), paths=paths, seed=_inputs.seed("pareto", seed),
        intervals=intervals, processes=processes, journal=journal, resume=bool(resume), progress=progress))


def audit(model, logs, *, payload_kg=None, pause_s=1.0, moves=40, litres_per_kWh=0.0, engine_map=None, bound=True,
          processes=0, progress=None):
    """Compares each recorded move with its energy-optimal motion: what was wasted, where, why; returns an AuditResult.

    payload_kg: payload [kg]; None is that of the log. pause_s: shortest rest that ends a move [s].
    moves: moves examined at most, those with the longest way. litres_per_kWh: fuel for each kWh of hydraulic energy
    [l/kWh]; engine_map: path of the engine's fuel over its power (YAML) in its place. bound: also lower bounds of the energy.
    processes: starts solved in parallel, 0 is one for each processor.
    Raises InputError where the logs have no move; after Ctrl-C the exception's `result` has the moves examined.
    """
    if litres_per_kWh and engine_map is not None:
        raise UsageError("audit: give either litres_per_kWh or engine_map")
    return core.audit(_inputs.one("audit", model, core.Model), dict(
        logs=logs, payload_kg=payload_kg, pause_s=pause_s, moves=moves, litres_per_kWh=litres_per_kWh, engine_map=engine_map,
        bound=bound, processes=processes, progress=progress))


def simulate(machine, *, seconds=60.0, rate=50.0, seed=1, effects=(), plant=None, programme="operator", track=None, replay=None,
             motion=None, controller=None, start=None, payload_kg=None, progress=None):
    """Lets the dynamic plant, which knows no law of the model, do something; returns a Simulation with its log.

    seconds: duration [s]. rate: samples a second [Hz]. seed: of the random work and the sensors.
    effects: items 'NAME[:AT][=VALUE|=off]', 'none' or 'all', in their order (plant_effects() lists them). plant: path of a file
    with parameters of the plant (docs/plant.md).
    One of these drives it: programme, 'operator' or 'cycles'; track, a Trajectory or the path of a motion or log, whose joint
    positions are followed; replay, the path of a file with commands; motion, one that diagnose proposes, by its words or number;
    controller, a function of the state that returns levers from -1 to 1 by cylinder, {'boom': 0.3}; one that is not named is 0.
    The state is a dict with 't_s' [s], 'q' and 'qd' by joint [rad, rad/s or m, m/s], 'length_m' of the cylinders pin to pin,
    'pA_bar' and 'pB_bar' by cylinder, 'p_bar' by pump, 'payload_kg' and 'oil_C': true values of the plant.
    start: joint positions by name for a controller [rad or m]; others stand in the middle of their ranges.
    payload_kg: payload [kg]; None is that of the file, or drawn, for a controller 0.
    A run that ends early, because the machine leaves its kinematics, is told by a warning and by `status`; after Ctrl-C the
    exception's `result` has the log so far. What the controller raises ends the run and is raised here.
    """
    if programme not in ("operator", "cycles"):
        raise UsageError(f"simulate: programme is 'operator' or 'cycles'; got {programme!r}")
    if start is not None and controller is None:
        raise UsageError("simulate: start is for a controller; programmes begin where they say")
    if controller is not None:
        _controllers.check(controller)
    return core.simulate(_inputs.one("simulate", machine, core.Machine), dict(
        seconds=seconds, rate=rate, seed=_inputs.seed("simulate", seed), effects=_several(effects, str), plant=plant,
        programme=programme, track=track, replay=replay, motion=motion, ask=None if controller is None else _controllers.asked(controller), start=dict(start or {}),
        payload_kg=payload_kg, progress=progress))


def benchmark(scenarios, controllers=None, *, model=None, functions=None, processes=None, gains=None, reference="", seeds=0,
              optimum=True, bound=True, sway_deg=0.0, step_budget_s=0.5, jobs=0, journal=None, resume=False, progress=None):
    """Compares controllers on the dynamic plant: true energy, time, errors; returns a BenchmarkResult.

    scenarios: a path of a scenario or a folder of them, or several. controllers: names of the program's; None is all of them,
    or none where functions or processes are given.
    functions: controllers of your own by name, {'mine': function of the state} as in simulate, but with what sensors tell. An
    object with a method begin(task) is told each goal (the keys are those of docs/benchmark.md); of a class a new object is made
    for each run. They run in this process, one run after another; what they raise is the reason of a failed run.
    processes: programs of your own by name, {'mine': 'python3 mine.py'}, which must answer a step in step_budget_s [s].
    model: a Model or the path of one; None is the one that each scenario names. gains: {'joint_pi.proportional': 1.2}.
    reference: name of the controller that others are compared with; '' is tracked_optimum, or the first. seeds: runs of each
    controller in each scenario; 0 is the scenario's seeds. optimum, bound: also the energy-optimal motion and its lower bound.
    sway_deg: limit of the payload's sway for which these motions are planned, 0 is none.
    jobs: runs at the same time, 0 is one for each processor. After Ctrl-C the exception's `result` has the runs done.
    journal: path of a file that takes every finished part at once; a call that ends whole deletes it. resume: take what the
    journal of an earlier call with the same inputs and options has; InputError for one of other inputs. What functions and
    programs of your own do is not known to it: after a change of one, begin anew.
    """
    functions, processes = dict(functions or {}), dict(processes or {})
    for function in functions.values():
        _controllers.check(function)
    names = [controllers] if isinstance(controllers, str) else list(controllers or ())
    return core.benchmark(dict(
        scenarios=_several(scenarios, (str, os.PathLike)), controllers=names, no_others=bool(functions or processes),
        functions=[(name, _controllers.words(f), lambda f=f: _controllers.asked(f)) for name, f in functions.items()],
        processes=[f"{name}={command}" for name, command in processes.items()],
        gains=[f"{name}={value!r}" for name, value in dict(gains or {}).items()], model=model, reference=reference, seeds=seeds,
        optimum=optimum, bound=bound, sway_deg=sway_deg, step_budget_s=step_budget_s, jobs=jobs, journal=journal,
        resume=bool(resume), progress=progress))


def loop_of_trust(machine, *, train_seconds=200.0, test_seconds=100.0, rate=25.0, most_effects=12, moves=3, seed=1, effects=(),
                  processes=0, progress=None):
    """Closes the loop on the dynamic plant: does what a model promises come true? Returns a TrustLoop.

    The plant writes train_seconds [s] of an operator's work to learn from and test_seconds [s] to judge on; a model is fitted,
    diagnosed and improved; moves drawn from the seed are optimised by the model before and after, and tracked on the plant, beside
    a sequential operator and joint PI. True energy is the pumps' pressure times their flow.
    rate: samples a second [Hz]. most_effects: that improve may add. moves: number of them.
    effects: of the plant, as in simulate. processes: motions at the same time, 0 is one for each processor.
    """
    return core.loop_of_trust(_inputs.one("loop_of_trust", machine, core.Machine), dict(
        train_seconds=train_seconds, test_seconds=test_seconds, rate=rate, most_effects=most_effects, moves=moves,
        seed=_inputs.seed("loop_of_trust", seed), effects=_several(effects, str), processes=processes, progress=progress))


def evaluate(model, q, qd, qdd=None, *, payload_kg=0.0, oil_C=40.0):
    """The exact law of the Model on N states at once, without Python's lock; returns a dict of arrays, SI.

    q, qd, qdd: [N x joints] positions [rad or m], rates and accelerations of the joints (None: no inertia forces).
    Keys [N x cylinders]: 'speed' of the rods [m/s], 'static_force', 'total_force' with effects [N], 'flow' [m^3/s], working
    'pressure' [Pa, 0 at rest]; [N x pumps]: 'pump_flow', 'pump_pressure'; [N x 1]: 'power' of the pumps [W].
    Raises UsageError for another shape and for a posture in which a linkage cannot close.
    """
    return core.evaluate(_inputs.one("evaluate", model, core.Model), dict(q=q, qd=qd, qdd=qdd, payload_kg=payload_kg, oil_C=oil_C))


def derivatives(model, q, qd, qdd=None, *, payload_kg=0.0, oil_C=40.0):
    """The exact first derivatives of what `evaluate` gives, on N states at once; returns a dict of dicts of arrays, SI.

    derivatives(...)['power']['qd'] is the derivative of the power by the joints' rates, [N x 1 x joints] [W s/rad or W s/m];
    quantities are those of `evaluate` with [N x cylinders x joints] or [N x pumps x joints], and variables 'q', 'qd', 'qdd'
    (by accelerations only what inertia forces reach). Derivatives do not exist at rest, where flows have a kink and pressures
    jump, and where two demands on a pump are equal: there those of rest and of the first demand are given.
    Raises UsageError as `evaluate` does, InputError for a machine of more than ten joints (seven with inertia).
    """
    return core.derivatives(_inputs.one("derivatives", model, core.Model), dict(q=q, qd=qd, qdd=qdd, payload_kg=payload_kg, oil_C=oil_C))
