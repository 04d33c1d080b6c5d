/// How far a change of a plant shows in the sensors: what must hold whatever the plant does.
#include "studies/plants/change_in_noise.h"

#include <gtest/gtest.h>

#include <vector>

#include "models/files/machine_file.h"

namespace sparflow::bench {
namespace {

using plant::PlantParameters;
using plant::Record;

/// The loader crane that lifts and reaches for five seconds, nominal but rigid and with the payload at its tip.
class PlantChangeInSensors : public testing::Test {
 protected:
  Machine machine =
      load_machine(std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/loader_crane.yaml");
  PlantParameters built = plain();

  /// Records as the runs of change_in_noise see them: posture, commands and payload of each row.
  std::vector<Record> records(double payload) const {
    std::vector<double> q;
    for (const Joint& j : machine.joints) q.push_back(0.5 * (j.position.lo + j.position.hi));
    plant::PlantRun run(machine, built, q, payload);
    std::vector<Record> rows;
    for (int k = 0; k < 250; ++k) {  // 5 s in steps of 20 ms
      rows.push_back(run.record());
      run.advance({0.3, 0.2, 0.0});
      rows.back().command = {0.3, 0.2, 0.0};
    }
    return rows;
  }

  double ratio(const PlantParameters& changed, double told = 1.0) const {
    return change_in_noise(machine, {built, changed, told}, records(500.0), 7).ratio;
  }

 private:
  PlantParameters plain() const {
    PlantParameters p = plant::default_parameters(machine);
    p.flex_angle = 0.0;
    p.pendulum.rope_length = 0.0;
    p.sensors.position_step = p.sensors.pressure_step = 0.0;  // noise alone
    return p;
  }
};

TEST_F(PlantChangeInSensors, NothingChangedShowsNothing) { EXPECT_EQ(ratio(built), 0.0); }

TEST_F(PlantChangeInSensors, APayloadOtherThanToldShowsInAPressureInProportion) {
  const auto one = change_in_noise(machine, {built, built, 1.01}, records(500.0), 7);
  const double two = ratio(built, 1.02);
  EXPECT_EQ(one.channel.substr(0, 1), "p") << one.channel;
  // the static force is linear in the payload, the way to it not quite
  EXPECT_NEAR(two / one.ratio, 2.0, 0.1);
}

TEST_F(PlantChangeInSensors, ALouderSensorHidesAChange) {
  PlantParameters changed = built;
  changed.cylinders[0].friction.coulomb *= 3.0;
  const double quiet = ratio(changed);
  built.sensors.pressure_noise *= 2.0;
  built.sensors.position_noise *= 2.0;
  changed.sensors = built.sensors;
  EXPECT_NEAR(ratio(changed) / quiet, 0.5, 1e-6);
}

TEST_F(PlantChangeInSensors, AnOffsetOfASensorShowsInItsOwnChannelBySizeOverNoise) {
  PlantParameters changed = built;
  changed.pressure_offset[1] += 20.0 * built.sensors.pressure_noise;
  const auto most = change_in_noise(machine, {built, changed, 1.0}, records(500.0), 7);
  EXPECT_EQ(most.channel, "pA_" + machine.cylinders[1].name + "_bar");
  // the noise's deviation from 250 rows is known to 4.5 %; 3.5 of these
  EXPECT_NEAR(most.ratio, 20.0, 3.2);
}

TEST_F(PlantChangeInSensors, ALogThatEndsBeforeAStretchTellsNothing) {
  const std::vector<Record> rows = records(500.0);
  PlantParameters changed = built;
  changed.cylinders[0].friction.coulomb *= 3.0;
  EXPECT_EQ(change_in_noise(machine, {built, changed, 1.0}, std::span(rows).first(100), 7).ratio,
            0.0);
  EXPECT_EQ(change_in_noise(machine, {built, changed, 1.0}, {}, 7).ratio, 0.0);
}

}  // namespace
}  // namespace sparflow::bench
