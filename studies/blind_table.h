#pragma once
/// The blind test's table: each measure with its 95 % limits and the required value.
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "studies/blind_case.h"

namespace sparflow::bench {

/// One line of the table.
struct Measure {
  std::string text, value, limits, runs, least, aim;
  double number = 0.0;  ///< SI or a share
  bool reached = true;  ///< whether the required value `least` is reached
};

/// Computes the table. @param runs all of the same method  @param seconds of a diagnosis of 15 000 rows; NaN = not timed
std::vector<Measure> blind_table(const std::vector<BlindRun>& runs, double seconds);
std::string table_text(const std::vector<Measure>& table, const std::string& judge);

/// One line of text: "X" for a wrong answer, row, use of a reference, seed, machine, truth with its law, answer.
std::string run_line(const BlindRun& run);
/// Text with the number of 95 % intervals that contain the true value, by parameter.
std::string coverage_text(const std::vector<BlindRun>& runs);
/// Text with the share of the error that fitting again absorbs, by stage (method gp).
std::string absorbed_text(const std::vector<BlindRun>& runs);
nlohmann::json run_json(const BlindRun& run);
nlohmann::json table_json(const std::vector<Measure>& table, const std::string& judge);

}  // namespace sparflow::bench
