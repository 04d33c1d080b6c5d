#pragma once
/// The crane with its base laws and hidden laws, stepped in time: lever -> spool -> flow -> rod -> load -> chambers
/// -> pump -> sensors. It is quasi-static; inertia is one of the hidden effects.
#include "simulator/hidden_effects/hidden_law.h"
#include "simulator/operator/operator_motion.h"

namespace sparflow::simulator {

class Plant {
 public:
  /// @param machine as in the machine file; hidden laws may change its bodies  @param step [s]
  Plant(const Machine& machine, const CraneLaws& laws,
        std::vector<std::unique_ptr<HiddenLaw>>& hidden, std::vector<double> start, double step);

  /// Advances by state().h. @param payload [kg]  @param oil [degC]  @param command levers [-] by cylinder
  void step(double payload, double oil, const std::vector<double>& command);
  void sense(SensorState& sensors);
  /// Takes over the positions of another plant before a step, so that the two then differ only by their laws.
  void follow(const PlantState& other);
  const PlantState& state() const { return state_; }

 private:
  void move();
  void load();
  void pressurise();
  void supply();
  template <class Hook>
  void each(Hook hook) {
    for (auto& law : hidden_) hook(*law);
  }

  const Machine& machine_;
  const CraneLaws& laws_;
  std::vector<std::unique_ptr<HiddenLaw>>& hidden_;
  BodyForces bodies_;
  bool inertia_ = false;
  PlantState state_;
  JointLoads loads_;
  std::vector<double> speed_before_, speed_before2_, loaded_at_;
  double loaded_with_ = -1.0;
};

}  // namespace sparflow::simulator
