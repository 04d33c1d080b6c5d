#include "identification/log/log_mapping.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "models/yaml/yaml_reader.h"

namespace sparflow {
namespace {

const std::vector<std::string> kKeys = {"columns", "ignore",  "delimiter", "skip_rows",
                                        "decimal", "missing", "dbc",       "clock_s"};

FilePlace place_of(const std::string& file, const YAML::Node& node) {
  const YAML::Mark mark = node.Mark();
  return mark.is_null() ? FilePlace{file, 0, 0} : FilePlace{file, mark.line + 1, mark.column + 1};
}

std::string scalar(const std::string& file, const YAML::Node& node, const std::string& key) {
  if (!node.IsScalar()) {
    throw InputError(place_of(file, node), key, "expected one value, got a list or a table");
  }
  return node.Scalar();
}

/// Reads a list of values; a single value counts as a list of one.
std::vector<std::string> scalars(const std::string& file, const YAML::Node& node,
                                 const std::string& key) {
  std::vector<std::string> list;
  if (node.IsScalar()) return {node.Scalar()};
  if (!node.IsSequence()) throw InputError(place_of(file, node), key, "expected a list");
  for (const YAML::Node& entry : node) list.push_back(scalar(file, entry, key));
  return list;
}

void read_columns(const std::string& file, const YAML::Node& node, LogMapping* mapping) {
  if (!node.IsMap()) {
    throw InputError(place_of(file, node), "columns",
                     "expected a table of name: expression, e.g. {t_s: \"Time [ms] * 0.001\"}");
  }
  for (const auto& entry : node) {
    const std::string name = scalar(file, entry.first, "columns");
    const std::string key = "columns." + name;
    const std::string expression = scalar(file, entry.second, key);
    if (trimmed(expression).empty()) {
      throw InputError(place_of(file, entry.second), key,
                       "the expression is empty, expected e.g. \"Time [ms] * 0.001\"");
    }
    for (const MappedColumn& other : mapping->columns) {
      if (other.name == name) throw InputError(place_of(file, entry.first), key, "is given twice");
    }
    mapping->columns.push_back({name, expression, place_of(file, entry.second)});
  }
}

char read_delimiter(const std::string& file, const YAML::Node& node) {
  const std::string text = scalar(file, node, "delimiter");
  if (text == "tab" || text == "\t") return '\t';
  if (text == "blanks" || text == " ") return ' ';
  if (text == "," || text == ";") return text.front();
  throw InputError(place_of(file, node), "delimiter",
                   fmt::format("got \"{}\", expected \",\", \";\", tab or blanks", text));
}

char read_decimal(const std::string& file, const YAML::Node& node) {
  const std::string text = scalar(file, node, "decimal");
  if (text == "." || text == "point") return '.';
  if (text == "," || text == "comma") return ',';
  throw InputError(place_of(file, node), "decimal",
                   fmt::format("got \"{}\", expected point or comma", text));
}

int read_skip_rows(const std::string& file, const YAML::Node& node) {
  try {
    const int rows = node.as<int>();
    if (rows >= 0) return rows;
  } catch (const YAML::Exception&) {  // reported below
  }
  throw InputError(place_of(file, node), "skip_rows", "expected a number of lines, 0 or more");
}

double read_clock(const std::string& file, const YAML::Node& node) {
  try {
    const double step = node.as<double>();
    if (step > 0.0 && std::isfinite(step)) return step;
  } catch (const YAML::Exception&) {  // reported below
  }
  throw InputError(place_of(file, node), "clock_s",
                   "expected the time between two rows, a positive number of seconds, e.g. 0.01");
}

LogMapping read_root(const std::string& path, const YAML::Node& root) {
  if (!root.IsMap()) {
    throw InputError({path, 1, 0}, "",
                     "expected a mapping file: columns: {t_s: \"Time [ms] * 0.001\", ...}");
  }
  LogMapping mapping;
  for (const auto& entry : root) {
    const std::string key = scalar(path, entry.first, "");
    const YAML::Node& value = entry.second;
    if (key == "columns") {
      read_columns(path, value, &mapping);
    } else if (key == "ignore") {
      mapping.ignore = scalars(path, value, key);
      mapping.ignore_place = place_of(path, value);
    } else if (key == "dbc") {
      const std::string folder = path.substr(0, path.find_last_of('/') + 1);
      for (const std::string& name : scalars(path, value, key)) {
        mapping.dbc.push_back(name.starts_with('/') ? name : folder + name);
      }
    } else if (key == "clock_s") {
      mapping.clock = read_clock(path, value);
    } else if (key == "missing") {
      mapping.dialect.missing = scalars(path, value, key);
    } else if (key == "delimiter") {
      mapping.dialect.delimiter = read_delimiter(path, value);
    } else if (key == "decimal") {
      mapping.dialect.decimal = read_decimal(path, value);
    } else if (key == "skip_rows") {
      mapping.dialect.skip_rows = read_skip_rows(path, value);
    } else {
      const std::string near = nearest_word(key, kKeys);
      throw InputError(place_of(path, entry.first), "",
                       fmt::format("unknown key \"{}\"; {}", key,
                                   near.empty() ? "known are columns, ignore, delimiter, decimal, "
                                                  "skip_rows, missing, dbc, clock_s"
                                                : fmt::format("did you mean \"{}\"?", near)));
    }
  }
  return mapping;
}

}  // namespace

LogMapping read_log_mapping(const std::string& path) {
  return parse_log_mapping(path, read_file(path));
}

LogMapping parse_log_mapping(const std::string& path, const std::string& text) {
  try {
    return read_root(path, first_document(text, path));
  } catch (const YAML::Exception& error) {
    const FilePlace place = error.mark.is_null()
                                ? FilePlace{path, 0, 0}
                                : FilePlace{path, error.mark.line + 1, error.mark.column + 1};
    throw InputError(place, "", explained_yaml_error(error.msg, text, error.mark.line));
  }
}

void apply_mapping(const LogMapping& mapping, RawTable* table) {
  // All expressions use the file's own columns, also when one of them replaces such a column.
  std::vector<RawColumn> mapped;
  std::set<std::string> read;
  for (const MappedColumn& column : mapping.columns) {
    RawColumn result;
    result.name = column.name;
    result.values = evaluate_expression(column.expression, *table, column.place,
                                        "columns." + column.name, &read);
    // The result of a division by zero or the root of a negative number is missing, like a hole in the log.
    for (double& v : result.values) {
      if (!std::isfinite(v)) v = std::numeric_limits<double>::quiet_NaN();
    }
    mapped.push_back(std::move(result));
  }
  for (const std::string& name : mapping.ignore) {
    const auto drop = std::remove_if(table->columns.begin(), table->columns.end(),
                                     [&](const RawColumn& c) { return c.name == name; });
    if (drop == table->columns.end()) {
      std::vector<std::string> names;
      for (const RawColumn& column : table->columns) names.push_back(column.name);
      const std::string near = nearest_word(name, names);
      throw InputError(mapping.ignore_place, "ignore",
                       fmt::format("the log has no column \"{}\"{}", name,
                                   near.empty() ? "; check its header"
                                                : fmt::format("; did you mean \"{}\"?", near)));
    }
    table->columns.erase(drop, table->columns.end());
  }
  for (RawColumn& column : table->columns) column.mapped_from = read.count(column.name) > 0;
  for (RawColumn& column : mapped) {
    const auto same = std::find_if(table->columns.begin(), table->columns.end(),
                                   [&](const RawColumn& c) { return c.name == column.name; });
    if (same == table->columns.end()) {
      table->columns.push_back(std::move(column));
    } else {
      *same = std::move(column);
    }
  }
}

}  // namespace sparflow
