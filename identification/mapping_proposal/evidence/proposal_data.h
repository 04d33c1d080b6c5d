#pragma once
/// Channels of a recording as the physics of the proposal sees them, and the weights of its evidence.
#include <Eigen/Dense>
#include <string>
#include <vector>

#include "identification/mapping_proposal/channel_file.h"
#include "identification/mapping_proposal/channel_words.h"
#include "identification/mapping_proposal/proposal_samples.h"

namespace sparflow {

/// How much a fit may count: `weight` independent samples, whose misfit is `spread` (as a share of the scale) where the meaning is
/// right. log-odds = weight * log(sqrt((1 + spread^2) / (misfit^2 + spread^2))) - price.
struct FitWeight {
  double weight = 4.0;  ///< [1]
  double spread = 0.1;  ///< [-]
  double price = 1.0;   ///< [nat] of a channel without any evidence
  double log_odds(double misfit) const;
};

/// Weights of what values say. All were tuned on simulated logs of seeds 1..4 (docs/mapping_proposal.md).
struct ChannelEvidenceOptions {
  /// Rod speed by the command's two slopes; ramps, dead bands and the other cylinders' flow are the misfit.
  /// @threshold [1] 0.1..10; tuned: seeds 1..4 of docs/mapping_proposal.md
  FitWeight command = {5.0, 0.4, 1.0};
  /// A measured speed is the derivative itself; noise of both is the misfit.
  /// @threshold [1] 0.1..10; tuned: seeds 1..4 of docs/mapping_proposal.md
  FitWeight speed = {6.0, 0.15, 2.0};
  /// Flow = area times rod speed, but for leaks and compression of the oil.
  /// @threshold [1] 0.1..10; tuned: seeds 1..4 of docs/mapping_proposal.md
  FitWeight flow = {6.0, 0.15, 2.0};
  /// Chamber forces against the static force, as a share of half the largest force of the cylinder.
  /// @threshold [1] 0.1..10; tuned: seeds 1..4 of docs/mapping_proposal.md
  FitWeight force = {7.0, 0.12, 1.5};
  /// One chamber alone: the other's pressure is not known.
  /// @threshold [1] 0.1..10; tuned: seeds 1..4 of docs/mapping_proposal.md
  FitWeight single_chamber = {2.5, 0.25, 2.0};
  /// Pump pressure above the largest working pressure, as a share of a third of the pump's largest pressure.
  /// @threshold [1] 0.1..10; tuned: seeds 1..4 of docs/mapping_proposal.md
  FitWeight pump = {4.0, 0.10, 1.0};
  /// Payload: force that the masses of the machine leave.
  /// @threshold [1] 0.1..10; tuned: seeds 1..4 of docs/mapping_proposal.md
  FitWeight payload = {4.0, 0.30, 0.5};
  /// Delay of the rod behind its command that is tried at most.
  /// @threshold [instants] 0..20; chosen: half a second; longer delays are no valve's
  int longest_lag = 5;
  /// Pressure limit where the machine has no pump.
  /// @threshold [Pa] 1e7..7e7; chosen: relief valves of mobile hydraulics
  double largest_pressure = 3.5e7;
  /// Instants on which the physics is judged.
  /// @threshold [1] 100..10000; chosen: every motion of a log is met several times, and the search takes seconds
  int physics_instants = 900;
  /// Channels that are considered; of more, those whose name or unit says something come first.
  /// @threshold [1] 20..2000; chosen: logs of a machine have fewer, whole vehicle busses more
  int most_channels = 160;
  /// Channels times meanings that are judged by name and unit to choose these; channels behind them come last.
  /// @threshold [1] 1e3..1e7; chosen: a second, for ten thousand channels of a machine with three cylinders
  int judged_names = 200'000;
};

/// One channel's values in SI by one reading of its unit.
struct ChannelReading {
  int channel = -1;  ///< in the recording
  ChannelUnit unit;
  bool stroke = false;      ///< of a position: it measures the cylinder
  double score = 0.0;       ///< [nat] name, unit, range and rate
  double name_score = 0.0;  ///< [nat] name and unit alone
  std::vector<std::string> reasons;
};

/// What all evidence is computed from.
struct ProposalData {
  const TimedChannels* file = nullptr;
  const Machine* machine = nullptr;
  WordOptions words;
  ChannelEvidenceOptions options;
  ProposalSamples samples;         ///< thinned to `physics_instants`
  std::vector<int> considered;     ///< channels, at most `most_channels`
  std::vector<ChannelUnit> units;  ///< of every channel, as the file says
  std::vector<double>
      mode_shares;  ///< of every channel: share of samples that have its most frequent value

  const std::string& name(int channel) const {
    return file->recording.channels[static_cast<std::size_t>(channel)].name;
  }
  const ChannelShape& shape(int channel) const {
    return samples.shapes[static_cast<std::size_t>(channel)];
  }
  double largest_pressure() const;  ///< [Pa] of the machine's pumps
  /// Name and unit of a channel about a meaning. @param reasons gets clauses; may be null
  double said(int channel, const Meaning& meaning, std::vector<std::string>* reasons) const;
};

ProposalData proposal_data(const TimedChannels& file, const Machine& machine,
                           const WordOptions& words, const ChannelEvidenceOptions& options);

/// Values of a channel at `lag` instants before, held at the begin of each run.
Eigen::VectorXd delayed(const ProposalSamples& samples, const Eigen::Ref<const Eigen::VectorXd>& v,
                        int lag);

}  // namespace sparflow
