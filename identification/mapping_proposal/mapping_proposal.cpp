#include "identification/mapping_proposal/mapping_proposal.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "identification/log/log_columns.h"
#include "identification/mapping_proposal/proposal_search.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// "`PT 01` * 0.001", the column in the unit of the program's name.
std::string column_times(const std::string& name, double factor, double offset) {
  std::string text = fmt::format("`{}`", name);
  if (std::abs(factor - 1.0) > 1e-9) {
    const double inverse = 1.0 / factor;
    text += std::abs(inverse - std::round(inverse)) < 1e-9 * inverse && inverse > 1.5
                ? fmt::format(" / {:.9g}", std::round(inverse))
                : fmt::format(" * {:.9g}", factor);
  }
  if (offset != 0.0) text += fmt::format(" {} {:.9g}", offset < 0.0 ? "-" : "+", std::abs(offset));
  return text;
}

/// Makes the rows of the proposal from the best assignment.
class ProposalRows {
 public:
  ProposalRows(const ProposalData& data, ProposalSearch* search,
               const ConfidenceOptions& confidence)
      : data_(data),
        machine_(*data.machine),
        search_(*search),
        best_(search->best()),
        confidence_(confidence),
        forces_(search->forces(best_)),
        parts_(search->cylinders(best_)) {
    payload_.resize(data.samples.instants(), 0);
    for (std::size_t r = 0; r < search->rest().size(); ++r) {
      if (search->rest()[r].role == Role::kPayload && best_.rest[r] >= 0)
        payload_ = data.samples.values.col(best_.rest[r]);
    }
  }

  std::vector<MeaningProposal> rows() {
    std::vector<MeaningProposal> all;
    all.reserve(static_cast<std::size_t>(machine_.joint_count() + 2 * machine_.cylinder_count()) +
                search_.rest().size());
    for (int j = 0; j < machine_.joint_count(); ++j) all.push_back(position_row(j));
    for (int c = 0; c < machine_.cylinder_count(); ++c) {
      if (!machine_.cylinders[static_cast<std::size_t>(c)].hydraulic()) continue;
      for (const int side : {0, 1}) all.push_back(pressure_row(c, side));
    }
    for (std::size_t r = 0; r < search_.rest().size(); ++r) {
      if (best_.rest[r] >= 0 || wanted(search_.rest()[r])) all.push_back(rest_row(r));
    }
    return all;
  }

 private:
  /// Meanings without a channel that are worth a word.
  static bool wanted(const Meaning& m) {
    return m.kind == MeaningKind::kRole &&
           (m.role == Role::kCommand || m.role == Role::kPumpPressure || m.role == Role::kPayload ||
            m.role == Role::kOilTemperature || m.role == Role::kForce);
  }

  MeaningProposal begun(const Meaning& meaning, int channel) const {
    MeaningProposal row;
    row.meaning = meaning;
    row.channel = channel;
    if (meaning.kind == MeaningKind::kRole)
      row.column = usual_name(meaning.role, meaning.index, machine_);
    if (channel < 0) return row;
    row.channel_name = data_.name(channel);
    data_.said(channel, meaning, &row.reasons);
    return row;
  }

  /// Confidence and the rival, from the best assignment without this choice.
  void judge(MeaningProposal* row, const Ban& ban,
             const std::function<int(const Assignment&)>& channel_of) {
    Assignment other;
    const double margin = search_.margin(ban, &other);
    const double odds = confidence_.at_zero + confidence_.by_margin * margin;
    row->margin = margin;
    row->confidence = std::min(confidence_.most, 1.0 / (1.0 + std::exp(-odds)));
    if (rests_unnamed(*row)) {
      row->confidence = std::min(row->confidence, confidence_.resting);
      row->reasons.push_back("its joint rests throughout, and the name says nothing");
    }
    if (other.positions.empty()) return;
    const int m = channel_of(other);
    if (m >= 0) row->other = data_.name(m);
  }

  /// Whether neither motion nor name tells a meaning of a joint or cylinder.
  bool rests_unnamed(const MeaningProposal& row) const {
    const Meaning& m = row.meaning;
    if (m.index < 0) return false;
    std::vector<int> joints;
    if (m.role == Role::kPumpPressure) {
      for (const int c : machine_.pumps[static_cast<std::size_t>(m.index)].feeds)
        joints.push_back(machine_.cylinders[static_cast<std::size_t>(c)].joint);
    } else if (m.role == Role::kJointPosition) {
      joints.push_back(m.index);
    } else {
      joints.push_back(machine_.cylinders[static_cast<std::size_t>(m.index)].joint);
    }
    for (const int joint : joints) {
      const PositionCandidate* p = search_.position(best_, joint);
      if (p != nullptr && p->moves) return false;
    }
    return data_.said(row.channel, m, nullptr) <= data_.words.right_unit;
  }

  MeaningProposal position_row(int joint) {
    const PositionCandidate* c = search_.position(best_, joint);
    if (c == nullptr) {
      MeaningProposal row = begun({Role::kJointPosition, joint}, -1);
      row.required = true;
      return row;
    }
    const ChannelReading& r = c->reading;
    const Meaning meaning = r.stroke ? Meaning{Role::kStroke, machine_.cylinder_of_joint(joint)}
                                     : Meaning{Role::kJointPosition, joint};
    MeaningProposal row = begun(meaning, r.channel);
    row.required = true;
    row.reasons = r.reasons;
    row.factor = r.unit.factor;
    row.expression = column_times(row.channel_name, r.unit.factor, 0.0);
    judge(&row, {Ban::Kind::kPosition, joint, r.channel}, [&](const Assignment& a) {
      const PositionCandidate* p = search_.position(a, joint);
      return p == nullptr ? -1 : p->reading.channel;
    });
    return row;
  }

  MeaningProposal pressure_row(int cylinder, int side) {
    const auto c = static_cast<std::size_t>(cylinder);
    const int column = best_.pairs[c][static_cast<std::size_t>(side)];
    const Meaning meaning{side == 0 ? Role::kPressureA : Role::kPressureB, cylinder};
    const PressureSet& set = search_.pressures();
    if (column < 0) return begun(meaning, -1);
    const ChannelUnit& unit = set.units[static_cast<std::size_t>(column)];
    MeaningProposal row = begun(meaning, set.channels[static_cast<std::size_t>(column)]);
    row.factor = unit.factor;
    row.expression =
        column_times(row.channel_name, unit.factor / units::kBar, unit.offset / units::kBar);
    const bool has_unit =
        data_.units[static_cast<std::size_t>(row.channel)].of == ChannelUnit::Of::kPressure;
    if (!set.open_unit.empty() && !has_unit)
      row.reasons.push_back(fmt::format("values fit in {}", set.open_unit));
    const PositionCandidate* position = search_.position(best_, machine_.cylinders[c].joint);
    bool exchanged = false;
    // where nothing moves every constant follows the static force
    if (position != nullptr && position->moves && parts_[c].speed != nullptr &&
        best_.pairs[c][0] >= 0) {
      const CylinderForces forces(data_, {set, cylinder, forces_, *parts_[c].speed, payload_});
      const ForceFit fit = forces.fit(best_.pairs[c][0], best_.pairs[c][1]);
      const double largest =
          (set.values.col(best_.pairs[c][0]) * machine_.cylinders[c].area_piston())
              .cwiseAbs()
              .maxCoeff();
      if (fit.log_odds > 0.0) {
        row.reasons.push_back(
            fmt::format("{} follows the static force of {} within {:.2g} kN rms (largest chamber "
                        "force {:.3g} kN)",
                        best_.pairs[c][1] >= 0 ? "A pA - B pB" : "A pA", machine_.cylinders[c].name,
                        1e-3 * fit.rms, 1e-3 * largest));
      }
      if (best_.pairs[c][1] >= 0) {
        const ForceFit other = forces.fit(best_.pairs[c][1], best_.pairs[c][0]);
        exchanged = other.log_odds > fit.log_odds + confidence_.decisive;
        if (exchanged)
          row.reasons.push_back(fmt::format(
              "bore and rod side seem to be exchanged: the other way round the force is followed "
              "within {:.2g} kN",
              1e-3 * other.rms));
      }
    }
    judge(&row, {side == 0 ? Ban::Kind::kPressureA : Ban::Kind::kPressureB, cylinder, row.channel},
          [&](const Assignment& a) {
            const int k = a.pairs[c][static_cast<std::size_t>(side)];
            return k < 0 ? -1 : set.channels[static_cast<std::size_t>(k)];
          });
    if (exchanged) row.confidence = std::min(row.confidence, confidence_.resting);
    return row;
  }

  MeaningProposal rest_row(std::size_t r) {
    const Meaning& meaning = search_.rest()[r];
    MeaningProposal row = begun(meaning, best_.rest[r]);
    if (row.channel < 0) return row;
    row.factor = 1.0;
    if (meaning.role == Role::kCommand) {
      explain_command(&row);
    } else if (meaning.role == Role::kPumpPressure || meaning.role == Role::kReturnPressure) {
      explain_supply(&row);
    } else if (meaning.role == Role::kPayload) {
      const PayloadFit fit = fit_payload(data_, search_.pressures(), row.channel, parts_, forces_);
      row.factor = fit.unit.factor;
      row.expression = column_times(row.channel_name, fit.unit.factor, 0.0);
      if (fit.share > 0.0)
        row.reasons.push_back(
            fmt::format("explains {:.0f} % of the force that the masses leave", 100.0 * fit.share));
    } else if (meaning.role == Role::kOilTemperature) {
      const OilFit fit = fit_oil(data_, row.channel);
      row.factor = fit.unit.factor;
      row.expression = column_times(row.channel_name, fit.unit.factor, fit.unit.offset);
      if (fit.slow && fit.within)
        row.reasons.push_back("it is slow and lies among temperatures of oil");
    } else if (meaning.role == Role::kForce) {
      row.factor = data_.units[static_cast<std::size_t>(row.channel)].factor;
      row.expression = column_times(row.channel_name, row.factor, 0.0);
      const double left = force_misfit(data_, row.channel, meaning.index, parts_, forces_);
      if (data_.options.force.log_odds(left) > 0.0) {
        row.reasons.push_back(fmt::format(
            "follows static force, friction and acceleration but for {:.0f} %", 100.0 * left));
      }
    } else {
      explain_copy(&row);
    }
    judge(&row, {Ban::Kind::kRest, static_cast<int>(r), row.channel},
          [&](const Assignment& a) { return a.rest[r]; });
    return row;
  }

  void explain_command(MeaningProposal* row) {
    const int joint = machine_.cylinders[static_cast<std::size_t>(row->meaning.index)].joint;
    const int candidate = best_.positions[static_cast<std::size_t>(joint)];
    if (candidate < 0) {
      row->expression = column_times(
          row->channel_name,
          data_.units[static_cast<std::size_t>(row->channel)].of == ChannelUnit::Of::kShare
              ? data_.units[static_cast<std::size_t>(row->channel)].factor
              : 1.0,
          0.0);
      return;
    }
    const CommandFit& fit = search_.command_fit(joint, candidate, row->channel);
    if (fit.log_odds > 0.0) {
      row->reasons.push_back(fmt::format("explains {:.0f} % of the rod speed, {:.1f} s later",
                                         100.0 * (1.0 - fit.misfit * fit.misfit),
                                         fit.lag * data_.samples.step));
    }
    if (fit.log_odds > 0.0 && fit.sign < 0.0) row->reasons.push_back("its sign is reversed");
    std::string scale;
    row->expression = command_expression(data_, row->channel, row->meaning.index, fit, &scale);
    row->reasons.push_back(scale);
  }

  void explain_supply(MeaningProposal* row) {
    const PressureSet& set = search_.pressures();
    const auto place = std::find(set.channels.begin(), set.channels.end(), row->channel);
    const auto k = place - set.channels.begin();
    const ChannelUnit& unit = set.units[static_cast<std::size_t>(k)];
    row->factor = unit.factor;
    row->expression =
        column_times(row->channel_name, unit.factor / units::kBar, unit.offset / units::kBar);
    if (row->meaning.role == Role::kReturnPressure) return;
    const VectorXd working = largest_working_pressure(data_, set, parts_, row->meaning.index);
    const PumpFit fit = fit_pump(data_, set.values.col(k), row->meaning.index, working);
    if (fit.spread > 0.0) {
      row->reasons.push_back(
          fmt::format("at least the largest working pressure in {:.0f} % of the moving time, "
                      "{:.3g} bar above it in the median",
                      100.0 * fit.above, fit.margin / units::kBar));
    }
  }

  void explain_copy(MeaningProposal* row) {
    const Meaning& m = row->meaning;
    const bool of_joint = m.role == Role::kJointPosition;
    const int joint =
        of_joint ? m.index : machine_.cylinders[static_cast<std::size_t>(m.index)].joint;
    const PositionCandidate* p = search_.position(best_, joint);
    if (p == nullptr) {
      row->factor = possible_units(m, machine_).front().factor;
      row->expression = column_times(row->channel_name, row->factor, 0.0);
      return;
    }
    CopyFit fit;
    if (m.role == Role::kFlow) {
      fit = fit_flow(data_, row->channel, m.index, p->speed);
      row->reasons.push_back(
          fmt::format("area times rod speed leaves {:.0f} % of it", 100.0 * fit.misfit));
      row->factor = fit.factor;
      row->expression = column_times(row->channel_name, fit.factor / units::kLitrePerMinute, 0.0);
      if (data_.shape(row->channel).low < -0.05 * data_.shape(row->channel).high)
        row->expression = fmt::format("abs({})", row->expression);
      return;
    }
    if (m.kind == MeaningKind::kSpeed) {
      fit = fit_speed(data_, row->channel, m,
                      of_joint ? rate_of_change(data_.samples, p->position) : p->speed);
      row->reasons.push_back(fmt::format("it is the derivative of {} but for {:.0f} %",
                                         data_.name(p->reading.channel), 100.0 * fit.misfit));
    } else {
      fit = fit_copy(data_, row->channel, m,
                     of_joint ? p->position : stroke_of(machine_, joint, p->position));
      row->reasons.push_back(fmt::format("follows from {} by the linkage but for {:.0f} %",
                                         data_.name(p->reading.channel), 100.0 * fit.misfit));
    }
    row->factor = fit.factor;
    row->expression = column_times(row->channel_name, fit.factor, 0.0);
  }

  const ProposalData& data_;
  const Machine& machine_;
  ProposalSearch& search_;
  const Assignment& best_;
  ConfidenceOptions confidence_;
  StaticForces forces_;
  std::vector<ProposedCylinder> parts_;
  Eigen::MatrixXd payload_;  ///< [instants x 0 or 1] values of the proposed payload
};

}  // namespace

MappingProposal propose_mapping(const TimedChannels& file, const Machine& machine,
                                const ProposalOptions& options) {
  MappingProposal out;
  out.unsure_below = options.confidence.unsure_below;
  if (!file.clock.empty()) {
    out.clock = file.clock;
    out.clock_expression = column_times(file.clock, file.clock_unit, 0.0);
  }
  const ProposalData data = proposal_data(file, machine, options.words, options.evidence);
  std::unique_ptr<ProposalSearch> best;
  for (PressureSet& set : pressure_sets(data, options.pressures)) {
    auto search = std::make_unique<ProposalSearch>(data, std::move(set), options);
    if (best == nullptr || search->best().total > best->best().total) best = std::move(search);
  }
  out.meanings = ProposalRows(data, best.get(), options.confidence).rows();
  const std::size_t channels = file.recording.channels.size();
  std::vector<bool> taken(channels, false);
  for (const MeaningProposal& m : out.meanings) {
    if (m.channel >= 0) taken[static_cast<std::size_t>(m.channel)] = true;
  }
  for (std::size_t m = 0; m < channels; ++m) {
    if (!taken[m]) out.left_over.push_back(file.recording.channels[m].name);
  }
  if (data.considered.size() < channels) {
    out.notes.push_back(
        fmt::format("{} of {} channels were considered: the others have too few values, or names "
                    "and units that say least",
                    data.considered.size(), channels));
  }
  return out;
}

}  // namespace sparflow
