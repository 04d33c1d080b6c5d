#pragma once
/// A self-contained HTML page: one file, no network (its content security policy forbids it), light and
/// dark, printable. Everything given is escaped; nothing in it depends on the clock, so the same input makes
/// the same bytes.
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "apps/report/charts/charts.h"

namespace sparflow {

enum class Tone { kNeutral, kGood, kWarning, kBad };

/// A big number: value already formatted, e.g. {"12.4", "kJ", "energy", "18 % less than the seed"}.
struct Tile {
  std::string value;
  std::string unit;
  std::string label;
  std::string note = "";
  Tone tone = Tone::kNeutral;
};

struct TableColumn {
  std::string header;
  std::string unit = "";
  int digits = 4;  ///< significant digits of its numbers
};

/// A number (right-aligned, an em dash when it is not finite) or a text.
using TableCell = std::variant<double, std::string>;

struct Table {
  std::string title;
  std::vector<TableColumn> columns;
  std::vector<std::vector<TableCell>> rows;
  std::string note = "";
  int highlighted_row = -1;  ///< drawn strong, e.g. the best; -1 = none
};

class Page {
 public:
  explicit Page(std::string title);

  void subtitle(std::string text);
  /// The answer, in a box above everything else.
  void verdict(Tone tone, std::string headline, std::string text);
  /// Stands in the footer: program version, input files and their hashes, seed ... in the order given.
  void provenance(std::string name, std::string value);

  /// What follows belongs to this section; with more than two sections the page gets a contents line.
  void section(std::string heading);
  void paragraph(std::string text);
  /// Text as it is, in a fixed-width font, behind a click (long listings, options used).
  void details(std::string summary, std::string preformatted);
  void tiles(std::vector<Tile> tiles);
  void table(Table table);
  void plot(LineChart chart);
  void plot(ScatterChart chart);
  void plot(BarChart chart);
  void plot(HeatMap chart);
  void plot(CraneDrawing chart);

  int plot_count() const;
  /// The whole file. Long series are thinned so that it stays below 3 MB, and each figure says so.
  std::string html() const;
  /// @throws InputError when the folder cannot be written
  void write(const std::string& path) const;

 private:
  struct Heading {
    std::string text;
  };
  struct Paragraph {
    std::string text;
  };
  struct Details {
    std::string summary, text;
  };
  struct Tiles {
    std::vector<Tile> tiles;
  };
  using Item = std::variant<Heading, Paragraph, Details, Tiles, Table, LineChart, ScatterChart,
                            BarChart, HeatMap, CraneDrawing>;

  std::string body(Eigen::Index most_points) const;

  std::string title_, subtitle_;
  Tone verdict_tone_ = Tone::kNeutral;
  std::string verdict_headline_, verdict_text_;
  std::vector<std::pair<std::string, std::string>> provenance_;
  std::vector<Item> items_;
};

/// `value` with `digits` significant digits, thousands apart, no exponent between 1e-4 and 1e7; an em dash when
/// it is not finite.
std::string display_number(double value, int digits);

}  // namespace sparflow
