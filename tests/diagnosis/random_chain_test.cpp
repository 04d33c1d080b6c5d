/// A machine, a log and faults drawn at random go through fit, compare and diagnose: each gives a result whose numbers are
/// finite, or refuses with an InputError.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "diagnosis/verdict/diagnose.h"
#include "identification/comparison/compare.h"
#include "identification/learning/fit.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "simulator/hidden_effects/hidden_effect.h"
#include "simulator/hidden_effects/random_machine.h"

namespace sparflow {
namespace {

using Dice = std::mt19937_64;

bool chance(Dice& dice, double p) { return std::bernoulli_distribution(p)(dice); }

/// A log with channels left out at random and up to three faults in its text: a stretch without rows, one without values,
/// one with a value that is held, spikes, rows that are repeated.
std::string random_log(const Machine& machine, std::uint64_t seed) {
  Dice dice(seed);
  simulator::LogRequest request;
  request.machine = machine;
  request.crane_seed = request.motion_seed = seed;
  request.seconds = 40.0;
  request.rate = chance(dice, 0.3) ? 20.0 : 50.0;
  request.channels.commands = !chance(dice, 0.2);
  request.channels.pressure_b = !chance(dice, 0.2);
  request.channels.pumps = !chance(dice, 0.2);
  request.channels.payload = !chance(dice, 0.2);
  request.channels.oil = !chance(dice, 0.2);
  std::istringstream text(simulator::csv_text(simulator::generate(request)));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  const auto place = [&](std::size_t length) {
    return 1 + std::uniform_int_distribution<std::size_t>(0, lines.size() - length - 2)(dice);
  };
  for (int fault = std::uniform_int_distribution<int>(0, 3)(dice); fault > 0; --fault) {
    const std::size_t length = std::uniform_int_distribution<std::size_t>(1, 200)(dice),
                      at = place(length);
    switch (std::uniform_int_distribution<int>(0, 3)(dice)) {
      case 0:
        lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(at),
                    lines.begin() + static_cast<std::ptrdiff_t>(at + length));
        break;
      case 1:  // the last value of each line is missing
        for (std::size_t i = at; i < at + length; ++i) lines[i].erase(lines[i].rfind(',') + 1);
        break;
      case 2:  // the last value hangs
        for (std::size_t i = at + 1; i < at + length; ++i) {
          lines[i] =
              lines[i].substr(0, lines[i].rfind(',')) + lines[at].substr(lines[at].rfind(','));
        }
        break;
      default:  // single values far off
        for (std::size_t i = at; i < at + length; i += 17)
          lines[i] = lines[i].substr(0, lines[i].rfind(',')) + ",99999";
        break;
    }
  }
  std::string out;
  for (const std::string& line : lines) out += line + "\n";
  return out;
}

TEST(RandomChain, FitCompareAndDiagnoseGiveAResultOrRefuse) {
  std::vector<Machine> drawings;
  for (const char* name : {"loader_crane", "hmf_2020_k4", "swing_crane_two_pumps"}) {
    drawings.push_back(
        load_machine(std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/" + name + ".yaml"));
    drawings.back().pumps.front().type = PumpType::kLoadSensing;
  }
  int diagnosed = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Machine machine = simulator::random_machine(drawings, seed);
    try {
      const Log log = log_from_text("random.csv", random_log(machine, seed), machine);
      const FitResult fitted = fit(machine, {log});
      const CraneModel model = model_from_json(model_to_json(fitted.model), "m.json");
      const CompareResult compared = compare(model, {log});
      for (const StageScore& s : compared.scores)
        EXPECT_TRUE(std::isfinite(s.rmse)) << s.stage << s.at;
      EXPECT_TRUE(nlohmann::json::accept(compare_json(compared)));
      EXPECT_TRUE(nlohmann::json::accept(diagnose(model, {log}, {}).json()));
      ++diagnosed;
    } catch (const InputError& refused) {
      EXPECT_NE(std::string(refused.what()), "");
    }
  }
  EXPECT_GE(diagnosed, 3);
}

}  // namespace
}  // namespace sparflow
