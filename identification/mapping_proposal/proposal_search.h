#pragma once
/// The best assignment of all channels at once: positions first, pressures given them, everything else given both.
#include <array>
#include <map>
#include <memory>
#include <vector>

#include "identification/mapping_proposal/evidence/motion_evidence.h"
#include "identification/mapping_proposal/evidence/supply_evidence.h"
#include "identification/mapping_proposal/mapping_proposal.h"

namespace sparflow {

/// A choice for every meaning. Indices of candidates, columns of the pressure set, and channels; -1 = none.
struct Assignment {
  std::vector<int> positions;             ///< by joint, of its candidates
  std::vector<std::array<int, 2>> pairs;  ///< by cylinder, columns of the pressure set
  std::vector<int> rest;                  ///< by rest(), channels
  double total = -1e300;                  ///< [nat]
};

/// A meaning that is kept from its channel, to find the next best assignment.
struct Ban {
  enum class Kind { kNone, kPosition, kPressureA, kPressureB, kRest };
  Kind kind = Kind::kNone;
  int index = -1;    ///< joint, cylinder, or number in rest()
  int channel = -1;  ///< in the recording
};

class ProposalSearch {
 public:
  /// @param data must outlive this object
  ProposalSearch(const ProposalData& data, PressureSet pressures, const ProposalOptions& options);

  const Assignment& best() const { return best_; }
  /// @return loss of the best other assignment [nat], never negative
  double margin(const Ban& ban, Assignment* other = nullptr);

  /// Meanings beside positions and chamber pressures.
  const std::vector<Meaning>& rest() const { return rest_; }
  const PressureSet& pressures() const { return pressures_; }
  const std::vector<PositionCandidate>& candidates(int joint) const {
    return candidates_[static_cast<std::size_t>(joint)];
  }
  const PositionCandidate* position(const Assignment& a, int joint) const;
  const CommandFit& command_fit(int joint, int candidate, int channel);
  /// What the physics needs at a set of positions, for the sentences too.
  StaticForces forces(const Assignment& a) const;
  std::vector<ProposedCylinder> cylinders(const Assignment& a) const;

 private:
  struct JudgedSet {
    std::vector<int> positions;
    double position_score = 0.0;
    StaticForces forces;
    std::vector<std::vector<ColumnPair>>
        pairs;  ///< all that are worth more than nothing, by cylinder, best first
    std::map<std::array<int, 2>, double> force_scores;  ///< by cylinder and channel
    Assignment best;
  };
  std::vector<std::vector<int>> position_sets(const Ban& ban, int count) const;
  JudgedSet judge(const std::vector<int>& positions);
  std::vector<ColumnPair> pair_candidates(const JudgedSet& set, int cylinder);
  /// The best candidates of each cylinder without those that are banned.
  std::vector<std::vector<ColumnPair>> allowed_pairs(const JudgedSet& set, const Ban& ban) const;
  /// @param set its cache of force scores grows
  Assignment solve(JudgedSet& set, const Ban& ban);
  /// [rest x free] log-odds of each meaning beside positions and chamber pressures for each channel that is left.
  Eigen::MatrixXd rest_scores(JudgedSet& set, const Assignment& a, const std::vector<int>& free);
  double supply_score(const Meaning& meaning, int channel, const Eigen::VectorXd& working,
                      const std::vector<ProposedCylinder>& parts);
  double force_score(JudgedSet& set, const std::vector<ProposedCylinder>& parts, int cylinder,
                     int channel);
  double motion_score(const Assignment& a, const Meaning& meaning, int channel);

  const ProposalData& data_;
  PressureSet pressures_;
  ProposalOptions options_;
  std::vector<std::vector<PositionCandidate>> candidates_;
  std::vector<std::vector<Eigen::VectorXd>> activity_;  ///< by joint and candidate [n]
  Eigen::MatrixXd payloads_;
  std::vector<Meaning> rest_;
  Eigen::MatrixXd said_;  ///< [rest x channels] names and units
  std::map<std::array<int, 3>, CommandFit> commands_;
  std::map<std::array<int, 5>, double> motions_;
  std::vector<JudgedSet> kept_;
  Assignment best_;
};

/// [instants] stroke of a joint's cylinder.
Eigen::VectorXd stroke_of(const Machine& machine, int joint, const Eigen::VectorXd& position);

}  // namespace sparflow
