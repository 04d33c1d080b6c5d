/// The catalogue's entries and their texts.
#include <gtest/gtest.h>

#include "models/effects/effect_text.h"
#include "models/effects/registry.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

TEST(Catalogue, EveryEntryIsCompleteAndPlausible) {
  for (const auto& e : effect_catalogue()) {
    const EffectInfo& info = e->info();
    SCOPED_TRACE(info.id);
    EXPECT_FALSE(info.title.empty() || info.equation.empty() || info.citation.empty());
    EXPECT_FALSE(info.separated_by.empty() || info.in_motion.empty() || info.signals.empty());
    EXPECT_FALSE(e->shows_in().empty());
    bool shapes = false;
    for (const EffectParameter& p : info.parameters) {
      EXPECT_LT(p.lower, p.upper) << p.name;
      EXPECT_GE(p.typical, p.lower) << p.name;
      EXPECT_LE(p.typical, p.upper) << p.name;
      EXPECT_FALSE(p.meaning.empty()) << p.name;
      EXPECT_FALSE(p.linear && shapes) << "linear parameters come first";
      shapes = shapes || !p.linear;
      EXPECT_EQ(p.variants.size(), p.choice ? p.grid.size() : 0u) << p.name;
      for (std::size_t v = 0; v < p.variants.size(); ++v)
        EXPECT_EQ(variant_text(p, p.grid[v]), p.variants[v]);
      EXPECT_EQ(variant_text(p, -0.25), "") << p.name;
    }
    EXPECT_NE(effect_table().find(effect_signature(info)), std::string::npos);
    const std::string entry = effect_entry(*e);
    for (const EffectParameter& p : info.parameters) {
      EXPECT_NE(entry.find(p.name + ": "), std::string::npos);
    }
    for (const char* heading : {"equation", "needs", "shows in", "separated by", "source"}) {
      EXPECT_NE(entry.find(heading), std::string::npos) << heading;
    }
  }
}

TEST(Catalogue, ContainsSensorFaultsAndSuggestsNearIds) {
  EXPECT_NE(effect_table().find("sensor_fault:<channel>"), std::string::npos);
  EXPECT_NE(effect_entry(std::string("sensor_fault:pA_boom")).find("bad data"), std::string::npos);
  EXPECT_NE(effect_entry(std::string("coulomb_friction:boom")).find("Coulomb"), std::string::npos);
  try {
    effect_entry(std::string("colomb_friction"));
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("coulomb_friction"), std::string::npos);
  }
  EXPECT_NE(effects_json().find("\"sensor_fault\""), std::string::npos);
}

}  // namespace
}  // namespace sparflow
