#pragma once
/// Classifies a cell of a text log: number, missing, or text.
#include <string>
#include <string_view>
#include <vector>

namespace sparflow {

enum class CellKind {
  kNumber,
  kMissing,    ///< empty, "-", "NaN", "#N/A", an infinity ...
  kText,       ///< not a number
  kThousands,  ///< "1.234,5": digits in groups, which is ambiguous
  kOtherMark,  ///< a decimal comma where the file uses points, or the reverse
};

struct Cell {
  CellKind kind = CellKind::kMissing;
  double value = 0.0;
};

/// Reads the cells of one file; the first fractional number decides whether the file uses points or commas.
class CellReader {
 public:
  /// @param decimal '.', ',' or 0 = detect  @param missing further marks for "missing"
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
