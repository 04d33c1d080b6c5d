#pragma once
/// What a model leaves unexplained in logs, arranged for finding the missing effect: one channel for each measured
/// quantity against what comes before it as measured, so that an effect shows at its own stage.
/// Suspect logs and, where there are any, reference logs of the same machine without the effect stand in the same
/// channel: the reference then pins what is learned (the baseline), the effect acts in the suspect logs only.
///
/// Filters. A force is compared with an acceleration that a differentiating filter made: both must have passed the
/// same low-pass. The kernel g with g'' = h (h the filter's second-derivative kernel) does that for the force, the
/// kernel with g' = h for a command against a speed, the smoothing kernel itself for pressures.
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "diagnosis/evidence/noise_model.h"
#include "identification/comparison/compare.h"
#include "models/effects/registry.h"
#include "models/effects/series.h"

namespace sparflow {

struct EvidenceChannel {
  EvidenceKind kind = EvidenceKind::kForce;
  int index = 0;                     ///< cylinder, of kPump the pump
  std::string at;                    ///< its name
  std::string text;                  ///< "force of boom"
  FieldUnit unit;                    ///< to show it in
  Eigen::VectorXd y;                 ///< [rows] measured - model, SI
  Eigen::MatrixXd baseline;          ///< [rows x columns] what may always explain y (learned laws)
  std::vector<NoiseBlock> blocks;    ///< stretches of motion
  std::vector<int> log;              ///< [blocks] index into Evidence::series
  std::vector<Eigen::Index> sample;  ///< [rows] in that log
  /// Of forces and pumps, by suspect log: y before the filter [samples]; oscillations are looked for there.
  std::vector<Eigen::VectorXd> raw;
  /// Of supply channels: what one newton of measured force adds to y by the baseline [rows, Pa/N]. A sensor that
  /// reads wrong shifts the force too, and with it the baseline's answer.
  Eigen::VectorXd force_slope;
  double largest_force = 0.0;  ///< [N] of force channels: largest static force
  double noise_floor = 0.0;    ///< standard deviation of the sensors' noise in y; NaN = not known

  Eigen::Index rows() const { return y.size(); }
};

/// Whether an effect turns the whole machine, so that its force bends in its only parameter; weights are exact either
/// way. A joint's offset bends, too, but shows in flows by its slope alone: there both stay with the usual size.
bool bends(const Effect& effect);

struct Evidence {
  std::vector<MachineSeries> series;  ///< suspect logs first, then references
  std::size_t suspects = 0;           ///< how many are suspect
  std::vector<EvidenceChannel> channels;
  std::vector<std::string> notes;  ///< what cannot be judged, and why; whole sentences
  int stride = 1;                  ///< samples between rows
  double window = 0.0;             ///< [s] of the filter

  bool has_reference() const { return series.size() > suspects; }
  const EvidenceChannel* find(EvidenceKind kind, int index) const;

  /// What one unit of an effect's linear parameters adds to a channel, filtered like y; zero in reference logs.
  /// @param about linear parameters up to which a force that bends (an angle's) is the chord; empty: its usual size
  /// @return [rows x linear parameters]; no columns when it does not act there
  Eigen::MatrixXd columns(const EffectAt& effect, std::span<const double> shape,
                          const EvidenceChannel& channel, std::span<const double> about = {}) const;

  /// The same evidence with pumps led as the model's effects and these, in suspect logs, make them: a loss of a line
  /// can let another cylinder lead, which its columns, made at the leader without it, do not know. Rows stay.
  /// @param found values are those in whose neighbourhood columns are to hold
  /// @return nothing when the leaders are these already
  std::optional<Evidence> led_by(std::span<const AppliedEffect> found) const;

 private:
  friend Evidence collect_evidence(const CraneModel&, const std::vector<MachineSignals>&,
                                   const std::vector<MachineSignals>&,
                                   const std::vector<AppliedEffect>*, bool);
  struct Kernels {  // of one log: low-passes for forces, speeds and pressures, centred, odd length
    Eigen::VectorXd force, speed, pressure;
  };
  std::vector<Kernels> kernels_;
  std::vector<AppliedEffect> known_,
      known_in_references_;  // the model's effects, in either kind of log
  Eigen::VectorXd filter(std::size_t log, EvidenceKind kind, const Eigen::VectorXd& x) const;
  const std::vector<AppliedEffect>& known_in(std::size_t log) const {
    return log < suspects ? known_ : known_in_references_;
  }
  /// What the model's own effects already explain. [samples]
  Eigen::VectorXd known(std::size_t log, EvidenceKind kind, int index) const;
  /// One margin for each leader, and one for standby. [samples x feeds + 1]
  Eigen::MatrixXd margins(std::size_t log, int pump) const;
};

/// Without columns of learned laws that never act in these rows.
Eigen::MatrixXd acting_columns(const Eigen::MatrixXd& baseline);

/// @param model its effects are in every channel's model part; its margins start the pump's demand
/// @param in_references effects that the references have; null: the model's
/// @param whole_motions rows up to the ends of each motion, of quantities as measured: for signals whose own window is
/// so sharp (sharpest_window) that it rounds nothing off
Evidence collect_evidence(const CraneModel& model, const std::vector<MachineSignals>& suspects,
                          const std::vector<MachineSignals>& references = {},
                          const std::vector<AppliedEffect>* in_references = nullptr,
                          bool whole_motions = false);

/// Effects of the model that the machine had already when the references were recorded: all but those that a step of
/// the model's record added from other logs.
std::vector<AppliedEffect> effects_in_references(const CraneModel& model,
                                                 const std::vector<MachineSignals>& references);

/// "force of boom", "return pressure of jib while extending"
std::string evidence_text(EvidenceKind kind, const std::string& at);
/// The stage's name in reports: force, flow, pressure, pump.
const char* evidence_stage(EvidenceKind kind);

}  // namespace sparflow
