#pragma once
/// Mechanisms of the diagnosis that can be switched off one by one, and a record of those that acted. The ablation study
/// (studies/ablation/ablation.cpp, docs/ablation.md) uses both: a run in which a mechanism decided nothing has the same result
/// without it.
#include <atomic>
#include <cstdint>
#include <memory>

namespace sparflow {

enum class Mechanism : unsigned {
  kLeaders,          ///< updates of the load-sensing leader in the search
  kEstimateLeaders,  ///< the same in the estimate of all effects together
  kOptional,         ///< optional parameters, which a candidate has only where they gain enough
  kAngles,           ///< linearisation of angles at the value found
  kShareAtOne,       ///< a share on its bound that is fixed at one
  kFormGain,         ///< acceptance: gain beyond another effect's gain times form error squared
  kFormPower,        ///< acceptance: gain beside other exponents of the other effects
  kFormSize,         ///< acceptance: size over the model-form error of the others
  kAbsorbed,         ///< acceptance: absorbed share
  kSize,             ///< acceptance: size over noise
  kBound,            ///< acceptance: no parameter on its bound
  kHeldOut,          ///< acceptance: gain on motions left out
  kJoint,            ///< acceptance: joint significance
  kLeastGain,        ///< least gain beside the threshold of the null distribution
  kSquaresShape,     ///< least-squares comparison of points of the grid
  kPlainer,          ///< the plainer effect comes before its refinement
  kMerge,            ///< one effect for two
  kReshape,          ///< another variant of a law
  kMinor,            ///< minor effects are not named
  kOnce,             ///< isolated event: a large gain without significance
  kEvent,            ///< event in the residual of a force or speed
  kSettling,         ///< noise that is larger while the machine settles after a change of a command
  kBlocks,         ///< a second search beside references, with variances of the stretches of motion
  kCommonSupport,  ///< pressures are compared where the references have flows and forces
  kVoid,           ///< speeds are compared where the chamber that grows carries pressure
  kPumpFollows,    ///< changes of the demand show in the pump's pressure by the lag that it has
  kCount
};

class Mechanisms {
 public:
  bool enabled(Mechanism m) const { return (off_ & bit(m)) == 0; }
  void switch_off(Mechanism m) { off_ |= bit(m); }
  /// @param decides whether the mechanism changes a decision here, which is recorded
  /// @return whether it does so: false where it is switched off
  bool act(Mechanism m, bool decides = true) const {
    if (decides && acted_) *acted_ |= bit(m);
    return decides && enabled(m);
  }
  /// Begins a record, which copies share.
  void record() { acted_ = std::make_shared<std::atomic<std::uint64_t>>(0); }
  bool acted(Mechanism m) const { return acted_ && (*acted_ & bit(m)) != 0; }

 private:
  static std::uint64_t bit(Mechanism m) { return std::uint64_t{1} << static_cast<unsigned>(m); }
  std::uint64_t off_ = 0;
  std::shared_ptr<std::atomic<std::uint64_t>> acted_;
};

}  // namespace sparflow
