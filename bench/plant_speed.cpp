/// How fast the dynamic plant runs: random work of 60 s on each machine, one core.
///   plant_speed [MACHINE.yaml...]      without arguments: the bundled machines with hydraulics
/// Prints seconds of processor time, times real time, the integrator's counts and how far the energy balance closes.
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <exception>
#include <string>
#include <vector>

#include "models/files/machine_file.h"
#include "simulator/plant/parameters/plant_effects.h"
#include "simulator/programmes/programmes.h"

namespace {

using namespace sparflow;

void row(const std::string& path, bool flexible) {
  const Machine machine = load_machine(path);
  plant::PlantParameters parameters = plant::default_parameters(machine);
  std::vector<plant::EffectSetting> settings;
  if (flexible) settings.push_back(plant::parse_effect("flexible_boom"));
  plant::apply_effects(machine, settings, parameters);
  constexpr double kSeconds = 60.0;
  const auto work = plant::operator_work(machine, parameters, {1, kSeconds, 0.02, std::nullopt});
  plant::PlantRun run(machine, parameters, work->start(), work->start_payload());
  const std::clock_t begin = std::clock();
  while (run.time() < kSeconds - 1e-9 && run.status() == plant::RunStatus::kRunning) {
    const plant::ProgrammeStep step = work->step(run.record());
    if (step.payload) run.set_payload(*step.payload);
    run.advance(step.command);
  }
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  const plant::PlantRun::Counts c = run.counts();
  double work_done = run.ledger().drive_work;
  for (const double w : run.ledger().pump_work) work_done += w;
  fmt::print("{:<32} {:8} {:8.2f} {:8.1f} {:8} {:12} {:10} {:12.1e}\n", machine.name,
             flexible ? "bending" : "rigid", seconds, run.time() / seconds, c.steps, c.evaluations,
             c.jacobians, std::abs(run.ledger().imbalance()) / work_done);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::vector<std::string> paths(argv + 1, argv + argc);
    if (paths.empty())
      for (const char* name : {"loader_crane", "hmf_2020_k4", "excavator", "swing_crane",
                               "swing_crane_two_pumps", "urdf_crane"})
        paths.push_back(std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/" + name + ".yaml");
    fmt::print("{:<32} {:8} {:>8} {:>8} {:>8} {:>12} {:>10} {:>12}\n", "machine", "booms", "CPU s",
               "x real", "steps", "evaluations", "Jacobians", "imbalance");
    for (const std::string& path : paths)
      for (const bool flexible : {false, true}) row(path, flexible);
  } catch (const std::exception& e) {
    fmt::print(stderr, "plant_speed: {}\n", e.what());
    return 1;
  }
  return 0;
}
