// The loop of trust over plants of the dynamic simulator, drawn anew: how far the energy that a model predicts of its optima is from
// the true energy of tracking them, before and after `improve`. docs/benchmark.md.
//   trust_study [--plants 20] [--seed 1] [--machines loader_crane] [--moves 4] [--seconds 200] [--effects 8] [--processes 2] [--csv FILE] [--journal FILE]
#include <fmt/format.h>

#include <cmath>

#include "apps/tasks/trust/trust_task.h"
#include "bench/program_options.h"
#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "models/math/nan.h"
#include "optimizer/solve/kept_work.h"
#include "problems/bundled.h"
#include "studies/plants/drawn_plant.h"

namespace sparflow::bench {
namespace {

struct Arguments {
  int plants = 20, moves = 4, processes = 2, effects = 8;
  std::uint64_t seed = 1;
  double seconds = 200.0;
  std::vector<std::string> machines = {"loader_crane"};
  std::string csv;
};

/// What is kept of a loop.
struct Plant {
  std::string machine, added, left_out;
  double log_before = kNaN, log_after = kNaN;  // relative error of the held-out log's energy
  double seconds = 0.0;
  std::vector<TrustedMove> moves;
};

std::string packed(const Plant& plant) {
  Packer p;
  p.text(plant.machine).text(plant.added).text(plant.left_out);
  p.number(plant.log_before).number(plant.log_after).number(plant.seconds);
  p.number(static_cast<double>(plant.moves.size()));
  for (const TrustedMove& m : plant.moves) {
    p.text(m.name).number(m.payload).number(m.duration);
    for (const TrackedMotion* t : {&m.before, &m.after, &m.sequential, &m.joint_pi})
      p.number(t->predicted).number(t->measured).number(t->tip_error).text(t->failure);
  }
  return p.bytes();
}

Plant plant_from(const std::string& bytes) {
  Unpacker u(bytes);
  Plant plant;
  for (std::string* text : {&plant.machine, &plant.added, &plant.left_out}) *text = u.text();
  for (double* value : {&plant.log_before, &plant.log_after, &plant.seconds}) *value = u.number();
  plant.moves.resize(static_cast<std::size_t>(u.number()));
  for (TrustedMove& m : plant.moves) {
    m.name = u.text();
    m.payload = u.number();
    m.duration = u.number();
    for (TrackedMotion* t : {&m.before, &m.after, &m.sequential, &m.joint_pi}) {
      t->predicted = u.number();
      t->measured = u.number();
      t->tip_error = u.number();
      t->failure = u.text();
    }
  }
  return plant;
}

double energy_error(const CompareResult& r) {
  double measured = 0.0, predicted = 0.0;
  for (const EnergyScore& e : r.energy) {
    measured += e.measured;
    predicted += e.predicted;
  }
  return predicted / measured - 1.0;
}

Plant closed(std::uint64_t seed, const Arguments& a) {
  Plant plant;
  plant.machine = a.machines[seed % a.machines.size()];
  try {
    const auto machine = std::make_shared<Machine>(
        load_machine(bundled_file("machines/" + plant.machine + ".yaml")));
    simulator::Random random(seed, "trust study");
    TrustTask task;
    task.parameters = drawn_plant(*machine, random);
    // the log to judge on has the next seed
    constexpr std::uint64_t kSeedsOfAPlant = 10;
    task.seed = kSeedsOfAPlant * seed;
    task.train_seconds = a.seconds;
    task.test_seconds = 0.5 * a.seconds;
    task.moves = a.moves;
    task.most_effects = a.effects;
    task.processes = 1;
    const TrustLoop loop = trust_task(machine, task, {});
    for (const ExtendStep& s : loop.improved.steps)
      plant.added +=
          (plant.added.empty() ? "" : " ") + (s.added.empty() ? "-" + s.removed : s.added);
    plant.log_before = energy_error(loop.test_before);
    plant.log_after = energy_error(loop.test_after);
    plant.seconds = loop.seconds;
    plant.moves = loop.moves;
  } catch (const InputError& e) {
    plant.left_out = e.what();
  }
  return plant;
}

void tell(std::uint64_t seed, const Plant& p) {
  if (!p.left_out.empty()) {
    fmt::print("{:5} {:<14} left out: {}\n", seed, p.machine, p.left_out);
    return;
  }
  const TrustSums s = sums_of(p.moves);
  fmt::print(
      "{:5} {:<14} log {:+5.1f} -> {:+5.1f} %   moves {:+5.1f} -> {:+5.1f} % ({} of {})   saves "
      "{:5.1f} %   {}\n",
      seed, p.machine, 100.0 * p.log_before, 100.0 * p.log_after, 100.0 * s.bias_before,
      100.0 * s.bias_after, s.moves, p.moves.size(), 100.0 * s.saving, p.added);
  std::fflush(stdout);
}

std::string row_of(std::uint64_t seed, const Plant& p, const TrustedMove& m) {
  std::string row = fmt::format("{},{},{},{},{}", seed, p.machine, m.name, m.payload, m.duration);
  for (const TrackedMotion* t : {&m.before, &m.after, &m.sequential, &m.joint_pi})
    row += fmt::format(",{},{},{},{}", t->done() ? 1 : 0, t->predicted, t->measured, t->tip_error);
  return row + "\n";
}

int run(const Arguments& a, Journal& journal) {
  const auto seed_of = [&](int i) { return a.seed + static_cast<std::uint64_t>(i); };
  KeptWork work;
  work.count = a.plants;
  work.at_once = a.processes;
  work.name = [&](int i) { return fmt::format("plant {}", seed_of(i)); };
  work.work = [&](int i) { return packed(closed(seed_of(i), a)); };
  std::vector<TrustedMove> all;
  std::string csv =
      "seed,machine,move,payload_kg,duration_s,before_done,before_predicted_J,before_true_J,"
      "before_tip_m,after_done,after_predicted_J,after_true_J,after_tip_m,sequential_done,"
      "sequential_predicted_J,sequential_true_J,sequential_tip_m,joint_pi_done,joint_pi_predicted_"
      "J,"
      "joint_pi_true_J,joint_pi_tip_m\n";
  run_kept(work, journal, [&](int i, int, const ChildResult& child) {
    Plant p;
    if (child.ok) p = plant_from(child.bytes);
    if (!child.ok) p.left_out = child.error;
    tell(seed_of(i), p);
    for (const TrustedMove& m : p.moves) csv += row_of(seed_of(i), p, m);
    all.insert(all.end(), p.moves.begin(), p.moves.end());
  });
  const TrustSums s = sums_of(all);
  fmt::print(
      "{} of {} moves tracked with both models: predicted within {:.1f} % of true before improve, "
      "{:.1f} % after (medians); bias {:+.1f} -> {:+.1f} %; the optimum saves {:.1f} % against the "
      "sequential operator (median)\n",
      s.moves, all.size(), 100.0 * s.error_before, 100.0 * s.error_after, 100.0 * s.bias_before,
      100.0 * s.bias_after, 100.0 * s.saving);
  if (!a.csv.empty()) write_file_atomically(a.csv, csv);
  journal.remove();
  return 0;
}

int run_with(int argc, char** argv) {
  Arguments a;
  ProgramOptions app(
      "predicted against true energy on plants drawn anew, before and after improve");
  app.add("--plants", a.plants, "number of plants").positive();
  app.add("--seed", a.seed, "of the first plant");
  app.add("--machines", a.machines, "bundled machines, in turn");
  app.add("--moves", a.moves, "moves of each plant").positive();
  app.add("--seconds", a.seconds, "of the log to learn from").range(20.0, 1e5);
  app.add("--effects", a.effects, "that improve may add, at most").range(1, 20);
  app.add("--processes", a.processes, "plants at a time").positive();
  app.add("--csv", a.csv, "file for the moves");
  app.add_journal();
  if (const auto code = app.parse(argc, argv)) return *code;
  const std::unique_ptr<Journal> journal = app.journal({}, {"--csv", "--plants", "--processes"});
  return run(a, *journal);
}

}  // namespace
}  // namespace sparflow::bench

int main(int argc, char** argv) {
  return sparflow::bench::run_program("trust_study", sparflow::bench::run_with, argc, argv);
}
