/// Finds the physical effect that a model lacks. The bundled log is of a crane with a friction that the model is not told
/// of: the fit learns pressures all the same, and only the forces show it.
///   diagnose [MODEL.json LOG.csv]
#include "diagnosis/verdict/diagnose.h"

#include <fmt/format.h>

#include <cmath>
#include <exception>

#include "identification/learning/fit.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "problems/bundled.h"

using namespace sparflow;

namespace {

/// A model of the bundled crane, learned from the log with the hidden friction.
CraneModel bundled_model(const std::string& log) {
  const Machine machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  return fit(machine, {load_log(log, machine)}).model;
}

void run(int argc, char** argv) {
  if (argc != 1 && argc != 3) throw UsageError("usage: diagnose [MODEL.json LOG.csv]");
  const std::string path =
      argc == 3 ? argv[2] : bundled_file("logs/loader_crane_friction_train.csv");
  const CraneModel model = argc == 3 ? load_model(argv[1]) : bundled_model(path);

  const Diagnosis result = diagnose(model, {load_log(path, model.machine)});
  for (const std::string& note : result.notes) fmt::print("note: {}\n", note);
  for (const BadChannel& bad : result.set_aside) fmt::print("set aside: {}\n", bad.channel);
  for (const auto& set : result.indistinguishable)
    fmt::print("not told apart by this log: {}\n", fmt::join(set, ", "));
  fmt::print("{}\nprobability of this evidence if nothing were missing: {}\n", result.headline(),
             result.p_value_text());
  fmt::print("verdict {}\n", verdict_name(result.verdict));
  for (const DiagnosedEffect& e : result.effects) {
    for (const ParameterEstimate& p : e.parameters) {
      fmt::print("{}, probability {:.0f} %: {} = {:.0f} {}, 95 % interval {:.0f} .. {:.0f}\n",
                 e.key(), std::floor(100.0 * e.probability), p.name, p.value, p.unit, p.lower95,
                 p.upper95);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
