/// Compares methods that learn the pressures of a long log. Learns every cylinder and direction of one log with each
/// method, judges on another log and prints centres, seconds, held-out RMSE, NLPD and the time of an evaluation.
///   sparse_gp_table [MACHINE.yaml TRAIN.csv TEST.csv]
/// Without arguments it uses the loader crane, with logs in ../shared/data/loader_crane/plain of the source tree.
/// NLPD is the mean of -log p(measurement) with the pressure in bar; it also measures errors of the variance.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <numbers>
#include <string>
#include <vector>

#include "identification/learning/gaussian_process/learn_pressure.h"
#include "identification/signals/signals.h"
#include "models/files/machine_file.h"

namespace {

using namespace sparflow;
using Eigen::ArrayXd;
using Eigen::Index;

constexpr double kBar = 1e5;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Makes a data set for each cylinder and direction that the log drives.
std::vector<GpDataset> datasets(const Machine& machine, const std::string& path) {
  const MachineSignals signals = make_signals(machine, load_log(path, machine));
  std::vector<GpDataset> sets;
  for (std::size_t i = 0; i < signals.cylinders.size(); ++i) {
    const CylinderSignals& c = signals.cylinders[i];
    if (!c.has_pressure()) continue;
    for (int direction : {1, -1}) {
      std::vector<Index> rows;
      for (Index t = 0; t < signals.samples(); ++t) {
        if (signals.usable[t] && !signals.edge[t] && c.driven[t] && c.direction[t] == direction &&
            std::isfinite(c.working_pressure[t])) {
          rows.push_back(t);
        }
      }
      const std::string name = machine.cylinders[i].name + (direction > 0 ? " extend" : " retract");
      sets.push_back({name, c.flow(rows), c.static_force(rows), c.working_pressure(rows)});
    }
  }
  return sets;
}

struct Score {
  double square_sum = 0.0, nlpd_sum = 0.0, samples = 0.0;
  void add(const Score& other) {
    square_sum += other.square_sum;
    nlpd_sum += other.nlpd_sum;
    samples += other.samples;
  }
  double rmse() const { return std::sqrt(square_sum / samples); }
  double nlpd() const { return nlpd_sum / samples; }
};

Score judge(const GpParameters& parameters, const GpDataset& data) {
  const GaussianProcess process(parameters);
  Score score;
  for (Index t = 0; t < data.flow.size(); ++t) {
    const double error = (process.mean(data.flow[t], data.force[t]) - data.pressure[t]) / kBar;
    const double variance = (process.variance(data.flow[t], data.force[t]) +
                             parameters.noise_std * parameters.noise_std) /
                            (kBar * kBar);
    score.square_sum += error * error;
    score.nlpd_sum +=
        0.5 * (error * error / variance + std::log(2.0 * std::numbers::pi * variance));
    score.samples += 1.0;
  }
  return score;
}

/// Time [us] of one evaluation of mean, gradient and Hessian, averaged over the test points.
double microseconds(const GpParameters& parameters, const GpDataset& data) {
  const GaussianProcess process(parameters);
  double sink = 0.0;
  const auto start = std::chrono::steady_clock::now();
  int count = 0;
  for (int repeat = 0; repeat < 20; ++repeat) {
    for (Index t = 0; t < data.flow.size(); ++t, ++count) {
      sink += process.mean_derivatives(data.flow[t], data.force[t]).value;
    }
  }
  const double elapsed = seconds_since(start);
  return sink == 0.0 ? NAN : 1e6 * elapsed / count;
}

struct Method {
  std::string name;
  LearnGpOptions options;
};

std::vector<Method> methods() {
  std::vector<Method> list;
  const auto add = [&](const std::string& name, GpMethod method, int centres) {
    LearnGpOptions options;
    options.method = method;
    options.max_centres = centres;
    list.push_back({name, options});
    return &list.back().options;
  };
  for (int centres : {30, 60, 120, 250, 500}) {
    add(fmt::format("subset, {}", centres), GpMethod::kSubset, centres);
  }
  for (int centres : {5, 10, 20}) {
    add(fmt::format("inducing, at most {}", centres), GpMethod::kInducing, centres);
  }
  for (double tolerance : {0.1, 0.03, 0.003, 0.001}) {
    add(fmt::format("inducing, open {:g} %", 100 * tolerance), GpMethod::kInducing, 100)
        ->sparse_tolerance = tolerance;
  }
  add("inducing, hyper from all", GpMethod::kInducing, 60)->hyper_samples = 100000;
  add("inducing, default", GpMethod::kInducing, LearnGpOptions().max_centres);
  for (double shortest : {0.05, 0.1, 0.2, 0.3}) {
    add(fmt::format("  length at least {:g}", shortest), GpMethod::kInducing, 60)->shortest_length =
        shortest;
  }
  return list;
}

void run(const std::string& machine_file, const std::string& train_file,
         const std::string& test_file) {
  const Machine machine = load_machine(machine_file);
  const std::vector<GpDataset> train = datasets(machine, train_file);
  const std::vector<GpDataset> test = datasets(machine, test_file);
  fmt::print("{:<26}{:>9}{:>9}{:>11}{:>9}{:>12}\n", "method", "centres", "seconds", "RMSE [bar]",
             "NLPD", "us / eval.");
  for (const Method& method : methods()) {
    const auto start = std::chrono::steady_clock::now();
    const std::vector<LearnedGp> learned = learn_gps(train, method.options);
    const double seconds = seconds_since(start);
    Score all;
    double time = 0.0;
    int centres = 0;
    for (std::size_t i = 0; i < learned.size(); ++i) {
      if (!learned[i].report.failure.empty() || test[i].flow.size() == 0) continue;
      all.add(judge(learned[i].parameters, test[i]));
      time += microseconds(learned[i].parameters, test[i]);
      centres += learned[i].report.centres;
    }
    fmt::print("{:<26}{:>9}{:>9.2f}{:>11.3f}{:>9.3f}{:>12.3f}\n", method.name, centres, seconds,
               all.rmse(), all.nlpd(), time);
    std::fflush(stdout);
  }
  fmt::print(
      "(centres and microseconds: sums over {} pressure models; seconds: all of them in "
      "parallel)\n\n",
      train.size());

  fmt::print("{:<20}{:>7}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>8}{:>8}\n", "default, each", "rows",
             "outliers", "centres", "seconds", "noise", "train", "test", "l_Q", "l_F");
  const std::vector<LearnedGp> learned = learn_gps(train);
  for (std::size_t i = 0; i < learned.size(); ++i) {
    const GpReport& r = learned[i].report;
    const GpParameters& p = learned[i].parameters;
    if (!r.failure.empty()) {
      fmt::print("{}\n", r.failure);
      continue;
    }
    const double test_rmse = test[i].flow.size() == 0 ? NAN : judge(p, test[i]).rmse();
    fmt::print("{:<20}{:>7}{:>9}{:>9}{:>9.3f}{:>9.3f}{:>9.3f}{:>9.3f}{:>8.2f}{:>8.2f}\n",
               train[i].name, r.given, r.outliers, r.centres, r.seconds, r.noise_std / kBar,
               r.rmse / kBar, test_rmse, p.length_flow / (p.flow_max - p.flow_min),
               p.length_force / (p.force_max - p.force_min));
  }
  fmt::print("(noise, train, test in bar RMS; l_Q, l_F: length-scales in ranges of the data)\n");
}

}  // namespace

int main(int argc, char** argv) {
  const std::string root = SPARFLOW_SOURCE_DIR;
  const std::string logs = root + "/../shared/data/loader_crane/plain/";
  try {
    if (argc == 4) {
      run(argv[1], argv[2], argv[3]);
    } else if (argc == 1) {
      run(root + "/problems/machines/loader_crane.yaml", logs + "train.csv", logs + "test.csv");
    } else {
      fmt::print(stderr, "usage: sparse_gp_table [MACHINE.yaml TRAIN.csv TEST.csv]\n");
      return 2;
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "sparse_gp_table: {}\n", error.what());
    return 3;
  }
  return 0;
}
