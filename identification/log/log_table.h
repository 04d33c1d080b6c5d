#pragma once
/// The content of a log file before its columns are interpreted: named columns of numbers, one row for each instant.
/// log_dialect.h (text) and log_matlab.h (.mat) fill it, log_mapping.h adds columns, log.h interprets it.
#include <cstdint>
#include <string>
#include <vector>

#include "models/math/error.h"

namespace sparflow {

struct RawColumn {
  std::string name;            ///< as in the file (UTF-8)
  std::string unit;            ///< from a units row under the header, "" when there is none
  std::vector<double> values;  ///< NaN = missing
  bool text = false;           ///< most cells are not numbers
  bool mapped_from = false;    ///< an expression of the mapping reads it; it is no candidate signal
  std::int64_t unreadable = 0;  ///< cells that are neither a number nor a mark for "missing"
  std::string example;          ///< the first such cell
  int example_line = 0;         ///< 1-based
};

struct RawTable {
  std::string file;
  int header_line = 0;                ///< 1-based, 0 = the file has no lines (.mat)
  std::vector<RawColumn> columns;     ///< all of one length
  std::vector<int> lines;             ///< file line of each row; empty = count the rows from 1
  std::int64_t rows_wrong_width = 0;  ///< rows left out: not as many values as columns
  std::string dialect;  ///< in words, e.g. `";" between values, decimal comma, units row`
  std::vector<std::string> warnings;

  std::size_t rows() const { return columns.empty() ? 0 : columns.front().values.size(); }
  /// @return line of a row in a text file, number of the row in others
  int line(std::size_t row) const { return lines.empty() ? static_cast<int>(row) + 1 : lines[row]; }
  FilePlace place(std::size_t row) const { return {file, lines.empty() ? 0 : lines[row], 0}; }
};

}  // namespace sparflow
