#pragma once
/// What the plant is asked to do: at each sample a programme sees what is measured and gives the commands.
#include <optional>
#include <vector>

#include "simulator/plant/run/plant_run.h"

namespace sparflow::plant {

struct ProgrammeStep {
  std::vector<double> command;    ///< [-1..1] by cylinder
  std::optional<double> payload;  ///< [kg] taken or put down now
  bool end = false;               ///< nothing is left to do
};

class Programme {
 public:
  virtual ~Programme() = default;
  virtual std::vector<double> start() const = 0;  ///< joint positions at the begin
  virtual double start_payload() const = 0;       ///< [kg]
  virtual ProgrammeStep step(const Record& measured) = 0;
};

/// Levers for rod speeds on a valve whose dead band and full flow are known, the nominal inverse of spool and metering edge.
class LeverMap {
 public:
  LeverMap(const Machine& machine, const PlantParameters& parameters);
  const Machine& machine() const { return machine_; }
  /// @param speed [m/s] of the rod, positive extends @return [-1..1]
  double lever(int cylinder, double speed) const;
  /// Fastest rod speed that valve and pump allow this cylinder alone. [m/s]
  double fastest(int cylinder, bool extend) const;

 private:
  const Machine& machine_;
  const PlantParameters& parameters_;
};

/// Commands that let the cylinders follow joint positions: flow ahead plus position feedback.
struct FollowerOptions {
  /// Speed by which an error of position is corrected.
  /// @threshold [1/s] 0..10; chosen: well below the spool's and the load's natural frequencies
  double gain = 2.0;
  /// Error of the stroke that is left alone while the reference rests.
  /// @threshold [m] 0..0.05; chosen: no hunting in the valve's dead band
  double rest = 0.003;
  /// Time by which the flow ahead is taken earlier, as spools, pilot lines and oil follow late.
  /// @threshold [s] 0..0.5; tuned: the lead of TrackerGains, on problems/scenarios/tuning
  double lead = 0.2;
};

/// @param q, qd wanted joint positions and rates
std::vector<double> follow(const LeverMap& levers, const Record& measured, const Eigen::VectorXd& q,
                           const Eigen::VectorXd& qd, const FollowerOptions& options = {});

}  // namespace sparflow::plant
