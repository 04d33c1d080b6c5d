#include "studies/blind_case.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <set>

#include "diagnosis/extension/extend.h"
#include "diagnosis/selection/effect_intervals.h"
#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "optimizer/solve/child_processes.h"
#include "problems/bundled.h"
#include "simulator/hidden_effects/hidden_effect.h"
#include "simulator/hidden_effects/random_machine.h"
#include "simulator/hidden_effects/visibility.h"
#include "studies/stable_hash.h"

namespace sparflow::bench {

/// A case as a user has it: logs that are read from text, and a fitted model.
struct PreparedCase::Crane {
  std::vector<simulator::HiddenTruth> truth;
  std::string shown;  // visibility of the effects, for the details
  std::vector<Log> train, references, tests;
  CraneModel model;
  double rows = 0.0;
};

namespace {

using Crane = PreparedCase::Crane;
using simulator::CaseRequest;
using simulator::GeneratedCase;
using simulator::HiddenEffect;
using simulator::HiddenParameter;
using simulator::HiddenTruth;
/// [-] Fitting again changes errors by some tenths of a percent.
constexpr double kRefitMoves = 1.005;
/// [-] An increase by less than this many standard errors between motions counts as chance.
constexpr double kStandardErrors = 2.0;
/// An effect that a log cannot show is hidden in another crane. After kCranesForIds cranes other effects are drawn;
/// after kMostCranes the last case is kept.
constexpr std::uint64_t kCranesForIds = 8, kMostCranes = 40;
constexpr double kNotJudged = std::numeric_limits<double>::quiet_NaN();

Machine draw_machine(std::uint64_t seed) {
  std::vector<Machine> drawings;
  for (const char* file :
       {"loader_crane", "loader_crane", "hmf_2020_k4", "swing_crane_two_pumps", "excavator"}) {
    drawings.push_back(load_machine(bundled_file(fmt::format("machines/{}.yaml", file))));
    drawings.back().pumps.front().type = PumpType::kLoadSensing;
  }
  return simulator::random_machine(drawings, seed);
}

std::string key_of(const std::string& id, const std::string& at) {
  return at.empty() ? id : id + ":" + at;
}

/// Ids of the effects that can be hidden in this machine.
std::vector<std::string> ids_for(const Machine& machine, bool outside, const std::string& only) {
  std::vector<std::string> ids;
  for (const std::string& id : outside ? simulator::outside_ids() : simulator::catalogue_ids()) {
    if (id == "sensor_fault" || simulator::places_of(id, machine).empty()) continue;
    if (!only.empty() && id != only) continue;
    ids.push_back(id);
  }
  return ids;
}

/// Draws machine, effects and motions of a case. @param shown set to one line for each effect with its visibility
CaseRequest draw_case(const BlindCase& asked, std::string& shown) {
  std::mt19937_64 random(asked.seed * 7919 + stable_hash(asked.row) % 1000);
  CaseRequest request;
  request.log.seconds = asked.seconds;
  request.log.noise_factor = asked.noise;
  request.log.crane_seed = request.log.motion_seed = asked.seed;
  request.log.channels.pressure_b = asked.leave_out != "rod";
  request.log.channels.payload = asked.leave_out != "payload";
  request.log.channels.commands = asked.leave_out != "commands";
  request.log.channels.oil = asked.leave_out != "oil";
  request.log.channels.pumps = asked.leave_out != "pump";
  const double size = asked.row == "small" ? 1.0 / 3.0 : 1.0;
  std::vector<HiddenEffect> wanted;  // kept for the next crane when a log cannot show them
  for (std::uint64_t attempt = 0;; ++attempt) {
    request.log.machine = draw_machine(asked.seed + 100000 * attempt);
    request.log.crane_seed = asked.seed + 100000 * attempt;
    if (asked.row == "none") return request;
    if (asked.row == "fault") {
      request.log.effects = {{"sensor_fault", "", 1.0, -1}};
      return request;
    }
    const std::vector<std::string> ids =
        ids_for(request.log.machine, asked.row == "outside", asked.only);
    if (ids.empty() && attempt < kMostCranes) continue;
    if (ids.empty()) throw UsageError("no machine has a place for " + asked.only);
    const bool anew = attempt % kCranesForIds == 0;
    if (anew || wanted.empty()) {
      wanted = {{ids[random() % ids.size()], "", size, -1}};
      while (asked.row == "pairs" && wanted.size() < 2) {
        const std::string second = ids[random() % ids.size()];
        if (second != wanted[0].id) wanted.push_back({second, "", size, -1});
      }
    }
    const bool possible = std::all_of(wanted.begin(), wanted.end(), [&](const HiddenEffect& e) {
      return std::find(ids.begin(), ids.end(), e.id) != ids.end();
    });
    if (!possible) continue;
    request.log.effects = wanted;
    const simulator::CaseLogs logs = simulator::case_logs(request);
    const std::vector<simulator::Visibility> seen =
        simulator::visibility(logs.train, true, asked.reference ? &logs.reference : nullptr);
    shown.clear();
    for (std::size_t k = 0; k < seen.size(); ++k) {
      shown += fmt::format(
          "   {} shows most in the {}: {:.2g} times the noise for {:.3g} s, {:.0f} % absorbed\n",
          wanted[k].id, seen[k].channel, seen[k].size, seen[k].seconds, 100.0 * seen[k].absorbed);
    }
    if (attempt >= kMostCranes || std::all_of(seen.begin(), seen.end(), simulator::visible))
      return request;
  }
}

Crane prepare(const BlindCase& asked) {
  std::string shown;
  const CaseRequest request = draw_case(asked, shown);
  const GeneratedCase logs = simulator::generate_case(request);
  if (!asked.folder.empty()) {
    simulator::write_case(request, logs,
                          fmt::format("{}/{}_{}", asked.folder, asked.row, asked.seed));
  }
  const Machine& machine = request.log.machine;
  Crane crane;
  crane.shown = std::move(shown);
  crane.truth = logs.train.truth;
  crane.train = {log_from_text("train.csv", csv_text(logs.train), machine)};
  crane.tests = {log_from_text("test.csv", csv_text(logs.test), machine)};
  if (asked.reference)
    crane.references = {log_from_text("reference.csv", csv_text(logs.reference), machine)};
  crane.rows = static_cast<double>(logs.train.rows());
  FitOptions options;
  options.hold_out_every = 0;
  crane.model = fit(machine, asked.reference ? crane.references : crane.train, {}, options).model;
  return crane;
}

DiagnosedEffect named_effect(const EffectAt& e, const Machine& machine) {
  DiagnosedEffect one;
  one.effect = e;
  one.id = e.effect->info().id;
  const std::string key = effect_key(e.effect->info(), machine, e.at);
  one.at = key.size() > one.id.size() ? key.substr(one.id.size() + 1) : "";
  return one;
}

std::vector<EffectAt> true_effects(const Crane& crane) {
  std::vector<EffectAt> out;
  for (const EffectAt& e : candidates(crane.model.machine)) {
    const std::string key = effect_key(e.effect->info(), crane.model.machine, e.at);
    for (const HiddenTruth& t : crane.truth) {
      if (key_of(t.id, t.at) == key) out.push_back(e);
    }
  }
  return out;
}

/// Diagnosis that names the true effects, to test extend() alone.
Diagnosis diagnosis_of_the_truth(const Crane& crane) {
  Diagnosis d;
  for (const EffectAt& e : true_effects(crane))
    d.effects.push_back(named_effect(e, crane.model.machine));
  d.verdict = d.effects.empty() ? Verdict::kNone : Verdict::kMissing;
  return d;
}

/// The answer of a baseline method in the form of a diagnosis.
Diagnosis baseline_diagnosis(const std::string& judge, const Crane& crane) {
  const RawEvidence evidence(crane.model, crane.train, crane.references);
  const SimpleAnswer answer =
      judge == "bic" ? evidence.iid_bic() : evidence.strongest_correlation();
  Diagnosis d;
  d.verdict = answer.found.empty() ? Verdict::kNone : Verdict::kMissing;
  for (std::size_t k = 0; k < answer.found.size(); ++k) {
    const EffectAt& e = answer.found[k];
    DiagnosedEffect one = named_effect(e, crane.model.machine);
    one.applied = {e.effect, e.at, answer.values[k], {}, {}};
    d.effects.push_back(one);
  }
  return d;
}

/// Compares the parameters of named effects with the text-book equivalents of the hidden law.
void judge_parameters(const Diagnosis& d, const std::vector<HiddenTruth>& truth, BlindRun& run) {
  for (const HiddenTruth& t : truth) {
    for (const DiagnosedEffect& e : d.effects) {
      if (e.key() != key_of(t.id, t.at)) continue;
      const EffectInfo& info = e.effect.effect->info();
      for (std::size_t k = 0; k < info.parameters.size(); ++k) {
        for (const HiddenParameter& p : t.parameters) {
          if (p.name != info.parameters[k].name || p.equivalent == 0.0) continue;
          if (e.applied.values.empty() || !value_is_determined(e.applied, k)) continue;
          run.errors.push_back(std::abs(e.applied.values[k] / p.equivalent - 1.0));
          if (e.applied.lower95.empty()) continue;
          run.covered.push_back(p.equivalent >= e.applied.lower95[k] &&
                                p.equivalent <= e.applied.upper95[k]);
          run.parameters.push_back(t.id + "." + p.name);
          run.truth +=
              fmt::format(" {} {:.4g} ({:.4g}..{:.4g}) for {:.4g}", p.name, e.applied.values[k],
                          e.applied.lower95[k], e.applied.upper95[k], p.equivalent);
        }
      }
    }
  }
}

void judge_answer(const Diagnosis& d, const std::vector<HiddenTruth>& hidden, BlindRun& run) {
  std::set<std::string> truth, answer;
  for (const HiddenTruth& t : hidden) truth.insert(key_of(t.id, t.at));
  if (d.verdict == Verdict::kMissing) {
    for (const DiagnosedEffect& e : d.effects) answer.insert(e.key());
  }
  run.verdict = verdict_name(d.verdict);
  run.truth = fmt::format("{}", fmt::join(truth, " + "));
  for (const HiddenTruth& t : hidden) run.truth += fmt::format(" [{}]", t.law_name);
  run.answer += fmt::format("{}", fmt::join(answer, " + "));
  if (d.verdict == Verdict::kUnknown && d.unexplained)
    run.answer += "unknown: " + d.unexplained->sentence;
  for (const BadChannel& b : d.set_aside) {
    run.answer += " set aside: " + bad_channel_sentence(b);
    for (const HiddenTruth& t : hidden) run.broken_found = run.broken_found || t.at == b.channel;
  }
  if (d.unmodelled_share > 0.0) run.answer += fmt::format(" (left {:.2f})", d.unmodelled_share);
  for (const DiagnosedEffect& e : d.effects) {
    for (const auto& [rival, worse] : e.rivals) run.answer += fmt::format(" ~{}", rival);
  }
  for (const FoundEffect& f : d.search.found) {
    const EffectAt& e = f.design.effect;
    run.named.push_back({effect_key(e.effect->info(), *d.evidence.series[0].machine, e.at), f.size,
                         f.over_form, f.gain});
  }
  run.said = said_effects(d, [&](const std::string& key) { return truth.count(key) > 0; });
  run.exact = answer == truth;
  run.all_found = std::includes(answer.begin(), answer.end(), truth.begin(), truth.end());
  if (d.verdict != Verdict::kMissing || truth.empty()) return;
  run.top = truth.count(d.effects.front().key()) > 0;
  run.set_size = 0.0;
  for (const DiagnosedEffect& e : d.effects) {
    run.set_size += 1.0 + static_cast<double>(e.rivals.size());
    run.in_set = run.in_set || truth.count(e.key()) > 0;
    for (const auto& [rival, worse] : e.rivals) run.in_set = run.in_set || truth.count(rival) > 0;
  }
  run.set_size /= static_cast<double>(truth.size());
  judge_parameters(d, hidden, run);
}

double energy_error(const CompareResult& result) {
  double wrong = 0.0, measured = 0.0;
  for (const EnergyScore& e : result.energy) {
    if (!(e.measured > 0.0)) continue;
    wrong += std::abs(e.predicted - e.measured);
    measured += e.measured;
  }
  return measured > 0.0 ? wrong / measured : kNotJudged;
}

/// Lists the errors on the test log that changed, largest change first; of pressures also the share outside the data.
std::string changed_errors(const CompareResult& before, const CompareResult& after) {
  std::vector<std::pair<double, std::string>> lines;
  for (const StageScore& b : before.scores) {
    const StageScore* a = after.find(b.stage, b.at, b.regime);
    if (a == nullptr || !(b.rmse > 0.0) || !(a->rmse > 0.0)) continue;
    const double moved = static_cast<double>(b.n) * std::log(a->rmse / b.rmse);
    std::string line = fmt::format("   {} {} {}: {:.3g} -> {:.3g} {} (bias {:.2g} -> {:.2g})",
                                   b.stage, b.at, b.regime, b.rmse / b.unit.si, a->rmse / b.unit.si,
                                   b.unit.name, b.bias / b.unit.si, a->bias / b.unit.si);
    if (b.stage == "pressure")
      line += fmt::format(", {:.0f} -> {:.0f} % outside with {:.0f} -> {:.0f} % of the error",
                          b.extrapolated_percent, a->extrapolated_percent,
                          b.extrapolated_error_percent, a->extrapolated_error_percent);
    lines.emplace_back(-std::abs(moved), line + fmt::format(", {} samples\n", b.n));
  }
  std::sort(lines.begin(), lines.end());
  std::string out;
  for (const auto& [moved, line] : lines) out += line;
  return out;
}

std::vector<std::string> stages_of(const std::vector<ExtendStep>& steps) {
  std::vector<std::string> out;
  out.reserve(steps.size());
  for (const ExtendStep& step : steps) out.push_back(step.stage);
  return out;
}

/// Extends the model by the named effects, and by the true ones, and judges both on the test log.
void judge_extended(const Diagnosis& d, const Crane& crane, BlindRun& run) {
  std::vector<EffectAt> named;
  if (d.verdict == Verdict::kMissing) {
    for (const DiagnosedEffect& e : d.effects) named.push_back(e.effect);
  }
  ExtendOptions options;
  options.fit.hold_out_every = 0;
  const auto learned = [&](const std::vector<EffectAt>& effects) -> std::optional<ExtendResult> {
    if (effects.empty()) return {};
    try {
      return extend(crane.model, effects, {crane.train, crane.references, crane.tests}, options);
    } catch (const InputError&) {  // The logs do not show the effect.
      return {};
    }
  };
  const std::optional<ExtendResult> ours = learned(named);
  const std::vector<EffectAt> truth = true_effects(crane);
  if (ours) {
    const CompareResult &before = ours->steps.front().before, &after = ours->steps.back().after;
    run.changed = true;
    const ErrorChange change =
        error_change(crane.model.machine, before, after, stages_of(ours->steps));
    const bool all_grew = change.overall > kRefitMoves &&
                          std::log(change.overall) > kStandardErrors * change.overall_deviation;
    run.made_worse = all_grew || !change.harmed.empty();
    if (run.made_worse) run.worse_by = fmt::format("overall {:.3f}", change.overall);
    for (const HarmedError& h : change.harmed) run.worse_by += "; " + h.sentence;
    run.energy_before = energy_error(before);
    run.energy_after = energy_error(after);
    run.details += changed_errors(before, after);
  }
  if (truth.empty()) return;
  if (run.exact) {
    run.rms_ratio = ours ? 1.0 : kNotJudged;
    return;
  }
  const std::optional<ExtendResult> best = learned(truth);
  if (!best) return;
  const CompareResult& known = best->steps.back().after;
  run.rms_ratio = error_change(crane.model.machine, known,
                               ours ? ours->steps.back().after : best->steps.front().before,
                               best->steps.front().stage)
                      .overall;
  if (!ours) run.energy_before = run.energy_after = energy_error(best->steps.front().before);
}

}  // namespace

bool BlindRun::good() const {
  if (asked.row == "none") return verdict == "none";
  if (asked.row == "outside") return verdict == "unknown";
  if (asked.row == "fault") return broken_found && verdict != "missing" && verdict != "unknown";
  if (asked.row == "pairs") return exact;
  return top;
}

BlindRun run_blind(const BlindCase& asked) {
  BlindRun run;
  run.asked = asked;
  run.rms_ratio = run.energy_before = run.energy_after = kNotJudged;
  try {
    const Crane crane = prepare(asked);
    run.machine = crane.model.machine.name;
    run.rows = crane.rows;
    const auto start = std::chrono::steady_clock::now();
    Diagnosis d;
    if (asked.judge == "ours") {
      d = diagnose(crane.model, crane.train, crane.references);
    } else if (asked.judge == "gp") {
      run.absorbed = absorbed_by_refit(crane.model, crane.references, crane.train);
      for (const auto& s : run.absorbed)
        run.answer += fmt::format("{} error {:+.0f} % ", s.stage, -100.0 * s.share);
    } else if (asked.judge == "truth") {
      d = diagnosis_of_the_truth(crane);
    } else {
      d = baseline_diagnosis(asked.judge, crane);
    }
    run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    judge_answer(d, crane.truth, run);
    if (asked.judge == "ours") run.details = d.table() + crane.shown;
    if ((asked.judge == "ours" || asked.judge == "truth") && asked.extend)
      judge_extended(d, crane, run);
    for (const HiddenTruth& t : crane.truth) {
      for (const HiddenParameter& p : t.parameters) {
        run.details += fmt::format("   truth {} {} = {:.5g} {} (equivalent {:.5g})\n", t.id, p.name,
                                   p.value, p.unit, p.equivalent);
      }
    }
  } catch (const InputError& error) {
    run.left_out = error.what();
  }
  return run;
}

PreparedCase::PreparedCase(const BlindCase& asked)
    : asked_(asked), crane_(std::make_unique<Crane>(prepare(asked))) {}
PreparedCase::~PreparedCase() = default;

BlindRun PreparedCase::diagnosed(const DiagnoseOptions& options) const {
  BlindRun run;
  run.asked = asked_;
  run.rms_ratio = run.energy_before = run.energy_after = kNotJudged;
  run.machine = crane_->model.machine.name;
  run.rows = crane_->rows;
  const auto start = std::chrono::steady_clock::now();
  const Diagnosis d = diagnose(crane_->model, crane_->train, crane_->references, options);
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  judge_answer(d, crane_->truth, run);
  return run;
}

Evidence PreparedCase::evidence(const DiagnoseOptions& options) const {
  const auto signals = [&](const std::vector<Log>& logs) {
    std::vector<MachineSignals> out;
    out.reserve(logs.size());
    for (const Log& log : logs)
      out.push_back(make_signals(crane_->model.machine, log, options.signals));
    return out;
  };
  return collect_evidence(crane_->model, signals(crane_->train), signals(crane_->references),
                          nullptr, options.evidence);
}

double time_of_diagnosis(std::uint64_t seed) {
  BlindCase asked;
  asked.row = "clear";
  asked.reference = true;
  asked.seed = seed;
  asked.extend = false;
  const BlindRun run = run_blind(asked);
  return run.seconds * 15000.0 / std::max(1.0, run.rows);
}

// A run as bytes. Its fields are bound by name, so that a field which is added and not packed does not compile.
namespace {

/// Calls `visit` with each field of a run but `asked`.
template <class Run, class Visit>
void each_field(Run& run, const Visit& visit) {
  auto& [asked, machine, truth, answer, verdict, left_out, details, top, in_set, broken_found,
         all_found, exact, set_size, seconds, rows, named, said, errors, covered, parameters,
         rms_ratio, energy_before, energy_after, changed, made_worse, worse_by, absorbed] = run;
  (void)asked;
  visit(machine, truth, answer, verdict, left_out, details, top, in_set, broken_found, all_found,
        exact, set_size, seconds, rows, named, said, errors, covered, parameters, rms_ratio,
        energy_before, energy_after, changed, made_worse, worse_by, absorbed);
}

void put(Packer& p, double v) { p.number(v); }
void put(Packer& p, bool v) { p.number(v ? 1.0 : 0.0); }
void put(Packer& p, const std::string& v) { p.text(v); }
void put(Packer& p, const NamedEffect& e) {
  p.text(e.key).number(e.size).number(e.over_form).number(e.gain);
}
void put(Packer& p, const SaidEffect& e) {
  p.text(e.key).number(e.probability).number(e.set_probability);
  p.number(e.right ? 1.0 : 0.0).number(e.set_right ? 1.0 : 0.0);
}
void put(Packer& p, const AbsorbedError& e) { p.text(e.stage).number(e.share); }
template <class Value>
void put(Packer& p, const std::vector<Value>& list) {
  p.number(static_cast<double>(list.size()));
  for (const Value& v : list) put(p, v);
}

void take(Unpacker& u, double& v) { v = u.number(); }
void take(Unpacker& u, bool& v) { v = u.number() != 0.0; }
void take(Unpacker& u, std::string& v) { v = u.text(); }
void take(Unpacker& u, NamedEffect& e) {
  e.key = u.text();
  e.size = u.number();
  e.over_form = u.number();
  e.gain = u.number();
}
void take(Unpacker& u, SaidEffect& e) {
  e.key = u.text();
  e.probability = u.number();
  e.set_probability = u.number();
  e.right = u.number() != 0.0;
  e.set_right = u.number() != 0.0;
}
void take(Unpacker& u, AbsorbedError& e) {
  e.stage = u.text();
  e.share = u.number();
}
template <class Value>
void take(Unpacker& u, std::vector<Value>& list) {
  const auto count = static_cast<std::size_t>(u.number());
  list.clear();
  for (std::size_t i = 0; i < count; ++i) {
    Value v{};
    take(u, v);
    list.push_back(std::move(v));
  }
}

}  // namespace

std::string pack_run(const BlindRun& run) {
  Packer p;
  each_field(run, [&p](const auto&... field) { (put(p, field), ...); });
  return p.bytes();
}

BlindRun unpack_run(const BlindCase& asked, const std::string& bytes) {
  BlindRun run;
  run.asked = asked;
  Unpacker u(bytes);
  each_field(run, [&u](auto&... field) { (take(u, field), ...); });
  return run;
}

}  // namespace sparflow::bench
