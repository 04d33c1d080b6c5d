#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/math/error.h"
#include "simulator/hidden_effects/drive.h"
#include "simulator/hidden_effects/log_columns.h"

namespace sparflow::simulator {
namespace {

constexpr double kNoMachine = 5e8;  // [Pa] no cylinder bears such a pressure
constexpr double kLongestStep =
    0.01;  // [s] of the plant; short compared with every lag that is drawn

int place_index(const LawEntry& entry, const Machine& machine, const std::string& at) {
  switch (entry.place) {
    case HiddenPlace::kJoint:
      return machine.joint_index(at);
    case HiddenPlace::kCylinder:
      return machine.cylinder_index(at);
    case HiddenPlace::kPump:
      return machine.pump_index(at);
    default:
      return -1;
  }
}

/// Draws place, law and strength of each effect and writes place and law into `effects`. @throws InputError
std::vector<std::unique_ptr<HiddenLaw>> make_laws(std::vector<HiddenEffect>& effects,
                                                  const Machine& machine, const CraneLaws& laws,
                                                  std::uint64_t crane_seed, double usual) {
  std::vector<std::unique_ptr<HiddenLaw>> hidden;
  for (std::size_t k = 0; k < effects.size(); ++k) {
    HiddenEffect& effect = effects[k];
    const LawEntry& entry = law_entry(effect.id);
    Random random(crane_seed + 1000 * k, effect.id);
    const std::vector<std::string> places = places_of(effect.id, machine);
    const int picked = random.below(std::max(1, static_cast<int>(places.size())));
    const int variant = random.below(static_cast<int>(entry.laws.size()));
    if (places.empty())
      throw InputError({}, "effects",
                       effect.id + " has no possible place on machine " + machine.name);
    if (effect.at.empty()) effect.at = places[static_cast<std::size_t>(picked)];
    if (std::find(places.begin(), places.end(), effect.at) == places.end())
      throw InputError({}, "effects",
                       fmt::format("{} has no place \"{}\"; possible: {}", effect.id, effect.at,
                                   fmt::join(places, ", ")));
    if (effect.law < 0) effect.law = variant;
    if (effect.law >= static_cast<int>(entry.laws.size()))
      throw InputError(
          {}, "effects",
          fmt::format("{} has laws 0..{}, got {}", effect.id, entry.laws.size() - 1, effect.law));
    LawContext context{&machine,  &laws,       &random,    place_index(entry, machine, effect.at),
                       effect.at, effect.size, effect.law, usual};
    hidden.push_back(entry.make(context));
  }
  return hidden;
}

/// Payloads [kg], each constant over about a third of a log, with the times [s] at which they end.
struct Payloads {
  std::vector<double> mass, until;
  std::size_t now = 0;
};

Payloads draw_payloads(Random& random, double usual, double seconds, bool one) {
  Payloads p;
  std::vector<double> menu = {0.0, 0.3 * usual, 0.6 * usual, usual};
  const int stretches = one ? 1 : (seconds < 100.0 ? 2 : 3);
  for (int i = 0; i < stretches; ++i) {
    const auto pick = static_cast<std::size_t>(random.below(static_cast<int>(menu.size())));
    p.mass.push_back(std::round(menu[pick] / 10.0) * 10.0);
    menu.erase(menu.begin() + static_cast<std::ptrdiff_t>(pick));
    p.until.push_back(seconds * (i + 1) / stretches + random.uniform(-0.06, 0.06) * seconds);
  }
  p.until.back() = 1e12;
  return p;
}

std::vector<HiddenTruth> truths(const std::vector<HiddenEffect>& drawn,
                                const std::vector<std::unique_ptr<HiddenLaw>>& laws) {
  std::vector<HiddenTruth> result;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const LawEntry& entry = law_entry(drawn[i].id);
    result.push_back({drawn[i].id, drawn[i].at, drawn[i].size, drawn[i].law,
                      entry.laws[static_cast<std::size_t>(drawn[i].law)], entry.in_catalogue,
                      laws[i]->parameters()});
  }
  return result;
}

}  // namespace

std::vector<std::string> places_of(const std::string& id, const Machine& machine) {
  const LawEntry& entry = law_entry(id);
  std::vector<std::string> places;
  const auto add = [&](int count, auto name) {
    for (int i = 0; i < count; ++i)
      if (!entry.fits || entry.fits(machine, i))
        places.push_back(name(static_cast<std::size_t>(i)));
  };
  switch (entry.place) {
    case HiddenPlace::kMachine:
      if (!entry.fits || entry.fits(machine, -1)) places.push_back("");
      break;
    case HiddenPlace::kJoint:
      add(machine.joint_count(), [&](std::size_t i) { return machine.joints[i].name; });
      break;
    case HiddenPlace::kCylinder:
      add(machine.cylinder_count(), [&](std::size_t i) { return machine.cylinders[i].name; });
      break;
    case HiddenPlace::kPump:
      add(machine.pump_count(), [&](std::size_t i) { return machine.pumps[i].name; });
      break;
    case HiddenPlace::kChannel:
      for (const Cylinder& c : machine.cylinders) {
        if (!c.hydraulic()) continue;
        places.push_back("pA_" + c.name);
        places.push_back("pB_" + c.name);
      }
      for (const Pump& p : machine.pumps) places.push_back("p_" + p.name);
      for (const Joint& j : machine.joints) places.push_back("q_" + j.name);
      break;
  }
  return places;
}

std::unique_ptr<HiddenCase> draw_hidden(const LogRequest& request) {
  const Machine& machine = request.machine;
  if (request.rate < 5.0 || request.rate > 200.0 || request.seconds <= 0.0)
    throw InputError({}, "rate",
                     fmt::format("got {} Hz for {} s, expected 5..200 Hz and a "
                                 "positive duration",
                                 request.rate, request.seconds));
  auto drawn = std::make_unique<HiddenCase>();  // The laws keep its address.
  HiddenCase& one = *drawn;
  one.usual_payload = usual_payload(machine, request.crane_seed);
  one.laws = draw_crane_laws(machine, request.crane_seed);
  one.drawn = request.effects;
  std::vector<HiddenEffect> absent = request.absent;
  one.hidden = make_laws(one.drawn, machine, one.laws, request.crane_seed, one.usual_payload);
  for (const auto& law :
       make_laws(absent, machine, one.laws, request.crane_seed, one.usual_payload))
    law->prepare_crane(one.laws);
  for (const auto& law : one.hidden) law->prepare_crane(one.laws);
  return drawn;
}

void drive_log(const LogRequest& request, HiddenCase& one, const StepWatch& before_step,
               const RowWatch& after_row) {
  const Machine& machine = request.machine;
  const CraneLaws& laws = one.laws;
  Random load_random(request.motion_seed, "loads");
  Payloads payloads = draw_payloads(load_random, one.usual_payload, request.seconds, request.warm);
  std::vector<std::array<double, 2>> flows;
  for (const CylinderLaws& c : laws.cylinders)
    flows.push_back({c.direction[0].valve_gain, c.direction[1].valve_gain});
  OperatorMotion motion(machine, lever_flows(machine, flows), request.motion_seed);
  const int substeps =
      std::max(1, static_cast<int>(std::ceil(1.0 / request.rate / kLongestStep - 1e-9)));
  const double h = 1.0 / request.rate / substeps;
  Plant plant(machine, laws, one.hidden, motion.start_posture(), h);
  const auto rows = static_cast<std::size_t>(std::llround(request.seconds * request.rate));

  std::vector<double> command(machine.cylinders.size(), 0.0), rate(machine.cylinders.size());
  const double oil_before = request.warm ? 0.6 * request.seconds + 0.5 * laws.oil_time : 0.0;
  for (std::size_t row = 0; row < rows; ++row) {
    for (int sub = 0; sub < substeps; ++sub) {
      const PlantState& s = plant.state();
      if (motion.resting() && s.t > payloads.until[payloads.now]) ++payloads.now;
      for (std::size_t i = 0; i < rate.size(); ++i) rate[i] = s.cylinders[i].rate;
      motion.levers(s.t, h, s.q, rate, command);
      for (std::size_t i = 0; i < command.size(); ++i) {
        // The operator moves the lever quickly over most of a dead band.
        for (const auto& law : one.hidden) {
          const double gap = laws.operator_deadband_share *
                             law->lever_deadband(static_cast<int>(i), sign_of(command[i]));
          const double small = std::min(1.0, std::abs(command[i]) / 0.03);
          command[i] =
              std::clamp(command[i] * (1.0 - gap) + sign_of(command[i]) * gap * small, -1.0, 1.0);
        }
        command[i] =
            std::round(command[i] * 1e4) / 1e4;  // The valve gets the rounded value that is logged.
      }
      const double oil = laws.oil_end - (laws.oil_end - laws.oil_start) *
                                            std::exp(-(s.t + oil_before) / laws.oil_time);
      const double payload = payloads.mass[payloads.now];
      if (before_step) before_step(plant, {payload, oil, command});
      plant.step(payload, oil, command);
    }
    after_row(plant, payloads.mass[payloads.now]);
  }
}

GeneratedLog generate(const LogRequest& request) {
  const std::unique_ptr<HiddenCase> drawn = draw_hidden(request);
  HiddenCase& one = *drawn;
  const auto rows = static_cast<std::size_t>(std::llround(request.seconds * request.rate));
  LogRecorder recorder(request.machine, request, rows);
  SensorState sensors;
  drive_log(request, one, {}, [&](Plant& plant, double payload) {
    plant.sense(sensors);
    for (const CylinderState& c : plant.state().cylinders)
      SPARFLOW_CHECK(std::max(std::abs(c.pressure_a), std::abs(c.pressure_b)) < kNoMachine,
                     "a hidden law makes the simulated crane unstable");
    recorder.add(plant.state(), sensors, payload);
  });
  Random noise(request.motion_seed, "noise");
  recorder.finish(one.hidden, noise);
  GeneratedLog log = recorder.log();
  log.truth = truths(one.drawn, one.hidden);
  return log;
}

}  // namespace sparflow::simulator
