/// Ablation study of the diagnosis: each mechanism of the search is switched off in turn on the logs of the blind test.
/// A mechanism that decided nothing in a run has the same result without it, so that only the other runs are repeated.
///   build/bench/ablation --runs 100 --seed 71000 --json runs.jsonl     # adds what the file lacks, then prints the table
///   build/bench/ablation --runs 0 --json runs.jsonl                    # prints the table of a file
/// Results and what followed from them: docs/ablation.md.
#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <map>
#include <optional>
#include <set>

#include "bench/program_options.h"
#include "models/math/error.h"
#include "studies/blind_table.h"
#include "studies/share.h"

namespace {

using namespace sparflow;
using namespace sparflow::bench;
using nlohmann::json;

struct Named {
  const char* name;
  std::optional<Mechanism> mechanism;  ///< none: switched off by an option of the evidence
};

const Named kMechanisms[] = {{"leaders", Mechanism::kLeaders},
                             {"leaders_in_estimate", Mechanism::kEstimateLeaders},
                             {"optional", Mechanism::kOptional},
                             {"oil", {}},
                             {"angles", Mechanism::kAngles},
                             {"share_at_one", Mechanism::kShareAtOne},
                             {"form_gain", Mechanism::kFormGain},
                             {"form_power", Mechanism::kFormPower},
                             {"form_size", Mechanism::kFormSize},
                             {"absorbed", Mechanism::kAbsorbed},
                             {"size", Mechanism::kSize},
                             {"bound", Mechanism::kBound},
                             {"held_out", Mechanism::kHeldOut},
                             {"joint", Mechanism::kJoint},
                             {"least_gain", Mechanism::kLeastGain},
                             {"squares_shape", Mechanism::kSquaresShape},
                             {"plainer", Mechanism::kPlainer},
                             {"merge", Mechanism::kMerge},
                             {"reshape", Mechanism::kReshape},
                             {"minor", Mechanism::kMinor},
                             {"once", Mechanism::kOnce},
                             {"event", Mechanism::kEvent},
                             {"settling", Mechanism::kSettling},
                             {"blocks", Mechanism::kBlocks},
                             {"common_support", Mechanism::kCommonSupport},
                             {"void", Mechanism::kVoid},
                             {"pump_follows", Mechanism::kPumpFollows}};

struct Options {
  int runs = 100;
  std::uint64_t seed = 71000;
  BlindCase how;
  std::vector<std::string> rows = {"none", "clear", "small", "pairs"};
  std::vector<std::string> without, together;
  std::string json;
};

volatile std::sig_atomic_t stopped = 0;

/// Identifies a case in the file, and with a mechanism a diagnosis of it.
std::string key_of(const BlindCase& c, const std::string& without = "") {
  return fmt::format("{}/{}/{}/{}", c.row, c.only, c.seed, without);
}

/// Whether a channel of the evidence has other rows when the return line's law ignores the oil's temperature.
bool oil_decides(const PreparedCase& prepared, const DiagnoseOptions& all,
                 const DiagnoseOptions& off) {
  const Evidence a = prepared.evidence(all), b = prepared.evidence(off);
  return !std::equal(a.channels.begin(), a.channels.end(), b.channels.begin(), b.channels.end(),
                     [](const EvidenceChannel& x, const EvidenceChannel& y) {
                       return x.sample == y.sample && x.kind == y.kind && x.index == y.index &&
                              x.log == y.log;
                     });
}

constexpr const char* kTogether = "together";

template <class List>
bool contains(const List& list, const std::string& name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

/// Options with the named mechanisms switched off.
DiagnoseOptions options_without(const std::vector<std::string>& names) {
  DiagnoseOptions options;
  for (const Named& one : kMechanisms) {
    if (!contains(names, one.name)) continue;
    if (one.mechanism)
      options.evidence.mechanisms.switch_off(*one.mechanism);
    else
      options.evidence.branches.least_oil_range = 1e9;  // K, more than any oil changes
  }
  return options;
}

class Study {
 public:
  explicit Study(const Options& options) : options_(options) {
    std::ifstream in(options.json);
    for (std::string line; std::getline(in, line);) {
      if (!line.empty()) keep(json::parse(line));
    }
    out_.open(options.json, std::ios::app);
  }

  void run_all() {
    for (int i = 0; i < options_.runs && stopped == 0; ++i) {
      for (const std::string& row : options_.rows) {
        BlindCase one = options_.how;
        one.row = row;
        one.seed = options_.seed + static_cast<std::uint64_t>(i);
        one.reference = one.seed % 2 == 0;
        if (stopped == 0) run_case(one);
      }
    }
  }

  const std::map<std::string, json>& runs() const { return runs_; }

 private:
  void run_case(const BlindCase& asked) {
    const auto whole = runs_.find(key_of(asked));
    if (whole != runs_.end() && missing(asked, whole->second).empty()) return;
    try {
      const PreparedCase prepared(asked);
      if (whole == runs_.end()) {
        DiagnoseOptions all;
        all.evidence.mechanisms.record();
        json line = diagnosed(prepared, asked, all, "");
        line["acted"] = json::array();
        for (const Named& m : kMechanisms) {
          const bool acted = m.mechanism ? all.evidence.mechanisms.acted(*m.mechanism)
                                         : oil_decides(prepared, all, options_without({m.name}));
          if (acted) line["acted"].push_back(m.name);
        }
        add(std::move(line));
      }
      for (const std::string& name : missing(asked, runs_.at(key_of(asked)))) {
        if (stopped != 0) continue;
        const bool all = name == kTogether;
        json line = diagnosed(prepared, asked,
                              options_without(all ? options_.together : std::vector{name}), name);
        if (all) line["off"] = options_.together;
        add(std::move(line));
      }
    } catch (const InputError& error) {
      BlindRun run;
      run.asked = asked;
      run.left_out = error.what();
      json line = run_json(run);
      line["only"] = asked.only;
      line["without"] = "";
      line["acted"] = json::array();
      add(std::move(line));
    }
  }

  /// The mechanisms that acted in a case and whose diagnosis without them the file lacks.
  std::vector<std::string> missing(const BlindCase& asked, const json& whole) const {
    std::vector<std::string> out;
    const json& acted = whole.at("acted");
    const auto lacks = [&](const std::string& name) {
      return !runs_.contains(key_of(asked, name));
    };
    bool one_of_all = false;
    for (const Named& m : kMechanisms) {
      if (!contains(acted, m.name)) continue;
      const bool wanted = options_.without.empty() || contains(options_.without, m.name);
      if (wanted && lacks(m.name)) out.emplace_back(m.name);
      one_of_all = one_of_all || contains(options_.together, m.name);
    }
    if (one_of_all && lacks(kTogether)) out.emplace_back(kTogether);
    return out;
  }

  static json diagnosed(const PreparedCase& prepared, const BlindCase& asked,
                        const DiagnoseOptions& options, const std::string& without) {
    const std::clock_t before = std::clock();  // of all threads; nothing else runs in this program
    json line = run_json(prepared.diagnosed(options));
    line["core_seconds"] = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
    line["only"] = asked.only;
    line["without"] = without;
    return line;
  }

  void keep(json line) {
    BlindCase c;
    c.row = line.at("row");
    c.only = line.at("only");
    c.seed = line.at("seed");
    const std::string without = line.at("without");
    runs_[key_of(c, without)] = std::move(line);
  }
  void add(json line) {
    out_ << line.dump() << std::endl;
    fmt::print(stderr, "{} {} {} without {}: {} {}\n", line["row"].get<std::string>(),
               line["only"].get<std::string>(), line["seed"].get<int>(),
               line["without"].get<std::string>(), line["good"].get<bool>() ? " " : "X",
               line["answer"].get<std::string>());
    keep(std::move(line));
  }

  const Options& options_;
  std::map<std::string, json> runs_;
  std::ofstream out_;
};

/// Runs with a mechanism and without it.
struct Pairs {
  int both = 0, with = 0, without = 0, neither = 0;
  void count(bool a, bool b) { ++(a ? (b ? both : with) : (b ? without : neither)); }
  int runs() const { return both + with + without + neither; }
  /// "+ 5 - 1  1.0 (-0.4 ..  2.7)": runs right only with it, only without it, difference [%] with 95 % limits.
  std::string text() const {
    const PairedDifference d = paired_difference(both, with, without, neither);
    return fmt::format("+{:2d} -{:2d} {:5.1f} ({:5.1f} ..{:5.1f})", with, without, 100.0 * d.value,
                       100.0 * d.lower, 100.0 * d.upper);
  }
};

/// What a mechanism changed in one row.
struct RowSum {
  int acted = 0, changed = 0;
  Pairs right, exact;
  int held_with = 0, held_without = 0, intervals_with = 0, intervals_without = 0;
  double log_errors = 0.0, core_with = 0.0, core_without = 0.0;
  int errors = 0;
};

bool only_the_truth(const json& r) {
  const bool named = r.at("row") != "none" && r.at("row") != "outside";
  return r.at(named ? "exact" : "good").get<bool>();
}

void compare(const json& with, const json& without, RowSum& sum) {
  sum.right.count(with.at("good"), without.at("good"));
  sum.exact.count(only_the_truth(with), only_the_truth(without));
  if (&with == &without) return;
  ++sum.acted;
  sum.changed +=
      with.at("answer") != without.at("answer") || with.at("verdict") != without.at("verdict");
  sum.core_with += with.at("core_seconds").get<double>();
  sum.core_without += without.at("core_seconds").get<double>();
  for (const json& c : with.at("covered")) sum.held_with += c.get<bool>(), ++sum.intervals_with;
  for (const json& c : without.at("covered"))
    sum.held_without += c.get<bool>(), ++sum.intervals_without;
  const json &a = with.at("errors"), &b = without.at("errors");
  for (std::size_t k = 0; with.at("parameters") == without.at("parameters") && k < a.size(); ++k) {
    constexpr double kLeast = 1e-3;  // errors below a tenth of a percent count as equal
    sum.log_errors +=
        std::log(std::max(kLeast, b[k].get<double>()) / std::max(kLeast, a[k].get<double>()));
    ++sum.errors;
  }
}

void print_line(const std::string& name, const std::string& row, const RowSum& e) {
  if (e.right.runs() == 0) return;
  fmt::print("{:20s} {:21s} {:4d} {:4d} {:4d}  {}  {}  {:>5s} {:>9s} {:>9s} {:>5s}\n", name, row,
             e.right.runs(), e.acted, e.changed, e.right.text(), e.exact.text(),
             e.errors == 0 ? "" : fmt::format("{:.2f}", std::exp(e.log_errors / e.errors)),
             e.acted == 0 ? "" : fmt::format("{}/{}", e.held_with, e.intervals_with),
             e.acted == 0 ? "" : fmt::format("{}/{}", e.held_without, e.intervals_without),
             e.acted == 0 ? "" : fmt::format("{:.2f}", e.core_without / e.core_with));
}

void print_table(const std::map<std::string, json>& runs) {
  std::map<std::string, std::vector<const json*>> rows;
  for (const auto& [key, r] : runs) {
    if (r.at("without") != "" || r.at("left_out") != "") continue;
    const std::string only = r.at("only");
    rows[r.at("row").get<std::string>() + (only.empty() ? "" : " " + only)].push_back(&r);
  }
  fmt::print(
      "acts: runs in which it decides something; diff: of these, with another answer without it\n"
      "right: as the blind test counts; exact: the truth and nothing else; + right only with it, - "
      "only without it,\ndifference in percent with 95 % limits; all four: none, clear, small, "
      "pairs\n"
      "in runs in which it acts: error of parameters without / with, intervals that hold the "
      "truth, "
      "core time without / with\n\n");
  fmt::print("{:20s} {:21s} {:>4s} {:>4s} {:>4s}  {:26s}  {:26s}  {:>5s} {:>9s} {:>9s} {:>5s}\n",
             "without", "row", "runs", "acts", "diff", "right", "exact", "error", "with", "without",
             "time");
  std::vector<std::string> names;
  for (const Named& m : kMechanisms) names.emplace_back(m.name);
  for (const auto& [key, r] : runs) {  // a file may hold mechanisms that were deleted since
    const std::string name = r.at("without");
    if (!name.empty() && !contains(names, name)) names.push_back(name);
  }
  for (const std::string& name : names) {
    RowSum pooled;
    for (const auto& [row, all] : rows) {
      RowSum sum;
      for (const json* with : all) {
        BlindCase c;
        c.row = with->at("row");
        c.only = with->at("only");
        c.seed = with->at("seed");
        const auto without = runs.find(key_of(c, name));
        const bool acts =
            name == kTogether ? without != runs.end() : contains(with->at("acted"), name);
        if (acts && without == runs.end()) continue;  // not run
        const json& other = acts ? without->second : *with;
        compare(*with, other, sum);
        if (c.only.empty() && c.row != "outside") compare(*with, other, pooled);
      }
      if (sum.acted > 0) print_line(name, row, sum);
    }
    print_line(name, "all four", pooled);
  }
}

int run(int argc, char** argv) {
  bench::ProgramOptions app("Ablation study of the diagnosis");
  Options options;
  app.add("--runs", options.runs, "runs of each row; even seeds have a reference log");
  app.add("--seed", options.seed, "first seed");
  app.add("--rows", options.rows, "none, clear, small, pairs, outside");
  app.add("--only", options.how.only, "id of the only effect to hide");
  app.add("--without", options.without, "mechanisms to switch off; empty = all that acted");
  app.add("--together", options.together,
          "mechanisms to switch off at once, where one of them acted");
  app.add("--json", options.json, "file with one run a line; runs that it has are not repeated")
      .required();
  if (const auto code = app.parse(argc, argv)) return *code;
  std::signal(SIGINT, [](int) { stopped = 1; });
  std::signal(SIGTERM, [](int) { stopped = 1; });
  Study study(options);
  study.run_all();
  print_table(study.runs());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return sparflow::bench::run_program("ablation", run, argc, argv);
}
