// An effect of one's own in C++: what docs/effects.md shows, compiled and used through the registry. The effect stands
// between the two marks as it stands there.
#include <gtest/gtest.h>

#include <filesystem>

#include "models/chain/crane_model.h"
#include "models/effects/instant.h"
#include "models/effects/registry.h"
#include "models/math/error.h"
#include "tests/models/effects/effects_support.h"

// [own effect]
#include "models/effects/effect.h"

namespace sparflow {
namespace {

/// Force of a balancing spring parallel to the cylinder: k (x - x0) beyond its free length x0.
class BalanceSpring final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "balance_spring",
        .title = "Balancing spring",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kCylinder,
        // linear ones first: name, unit, SI value of one unit, lower, upper, typical [SI], meaning, linear, grid [SI]
        .parameters = {{"k", "kN/m", 1e3, 0.0, 200e3, 20e3, "stiffness", true, {}},
                       {"x0", "m", 1.0, 0.5, 3.0, 1.0, "free length", false, {0.8, 1.2, 1.6}}},
        .equation = "F = F_static + k max(0, x - x0)",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"unmodelled_mass", "force_offset"},
        .separated_by = "the whole stroke at two payloads",
        .citation = "R. Hooke (1678), De Potentia Restitutiva",
        .in_motion = "force"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }

  /// T is double for logs and Jet for the optimiser, which takes its derivatives from it.
  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    const T stretched = s.length[i] - T(p[1]);
    if (stretched > T(0.0)) out[i] += p[0] * stretched;
  }
  SPARFLOW_EFFECT_LAW(add_force)
};

}  // namespace
}  // namespace sparflow
// [/own effect]

namespace sparflow {
namespace {

const Effect* balance_spring() {
  static const Effect* added = add_user_effect(std::make_unique<BalanceSpring>());
  return added;
}

TEST(OwnEffect, IsInTheCatalogueWithItsPlaces) {
  const Machine machine = test_support::loader_crane();
  EXPECT_EQ(find_effect("balance_spring"), balance_spring());
  const EffectAt place = parse_effect("balance_spring:boom", machine);
  EXPECT_EQ(place.effect, balance_spring());
  EXPECT_EQ(place.at, 0);
  EXPECT_THROW(add_user_effect(std::make_unique<BalanceSpring>()), InputError);
}

TEST(EffectKey, ANearWordOrABeginningIsSuggested) {
  const Machine machine = test_support::loader_crane();
  const auto suggested = [&](const std::string& key) {
    try {
      parse_effect(key, machine);
    } catch (const InputError& error) {
      const std::string text = error.what();
      const std::size_t at = text.find("did you mean '");
      if (at == std::string::npos) return std::string();
      const std::size_t from = at + 14;
      return text.substr(from, text.find('\'', from) - from);
    }
    return std::string("accepted");
  };
  EXPECT_EQ(suggested("coulomb_fricton:boom"), "coulomb_friction");
  EXPECT_EQ(suggested("coulomb:boom"), "coulomb_friction");
  EXPECT_EQ(suggested("unmodelled"), "unmodelled_mass");
  EXPECT_EQ(suggested("gremlins"), "");
}

TEST(OwnEffect, ActsInTheModel) {
  CraneModel model = CraneModel::untrained(test_support::loader_crane());
  const int n = model.machine.joint_count();
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(n, 0.3), qd = Eigen::VectorXd::Zero(n);
  Chain without(model);
  const CylinderState before = without.evaluate({q.data(), qd.data()}, 0.0).cylinders[0];
  const double loose = before.length - 0.1;
  model.effects = {{balance_spring(), 0, {20e3, loose}, {}, {}}};
  Chain with(model);
  const CylinderState after = with.evaluate({q.data(), qd.data()}, 0.0).cylinders[0];
  EXPECT_NEAR(after.total_force - before.total_force, 20e3 * 0.1, 1e-6);
}

TEST(OwnEffect, ColumnsComeFromItsLaw) {
  const Machine machine = test_support::loader_crane();
  const Eigen::Index n = machine.joint_count();
  const auto motion = [&](double t) {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(3 * n);
    x.head(n).setConstant(0.2 + 0.1 * t);
    x.segment(n, n).setConstant(0.1);
    return x;
  };
  const MachineSeries log = test_support::log_of(machine, motion, 2.0, 0.1, 0.0);
  const double loose[] = {log.cylinders[0].length.mean()};
  Eigen::MatrixXd columns;
  ASSERT_TRUE(balance_spring()->columns(log, {EvidenceKind::kForce, 0}, 0, loose, columns));
  ASSERT_EQ(columns.cols(), 1);
  for (Eigen::Index k = 0; k < log.samples(); ++k) {
    EXPECT_NEAR(columns(k, 0), std::max(0.0, log.cylinders[0].length[k] - loose[0]), 1e-12) << k;
  }
  EXPECT_FALSE(balance_spring()->columns(log, {EvidenceKind::kForce, 1}, 0, loose, columns));
}

/// Text between a mark and its end, without the lines of the marks.
std::string between(const std::string& text, const std::string& mark, const std::string& end) {
  const std::size_t from = text.find(mark);
  if (from == std::string::npos) return "";
  const std::size_t first = text.find('\n', from) + 1, last = text.find(end, first);
  return last == std::string::npos ? "" : text.substr(first, last - first);
}

TEST(OwnEffect, DocumentationShowsThisCode) {
  const std::string path = SPARFLOW_SOURCE_DIR "/docs/effects.md";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no docs/effects.md";
  const std::string page = read_file(path);
  if (page.find("public Effect") == std::string::npos) GTEST_SKIP() << "no example in C++ there";
  const std::string code =
      between(read_file(SPARFLOW_SOURCE_DIR "/tests/models/effects/own_effect_test.cpp"),
              "// [own effect]", "// [/own effect]");
  ASSERT_FALSE(code.empty());
  EXPECT_NE(page.find(code), std::string::npos)
      << "the C++ example of docs/effects.md is not the one this test compiles";
}

}  // namespace
}  // namespace sparflow
