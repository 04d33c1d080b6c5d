#include "apps/tasks/benchmark/learned_run.h"

#include <optional>

#include "apps/tasks/benchmark/learned_machine.h"

namespace sparflow {

benchmark::Row LearnedRun::run(const std::string& name, const MakeLearned& make, std::uint64_t seed,
                               const benchmark::LoopOptions& loop) const {
  const control::SectionValves valves(model != nullptr ? learned_sections(*model)
                                                       : control::sections_of(scenario.machine));
  std::optional<LearnedPower> power;
  std::optional<ScenarioMotions> source;
  if (model != nullptr) {
    power.emplace(*model);
    source.emplace(scenario, *model, motions, planning);
  }
  control::Knowledge know;
  know.machine = &scenario.machine;
  know.valves = &valves;
  know.power = power ? &*power : nullptr;
  know.motions = source ? &*source : nullptr;
  know.sample_time = loop.sample_time;
  return benchmark::run_closed_loop(
      scenario, name, [&] { return make(know); }, seed, loop);
}

}  // namespace sparflow
