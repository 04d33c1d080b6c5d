#include "models/machine/machine_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/machine/linkage.h"
#include "models/machine/linkage_review.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

/// Number of positions at which a linkage is checked. A dead centre or an opening narrower than 1/400 of the range is
/// at one of its ends, and the ends are checked.
/// @threshold [1] 11..100001; chosen: a 400th of the range
constexpr int kSamples = 401;
/// [-] Below this share of its largest value |dx/dq| counts as a dead centre, where the force is a hundredfold.
/// @threshold [1] 0..0.5; chosen: no cylinder holds that
constexpr double kDeadCentreShare = 0.01;

class Checker {
 public:
  Checker(const Machine& machine, const MachinePlaces& places)
      : machine_(machine), places_(places) {}

  std::vector<std::string> run() {
    check_names();
    check_gravity();
    check_joints();
    check_links();
    check_cylinders();
    check_supply();
    check_valves();
    return warnings_;
  }

 private:
  FilePlace place(const std::vector<FilePlace>& list, std::size_t i) const {
    return i < list.size() ? list[i] : FilePlace{places_.file, 0, 0};
  }

  [[noreturn]] void fail(const std::vector<FilePlace>& list, std::size_t i, const std::string& key,
                         const std::string& message) const {
    throw InputError(place(list, i), key, message);
  }

  void warn(const std::vector<FilePlace>& list, std::size_t i, const std::string& key,
            const std::string& message) {
    warnings_.emplace_back(InputError(place(list, i), key, message).what());
  }

  template <class Part>
  void unique_names(const std::vector<Part>& parts, const std::vector<FilePlace>& list,
                    const char* section) const {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (parts[i].name != parts[j].name) continue;
        fail(list, i, fmt::format("{}[{}]", section, parts[i].name),
             fmt::format("the name occurs twice (first on line {}); give each its own",
                         place(list, j).line));
      }
    }
  }

  void check_names() const {
    unique_names(machine_.joints, places_.joints, "joints");
    unique_names(machine_.links, places_.links, "links");
    unique_names(machine_.cylinders, places_.cylinders, "cylinders");
    unique_names(machine_.pumps, places_.pumps, "pumps");
  }

  void check_gravity() {
    /// Gravity beyond which a machine is warned of.
    /// @threshold [m/s^2] 9.9..1000; chosen: three times that of the earth
    constexpr double kLargestGravity = 30.0;
    const double g = machine_.gravity.norm();
    if (g == 0.0) {
      warn({}, 0, "gravity",
           "is zero, so no load presses on any cylinder; expected about 9.81 m/s^2");
    } else if (g < 1.0 || g > kLargestGravity) {
      warn({}, 0, "gravity", fmt::format("its size is {:.4g}; expected about 9.81 m/s^2", g));
    }
  }

  void check_joints() {
    for (std::size_t i = 0; i < machine_.joints.size(); ++i) {
      const Joint& joint = machine_.joints[i];
      const std::string key = fmt::format("joints[{}]", joint.name);
      const double turns = std::max(std::abs(joint.position.lo), std::abs(joint.position.hi)) /
                           (2.0 * std::numbers::pi);
      if (joint.type == JointType::kRevolute && turns > 2.0) {
        warn(places_.joints, i, key + ".position",
             fmt::format("reaches {:.3g} turns; angles are in rad, are these degrees?", turns));
      }
      if (static_cast<int>(i) > machine_.tip.joint) {
        warn(places_.joints, i, key, "this joint lies behind the tip and does not move it");
      }
      if (machine_.cylinder_of_joint(static_cast<int>(i)) < 0) {
        warn(places_.joints, i, key,
             "no cylinder drives this joint; moving it will cost no energy");
      }
    }
  }

  void check_links() {
    for (std::size_t i = 0; i < machine_.links.size(); ++i) {
      const Link& link = machine_.links[i];
      if (link.slides_with >= 0 && (link.fraction < 0.0 || link.fraction > 1.0)) {
        warn(places_.links, i, fmt::format("links[{}].fraction", link.name),
             fmt::format("is {:g}; a telescope stage moves by 0 to 1 of the extension",
                         link.fraction));
      }
    }
  }

  std::string at(const Joint& joint, double q) const {
    return joint.type == JointType::kRevolute
               ? fmt::format("{} = {:.1f} deg ({:.4f} rad)", joint.name, q / units::kDegree, q)
               : fmt::format("{} = {:.4f} m", joint.name, q);
  }

  std::string range(const Joint& joint) const {
    return joint.type == JointType::kRevolute
               ? fmt::format("[{:.1f}, {:.1f}] deg", joint.position.lo / units::kDegree,
                             joint.position.hi / units::kDegree)
               : fmt::format("[{:g}, {:g}] m", joint.position.lo, joint.position.hi);
  }

  void check_cylinders() {
    for (std::size_t i = 0; i < machine_.cylinders.size(); ++i) {
      const Cylinder& cylinder = machine_.cylinders[i];
      for (std::size_t j = 0; j < i; ++j) {
        if (machine_.cylinders[j].joint != cylinder.joint) continue;
        fail(places_.cylinders, i, fmt::format("cylinders[{}].joint", cylinder.name),
             fmt::format("joint {} is driven by {} already; equal cylinders side by side are one "
                         "cylinder with `parallel: 2`",
                         machine_.joints[static_cast<std::size_t>(cylinder.joint)].name,
                         machine_.cylinders[j].name));
      }
      check_linkage(i);
    }
  }

  void check_linkage(std::size_t i) {
    const Cylinder& cylinder = machine_.cylinders[i];
    const Joint& joint = machine_.joints[static_cast<std::size_t>(cylinder.joint)];
    const std::string key = fmt::format("cylinders[{}].linkage", cylinder.name);
    if (std::holds_alternative<DirectLinkage>(cylinder.linkage) && cylinder.hydraulic() &&
        joint.type == JointType::kRevolute) {
      warn(places_.cylinders, i, key,
           fmt::format("direct on the revolute joint {} makes x an angle; expected rack, pins or "
                       "four_bar",
                       joint.name));
    }
    const bool has_pins = std::holds_alternative<PinsLinkage>(cylinder.linkage) ||
                          std::holds_alternative<FourBarLinkage>(cylinder.linkage);
    if (has_pins) {
      check_less_than_a_turn(i);
      check_four_bar_plane(i);
      check_dead_centre(i);
      for (const std::string& doubt : linkage_doubts(machine_, static_cast<int>(i)))
        warn(places_.cylinders, i, key, doubt);
    }
    check_stroke(i);
  }

  /// Within a whole turn every pinned cylinder passes a dead centre, so that a wider range is a unit error. It is
  /// reported first, because the position of the dead centre would not help the user.
  void check_less_than_a_turn(std::size_t i) const {
    const auto j = static_cast<std::size_t>(machine_.cylinders[i].joint);
    const Joint& joint = machine_.joints[j];
    if (joint.type != JointType::kRevolute) return;
    const Range& r = joint.position;
    if (r.hi - r.lo < 2.0 * std::numbers::pi) return;
    fail(places_.joints, j, fmt::format("joints[{}].position", joint.name),
         fmt::format(
             "[{:g}, {:g}] rad is more than a turn, which cylinder {} cannot drive; if these "
             "are degrees, write [{:.4f}, {:.4f}]",
             r.lo, r.hi, machine_.cylinders[i].name, r.lo * units::kDegree, r.hi * units::kDegree));
  }

  /// A four-bar is computed in the plane through its rocker pin normal to the joint's axis.
  void check_four_bar_plane(std::size_t i) {
    const Cylinder& cylinder = machine_.cylinders[i];
    const auto* bar = std::get_if<FourBarLinkage>(&cylinder.linkage);
    if (bar == nullptr) return;
    const Joint& joint = machine_.joints[static_cast<std::size_t>(cylinder.joint)];
    const Eigen::Vector3d axis = joint.origin.linear() * joint.axis;
    const double off = std::max(std::abs(axis.dot(joint.origin * bar->coupler - bar->rocker)),
                                std::abs(axis.dot(bar->barrel - bar->rocker)));
    /// Distance of a four-bar's pins from its plane beyond which a machine is warned of.
    /// @threshold [m] 0..0.1; chosen: a millimetre is rounding of a drawing
    constexpr double kFlat = 1e-3;
    if (off > kFlat) {
      warn(places_.cylinders, i, fmt::format("cylinders[{}].linkage", cylinder.name),
           fmt::format("its pins lie up to {:.3f} m apart along the axis of {}; a four-bar is flat",
                       off, joint.name));
    }
  }

  /// Position between `good` and `bad` where the predicate changes, by bisection.
  template <class Predicate>
  static double border(double good, double bad, const Predicate& holds) {
    /// Halvings of the interval.
    /// @threshold [1] 53..200; derived: 53 bits of a double are exhausted
    constexpr int kHalvings = 60;
    for (int k = 0; k < kHalvings; ++k) {
      const double middle = 0.5 * (good + bad);
      (holds(middle) ? good : bad) = middle;
    }
    return 0.5 * (good + bad);
  }

  void check_dead_centre(std::size_t i) const {
    const int index = static_cast<int>(i);
    const Cylinder& cylinder = machine_.cylinders[i];
    const Joint& joint = machine_.joints[static_cast<std::size_t>(cylinder.joint)];
    const std::string key = fmt::format("cylinders[{}].linkage", cylinder.name);
    const auto closes = [&](double q) {
      try {
        linkage_rates(machine_, index, q);
        return true;
      } catch (const std::domain_error&) {
        return false;
      }
    };
    std::vector<double> position, rate;
    std::vector<bool> closed;
    for (int k = 0; k < kSamples; ++k) {
      const double share = k / (kSamples - 1.0);
      position.push_back(joint.position.lo + share * (joint.position.hi - joint.position.lo));
      closed.push_back(closes(position.back()));
      rate.push_back(closed.back() ? linkage_rates(machine_, index, position.back()).d1 : 0.0);
    }
    for (std::size_t k = 0; k < closed.size(); ++k) {
      if (closed[k]) continue;
      const char* remedy = "lengthen rocker or coupler, correct the pins or narrow the range";
      const std::size_t good =
          static_cast<std::size_t>(std::find(closed.begin(), closed.end(), true) - closed.begin());
      if (good == closed.size()) {
        fail(places_.cylinders, i, key,
             fmt::format("the four-bar cannot close anywhere in the range {} of {}; {}",
                         range(joint), joint.name, remedy));
      }
      // the border of the open range that is nearest to a closed position
      const std::size_t open = k > 0 ? k : good - 1;
      const double edge = border(position[k > 0 ? k - 1 : good], position[open], closes);
      fail(places_.cylinders, i, key,
           fmt::format("the four-bar cannot close {} {}, inside the joint's range {}; {}",
                       k > 0 ? "beyond" : "below", at(joint, edge), range(joint), remedy));
    }
    double largest = 0.0;
    for (const double r : rate) largest = std::max(largest, std::abs(r));
    for (std::size_t k = 1; k < rate.size(); ++k) {
      if (rate[k - 1] * rate[k] > 0.0) continue;
      const double sign = rate[k - 1];
      const double q = border(position[k - 1], position[k], [&](double x) {
        return linkage_rates(machine_, index, x).d1 * sign > 0.0;
      });
      fail(places_.cylinders, i, key,
           fmt::format("dead centre: dx/dq changes sign at {}, inside the joint's range {}; narrow "
                       "the range or correct the pins",
                       at(joint, q), range(joint)));
    }
    /// Largest rate up to which a linkage does not move at all.
    /// @threshold [m/rad] 0..1e-3; numerical: rounding of pins in millimetres
    constexpr double kNoRate = 1e-6;
    for (std::size_t k = 0; k < rate.size(); ++k) {
      if (std::abs(rate[k]) > kDeadCentreShare * largest && largest > kNoRate) continue;
      fail(places_.cylinders, i, key,
           fmt::format("nearly a dead centre: dx/dq is only {:.2g} at {}, its largest is {:.2g}; "
                       "narrow the range or correct the pins",
                       rate[k], at(joint, position[k]), largest));
    }
  }

  void check_stroke(std::size_t i) {
    const Cylinder& cylinder = machine_.cylinders[i];
    const Joint& joint = machine_.joints[static_cast<std::size_t>(cylinder.joint)];
    const std::string key = fmt::format("cylinders[{}]", cylinder.name);
    // The length is monotonic in q (checked above), so that its extremes lie at the range's ends.
    const double at_lo = cylinder_length(machine_, static_cast<int>(i), joint.position.lo);
    const double at_hi = cylinder_length(machine_, static_cast<int>(i), joint.position.hi);
    const double shortest = std::min(at_lo, at_hi), longest = std::max(at_lo, at_hi);
    // [m] A fraction of a millimetre is rounding of the file's numbers.
    /// Excess of a length up to which it is within the stroke.
    /// @threshold [m] 0..0.01; numerical: a fraction of a millimetre is rounding of the file's numbers
    constexpr double kTolerance = 5e-4;
    if (cylinder.length_at_zero_stroke && shortest < *cylinder.length_at_zero_stroke - kTolerance) {
      warn(places_.cylinders, i, key + ".length_at_zero_stroke",
           fmt::format("the length falls to {:.4f} m at {}, shorter than {:.4f} m at zero stroke",
                       shortest, at(joint, at_lo < at_hi ? joint.position.lo : joint.position.hi),
                       *cylinder.length_at_zero_stroke));
    }
    if (!cylinder.stroke) return;
    if (cylinder.length_at_zero_stroke) {
      const double end = *cylinder.length_at_zero_stroke + *cylinder.stroke;
      if (longest > end + kTolerance) {
        warn(places_.cylinders, i, key + ".stroke",
             fmt::format("the length grows to {:.4f} m at {}, longer than {:.4f} m at full stroke",
                         longest, at(joint, at_lo < at_hi ? joint.position.hi : joint.position.lo),
                         end));
      }
    } else if (longest - shortest > *cylinder.stroke + kTolerance) {
      warn(places_.cylinders, i, key + ".stroke",
           fmt::format("the joint's range {} needs {:.4f} m of stroke, the cylinder has {:.4f} m",
                       range(joint), longest - shortest, *cylinder.stroke));
    }
  }

  void check_supply() {
    for (std::size_t p = 0; p < machine_.pumps.size(); ++p) {
      const Pump& pump = machine_.pumps[p];
      const std::string key = fmt::format("pumps[{}].feeds", pump.name);
      if (pump.feeds.empty()) warn(places_.pumps, p, key, "feeds no cylinder");
      for (std::size_t k = 0; k < pump.feeds.size(); ++k) {
        const Cylinder& fed = machine_.cylinders[static_cast<std::size_t>(pump.feeds[k])];
        if (std::find(pump.feeds.begin(), pump.feeds.begin() + static_cast<std::ptrdiff_t>(k),
                      pump.feeds[k]) != pump.feeds.begin() + static_cast<std::ptrdiff_t>(k)) {
          fail(places_.pumps, p, key, fmt::format("names cylinder {} twice; keep one", fed.name));
        }
        if (!fed.hydraulic()) {
          fail(places_.pumps, p, key,
               fmt::format("cylinder {} has no bore, so it takes no oil; give its bore and rod or "
                           "take it off the list",
                           fed.name));
        }
        for (std::size_t other = 0; other < p; ++other) {
          const std::vector<int>& feeds = machine_.pumps[other].feeds;
          if (std::find(feeds.begin(), feeds.end(), pump.feeds[k]) == feeds.end()) continue;
          fail(places_.pumps, p, key,
               fmt::format("cylinder {} is fed by pump {} already; expected one pump a cylinder",
                           fed.name, machine_.pumps[other].name));
        }
      }
    }
    for (std::size_t i = 0; i < machine_.cylinders.size(); ++i) {
      const Cylinder& cylinder = machine_.cylinders[i];
      const std::string key = fmt::format("cylinders[{}]", cylinder.name);
      if (!cylinder.hydraulic()) continue;
      if (machine_.pump_of_cylinder(static_cast<int>(i)) < 0) {
        warn(places_.cylinders, i, key, "no pump feeds it; its motion will cost no energy");
      }
      if (machine_.valve_of_cylinder(static_cast<int>(i)) == nullptr) {
        warn(places_.cylinders, i, key, "it has no valve; only the pump will limit its flow");
      }
    }
  }

  void check_valves() const {
    for (std::size_t v = 0; v < machine_.valves.size(); ++v) {
      const Cylinder& cylinder =
          machine_.cylinders[static_cast<std::size_t>(machine_.valves[v].cylinder)];
      const std::string key = fmt::format("valves[{}]", cylinder.name);
      if (!cylinder.hydraulic()) {
        fail(places_.valves, v, key,
             "this cylinder has no bore, so no valve; give its bore and rod or remove the valve");
      }
      for (std::size_t other = 0; other < v; ++other) {
        if (machine_.valves[other].cylinder != machine_.valves[v].cylinder) continue;
        fail(places_.valves, v, key,
             fmt::format("this cylinder has a valve already (line {}); keep one",
                         place(places_.valves, other).line));
      }
    }
  }

  const Machine& machine_;
  const MachinePlaces& places_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::vector<std::string> check_machine(const Machine& machine, const MachinePlaces& places) {
  return Checker(machine, places).run();
}

}  // namespace sparflow
