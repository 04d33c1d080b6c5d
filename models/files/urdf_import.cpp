#include "models/files/urdf_import.h"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <mutex>
#include <set>

#include "models/files/xml_outline.h"
#include "models/math/door.h"
#include "models/yaml/yaml_reader.h"

namespace sparflow {
namespace {

/// liburdfdom reports to a logger of the whole process; this object collects its messages while one file is parsed.
class CaughtMessages : public console_bridge::OutputHandler {
 public:
  CaughtMessages() : lock_(mutex()), before_(console_bridge::getOutputHandler()) {
    console_bridge::useOutputHandler(this);
  }
  ~CaughtMessages() override { console_bridge::useOutputHandler(before_); }
  CaughtMessages(const CaughtMessages&) = delete;
  CaughtMessages& operator=(const CaughtMessages&) = delete;
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && first_.empty()) first_ = text;
  }
  const std::string& first() const { return first_; }

 private:
  static std::mutex& mutex() {
    static std::mutex m;
    return m;
  }
  std::lock_guard<std::mutex> lock_;
  console_bridge::OutputHandler* before_;
  std::string first_;
};

Eigen::Isometry3d isometry(const urdf::Pose& pose) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.translation() << pose.position.x, pose.position.y, pose.position.z;
  double x = 0.0, y = 0.0, z = 0.0, w = 1.0;
  pose.rotation.getQuaternion(x, y, z, w);
  result.linear() = Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
  return result;
}

class Importer {
 public:
  Importer(const std::string& path, const std::map<std::string, JointLimitsOverride>& limits,
           const FilePlace& place)
      : path_(path), limits_(limits), place_(place) {}

  /// Links own their children, so those in a circle would keep each other.
  ~Importer() {
    if (!model_) return;
    for (const auto& [name, link] : model_->links_) {
      link->child_links.clear();
      link->child_joints.clear();
    }
  }
  Importer(const Importer&) = delete;
  Importer& operator=(const Importer&) = delete;

  UrdfChain import(const std::string& tip_link) {
    const std::string text = read_text(path_);
    check_xml(text, path_);
    {
      CaughtMessages messages;
      model_ = urdf::parseURDF(text);
      if (!model_) {
        fail("", messages.first().empty() ? "not a URDF robot description"
                                          : "not readable as URDF: " + messages.first());
      }
    }
    require_tree(text);
    find_chain(tip_link.empty() ? only_leaf() : tip_link);
    walk(model_->getRoot(), -1, Eigen::Isometry3d::Identity());
    for (const auto& [name, limit] : limits_) {
      const bool used = std::any_of(chain_.joints.begin(), chain_.joints.end(),
                                    [&key = name](const Joint& j) { return j.name == key; });
      if (used) continue;
      std::vector<std::string> names;
      for (const Joint& joint : chain_.joints) names.push_back(joint.name);
      throw InputError(limit.place, "kinematics.limits",
                       fmt::format("the chain in {} has no moving joint \"{}\" (it has {}){}",
                                   path_, name, listed(names), suggestion(name, names)));
    }
    return chain_;
  }

 private:
  [[noreturn]] void fail(const std::string& key, const std::string& message) const {
    throw InputError({path_, 0, 0}, key, message);
  }

  /// Line of the element of this kind and name, 0 when it is not found.
  static int line_of(const std::string& text, const std::string& element, const std::string& name) {
    for (const char quote : {'"', '\''}) {
      const std::string wanted = fmt::format("name={}{}{}", quote, name, quote);
      for (std::size_t at = text.find(wanted); at != std::string::npos;
           at = text.find(wanted, at + 1)) {
        const std::size_t begin = text.rfind('<', at);
        if (begin == std::string::npos || text.compare(begin + 1, element.size(), element) != 0)
          continue;
        return 1 + static_cast<int>(std::count(
                       text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
      }
    }
    return 0;
  }

  /// The library checks that one link has no parent, and nothing of the others: joints may form a circle beside the tree,
  /// and two joints may lead to one link.
  void require_tree(const std::string& text) const {
    std::map<std::string, std::string> parent_of;  // joint that leads to a link
    for (const auto& [name, joint] : model_->joints_) {
      const auto [before, first] = parent_of.emplace(joint->child_link_name, name);
      if (first) continue;
      throw InputError({path_, line_of(text, "joint", name), 0}, key(*joint),
                       fmt::format("leads to link \"{}\", as joint \"{}\" does; expected one joint "
                                   "to each link",
                                   joint->child_link_name, before->second));
    }
    std::set<std::string> reached;
    std::vector<std::string> left = {model_->getRoot()->name};
    while (!left.empty()) {
      const urdf::LinkConstSharedPtr link = model_->getLink(left.back());
      left.pop_back();
      if (!link || !reached.insert(link->name).second) continue;
      for (const urdf::JointSharedPtr& joint : link->child_joints)
        left.push_back(joint->child_link_name);
    }
    for (const auto& [name, link] : model_->links_) {
      if (reached.count(name) > 0) continue;
      throw InputError(
          {path_, line_of(text, "link", name), 0}, fmt::format("link[{}]", name),
          fmt::format("not reached from the root link \"{}\"; the joints around it form a "
                      "circle, expected a tree",
                      model_->getRoot()->name));
    }
  }

  static std::string key(const urdf::Joint& joint) { return fmt::format("joint[{}]", joint.name); }

  std::string only_leaf() const {
    std::vector<std::string> leaves;
    for (const auto& [name, link] : model_->links_) {
      if (link->child_joints.empty()) leaves.push_back(name);
    }
    if (leaves.size() == 1) return leaves[0];
    throw InputError(
        place_, "tip",
        fmt::format("{} branches and has the leaves {}; say which carries the payload: "
                    "tip: {{link: NAME}}",
                    path_, listed(leaves)));
  }

  void find_chain(const std::string& tip_link) {
    const auto found = model_->links_.find(tip_link);
    if (found == model_->links_.end()) {
      std::vector<std::string> names;
      for (const auto& [name, link] : model_->links_) names.push_back(name);
      throw InputError(place_, "tip",
                       fmt::format("{} has no link \"{}\"; it has {}{}", path_, tip_link,
                                   listed(names), suggestion(tip_link, names)));
    }
    tip_link_ = tip_link;
    for (urdf::LinkConstSharedPtr link = found->second; link && link->parent_joint;
         link = link->getParent()) {
      chain_joints_.push_back(link->parent_joint->name);
    }
  }

  /// @param carrier moving joint whose frame carries the link (-1 = base)  @param pose link in that frame
  void walk(const urdf::LinkConstSharedPtr& link, int carrier, const Eigen::Isometry3d& pose) {
    add_mass(*link, carrier, pose);
    if (link->name == tip_link_) {
      chain_.tip_joint = carrier;
      chain_.tip_frame = pose;
    }
    for (const urdf::JointSharedPtr& joint : link->child_joints) {
      const Eigen::Isometry3d origin = pose * isometry(joint->parent_to_joint_origin_transform);
      const urdf::LinkConstSharedPtr child = model_->getLink(joint->child_link_name);
      const bool on_chain =
          std::find(chain_joints_.begin(), chain_joints_.end(), joint->name) != chain_joints_.end();
      if (joint->type != urdf::Joint::FIXED && on_chain) {
        chain_.joints.push_back(moving_joint(*joint, origin));
        walk(child, static_cast<int>(chain_.joints.size()) - 1, Eigen::Isometry3d::Identity());
        continue;
      }
      if (joint->type != urdf::Joint::FIXED) {
        chain_.warnings.push_back(
            fmt::format("{}: {}: lies beside the chain to {} and is held at its zero", path_,
                        key(*joint), tip_link_));
      }
      walk(child, carrier, origin);
    }
  }

  Joint moving_joint(const urdf::Joint& from, const Eigen::Isometry3d& origin) const {
    Joint joint;
    joint.name = from.name;
    const bool fit = std::all_of(from.name.begin(), from.name.end(), [](unsigned char c) {
      return std::isalnum(c) || c == '_' || c == '-' || c == '.';
    });
    if (!fit || from.name == "base") {
      fail(
          key(from),
          "expected a name of letters, digits, `_`, `-` and `.`, and not `base`; rename the joint");
    }
    joint.origin = origin;
    switch (from.type) {
      case urdf::Joint::REVOLUTE:
      case urdf::Joint::CONTINUOUS:
        joint.type = JointType::kRevolute;
        break;
      case urdf::Joint::PRISMATIC:
        joint.type = JointType::kPrismatic;
        break;
      default:
        fail(
            key(from),
            "a floating or planar joint; expected revolute, continuous, prismatic or fixed joints");
    }
    if (from.mimic) {
      fail(key(from), fmt::format("mimics {}; write the machine with `joints` and `links`, where a "
                                  "telescope stage is a link with slides_with and fraction",
                                  from.mimic->joint_name));
    }
    joint.axis = Eigen::Vector3d(from.axis.x, from.axis.y, from.axis.z);
    /// Length of an axis up to which it is no direction.
    /// @threshold [1] 0..1e-3; numerical: rounding of the file's numbers
    constexpr double kZeroAxis = 1e-9;
    if (joint.axis.norm() < kZeroAxis) fail(key(from), "its axis is zero; expected a direction");
    joint.axis.normalize();
    set_limits(from, joint);
    return joint;
  }

  void set_limits(const urdf::Joint& from, Joint& joint) const {
    const auto found = limits_.find(from.name);
    const JointLimitsOverride given =
        found == limits_.end() ? JointLimitsOverride{} : found->second;
    const std::string remedy =
        fmt::format("give it in the machine file: kinematics: {{limits: {{{}: {{", from.name);
    const bool bounded = from.type != urdf::Joint::CONTINUOUS && from.limits &&
                         from.limits->lower < from.limits->upper;
    if (given.position) {
      joint.position = *given.position;
    } else if (bounded) {
      joint.position = {from.limits->lower, from.limits->upper};
    } else {
      fail(key(from), fmt::format("{}; {}position: [lo, hi]}}}}}}",
                                  from.type == urdf::Joint::CONTINUOUS
                                      ? "a continuous joint has no position range and needs one"
                                      : "its limit has no lower < upper",
                                  remedy));
    }
    if (given.velocity) {
      joint.velocity = *given.velocity;
    } else if (from.limits && from.limits->velocity > 0.0) {
      joint.velocity = {-from.limits->velocity, from.limits->velocity};
    } else {
      fail(key(from), fmt::format("has no velocity limit; {}velocity: [lo, hi]}}}}}}", remedy));
    }
    if (!given.acceleration) {
      fail(key(from),
           fmt::format("URDF knows no acceleration limit; {}acceleration: [lo, hi]}}}}}}", remedy));
    }
    joint.acceleration = *given.acceleration;
  }

  void add_mass(const urdf::Link& from, int carrier, const Eigen::Isometry3d& pose) {
    if (!from.inertial) return;
    const urdf::Inertial& inertial = *from.inertial;
    if (!(inertial.mass >= 0.0)) {
      fail(fmt::format("link[{}]", from.name),
           fmt::format("got mass {}, expected a mass that is not negative [kg]", inertial.mass));
    }
    const Eigen::Isometry3d at = pose * isometry(inertial.origin);
    Link link;
    link.name = from.name;
    link.joint = carrier;
    link.mass = inertial.mass;
    link.cog = at.translation();
    Eigen::Matrix3d tensor;
    tensor << inertial.ixx, inertial.ixy, inertial.ixz, inertial.ixy, inertial.iyy, inertial.iyz,
        inertial.ixz, inertial.iyz, inertial.izz;
    tensor = (at.linear() * tensor * at.linear().transpose()).eval();
    if (carrier >= 0) {
      const Joint& joint = chain_.joints[static_cast<std::size_t>(carrier)];
      const bool slides =
          joint.type == JointType::kPrismatic && carrier > 0 &&
          chain_.joints[static_cast<std::size_t>(carrier) - 1].type == JointType::kRevolute;
      if (slides) {
        const Eigen::Vector3d axis = chain_.joints[static_cast<std::size_t>(carrier) - 1].axis;
        const Eigen::Matrix3d turn = joint.origin.linear();
        link.inertia = axis.dot(turn * tensor * turn.transpose() * axis);
        link.joint = carrier - 1;
        link.cog = joint.origin * link.cog;
        link.slides_with = carrier;
        link.fraction = 1.0;
      } else {
        link.inertia = joint.axis.dot(tensor * joint.axis);
      }
      if (link.inertia < 0.0) {
        fail(fmt::format("link[{}]", from.name),
             "its inertia about the joint's axis is negative; correct the tensor");
      }
    }
    if (link.mass > 0.0 || link.inertia > 0.0) chain_.links.push_back(link);
  }

  const std::string& path_;
  const std::map<std::string, JointLimitsOverride>& limits_;
  const FilePlace& place_;
  urdf::ModelInterfaceSharedPtr model_;
  std::string tip_link_;
  std::vector<std::string> chain_joints_;
  UrdfChain chain_;
};

}  // namespace

UrdfChain import_urdf(const std::string& path, const std::string& tip_link,
                      const std::map<std::string, JointLimitsOverride>& limits,
                      const FilePlace& place) {
  return Importer(path, limits, place).import(tip_link);
}

}  // namespace sparflow
