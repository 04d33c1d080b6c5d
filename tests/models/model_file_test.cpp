#include "models/model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "broken_model_support.h"
#include "models/error.h"

namespace sparflow {
namespace {

using testing::HasSubstr;

TEST(ModelFile, ReadsBackEveryNumberExactly) {
  const CraneModel model = small_model();
  const CraneModel read = model_from_json(model_to_json(model), "m.json");
  ASSERT_EQ(read.cylinders.size(), model.cylinders.size());
  for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
    EXPECT_EQ(read.cylinders[i].margin, model.cylinders[i].margin);
    EXPECT_EQ(read.cylinders[i].valve_gain_extend, model.cylinders[i].valve_gain_extend);
    EXPECT_EQ(read.cylinders[i].valve_gain_retract, model.cylinders[i].valve_gain_retract);
    EXPECT_EQ(read.cylinders[i].retract.empty(), model.cylinders[i].retract.empty());
    const GpParameters& a = model.cylinders[i].extend.parameters();
    const GpParameters& b = read.cylinders[i].extend.parameters();
    EXPECT_EQ(a.length_flow, b.length_flow);
    EXPECT_EQ(a.length_force, b.length_force);
    EXPECT_EQ(a.signal_std, b.signal_std);
    EXPECT_EQ(a.noise_std, b.noise_std);
    EXPECT_EQ(a.mean_constant, b.mean_constant);
    EXPECT_EQ(a.mean_slope, b.mean_slope);
    EXPECT_EQ(a.data_count, b.data_count);
    EXPECT_EQ(a.flow_min, b.flow_min);
    EXPECT_EQ(a.force_max, b.force_max);
    EXPECT_TRUE((a.flow == b.flow).all());
    EXPECT_TRUE((a.force == b.force).all());
    EXPECT_TRUE((a.weight == b.weight).all());
    EXPECT_EQ(a.variance_core, b.variance_core);
  }
  EXPECT_EQ(read.pumps[0].standby, model.pumps[0].standby);
  EXPECT_EQ(read.machine.source_text, model.machine.source_text);
  ASSERT_EQ(read.data.size(), 1u);
  EXPECT_EQ(read.data[0].sha256, model.data[0].sha256);
  ASSERT_EQ(read.quality.size(), 2u);
  EXPECT_EQ(read.quality[0].rmse, model.quality[0].rmse);
  EXPECT_TRUE(std::isnan(read.quality[1].fit_percent)) << "a constant signal has no fit";
}

TEST(ModelFile, GivesTheSamePressuresAfterALoad) {
  const CraneModel model = small_model();
  const CraneModel read = model_from_json(model_to_json(model), "m.json");
  const GaussianProcess& a = model.cylinders[0].extend;
  const GaussianProcess& b = read.cylinders[0].extend;
  for (const double flow : {1e-5, 3e-4, 2e-3}) {
    EXPECT_EQ(a.mean(flow, 5e4), b.mean(flow, 5e4));
    EXPECT_EQ(a.variance(flow, 5e4), b.variance(flow, 5e4));
  }
}

TEST(ModelFile, IsTheSameTextEveryTime) {
  const std::string text = model_to_json(small_model());
  EXPECT_EQ(text, model_to_json(model_from_json(text, "m.json")));
}

TEST(ModelFile, KeepsAnUntrainedModel) {
  CraneModel model = CraneModel::untrained(small_model().machine);
  const CraneModel read = model_from_json(model_to_json(model), "m.json");
  EXPECT_FALSE(read.complete());
  EXPECT_EQ(read.missing(), model.missing());
}

TEST(ModelFile, SavesAndLoads) {
  const std::string path =
      (std::filesystem::path(testing::TempDir()) / "sparflow_model_file_test.json").string();
  save_model(small_model(), path);
  EXPECT_EQ(model_to_json(load_model(path)), model_to_json(small_model()));
  std::filesystem::remove(path);
  EXPECT_THROW(load_model(path), InputError);
  EXPECT_THROW(save_model(small_model(), "no/such/folder/m.json"), InputError);
}

TEST(ModelFile, SaysWhichVersionWroteIt) {
  EXPECT_THAT(model_to_json(small_model()),
              HasSubstr(std::string("\"program\": \"sparflow ") + program_version()));
  EXPECT_THAT(model_to_json(small_model()), HasSubstr("\"sparflow_model\": 1"));
}

}  // namespace
}  // namespace sparflow
