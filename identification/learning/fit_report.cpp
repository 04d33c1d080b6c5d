// Formats the result of a fit as text.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "identification/comparison/report_numbers.h"
#include "identification/learning/fit.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

/// @return root mean square over a stage's scores, weighted by samples; NaN when there is none
double stage_rmse(const CompareResult& result, const std::string& stage) {
  double sum = 0.0, n = 0.0;
  for (const StageScore& s : result.scores) {
    if (s.stage != stage) continue;
    sum += s.rmse * s.rmse * static_cast<double>(s.n);
    n += static_cast<double>(s.n);
  }
  return std::sqrt(sum / n);
}

std::string figures(const CompareResult& result) {
  std::string text;
  const double pressure = stage_rmse(result, "pressure"), pump = stage_rmse(result, "pump");
  if (std::isfinite(pressure))
    text += fmt::format("working pressures {:.2f} bar, ", pressure / units::kBar);
  if (std::isfinite(pump)) text += fmt::format("pump {:.2f} bar, ", pump / units::kBar);
  for (const EnergyScore& e : result.energy) {
    if (std::isfinite(e.relative_error)) {
      text += fmt::format("energy of {} {:+.2f} %, ", e.pump, 100.0 * e.relative_error);
    } else {
      text += fmt::format("energy of {} \u2013 % (nothing delivered in {:.1f} s), ", e.pump,
                          e.duration);
    }
  }
  if (text.empty()) {
    const double force = stage_rmse(result, "force");
    return std::isfinite(force) ? fmt::format("force {} N", plain_number(force, 4))
                                : "nothing compared";
  }
  return text.substr(0, text.size() - 2);
}

std::string process_lines(const FitResult& r) {
  if (r.processes.empty()) return "no hydraulic cylinder: there is no pressure model to learn\n";
  std::string text =
      fmt::format("{:<20}{:>8}{:>6}{:>16}{:>11}{:>11}{:>16}{:>20}\n", "pressure of", "samples",
                  "step", "law", "RMSE bar", "noise bar", "flow l/min", "load kN");
  for (const ProcessFit& f : r.processes) {
    const auto i = static_cast<std::size_t>(f.cylinder);
    const std::string name =
        r.model.machine.cylinders[i].name + (f.extend ? " extend" : " retract");
    const GaussianProcess& g =
        f.extend ? r.model.cylinders[i].extend : r.model.cylinders[i].retract;
    if (g.empty()) {
      text += fmt::format("{:<20}{:>8}  not learned\n", name, f.offered);
      continue;
    }
    const GpParameters& p = g.parameters();
    text += fmt::format(
        "{:<20}{:>8}{:>6}{:>16}{:>11.2f}{:>11.2f}{:>16}{:>20}\n", name, f.offered, f.step,
        pressure_law_name(p.law), f.report.rmse / units::kBar, f.report.noise_std / units::kBar,
        fmt::format("{:.1f}..{:.1f}", p.flow_min / units::kLitrePerMinute,
                    p.flow_max / units::kLitrePerMinute),
        fixed_number(p.force_min / 1e3, 1) + ".." + fixed_number(p.force_max / 1e3, 1));
  }
  return text;
}

std::string supply_lines(const FitResult& r) {
  const Machine& machine = r.model.machine;
  std::string text;
  for (std::size_t p = 0; p < r.pumps.size(); ++p) {
    if (!r.pumps[p]) continue;
    const Pump& pump = machine.pumps[p];
    text += fmt::format("pump {}: {} {:.1f} bar", pump.name,
                        pump.type == PumpType::kLoadSensing ? "standby" : "constant",
                        r.model.pumps[p].standby / units::kBar);
    for (std::size_t f = 0; f < pump.feeds.size() && f < r.pumps[p]->margins.size(); ++f) {
      const LearnedMargin& m = r.pumps[p]->margins[f];
      text += fmt::format("{}{} {:.2f}", f == 0 ? ", margins [bar] " : ", ",
                          machine.cylinders[static_cast<std::size_t>(pump.feeds[f])].name,
                          m.margin / units::kBar);
      text +=
          m.identified ? fmt::format(" +- {:.2f}", m.standard_error / units::kBar) : " (assumed)";
    }
    text += "\n";
  }
  if (!r.valves.empty()) text += "valve gains [l/min at full command]:";
  for (const ValveFit& v : r.valves) {
    text +=
        fmt::format(" {} {} {:.1f},", machine.cylinders[static_cast<std::size_t>(v.cylinder)].name,
                    v.extend ? "extend" : "retract", v.valve.gain / units::kLitrePerMinute);
  }
  if (!r.valves.empty()) text.back() = '\n';
  return text;
}

}  // namespace

std::string FitResult::brief(bool timed) const {
  const auto learned = std::count_if(processes.begin(), processes.end(),
                                     [](const ProcessFit& f) { return f.report.failure.empty(); });
  std::string text = fmt::format("{} of {} pressure models identified from {} samples", learned,
                                 processes.size(), train.samples);
  if (timed) text += fmt::format(" in {:.1f} s", seconds);
  if (test) return text + "; on the test logs: " + figures(*test);
  if (held_out) return text + "; on held-out motions: " + figures(*held_out);
  return text + "; on the training logs: " + figures(train);
}

std::string FitResult::full() const {
  std::string text = process_lines(*this) + supply_lines(*this);
  text += "training logs:    " + figures(train) + "\n";
  if (held_out) text += "held-out motions: " + figures(*held_out) + "\n";
  if (test) text += "test logs:        " + figures(*test) + "\n";
  for (const BadChannelOfLog& b : train.bad_data)
    text += fmt::format("set aside: {}: {}\n", b.file, bad_channel_sentence(b.bad));
  if (test)
    for (const BadChannelOfLog& b : test->bad_data)
      text += fmt::format("{}: {}: {}\n", b.in_errors ? "bad data" : "set aside", b.file,
                          bad_channel_sentence(b.bad));
  for (const std::string& note : notes) text += "note: " + note + "\n";
  return text + brief() + "\n";
}

}  // namespace sparflow
