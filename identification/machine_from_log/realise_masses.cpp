#include "identification/machine_from_log/realise_masses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "identification/machine_from_log/linkage_plane.h"
#include "identification/machine_from_log/weighted_fit.h"
#include "models/math/linear_algebra.h"

namespace sparflow::from_log {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Places of a centre of mass along its link that are tried, from the convention on.
/// @threshold [1] 0..3; chosen: half way first, then away from it
constexpr double kPlaces[] = {0.5, 0.45, 0.55, 0.4, 0.6, 0.65, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5};
/// Farthest centre of mass, as multiple of the link's length.
/// @threshold [1] 1..10; chosen: counterweights and buckets lie beyond their link
constexpr double kFarthest = 2.0;
/// Share of the largest coefficient below which a term of a combination is not named.
/// @threshold [1] 1e-6..0.1; chosen: rounding of what is written
constexpr double kNamed = 1e-3;

struct Indices {
  Index mass = -1;
  Index moment = -1;  ///< the first of three
};

std::vector<Indices> indices_of(const Machine& machine, const std::vector<MassUnknown>& unknowns) {
  std::vector<Indices> list(machine.links.size());
  for (std::size_t u = 0; u < unknowns.size(); ++u) {
    Indices& at = list[static_cast<std::size_t>(unknowns[u].link)];
    if (unknowns[u].axis < 0) at.mass = static_cast<Index>(u);
    if (unknowns[u].axis == 0) at.moment = static_cast<Index>(u);
  }
  return list;
}

/// Size of a link [m], by which centres of mass are judged.
double length_of(const Machine& machine, const Link& link) {
  constexpr double kShortestLink = 0.5;  // no threshold: a joint without a next one
  return link.joint < 0 ? kShortestLink
                        : std::max(to_next_joint(machine, link.joint).norm(), kShortestLink);
}

Eigen::Vector3d direction_of(const Machine& machine, const Link& link) {
  Eigen::Vector3d to = link.joint < 0 ? Eigen::Vector3d(Eigen::Vector3d::UnitX())
                                      : to_next_joint(machine, link.joint);
  if (to.norm() < 1e-6) to = Eigen::Vector3d::UnitX() * length_of(machine, link);
  return to;
}

/// The solution whose centres lie nearest to `place` along their links.
VectorXd solution_at(const Machine& machine, const std::vector<Indices>& links, const LoadFit& fit,
                     double place) {
  const Index unknowns = fit.masses.size();
  if (fit.free.cols() == 0) return fit.masses;
  std::vector<VectorXd> rows;
  std::vector<double> wanted;
  for (std::size_t l = 0; l < links.size(); ++l) {
    const Link& link = machine.links[l];
    const Eigen::Vector3d to = place * direction_of(machine, link);
    if (links[l].moment < 0) {
      // A mass that no row determines stays small.
      if (links[l].mass >= 0) {
        rows.push_back(1e-3 * VectorXd::Unit(unknowns, links[l].mass));
        wanted.push_back(0.0);
      }
      continue;
    }
    for (int axis = 0; axis < 3; ++axis) {
      VectorXd row = VectorXd::Unit(unknowns, links[l].moment + axis);
      if (links[l].mass >= 0) row[links[l].mass] = -to[axis];
      rows.push_back(row);
      wanted.push_back(links[l].mass >= 0 ? 0.0 : link.mass * to[axis]);
    }
  }
  MatrixXd target(static_cast<Index>(rows.size()), unknowns);
  for (std::size_t r = 0; r < rows.size(); ++r)
    target.row(static_cast<Index>(r)) = rows[r].transpose();
  const VectorXd miss =
      VectorXd::Map(wanted.data(), static_cast<Index>(wanted.size())) - target * fit.masses;
  return fit.masses + fit.free * least_squares_of_least_norm(target * fit.free, miss);
}

bool possible(const Machine& machine, const std::vector<Indices>& links, const VectorXd& masses) {
  for (std::size_t l = 0; l < links.size(); ++l) {
    const Link& link = machine.links[l];
    const double mass = links[l].mass >= 0 ? masses[links[l].mass] : link.mass;
    if (links[l].mass >= 0 && !(mass >= 0.0)) return false;
    if (links[l].moment < 0) continue;
    const double moment = masses.segment(links[l].moment, 3).norm();
    if (moment > kFarthest * length_of(machine, link) * mass + 1e-9) return false;
  }
  return true;
}

std::string name_of(const Machine& machine, const MassUnknown& u) {
  const Link& link = machine.links[static_cast<std::size_t>(u.link)];
  if (u.axis < 0) return fmt::format("mass of {}", link.name);
  return fmt::format("mass x {} of {}", "xyz"[u.axis], link.name);
}

/// Base parameters: each unknown that the rows determine together with multiples of those that they leave free.
/// @return by link: whether one of its unknowns is determined so
std::vector<bool> name_combinations(const Machine& machine,
                                    const std::vector<MassUnknown>& unknowns,
                                    const std::vector<LoadRows>& loads, const LoadFit& fit,
                                    RealisedMasses& out) {
  const Index n = fit.masses.size(), free = fit.free.cols();
  // Which unknowns are expressed by the others: masses first, which are what the convention chooses.
  MatrixXd basis = fit.free;
  std::vector<Index> dependent;
  std::vector<bool> taken(static_cast<std::size_t>(n), false);
  for (Index k = 0; k < free; ++k) {
    Index best = -1;
    for (Index u = 0; u < n; ++u) {
      if (taken[static_cast<std::size_t>(u)]) continue;
      const bool mass = unknowns[static_cast<std::size_t>(u)].axis < 0;
      const double size = basis.row(u).tail(free - k).norm() * (mass ? 1e3 : 1.0);
      const double most = best < 0
                              ? 0.0
                              : basis.row(best).tail(free - k).norm() *
                                    (unknowns[static_cast<std::size_t>(best)].axis < 0 ? 1e3 : 1.0);
      if (size > most) best = u;
    }
    if (best < 0) break;
    taken[static_cast<std::size_t>(best)] = true;
    dependent.push_back(best);
    // Eliminates that row from the remaining columns.
    Index pivot = k;
    for (Index c = k; c < free; ++c) {
      if (std::abs(basis(best, c)) > std::abs(basis(best, pivot))) pivot = c;
    }
    basis.col(k).swap(basis.col(pivot));
    for (Index c = k + 1; c < free; ++c)
      basis.col(c) -= basis(best, c) / basis(best, k) * basis.col(k);
  }
  const auto d = static_cast<Index>(dependent.size());
  MatrixXd square(d, free);
  for (Index k = 0; k < d; ++k)
    square.row(k) = fit.free.row(dependent[static_cast<std::size_t>(k)]);
  Index rows = 0;
  for (std::size_t i = 0; i < loads.size(); ++i) rows += fit.used[i] ? loads[i].rows() : 0;
  std::vector<bool> told(machine.links.size(), false);
  for (Index u = 0; u < n; ++u) {
    if (taken[static_cast<std::size_t>(u)]) continue;
    told[static_cast<std::size_t>(unknowns[static_cast<std::size_t>(u)].link)] = true;
    VectorXd weights = VectorXd::Unit(n, u);
    std::string name = name_of(machine, unknowns[static_cast<std::size_t>(u)]);
    if (d > 0) {
      const VectorXd others =
          least_squares_of_least_norm(square.transpose(), fit.free.row(u).transpose());
      for (Index k = 0; k < d; ++k) {
        const Index other = dependent[static_cast<std::size_t>(k)];
        weights[other] = -others[k];
        if (std::abs(others[k]) < kNamed) continue;
        name += fmt::format(" {} {:.4g} x {}", others[k] < 0.0 ? "+" : "-", std::abs(others[k]),
                            name_of(machine, unknowns[static_cast<std::size_t>(other)]));
      }
    }
    std::vector<MassTerm> terms;
    for (Index k = 0; k < n; ++k) {
      const MassUnknown& unknown = unknowns[static_cast<std::size_t>(k)];
      if (weights[k] != 0.0) terms.push_back({unknown.link, unknown.axis, weights[k]});
    }
    out.combinations.push_back({name, weights.dot(fit.masses), fit.half_of(weights),
                                unknowns[static_cast<std::size_t>(u)].axis < 0 ? "kg" : "kg m",
                                fmt::format("pressures and static forces, {} rows", rows), "",
                                std::move(terms)});
  }
  return told;
}

/// Names of the cylinders whose rows took part.
std::string used_cylinders(const Machine& machine, const LoadFit& fit) {
  std::string used;
  for (std::size_t i = 0; i < fit.used.size(); ++i) {
    if (fit.used[i]) used += (used.empty() ? "" : ", ") + machine.cylinders[i].name;
  }
  return used;
}

/// Asks for links on which no row depends.
void ask_for_idle_links(const Known& known, const std::vector<LoadRows>& loads, const LoadFit& fit,
                        const std::string& obstacle, RealisedMasses& out) {
  const MachineSketch& sketch = known.sketch;
  const Machine& machine = known.machine;
  const std::vector<Indices> links = indices_of(machine, mass_unknowns(sketch));
  const std::string used = used_cylinders(machine, fit);
  for (std::size_t l = 0; l < links.size(); ++l) {
    if (links[l].mass < 0 && links[l].moment < 0) continue;
    double effect = 0.0;
    bool any = false;
    for (std::size_t i = 0; i < loads.size(); ++i) {
      if (!fit.used[i] || loads[i].rows() == 0) continue;
      any = true;
      if (links[l].mass >= 0) effect += loads[i].masses.col(links[l].mass).norm();
      if (links[l].moment >= 0) effect += loads[i].masses.middleCols(links[l].moment, 3).norm();
    }
    if (effect > 1e-6) continue;
    const std::string& name = machine.links[l].name;
    for (const OpenValue& v : sketch.open) {
      if (v.part != static_cast<int>(l) || v.kind > OpenKind::kCog) continue;
      out.questions.push_back(
          {v.path,
           any ? fmt::format(
                     "no force that could be used depends on it (used: {}); answer what is asked "
                     "about the cylinders that carry {}, or give it",
                     used, name)
               : obstacle + "; give it, or a log that has this"});
    }
  }
}

/// Names of the cylinders whose force the convention for centres changes: what it chooses freely is free only beside an offset
/// and friction, so that it would choose part of the load.
std::string cylinders_changed(const Known& known, const std::vector<LoadRows>& loads,
                              const LoadFit& fit, const VectorXd& move) {
  std::string names;
  for (std::size_t i = 0; i < loads.size(); ++i) {
    if (!fit.used[i] || loads[i].rows() == 0) continue;
    const double load = (loads[i].known + loads[i].masses * fit.masses).norm();
    if (!((loads[i].masses * move).norm() > known.options.undetermined * load)) continue;
    names += (names.empty() ? "" : ", ") + known.machine.cylinders[i].name;
  }
  return names;
}

/// By link: whether it takes part in a direction that has a force which an offset, friction or an area takes up.
std::vector<bool> confounded_links(const Known& known, const std::vector<LoadRows>& loads,
                                   const LoadFit& fit) {
  const std::vector<MassUnknown> unknowns = mass_unknowns(known.sketch);
  std::vector<bool> taking(known.machine.links.size(), false);
  for (Index d = 0; d < fit.confounded.cols(); ++d) {
    std::vector<double> force(taking.size(), 0.0);
    for (std::size_t i = 0; i < loads.size(); ++i) {
      if (!fit.used[i] || loads[i].rows() == 0) continue;
      for (std::size_t l = 0; l < taking.size(); ++l) {
        VectorXd own = VectorXd::Zero(fit.masses.size());
        for (Index u = 0; u < own.size(); ++u) {
          if (unknowns[static_cast<std::size_t>(u)].link == static_cast<int>(l))
            own[u] = fit.confounded(u, d);
        }
        force[l] += (loads[i].masses * own).squaredNorm();
      }
    }
    const double largest = *std::max_element(force.begin(), force.end());
    for (std::size_t l = 0; l < taking.size(); ++l) {
      if (std::sqrt(force[l]) > known.options.undetermined * std::sqrt(largest)) taking[l] = true;
    }
  }
  return taking;
}

/// Asks for open links where the logs do not tell masses from an offset and friction.
void ask_for_doubtful_links(const Known& known, const std::vector<bool>& links,
                            const std::string& cylinders, RealisedMasses& out) {
  for (const OpenValue& v : known.sketch.open) {
    const bool centre = v.kind == OpenKind::kCog && !known.sketch.is_open(OpenKind::kMass, v.part);
    if ((v.kind != OpenKind::kMass && !centre) || !links[static_cast<std::size_t>(v.part)])
      continue;
    out.questions.push_back(
        {v.path,
         fmt::format("in these logs what it weighs on {} looks like an offset of the pressures and "
                     "like friction, because it hardly changes; give it, or a log with more "
                     "different postures, speeds and payloads",
                     cylinders)});
  }
}

}  // namespace

RealisedMasses realise_masses(const Known& known, const std::vector<LoadRows>& loads,
                              const LoadFit& fit, const std::string& obstacle) {
  const MachineSketch& sketch = known.sketch;
  const Machine& machine = known.machine;
  RealisedMasses out;
  const std::vector<MassUnknown> unknowns = mass_unknowns(sketch);
  const std::vector<Indices> links = indices_of(machine, unknowns);
  if (unknowns.empty()) {
    out.links.resize(machine.links.size());
    out.solution.resize(0);
    return out;
  }
  ask_for_idle_links(known, loads, fit, obstacle, out);
  VectorXd masses;
  bool found = false;
  double used = 0.0;
  for (const double place : kPlaces) {
    masses = solution_at(machine, links, fit, place);
    found = possible(machine, links, masses);
    used = place;
    if (found) break;
  }
  if (!found && out.questions.empty() &&
      cylinders_changed(known, loads, fit, masses - fit.masses).empty()) {
    for (const OpenValue& v : sketch.open) {
      if (v.kind != OpenKind::kMass) continue;
      out.questions.push_back(
          {v.path,
           "the forces determine combinations of masses alone, and no masses that are not negative "
           "give them with centres near the links; give the mass of this link and leave its cog "
           "open (and check signs, units and the payload)"});
    }
  }
  const std::vector<bool> told = name_combinations(machine, unknowns, loads, fit, out);
  std::string changed = cylinders_changed(known, loads, fit, masses - fit.masses);
  std::vector<bool> doubtful(machine.links.size(), true);
  if (changed.empty()) {  // a link of which nothing at all is determined is as doubtful
    doubtful = confounded_links(known, loads, fit);
    for (std::size_t l = 0; l < told.size(); ++l) doubtful[l] = doubtful[l] && !told[l];
    if (std::find(doubtful.begin(), doubtful.end(), true) != doubtful.end())
      changed = used_cylinders(machine, fit);
  }
  if (!changed.empty() && out.questions.empty()) {
    ask_for_doubtful_links(known, doubtful, changed, out);
    masses = fit.masses;
    found = false;
  }
  if (found && fit.free.cols() > 0) {
    out.notes.push_back(fmt::format(
        "static forces determine {} combinations of the {} open masses and moments; by convention "
        "centres lie {:g} % of the way from their joint to the next, and these masses give the "
        "same "
        "static forces as the real ones, not the same inertia. Give a link's mass to have its "
        "centre "
        "found",
        unknowns.size() - static_cast<std::size_t>(fit.free.cols()), unknowns.size(),
        100.0 * used));
  }
  out.possible = found;
  out.solution = masses;
  out.links.resize(machine.links.size());
  for (std::size_t l = 0; l < links.size(); ++l) {
    out.links[l].mass = links[l].mass >= 0 ? masses[links[l].mass] : machine.links[l].mass;
    if (links[l].moment >= 0) out.links[l].moment = masses.segment(links[l].moment, 3);
  }
  return out;
}

}  // namespace sparflow::from_log
