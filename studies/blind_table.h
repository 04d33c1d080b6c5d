#pragma once
/// The blind test's table: every measure with its 95 % limits beside what is asked.
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "studies/blind_case.h"

namespace sparflow::bench {

/// One line of the table.
struct Measure {
  std::string text, value, limits, runs, least, aim;
  double number = 0.0;  ///< SI or a share
  bool reached = true;  ///< what is asked at least
};

/// @param runs all judged by the same  @param seconds of a diagnosis of 15 000 rows; NaN = not timed
std::vector<Measure> blind_table(const std::vector<BlindRun>& runs, double seconds);
std::string table_text(const std::vector<Measure>& table, const std::string& judge);

/// "X" marks a wrong answer, then row, way, seed, machine, truth with its law, answer.
std::string run_line(const BlindRun& run);
/// Intervals that held the truth, by parameter.
std::string coverage_text(const std::vector<BlindRun>& runs);
/// What learning again swallows of the error, by stage (judge gp).
std::string swallowed_text(const std::vector<BlindRun>& runs);
nlohmann::json run_json(const BlindRun& run);
nlohmann::json table_json(const std::vector<Measure>& table, const std::string& judge);

}  // namespace sparflow::bench
