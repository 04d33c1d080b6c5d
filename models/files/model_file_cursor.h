#pragma once
/// Reads a model file: a JSON value with its key path, for messages. Used by model_file*.cpp only.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "models/machine/machine.h"
#include "models/math/error.h"
#include "models/yaml/yaml_reader.h"

namespace sparflow {

using ModelJson = nlohmann::ordered_json;

/// A value of the file with its key path, for messages.
class ModelCursor {
 public:
  ModelCursor(const ModelJson& value, const std::string& file, std::string path)
      : value_(&value), file_(&file), path_(std::move(path)) {}

  [[noreturn]] void fail(const std::string& message) const {
    throw InputError({*file_, 0, 0}, path_, message);
  }
  [[noreturn]] void fail_expected(const std::string& expected) const {
    std::string found =
        value_->is_structured()
            ? fmt::format("{} of {} element(s)", value_->is_array() ? "a list" : "an object",
                          value_->size())
            : value_->dump(-1, ' ', false, ModelJson::error_handler_t::replace);
    /// Longest text that a message quotes.
    /// @threshold [characters] 10..1000; chosen: a line with what was expected
    constexpr std::size_t kLongestQuote = 60;
    if (found.size() > kLongestQuote) found = found.substr(0, kLongestQuote - 3) + "...";
    fail("got " + found + ", expected " + expected);
  }
  bool is_null() const { return value_->is_null(); }
  std::size_t size() const { return value_->size(); }
  const std::string& path() const { return path_; }

  /// Checks that the value is an object with these keys and no others.
  const ModelCursor& keys(const std::vector<std::string>& known) const {
    if (!value_->is_object()) fail_expected("an object with the keys " + listed(known));
    for (auto it = value_->begin(); it != value_->end(); ++it) {
      if (std::find(known.begin(), known.end(), it.key()) == known.end()) {
        fail(fmt::format("unknown key \"{}\"{}", it.key(), suggestion(it.key(), known)));
      }
    }
    return *this;
  }
  bool has(const std::string& key) const { return value_->is_object() && value_->contains(key); }
  ModelCursor at(const std::string& key, const std::string& expected) const {
    const std::string child = path_.empty() ? key : path_ + "." + key;
    if (!has(key)) {
      throw InputError({*file_, 0, 0}, child,
                       fmt::format("missing; expected {}. Is the file complete?", expected));
    }
    return {value_->at(key), *file_, child};
  }
  ModelCursor element(std::size_t i, const std::string& name) const {
    return {value_->at(i), *file_, fmt::format("{}[{}]", path_, name)};
  }
  std::vector<ModelCursor> list(const std::string& expected) const {
    if (!value_->is_array()) fail_expected(expected);
    std::vector<ModelCursor> out;
    for (std::size_t i = 0; i < value_->size(); ++i) out.push_back(element(i, std::to_string(i)));
    return out;
  }
  double number(const std::string& expected) const {
    if (!value_->is_number()) fail_expected(expected);
    const double v = value_->get<double>();
    if (!std::isfinite(v)) fail_expected(expected);
    return v;
  }
  double non_negative(const std::string& expected) const {
    const double v = number(expected);
    if (v < 0.0) fail_expected(expected);
    return v;
  }
  long whole(const std::string& expected) const {
    /// Largest whole number that is read.
    /// @threshold [1] 1e9..9e15; derived: below 2^53, up to which doubles hold whole numbers
    constexpr double kLargestWhole = 1e15;
    if (!value_->is_number_integer() || value_->get<double>() < 0.0 ||
        value_->get<double>() > kLargestWhole) {
      fail_expected(expected);
    }
    return value_->get<long>();
  }
  std::string text(const std::string& expected) const {
    if (!value_->is_string()) fail_expected(expected);
    return value_->get<std::string>();
  }
  Eigen::ArrayXd numbers(const std::string& expected) const {
    const std::vector<ModelCursor> values = list(expected);
    Eigen::ArrayXd out(static_cast<Eigen::Index>(values.size()));
    for (std::size_t i = 0; i < values.size(); ++i) {
      out[static_cast<Eigen::Index>(i)] = values[i].number("a finite number");
    }
    return out;
  }
  Range range(const std::string& expected) const {
    const Eigen::ArrayXd v = numbers(expected);
    if (v.size() != 2 || v[0] > v[1]) fail_expected(expected);
    return {v[0], v[1]};
  }

 private:
  const ModelJson* value_;
  const std::string* file_;
  std::string path_;
};

}  // namespace sparflow
