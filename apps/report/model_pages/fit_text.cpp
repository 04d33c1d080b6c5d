#include "apps/report/model_pages/fit_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "models/math/error.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

/// Whether the signals of any log have this quantity of any part of the machine.
template <class Has>
bool measured(const FitResult& r, const Has& has) {
  return std::any_of(r.train.logs.begin(), r.train.logs.end(),
                     [&](const LogComparison& log) { return has(log.signals); });
}

/// Names what the logs lack when nothing could be learned from them; empty when something was learned, or when the
/// machine has no hydraulic cylinder.
std::string why_nothing_learned(const FitResult& r) {
  const auto identified = [](const std::optional<LearnedPump>& p) {
    return p && (p->standby_identified ||
                 std::any_of(p->margins.begin(), p->margins.end(),
                             [](const LearnedMargin& m) { return m.identified; }));
  };
  const bool learned = std::any_of(r.processes.begin(), r.processes.end(),
                                   [](const ProcessFit& p) { return p.report.failure.empty(); }) ||
                       std::any_of(r.pumps.begin(), r.pumps.end(), identified) || !r.valves.empty();
  if (learned || r.processes.empty()) return "";
  std::vector<std::string> missing;
  const auto cylinders = [&](const auto& has) {
    return measured(r, [&](const MachineSignals& s) {
      return std::any_of(s.cylinders.begin(), s.cylinders.end(), has);
    });
  };
  if (!cylinders([](const CylinderSignals& c) { return c.logs_a || c.logs_b; }))
    missing.emplace_back("chamber pressures (pA_<cylinder>_bar, pB_<cylinder>_bar)");
  if (!measured(r, [](const MachineSignals& s) {
        return std::any_of(s.pumps.begin(), s.pumps.end(), [](const PumpSignals& p) {
          return p.pressure.array().isFinite().any();
        });
      }))
    missing.emplace_back("pump pressure (p_<pump>_bar)");
  if (!cylinders([](const CylinderSignals& c) { return c.command.array().isFinite().any(); }))
    missing.emplace_back("commands (u_<cylinder>)");
  if (!cylinders([](const CylinderSignals& c) { return c.driven.any(); }))
    missing.emplace_back("motion (no cylinder is driven faster than 2 mm/s)");
  if (missing.empty()) {
    return fmt::format("the logs have too few samples of each motion ({} in all)", r.train.samples);
  }
  return fmt::format("the logs lack {}", fmt::join(missing, ", "));
}

}  // namespace

std::string fit_judgement(const FitResult& result) {
  const bool held_out = !result.test && result.held_out;
  const CompareResult& by = result.test ? *result.test : held_out ? *result.held_out : result.train;
  if (by.ranking.grade() == Grade::kGood) return "";
  return fmt::format("on the {}: {}\n",
                     result.test ? "test logs"
                     : held_out  ? "held-out motions"
                                 : "training logs",
                     by.ranking.headline);
}

std::string fit_json(const FitResult& result) {
  nlohmann::json json;
  json["seconds"] = result.seconds;
  json["notes"] = result.notes;
  for (const ProcessFit& p : result.processes) {
    const Cylinder& cylinder = result.model.machine.cylinders[static_cast<std::size_t>(p.cylinder)];
    json["processes"].push_back({{"cylinder", cylinder.name},
                                 {"direction", p.extend ? "extend" : "retract"},
                                 {"samples", p.offered},
                                 {"used", p.report.used},
                                 {"outliers", p.report.outliers},
                                 {"centres", p.report.centres},
                                 {"law", pressure_law_name(p.report.law)},
                                 {"plane_left_out_bar", p.report.plane_left_out / units::kBar},
                                 {"process_left_out_bar", p.report.process_left_out / units::kBar},
                                 {"rmse_bar", p.report.rmse / units::kBar},
                                 {"noise_bar", p.report.noise_std / units::kBar},
                                 {"converged", p.report.converged},
                                 {"failure", p.report.failure}});
  }
  for (std::size_t i = 0; i < result.model.cylinders.size(); ++i) {
    json["margins_bar"][result.model.machine.cylinders[i].name] =
        result.model.cylinders[i].margin / units::kBar;
  }
  for (std::size_t i = 0; i < result.model.pumps.size(); ++i) {
    json["standby_bar"][result.model.machine.pumps[i].name] =
        result.model.pumps[i].standby / units::kBar;
  }
  json["train"] = nlohmann::json::parse(compare_json(result.train));
  if (result.test) json["test"] = nlohmann::json::parse(compare_json(*result.test));
  if (result.held_out) json["held_out"] = nlohmann::json::parse(compare_json(*result.held_out));
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

void check_learned(const FitResult& result, const std::string& file) {
  const std::string lacking = why_nothing_learned(result);
  if (lacking.empty()) return;
  throw InputError({file, 0, 0}, "fit",
                   fmt::format("nothing was learned, so no model is written: {}; record each "
                               "cylinder moving in both directions at several speeds and loads",
                               lacking));
}

bool no_pressure_learned(const FitResult& result) {
  return !result.processes.empty() && result.model.missing().size() == result.processes.size();
}

std::vector<std::string> learning_gaps(const FitResult& result) {
  if (result.processes.empty()) {
    return {fmt::format(
        "{} has no hydraulic cylinder: there is nothing to learn, only forces are compared",
        result.model.machine.name)};
  }
  if (!no_pressure_learned(result)) return {};
  return {fmt::format(
      "none of {} pressure models was learned; the model that is written predicts flows from "
      "commands and what the pump does, but no working pressures and no energy of a motion; the "
      "notes say what each motion lacks",
      result.processes.size())};
}

}  // namespace sparflow
