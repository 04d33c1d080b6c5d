/// Each hidden effect changes the channels that it should and no others, by an amount above the noise.
#include <map>
#include <set>

#include "tests/simulator/hidden_log_support.h"

namespace sparflow::simulator {
namespace {

enum class Changes { kPressures, kMotion, kPump, kOwnChannel, kPosition };

const std::map<std::string, Changes>& expectations() {
  static const std::map<std::string, Changes> table = {
      {"coulomb_friction", Changes::kPressures},
      {"viscous_friction", Changes::kPressures},
      {"stribeck_friction", Changes::kPressures},
      {"load_friction", Changes::kPressures},
      {"presliding", Changes::kPressures},
      {"pad_friction", Changes::kPressures},
      {"end_cushion", Changes::kPressures},
      {"force_offset", Changes::kPressures},
      {"inertia", Changes::kPressures},
      {"unmodelled_mass", Changes::kPressures},
      {"payload_error", Changes::kPressures},
      {"base_tilt", Changes::kPressures},
      {"angle_offset", Changes::kPosition},
      {"structural_flex", Changes::kPressures},
      {"return_back_pressure", Changes::kPressures},
      {"line_loss", Changes::kPump},
      {"counterbalance", Changes::kPressures},
      {"oil_temperature", Changes::kPressures},
      {"valve_deadband", Changes::kMotion},
      {"valve_lag", Changes::kMotion},
      {"valve_pressure_drop", Changes::kMotion},
      {"flow_saturation", Changes::kMotion},
      {"leakage", Changes::kMotion},
      {"compressibility", Changes::kMotion},
      {"pump_lag", Changes::kPump},
      {"flow_dependent_margin", Changes::kPump},
      {"torque_limit", Changes::kPump},
      {"pressure_offset", Changes::kOwnChannel},
      {"sensor_delay", Changes::kOwnChannel},
      {"sensor_fault", Changes::kOwnChannel},
      {"pump_ripple", Changes::kPump},
      {"pump_hunting", Changes::kPump},
      {"pose_margin", Changes::kPump},
      {"spool_hysteresis", Changes::kMotion},
      {"engine_droop", Changes::kMotion},
      {"cubic_gain", Changes::kMotion},
      {"sensor_crosstalk", Changes::kOwnChannel},
      {"pressure_drift", Changes::kOwnChannel},
      {"structural_vibration", Changes::kPressures},
      {"friction_bump", Changes::kPressures},
      {"payload_swing", Changes::kPressures}};
  return table;
}

GeneratedLog with(const LogRequest& base, std::vector<HiddenEffect> effects) {
  LogRequest request = base;
  request.effects = std::move(effects);
  return generate(request);
}

class HiddenEffectTest : public ::testing::TestWithParam<std::string> {};

TEST_P(HiddenEffectTest, TouchesItsChannelsOnly) {
  const std::string id = GetParam();
  LogRequest base = quiet_request(machine_named("loader_crane"), 120.0);
  if (id == "sensor_fault")
    base.noise_factor = 1.0;  // This effect multiplies the channel's noise, so there must be some.
  const auto& all = effect_descriptions();
  const auto description =
      std::find_if(all.begin(), all.end(), [&](const auto& e) { return e.id == id; });
  for (std::size_t law = 0; law < description->laws.size(); ++law) {
    SCOPED_TRACE(description->laws[law]);
    const HiddenEffect effect{id, "", 1.0, static_cast<int>(law)};
    LogRequest without = base;
    without.absent = {effect};
    const GeneratedLog plain = generate(without);
    const GeneratedLog hidden = with(base, {effect});
    ASSERT_EQ(hidden.truth.size(), 1u);
    EXPECT_EQ(hidden.truth[0].law, static_cast<int>(law));
    double motion = 0.0, pressures = 0.0, pump = difference(plain, hidden, "p_main_bar");
    int channels = 0;
    for (std::size_t c = 0; c < plain.names.size(); ++c) {
      const std::string& name = plain.names[c];
      const double d = difference(plain, hidden, name);
      channels += d > 0.0;
      if (name.rfind("q_", 0) == 0) motion = std::max(motion, d);
      if (name.rfind("pA_", 0) == 0 || name.rfind("pB_", 0) == 0)
        pressures = std::max(pressures, d);
      // Payloads change in pauses, whose times shift when the motions differ.
      const bool shifted = name == "payload_kg" && expectations().at(id) != Changes::kMotion;
      if (shifted || name == "oil_C" || name == "t_s") {
        EXPECT_EQ(d, 0.0) << name;
      }
    }
    // A clear effect reaches at least 1 bar somewhere; positions are rounded to 1e-4.
    switch (expectations().at(id)) {
      case Changes::kPressures:
        EXPECT_EQ(motion, 0.0);
        EXPECT_GT(pressures, 1.0);
        break;
      case Changes::kPump:
        EXPECT_EQ(motion, 0.0);
        EXPECT_EQ(pressures, 0.0);
        EXPECT_GT(pump, 1.0);
        break;
      case Changes::kMotion:
        EXPECT_GT(motion, 1e-3);
        break;
      case Changes::kPosition:
        EXPECT_GT(motion, 5e-3);
        EXPECT_EQ(pressures, 0.0);
        EXPECT_EQ(pump, 0.0);
        break;
      case Changes::kOwnChannel:
        EXPECT_TRUE(channels == 1 || id == "sensor_delay") << channels;
        EXPECT_GT(std::max({pressures, pump, 1e3 * motion}), 1.0);
        break;
    }
  }
}

TEST_P(HiddenEffectTest, AThirdIsSmaller) {
  const std::string id = GetParam();
  if (expectations().at(id) == Changes::kMotion) GTEST_SKIP() << "motions part ways in time";
  if (id == "sensor_fault") GTEST_SKIP() << "a stuck sensor is not stuck by a third";
  const LogRequest base = quiet_request(machine_named("loader_crane"), 120.0);
  const auto effect = [&](double size) {
    LogRequest without = base;
    const HiddenEffect e{id, "", size, 0};
    without.absent = {e};
    const GeneratedLog plain = generate(without), hidden = with(base, {e});
    double square = 0.0;
    for (std::size_t c = 0; c < plain.columns.size(); ++c) {
      for (std::size_t i = 0; i < plain.rows(); ++i) {
        const double d = hidden.columns[c][i] - plain.columns[c][i];
        square += d * d;
      }
    }
    return square;
  };
  const double clear = effect(1.0);
  EXPECT_GT(clear, 0.0);
  EXPECT_LT(effect(1.0 / 3.0), 0.6 * clear);
}

INSTANTIATE_TEST_SUITE_P(All, HiddenEffectTest, ::testing::ValuesIn([] {
                           std::vector<std::string> ids;
                           for (const auto& e : effect_descriptions()) ids.push_back(e.id);
                           return ids;
                         }()),
                         [](const auto& param) { return param.param; });

TEST(HiddenEffects, TheCatalogueIsCoveredWithAtLeastTwoLaws) {
  std::set<std::string> ids;
  for (const EffectDescription& e : effect_descriptions()) {
    EXPECT_TRUE(ids.insert(e.id).second) << e.id;
    EXPECT_TRUE(!e.in_catalogue || e.laws.size() >= 2) << e.id;
  }
  EXPECT_GE(outside_ids().size(), 10u);
  EXPECT_GE(catalogue_ids().size(), 29u);
}

TEST(HiddenEffects, TextBookLawsHaveTheirOwnEquivalent) {
  // A linear law is its own text-book equivalent; smooth signs change it by less than 3 % above 2 mm/s.
  LogRequest base = quiet_request(machine_named("loader_crane"), 120.0);
  for (const char* id : {"coulomb_friction", "viscous_friction", "load_friction", "line_loss",
                         "flow_dependent_margin", "return_back_pressure", "leakage"}) {
    const GeneratedLog log = with(base, {{id, "", 1.0, 0}});
    const HiddenParameter& p = log.truth[0].parameters[0];
    EXPECT_NEAR(p.equivalent / p.value, 1.0, 0.03) << id;
  }
}

}  // namespace
}  // namespace sparflow::simulator
