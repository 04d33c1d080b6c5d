#include "studies/strategy_map_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "optimizer/baselines/strategies_statistics.h"

namespace sparflow {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double of_way(const MapPoint& p, MapWay way) {
  switch (way) {
    case MapWay::kSequentialMotion:
      return p.sequential;
    case MapWay::kSimultaneousMotion:
      return p.simultaneous;
    case MapWay::kOptimalMotion:
      break;
  }
  return p.optimal;
}

std::string cell(double v, const char* form = "{:.1f}") {
  return std::isfinite(v) ? fmt::format(fmt::runtime(form), v) : "";
}

double moving(const MapPoint& p, std::size_t count) {
  return count < p.share_moving.size() ? p.share_moving[count] : 0.0;
}

double overlap(const MapPoint& p) {
  double share = 0.0;
  for (std::size_t k = 2; k < p.share_moving.size(); ++k) share += p.share_moving[k];
  const double idle = moving(p, 0);
  return idle < 1.0 ? share / (1.0 - idle) : 0.0;
}

/// Limits of the picture's columns, as multiples of the shortest time: [from, to).
const std::vector<double>& columns() {
  static const std::vector<double> edges = {1.0, 1.1, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.5};
  return edges;
}

const MapPoint* point_in(const MapCurve& curve, double from, double to) {
  const MapPoint* best = nullptr;
  const double middle = std::sqrt(from * to);
  for (const MapPoint& p : curve.points) {
    const double r = p.duration / curve.shortest;
    if (r < from || r >= to) continue;
    if (best == nullptr || std::abs(std::log(r / middle)) <
                               std::abs(std::log(best->duration / curve.shortest / middle)))
      best = &p;
  }
  return best;
}

/// Colour of a cell: blue where the sequential motion is cheaper, orange where the simultaneous one is, white if equal.
std::string colour(double share) {
  const double a = std::clamp(std::abs(share) / 0.3, 0.0, 1.0);
  const auto mix = [&](int full) { return static_cast<int>(std::lround(255 + (full - 255) * a)); };
  return share < 0.0 ? fmt::format("#{:02x}{:02x}{:02x}", mix(33), mix(102), mix(172))
                     : fmt::format("#{:02x}{:02x}{:02x}", mix(217), mix(95), mix(2));
}

std::string grey(double share) {
  const int level = static_cast<int>(std::lround(255 - 170 * std::clamp(share, 0.0, 1.0)));
  return fmt::format("#{0:02x}{0:02x}{0:02x}", level);
}

struct TextStyle {
  const char* anchor = "middle";
  int size = 11;
  const char* fill = "#222";
};

std::string text_at(double x, double y, const std::string& text, const TextStyle& style = {}) {
  return fmt::format(
      R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}" font-size="{}" fill="{}">{}</text>)"
      "\n",
      x, y, style.anchor, style.size, style.fill, text);
}

std::string box_at(double x, double y, double w, double h, const std::string& fill) {
  return fmt::format(
      R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" stroke="#fff"/>)"
      "\n",
      x, y, w, h, fill);
}

std::string row_label(const MapCurve& c) {
  std::string name = c.reach;
  std::replace(name.begin(), name.end(), '_', ' ');
  return fmt::format("{}, {:g} kg", name, c.payload);
}

/// Smallest duration, as a multiple of the shortest time, at which a sequential motion keeps the limits.
double first_sequential(const MapCurve& c) {
  for (const MapPoint& p : c.points) {
    if (std::isfinite(p.sequential)) return p.duration / c.shortest;
  }
  return kNaN;
}

}  // namespace

BestTime best_time(const MapCurve& curve, MapWay way, double idle_power) {
  BestTime best;
  for (const MapPoint& p : curve.points) {
    const double energy = of_way(p, way);
    if (!std::isfinite(energy)) continue;
    const double cost = energy + idle_power * p.duration;
    if (best.duration > 0.0 && cost >= best.cost) continue;
    best = {p.duration, cost};
  }
  return best;
}

std::string map_csv(const std::vector<MapCurve>& curves) {
  std::string text =
      "reach,payload_kg,shortest_s,duration_s,time_ratio,sequential_J,simultaneous_J,optimal_J,"
      "share_0,share_1,share_2,share_3,share_4,optimum_from\n";
  for (const MapCurve& c : curves) {
    for (const MapPoint& p : c.points) {
      std::string from = p.from;
      std::replace(from.begin(), from.end(), ',', ';');
      text += fmt::format(
          "{},{:g},{:.3f},{:.3f},{:.3f},{},{},{:.1f},{:.4f},{:.4f},{:.4f},{:.4f},"
          "{:.4f},{}\n",
          c.reach, c.payload, c.shortest, p.duration, p.duration / c.shortest, cell(p.sequential),
          cell(p.simultaneous), p.optimal, moving(p, 0), moving(p, 1), moving(p, 2), moving(p, 3),
          moving(p, 4), from);
    }
  }
  return text;
}

std::string idle_csv(const std::vector<MapCurve>& curves, const std::vector<double>& idle_powers) {
  std::string text =
      "reach,payload_kg,idle_W,sequential_s,sequential_J,simultaneous_s,simultaneous_J,optimal_s,"
      "optimal_J\n";
  for (const MapCurve& c : curves) {
    for (const double idle : idle_powers) {
      text += fmt::format("{},{:g},{:g}", c.reach, c.payload, idle);
      for (const MapWay way :
           {MapWay::kSequentialMotion, MapWay::kSimultaneousMotion, MapWay::kOptimalMotion}) {
        const BestTime b = best_time(c, way, idle);
        text += b.duration > 0.0 ? fmt::format(",{:.3f},{:.1f}", b.duration, b.cost) : ",,";
      }
      text += "\n";
    }
  }
  return text;
}

std::string map_svg(const std::vector<MapCurve>& curves, const std::vector<double>& idle_powers) {
  constexpr double kLeft = 260, kTop = 74, kCell = 44, kRow = 19, kGap = 40;
  const std::size_t n = columns().size() - 1;
  const double second = kLeft + kCell * static_cast<double>(n) + kGap;
  const double third = second + kCell * static_cast<double>(n) + kGap;
  const double width = third + kCell * static_cast<double>(idle_powers.size()) + 20;
  const double height = kTop + kRow * static_cast<double>(curves.size()) + 70;
  std::string svg = fmt::format(
      R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0:.0f} {1:.0f}" width="{0:.0f}" height="{1:.0f}" font-family="sans-serif">)"
      "\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
      width, height);
  svg += text_at(kLeft, 20, "Sequential against simultaneous in equal time", {"start", 13});
  svg += text_at(kLeft, 36, "energy of the sequential motion over that of the joint line - 1 [%]",
                 {"start"});
  svg += text_at(second, 20, "Moving cylinders in the optimum", {"start", 13});
  svg += text_at(second, 36, "share of its moving time with two or more cylinders moving [%]",
                 {"start"});
  svg += text_at(third, 20, "Each at its own best duration", {"start", 13});
  svg += text_at(third, 36, "sequential over joint line - 1, idle energy included [%]", {"start"});
  for (std::size_t k = 0; k < n; ++k) {
    const std::string label = fmt::format("{:g}", columns()[k]);
    const double x = kCell * static_cast<double>(k);
    svg += text_at(kLeft + x, kTop - 8, label) + text_at(second + x, kTop - 8, label);
  }
  svg += text_at(kLeft - 8, kTop - 8, "duration over the shortest:", {"end"});
  for (std::size_t k = 0; k < idle_powers.size(); ++k) {
    svg += text_at(third + kCell * (static_cast<double>(k) + 0.5), kTop - 8,
                   fmt::format("{:g} kW", idle_powers[k] / 1e3));
  }
  double y = kTop;
  for (const MapCurve& c : curves) {
    svg += text_at(kLeft - 8, y + 13, row_label(c), {"end"});
    for (std::size_t k = 0; k < n && c.shortest > 0.0; ++k) {
      const double x = kCell * static_cast<double>(k);
      const MapPoint* p = point_in(c, columns()[k], columns()[k + 1]);
      if (p == nullptr) continue;
      const bool seq = std::isfinite(p->sequential), sim = std::isfinite(p->simultaneous);
      const double share = seq && sim ? p->sequential / p->simultaneous - 1.0 : kNaN;
      svg += box_at(kLeft + x, y, kCell, kRow,
                    seq && sim ? colour(share)
                    : sim      ? "#f6c492"
                    : seq      ? "#9fc3e3"
                               : "#eee");
      svg += text_at(
          kLeft + x + kCell / 2, y + 13,
          seq && sim ? fmt::format("{:+.0f}", 100.0 * share)
          : sim      ? "only sim"
          : seq      ? "only seq"
                     : "neither",
          {"middle", seq && sim ? 11 : 9, seq && sim && std::abs(share) > 0.2 ? "#fff" : "#222"});
      svg += box_at(second + x, y, kCell, kRow, grey(overlap(*p)));
      svg += text_at(second + x + kCell / 2, y + 13, fmt::format("{:.0f}", 100.0 * overlap(*p)),
                     {"middle", 11, overlap(*p) > 0.6 ? "#fff" : "#222"});
    }
    for (std::size_t k = 0; k < idle_powers.size(); ++k) {
      const BestTime seq = best_time(c, MapWay::kSequentialMotion, idle_powers[k]),
                     sim = best_time(c, MapWay::kSimultaneousMotion, idle_powers[k]);
      if (seq.duration <= 0.0 || sim.duration <= 0.0) continue;
      const double share = seq.cost / sim.cost - 1.0, x = third + kCell * static_cast<double>(k);
      svg += box_at(x, y, kCell, kRow, colour(share));
      svg += text_at(x + kCell / 2, y + 13, fmt::format("{:+.0f}", 100.0 * share),
                     {"middle", 11, std::abs(share) > 0.2 ? "#fff" : "#222"});
    }
    y += kRow;
  }
  svg +=
      text_at(kLeft, y + 24,
              "Blue: the sequential motion takes less. Orange: the simultaneous motion takes less. "
              "Columns begin at the figure above their left edge.",
              {"start"});
  svg +=
      text_at(kLeft, y + 42,
              "only sim: no sequential motion of this duration keeps the limits; neither: only the "
              "optimum with its overlaps does.",
              {"start"});
  return svg + "</svg>\n";
}

std::string map_summary(const std::vector<MapCurve>& curves,
                        const std::vector<double>& idle_powers) {
  std::string text = fmt::format("{:>12} {:>6} {:>24} {:>10} {:>10} {:>9} {:>9} {:>9}\n",
                                 "time/short.", "n", "seq/sim-1 % (quartiles)", "seq wins",
                                 "opt/seq %", "1 moves", "2 move", "3+ move");
  for (std::size_t k = 0; k + 1 < columns().size(); ++k) {
    std::vector<double> share, above, one, two, three;
    int wins = 0;
    for (const MapCurve& c : curves) {
      for (const MapPoint& p : c.points) {
        const double r = p.duration / c.shortest;
        if (r < columns()[k] || r >= columns()[k + 1]) continue;
        one.push_back(moving(p, 1));
        two.push_back(moving(p, 2));
        three.push_back(moving(p, 3) + moving(p, 4));
        if (std::isfinite(p.sequential)) above.push_back(p.sequential / p.optimal - 1.0);
        if (!std::isfinite(p.sequential) || !std::isfinite(p.simultaneous)) continue;
        share.push_back(p.sequential / p.simultaneous - 1.0);
        wins += share.back() < -1e-3 ? 1 : 0;
      }
    }
    text += fmt::format(
        "{:5g}..{:<5g} {:6} {:>8} ({:>6} ..{:>6}) {:>6}/{:<3} {:>10} {:>9} {:>9} {:>9}\n",
        columns()[k], columns()[k + 1], one.size(), cell(100.0 * quantile(share, 0.5)),
        cell(100.0 * quantile(share, 0.25)), cell(100.0 * quantile(share, 0.75)), wins,
        share.size(), cell(100.0 * quantile(above, 0.5), "{:.2f}"),
        cell(100.0 * quantile(one, 0.5)), cell(100.0 * quantile(two, 0.5)),
        cell(100.0 * quantile(three, 0.5)));
  }
  std::vector<double> first, limit;
  for (const MapCurve& c : curves) {
    first.push_back(first_sequential(c));
    if (!c.points.empty()) limit.push_back(c.points.back().optimal / c.sequential_limit - 1.0);
  }
  first.erase(std::remove_if(first.begin(), first.end(), [](double v) { return std::isnan(v); }),
              first.end());
  text += fmt::format(
      "sequential motions are possible from {:.2f} times the shortest time on (median; "
      "{:.2f} .. {:.2f})\n",
      quantile(first, 0.5), quantile(first, 0.0), quantile(first, 1.0));
  text += fmt::format(
      "optimum of the longest duration against the sequential limit at unlimited time: {:+.2f} % "
      "(median), {:+.2f} .. {:+.2f}\n",
      100.0 * quantile(limit, 0.5), 100.0 * quantile(limit, 0.0), 100.0 * quantile(limit, 1.0));
  for (const double idle : idle_powers) {
    std::vector<double> share, time;
    int wins = 0;
    for (const MapCurve& c : curves) {
      const BestTime seq = best_time(c, MapWay::kSequentialMotion, idle),
                     sim = best_time(c, MapWay::kSimultaneousMotion, idle),
                     opt = best_time(c, MapWay::kOptimalMotion, idle);
      if (opt.duration > 0.0) time.push_back(opt.duration / c.shortest);
      if (seq.duration <= 0.0 || sim.duration <= 0.0) continue;
      share.push_back(seq.cost / sim.cost - 1.0);
      wins += share.back() < -1e-3 ? 1 : 0;
    }
    text += fmt::format(
        "idle {:4.1f} kW: seq/sim-1 at own best times {:+.1f} % (median; {:+.1f} .. "
        "{:+.1f}), sequential wins {} of {}; the optimum takes {:.2f} times the "
        "shortest time\n",
        idle / 1e3, 100.0 * quantile(share, 0.5), 100.0 * quantile(share, 0.25),
        100.0 * quantile(share, 0.75), wins, share.size(), quantile(time, 0.5));
  }
  return text;
}

}  // namespace sparflow
