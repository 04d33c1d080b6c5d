#include "identification/mapping_proposal/proposal_search.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "models/machine/linkage.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Pairs of pressures of a cylinder among which the search chooses.
/// @threshold [1] 5..200; chosen: all pairs of the channels of its own motion
constexpr std::size_t kPairs = 40;
/// Sets of pairs that are judged with pump, flows and commands.
/// @threshold [1] 1..10; chosen: they differ in the cylinder that is least clear
constexpr std::size_t kPairSets = 2;
/// Joints or cylinders up to which all combinations are searched; of larger machines each part is judged for itself.
/// @threshold [1] 2..12; numerical: the search grows exponentially where many channels are alike
constexpr int kSearchedParts = 8;

bool direct_linkage(const Machine& machine, int cylinder) {
  return std::holds_alternative<DirectLinkage>(
      machine.cylinders[static_cast<std::size_t>(cylinder)].linkage);
}

std::vector<Meaning> rest_meanings(const Machine& machine) {
  std::vector<Meaning> rest;
  rest.reserve(static_cast<std::size_t>(5 * machine.cylinder_count() + machine.joint_count() +
                                        machine.pump_count() + 3));
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    rest.push_back({Role::kCommand, c});
    rest.push_back(
        {machine.cylinders[static_cast<std::size_t>(c)].hydraulic() ? Role::kFlow : Role::kForce,
         c});
    if (direct_linkage(machine, c)) continue;
    rest.push_back({Role::kStroke, c});
    rest.push_back({Role::kStroke, c, MeaningKind::kSpeed});
  }
  for (int j = 0; j < machine.joint_count(); ++j) {
    rest.push_back({Role::kJointPosition, j});
    rest.push_back({Role::kJointPosition, j, MeaningKind::kSpeed});
  }
  for (int p = 0; p < machine.pump_count(); ++p) rest.push_back({Role::kPumpPressure, p});
  for (const Role role : {Role::kReturnPressure, Role::kPayload, Role::kOilTemperature}) {
    rest.push_back({role, -1});
  }
  return rest;
}

/// Score of what must not be chosen, whatever else speaks for it.
// no threshold: below any sum of evidence
constexpr double kNeverTaken = -1e6;

/// A joint's channel, a reading of it in `second` so that each reading is a column of its own.
constexpr int kReadings = 1000;

}  // namespace

VectorXd stroke_of(const Machine& machine, int joint, const VectorXd& position) {
  const int cylinder = machine.cylinder_of_joint(joint);
  const Range& range = machine.joints[static_cast<std::size_t>(joint)].position;
  return position.unaryExpr(
      [&](double q) { return stroke_at(machine, cylinder, std::clamp(q, range.lo, range.hi)); });
}

ProposalSearch::ProposalSearch(const ProposalData& data, PressureSet pressures,
                               const ProposalOptions& options)
    : data_(data),
      pressures_(std::move(pressures)),
      options_(options),
      rest_(rest_meanings(*data.machine)) {
  const Machine& machine = *data_.machine;
  for (int j = 0; j < machine.joint_count(); ++j) {
    candidates_.push_back(position_candidates(data_, j, options_.positions));
    std::vector<VectorXd> activity;
    for (const PositionCandidate& c : candidates_.back())
      activity.push_back(activity_scores(data_, pressures_, c.speed, options_.pressures));
    activity_.push_back(std::move(activity));
  }
  said_.resize(static_cast<Eigen::Index>(rest_.size()), data_.samples.values.cols());
  for (std::size_t r = 0; r < rest_.size(); ++r) {
    for (const int m : data_.considered)
      said_(static_cast<Eigen::Index>(r), m) = data_.said(m, rest_[r], nullptr);
  }
  const std::vector<int> payloads = payload_channels(data_, options_.pressures);
  payloads_.resize(data_.samples.instants(), static_cast<Eigen::Index>(payloads.size()));
  for (std::size_t k = 0; k < payloads.size(); ++k) {
    payloads_.col(static_cast<Eigen::Index>(k)) = data_.samples.values.col(payloads[k]);
  }
  const int affordable = std::max(1, options_.affordable_sets / std::max(1, machine.joint_count()));
  for (const std::vector<int>& set :
       position_sets({}, std::min(options_.position_sets, affordable))) {
    JudgedSet judged = judge(set);
    if (judged.best.total > best_.total) best_ = judged.best;
    const auto place = std::upper_bound(
        kept_.begin(), kept_.end(), judged,
        [](const JudgedSet& a, const JudgedSet& b) { return a.best.total > b.best.total; });
    kept_.insert(place, std::move(judged));
    if (kept_.size() > static_cast<std::size_t>(options_.kept_sets)) kept_.pop_back();
  }
}

const PositionCandidate* ProposalSearch::position(const Assignment& a, int joint) const {
  const int k = a.positions[static_cast<std::size_t>(joint)];
  return k < 0 ? nullptr
               : &candidates_[static_cast<std::size_t>(joint)][static_cast<std::size_t>(k)];
}

std::vector<std::vector<int>> ProposalSearch::position_sets(const Ban& ban, int count) const {
  const std::size_t joints = candidates_.size();
  std::vector<std::vector<ColumnPair>> groups(joints);
  for (std::size_t j = 0; j < joints; ++j) {
    groups[j].push_back({-1, -1, -options_.positions.missing});
    for (std::size_t k = 0; k < candidates_[j].size(); ++k) {
      const ChannelReading& r = candidates_[j][k].reading;
      if (ban.kind == Ban::Kind::kPosition && ban.index == static_cast<int>(j) &&
          ban.channel == r.channel)
        continue;
      const int id = 1'000'000 + static_cast<int>(j) * kReadings + static_cast<int>(k);
      groups[j].push_back({r.channel, id, r.score});
    }
  }
  std::vector<PairSet> sets;
  if (joints <= static_cast<std::size_t>(kSearchedParts)) {
    sets =
        best_pair_sets(groups, static_cast<std::size_t>(std::max(1, count)), options_.pair_search);
  } else {
    sets.push_back(greedy_pairs(groups));
  }
  std::vector<std::vector<int>> out;
  out.reserve(sets.size());
  for (const PairSet& set : sets) {
    std::vector<int> positions;
    positions.reserve(joints);
    for (const ColumnPair& p : set.pairs)
      positions.push_back(p.second < 0 ? -1 : p.second % kReadings);
    out.push_back(std::move(positions));
  }
  return out;
}

StaticForces ProposalSearch::forces(const Assignment& a) const {
  const Machine& machine = *data_.machine;
  MatrixXd q(data_.samples.instants(), machine.joint_count());
  for (int j = 0; j < machine.joint_count(); ++j) {
    const PositionCandidate* c = position(a, j);
    const Range& range = machine.joints[static_cast<std::size_t>(j)].position;
    if (c != nullptr) {
      q.col(j) = c->position;
    } else {
      q.col(j).setConstant(0.5 * (range.lo + range.hi));
    }
  }
  return forces_along(machine, q);
}

std::vector<ProposedCylinder> ProposalSearch::cylinders(const Assignment& a) const {
  const Machine& machine = *data_.machine;
  std::vector<ProposedCylinder> all(static_cast<std::size_t>(machine.cylinder_count()));
  for (std::size_t c = 0; c < all.size(); ++c) {
    const PositionCandidate* p = position(a, machine.cylinders[c].joint);
    all[c].speed = p == nullptr ? nullptr : &p->speed;
    all[c].a = a.pairs[c][0];
    all[c].b = a.pairs[c][1];
  }
  return all;
}

std::vector<ColumnPair> ProposalSearch::pair_candidates(const JudgedSet& set, int cylinder) {
  const Cylinder& c = data_.machine->cylinders[static_cast<std::size_t>(cylinder)];
  std::vector<ColumnPair> pairs = {{-1, -1, 0.0}};
  const int n = static_cast<int>(pressures_.values.cols());
  if (!c.hydraulic() || n == 0) return pairs;
  const auto joint = static_cast<std::size_t>(c.joint);
  const int k = set.positions[joint];
  const PositionCandidate* position =
      k < 0 ? nullptr : &candidates_[joint][static_cast<std::size_t>(k)];
  VectorXd a = pressures_.said_a.col(cylinder), b = pressures_.said_b.col(cylinder);
  for (int i = 0; i < n; ++i) {
    const double own =
        pressures_.range_score[static_cast<std::size_t>(i)] +
        (position == nullptr ? 0.0 : activity_[joint][static_cast<std::size_t>(k)][i]);
    a[i] += own;
    b[i] += own;
    // A channel that is already a position is no pressure.
    for (std::size_t j = 0; j < set.positions.size(); ++j) {
      const int p = set.positions[j];
      if (p >= 0 && candidates_[j][static_cast<std::size_t>(p)].reading.channel ==
                        pressures_.channels[static_cast<std::size_t>(i)])
        a[i] = b[i] = kNeverTaken;
    }
  }
  const ChannelEvidenceOptions& o = options_.evidence;
  if (position == nullptr) {
    for (int i = 0; i < n; ++i) {
      pairs.push_back({i, -1, a[i] - o.single_chamber.price});
      pairs.push_back({-1, i, b[i] - o.single_chamber.price});
      for (int m = 0; m < n; ++m) {
        if (m != i) pairs.push_back({i, m, a[i] + b[m] - 2.0 * o.single_chamber.price});
      }
    }
  } else {
    const CylinderForces forces(
        data_, {pressures_, cylinder, set.forces, position->speed, payloads_}, options_.pressures);
    for (int i = 0; i < n; ++i) {
      pairs.push_back({i, -1, a[i] + forces.fit(i, -1).log_odds});
      pairs.push_back({-1, i, b[i] - o.single_chamber.price});
      for (int m = 0; m < n; ++m) {
        if (m != i) pairs.push_back({i, m, a[i] + b[m] + forces.fit(i, m).log_odds});
      }
    }
  }
  std::erase_if(pairs, [](const ColumnPair& p) { return p.score < 0.0; });
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const ColumnPair& x, const ColumnPair& y) { return x.score > y.score; });
  if (std::none_of(pairs.begin(), pairs.end(),
                   [](const ColumnPair& p) { return p.first < 0 && p.second < 0; }))
    pairs.push_back({-1, -1, 0.0});
  return pairs;
}

ProposalSearch::JudgedSet ProposalSearch::judge(const std::vector<int>& positions) {
  JudgedSet set;
  set.positions = positions;
  for (std::size_t j = 0; j < positions.size(); ++j) {
    set.position_score +=
        positions[j] < 0 ? -options_.positions.missing
                         : candidates_[j][static_cast<std::size_t>(positions[j])].reading.score;
  }
  Assignment a;
  a.positions = positions;
  set.forces = forces(a);
  const int cylinders = data_.machine->cylinder_count();
  set.pairs.reserve(static_cast<std::size_t>(cylinders));
  for (int c = 0; c < cylinders; ++c) set.pairs.push_back(pair_candidates(set, c));
  set.best = solve(set, {});
  return set;
}

std::vector<std::vector<ColumnPair>> ProposalSearch::allowed_pairs(const JudgedSet& set,
                                                                   const Ban& ban) const {
  const bool of_pressure = ban.kind == Ban::Kind::kPressureA || ban.kind == Ban::Kind::kPressureB;
  std::vector<std::vector<ColumnPair>> groups(set.pairs.size());
  for (std::size_t c = 0; c < groups.size(); ++c) {
    const bool banned = of_pressure && ban.index == static_cast<int>(c);
    groups[c].reserve(kPairs + 1);
    for (const ColumnPair& p : set.pairs[c]) {
      const bool empty = p.first < 0 && p.second < 0;
      if (groups[c].size() >= kPairs && !empty) continue;
      const int column = ban.kind == Ban::Kind::kPressureA ? p.first : p.second;
      if (banned && column >= 0 &&
          pressures_.channels[static_cast<std::size_t>(column)] == ban.channel)
        continue;
      groups[c].push_back(p);
    }
  }
  return groups;
}

Assignment ProposalSearch::solve(JudgedSet& set, const Ban& ban) {
  if (options_.progress) options_.progress();
  const std::vector<std::vector<ColumnPair>> groups = allowed_pairs(set, ban);
  const std::vector<PairSet> pair_sets =
      groups.size() <= static_cast<std::size_t>(kSearchedParts)
          ? best_pair_sets(groups, kPairSets, options_.pair_search)
          : std::vector<PairSet>{greedy_pairs(groups)};
  Assignment best;
  for (const PairSet& pairs : pair_sets) {
    Assignment a;
    a.positions = set.positions;
    a.pairs.reserve(pairs.pairs.size());
    std::set<int> used;
    for (const ColumnPair& p : pairs.pairs) {
      a.pairs.push_back({p.first, p.second});
      for (const int column : {p.first, p.second}) {
        if (column >= 0) used.insert(pressures_.channels[static_cast<std::size_t>(column)]);
      }
    }
    for (int j = 0; j < data_.machine->joint_count(); ++j) {
      if (const PositionCandidate* c = position(a, j)) used.insert(c->reading.channel);
    }
    std::vector<int> free;
    free.reserve(data_.considered.size());
    for (const int m : data_.considered) {
      if (used.count(m) == 0) free.push_back(m);
    }
    MatrixXd score = rest_scores(set, a, free);
    if (ban.kind == Ban::Kind::kRest) {
      for (std::size_t m = 0; m < free.size(); ++m) {
        if (free[m] == ban.channel) score(ban.index, static_cast<Eigen::Index>(m)) = -1.0;
      }
    }
    double total = 0.0;
    const std::vector<int> taken = best_assignment(score, &total);
    a.total = set.position_score + pairs.total + total;
    if (a.total <= best.total) continue;
    a.rest.reserve(rest_.size());
    for (const int m : taken) a.rest.push_back(m < 0 ? -1 : free[static_cast<std::size_t>(m)]);
    best = std::move(a);
  }
  return best;
}

MatrixXd ProposalSearch::rest_scores(JudgedSet& set, const Assignment& a,
                                     const std::vector<int>& free) {
  MatrixXd score(static_cast<Eigen::Index>(rest_.size()), static_cast<Eigen::Index>(free.size()));
  const std::vector<ProposedCylinder> parts = cylinders(a);
  for (std::size_t r = 0; r < rest_.size(); ++r) {
    const Meaning& meaning = rest_[r];
    const auto row = static_cast<Eigen::Index>(r);
    const bool supply =
        meaning.role == Role::kPumpPressure || meaning.role == Role::kReturnPressure;
    const VectorXd working = meaning.role == Role::kPumpPressure
                                 ? largest_working_pressure(data_, pressures_, parts, meaning.index)
                                 : VectorXd();
    for (std::size_t m = 0; m < free.size(); ++m) {
      const int channel = free[m];
      double fit = 0.0;
      if (supply) {
        fit = supply_score(meaning, channel, working, parts);
      } else if (meaning.role == Role::kPayload) {
        fit = fit_payload(data_, pressures_, channel, parts, set.forces).log_odds;
      } else if (meaning.role == Role::kOilTemperature) {
        fit = fit_oil(data_, channel).log_odds;
      } else if (meaning.role == Role::kForce) {
        fit = force_score(set, parts, meaning.index, channel);
      } else {
        fit = motion_score(a, meaning, channel);
      }
      score(row, static_cast<Eigen::Index>(m)) = said_(row, channel) + fit;
    }
  }
  return score;
}

double ProposalSearch::supply_score(const Meaning& meaning, int channel, const VectorXd& working,
                                    const std::vector<ProposedCylinder>& parts) {
  const auto place = std::find(pressures_.channels.begin(), pressures_.channels.end(), channel);
  if (place == pressures_.channels.end()) return kNeverTaken;  // it has no reading as a pressure
  const auto k = place - pressures_.channels.begin();
  const VectorXd pressure = pressures_.values.col(k);
  const double range = pressures_.range_score[static_cast<std::size_t>(k)];
  if (meaning.role == Role::kReturnPressure)
    return std::max(range, -1.0) + return_log_odds(data_, pressure, parts);
  return range + fit_pump(data_, pressure, meaning.index, working).log_odds;
}

double ProposalSearch::force_score(JudgedSet& set, const std::vector<ProposedCylinder>& parts,
                                   int cylinder, int channel) {
  const auto [score, is_new] = set.force_scores.try_emplace({cylinder, channel}, 0.0);
  if (is_new) {
    score->second =
        options_.evidence.force.log_odds(force_misfit(data_, channel, cylinder, parts, set.forces));
  }
  return score->second;
}

double ProposalSearch::motion_score(const Assignment& a, const Meaning& meaning, int channel) {
  const Machine& machine = *data_.machine;
  const bool of_joint = meaning.role == Role::kJointPosition;
  const int joint =
      of_joint ? meaning.index : machine.cylinders[static_cast<std::size_t>(meaning.index)].joint;
  const PositionCandidate* position_of = position(a, joint);
  if (position_of == nullptr) return -options_.evidence.command.price;
  const int candidate = a.positions[static_cast<std::size_t>(joint)];
  if (meaning.role == Role::kCommand) return command_fit(joint, candidate, channel).log_odds;
  const std::array<int, 5> key = {static_cast<int>(meaning.role), static_cast<int>(meaning.kind),
                                  joint, candidate, channel};
  const auto known = motions_.find(key);
  if (known != motions_.end()) return known->second;
  double odds = 0.0;
  if (meaning.role == Role::kFlow) {
    odds = fit_flow(data_, channel, meaning.index, position_of->speed).log_odds;
  } else if (meaning.kind == MeaningKind::kSpeed) {
    const VectorXd rate =
        of_joint ? rate_of_change(data_.samples, position_of->position) : position_of->speed;
    odds = fit_speed(data_, channel, meaning, rate).log_odds;
  } else if (of_joint != position_of->reading.stroke ||
             direct_linkage(machine, machine.cylinder_of_joint(joint))) {
    odds = -2.0 * options_.positions.outside;  // it has this meaning already
  } else {
    const VectorXd expected =
        of_joint ? position_of->position : stroke_of(machine, joint, position_of->position);
    odds = fit_copy(data_, channel, meaning, expected).log_odds;
  }
  motions_.emplace(key, odds);
  return odds;
}

const CommandFit& ProposalSearch::command_fit(int joint, int candidate, int channel) {
  const std::array<int, 3> key = {joint, candidate, channel};
  const auto known = commands_.find(key);
  if (known != commands_.end()) return known->second;
  return commands_
      .emplace(
          key,
          fit_command(
              data_, channel,
              candidates_[static_cast<std::size_t>(joint)][static_cast<std::size_t>(candidate)]))
      .first->second;
}

double ProposalSearch::margin(const Ban& ban, Assignment* other) {
  Assignment next;
  const auto offer = [&](Assignment a) {
    if (a.total > next.total) next = std::move(a);
  };
  if (ban.kind == Ban::Kind::kPosition) {
    const auto banned = [&](const std::vector<int>& positions) {
      const int k = positions[static_cast<std::size_t>(ban.index)];
      return k >= 0 && candidates_[static_cast<std::size_t>(ban.index)][static_cast<std::size_t>(k)]
                               .reading.channel == ban.channel;
    };
    bool found = false;
    for (const JudgedSet& set : kept_) {
      if (banned(set.positions)) continue;
      found = true;
      offer(set.best);
    }
    if (!found) {
      for (const std::vector<int>& positions : position_sets(ban, options_.kept_sets))
        offer(judge(positions).best);
    }
  } else {
    for (JudgedSet& set : kept_) {
      if (set.best.total > next.total) offer(solve(set, ban));
    }
  }
  const double loss = std::max(0.0, best_.total - next.total);
  if (other != nullptr) *other = std::move(next);
  return loss;
}

}  // namespace sparflow
