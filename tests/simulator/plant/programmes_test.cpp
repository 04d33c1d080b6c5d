/// Work programmes and sensors of the plant.
#include "simulator/programmes/programmes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <sstream>
#include <utility>

#include "models/files/machine_file.h"
#include "models/machine/kinematics.h"
#include "simulator/plant/parameters/plant_effects.h"
#include "simulator/sensors/log_writer.h"

namespace sparflow::plant {
namespace {

Machine machine_at(const std::string& name) {
  return load_machine(std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/" + name + ".yaml");
}

PlantParameters nominal(const Machine& machine, const std::vector<std::string>& effects = {}) {
  PlantParameters p = default_parameters(machine);
  std::vector<EffectSetting> settings;
  settings.reserve(effects.size());
  for (const std::string& e : effects) settings.push_back(parse_effect(e));
  apply_effects(machine, settings, p);
  return p;
}

/// Runs a programme and collects its records.
std::vector<Record> driven(const Machine& machine, const PlantParameters& parameters,
                           Programme& programme, double seconds) {
  PlantRun run(machine, parameters, programme.start(), programme.start_payload());
  std::vector<Record> records;
  while (run.time() < seconds) {
    const ProgrammeStep step = programme.step(run.record());
    if (step.end) break;
    if (step.payload) run.set_payload(*step.payload);
    records.push_back(run.record());
    EXPECT_EQ(run.advance(step.command), RunStatus::kRunning)
        << machine.name << ": " << run.message();
    if (run.status() != RunStatus::kRunning) break;
  }
  return records;
}

TEST(PlantProgrammes, OperatorsWorkMovesEveryCylinderOfEveryMachineWithinItsRange) {
  for (const char* name : {"loader_crane", "hmf_2020_k4", "excavator", "swing_crane",
                           "swing_crane_two_pumps", "urdf_crane", "emps"}) {
    const Machine machine = machine_at(name);
    const PlantParameters p = nominal(machine);
    const auto work = operator_work(machine, p, {3, 60.0, 0.02, std::nullopt});
    const std::vector<Record> records = driven(machine, p, *work, 60.0);
    for (const Cylinder& c : machine.cylinders) {
      const auto j = static_cast<std::size_t>(c.joint);
      const Range range = machine.joints[j].position;
      double lo = records.front().q[j], hi = lo;
      for (const Record& r : records) {
        lo = std::min(lo, r.q[j]);
        hi = std::max(hi, r.q[j]);
      }
      EXPECT_GT(hi - lo, 0.1 * (range.hi - range.lo)) << name << ' ' << c.name;
      // A stop yields: an excavator's boom that sinks into it at 0.2 rad/s, because its port relief valve limits the pressure
      // that could hold it, presses it together by 0.012 rad.
      EXPECT_GT(lo, range.lo - 0.02) << name << ' ' << c.name;
      EXPECT_LT(hi, range.hi + 0.02) << name << ' ' << c.name;
    }
  }
}

TEST(PlantProgrammes, TheSameSeedGivesTheSameRun) {
  const Machine machine = machine_at("loader_crane");
  const PlantParameters p = nominal(machine);
  std::vector<Record> runs[2];
  for (auto& records : runs) {
    const auto work = operator_work(machine, p, {5, 10.0, 0.02, std::nullopt});
    records = driven(machine, p, *work, 10.0);
  }
  EXPECT_EQ(runs[0].back().q, runs[1].back().q);
  EXPECT_EQ(runs[0].back().pressure_a, runs[1].back().pressure_a);
}

TEST(PlantProgrammes, AWorkCycleTakesALoadLiftsItAndPutsItDownElsewhere) {
  const Machine machine = machine_at("swing_crane");
  const PlantParameters p = nominal(machine);
  const auto cycles = work_cycles(machine, p, {2, 120.0, 0.02, std::nullopt});
  const std::vector<Record> records = driven(machine, p, *cycles, 120.0);
  std::vector<Eigen::Vector3d> taken, put;
  double highest = -1e9;
  for (std::size_t i = 1; i < records.size(); ++i) {
    const Eigen::VectorXd q =
        Eigen::Map<const Eigen::VectorXd>(records[i].q.data(), machine.joint_count());
    const Eigen::Vector3d tip = tip_position<double>(machine, q);
    if (records[i].payload > 0.0 && put.empty()) highest = std::max(highest, tip.z());
    if (records[i].payload > records[i - 1].payload) taken.push_back(tip);
    if (records[i].payload < records[i - 1].payload) put.push_back(tip);
  }
  ASSERT_GE(taken.size(), 1U);
  ASSERT_GE(put.size(), 1U);
  EXPECT_GT((put[0] - taken[0]).norm(), 0.5);
  EXPECT_GT(highest, std::max(taken[0].z(), put[0].z()) + 0.2);
}

TEST(PlantProgrammes, ATrackedMotionIsFollowed) {
  const Machine machine = machine_at("loader_crane");
  const PlantParameters p = nominal(machine);
  TimeTable motion;
  const int rows = 601;
  motion.t = Eigen::VectorXd::LinSpaced(rows, 5.0, 17.0);  // time may begin anywhere
  motion.values.resize(rows, 3);
  const Eigen::Vector3d from(0.4, -1.2, 2.0), to(0.7, -0.9, 3.2);
  for (int i = 0; i < rows; ++i) {
    const double s = std::min(1.0, i / 500.0);
    motion.values.row(i) = from + 0.5 * (1.0 - std::cos(std::numbers::pi * s)) * (to - from);
  }
  motion.start = {from[0], from[1], from[2]};
  motion.start_payload = 300.0;
  const auto track = tracked_motion(machine, p, motion);
  const std::vector<Record> records = driven(machine, p, *track, 30.0);
  EXPECT_NEAR(records.back().t, 12.0, 0.05);
  double worst = 0.0;
  for (std::size_t i = 0; i < records.size(); ++i)
    for (int k = 0; k < 2; ++k)
      worst = std::max(
          worst, std::abs(records[i].q[static_cast<std::size_t>(k)] -
                          motion.values(
                              std::min<Eigen::Index>(static_cast<Eigen::Index>(i), rows - 1), k)));
  EXPECT_LT(worst, 0.03);                         // on the way, with spool and pump lag
  EXPECT_NEAR(records.back().q[0], to[0], 0.01);  // and at the end
  EXPECT_NEAR(records.back().q[2], to[2], 0.02);
}

TEST(PlantProgrammes, ReplayedCommandsReachTheValvesAsTheyAre) {
  const Machine machine = machine_at("loader_crane");
  TimeTable table;
  table.t = Eigen::Vector3d(0.0, 1.0, 2.0);
  table.values.resize(3, 3);
  table.values << 0.0, 0.0, 0.0, 0.4, 0.0, -2.0, 0.0, 0.0, 0.0;
  table.payload = Eigen::Vector3d(0.0, 200.0, 200.0);
  table.start = {0.5, -1.0, 3.0};
  const auto replay = replayed_commands(table);
  Record r;
  r.t = 1.5;
  r.payload = 0.0;
  ProgrammeStep s = replay->step(r);
  EXPECT_EQ(s.command, (std::vector<double>{0.4, 0.0, -1.0}));
  EXPECT_EQ(s.payload, 200.0);
  r.payload = 200.0;
  EXPECT_FALSE(replay->step(r).payload.has_value());
  r.t = 2.5;
  EXPECT_TRUE(replay->step(r).end);
}

/// Numbers of a log's rows, NaN for an empty cell.
std::vector<std::vector<double>> numbers(const std::string& text) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(text);
  std::string line;
  bool header = true;
  while (std::getline(lines, line)) {
    if (line.starts_with("#")) continue;
    if (std::exchange(header, false)) continue;
    std::vector<double> row;
    std::istringstream cells(line + ",");
    std::string cell;
    while (std::getline(cells, cell, ',')) row.push_back(cell.empty() ? NAN : std::stod(cell));
    rows.push_back(row);
  }
  return rows;
}

/// A log of a machine whose bore pressure of the boom rises by 1 bar in each of 2000 samples of 10 ms.
std::vector<std::vector<double>> rising(const std::vector<std::string>& effects) {
  const Machine machine = machine_at("loader_crane");
  const PlantParameters p = nominal(machine, effects);
  PlantRun run(machine, p, {0.5, -1.0, 3.0}, 0.0);
  LogWriter log(machine, p, 1, "");
  Record r = run.record();
  for (int i = 0; i < 2000; ++i) {
    r.t = 0.01 * i;
    r.pressure_a[0] = 1e5 * i;
    log.add(r);
  }
  return numbers(log.text(""));
}
constexpr std::size_t kBorePressure = 1 + 3 + 3;  // behind time, positions and commands

TEST(PlantSensors, NoiseOffsetDelayAndQuantisationAreWhatTheirParametersSay) {
  EXPECT_DOUBLE_EQ(rising({"none"})[1000][kBorePressure], 1000.0);
  const auto coarse = rising({"none", "quantisation=7"});
  EXPECT_NEAR(coarse[1000][kBorePressure], 1001.0, 1e-9);  // 143 steps
  const auto late = rising({"none", "sensor_delay=0.2"});
  EXPECT_NEAR(late[1000][kBorePressure], 980.0, 0.051);
  const auto shifted = rising({"none", "pressure_offset:boom=3"});
  EXPECT_NEAR(shifted[1000][kBorePressure], 1003.0, 0.051);
  const auto noisy = rising({"none", "sensor_noise=2"});
  double square = 0.0;
  for (std::size_t i = 0; i < noisy.size(); ++i)
    square += std::pow(noisy[i][kBorePressure] - static_cast<double>(i), 2);
  // 2000 draws: the standard deviation of the estimate is 1.6 %
  EXPECT_NEAR(std::sqrt(square / 2000.0), 2.0, 0.13);
}

/// The payload that a log tells is the mass that acts at the tip, also where only the hook hangs there.
TEST(PlantSensors, AnEmptyHookIsToldAsPayload) {
  const Machine machine = machine_at("loader_crane");
  PlantParameters p = nominal(machine, {"none"});
  for (const double rope : {0.0, 1.5}) {
    p.pendulum.rope_length = rope;
    PlantRun run(machine, p, {0.5, -1.0, 3.0}, 0.0);
    LogWriter log(machine, p, 1, "");
    for (const double payload : {0.0, 300.0}) {
      Record r = run.record();
      r.payload = payload;
      log.add(r);
    }
    const auto rows = numbers(log.text(""));
    const std::size_t column = rows[0].size() - 2;  // before the oil's temperature
    EXPECT_EQ(rows[0][column], rope > 0.0 ? p.pendulum.hook_mass : 0.0);
    EXPECT_EQ(rows[1][column], 300.0);
  }
}

TEST(PlantSensors, DropOutsLeaveEmptyCellsInSingleChannels) {
  const auto rows = rising({"none", "drop_outs=0.5"});
  int empty = 0, whole = 0;
  for (const auto& row : rows) {
    if (std::isnan(row[kBorePressure])) {
      ++empty;
      whole += std::isnan(row[kBorePressure + 1]) ? 1 : 0;
    }
  }
  EXPECT_GT(empty, 20);  // ten gaps of 0.04 to 0.4 s are expected in twenty seconds
  EXPECT_LT(empty, 800);
  EXPECT_LT(whole, empty);
  EXPECT_EQ(std::count_if(rows.begin(), rows.end(), [](const auto& r) { return std::isnan(r[4]); }),
            0);
}

}  // namespace
}  // namespace sparflow::plant
