/// Fits a model to a log and prints its errors on a log that took no part.
///   fit [MACHINE.yaml LOG.csv TEST.csv MODEL.json]
#include "identification/learning/fit.h"

#include <fmt/format.h>

#include <exception>

#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "problems/bundled.h"

using namespace sparflow;

namespace {

void run(int argc, char** argv) {
  if (argc > 5) throw UsageError("usage: fit [MACHINE.yaml LOG.csv TEST.csv MODEL.json]");
  const auto file = [&](int i, const char* bundled) {
    return argc > i ? std::string(argv[i]) : bundled_file(bundled);
  };
  const Machine machine = load_machine(file(1, "machines/loader_crane.yaml"));
  const Log log = load_log(file(2, "logs/loader_crane_train.csv"), machine);
  const Log test = load_log(file(3, "logs/loader_crane_test.csv"), machine);

  const FitResult result = fit(machine, {log}, {test});
  for (const std::string& note : result.notes) fmt::print("note: {}\n", note);
  const std::string path = argc > 4 ? argv[4] : "fitted.json";
  save_model(result.model, path);

  // What is saved reads back to the same numbers, so that the file is all that later programs need.
  const CompareResult errors = compare(load_model(path), {test});
  fmt::print("{:<12} {:<12} {:<8} {:>8}\n", "stage", "at", "", "RMSE");
  for (const StageScore& s : errors.scores) {
    fmt::print("{:<12} {:<12} {:<8} {:>8.2f} {}\n", s.stage, s.at, s.regime, s.rmse / s.unit.si,
               s.unit.name);
  }
  for (const EnergyScore& e : errors.energy) {
    fmt::print("energy of pump {} on {}: {:+.2f} %, model in {}\n", e.pump, test.file,
               100.0 * e.relative_error, path);
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
