#include "apps/report/page/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "apps/report/charts/chart_json.h"
#include "apps/report/page/assets.h"
#include "apps/report/page/escape.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

constexpr std::size_t kLargestPage = 3'000'000;  // [bytes] opens at once from a mail attachment
constexpr Eigen::Index kMostPoints = 6000;       // more rows than any screen has columns
constexpr Eigen::Index kFewestPoints = 300;

const char* tone_class(Tone tone) {
  switch (tone) {
    case Tone::kGood:
      return "good";
    case Tone::kWarning:
      return "warning";
    case Tone::kBad:
      return "bad";
    case Tone::kNeutral:
      break;
  }
  return "neutral";
}

std::string with_unit(const std::string& label, const std::string& unit) {
  if (unit.empty()) return html_escape(label);
  return fmt::format("{} <span class=\"unit\">[{}]</span>", html_escape(label), html_escape(unit));
}

/// Separates thousands by narrow no-break spaces (not in 1234) and writes a true minus sign, but none before a zero.
std::string grouped(std::string text) {
  if (text[0] == '-' && text.find_first_not_of("-0.") == std::string::npos) text.erase(0, 1);
  const std::size_t point = std::min(text.find('.'), text.size());
  const std::size_t first = text[0] == '-' ? 1 : 0;
  if (point - first > 4) {
    for (std::size_t at = point; at > first + 3; at -= 3) text.insert(at - 3, "\u202F");
  }
  if (first == 1) text.replace(0, 1, "\u2212");
  return text;
}

std::string display_count(double value) {
  if (!std::isfinite(value) || std::abs(value) > 1e15) return display_number(value, 4);
  return grouped(fmt::format("{:.0f}", value));
}

std::string tiles_html(const std::vector<Tile>& tiles) {
  std::string html = "<div class=\"tiles\">\n";
  for (const Tile& tile : tiles) {
    html += fmt::format(
        "<div class=\"tile {}\"><div class=\"tile-label\">{}</div>"
        "<div class=\"tile-value\">{} <span class=\"unit\">{}</span></div>",
        tone_class(tile.tone), html_escape(tile.label), html_escape(tile.value),
        html_escape(tile.unit));
    if (!tile.note.empty()) {
      html += fmt::format("<div class=\"tile-note\">{}</div>", html_escape(tile.note));
    }
    html += "</div>\n";
  }
  return html + "</div>\n";
}

/// A column is right-aligned when it holds any number.
bool is_numeric(const Table& table, std::size_t column) {
  return std::any_of(table.rows.begin(), table.rows.end(), [&](const auto& row) {
    return column < row.size() && std::holds_alternative<double>(row[column]);
  });
}

/// True when all numbers of a column are whole: they are printed without decimals.
bool is_whole(const Table& table, std::size_t column) {
  return std::all_of(table.rows.begin(), table.rows.end(), [&](const auto& row) {
    const double* number = column < row.size() ? std::get_if<double>(&row[column]) : nullptr;
    return number == nullptr || !std::isfinite(*number) || *number == std::trunc(*number);
  });
}

std::string table_html(const Table& table) {
  std::string html = "<div class=\"table\"><table>\n";
  if (!table.title.empty()) {
    html += fmt::format("<caption>{}</caption>\n", html_escape(table.title));
  }
  html += "<thead><tr>";
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    html += fmt::format("<th scope=\"col\"{}>{}</th>", is_numeric(table, c) ? " class=\"num\"" : "",
                        with_unit(table.columns[c].header, table.columns[c].unit));
  }
  html += "</tr></thead>\n<tbody>\n";
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    SPARFLOW_CHECK(table.rows[r].size() == table.columns.size(),
                   fmt::format("table \"{}\": row {} has {} cells for {} columns", table.title, r,
                               table.rows[r].size(), table.columns.size()));
    html += static_cast<int>(r) == table.highlighted_row ? "<tr class=\"best\">" : "<tr>";
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      const TableCell& cell = table.rows[r][c];
      if (const double* number = std::get_if<double>(&cell)) {
        html += fmt::format("<td class=\"num\">{}</td>",
                            is_whole(table, c) ? display_count(*number)
                                               : display_number(*number, table.columns[c].digits));
      } else {
        html += fmt::format("<td{}>{}</td>", is_numeric(table, c) ? " class=\"num\"" : "",
                            html_escape(std::get<std::string>(cell)));
      }
    }
    html += "</tr>\n";
  }
  html += "</tbody></table>\n";
  if (!table.note.empty())
    html += fmt::format("<p class=\"note\">{}</p>\n", html_escape(table.note));
  return html + "</div>\n";
}

template <class Chart>
std::string figure_html(const Chart& chart, int number, Eigen::Index most_points) {
  using nlohmann::json;
  const json spec = chart_json(chart, most_points);
  std::string note = html_escape(chart.note);
  if (spec.contains("of") && spec["shown"] < spec["of"]) {
    note += fmt::format(
        "{}<span class=\"thinned\">{} of {} points drawn{}.</span>", note.empty() ? "" : " ",
        spec["shown"].template get<long>(), spec["of"].template get<long>(),
        std::is_same_v<Chart, LineChart> ? ": the smallest and largest of each stretch"
                                         : ": one where several coincide");
  }
  return fmt::format(
      "<figure class=\"plot {}\" id=\"figure-{}\">\n<figcaption>{}</figcaption>\n"
      "<div class=\"drawing\" role=\"img\" aria-label=\"{}\"></div>\n"
      "{}<script type=\"application/json\">{}</script>\n</figure>\n",
      chart.width == FigureWidth::kHalf ? "half" : "full", number, html_escape(chart.title),
      html_escape(chart.title), note.empty() ? "" : fmt::format("<p class=\"note\">{}</p>\n", note),
      script_safe(spec.dump(-1, ' ', false, json::error_handler_t::replace)));
}

std::string script(std::string_view asset) {
  return fmt::format("<script>\n{}\n</script>\n", page_asset(asset));
}

}  // namespace

std::string display_number(double value, int digits) {
  if (!std::isfinite(value)) return "\u2014";
  if (value == 0.0) return "0";
  const double magnitude = std::abs(value);
  if (magnitude < 1e-4 || magnitude >= 1e7) return fmt::format("{:.{}e}", value, digits - 1);
  const int exponent = static_cast<int>(std::floor(std::log10(magnitude)));
  std::string text = fmt::format("{:.{}f}", value, std::max(0, digits - 1 - exponent));
  if (text.find_first_of("123456789") == std::string::npos) return "0";
  return grouped(text);
}

Page::Page(std::string title) : title_(std::move(title)) {}

void Page::subtitle(std::string text) { subtitle_ = std::move(text); }

void Page::verdict(Tone tone, std::string headline, std::string text) {
  verdict_tone_ = tone;
  verdict_headline_ = std::move(headline);
  verdict_text_ = std::move(text);
}

void Page::banner(std::string text) { banner_ = std::move(text); }

void Page::provenance(std::string name, std::string value) {
  provenance_.emplace_back(std::move(name), std::move(value));
}

void Page::section(std::string heading) { items_.emplace_back(Heading{std::move(heading)}); }
void Page::paragraph(std::string text) { items_.emplace_back(Paragraph{std::move(text)}); }
void Page::details(std::string summary, std::string preformatted) {
  items_.emplace_back(Details{std::move(summary), std::move(preformatted)});
}
void Page::tiles(std::vector<Tile> tiles) { items_.emplace_back(Tiles{std::move(tiles)}); }
void Page::table(Table table) { items_.emplace_back(std::move(table)); }
void Page::plot(LineChart chart) { items_.emplace_back(std::move(chart)); }
void Page::plot(ScatterChart chart) { items_.emplace_back(std::move(chart)); }
void Page::plot(BarChart chart) { items_.emplace_back(std::move(chart)); }
void Page::plot(SankeyChart chart) { items_.emplace_back(std::move(chart)); }
void Page::plot(HeatMap chart) { items_.emplace_back(std::move(chart)); }
void Page::plot(CraneDrawing chart) { items_.emplace_back(std::move(chart)); }

int Page::plot_count() const {
  return static_cast<int>(std::count_if(items_.begin(), items_.end(), [](const Item& item) {
    return std::visit(
        [](const auto& i) { return std::is_base_of_v<Figure, std::decay_t<decltype(i)>>; }, item);
  }));
}

std::string Page::body(Eigen::Index most_points) const {
  std::string html;
  int figures = 0, sections = 0;
  bool in_figures = false;  // neighbouring figures share one grid
  for (const Item& item : items_) {
    std::visit(
        [&](const auto& i) {
          using T = std::decay_t<decltype(i)>;
          if (std::is_base_of_v<Figure, T> != in_figures) {
            html += in_figures ? "</div>\n" : "<div class=\"figures\">\n";
            in_figures = !in_figures;
          }
          if constexpr (std::is_base_of_v<Figure, T>) {
            html += figure_html(i, ++figures, most_points);
          } else if constexpr (std::is_same_v<T, Heading>) {
            html += fmt::format("<h2 id=\"section-{}\">{}</h2>\n", ++sections, html_escape(i.text));
          } else if constexpr (std::is_same_v<T, Paragraph>) {
            html += fmt::format("<p>{}</p>\n", html_escape(i.text));
          } else if constexpr (std::is_same_v<T, Details>) {
            html += fmt::format("<details><summary>{}</summary><pre>{}</pre></details>\n",
                                html_escape(i.summary), html_escape(i.text));
          } else if constexpr (std::is_same_v<T, Tiles>) {
            html += tiles_html(i.tiles);
          } else {
            html += table_html(i);
          }
        },
        item);
  }
  return in_figures ? html + "</div>\n" : html;
}

std::string Page::html() const {
  std::string head = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src "
      "'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n<title>{}</title>\n"
      "<style>\n{}\n{}</style>\n</head>\n<body data-plots-expected=\"{}\">\n"
      // This script is the first one, so that an error in any later one is counted.
      "<script>var pageErrors = []; window.addEventListener('error', function (e) {{ "
      "pageErrors.push(String(e.message)); }});</script>\n<header>\n<h1>{}</h1>\n",
      html_escape(title_), page_asset("uplot/uPlot.min.css"), page_asset("page.css"), plot_count(),
      html_escape(title_));
  if (!subtitle_.empty())
    head += fmt::format("<p class=\"subtitle\">{}</p>\n", html_escape(subtitle_));
  if (!banner_.empty()) {
    head += fmt::format("<div class=\"verdict {} banner\"><strong>{}</strong></div>\n",
                        tone_class(Tone::kWarning), html_escape(banner_));
  }
  if (!verdict_headline_.empty()) {
    head += fmt::format("<div class=\"verdict {}\"><strong>{}</strong> {}</div>\n",
                        tone_class(verdict_tone_), html_escape(verdict_headline_),
                        html_escape(verdict_text_));
  }
  std::vector<std::string> headings;
  for (const Item& item : items_) {
    if (const Heading* heading = std::get_if<Heading>(&item)) headings.push_back(heading->text);
  }
  if (headings.size() > 2) {
    head += "<nav>";
    for (std::size_t i = 0; i < headings.size(); ++i) {
      head += fmt::format("<a href=\"#section-{}\">{}</a> ", i + 1, html_escape(headings[i]));
    }
    head += "</nav>\n";
  }
  head += "</header>\n<main>\n";

  std::string tail =
      "</main>\n<noscript><p>The figures of this page are drawn by its own scripts: allow "
      "JavaScript to see "
      "them. Nothing is loaded from a network.</p></noscript>\n<footer>\n<dl>\n";
  for (const auto& [name, value] : provenance_) {
    tail += fmt::format("<dt>{}</dt><dd>{}</dd>\n", html_escape(name), html_escape(value));
  }
  tail += fmt::format(
      "</dl>\n<details><summary>Licence of the chart library (uPlot)</summary><pre>{}"
      "</pre></details>\n</footer>\n",
      html_escape(page_asset("uplot/LICENSE")));
  for (const char* asset : {"uplot/uPlot.iife.min.js", "page.js", "line_charts.js", "svg_charts.js",
                            "crane_drawing.js"}) {
    tail += script(asset);
  }
  tail += "<script>page.drawAll();</script>\n</body>\n</html>\n";

  Eigen::Index most_points = kMostPoints;
  std::string middle = body(most_points);
  while (head.size() + middle.size() + tail.size() > kLargestPage && most_points > kFewestPoints) {
    most_points = most_points * 2 / 3;
    middle = body(most_points);
  }
  return head + middle + tail;
}

std::string Page::summary() const {
  std::string html = fmt::format("<div class=\"sparflow\"><h4>{}</h4>\n", html_escape(title_));
  if (!banner_.empty()) html += fmt::format("<p><strong>{}</strong></p>\n", html_escape(banner_));
  if (!verdict_headline_.empty()) {
    html += fmt::format("<p><strong>{}</strong> {}</p>\n", html_escape(verdict_headline_),
                        html_escape(verdict_text_));
  }
  bool tiles_shown = false, table_shown = false;
  for (const Item& item : items_) {
    if (const Tiles* some = std::get_if<Tiles>(&item); some != nullptr && !tiles_shown) {
      html += "<table><tbody>\n";
      for (const Tile& tile : some->tiles) {
        html += fmt::format("<tr><td>{}</td><td><strong>{}</strong> {}</td><td>{}</td></tr>\n",
                            html_escape(tile.label), html_escape(tile.value),
                            html_escape(tile.unit), html_escape(tile.note));
      }
      html += "</tbody></table>\n";
      tiles_shown = true;
    } else if (const Table* one = std::get_if<Table>(&item); one != nullptr && !table_shown) {
      html += table_html(*one);
      table_shown = true;
    }
  }
  return html + "</div>\n";
}

void Page::write(const std::string& path) const { write_file_atomically(path, html()); }

}  // namespace sparflow
