#include "identification/log/log_dialect.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "identification/log/log_number.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

/// Splits text into numbered lines. In a file without line feeds, CR ends the lines.
class Lines {
 public:
  explicit Lines(std::string_view text)
      : text_(text), end_mark_(text.find('\n') == text.npos ? '\r' : '\n') {}

  bool next(std::string_view* line) {
    if (at_ >= text_.size()) return false;
    const std::size_t end = std::min(text_.find(end_mark_, at_), text_.size());
    *line = text_.substr(at_, end - at_);
    at_ = end + 1;
    ++number_;
    return true;
  }
  /// Finds the next line that is neither blank nor a comment.
  bool next_filled(std::string_view* line) {
    while (next(line)) {
      const std::string_view content = trimmed(*line);
      if (content.empty()) continue;
      if (content.front() != '#') return true;
      last_comment_ = content.substr(1);
    }
    return false;
  }
  int number() const { return number_; }
  std::string_view last_comment() const { return last_comment_; }

 private:
  std::string_view text_, last_comment_;
  char end_mark_;
  std::size_t at_ = 0;
  int number_ = 0;
};

/// Splits a line at the separators outside quotes. A quoted cell is returned without its quotes.
/// @return false when a quote is not closed
bool split(std::string_view line, char delimiter, std::vector<std::string_view>* cells) {
  cells->clear();
  const char* p = line.data();
  const char* const end = p + line.size();
  const auto blank = [&](char c) { return (c == ' ' || c == '\t' || c == '\r') && c != delimiter; };
  if (delimiter == ' ') {
    while (p < end) {
      const char* const start = p;
      while (p < end && *p != ' ' && *p != '\t' && *p != '\r') ++p;
      if (p > start) cells->emplace_back(start, static_cast<std::size_t>(p - start));
      if (p < end) ++p;
    }
    return true;
  }
  for (;;) {
    while (p < end && blank(*p)) ++p;
    const char* start = p;
    const char* stop = nullptr;
    if (p < end && *p == '"') {
      for (++start, ++p; p < end && !(*p == '"' && (p + 1 == end || p[1] != '"')); ++p) {
        if (*p == '"') ++p;  // a doubled quote belongs to the content
      }
      if (p >= end) return false;
      stop = p++;
      while (p < end && *p != delimiter) ++p;
    } else {
      while (p < end && *p != delimiter) ++p;
      stop = p;
    }
    while (stop > start && blank(stop[-1])) --stop;
    cells->emplace_back(start, static_cast<std::size_t>(stop - start));
    if (p >= end) return true;
    ++p;
  }
}

/// @return number of cells without the empty ones at the end
std::size_t filled_width(const std::vector<std::string_view>& cells) {
  std::size_t n = cells.size();
  while (n > 0 && cells[n - 1].empty()) --n;
  return n;
}

/// @return the separator with which header and first rows have equally many cells; with equal scores tab precedes `;` and
///   `;` precedes `,`, because a decimal comma looks like a separator
char detect_delimiter(std::string_view header, Lines following) {
  std::vector<std::string_view> sample, cells;
  for (std::string_view line; sample.size() < 20 && following.next_filled(&line);) {
    sample.push_back(line);
  }
  char best = ',';
  double best_score = -1.0;
  for (const char candidate : {'\t', ';', ',', ' '}) {
    if (!split(header, candidate, &cells)) continue;
    const std::size_t width = filled_width(cells);
    if (width < 2) continue;
    int agreeing = 0;
    for (const std::string_view line : sample) {
      if (split(line, candidate, &cells) && cells.size() >= width && filled_width(cells) <= width) {
        ++agreeing;
      }
    }
    const double score = sample.empty() ? 0.0 : agreeing / static_cast<double>(sample.size());
    if (score > best_score && !(candidate == ' ' && best_score >= 0.0 && score < 0.9)) {
      best = candidate;
      best_score = score;
    }
  }
  return best;
}

bool all_numbers(const std::vector<std::string_view>& cells, const DialectOptions& options) {
  CellReader reader(options.decimal, options.missing);
  bool any = false;
  for (const std::string_view cell : cells) {
    const CellKind kind = reader.read(cell).kind;
    if (kind == CellKind::kText) return false;
    any = any || kind == CellKind::kNumber;
  }
  return any;
}

std::string delimiter_in_words(char delimiter) {
  if (delimiter == '\t') return "tab";
  if (delimiter == ' ') return "blanks";
  return fmt::format("\"{}\"", delimiter);
}

/// Reads header, units row and rows of a text log.
class DelimitedReader {
 public:
  DelimitedReader(const std::string& file, std::string_view text, const DialectOptions& options,
                  const DoorLimits& limits)
      : options_(options),
        limits_(limits),
        lines_(text),
        text_size_(text.size()),
        cells_of_(options.decimal, options.missing) {
    table_.file = file;
  }

  RawTable read() {
    read_header();
    read_rows();
    finish();
    return std::move(table_);
  }

 private:
  [[noreturn]] void fail(int line, const std::string& message) const {
    throw InputError({table_.file, line, 0}, "", message);
  }

  void read_header() {
    std::string_view line;
    for (int i = 0; i < options_.skip_rows; ++i) lines_.next(&line);
    if (!lines_.next_filled(&line)) {
      fail(0, options_.skip_rows > 0 ? "nothing is left after skip_rows" : "the file is empty");
    }
    delimiter_ = options_.delimiter;
    const std::string_view first = trimmed(line);
    if (first.starts_with("sep=") && first.size() <= 5) {  // written by spreadsheet programs
      if (delimiter_ == 0) delimiter_ = first.size() == 5 ? first[4] : '\t';
      if (!lines_.next_filled(&line)) fail(lines_.number(), "no header line under \"sep=\"");
    }
    if (delimiter_ == 0) delimiter_ = detect_delimiter(line, lines_);
    std::vector<std::string_view> names;
    if (!split(line, delimiter_, &names)) fail(lines_.number(), "a quote is opened and not closed");
    if (all_numbers(names, options_)) {  // then the comment above must be the header
      std::vector<std::string_view> in_comment;
      if (!split(lines_.last_comment(), delimiter_, &in_comment) ||
          in_comment.size() != names.size() || all_numbers(in_comment, options_)) {
        fail(lines_.number(),
             "the first line holds numbers only, expected a header with the columns' names, e.g. "
             "\"t_s,q_boom_rad,pA_boom_bar\"");
      }
      pending_ = line;
      names = in_comment;
    }
    names.resize(filled_width(names));
    if (names.size() < 2) {
      fail(lines_.number(), fmt::format("only one column, \"{}\", expected several separated by "
                                        "\",\", \";\", tab or blanks",
                                        printable(trimmed(line), 60)));
    }
    table_.header_line = lines_.number();
    if (static_cast<std::int64_t>(names.size()) > limits_.log_columns) {
      fail(table_.header_line,
           fmt::format("{} columns, the limit is {} (docs/limits.md); is this a log?", names.size(),
                       limits_.log_columns));
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      RawColumn column;
      column.name = names[i].empty() ? fmt::format("column {}", i + 1) : printable(names[i]);
      table_.columns.push_back(std::move(column));
    }
    const std::size_t rows = text_size_ / std::max<std::size_t>(line.size(), 8) + 16;
    for (RawColumn& column : table_.columns) column.values.reserve(rows);
    table_.lines.reserve(rows);
  }

  void read_rows() {
    const std::size_t width = table_.columns.size();
    std::vector<std::string_view> cells;
    std::vector<double> row(width);
    std::string_view line = pending_;
    bool first = pending_.empty();
    if (pending_.empty() && !lines_.next_filled(&line)) return;
    do {
      if (!split(line, delimiter_, &cells)) {
        fail(lines_.number(), "a quote is opened and not closed on its line");
      }
      if (first && is_units_row(cells)) {
        first = false;
        continue;
      }
      first = false;
      if (cells.size() < width || filled_width(cells) > width) {
        note_wrong_width(cells.size() < width ? cells.size() : filled_width(cells));
        continue;
      }
      for (std::size_t i = 0; i < width; ++i) row[i] = number(cells[i], &table_.columns[i]);
      for (std::size_t i = 0; i < width; ++i) table_.columns[i].values.push_back(row[i]);
      table_.lines.push_back(lines_.number());
      if (static_cast<std::int64_t>(table_.lines.size() * width) > limits_.log_values) {
        fail(lines_.number(),
             fmt::format("{} rows of {} columns up to here, the limit is {:g} values "
                         "(docs/limits.md); cut the log, or leave columns out",
                         table_.lines.size(), width, static_cast<double>(limits_.log_values)));
      }
    } while (lines_.next_filled(&line));
  }

  /// @return true for a line under the header that holds text and no number
  bool is_units_row(const std::vector<std::string_view>& cells) {
    if (filled_width(cells) > table_.columns.size()) return false;
    CellReader reader(options_.decimal, options_.missing);
    bool any = false;
    for (const std::string_view cell : cells) {
      const CellKind kind = reader.read(cell).kind;
      if (kind != CellKind::kMissing && kind != CellKind::kText) return false;
      any = any || kind == CellKind::kText;
    }
    if (!any) return false;
    has_units_ = true;
    for (std::size_t i = 0; i < std::min(cells.size(), table_.columns.size()); ++i) {
      std::string unit = printable(cells[i], 40);
      if (unit.size() > 2 && (unit.front() == '[' || unit.front() == '(')) {
        unit = unit.substr(1, unit.size() - 2);
      }
      table_.columns[i].unit = unit == "-" || unit == "--" ? "" : unit;
    }
    return true;
  }

  double number(std::string_view text, RawColumn* column) {
    const Cell cell = cells_of_.read(text);
    switch (cell.kind) {
      case CellKind::kNumber:
        return cell.value;
      case CellKind::kMissing:
        return kMissing;
      case CellKind::kThousands:
        fail(lines_.number(), fmt::format("{}: got \"{}\", expected a number without thousands "
                                          "separators; export it without them",
                                          column->name, printable(text, 40)));
      case CellKind::kOtherMark:
        fail(
            lines_.number(),
            fmt::format(
                "{}: got \"{}\", but the numbers above have a decimal {}; export the log with "
                "one decimal mark, or set `decimal` in a mapping file",
                column->name, printable(text, 40), cells_of_.decimal() == '.' ? "point" : "comma"));
      case CellKind::kText:
        break;
    }
    if (column->unreadable++ == 0) {
      column->example = printable(text, 40);
      column->example_line = lines_.number();
    }
    return kMissing;
  }

  void note_wrong_width(std::size_t width) {
    if (table_.rows_wrong_width++ == 0) {
      wrong_line_ = lines_.number();
      wrong_width_ = width;
    }
  }

  void finish() {
    const std::size_t width = table_.columns.size();
    const auto rows = static_cast<std::int64_t>(table_.rows());
    if (table_.rows_wrong_width > 0) {
      std::string what =
          fmt::format("{} values where the header names {} columns", wrong_width_, width);
      if (table_.rows_wrong_width > 1 && table_.rows_wrong_width * 100 > rows) {
        if (delimiter_ == ',' && wrong_width_ > width) {
          what +=
              "; decimal commas between values separated by commas? Export with \";\" or decimal "
              "points";
        } else {
          what +=
              "; every row needs one value (or nothing between separators) for each column. If "
              "lines "
              "of text stand before the header, a mapping file says how many: skip_rows: N";
        }
        fail(wrong_line_, what);
      }
      if (rows > 0) {
        table_.warnings.push_back(
            fmt::format("{} {} left out: line {} has {}", table_.rows_wrong_width,
                        table_.rows_wrong_width == 1 ? "row" : "rows", wrong_line_, what));
      }
    }
    if (rows == 0) fail(table_.header_line, "no rows of numbers under the header");
    for (RawColumn& column : table_.columns) {
      const auto numbers = std::count_if(column.values.begin(), column.values.end(),
                                         [](double v) { return !std::isnan(v); });
      column.text = column.unreadable > numbers;
    }
    table_.dialect = fmt::format("{} between values, decimal {}{}", delimiter_in_words(delimiter_),
                                 cells_of_.decimal() == ',' ? "comma" : "point",
                                 has_units_ ? ", units row" : "");
  }

  const DialectOptions& options_;
  const DoorLimits& limits_;
  Lines lines_;
  std::size_t text_size_;
  CellReader cells_of_;
  RawTable table_;
  std::string_view pending_;  // the first row, when the header was a comment
  char delimiter_ = 0;
  bool has_units_ = false;
  int wrong_line_ = 0;
  std::size_t wrong_width_ = 0;
};

}  // namespace

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

RawTable read_delimited(const std::string& file, std::string bytes, const DialectOptions& options,
                        const DoorLimits& limits) {
  std::vector<std::string> warnings;
  const std::string text = text_as_utf8(file, std::move(bytes), &warnings);
  RawTable table = DelimitedReader(file, text, options, limits).read();
  table.warnings.insert(table.warnings.begin(), warnings.begin(), warnings.end());
  return table;
}

}  // namespace sparflow
