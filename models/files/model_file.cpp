#include "models/files/model_file.h"

#include <fmt/format.h>

#include <limits>
#include <stdexcept>
#include <vector>

#include "models/files/machine_file.h"
#include "models/files/model_file_cursor.h"
#include "models/files/model_file_effects.h"
#include "models/hydraulics/uninformed_length.h"

namespace sparflow {
namespace {

using Json = ModelJson;
using Cursor = ModelCursor;

// ---------------------------------------------------------------- writing

/// Writes objects and lists of objects over several lines, lists of plain values on one line.
void write(const Json& value, int indent, std::string& out) {
  const std::string pad(static_cast<std::size_t>(indent) + 1, ' ');
  const auto block = [&](char open, char close, const auto& element) {
    out += open;
    bool first = true;
    for (auto it = value.begin(); it != value.end(); ++it) {
      out += first ? "\n" : ",\n";
      first = false;
      out += pad;
      element(it);
    }
    out += '\n' + std::string(static_cast<std::size_t>(indent), ' ') + close;
  };
  if (value.is_object() && !value.empty()) {
    block('{', '}', [&](const auto& it) {
      out += Json(it.key()).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + ": ";
      write(it.value(), indent + 1, out);
    });
  } else if (value.is_array() && !value.empty() && value.front().is_structured()) {
    block('[', ']', [&](const auto& it) { write(*it, indent + 1, out); });
  } else {
    out += value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
}

Json numbers(const Eigen::ArrayXd& values) {
  return std::vector<double>(values.data(), values.data() + values.size());
}

Json process_json(const GaussianProcess& process) {
  if (process.empty()) return nullptr;
  const GpParameters& p = process.parameters();
  Json core = Json::array();
  for (Eigen::Index i = 0; i < p.variance_core.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) core.push_back(p.variance_core(i, j));
  }
  Json out = {{"length_flow", p.length_flow},
              {"length_force", p.length_force},
              {"signal_std", p.signal_std},
              {"noise_std", p.noise_std},
              {"mean_constant", p.mean_constant},
              {"mean_slope", p.mean_slope},
              {"flow_range", {p.flow_min, p.flow_max}},
              {"force_range", {p.force_min, p.force_max}},
              {"data_count", p.data_count},
              {"flow", numbers(p.flow)},
              {"force", numbers(p.force)},
              {"weight", numbers(p.weight)},
              {"variance_core", std::move(core)}};
  if (p.mean_flow_slope != 0.0) out["mean_flow_slope"] = p.mean_flow_slope;
  if (p.law == PressureLaw::kPlane) out["law"] = "plane";
  const BranchCorner& corner = p.corner;
  if (corner.there()) {
    out["corner"] = {
        {"level", corner.level}, {"per_flow", corner.per_flow}, {"per_force", corner.per_force}};
  }
  const LoadsBeyond& b = p.beyond;
  if (b.side != 0) {
    out["beyond"] = {{"side", b.side},
                     {"static_slope", b.static_slope},
                     {"static_level", b.static_level},
                     {"slope_heavier", b.slope_heavier},
                     {"slope_lighter", b.slope_lighter},
                     {"least", b.least}};
  }
  return out;
}

// ---------------------------------------------------------------- reading

/// Files of earlier programs have no such key.
LoadsBeyond read_beyond(const Cursor& c) {
  c.keys({"side", "static_slope", "static_level", "slope_heavier", "slope_lighter", "least"});
  const auto number = [&](const char* key, const char* expected) {
    return c.at(key, expected).number(expected);
  };
  LoadsBeyond b;
  b.side = number("side", "1 or -1") > 0.0 ? 1 : -1;
  b.static_slope = number("static_slope", "a positive number [Pa/N]");
  b.static_level = number("static_level", "a number [Pa]");
  b.slope_heavier = number("slope_heavier", "a number [Pa/N]");
  b.slope_lighter = number("slope_lighter", "a number [Pa/N]");
  b.least = number("least", "a number [Pa]");
  return b;
}

BranchCorner read_corner(const Cursor& c) {
  c.keys({"level", "per_flow", "per_force"});
  const auto number = [&](const char* key, const char* expected) {
    return c.at(key, expected).number(expected);
  };
  return {number("level", "a number [Pa]"), number("per_flow", "a number [Pa s/m^3]"),
          number("per_force", "a number [Pa/N]")};
}

GaussianProcess read_process(const Cursor& c) {
  if (c.is_null()) return {};
  c.keys({"length_flow", "length_force", "signal_std", "noise_std", "mean_constant", "mean_slope",
          "flow_range", "force_range", "data_count", "flow", "force", "weight", "variance_core",
          "mean_flow_slope", "law", "corner", "beyond"});
  const auto positive = [&](const char* key, const char* unit) {
    const Cursor v = c.at(key, fmt::format("a positive number [{}]", unit));
    const double number = v.number(fmt::format("a positive number [{}]", unit));
    if (!(number > 0.0)) v.fail_expected(fmt::format("a positive number [{}]", unit));
    return number;
  };
  GpParameters p;
  p.length_flow = positive("length_flow", "m^3/s");
  p.length_force = positive("length_force", "N");
  p.signal_std = positive("signal_std", "Pa");
  p.noise_std = c.at("noise_std", "a number [Pa]").non_negative("a number >= 0 [Pa]");
  p.mean_constant = c.at("mean_constant", "a number [Pa]").number("a number [Pa]");
  p.mean_slope = c.at("mean_slope", "a number [Pa/N]").number("a number [Pa/N]");
  if (c.has("mean_flow_slope"))
    p.mean_flow_slope = c.at("mean_flow_slope", "").number("a number [Pa s/m^3]");
  if (c.has("law")) {
    const Cursor law = c.at("law", "");
    const std::string word = law.text("plane or plane_and_process");
    if (word != "plane" && word != "plane_and_process")
      law.fail_expected("plane or plane_and_process");
    p.law = word == "plane" ? PressureLaw::kPlane : PressureLaw::kPlaneAndProcess;
  }
  const Range flow = c.at("flow_range", "[lo, hi] [m^3/s]").range("[lo, hi] with lo <= hi [m^3/s]");
  const Range force = c.at("force_range", "[lo, hi] [N]").range("[lo, hi] with lo <= hi [N]");
  p.flow_min = flow.lo;
  p.flow_max = flow.hi;
  p.force_min = force.lo;
  p.force_max = force.hi;
  const std::string count = "the number of measurements of the Gaussian process";
  p.data_count = static_cast<int>(std::min<long>(c.at("data_count", count).whole(count), 1L << 30));
  p.weight = c.at("weight", "a list of numbers").numbers("a list of numbers, one for each centre");
  const Eigen::Index n = p.weight.size();
  if (n == 0) c.at("weight", "").fail("got no number, expected at least one centre");
  const auto centres = [&](const char* key) {
    const std::string expected = fmt::format("{} numbers, one for each weight", n);
    const Cursor v = c.at(key, expected);
    Eigen::ArrayXd values = v.numbers(expected);
    if (values.size() != n) v.fail_expected(expected);
    return values;
  };
  p.flow = centres("flow");
  p.force = centres("force");
  const Cursor core = c.at("variance_core", "the lower triangle of a symmetric matrix, row by row");
  const Eigen::ArrayXd packed = core.numbers("a list of numbers");
  if (packed.size() > 0) {
    const Eigen::Index rows = n + (c.has("mean_flow_slope") ? 3 : 2);
    if (packed.size() != rows * (rows + 1) / 2) {
      core.fail_expected(fmt::format("{} numbers: the lower triangle of {} x {} (centres + {})",
                                     rows * (rows + 1) / 2, rows, rows, rows - n));
    }
    p.variance_core.resize(rows, rows);
    for (Eigen::Index i = 0, k = 0; i < rows; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j, ++k) {
        p.variance_core(i, j) = p.variance_core(j, i) = packed[k];
      }
    }
  }
  if (c.has("corner")) p.corner = read_corner(c.at("corner", ""));
  if (c.has("beyond")) p.beyond = read_beyond(c.at("beyond", ""));
  replace_uninformed_lengths(p);
  try {
    return GaussianProcess(std::move(p));
  } catch (const InputError& error) {
    c.fail(error.what());
  }
}

/// Elements that must name the machine's parts, one for each part in the machine's order.
template <class Part>
std::vector<Cursor> matched(const Cursor& root, const std::string& key,
                            const std::vector<Part>& parts) {
  std::vector<std::string> names;
  names.reserve(parts.size());
  for (const Part& part : parts) names.push_back(part.name);
  const std::string expected =
      fmt::format("a list, one element for each of the machine's {}: {}", key, listed(names));
  const Cursor list = root.at(key, expected);
  const std::vector<Cursor> elements = list.list(expected);
  if (elements.size() != parts.size()) list.fail_expected(expected);
  std::vector<Cursor> named;
  named.reserve(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Cursor name = elements[i].at("name", fmt::format("\"{}\"", names[i]));
    if (name.text("a name") != names[i]) {
      name.fail_expected(fmt::format("\"{}\", as in the machine", names[i]));
    }
    named.push_back(list.element(i, names[i]));
  }
  return named;
}

FilePlace place_of_byte(const std::string& file, const std::string& text, std::size_t byte) {
  FilePlace place{file, 1, 1};
  for (std::size_t i = 0; i + 1 < byte && i < text.size(); ++i) {
    place.column = text[i] == '\n' ? 1 : place.column + 1;
    if (text[i] == '\n') ++place.line;
  }
  return place;
}

Json parse(const std::string& text, const std::string& file) {
  const std::size_t start = text.find_first_not_of(" \t\r\n");
  if (start == std::string::npos) {
    throw InputError({file, 0, 0}, "",
                     "the file is empty; expected a model written by `sparflow fit`");
  }
  if (text[start] != '{') {
    throw InputError(place_of_byte(file, text, start + 1), "",
                     fmt::format("this is not {}; expected a model written by `sparflow fit`",
                                 text[start] == '[' ? "a JSON object but a list" : "JSON"));
  }
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    // The library gives the character at which it stopped, counted from one.
    const bool ended = error.byte > text.size();
    std::string reason = error.what();
    const std::size_t cut = reason.rfind("; ");
    reason = cut == std::string::npos ? "not valid JSON" : reason.substr(cut + 2);
    throw InputError(place_of_byte(file, text, error.byte), "",
                     ended ? "the JSON ends in the middle; was the file copied completely?"
                           : "not valid JSON: " + reason);
  } catch (const Json::out_of_range&) {
    throw InputError({file, 0, 0}, "", "a number in it is too large for a double");
  }
}

}  // namespace

std::string model_to_json(const CraneModel& model) {
  Json root;
  root["sparflow_model"] = kModelFileVersion;
  root["program"] = fmt::format("sparflow {}", program_version());
  root["machine"] = {{"name", model.machine.name},
                     {"yaml", model.machine.source_text.empty() ? write_machine(model.machine)
                                                                : model.machine.source_text}};
  write_provenance(model, root);
  root["pumps"] = Json::array();
  for (std::size_t p = 0; p < model.pumps.size(); ++p) {
    root["pumps"].push_back(
        {{"name", model.machine.pumps[p].name}, {"standby", model.pumps[p].standby}});
  }
  root["cylinders"] = Json::array();
  for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
    const CylinderModel& c = model.cylinders[i];
    root["cylinders"].push_back({{"name", model.machine.cylinders[i].name},
                                 {"margin", c.margin},
                                 {"valve_gain_extend", c.valve_gain_extend},
                                 {"valve_gain_retract", c.valve_gain_retract},
                                 {"extend", process_json(c.extend)},
                                 {"retract", process_json(c.retract)}});
  }
  std::string text;
  write(root, 0, text);
  return text + "\n";
}

CraneModel model_from_json(const std::string& text, const std::string& file) {
  const Json document = parse(text, file);
  const Cursor root(document, file, "");
  if (!root.has("sparflow_model")) {
    root.fail(
        "this JSON is not a model (no key \"sparflow_model\"); expected a file written by "
        "`sparflow fit`");
  }
  const Cursor version = root.at("sparflow_model", "");
  const std::string expected_version = fmt::format("a version from 1 to {}", kModelFileVersion);
  const long number = version.whole(expected_version);
  if (number > kModelFileVersion) {
    version.fail(
        fmt::format("got version {}, but this program (sparflow {}) reads up to {}; update it, "
                    "or fit the model again with this one",
                    number, program_version(), kModelFileVersion));
  }
  if (number < 1) version.fail_expected(expected_version);
  root.keys({"sparflow_model", "program", "machine", "data", "quality", "user_effects", "effects",
             "steps", "pumps", "cylinders"});
  root.at("program", "a program's name").text("a program's name");
  const Cursor machine = root.at("machine", "an object").keys({"name", "yaml"});
  machine.at("name", "a name").text("a name");
  const std::string yaml =
      machine.at("yaml", "the machine file's text").text("the machine file's text");
  CraneModel model = CraneModel::untrained(parse_machine(yaml, file + " (machine.yaml)", ""));
  read_provenance(root, model);
  const std::vector<Cursor> pumps = matched(root, "pumps", model.machine.pumps);
  for (std::size_t p = 0; p < pumps.size(); ++p) {
    const std::string expected = "a pressure >= 0 [Pa]";
    model.pumps[p].standby =
        pumps[p].keys({"name", "standby"}).at("standby", expected).non_negative(expected);
  }
  const std::vector<Cursor> cylinders = matched(root, "cylinders", model.machine.cylinders);
  for (std::size_t i = 0; i < cylinders.size(); ++i) {
    const Cursor& c = cylinders[i];
    c.keys({"name", "margin", "valve_gain_extend", "valve_gain_retract", "extend", "retract"});
    CylinderModel& out = model.cylinders[i];
    const auto value = [&](const char* key, const std::string& expected) {
      return c.at(key, expected).non_negative(expected);
    };
    out.margin = value("margin", "a pressure >= 0 [Pa]");
    out.valve_gain_extend = value("valve_gain_extend", "a flow >= 0 [m^3/s]");
    out.valve_gain_retract = value("valve_gain_retract", "a flow >= 0 [m^3/s]");
    out.extend = read_process(c.at("extend", "a process or null"));
    out.retract = read_process(c.at("retract", "a process or null"));
  }
  return model;
}

void save_model(const CraneModel& model, const std::string& path) {
  const std::string text = model_to_json(model);
  try {
    model_from_json(text, path);
  } catch (const InputError& error) {
    // Found before the file stands, and not by the next verb.
    throw std::logic_error(
        fmt::format("this model could not be read again, so it is not written: {}", error.what()));
  }
  write_file_atomically(path, text);
}

CraneModel load_model(const std::string& path) { return model_from_json(read_file(path), path); }

}  // namespace sparflow
