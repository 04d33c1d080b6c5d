#pragma once
/// A mapping file computes the program's columns from a log with other column names, by expressions:
///   columns: {t_s: "Time [ms] * 0.001", pA_boom_bar: "PT01 / 1e5 - 1.01"}
/// docs/log_format.md describes it.
#include <set>
#include <string>
#include <vector>

#include "identification/log/log_dialect.h"
#include "identification/log/log_table.h"

namespace sparflow {

struct MappedColumn {
  std::string name;        ///< the program's name, with its unit
  std::string expression;  ///< over the file's own column names
  FilePlace place;         ///< of the expression in the mapping file
};

struct LogMapping {
  std::vector<MappedColumn> columns;
  std::vector<std::string> ignore;  ///< columns of the log to leave out
  FilePlace ignore_place;
  DialectOptions dialect;
  std::vector<std::string>
      dbc;             ///< databases of CAN frames, beside the mapping file unless absolute
  double clock = 0.0;  ///< [s] step of the clock of a recording; 0 = chosen from its channels
};

/// @throws InputError with file:line:column for unknown keys, wrong types, names given twice
LogMapping read_log_mapping(const std::string& path);
/// Parses a mapping file from memory. @param path name for messages  @throws InputError as above
LogMapping parse_log_mapping(const std::string& path, const std::string& text);

/// Adds the mapped columns (replacing a column of the same name), removes the ignored ones and marks those that an
/// expression reads.
/// @throws InputError at the expression's place: unknown column (with the most similar one), text column, syntax
void apply_mapping(const LogMapping& mapping, RawTable* table);

/// Evaluates an expression row by row: + - * / ^ ( ), abs sqrt sin cos min max, pi deg rad; a column is written by its
/// name (the longest that matches) or between backticks. A missing value in any operand makes the result missing.
/// @param place, key for messages  @param read gets the names of the columns used; may be null
/// @throws InputError for a syntax error, an unknown column or a column of text
std::vector<double> evaluate_expression(const std::string& expression, const RawTable& table,
                                        const FilePlace& place, const std::string& key,
                                        std::set<std::string>* read = nullptr);

}  // namespace sparflow
