#include "identification/data_checks/sensor_slips.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/machine/static_force.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;

/// A unit that a number may be in although its column says another.
struct OtherUnit {
  const char* name;    ///< for sentences
  const char* suffix;  ///< of a column
  double factor;       ///< number in this unit over the number in the column's unit
};

/// For columns in bar.
constexpr OtherUnit kPressureUnits[] = {
    {"psi", "psi", 14.5038}, {"MPa", "MPa", 0.1}, {"kPa", "kPa", 100.0}, {"Pa", "Pa", 1e5}};
/// For columns in kg.
constexpr OtherUnit kMassUnits[] = {
    {"tonnes", "t", 1e-3}, {"pounds", "lb", 2.20462}, {"grams", "g", 1e3}};

/// Evenly spaced samples for which a test holds.
template <class Test>
std::vector<Index> thinned(Index samples, Index most, const Test& holds) {
  std::vector<Index> all;
  for (Index k = 0; k < samples; ++k) {
    if (holds(k)) all.push_back(k);
  }
  const auto count = static_cast<Index>(all.size());
  if (count <= most) return all;
  std::vector<Index> some;
  for (Index i = 0; i < most; ++i) some.push_back(all[static_cast<std::size_t>(i * count / most)]);
  return some;
}

class SlipSearch {
 public:
  SlipSearch(const Machine& machine, const MachineSignals& signals, const SlipOptions& options)
      : machine_(machine), signals_(signals), options_(options) {}

  std::vector<SensorSlip> run() {
    for (std::size_t i = 0; i < signals_.cylinders.size(); ++i) {
      check_command(i);
      check_chambers(i);
    }
    if (!forces_doubted_) {
      for (std::size_t p = 0; p < signals_.pumps.size(); ++p) check_pump(p);
      check_payload();
    }
    return std::move(slips_);
  }

 private:
  bool enough(const std::vector<Index>& samples) const {
    return static_cast<Index>(samples.size()) >= options_.fewest;
  }

  void check_command(std::size_t i) {
    const CylinderSignals& c = signals_.cylinders[i];
    if (!c.has_command()) return;
    const std::vector<Index> firm = thinned(signals_.samples(), options_.most, [&](Index k) {
      return std::abs(c.command[k]) > options_.firm_command &&
             std::abs(c.speed[k]) > options_.firm_speed;
    });
    if (!enough(firm)) return;
    const auto agreeing = std::count_if(firm.begin(), firm.end(), [&](Index k) {
      return (c.command[k] > 0.0) == (c.speed[k] > 0.0);
    });
    const double share = static_cast<double>(agreeing) / static_cast<double>(firm.size());
    if (share > options_.least_agreement) return;
    const std::string channel = "u_" + machine_.cylinders[i].name;
    slips_.push_back(
        {"sign",
         {channel},
         fmt::format("{}: the sign looks reversed: the rod moves against its command in {:.0f} % "
                     "of the samples with a firm command; positive must extend the rod. Turn the "
                     "sign round in a mapping file (columns: {{{}: \"-COLUMN\"}})",
                     channel, 100.0 * (1.0 - share), channel)});
  }

  /// Squared error of a reading of both chambers over the squared static force.
  struct Reading {
    double error = 0.0;
    bool swapped = false;
    const OtherUnit* unit = nullptr;  ///< nullptr: the column's own
  };

  void check_chambers(std::size_t i) {
    const CylinderSignals& c = signals_.cylinders[i];
    if (c.pressure_a.size() == 0 || c.pressure_b.size() == 0) return;
    const Cylinder& cylinder = machine_.cylinders[i];
    const std::vector<Index> moving = thinned(signals_.samples(), options_.most, [&](Index k) {
      return std::abs(c.speed[k]) > options_.firm_speed && std::isfinite(c.pressure_a[k]) &&
             std::isfinite(c.pressure_b[k]) && std::isfinite(c.statics()[k]);
    });
    if (!enough(moving)) return;
    double square = 0.0;
    for (const Index k : moving) square += c.statics()[k] * c.statics()[k];
    if (!(square > 0.0)) return;
    const auto read = [&](bool swapped, const OtherUnit* unit) {
      const double factor = unit == nullptr ? 1.0 : unit->factor;
      double sum = 0.0;
      for (const Index k : moving) {
        const double a = swapped ? c.pressure_b[k] : c.pressure_a[k];
        const double b = swapped ? c.pressure_a[k] : c.pressure_b[k];
        const double force = (a * cylinder.area_piston() - b * cylinder.area_rod()) / factor;
        sum += (force - c.statics()[k]) * (force - c.statics()[k]);
      }
      return Reading{sum / square, swapped, unit};
    };
    const Reading given = read(false, nullptr);
    Reading best = given;
    for (const bool swapped : {false, true}) {
      const auto consider = [&](const Reading& r) {
        if (r.error < best.error) best = r;
      };
      consider(read(swapped, nullptr));
      for (const OtherUnit& unit : kPressureUnits) consider(read(swapped, &unit));
    }
    if (best.error > options_.error_share * given.error || best.error > options_.explained_share)
      return;
    forces_doubted_ = true;
    report_chambers(cylinder.name, given, best);
  }

  void report_chambers(const std::string& name, const Reading& given, const Reading& best) {
    const std::string a = "pA_" + name, b = "pB_" + name;
    const auto percent = [](double error) { return 100.0 * std::sqrt(error); };
    std::string what, remedy;
    if (best.swapped) {
      what = "are exchanged";
      remedy = "Exchange the two columns";
    }
    if (best.unit != nullptr) {
      what += (what.empty() ? "" : " and ") + fmt::format("are in {}, not in bar", best.unit->name);
      remedy +=
          (remedy.empty() ? "Name" : ", and name") +
          fmt::format(" the columns {}_{} and {}_{}", a, best.unit->suffix, b, best.unit->suffix);
    }
    slips_.push_back(
        {best.swapped ? (best.unit != nullptr ? "swapped_and_unit" : "swapped") : "unit",
         {a, b},
         fmt::format("{} and {} look as if they {}: as they are, their force misses the static "
                     "force by {:.0f} % of it, read that way by {:.0f} %. {}",
                     a, b, what, percent(given.error), percent(best.error), remedy)});
  }

  void check_pump(std::size_t p) {
    const Eigen::VectorXd& pressure = signals_.pumps[p].pressure;
    if (pressure.size() == 0) return;
    std::vector<double> ratios;
    for (Index k = 0; k < signals_.samples(); ++k) {
      double working = 0.0;
      for (const int i : machine_.pumps[p].feeds) {
        const CylinderSignals& c = signals_.cylinders[static_cast<std::size_t>(i)];
        if (c.has_pressure() && c.driven[k] && c.working_pressure[k] > working)
          working = c.working_pressure[k];
      }
      if (working > 0.0 && pressure[k] > 0.0) ratios.push_back(pressure[k] / working);
    }
    if (static_cast<Index>(ratios.size()) < options_.fewest) return;
    const double ratio =
        median(Eigen::Map<Eigen::VectorXd>(ratios.data(), static_cast<Index>(ratios.size())));
    if (ratio > options_.least_pump_ratio && ratio < options_.largest_pump_ratio) return;
    // A pump's pressure is a little above what its cylinders work with; the unit that leaves that is the likeliest.
    const OtherUnit* unit = nullptr;
    double nearest = std::numeric_limits<double>::infinity();
    for (const OtherUnit& u : kPressureUnits) {
      const double off = std::abs(std::log(ratio / u.factor));
      if (off < nearest) {
        nearest = off;
        unit = &u;
      }
    }
    const std::string channel = "p_" + machine_.pumps[p].name;
    slips_.push_back(
        {"unit",
         {channel},
         fmt::format("{} looks as if it is in {}, not in bar: while cylinders move it is {:.3g} "
                     "times their largest working pressure (median). Name the column {}_{}",
                     channel, unit->name, ratio, channel, unit->suffix)});
  }

  void check_payload() {
    if (!signals_.payload_measured) return;
    const std::vector<Index> loaded = thinned(signals_.samples(), options_.most, [&](Index k) {
      return signals_.payload[k] > 0.0 && signals_.usable[k];
    });
    if (!enough(loaded)) return;
    StaticForce statics(machine_);
    const auto n = signals_.cylinders.size();
    // Sums over the samples of each cylinder: error of the file's reading, and of each other unit's, over the squared force.
    std::vector<double> error(1 + std::size(kMassUnits), 0.0);
    bool any = false;
    std::vector<std::vector<double>> sums(n, std::vector<double>(error.size(), 0.0));
    std::vector<double> square(n, 0.0);
    Eigen::VectorXd q;
    for (const Index k : loaded) {
      q = signals_.q.row(k).transpose();
      if (!q.allFinite()) continue;
      try {
        statics.update(q.data(), 0.0, 0);
      } catch (const std::domain_error&) {
        continue;  // a measured posture a little beyond the linkage's range
      }
      for (std::size_t i = 0; i < n; ++i) {
        const CylinderSignals& c = signals_.cylinders[i];
        if (!c.has_force() || !std::isfinite(c.force[k]) || !c.moving[k]) continue;
        any = true;
        const double empty = statics.force()[static_cast<Index>(i)];
        const double load = c.statics()[k] - empty;  // as the file's number gives it
        square[i] += c.force[k] * c.force[k];
        for (std::size_t u = 0; u < error.size(); ++u) {
          const double factor = u == 0 ? 1.0 : kMassUnits[u - 1].factor;
          const double miss = c.force[k] - empty - load / factor;
          sums[i][u] += miss * miss;
        }
      }
    }
    if (!any) return;
    double cylinders = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      if (!(square[i] > 0.0)) continue;
      cylinders += 1.0;
      for (std::size_t u = 0; u < error.size(); ++u) error[u] += sums[i][u] / square[i];
    }
    const auto best = std::min_element(error.begin(), error.end()) - error.begin();
    const double least = error[static_cast<std::size_t>(best)];
    if (best == 0 || least > options_.error_share * error[0] ||
        least > options_.explained_share * cylinders)
      return;
    const OtherUnit& unit = kMassUnits[best - 1];
    slips_.push_back(
        {"unit",
         {"payload"},
         fmt::format("payload looks as if it is in {}, not in kg: the squared error of all forces "
                     "falls to {:.0f} % when it is read that way. Name the column payload_{}",
                     unit.name, 100.0 * least / error[0], unit.suffix)});
  }

  const Machine& machine_;
  const MachineSignals& signals_;
  const SlipOptions& options_;
  std::vector<SensorSlip> slips_;
  bool forces_doubted_ = false;  ///< a chamber is read wrongly, so that forces judge nothing else
};

}  // namespace

std::vector<SensorSlip> find_sensor_slips(const Machine& machine, const MachineSignals& signals,
                                          const SlipOptions& options) {
  return SlipSearch(machine, signals, options).run();
}

}  // namespace sparflow
