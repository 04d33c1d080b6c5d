#pragma once
/// A self-contained HTML page: one file that needs no network (its content security policy forbids requests), has a
/// light and a dark theme and can be printed. All text is escaped; nothing depends on the clock, so that the same input
/// gives the same bytes.
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "apps/report/charts/charts.h"

namespace sparflow {

enum class Tone { kNeutral, kGood, kWarning, kBad };

/// A number in large type; the value is already formatted, e.g. {"12.4", "kJ", "energy", "18 % less than the seed"}.
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
  int digits = 4;  ///< [-] significant digits of the column's numbers
};

/// A number (right-aligned, an em dash when it is not finite) or a text.
using TableCell = std::variant<double, std::string>;

struct Table {
  std::string title;
  std::vector<TableColumn> columns;
  std::vector<std::vector<TableCell>> rows;
  std::string note = "";
  int highlighted_row = -1;  ///< index of the row in bold type, e.g. the best; -1 = none
};

class Page {
 public:
  explicit Page(std::string title);

  void subtitle(std::string text);
  /// Sets the main result, which stands in a box above everything else.
  void verdict(Tone tone, std::string headline, std::string text);
  const std::string& headline() const { return verdict_headline_; }  ///< of verdict()
  /// Adds a line above everything else that says the result is not whole ("Interrupted: ..."). Empty text: none.
  void banner(std::string text);
  /// Adds a line to the footer (program version, input files and their hashes, seed ...), in the order of the calls.
  void provenance(std::string name, std::string value);

  /// Begins a section. A page with more than two sections gets a line of contents.
  void section(std::string heading);
  void paragraph(std::string text);
  /// Adds preformatted text in a fixed-width font that a click opens (long listings, options used).
  void details(std::string summary, std::string preformatted);
  void tiles(std::vector<Tile> tiles);
  void table(Table table);
  void plot(LineChart chart);
  void plot(ScatterChart chart);
  void plot(BarChart chart);
  void plot(SankeyChart chart);
  void plot(HeatMap chart);
  void plot(CraneDrawing chart);

  int plot_count() const;
  /// The page's summary as a piece of HTML without scripts and styles of its own beyond plain ones: banner, main result, the
  /// first tiles and the first table, for a notebook.
  std::string summary() const;
  /// Returns the whole file. Long series are thinned so that it stays below 3 MB; each figure states how far.
  std::string html() const;
  /// Writes html() to `path`. @throws InputError when the folder cannot be written
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
                            BarChart, SankeyChart, HeatMap, CraneDrawing>;

  std::string body(Eigen::Index most_points) const;

  std::string title_, subtitle_;
  Tone verdict_tone_ = Tone::kNeutral;
  std::string banner_, verdict_headline_, verdict_text_;
  std::vector<std::pair<std::string, std::string>> provenance_;
  std::vector<Item> items_;
};

/// Formats `value` with `digits` significant digits, spaces between thousands and no exponent between 1e-4 and 1e7;
/// returns an em dash when it is not finite.
std::string display_number(double value, int digits);

}  // namespace sparflow
