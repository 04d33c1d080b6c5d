#pragma once
/// Machines and log files for the tests of logs.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "identification/log/log.h"
#include "models/machine/machine.h"
#include "models/math/error.h"

namespace sparflow::test {

inline Joint joint(const std::string& name, JointType type, Range position, double speed) {
  Joint j;
  j.name = name;
  j.type = type;
  j.position = position;
  j.velocity = {-speed, speed};
  return j;
}

inline Cylinder cylinder(const std::string& name, int joint_index) {
  Cylinder c;
  c.name = name;
  c.joint = joint_index;
  c.bore = 0.15;
  c.rod = 0.1;
  return c;
}

/// Joints boom (revolute) and extension (prismatic), a cylinder each, pump main.
inline Machine small_crane() {
  Machine m;
  m.name = "small";
  m.joints = {joint("boom", JointType::kRevolute, {-0.2, 1.35}, 0.11),
              joint("extension", JointType::kPrismatic, {0.0, 6.0}, 0.3)};
  m.cylinders = {cylinder("boom", 0), cylinder("extension", 1)};
  m.cylinders[0].stroke = 0.8;
  m.pumps.push_back({"main", PumpType::kLoadSensing, {0, 1}, 2e-3, 3e7, 2e6});
  return m;
}

/// Names and ranges of the real crane the logs in hmf_2020_k4 come from.
inline Machine real_crane() {
  Machine m;
  m.name = "hmf-2020-k4";
  m.joints = {joint("main", JointType::kRevolute, {-0.75, 1.45}, 0.15),
              joint("jib", JointType::kRevolute, {-2.55, 0.20}, 0.25)};
  m.cylinders = {cylinder("main", 0), cylinder("jib", 1)};
  m.cylinders[0].stroke = 0.75;
  m.cylinders[1].stroke = 0.855;
  m.pumps.push_back({"supply", PumpType::kConstantPressure, {0, 1}, 7e-4, 2.5e7, 2e6});
  return m;
}

inline Machine loader_crane() {
  Machine m;
  m.name = "loader-crane";
  m.joints = {joint("boom", JointType::kRevolute, {-0.20, 1.35}, 0.11),
              joint("jib", JointType::kRevolute, {-2.30, 0.05}, 0.18),
              joint("extension", JointType::kPrismatic, {0.0, 6.0}, 0.30)};
  m.cylinders = {cylinder("boom", 0), cylinder("jib", 1), cylinder("extension", 2)};
  m.pumps.push_back({"main", PumpType::kLoadSensing, {0, 1, 2}, 2e-3, 3.1e7, 2.2e6});
  return m;
}

/// One prismatic joint with a measured drive force.
inline Machine drive() {
  Machine m;
  m.name = "emps";
  m.joints = {joint("axis", JointType::kPrismatic, {-0.05, 0.35}, 0.5)};
  m.cylinders = {cylinder("axis", 0)};
  m.cylinders[0].bore = m.cylinders[0].rod = 0.0;
  return m;
}

/// @return a log of small_crane() without faults, 50 Hz, with the rows that all dialects of the tests contain
inline std::string plain_log(int rows = 30) {
  std::string text =
      "t_s,q_boom_rad,q_extension_m,u_boom,pA_boom_bar,p_main_bar,payload_kg,oil_C\n";
  for (int i = 0; i < rows; ++i) {
    text += fmt::format("{:.3f},{:.4f},{:.4f},{:.2f},{:.1f},{:.1f},800,41.5\n", 0.02 * i,
                        0.5 + 0.001 * i, 1.0 + 0.002 * i, 0.25, 80.0 + 0.1 * (i % 7),
                        120.5 + 0.1 * (i % 5));
  }
  return text;
}

/// A folder of its own for each test program, removed at the end.
class LogFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::path(testing::TempDir()) / ("sparflow_logs_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
  }
  Log load(const std::string& content, const LogOptions& options = {}) const {
    return log_from_text("log.csv", content, small_crane(), options);
  }
  /// The message without the folder; "" when nothing was thrown.
  template <class Call>
  std::string message_of(Call call) const {
    try {
      call();
    } catch (const InputError& error) {
      std::string text = error.what();
      const std::string prefix = folder_.string() + "/";
      for (std::size_t at; (at = text.find(prefix)) != text.npos;) text.erase(at, prefix.size());
      return text;
    }
    return "";
  }
  std::string error_of(const std::string& content) const {
    return message_of([&] { load(content); });
  }

  std::filesystem::path folder_;
};

inline std::string shared_file(const std::string& name) {
  return std::string(SPARFLOW_SOURCE_DIR "/../shared/data/") + name;
}

}  // namespace sparflow::test
