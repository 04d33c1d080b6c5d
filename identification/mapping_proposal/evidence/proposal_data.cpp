#include "identification/mapping_proposal/evidence/proposal_data.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace sparflow {
namespace {

/// Share of the samples that have the most frequent value exactly, as levers at rest do.
double mode_share(const RecordedChannel& channel) {
  // A few ten thousand samples tell the share well enough.
  constexpr std::size_t kSorted = 20'000;
  const std::size_t stride = channel.values.size() / kSorted + 1;
  std::vector<double> values;
  values.reserve(channel.values.size() / stride + 1);
  for (std::size_t i = 0; i < channel.values.size(); i += stride) {
    if (std::isfinite(channel.values[i])) values.push_back(channel.values[i]);
  }
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  std::size_t longest = 0, run = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    run = i > 0 && values[i] == values[i - 1] ? run + 1 : 1;
    longest = std::max(longest, run);
  }
  return static_cast<double>(longest) / static_cast<double>(values.size());
}

/// All meanings that a machine's log can have.
std::vector<Meaning> all_meanings(const Machine& machine) {
  std::vector<Meaning> all;
  all.reserve(static_cast<std::size_t>(8 * machine.cylinder_count() + machine.joint_count() + 8));
  for (int j = 0; j < machine.joint_count(); ++j) all.push_back({Role::kJointPosition, j});
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    for (const Role role : {Role::kStroke, Role::kCommand, Role::kPressureA, Role::kPressureB,
                            Role::kForce, Role::kFlow}) {
      all.push_back({role, c});
    }
  }
  for (int p = 0; p < machine.pump_count(); ++p) all.push_back({Role::kPumpPressure, p});
  for (const Role role : {Role::kReturnPressure, Role::kPayload, Role::kOilTemperature}) {
    all.push_back({role, -1});
  }
  return all;
}

/// Channels with usable values; of too many, those of which names or units say most.
std::vector<int> considered_channels(const ProposalData& data) {
  std::vector<int> usable;
  for (std::size_t m = 0; m < data.samples.shapes.size(); ++m) {
    if (data.samples.shapes[m].usable) usable.push_back(static_cast<int>(m));
  }
  const auto most = static_cast<std::size_t>(data.options.most_channels);
  if (usable.size() <= most) return usable;
  // Names are judged on the first channels only as far as this takes a moment.
  const std::vector<Meaning> meanings = all_meanings(*data.machine);
  // A channel that is not judged comes behind all that are.
  std::vector<double> said(data.samples.shapes.size(), -std::numeric_limits<double>::infinity());
  const std::size_t affordable = static_cast<std::size_t>(std::max(0, data.options.judged_names)) /
                                 std::max<std::size_t>(1, meanings.size());
  for (std::size_t k = 0; k < std::min(usable.size(), affordable); ++k) {
    double best = -std::numeric_limits<double>::max();
    for (const Meaning& m : meanings) best = std::max(best, data.said(usable[k], m, nullptr));
    said[static_cast<std::size_t>(usable[k])] = best;
  }
  std::stable_sort(usable.begin(), usable.end(), [&](int a, int b) {
    return said[static_cast<std::size_t>(a)] > said[static_cast<std::size_t>(b)];
  });
  usable.resize(most);
  std::sort(usable.begin(), usable.end());
  return usable;
}

}  // namespace

double FitWeight::log_odds(double misfit) const {
  const double s2 = spread * spread;
  return 0.5 * weight * std::log((1.0 + s2) / (misfit * misfit + s2)) - price;
}

double ProposalData::largest_pressure() const {
  double most = 0.0;
  for (const Pump& pump : machine->pumps) most = std::max(most, pump.max_pressure);
  return most > 0.0 ? most : options.largest_pressure;
}

double ProposalData::said(int channel, const Meaning& meaning,
                          std::vector<std::string>* reasons) const {
  const WordEvidence name_says = name_evidence(name(channel), meaning, *machine, words);
  const WordEvidence unit_says =
      unit_evidence(units[static_cast<std::size_t>(channel)], meaning, *machine, words);
  if (reasons != nullptr) {
    for (const WordEvidence* e : {&name_says, &unit_says}) {
      if (!e->words.empty() && e->log_odds > 0.0) reasons->push_back(e->words);
    }
  }
  return name_says.log_odds + unit_says.log_odds;
}

ProposalData proposal_data(const TimedChannels& file, const Machine& machine,
                           const WordOptions& words, const ChannelEvidenceOptions& options) {
  ProposalData data;
  data.file = &file;
  data.machine = &machine;
  data.words = words;
  data.options = options;
  SampleOptions sampling;
  sampling.most_instants = options.physics_instants;
  // Few stretches, so that delays and derivatives hold over long parts.
  sampling.stretches = 6;
  data.samples = proposal_samples(file.recording, sampling);
  const std::size_t channels = file.recording.channels.size();
  data.units.reserve(channels);
  data.mode_shares.reserve(channels);
  for (const RecordedChannel& c : file.recording.channels) {
    data.units.push_back(channel_unit(c.name, c.unit));
    data.mode_shares.push_back(mode_share(c));
  }
  data.considered = considered_channels(data);
  return data;
}

Eigen::VectorXd delayed(const ProposalSamples& s, const Eigen::Ref<const Eigen::VectorXd>& v,
                        int lag) {
  Eigen::VectorXd out(v.size());
  for (const SampleRange& run : s.runs) {
    for (Eigen::Index i = run.begin; i < run.end; ++i) {
      out[i] = v[std::max(run.begin, i - static_cast<Eigen::Index>(lag))];
    }
  }
  return out;
}

}  // namespace sparflow
