// Each log is left out in turn: the errors of every stage on it before `improve`, after it, and of planes, Coulomb friction
// and a mass at the tip by least squares, which is what an engineer would fit first.
// With --together no log is left out, and the relative error of each force is printed, |F - F_model| / |F|, over all samples
// as benchmarks of drives state it.
// With --as-fitted nothing is improved: `after` is `before`, and only least squares is compared with it.
//   improve_left_out -m MACHINE.yaml -l LOG.csv... [--only NAME] [--together] [--as-fitted]
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <map>

#include "diagnosis/extension/extend.h"
#include "identification/comparison/compare.h"
#include "identification/data_checks/set_aside.h"
#include "identification/learning/fit.h"
#include "models/effects/registry.h"
#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "models/math/linear_algebra.h"

namespace sparflow::bench {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows of a regression, appended one by one.
struct Rows {
  std::vector<double> x, y;
  std::size_t width = 0;

  VectorXd coefficients() const {
    const auto n = static_cast<Index>(y.size()), m = static_cast<Index>(width);
    if (n <= m) return VectorXd::Zero(m);
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>
        a(x.data(), n, m);
    return least_squares_of_least_norm(a, Eigen::Map<const VectorXd>(y.data(), n));
  }
  void add(const std::vector<double>& row, double value) {
    if (!std::isfinite(value) ||
        !std::all_of(row.begin(), row.end(), [](double v) { return std::isfinite(v); }))
      return;
    width = row.size();
    x.insert(x.end(), row.begin(), row.end());
    y.push_back(value);
  }
};

/// A log's signals with a model's effects.
MachineSignals seen_with(const CraneModel& model, MachineSignals signals) {
  CompareOptions options;
  options.find_regions = false;
  std::vector<MachineSignals> one;
  one.push_back(std::move(signals));
  return std::move(compare_signals(model, std::move(one), {}, options).logs.front().signals);
}

/// Mass and moment on the last link and Coulomb friction of each cylinder, by least squares over all moving samples.
std::vector<AppliedEffect> mass_and_coulomb(const Machine& machine,
                                            const std::vector<MachineSignals>& signals) {
  std::vector<AppliedEffect> effects;
  const int last = static_cast<int>(machine.joints.size()) - 1;
  effects.push_back({find_effect("unmodelled_mass"), last, {0.0, 0.0}, {}, {}});
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    AppliedEffect e{find_effect("coulomb_friction"), i, {}, {}, {}};
    for (const EffectParameter& p : e.effect->info().parameters)
      e.values.push_back(p.linear || p.grid.empty() ? 0.0 : p.grid.front());
    effects.push_back(e);
  }
  struct Unknown {
    std::size_t effect, parameter;
  };
  std::vector<Unknown> unknowns = {{0, 0}, {0, 1}};
  for (std::size_t e = 1; e < effects.size(); ++e) unknowns.push_back({e, 0});
  Rows rows;
  for (const MachineSignals& s : signals) {
    std::vector<MachineSignals> with;
    for (const Unknown& u : unknowns) {
      CraneModel one = CraneModel::untrained(machine);
      AppliedEffect unit = effects[u.effect];
      unit.values[u.parameter] = 1.0;
      one.effects = {unit};
      with.push_back(seen_with(one, s));
    }
    for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
      const CylinderSignals& c = s.cylinders[i];
      for (Index k = 0; k < s.samples() && c.has_force(); ++k) {
        if (!c.moving[k] || !s.usable[k] || s.edge[k]) continue;
        std::vector<double> row;
        row.reserve(with.size());
        for (const MachineSignals& w : with)
          row.push_back(w.cylinders[i].model_force[k] - c.static_force[k]);
        rows.add(row, c.force[k] - c.static_force[k]);
      }
    }
  }
  const VectorXd found = rows.coefficients();
  for (std::size_t j = 0; j < unknowns.size(); ++j)
    effects[unknowns[j].effect].values[unknowns[j].parameter] = found[static_cast<Index>(j)];
  return effects;
}

/// Model of planes over flow and model force, flow proportional to the command, mass and Coulomb friction.
/// @param fitted gives margins and standby
CraneModel by_least_squares(const CraneModel& fitted, const std::vector<MachineSignals>& signals) {
  CraneModel model = CraneModel::untrained(fitted.machine);
  model.pumps = fitted.pumps;
  model.effects = mass_and_coulomb(fitted.machine, signals);
  for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
    model.cylinders[i].margin = fitted.cylinders[i].margin;
    for (const int side : {1, -1}) {
      Rows pressure, flow;
      GpParameters plane;
      plane.flow_min = plane.force_min = 1e300;
      plane.flow_max = plane.force_max = -1e300;
      for (const MachineSignals& plain : signals) {
        const MachineSignals s = seen_with(model, plain);
        const CylinderSignals& c = s.cylinders[i];
        for (Index k = 0; k < s.samples() && c.has_pressure() && c.has_command(); ++k) {
          if (!c.driven[k] || c.direction[k] != side || !s.usable[k] || s.edge[k]) continue;
          const double q = c.flow[k], f = c.model_force[k];
          // scaled, so that the columns have one size
          pressure.add({1.0, 1e4 * q, 1e-5 * f}, c.working_pressure[k]);
          flow.add({std::abs(c.command[k])}, q);
          plane.flow_min = std::min(plane.flow_min, q),
          plane.flow_max = std::max(plane.flow_max, q);
          plane.force_min = std::min(plane.force_min, f);
          plane.force_max = std::max(plane.force_max, f);
        }
      }
      if (pressure.y.size() < 4) continue;
      const VectorXd found = pressure.coefficients();
      plane.law = PressureLaw::kPlane;
      plane.mean_constant = found[0];
      plane.mean_flow_slope = 1e4 * found[1];
      plane.mean_slope = 1e-5 * found[2];
      plane.flow = plane.force = plane.weight = Eigen::ArrayXd::Zero(1);
      (side > 0 ? model.cylinders[i].extend : model.cylinders[i].retract) =
          GaussianProcess(std::move(plane));
      (side > 0 ? model.cylinders[i].valve_gain_extend : model.cylinders[i].valve_gain_retract) =
          flow.coefficients()[0];
    }
  }
  return model;
}

/// A row of the table: squares of errors of the three models, summed over the logs.
struct Sums {
  double n = 0.0, before = 0.0, after = 0.0, squares = 0.0;
};

/// Counts how often `after` is worse than another error by more than rounding and refitting may do.
struct Tally {
  int rows = 0, than_before = 0, than_squares = 0;
  /// Refitting alone may change an error by this factor (ErrorChangeOptions::refit_moves).
  static constexpr double kMoves = 1.02;

  std::string add(double before, double after, double squares) {
    ++rows;
    const bool b = after > kMoves * before, s = after > kMoves * squares;
    than_before += b ? 1 : 0;
    than_squares += s ? 1 : 0;
    return fmt::format("{}{}", b ? " worse than before" : "", s ? " worse than squares" : "");
  }
};

struct Study {
  const Machine& machine;
  std::map<std::string, std::pair<std::string, Sums>> pooled;  // by row, with the unit
  Tally tally;

  void print(const std::string& name, const std::string& unit, double n,
             const Eigen::Vector3d& errors) {
    fmt::print("  {:26}{:7.0f}{:10.4g}{:10.4g}{:10.4g} {:6}{}\n", name, n, errors[0], errors[1],
               errors[2], unit, tally.add(errors[0], errors[1], errors[2]));
  }

  void compare_three(const CraneModel& before, const CraneModel& after, const CraneModel& squares,
                     const Log& left_out) {
    const CompareResult b = compare(before, {left_out}), a = compare(after, {left_out}),
                        s = compare(squares, {left_out});
    for (const StageScore& score : b.scores) {
      const StageScore* x = a.find(score.stage, score.at, score.regime);
      const StageScore* y = s.find(score.stage, score.at, score.regime);
      if (x == nullptr || y == nullptr || score.n == 0) continue;
      const std::string name = score.stage + " " + score.at + " " + score.regime;
      const double si = score.unit.si, n = static_cast<double>(score.n);
      print(name, score.unit.name, n, {score.rmse / si, x->rmse / si, y->rmse / si});
      auto& [unit, sums] = pooled[name];
      unit = score.unit.name;
      sums.n += n;
      sums.before += n * std::pow(score.rmse / si, 2);
      sums.after += n * std::pow(x->rmse / si, 2);
      sums.squares += n * std::pow(y->rmse / si, 2);
    }
    for (std::size_t p = 0; p < b.energy.size(); ++p) {
      const auto part = [&](const CompareResult& r, bool commands) {
        const EnergyScore& e = r.energy[p];
        if (!(e.measured > 0.0)) return std::nan("");
        const double predicted = commands ? e.from_commands.value_or(std::nan("")) : e.predicted;
        return 100.0 * std::abs(predicted / e.measured - 1.0);
      };
      for (const bool commands : {false, true}) {
        const Eigen::Vector3d errors(part(b, commands), part(a, commands), part(s, commands));
        if (!errors.allFinite()) continue;
        const std::string name = (commands ? "energy of commands " : "energy ") + b.energy[p].pump;
        print(name, "%", 1.0, errors);
        auto& [unit, sums] = pooled[name];
        unit = "%";
        sums.n += 1.0;
        sums.before += errors[0] * errors[0];
        sums.after += errors[1] * errors[1];
        sums.squares += errors[2] * errors[2];
      }
    }
  }
};

void print_effects(const CraneModel& model) {
  for (const AppliedEffect& e : model.effects) {
    fmt::print("    {:32}", e.key(model.machine));
    for (std::size_t k = 0; k < e.values.size(); ++k) {
      const EffectParameter& p = e.effect->info().parameters[k];
      fmt::print("  {} {:.5g} {}", p.name, e.values[k] / p.si, p.unit);
    }
    fmt::print("\n");
  }
}

/// Relative error of each force over all usable samples and over those of which `compare` gives errors. Accelerations come from the
/// sharpest window that the positions allow, as in the estimate: the force is compared as measured, and a wide window would smooth
/// what the force shows.
void run_together(const Machine& machine, const std::vector<Log>& logs) {
  const ExtendResult r = improve(fit(machine, logs).model, {logs, {}, {}});
  fmt::print("{:.0f} s, {}\n", r.seconds, r.stopped_because);
  print_effects(r.model);
  for (const Log& log : logs) {
    MachineSignals raw = make_signals(machine, log);
    raw = smoothed_anew(machine, raw,
                        sharpest_window(raw.time, raw.runs, raw.q_measured, raw.window));
    const MachineSignals s = seen_with(r.model, std::move(raw));
    for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
      const CylinderSignals& c = s.cylinders[i];
      double error = 0.0, all = 0.0, moving_error = 0.0, moving = 0.0;
      for (Index k = 0; k < s.samples() && c.has_force(); ++k) {
        const double e = std::pow(c.predicted_force[k] - c.force[k], 2),
                     f = std::pow(c.force[k], 2);
        if (!s.usable[k] || !std::isfinite(e)) continue;
        error += e, all += f;
        if (c.moving[k]) moving_error += e, moving += f;
      }
      if (all > 0.0)
        fmt::print("{} {}: relative force error {:.3f} % of all samples, {:.3f} % of moving ones\n",
                   log.file, machine.cylinders[i].name, 100.0 * std::sqrt(error / all),
                   100.0 * std::sqrt(moving_error / moving));
    }
  }
}

/// The log without what the data checks find faulty, which neither trains nor judges a model. Jumps stay: an effect may explain
/// them.
Log without_faults(const Machine& machine, Log log) {
  std::vector<BadChannel> faults = find_bad_channels(machine, log, make_signals(machine, log));
  std::erase_if(faults, [](const BadChannel& b) { return b.kind == BadDataKind::kJumping; });
  for (const BadChannel& b : faults) fmt::print("{}: {}\n", log.file, bad_channel_sentence(b));
  return without_bad_data(std::move(log), faults);
}

int run(const std::string& machine_file, const std::vector<std::string>& files,
        const std::vector<std::string>& only, bool together, bool as_fitted) {
  const Machine machine = load_machine(machine_file);
  std::vector<Log> logs;
  logs.reserve(files.size());
  for (const std::string& f : files) logs.push_back(without_faults(machine, load_log(f, machine)));
  if (together) {
    run_together(machine, logs);
    return 0;
  }
  Study study{machine, {}, {}};
  for (std::size_t out = 0; out < logs.size(); ++out) {
    const auto named = [&](const std::string& o) {
      return logs[out].file.find(o) != std::string::npos;
    };
    if (!only.empty() && std::none_of(only.begin(), only.end(), named)) continue;
    ExtendLogs train;
    std::vector<MachineSignals> signals;
    for (std::size_t l = 0; l < logs.size(); ++l) {
      if (l == out) continue;
      train.suspects.push_back(logs[l]);
      signals.push_back(make_signals(machine, logs[l]));
    }
    const CraneModel before = fit(machine, train.suspects).model;
    const CraneModel squares = by_least_squares(before, signals);
    ExtendResult r;
    if (as_fitted) {
      r.model = before;
      r.stopped_because = "not improved";
    } else {
      r = improve(before, train);
    }
    fmt::print("{}: {:.0f} s, {}\n", logs[out].file, r.seconds, r.stopped_because);
    print_effects(r.model);
    fmt::print("  {:26}{:>7}{:>10}{:>10}{:>10}\n", "on the log left out", "samples", "before",
               "after", "squares");
    study.compare_three(before, r.model, squares, logs[out]);
    std::fflush(stdout);
  }
  const Tally each = study.tally;
  fmt::print("all logs left out\n");
  for (const auto& [name, row] : study.pooled) {
    const auto& [unit, sums] = row;
    const auto root = [n = sums.n](double squares) { return std::sqrt(squares / n); };
    study.print(name, unit, sums.n, {root(sums.before), root(sums.after), root(sums.squares)});
  }
  fmt::print("rows of single logs: {}, worse than before {}, worse than least squares {}\n",
             each.rows, each.than_before, each.than_squares);
  return 0;
}

}  // namespace
}  // namespace sparflow::bench

int main(int argc, char** argv) {
  std::string machine;
  std::vector<std::string> logs, only;
  bool together = false, as_fitted = false;
  CLI::App app("errors on each log left out, before and after improve");
  app.add_option("-m,--machine", machine, "machine file")->required()->check(CLI::ExistingFile);
  app.add_option("-l,--log", logs, "logs (CSV)")->required()->check(CLI::ExistingFile);
  app.add_option("--only", only, "leave out only logs whose name contains this");
  app.add_flag("--together", together, "leave out none; print the relative error of each force");
  app.add_flag("--as-fitted", as_fitted, "do not improve");
  CLI11_PARSE(app, argc, argv);
  try {
    return sparflow::bench::run(machine, logs, only, together, as_fitted);
  } catch (const sparflow::InputError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 3;
  }
}
