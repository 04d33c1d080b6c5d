#pragma once
/// The residuals of a model in logs, arranged for finding a missing effect. There is one evidence channel for each
/// measured quantity; its model input is the measured output of the stage before, so that an effect shows at its own
/// stage only. Suspect logs (those to be diagnosed) and reference logs of the same machine without the effect share a
/// channel: references determine what is learned (the baseline), and the effect acts in suspect logs only.
///
/// Filters. A force is compared with an acceleration from a differentiating filter, so both must pass the same
/// low-pass. For the force that is the kernel g with g'' = h (h: the filter's second-derivative kernel), for a command
/// compared with a speed the kernel with g' = h, and for pressures the smoothing kernel itself. What is left of a force
/// passes one more, wider low-pass, because the noise of the accelerations is far above that of the pressures.
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "diagnosis/evidence/evidence_options.h"
#include "diagnosis/evidence/noise_model.h"
#include "identification/comparison/compare.h"
#include "models/effects/registry.h"
#include "models/effects/series.h"

namespace sparflow {

struct EvidenceChannel {
  EvidenceKind kind = EvidenceKind::kForce;
  int index = 0;      ///< cylinder, pump for kPump, 0 for kReturnLine
  std::string at;     ///< name of that cylinder or pump
  std::string text;   ///< "force of boom"
  FieldUnit unit;     ///< unit of reports
  Eigen::VectorXd y;  ///< [rows] residual: measured - model, SI
  Eigen::MatrixXd
      baseline;  ///< [rows x columns] regressors of what is learned, fitted with every effect
  std::vector<NoiseBlock> blocks;    ///< stretches of motion
  std::vector<int> log;              ///< [blocks] index into Evidence::series
  std::vector<Eigen::Index> sample;  ///< [rows] sample index in that log
  SettlingTimes since_change;        ///< since a command of the machine changed, by row
  /// Force and pump channels, by log: y before the filter [samples, SI], in which oscillations are searched; empty where
  /// the log does not measure it.
  std::vector<Eigen::VectorXd> raw;
  /// Supply channels: change of the baseline with the measured force [rows, Pa/N]. An error of a pressure sensor also
  /// changes the measured force and thereby the baseline.
  Eigen::VectorXd force_slope;
  /// Channels of a chamber: change of the baseline with the flow over the return edge, which sets the pressure of either chamber [rows,
  /// Pa s/m^3]. Oil that passes it and moves no rod (a leak past the piston) is no part of the baseline's flow.
  Eigen::VectorXd flow_slope;
  double largest_force = 0.0;  ///< [N] largest static force; force channels only
  /// What the effects add that act in suspect and reference logs alike (EvidenceOptions::shared).
  struct SharedAction {
    EffectAt effect;
    Eigen::VectorXd values;               ///< [rows, SI]
    Eigen::Index first = 0, columns = 0;  ///< of the baseline, which are its own
  };
  std::vector<SharedAction> shared;
  double noise_floor =
      0.0;  ///< [SI] standard deviation of the sensors' noise in y; NaN = not known

  Eigen::Index rows() const { return y.size(); }
  NoiseRows noise_rows() const { return {blocks, since_change}; }
};

/// Whether an effect rotates the whole machine, so that its force is nonlinear in its only parameter. A joint's offset
/// is nonlinear too, but is excluded: flows show its derivative alone, so it keeps the linearisation at its usual size.
bool is_nonlinear_in_parameter(const Effect& effect);

/// Whether the signature is a secant that depends on the size of the effect: an angle of the whole machine, a loss behind a valve.
bool is_linearised(const Effect& effect);

/// Whether a linear parameter that cannot be zero multiplies the whole law (a lag's share): another value of the effect then
/// replaces the law, where that of other effects adds to it.
bool is_replaced_when_changed(const Effect& effect);

/// Logs in which an effect acts.
enum class ActingLogs { kSuspects, kReferences, kAll };

struct Evidence {
  std::vector<MachineSeries> series;  ///< suspect logs first, then references
  std::size_t suspects = 0;           ///< number of suspect logs
  std::vector<EvidenceChannel> channels;
  std::vector<Eigen::VectorXd>
      since_change;  ///< [logs][samples, s] since a command of the machine changed; no logs: not used
  std::vector<std::string> notes;  ///< which effects cannot be judged, and why; whole sentences
  int stride = 1;                  ///< samples between rows
  double window = 0.0;             ///< [s] width of the filter
  EvidenceOptions options;         ///< that it was collected with; fits on it use the same

  bool has_reference() const { return series.size() > suspects; }
  const EvidenceChannel* find(EvidenceKind kind, int index) const;

  /// Signature: what one SI unit of each linear parameter adds to a channel, filtered like y; zero in logs in which the
  /// effect does not act.
  /// @param shape nonlinear parameters [SI]
  /// @param about linear parameters [SI] at which a quantity that is nonlinear in them (a force in an angle, a flow in a line's
  ///        loss) is linearised by its secant from zero; empty: at their usual size
  /// @return [rows x linear parameters]; no columns when the effect does not act there
  Eigen::MatrixXd columns(const EffectAt& effect, std::span<const double> shape,
                          const EvidenceChannel& channel, std::span<const double> about = {},
                          ActingLogs where = ActingLogs::kSuspects) const;

  /// The same evidence with the load-sensing leaders that follow from the model's effects and, in suspect logs, from
  /// `found`, and with the lag of the pump that these have. A line loss can make another cylinder the leader, which signatures built
  /// with the former leaders do not contain. Rows stay the same.
  /// @param found effects with the values near which the signatures are to hold
  /// @return nothing when neither leaders nor lags change
  std::optional<Evidence> with_leaders_of(std::span<const AppliedEffect> found) const;

 private:
  friend class EvidenceCollector;
  struct Kernels {  // low-pass kernels of one log, centred, of odd length
    Eigen::VectorXd force, speed, pressure;
    std::vector<Eigen::VectorXd> behind_force;  // by cylinder: of its force behind all others
  };
  std::vector<Kernels> kernels_;
  std::vector<AppliedEffect> known_,
      known_in_references_;  // effects of the model that act in suspect logs, in reference logs
  Eigen::VectorXd filter(std::size_t log, EvidenceKind kind, const Eigen::VectorXd& x) const;
  /// What has passed the filter of a force, behind its further low-pass; x where there is none.
  Eigen::VectorXd behind_force(std::size_t log, int cylinder, const Eigen::VectorXd& x) const;
  const std::vector<AppliedEffect>& known_in(std::size_t log) const {
    return log < suspects ? known_ : known_in_references_;
  }
  /// Sum of what the effects of the model add. [samples, SI]
  Eigen::VectorXd known(std::size_t log, EvidenceKind kind, int index) const;
  /// The same behind the channel's filter. What comes from filtered derivatives has passed it (Effect::columns_filtered).
  Eigen::VectorXd smooth_known(std::size_t log, EvidenceKind kind, int index) const;
  /// Valve sections as an effect's columns of a channel fit them, those of all logs together; empty where they fit none.
  SectionPool sections(const EffectAt& effect, std::span<const double> shape,
                       const EvidenceChannel& channel, std::span<const double> about) const;
  /// A change of an effect that acts in all logs and has a parameter which switches it on (a lag's share) replaces the law of
  /// before: its signature is the difference of both.
  /// @param columns [samples x linear parameters] of the effect with its present shape, changed in place
  void subtract_shared(std::size_t log, const EffectAt& effect, std::span<const double> shape,
                       const EvidenceChannel& channel, Eigen::MatrixXd& columns) const;
  /// Adds the columns of the shared effects to a channel's baseline.
  void add_shared(EvidenceChannel& channel) const;
  /// Baseline of a pump: one margin for each cylinder as leader, and standby. [samples x (cylinders fed + 1)]
  Eigen::MatrixXd margins(std::size_t log, int pump) const;
};

/// The baseline without columns that are zero in all rows.
Eigen::MatrixXd acting_columns(const Eigen::MatrixXd& baseline);

/// @param model its effects are part of every channel's model; its margins give the first estimate of pump demand
/// @param in_references effects that act in the references; null: those of the model
Evidence collect_evidence(const CraneModel& model, const std::vector<MachineSignals>& suspects,
                          const std::vector<MachineSignals>& references = {},
                          const std::vector<AppliedEffect>* in_references = nullptr,
                          const EvidenceOptions& options = {});

/// Effects of the model that acted when the references were recorded: all except those which a step of the model's
/// record added from other logs.
std::vector<AppliedEffect> effects_in_references(const CraneModel& model,
                                                 const std::vector<MachineSignals>& references);

/// The catalogue on the model's machine without the effects that the model has.
std::vector<EffectAt> effects_not_in(const CraneModel& model);

/// "force of boom", "return pressure of jib extending"
std::string evidence_text(EvidenceKind kind, const std::string& at);
/// The stage's name in reports: force, flow, pressure, pump.
const char* evidence_stage(EvidenceKind kind);

}  // namespace sparflow
