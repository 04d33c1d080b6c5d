// Reads the reference problem; an error names the key that is missing or of the wrong kind.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/reference_model.h"
#include "models/math/error.h"

namespace sparflow::bench {
namespace {

using nlohmann::json;

/// A value of the file together with its key.
class Node {
 public:
  Node(const json& value, std::string file, std::string key)
      : value_(value), file_(std::move(file)), key_(std::move(key)) {}

  Node at(const std::string& name) const {
    if (!value_.is_object()) fail(key_, "expected an object");
    const std::string path = key_.empty() ? name : key_ + "." + name;
    const auto found = value_.find(name);
    if (found == value_.end()) fail(path, "is missing; take the file from bench/data");
    return {*found, file_, path};
  }
  Node at(std::size_t index) const { return {value_.at(index), file_, element(index)}; }

  std::size_t size(std::size_t wanted) const {
    if (!value_.is_array() || (wanted > 0 && value_.size() != wanted) || value_.empty()) {
      fail(key_, "expected a list of " + (wanted > 0 ? std::to_string(wanted) : "some") +
                     " entries, got " + brief());
    }
    return value_.size();
  }
  double number() const {
    if (!value_.is_number()) fail(key_, "expected a number, got " + brief());
    return value_.get<double>();
  }
  double positive() const {
    const double v = number();
    if (!(v > 0.0) || !std::isfinite(v)) fail(key_, "expected a positive number, got " + brief());
    return v;
  }
  template <std::size_t N>
  std::array<double, N> numbers() const {
    size(N);
    std::array<double, N> out;
    for (std::size_t i = 0; i < N; ++i) out[i] = at(i).number();
    return out;
  }
  std::vector<double> list(std::size_t wanted = 0) const {
    std::vector<double> out(size(wanted));
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = at(i).number();
    return out;
  }
  [[noreturn]] void fail(const std::string& key, const std::string& message) const {
    throw InputError({file_, 0, 0}, key, message);
  }

 private:
  std::string element(std::size_t index) const { return key_ + "[" + std::to_string(index) + "]"; }
  std::string brief() const {
    const std::string text = value_.dump();
    return text.size() <= 40 ? text : text.substr(0, 37) + "...";
  }
  const json& value_;
  std::string file_, key_;
};

ReferenceGp read_gp(const Node& node) {
  ReferenceGp gp;
  gp.inverse_length_flow = 1.0 / node.at("lQ").positive();
  gp.inverse_length_force = 1.0 / node.at("lF").positive();
  const double sf2 = node.at("sf2").positive();
  gp.flow = node.at("Q").list();
  gp.force = node.at("F").list(gp.flow.size());
  gp.weight = node.at("alpha").list(gp.flow.size());
  for (double& v : gp.flow) v *= gp.inverse_length_flow;
  for (double& v : gp.force) v *= gp.inverse_length_force;
  for (double& v : gp.weight) v *= sf2;
  const std::size_t padded = kernel_padded(gp.flow.size());
  gp.flow.resize(padded, 0.0);
  gp.force.resize(padded, 0.0);
  gp.weight.resize(padded, 0.0);
  double squared = 0.0;  // w^T K w
  for (std::size_t j = 0; j < padded; ++j) {
    squared += gp.weight[j] * kernel_sum(gp.centres(), gp.flow[j], gp.force[j]);
  }
  gp.bound = std::sqrt(std::max(squared, 0.0));
  return gp;
}

}  // namespace

ReferenceProblem read_reference_problem(const std::string& path) {
  const std::string text = read_file(path);
  json document;
  try {
    document = json::parse(text);
  } catch (const json::parse_error& error) {
    const std::string before = text.substr(0, std::min(error.byte, text.size()));
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    throw InputError({path, static_cast<int>(line), 0}, "",
                     "is not valid JSON; take the file from bench/data");
  }
  const Node root(document, path, "");
  ReferenceProblem p;
  p.duration = root.at("T").positive();
  const double intervals = root.at("N").positive();
  if (intervals != std::floor(intervals) || intervals < 2 || intervals > 100000) {
    root.fail("N", "expected a whole number of intervals from 2 to 100000");
  }
  p.intervals = static_cast<int>(intervals);
  p.base = root.at("base").numbers<2>();
  const std::pair<const char*, double*> positives[] = {{"gravity", &p.gravity},
                                                       {"L1", &p.L1},
                                                       {"L2", &p.L2},
                                                       {"a1", &p.a1},
                                                       {"b1", &p.b1},
                                                       {"a2", &p.a2},
                                                       {"b2", &p.b2},
                                                       {"eps_v", &p.eps_v},
                                                       {"q_eps", &p.q_eps},
                                                       {"standby", &p.standby},
                                                       {"lse_temperature", &p.lse_temperature},
                                                       {"q_total_max", &p.q_total_max}};
  for (const auto& [name, target] : positives) *target = root.at(name).positive();
  const std::pair<const char*, double*> numbers[] = {
      {"m_inner", &p.m_inner}, {"s_inner", &p.s_inner},     {"m_outer", &p.m_outer},
      {"s_outer", &p.s_outer}, {"m_tele", &p.m_tele},       {"s_tele0", &p.s_tele0},
      {"s_tele1", &p.s_tele1}, {"m_payload", &p.m_payload}, {"alpha1", &p.alpha1},
      {"alpha2", &p.alpha2},   {"margin", &p.margin},       {"w_acc", &p.w_acc}};
  for (const auto& [name, target] : numbers) *target = root.at(name).number();
  const std::pair<const char*, std::array<double, 3>*> triples[] = {
      {"area_piston", &p.area_piston},
      {"area_rod", &p.area_rod},
      {"q_lb", &p.q_lb},
      {"q_ub", &p.q_ub},
      {"qd_lb", &p.qd_lb},
      {"qd_ub", &p.qd_ub},
      {"qdd_lb", &p.qdd_lb},
      {"qdd_ub", &p.qdd_ub},
      {"q_start", &p.q_start},
      {"q_goal_guess", &p.q_goal_guess}};
  for (const auto& [name, target] : triples) *target = root.at(name).numbers<3>();
  p.goal = root.at("goal_xy").numbers<2>();
  const Node gp = root.at("gp");
  gp.size(3);
  for (std::size_t i = 0; i < 3; ++i) {
    gp.at(i).size(2);
    for (std::size_t side = 0; side < 2; ++side) p.gp[i][side] = read_gp(gp.at(i).at(side));
  }
  return p;
}

}  // namespace sparflow::bench
