/// The proposal as a mapping file, as a table, and guesses without a machine.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "identification/mapping_proposal/mapping_proposal.h"

namespace sparflow {
namespace {

/// A double-quoted YAML scalar.
std::string yaml_quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

/// Text of a comment: one line.
std::string one_line(const std::string& text) {
  std::string out = text;
  for (char& c : out) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  return out;
}

std::string in_percent(double confidence) { return fmt::format("{:.0f} %", 100.0 * confidence); }

/// Names with a backtick cannot stand between backticks; the reader then finds them as they are.
bool can_be_written(const MeaningProposal& m) {
  return std::count(m.channel_name.begin(), m.channel_name.end(), '`') == 0;
}

}  // namespace

std::string mapping_yaml(const MappingProposal& p, const Machine& machine) {
  std::string yaml = fmt::format(
      "# Proposed by sparflow log for machine {}; check it before use (docs/mapping_proposal.md).\n"
      "# Each line: the program's name, an expression over the log's own columns, confidence.\n"
      "columns:\n",
      one_line(machine.name));
  std::size_t written = 0;
  if (!p.clock.empty() && p.clock.find('`') == p.clock.npos) {
    yaml += fmt::format("  t_s: {}\n", yaml_quoted(p.clock_expression));
    ++written;
  }
  std::string unsure, missing;
  for (const MeaningProposal& m : p.meanings) {
    if (m.column.empty()) continue;
    const std::string meaning = one_line(meaning_words(m.meaning, machine));
    if (m.channel < 0) {
      missing += fmt::format("# no channel: {} ({})\n", m.column, meaning);
      continue;
    }
    const std::string line = fmt::format("{}: {}", m.column, yaml_quoted(m.expression));
    const std::string why = m.reasons.empty() ? "" : "; " + one_line(m.reasons.back());
    if (p.sure(m) && can_be_written(m)) {
      yaml += fmt::format("  {}  # {}{}\n", line, in_percent(m.confidence), why);
      ++written;
    } else {
      unsure += fmt::format("  # unsure: {}  # {}{}{}\n", one_line(line), in_percent(m.confidence),
                            m.other.empty() ? "" : ", or " + one_line(m.other), why);
    }
  }
  // An empty table must be written as one.
  if (written == 0) yaml.insert(yaml.size() - 1, " {}");
  return yaml + unsure + missing;
}

std::string proposal_table(const MappingProposal& p, const Machine& machine) {
  std::size_t width = 7;
  for (const MeaningProposal& m : p.meanings) width = std::max(width, m.channel_name.size());
  width = std::min<std::size_t>(width, 40);
  std::string text =
      fmt::format("proposed mapping for {} (nothing is used unasked)\n", machine.name);
  const auto list = [&](bool sure) {
    for (const MeaningProposal& m : p.meanings) {
      if (m.channel < 0 || p.sure(m) != sure) continue;
      text += fmt::format("  {:<{}}  {:>5}  {}{}{}\n", m.channel_name, width,
                          in_percent(m.confidence), meaning_words(m.meaning, machine),
                          m.column.empty() ? " (the program computes it)" : " -> " + m.column,
                          sure || m.other.empty() ? "" : fmt::format("; or {}", m.other));
      for (std::size_t k = 0; k < std::min<std::size_t>(m.reasons.size(), 4); ++k) {
        text += fmt::format("  {:<{}}         {}\n", "", width, m.reasons[k]);
      }
    }
  };
  list(true);
  const auto unsure =
      std::count_if(p.meanings.begin(), p.meanings.end(),
                    [&](const MeaningProposal& m) { return m.channel >= 0 && !p.sure(m); });
  if (unsure > 0) text += fmt::format("unsure (below {}):\n", in_percent(p.unsure_below));
  list(false);
  std::string missing;
  for (const MeaningProposal& m : p.meanings) {
    if (m.channel >= 0) continue;
    missing += fmt::format("{}{}{}", missing.empty() ? "" : ", ", meaning_words(m.meaning, machine),
                           m.required ? " (required)" : "");
  }
  if (!missing.empty()) text += fmt::format("without a channel: {}\n", missing);
  if (!p.left_over.empty())
    text += fmt::format("without a meaning: {}\n", fmt::join(p.left_over, ", "));
  for (const std::string& note : p.notes) text += note + "\n";
  return text;
}

std::vector<std::string> channel_guesses(const TimedChannels& file) {
  /// Channels whose derivatives are compared with each other.
  constexpr std::size_t kCompared = 120;
  /// Share of a rate that its measured copy may leave.
  /// @threshold [1] 0.1..0.6; chosen: noise of both; unrelated signals leave nearly all
  constexpr double kLeft = 0.4;
  const ProposalSamples samples = proposal_samples(file.recording);
  const auto& channels = file.recording.channels;
  std::vector<std::string> out;
  out.reserve(channels.size());
  const std::size_t compared = std::min(kCompared, channels.size());
  std::vector<Eigen::VectorXd> rates(compared);
  for (std::size_t i = 0; i < compared; ++i) {
    if (!samples.shapes[i].usable || samples.shapes[i].constant) continue;
    rates[i] = rate_of_change(samples, samples.values.col(static_cast<Eigen::Index>(i)));
  }
  for (std::size_t m = 0; m < channels.size(); ++m) {
    const std::string what =
        looks_like(channels[m].name, channel_unit(channels[m].name, channels[m].unit));
    std::string sentence = what.empty() ? "" : fmt::format("looks like a {}", what);
    double best = kLeft, factor = 0.0;
    std::size_t of = compared;
    for (std::size_t i = 0; i < compared && m < compared; ++i) {
      if (i == m || rates[i].size() == 0 || rates[m].size() == 0) continue;
      const auto v = samples.values.col(static_cast<Eigen::Index>(m));
      const double square = rates[i].squaredNorm(), all = v.squaredNorm();
      if (!(square > 0.0) || !(all > 0.0)) continue;
      const double k = v.dot(rates[i]) / square;
      const double left = std::sqrt(std::max(0.0, (v - k * rates[i]).squaredNorm() / all));
      if (left < best) best = left, of = i, factor = k;
    }
    if (of < compared) {
      sentence +=
          fmt::format("{}moves as the derivative of {} times {:.4g} but for {:.0f} %",
                      sentence.empty() ? "" : ", ", channels[of].name, factor, 100.0 * best);
    }
    out.push_back(std::move(sentence));
  }
  return out;
}

}  // namespace sparflow
