/// The blind test of diagnosis: logs with a hidden effect from simulator/hidden_effects (which shares no law with the
/// catalogue), one line a run, then the table of shares with their 95 % limits.
///   build/bench/blind_test --runs 40 --seed 1000 [--rows none,clear,small,outside,pairs,fault] [--way both] [--json F]
/// --ways ours,bic,gp,correlation also judges the simple ways (bench/simple_ways.h), on the same logs.
/// Thresholds were chosen on seeds below 1000 only.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "bench/share.h"
#include "bench/simple_ways.h"
#include "identification/diagnose.h"
#include "identification/fit.h"
#include "models/error.h"
#include "models/machine_file.h"
#include "problems/bundled.h"
#include "simulator/hidden_effects/hidden_effect.h"
#include "simulator/hidden_effects/random_machine.h"

namespace {

using namespace sparflow;
using namespace sparflow::simulator;

struct Options {
  int runs = 20;
  std::uint64_t seed = 1000;
  double seconds = 300.0, noise = 1.0;
  std::vector<std::string> rows = {"none", "clear", "small", "outside", "pairs", "fault"};
  std::vector<std::string> ways = {"ours"};
  std::string way = "both", only, json;
  bool verbose = false;
};

struct Run {
  std::string row, machine, truth, answer, verdict;
  bool reference = false, top = false, in_set = false, all_found = false, exact = false;
  double set_size = 1.0, seconds = 0.0, rows = 0.0;
  std::vector<double> errors;  // relative, of parameters
  std::vector<bool> covered;   // truth inside the 95 % interval
  std::string judge = "ours";  // which way gave the answer
  std::vector<sparflow::bench::Swallowed> swallowed;
};

Machine draw_machine(std::uint64_t seed) {
  std::vector<Machine> drawings;
  for (const char* file :
       {"loader_crane", "loader_crane", "hmf_2020_k4", "swing_crane_two_pumps", "excavator"}) {
    drawings.push_back(load_machine(bundled_file(fmt::format("machines/{}.yaml", file))));
    drawings.back().pumps.front().type = PumpType::kLoadSensing;
  }
  return random_machine(drawings, seed);
}

std::string key_of(const std::string& id, const std::string& at) {
  return at.empty() ? id : id + ":" + at;
}

/// Ids that can be hidden on this machine; what only a reference can show is left out without one.
std::vector<std::string> ids_for(const Machine& machine, bool outside, const std::string& only) {
  std::vector<std::string> ids;
  for (const std::string& id : outside ? outside_ids() : catalogue_ids()) {
    if (id == "sensor_fault" || places_of(id, machine).empty()) continue;
    if (!only.empty() && id != only) continue;
    ids.push_back(id);
  }
  return ids;
}

/// A simple way's answer in the form of a diagnosis.
Diagnosis simple_diagnosis(const std::string& judge, const CraneModel& model,
                           const std::vector<Log>& logs, const std::vector<Log>& references) {
  const sparflow::bench::RawEvidence evidence(model, logs, references);
  const sparflow::bench::SimpleAnswer answer =
      judge == "bic" ? evidence.iid_bic() : evidence.strongest_correlation();
  Diagnosis d;
  d.verdict = answer.found.empty() ? Verdict::kNone : Verdict::kMissing;
  for (std::size_t k = 0; k < answer.found.size(); ++k) {
    const EffectAt& e = answer.found[k];
    const std::string key = effect_key(e.effect->info(), model.machine, e.at);
    DiagnosedEffect one;
    one.effect = e;
    one.id = e.effect->info().id;
    one.at = key.size() > one.id.size() ? key.substr(one.id.size() + 1) : "";
    one.applied = {e.effect, e.at, answer.values[k], {}, {}};
    d.effects.push_back(one);
  }
  return d;
}

Run one_run(const std::string& row, bool reference, std::uint64_t seed, const std::string& judge,
            const Options& options) {
  std::mt19937_64 random(seed * 7919 + std::hash<std::string>()(row) % 1000);
  Run run;
  run.row = row;
  run.reference = reference;
  run.judge = judge;
  CaseRequest request;
  request.log.seconds = options.seconds;
  request.log.noise_factor = options.noise;
  request.log.crane_seed = request.log.motion_seed = seed;
  const double size = row == "small" ? 1.0 / 3.0 : 1.0;
  for (std::uint64_t attempt = 0;; ++attempt) {
    request.log.machine = draw_machine(seed + 100000 * attempt);
    if (row == "none") break;
    if (row == "fault") {
      request.log.effects = {{"sensor_fault", "", 1.0, -1}};
      break;
    }
    const std::vector<std::string> ids =
        ids_for(request.log.machine, row == "outside", options.only);
    if (ids.empty() && attempt < 20) continue;
    if (ids.empty()) throw UsageError("no machine can have " + options.only);
    request.log.effects = {{ids[random() % ids.size()], "", size, -1}};
    if (row == "pairs") {
      for (std::string second; second.empty();) {
        second = ids[random() % ids.size()];
        if (second == request.log.effects[0].id) second.clear();
        if (!second.empty()) request.log.effects.push_back({second, "", size, -1});
      }
    }
    break;
  }
  run.machine = request.log.machine.name;
  const GeneratedCase logs = generate_case(request);
  const Machine& machine = request.log.machine;
  const std::vector<Log> train = {log_from_text("train.csv", csv_text(logs.train), machine)};
  std::vector<Log> references;
  if (reference)
    references.push_back(log_from_text("reference.csv", csv_text(logs.reference), machine));
  run.rows = static_cast<double>(logs.train.rows());

  FitOptions fit_options;
  fit_options.hold_out_every = 0;
  const FitResult fitted = fit(machine, reference ? references : train, {}, fit_options);
  const auto start = std::chrono::steady_clock::now();
  Diagnosis d;
  if (judge == "ours") {
    d = diagnose(fitted.model, train, references);
  } else if (judge == "gp") {
    run.swallowed = sparflow::bench::swallowed_by_refit(fitted.model, references, train);
    for (const auto& s : run.swallowed)
      run.answer += fmt::format("{} error {:+.0f} % ", s.stage, -100.0 * s.share);
  } else {
    d = simple_diagnosis(judge, fitted.model, train, references);
  }
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  run.verdict = verdict_name(d.verdict);

  std::set<std::string> truth, answer;
  for (const HiddenTruth& t : logs.train.truth) truth.insert(key_of(t.id, t.at));
  if (d.verdict == Verdict::kMissing) {
    for (const DiagnosedEffect& e : d.effects) answer.insert(e.key());
  }
  run.truth = fmt::format("{}", fmt::join(truth, " + "));
  for (const HiddenTruth& t : logs.train.truth) run.truth += fmt::format(" [{}]", t.law_name);
  run.answer += fmt::format("{}", fmt::join(answer, " + "));
  if (d.verdict == Verdict::kUnknown && d.unexplained)
    run.answer += "unknown: " + d.unexplained->sentence;
  if (d.verdict == Verdict::kBadData) run.answer += bad_channel_sentence(d.bad.front());
  if (d.leftover_share > 0.0) run.answer += fmt::format(" (left {:.2f})", d.leftover_share);
  for (const DiagnosedEffect& e : d.effects) {
    for (const auto& [rival, worse] : e.rivals) run.answer += fmt::format(" ~{}", rival);
  }
  run.exact = answer == truth;
  run.all_found = std::includes(answer.begin(), answer.end(), truth.begin(), truth.end());
  // valve_lag may be asked for a cylinder or for all: the place then does not count
  if (d.verdict == Verdict::kMissing && !truth.empty()) {
    run.top = truth.count(d.effects.front().key()) > 0;
    run.set_size = 0.0;
    for (const DiagnosedEffect& e : d.effects) {
      run.set_size += 1.0 + static_cast<double>(e.rivals.size());
      run.in_set = run.in_set || truth.count(e.key()) > 0;
      for (const auto& [rival, worse] : e.rivals) run.in_set = run.in_set || truth.count(rival) > 0;
    }
    run.set_size /= static_cast<double>(truth.size());
    for (const HiddenTruth& t : logs.train.truth) {
      for (const DiagnosedEffect& e : d.effects) {
        if (e.key() != key_of(t.id, t.at)) continue;
        const EffectInfo& info = e.effect.effect->info();
        for (std::size_t k = 0; k < info.parameters.size(); ++k) {
          for (const HiddenParameter& p : t.parameters) {
            if (p.name != info.parameters[k].name || p.equivalent == 0.0) continue;
            run.errors.push_back(std::abs(e.applied.values[k] / p.equivalent - 1.0));
            if (e.applied.lower95.empty()) continue;
            run.covered.push_back(p.equivalent >= e.applied.lower95[k] &&
                                  p.equivalent <= e.applied.upper95[k]);
            run.truth +=
                fmt::format(" {} {:.4g} ({:.4g}..{:.4g}) for {:.4g}", p.name, e.applied.values[k],
                            e.applied.lower95[k], e.applied.upper95[k], p.equivalent);
          }
        }
      }
    }
  }
  if (options.verbose) {
    fmt::print("\n{}", d.table());
    for (const HiddenTruth& t : logs.train.truth) {
      for (const HiddenParameter& p : t.parameters) {
        fmt::print("   truth {} {} = {:.5g} {} (equivalent {:.5g})\n", t.id, p.name, p.value,
                   p.unit, p.equivalent);
      }
    }
  }
  return run;
}

bool good(const Run& r) {
  if (r.row == "none") return r.verdict == "none";
  if (r.row == "outside") return r.verdict == "unknown";
  if (r.row == "fault") return r.verdict == "bad_data";
  if (r.row == "pairs") return r.exact;
  return r.top;
}

double median_of(std::vector<double> v) {
  if (v.empty()) return 0.0;
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}

/// What learning again swallows of the error, by stage.
void print_swallowed(const std::vector<Run>& runs, nlohmann::json& json) {
  std::map<std::string, std::vector<double>> shares;
  for (const Run& r : runs) {
    for (const auto& s : r.swallowed) shares[s.stage].push_back(s.share);
  }
  fmt::print(
      "\nlearning again instead of a cause: share of the added error that is gone, median\n");
  for (const auto& [stage, all] : shares) {
    fmt::print("{:52s} {:5.1f} %  ({} runs)\n", "  " + stage, 100.0 * median_of(all), all.size());
    json["swallowed"].push_back(
        {{"stage", stage}, {"median", median_of(all)}, {"runs", all.size()}});
  }
}

void print_table(const std::vector<Run>& runs, nlohmann::json& json) {
  const std::string judge = runs.empty() ? "ours" : runs.front().judge;
  if (judge == "gp") return print_swallowed(runs, json);
  const auto share = [&](const std::string& text, const char* least, const auto& pick,
                         const auto& hit) {
    int n = 0, k = 0;
    for (const Run& r : runs) {
      if (!pick(r)) continue;
      ++n;
      k += hit(r) ? 1 : 0;
    }
    if (n == 0) return;
    const auto [lo, hi] = sparflow::bench::share_limits(k, n);
    fmt::print("{:52s} {:5.1f} %  ({:.0f} .. {:.0f} %, {} of {})   asked {}\n", text, 100.0 * k / n,
               100.0 * lo, 100.0 * hi, k, n, least);
    json["table"].push_back({{"by", judge},
                             {"measure", text},
                             {"share", 1.0 * k / n},
                             {"limits95", {lo, hi}},
                             {"hits", k},
                             {"runs", n}});
  };
  const auto is = [](const char* row) { return [row](const Run& r) { return r.row == row; }; };
  const auto single = [](const Run& r) { return r.row == "clear" || r.row == "small"; };
  fmt::print("\n{}", judge == "ours" ? "" : "judged by " + judge + "\n");
  share("false alarm, nothing missing", "<= 5 %", is("none"),
        [](const Run& r) { return r.verdict != "none"; });
  share("top-1 id and place, clear effect", ">= 97 %", is("clear"), good);
  share("top-1, small effect (one third)", ">= 90 %", is("small"), good);
  share("true effect in the reported set", ">= 98 %", single,
        [](const Run& r) { return r.in_set; });
  share("outside the catalogue -> unknown", ">= 90 %", is("outside"), good);
  share("pairs: both found and nothing else", ">= 85 %", is("pairs"), good);
  share("broken sensor -> bad data", "", is("fault"), good);
  std::vector<double> errors, sizes, seconds;
  int covered = 0, intervals = 0;
  for (const Run& r : runs) {
    if (single(r) && r.top) errors.insert(errors.end(), r.errors.begin(), r.errors.end());
    if (single(r) && r.verdict == "missing") sizes.push_back(r.set_size);
    seconds.push_back(r.seconds * 15000.0 / std::max(1.0, r.rows));
    for (const bool c : r.covered) {
      covered += c ? 1 : 0;
      ++intervals;
    }
  }
  double mean_size = 0.0;
  for (const double s : sizes) mean_size += s / static_cast<double>(sizes.size());
  if (!sizes.empty())
    fmt::print("{:52s} {:5.2f}                              asked <= 2\n",
               "mean size of the reported set", mean_size);
  if (!errors.empty()) {
    fmt::print("{:52s} {:5.1f} %  ({} parameters)              asked <= 10 %\n",
               "parameter error, median", 100.0 * median_of(errors), errors.size());
  }
  if (intervals > 0) {
    const auto [lo, hi] = sparflow::bench::share_limits(covered, intervals);
    fmt::print("{:52s} {:5.1f} %  ({:.0f} .. {:.0f} %)          asked 90 .. 98 %\n",
               "95 % intervals that hold the truth", 100.0 * covered / intervals, 100.0 * lo,
               100.0 * hi);
  }
  fmt::print("{:52s} {:5.2f} s                            asked <= 60 s\n",
             "diagnosis of 15 000 rows, median", median_of(seconds));
}

int run(int argc, char** argv) {
  CLI::App app{"Blind test of diagnosis on simulated logs with a hidden effect"};
  Options options;
  app.add_option("--runs", options.runs, "of each row and way");
  app.add_option("--seed", options.seed, "first seed");
  app.add_option("--seconds", options.seconds, "length of a log [s]");
  app.add_option("--noise", options.noise, "sensor noise, 1 = 0.8 bar");
  app.add_option("--rows", options.rows, "none, clear, small, outside, pairs, fault")
      ->delimiter(',');
  app.add_option("--way", options.way, "reference, alone or both");
  app.add_option("--ways", options.ways,
                 "who judges: ours, and for comparison bic, gp, correlation (docs/diagnose.md)")
      ->delimiter(',')
      ->check(CLI::IsMember({"ours", "bic", "gp", "correlation"}));
  app.add_option("--only", options.only, "this effect alone");
  app.add_option("--json", options.json, "all runs as JSON");
  app.add_flag("-v,--verbose", options.verbose, "the whole diagnosis of each run");
  CLI11_PARSE(app, argc, argv);
  std::map<std::string, std::vector<Run>> runs;
  nlohmann::json json;
  for (const std::string& row : options.rows) {
    for (const bool reference : {true, false}) {
      if ((options.way == "reference" && !reference) || (options.way == "alone" && reference))
        continue;
      for (int i = 0; i < options.runs; ++i) {
        const std::uint64_t seed =
            options.seed + static_cast<std::uint64_t>(2 * i + (reference ? 0 : 1));
        for (const std::string& judge : options.ways) {
          if (judge == "gp" && !reference) continue;  // no model before the effect to compare with
          const char* way = reference ? "reference" : "alone";
          try {
            runs[judge].push_back(one_run(row, reference, seed, judge, options));
          } catch (const InputError& error) {
            fmt::print("{:8s} {:9s} {:5d} left out: {}\n", row, way, seed, error.what());
            continue;
          }
          const Run& r = runs[judge].back();
          fmt::print("{} {:8s} {:9s} {:5d} {:24s} {:60s} -> {}{}{}\n",
                     good(r) || judge == "gp" ? "  " : "X ", row, way, seed, r.machine, r.truth,
                     judge == "ours" ? "" : judge + ": ",
                     r.verdict == "missing" ? "" : r.verdict + " ", r.answer);
          std::fflush(stdout);
          json["runs"].push_back({{"row", row},
                                  {"by", judge},
                                  {"reference", reference},
                                  {"seed", seed},
                                  {"machine", r.machine},
                                  {"truth", r.truth},
                                  {"answer", r.answer},
                                  {"verdict", r.verdict},
                                  {"good", good(r)},
                                  {"seconds", r.seconds},
                                  {"errors", r.errors}});
        }
      }
    }
  }
  for (const std::string& judge : options.ways) print_table(runs[judge], json);
  if (!options.json.empty()) write_file_atomically(options.json, json.dump(1) + "\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const UsageError& error) {
    fmt::print(stderr, "blind_test: {}\n", error.what());
    return 2;
  } catch (const InputError& error) {
    fmt::print(stderr, "blind_test: {}\n", error.what());
    return 3;
  }
}
