// Models that must be refused, each with the message that the user sees.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "models/files/model_file.h"
#include "models/math/error.h"
#include "tests/models/files/broken_model_support.h"

namespace sparflow {
namespace {

using Json = nlohmann::ordered_json;

struct BrokenModel {
  const char* name;
  std::string (*make)(std::string good);
  std::vector<std::string> message;  ///< every piece must stand in the message
};

std::string edited(const std::string& good, void (*edit)(Json&)) {
  Json root = Json::parse(good);
  edit(root);
  return root.dump();
}
Json& process(Json& root) { return root["cylinders"][0]["extend"]; }
Json friction(const char* at) {
  const Json fc = {{"name", "Fc"}, {"value", 4e3}, {"ci95", nullptr}};
  return {{"id", "coulomb_friction"}, {"at", at}, {"parameters", Json::array({fc})}};
}

const BrokenModel kBroken[] = {
    {"empty",
     [](std::string) -> std::string { return " \n"; },
     {"broken.json", "the file is empty"}},
    {"not_json",
     [](std::string) -> std::string { return "machine: crane\n"; },
     {"broken.json:1:1", "this is not JSON", "sparflow fit"}},
    {"list",
     [](std::string) -> std::string { return "[1, 2]\n"; },
     {"broken.json:1:1", "not a JSON object but a list", "sparflow fit"}},
    {"truncated",
     [](std::string good) { return good.substr(0, good.size() / 2); },
     {"broken.json:", "ends in the middle", "copied completely"}},
    {"syntax",
     [](std::string) -> std::string { return "{\n  \"sparflow_model\": 1,\n  oops\n}"; },
     {"broken.json:3:3", "not valid JSON"}},
    {"nan",
     [](std::string good) {
       const std::size_t at = good.find("\"margin\": ") + 10;
       return good.replace(at, good.find(',', at) - at, "NaN");
     },
     {"broken.json:", "not valid JSON"}},
    {"huge_number",
     [](std::string good) {
       const std::size_t at = good.find("\"margin\": ") + 10;
       return good.replace(at, good.find(',', at) - at, "1e999");
     },
     {"broken.json", "too large"}},
    {"other_json",
     [](std::string) -> std::string { return "{\"name\": \"x\"}"; },
     {"broken.json", "not a model", "sparflow_model"}},
    {"too_new",
     [](std::string good) { return edited(good, [](Json& r) { r["sparflow_model"] = 2; }); },
     {"sparflow_model", "got version 2", "reads up to 1", "update it"}},
    {"version_text",
     [](std::string good) { return edited(good, [](Json& r) { r["sparflow_model"] = "1"; }); },
     {"sparflow_model", "got \"1\"", "expected a version"}},
    {"missing_key",
     [](std::string good) { return edited(good, [](Json& r) { process(r).erase("noise_std"); }); },
     {"cylinders[arm].extend.noise_std", "missing", "expected a number [Pa]"}},
    {"missing_pumps",
     [](std::string good) { return edited(good, [](Json& r) { r.erase("pumps"); }); },
     {"pumps", "missing", "main"}},
    {"unknown_key",
     [](std::string good) { return edited(good, [](Json& r) { process(r)["lenght_flow"] = 1; }); },
     {"cylinders[arm].extend", "unknown key \"lenght_flow\"", "did you mean \"length_flow\""}},
    {"weights_and_centres",
     [](std::string good) { return edited(good, [](Json& r) { process(r)["flow"].erase(0); }); },
     {"cylinders[arm].extend.flow", "a list of 3", "expected 4 numbers"}},
    {"no_centre",
     [](std::string good) {
       return edited(good, [](Json& r) { process(r)["weight"] = Json::array(); });
     },
     {"cylinders[arm].extend.weight", "at least one centre"}},
    {"core_size",
     [](std::string good) {
       return edited(good, [](Json& r) { process(r)["variance_core"].erase(0); });
     },
     {"variance_core", "a list of 20", "expected 21 numbers", "6 x 6"}},
    {"null_number",
     [](std::string good) {
       return edited(good, [](Json& r) { process(r)["weight"][2] = nullptr; });
     },
     {"cylinders[arm].extend.weight[2]", "got null", "expected a finite number"}},
    {"text_number",
     [](std::string good) {
       return edited(good, [](Json& r) { process(r)["mean_slope"] = "33,3"; });
     },
     {"mean_slope", "got \"33,3\"", "[Pa/N]"}},
    {"negative_length",
     [](std::string good) {
       return edited(good, [](Json& r) { process(r)["length_force"] = -1.0; });
     },
     {"length_force", "got -1.0", "expected a positive number [N]"}},
    {"range_turned",
     [](std::string good) {
       return edited(good, [](Json& r) { process(r)["flow_range"] = {2.0, 1.0}; });
     },
     {"flow_range", "lo <= hi"}},
    {"negative_margin",
     [](std::string good) {
       return edited(good, [](Json& r) { r["cylinders"][0]["margin"] = -5; });
     },
     {"cylinders[arm].margin", "got -5", "[Pa]"}},
    {"other_cylinder",
     [](std::string good) {
       return edited(good, [](Json& r) { r["cylinders"][0]["name"] = "boom"; });
     },
     {"cylinders[0].name", "got \"boom\"", "expected \"arm\""}},
    {"cylinder_twice",
     [](std::string good) {
       return edited(good, [](Json& r) { r["cylinders"].push_back(r["cylinders"][0]); });
     },
     {"cylinders", "2 element(s)", "one element for each", "arm"}},
    {"effect_unknown",
     [](std::string good) {
       return edited(good, [](Json& r) { r["effects"].push_back({{"id", "coulomb_frictoin"}}); });
     },
     {"effects[0].id", "does not know the physical effect \"coulomb_frictoin\"",
      "did you mean \"coulomb_friction\"", "Update the program"}},
    {"effect_place",
     [](std::string good) {
       return edited(good, [](Json& r) { r["effects"].push_back(friction("boom")); });
     },
     {"effects[0].at", "got \"boom\"", "arm"}},
    {"effect_parameters",
     [](std::string good) {
       return edited(good, [](Json& r) {
         r["effects"].push_back(friction("arm"));
         r["effects"][0]["parameters"] = Json::array();
       });
     },
     {"effects[0].parameters", "one element for each parameter", "Fc"}},
    {"effect_other_parameter",
     [](std::string good) {
       return edited(good, [](Json& r) {
         r["effects"].push_back(friction("arm"));
         r["effects"][0]["parameters"][0]["name"] = "mu";
       });
     },
     {"effects[0].parameters[0].name", "got \"mu\"", "\"Fc\""}},
    {"effect_interval",
     [](std::string good) {
       return edited(good, [](Json& r) {
         r["effects"].push_back(friction("arm"));
         r["effects"][0]["parameters"][0]["ci95"] = {2.0, 1.0};
       });
     },
     {"effects[0].parameters[0].ci95", "[lower, upper] or null"}},
    {"step",
     [](std::string good) {
       return edited(good, [](Json& r) { r["steps"].push_back({{"added", "inertia"}}); });
     },
     {"steps[0].removed", "missing"}},
    {"hash",
     [](std::string good) { return edited(good, [](Json& r) { r["data"][0]["sha256"] = "abc"; }); },
     {"data[0].sha256", "got \"abc\"", "64 hexadecimal digits"}},
    {"rows",
     [](std::string good) { return edited(good, [](Json& r) { r["data"][0]["rows"] = -1; }); },
     {"data[0].rows", "got -1", "whole number"}},
    {"use",
     [](std::string good) { return edited(good, [](Json& r) { r["data"][0]["use"] = "trian"; }); },
     {"data[0].use", "got \"trian\"", "\"train\" or \"test\""}},
    {"machine_yaml",
     [](std::string good) {
       return edited(good, [](Json& r) {
         std::string yaml = r["machine"]["yaml"];
         yaml.replace(yaml.find("bore: 0.12"), 10, "bore: -0.1");
         r["machine"]["yaml"] = yaml;
       });
     },
     {"broken.json (machine.yaml):", "bore", "-0.1"}},
    {"machine_no_text",
     [](std::string good) { return edited(good, [](Json& r) { r["machine"]["yaml"] = 3; }); },
     {"machine.yaml", "got 3", "the machine file's text"}},
};

class BrokenModels : public testing::TestWithParam<BrokenModel> {};

TEST_P(BrokenModels, IsRefusedWithAMessage) {
  const std::string text = GetParam().make(model_to_json(small_model()));
  try {
    model_from_json(text, "broken.json");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    for (const std::string& piece : GetParam().message) {
      EXPECT_THAT(std::string(error.what()), testing::HasSubstr(piece));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, BrokenModels, testing::ValuesIn(kBroken),
                         [](const auto& model) { return std::string(model.param.name); });

// Every truncated or overwritten file gives an error message, never a crash, and no truncation goes unnoticed.
TEST(BrokenModelFiles, EveryCutIsAnError) {
  const std::string good = model_to_json(small_model());
  for (std::size_t length = 0; length + 2 < good.size(); length += 7) {
    EXPECT_THROW(model_from_json(good.substr(0, length), "broken.json"), InputError) << length;
  }
}

}  // namespace
}  // namespace sparflow
