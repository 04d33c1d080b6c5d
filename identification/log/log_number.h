#pragma once
/// One cell of a text log: a number, nothing, or something else.
#include <string>
#include <string_view>
#include <vector>

namespace sparflow {

enum class CellKind {
  kNumber,
  kMissing,    ///< empty, "-", "NaN", "#N/A", an infinity ...
  kText,       ///< not a number
  kThousands,  ///< "1.234,5": digits in groups, can be read two ways
  kOtherMark,  ///< a decimal comma where the file uses points, or the reverse
};

struct Cell {
  CellKind kind = CellKind::kMissing;
  double value = 0.0;
};

/// Reads cells of one file; learns from the first fractional number whether it uses points or commas.
class CellReader {
 public:
  /// @param decimal '.', ',' or 0 = learn  @param missing further marks for "missing"
  CellReader(char decimal, std::vector<std::string> missing);
  /// @param cell without blanks around and without quotes
  Cell read(std::string_view cell);
  char decimal() const { return decimal_; }

 private:
  Cell read_odd(std::string_view cell);
  char decimal_;
  std::vector<std::string> missing_;
};

}  // namespace sparflow
