#include "apps/report/model_pages/diagnose_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/report/model_pages/compare_charts.h"
#include "apps/report/model_pages/effect_text.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kStretchSeconds =
    30.0;  // [s] length of a stretch in which curves can still be compared by eye
constexpr std::size_t kMostRanked = 10, kFewestRanked = 3;
constexpr std::size_t kMostChannels = 2;  // drawn of an effect that acts in several

bool suspect_row(const Evidence& evidence, const EvidenceChannel& channel, std::size_t block) {
  return static_cast<std::size_t>(channel.log[block]) < evidence.suspects;
}

/// The kind of signal against which the residual of this effect has its typical form; "" when none is known.
std::string shows_against(const Effect& effect) {
  static const std::map<std::string, std::string> known = {
      {"coulomb_friction", "speed"},
      {"viscous_friction", "speed"},
      {"stribeck_friction", "speed"},
      {"load_friction", "speed"},
      {"pad_friction", "speed"},
      {"presliding", "speed"},
      {"end_cushion", "length"},
      {"unmodelled_mass", "angle"},
      {"payload_error", "angle"},
      {"base_tilt", "angle"},
      {"angle_offset", "angle"},
      {"structural_flex", "load"},
      {"force_offset", "load"},
      {"pressure_offset", "load"},
      {"inertia", "acceleration"},
      {"return_back_pressure", "all_return_flow"},
      {"line_loss", "flow"},
      {"flow_dependent_margin", "pump_flow"},
      {"flow_saturation", "pump_flow"},
      {"torque_limit", "pump_flow"},
      {"oil_temperature", "oil"},
      {"counterbalance", "load"},
      {"valve_deadband", "command"},
      {"leakage", "load"},
      {"valve_lag", "command_slope"},
      {"pump_lag", "pressure_slope"},
      {"compressibility", "command_slope"},
      {"sensor_delay", "acceleration"}};
  const auto at = known.find(effect.info().id);
  return at == known.end() ? "" : at->second;
}

/// Chooses a signal of the preferred kind where it explains at least half as much as the best signal, else the best.
const ExplainingSignal* choose(const std::vector<ExplainingSignal>& signals,
                               const VectorXd& residual, const std::string& preferred) {
  const ExplainingSignal* best = nullptr;
  const ExplainingSignal* own = nullptr;
  double most = -1.0, most_own = -1.0;
  for (const ExplainingSignal& s : signals) {
    const double share = share_explained(s.values, residual);
    if (share > most) most = share, best = &s;
    if (s.id == preferred && share > most_own) most_own = share, own = &s;
  }
  return own != nullptr && most_own >= 0.5 * most ? own : best;
}

int color_of(const Diagnosis& d, const EvidenceChannel& channel) {
  return channel.kind == EvidenceKind::kPump
             ? d.evidence.series.front().machine->cylinder_count() + channel.index
             : channel.index;
}

FieldUnit shown_unit(const EvidenceChannel& channel, double largest) {
  if (channel.unit.name == "N" && largest >= 1e4) return {"kN", 1e3};
  return channel.unit;
}

double largest_of(const VectorXd& x) {
  return x.size() == 0 ? 0.0 : x.array().isFinite().select(x.array().abs(), 0.0).maxCoeff();
}

Quantity axis_of(const EvidenceChannel& channel, const std::string& unit) {
  return {channel.kind == EvidenceKind::kForce  ? "force"
          : channel.kind == EvidenceKind::kFlow ? "rod speed"
                                                : "pressure",
          unit};
}

/// Weight of each row of a channel in the error by which an effect was judged. [rows]
VectorXd row_weights(const Diagnosis& d, const EvidenceChannel& channel) {
  const std::vector<double> weights =
      d.block_weights(static_cast<std::size_t>(&channel - d.evidence.channels.data()));
  VectorXd rows = VectorXd::Ones(channel.rows());
  for (std::size_t b = 0; b < weights.size(); ++b)
    rows.segment(channel.blocks[b].first, channel.blocks[b].last - channel.blocks[b].first)
        .setConstant(weights[b]);
  return rows;
}

/// Draws measurement and model over the stretch of one log in which the effect shows most, with gaps between blocks.
LineChart curves(const Diagnosis& d, const ChannelPicture& p, const std::string& effect) {
  const EvidenceChannel& channel = *p.channel;
  // The rows of each suspect log are in the order of time; the best stretch of all logs is kept.
  std::vector<Index> rows;
  std::size_t best_log = 0;
  double most = -1.0;
  const VectorXd weight = row_weights(d, channel);
  for (std::size_t log = 0; log < d.evidence.suspects; ++log) {
    std::vector<Index> own;
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      if (channel.log[b] != static_cast<int>(log)) continue;
      for (Index r = channel.blocks[b].first; r < channel.blocks[b].last; ++r) own.push_back(r);
    }
    if (own.size() < 2) continue;
    const auto n = static_cast<Index>(own.size());
    VectorXd time(n), gain(n);
    for (Index i = 0; i < n; ++i) {
      const Index r = own[static_cast<std::size_t>(i)];
      time[i] = d.evidence.series[log].time[channel.sample[static_cast<std::size_t>(r)]];
      gain[i] = weight[r] * (p.without[r] * p.without[r] - p.with[r] * p.with[r]);
    }
    const Stretch at = best_stretch(time, gain, kStretchSeconds);
    const double sum = gain.segment(at.first, at.last - at.first).sum();
    if (!rows.empty() && sum <= most) continue;
    most = sum;
    best_log = log;
    rows.assign(own.begin() + at.first, own.begin() + at.last);
  }
  LineChart chart;
  chart.title = capitalised(channel.text);
  if (rows.empty()) return chart;
  const MachineSeries& log = d.evidence.series[best_log];
  std::vector<double> time, measured, without, with;
  const double gap = 3.0 * d.evidence.stride * log.step;
  for (const Index r : rows) {
    const double t = log.time[channel.sample[static_cast<std::size_t>(r)]];
    if (!time.empty() && t - time.back() > gap) {  // no row there: the machine rests
      time.push_back(time.back() + 0.5 * (t - time.back()));
      for (auto* column : {&measured, &without, &with}) column->push_back(kNaN);
    }
    time.push_back(t);
    measured.push_back(p.measured[r]);
    without.push_back(p.measured[r] - p.without[r]);
    with.push_back(p.measured[r] - p.with[r]);
  }
  const auto n = static_cast<Index>(time.size());
  const auto column = [n](const std::vector<double>& v) {
    return VectorXd(Eigen::Map<const VectorXd>(v.data(), n));
  };
  const FieldUnit unit = shown_unit(channel, largest_of(column(measured)));
  chart.x = column(time);
  chart.y_axis = axis_of(channel, unit.name);
  const int color = color_of(d, channel);
  chart.series.push_back(
      {"measured", column(measured) / unit.si, LineStyle::kMeasured, color, {}, {}});
  chart.series.push_back(
      {"model without " + effect, column(without) / unit.si, LineStyle::kBefore, -1, {}, {}});
  chart.series.push_back(
      {"model with " + effect, column(with) / unit.si, LineStyle::kPredicted, color, {}, {}});
  chart.note =
      fmt::format("The {:.0f} s in which the effect shows most. Nothing is compared in the gaps.",
                  kStretchSeconds);
  return chart;
}

ScatterChart residuals(const Diagnosis& d, const ChannelPicture& p, const ExplainingSignal& signal,
                       bool both) {
  const EvidenceChannel& channel = *p.channel;
  const FieldUnit unit = shown_unit(channel, largest_of(p.without));
  ScatterChart chart;
  chart.title = fmt::format("Residual of the {} against {}", channel.text, signal.words);
  chart.x_axis = {signal.words, signal.unit};
  chart.y_axis = {kErrorAxis, unit.name};
  chart.trend = true;
  std::vector<double> x, without, with;
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    if (!suspect_row(d.evidence, channel, b)) continue;
    for (Index r = channel.blocks[b].first; r < channel.blocks[b].last; ++r) {
      x.push_back(signal.values[r]);
      without.push_back(-p.without[r] / unit.si);
      with.push_back(-p.with[r] / unit.si);
    }
  }
  const auto n = static_cast<Index>(x.size());
  const auto column = [n](const std::vector<double>& v) {
    return VectorXd(Eigen::Map<const VectorXd>(v.data(), n));
  };
  if (both)
    chart.groups.push_back({"without the effect", column(x), column(without), kBeforeColor});
  chart.groups.push_back(
      {both ? "with it" : "residual", column(x), column(with), color_of(d, channel)});
  chart.note = fmt::format(
      "Lines: medians in bins. {} explains {:.0f} % of the residual's variance{}.",
      capitalised(signal.words), 100.0 * share_explained(column(x), column(both ? without : with)),
      both ? fmt::format(" without the effect, {:.0f} % with it",
                         100.0 * share_explained(column(x), column(with)))
           : "");
  return chart;
}

/// Draws the residual over time in the longest block, since an oscillation does not show against a signal.
LineChart residual_over_time(const Diagnosis& d, const ChannelPicture& p) {
  const EvidenceChannel& channel = *p.channel;
  std::size_t longest = 0;
  Index rows = 0;
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    const Index n = channel.blocks[b].last - channel.blocks[b].first;
    if (suspect_row(d.evidence, channel, b) && n > rows) rows = n, longest = b;
  }
  LineChart chart;
  chart.title = fmt::format("Residual of the {} over time", channel.text);
  if (rows == 0) return chart;
  const MachineSeries& log = d.evidence.series[static_cast<std::size_t>(channel.log[longest])];
  const FieldUnit unit = shown_unit(channel, largest_of(p.with));
  chart.x.resize(rows);
  for (Index i = 0; i < rows; ++i) {
    const auto row = static_cast<std::size_t>(channel.blocks[longest].first + i);
    chart.x[i] = log.time[channel.sample[row]];
  }
  chart.y_axis = {kErrorAxis, unit.name};
  chart.series.push_back({"residual",
                          -p.with.segment(channel.blocks[longest].first, rows) / unit.si,
                          LineStyle::kPredicted,
                          color_of(d, channel),
                          {},
                          {}});
  chart.note = "The longest motion without a gap.";
  return chart;
}

}  // namespace

void add_effect_pictures(Page& page, const Diagnosis& d, std::size_t effect) {
  const DiagnosedEffect& e = d.effects[effect];
  std::vector<std::size_t> channels;
  for (const ChannelGain& g : e.channels) channels.push_back(g.channel);
  if (channels.size() > kMostChannels) channels.resize(kMostChannels);
  for (std::size_t n = 0; n < channels.size(); ++n) {
    const ChannelPicture p = channel_picture(d, static_cast<int>(effect), channels[n]);
    LineChart over_time = curves(d, p, e.key());
    const std::vector<ExplainingSignal> signals = explaining_signals(d.evidence, *p.channel);
    const ExplainingSignal* signal = choose(signals, p.without, shows_against(*e.effect.effect));
    if (n > 0) over_time.width = FigureWidth::kHalf;
    page.plot(std::move(over_time));
    if (signal == nullptr) continue;
    ScatterChart chart = residuals(d, p, *signal, true);
    if (n > 0) chart.width = FigureWidth::kHalf;
    page.plot(std::move(chart));
  }
}

void add_unexplained_residual(Page& page, const Diagnosis& d, const std::string& stage,
                              const std::string& at, bool swings) {
  constexpr double kLeastChartShare =
      0.03;  // [-] of the residual's variance, for a chart against a signal
  for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
    const EvidenceChannel& channel = d.evidence.channels[c];
    if (channel.at != at || evidence_stage(channel.kind) != stage) continue;
    const ChannelPicture p = channel_picture(d, -1, c);
    if (swings) page.plot(residual_over_time(d, p));
    const std::vector<ExplainingSignal> signals = explaining_signals(d.evidence, channel);
    std::vector<std::pair<double, const ExplainingSignal*>> ranked;
    ranked.reserve(signals.size());
    for (const ExplainingSignal& s : signals)
      ranked.emplace_back(share_explained(s.values, p.with), &s);
    std::stable_sort(ranked.begin(), ranked.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    for (std::size_t i = 0; i < std::min<std::size_t>(2, ranked.size()); ++i) {
      if (swings && ranked[i].first < kLeastChartShare) continue;
      ScatterChart chart = residuals(d, p, *ranked[i].second, false);
      chart.width = FigureWidth::kHalf;
      page.plot(std::move(chart));
    }
  }
}

void add_remaining_residuals(Page& page, const Diagnosis& d) {
  constexpr std::size_t kMostPictures = 4;
  struct Left {
    std::size_t channel;
    double share;  // [-] of the residual's variance that `signal` explains
    ExplainingSignal signal;
  };
  std::vector<Left> left;
  Table table;
  table.title = "Residual of each quantity";
  table.columns = {{"quantity"}, {"residual, RMS", "", 3}, {"sensor noise", "", 3},
                   {"unit"},     {"strongest signal"},     {"it explains", "%", 2}};
  for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
    const EvidenceChannel& channel = d.evidence.channels[c];
    if (channel.rows() == 0) continue;
    const ChannelPicture p = channel_picture(d, -1, c);
    Left best{c, -1.0, {}};
    for (ExplainingSignal& s : explaining_signals(d.evidence, channel)) {
      // The noise of a measured speed correlates with its own error, whatever the model.
      const bool same_sensor = s.id == "speed" || s.id == "acceleration" || s.id.ends_with("flow");
      if (channel.kind == EvidenceKind::kFlow && same_sensor) continue;
      const double share = share_explained(s.values, p.with);
      if (share > best.share) best = {c, share, std::move(s)};
    }
    const double rms = std::sqrt(p.with.squaredNorm() / static_cast<double>(p.with.size()));
    const auto [shown, unit] = readable_error(rms, channel.unit);
    const double scale = rms > 0.0 ? shown / rms : 1.0 / channel.unit.si;
    table.rows.push_back({channel.text, shown,
                          std::isfinite(channel.noise_floor) ? channel.noise_floor * scale : kNaN,
                          unit, best.signal.words, 100.0 * std::max(0.0, best.share)});
    if (best.share >= 0.0) left.push_back(std::move(best));
  }
  if (table.rows.empty()) return;
  page.section("Residuals");
  table.note =
      "Residual of the model after its pressure models were fitted to these logs, filtered as the "
      "evidence is. Strongest signal: the one that explains most of the variance in bins; a few "
      "per "
      "cent are chance.";
  page.table(std::move(table));
  std::stable_sort(left.begin(), left.end(),
                   [](const Left& a, const Left& b) { return a.share > b.share; });
  for (std::size_t i = 0; i < std::min(kMostPictures, left.size()); ++i) {
    ScatterChart chart =
        residuals(d, channel_picture(d, -1, left[i].channel), left[i].signal, false);
    chart.width = FigureWidth::kHalf;
    page.plot(std::move(chart));
  }
}

LineChart bad_channel_chart(const BadChannel& bad) {
  LineChart chart;
  chart.title = fmt::format("{} in {}", bad.channel, bad.file);
  chart.y_axis = {bad.channel, bad.unit};
  chart.x = bad.time;
  chart.series.push_back({"as logged", bad.values, LineStyle::kPlain, 0, {}, {}});
  std::string word = bad_data_word(bad.kind);
  std::replace(word.begin(), word.end(), '_', ' ');
  const double lasts = bad.time.size() > 1 ? bad.time[bad.time.size() - 1] - bad.time[0] : 0.0;
  const double thinnest = 0.002 * lasts;         // A single sample would be too thin to be seen.
  std::vector<std::pair<double, double>> drawn;  // gaps about as wide as a line are closed
  for (const auto& [from, to] : bad.stretches) {
    if (!drawn.empty() && from - drawn.back().second <= 0.01 * lasts)
      drawn.back().second = to;
    else
      drawn.emplace_back(from, to);
  }
  for (const auto& [from, to] : drawn) {
    const double more = std::max(0.0, 0.5 * (thinnest - (to - from)));
    chart.spans.push_back({from - more, to + more, chart.spans.empty() ? word : ""});
  }
  chart.note = fmt::format(
      "Shaded: the channel is {} there; close samples are shaded together, and {:.3g} % of the "
      "log are set aside.",
      word, 100.0 * bad.share);
  return chart;
}

void add_ranking(Page& page, const Diagnosis& d) {
  if (d.ranking.empty()) return;
  BarChart chart;
  chart.title = "Gain of each single effect";
  chart.value_axis = {"gain in log-likelihood", "nats"};
  std::vector<double> values;
  for (const auto& [key, gain] : d.ranking) {
    if (values.size() == kMostRanked) break;
    if (gain <= 0.0 && values.size() >= kFewestRanked) break;
    chart.categories.push_back(key);
    values.push_back(gain);
  }
  if (d.search.threshold > 0.0) {
    chart.categories.push_back("chance, at 5 %");
    values.push_back(d.search.threshold);
  }
  chart.series.push_back(
      {"gain", Eigen::Map<VectorXd>(values.data(), static_cast<Index>(values.size()))});
  chart.note =
      "Gain with this candidate alone in the model, less half the logarithm of the sample size for "
      "each parameter. A candidate similar to the missing effect (another kind of friction) gains "
      "too until the right one is in the model. The last bar is the threshold of the gain: where "
      "nothing is missing, the best candidate reaches it in one case of twenty.";
  page.plot(std::move(chart));
}

}  // namespace sparflow
