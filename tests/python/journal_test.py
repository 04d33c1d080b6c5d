"""Long calls keep finished parts in a journal; a later call takes them and gives what an undisturbed one gives."""

import shutil
import time

import pytest

import sparflow
from conftest import DATA, interrupted_soon, without_times

LIFT = DATA / "reaches/hmf_lift.yaml"  # of two joints, which are solved faster
HMF = DATA / "models/hmf_2020_k4_load_sensing.json"
QUICK = dict(paths=1, intervals=20, processes=1)


@pytest.fixture
def lift():
    return sparflow.Problem.load(LIFT, sparflow.Model.load(HMF))


def with_journal(call, folder):
    """The result of an undisturbed call, the lines of its journal shortly before its end, and the time it took [s]."""
    journal, copy = folder / "whole.journal", folder / "copy.journal"

    def progress(share, words):
        try:
            shutil.copy(journal, copy)
        except FileNotFoundError:  # before the first part and after the last one
            pass

    begun = time.monotonic()
    result = call(journal=journal, progress=progress)
    took = time.monotonic() - begun
    assert not journal.exists(), "a call that ended whole deletes its journal"
    return result, copy.read_text().splitlines(keepends=True), took


def resumed(call, lines, path):
    path.write_text("".join(lines))
    result = call(journal=path, resume=True)
    assert not path.exists()
    return result


def test_pareto_from_a_part_of_its_journal_is_the_undisturbed_curve(lift, tmp_path):
    def call(longest=1.5, **more):
        return sparflow.pareto(lift, points=3, longest=longest, **QUICK, **more)

    whole, lines, took = with_journal(call, tmp_path)
    assert len(lines) > 3  # the head and some solves
    half = resumed(call, lines[:len(lines) // 2 + 1], tmp_path / "half.journal")
    assert without_times(half.to_dict()) == without_times(whole.to_dict())
    (tmp_path / "other.journal").write_text("".join(lines))
    with pytest.raises(sparflow.InputError, match="other inputs or options"):
        call(longest=2.0, journal=tmp_path / "other.journal", resume=True)
    begun = time.monotonic()
    resumed(call, lines, tmp_path / "most.journal")
    assert time.monotonic() - begun < 0.7 * took, "solves that are kept are not solved again"


def test_strategies_that_ctrl_c_ended_are_resumed(lift, tmp_path):
    problems = [lift, sparflow.Problem.load(DATA / "reaches/loader_crane_short_hop.yaml")]
    journal = tmp_path / "s.journal"

    def call(**more):
        return sparflow.strategies(problems, orders=0, **QUICK, **more)

    with pytest.raises(sparflow.Interrupted) as caught:
        interrupted_soon(lambda progress: call(journal=journal, progress=progress),
                         when=lambda share, words: words.startswith("1 of 2"))
    caught.value.wait(20)
    assert len(journal.read_text().splitlines()) == 2  # the head and the first problem
    done = call(journal=journal, resume=True)
    assert not done.interrupted and not journal.exists()
    assert without_times(done.to_dict()) == without_times(call().to_dict())


def test_a_benchmark_from_a_part_of_its_journal_is_the_undisturbed_one(scenario, tmp_path):
    def call(**more):
        return sparflow.benchmark(scenario, "joint_pi", seeds=3, optimum=False, jobs=1, **more)

    whole, lines, _ = with_journal(call, tmp_path)
    assert len(lines) > 2
    half = resumed(call, lines[:2], tmp_path / "half.journal")
    assert without_times(half.to_dict()) == without_times(whole.to_dict())


def test_improve_takes_the_rounds_of_its_journal(machine, tmp_path):
    train, test = DATA / "logs/loader_crane_friction_train.csv", DATA / "logs/loader_crane_friction_test.csv"
    model = sparflow.fit(machine, train).model

    def call(**more):
        return sparflow.improve(model, train, test=test, candidates=["coulomb_friction:boom", "viscous_friction:boom"], **more)

    whole, lines, _ = with_journal(call, tmp_path)
    assert len(lines) == 2  # the head and the round that added the friction
    again = resumed(call, lines, tmp_path / "round.journal")
    assert without_times(again.to_dict()) == without_times(whole.to_dict())


def test_resume_needs_a_journal_and_tells_where_there_is_none(lift, tmp_path):
    with pytest.raises(sparflow.UsageError, match="resume=True needs journal="):
        sparflow.pareto(lift, resume=True)
    with pytest.warns(sparflow.SparflowWarning, match="there is no .*none.journal; everything is computed"):
        with pytest.raises(sparflow.Interrupted):
            interrupted_soon(lambda progress: sparflow.pareto(lift, journal=tmp_path / "none.journal", resume=True,
                                                              progress=progress))
