// Does `improve` find the same effects on copies of the same logs? Each copy is rounded, shifted in time, cut, resampled
// or given in another order; the models are compared on logs that took no part.
//   improve_copies -m MACHINE.yaml -l LOG.csv... [-t LEFT_OUT.csv...]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>

#include "bench/program_options.h"
#include "diagnosis/extension/extend.h"
#include "identification/learning/fit.h"
#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "optimizer/solve/child_processes.h"

namespace sparflow::bench {
namespace {

/// A CSV log with a header and a time in its first column.
struct Table {
  std::string name, header;
  std::vector<std::vector<double>> rows;

  std::string text() const {
    std::string out = header + "\n";
    for (const std::vector<double>& row : rows) {
      out += fmt::format("{:.9g}", fmt::join(row, ","));
      out += '\n';
    }
    return out;
  }
};

Table read_table(const std::string& path) {
  std::ifstream in(path);
  Table table;
  table.name = path.substr(path.find_last_of('/') + 1);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    if (table.header.empty()) {
      table.header = line;
      continue;
    }
    std::vector<double> row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');)
      row.push_back(cell.empty() ? std::nan("") : std::stod(cell));
    table.rows.push_back(std::move(row));
  }
  if (table.rows.empty()) throw InputError({path, 0, 0}, "log", "no rows; expected a CSV log");
  return table;
}

/// Strokes and angles to `x`, pressures in bar to `p`.
Table rounded(Table t, double x, double p) {
  std::istringstream names(t.header);
  std::size_t column = 0;
  for (std::string name; std::getline(names, name, ','); ++column) {
    const double step = name.rfind("x_", 0) == 0 || name.rfind("q_", 0) == 0 ? x
                        : name.rfind('p', 0) == 0 && name != "payload_kg"    ? p
                                                                             : 0.0;
    if (step == 0.0) continue;
    for (std::vector<double>& row : t.rows) row[column] = std::round(row[column] / step) * step;
  }
  return t;
}

/// Linear between rows, every `step` from `shift` on. [s]
Table resampled(const Table& t, double step, double shift) {
  Table out{t.name, t.header, {}};
  std::size_t k = 0;
  for (double at = t.rows.front()[0] + shift; at <= t.rows.back()[0]; at += step) {
    while (k + 2 < t.rows.size() && t.rows[k + 1][0] <= at) ++k;
    const std::vector<double>&a = t.rows[k], &b = t.rows[k + 1];
    const double w = (at - a[0]) / (b[0] - a[0]);
    std::vector<double> row(a.size());
    for (std::size_t c = 0; c < a.size(); ++c) row[c] = a[c] + w * (b[c] - a[c]);
    row[0] = at;
    out.rows.push_back(std::move(row));
  }
  return out;
}

std::vector<Table> cut(const Table& t, std::size_t parts) {
  std::vector<Table> out;
  for (std::size_t i = 0; i < parts; ++i) {
    const auto at = [&](std::size_t k) {
      return t.rows.begin() + static_cast<std::ptrdiff_t>(t.rows.size() * k / parts);
    };
    out.push_back({fmt::format("{} {}", t.name, i + 1), t.header, {at(i), at(i + 1)}});
  }
  return out;
}

using Tables = std::vector<Table>;

Tables each(const Tables& tables, const std::function<Table(const Table&)>& change) {
  Tables out;
  std::transform(tables.begin(), tables.end(), std::back_inserter(out), change);
  return out;
}

Tables all_cut(const Tables& tables, std::size_t parts) {
  Tables out;
  for (const Table& t : tables)
    for (Table& part : cut(t, parts)) out.push_back(std::move(part));
  return out;
}

/// Ten copies, the first as it is.
std::vector<std::pair<std::string, Tables>> copies(const Tables& as_is) {
  Tables reversed(as_is.rbegin(), as_is.rend());
  const double step = as_is[0].rows[1][0] - as_is[0].rows[0][0];
  const auto every = [&](double factor, double shift) {
    return each(as_is, [=](const Table& t) { return resampled(t, factor * step, shift * step); });
  };
  const auto to = [&](double x, double p) {
    return each(as_is, [=](const Table& t) { return rounded(t, x, p); });
  };
  return {{"as it is", as_is},
          {"rounded to 5 um, 0.5 mbar", to(5e-6, 5e-4)},
          {"rounded to 10 um, 1 mbar", to(1e-5, 1e-3)},
          {"shifted by half a sample", every(1.0, 0.5)},
          {"sampled twice as fast", every(0.5, 0.0)},
          {"sampled half as fast", every(2.0, 0.0)},
          {"cut into halves", all_cut(as_is, 2)},
          {"cut into thirds", all_cut(as_is, 3)},
          {"in another order", std::move(reversed)},
          {"without the first 25 rows", each(as_is, [](Table t) {
             t.rows.erase(t.rows.begin(), t.rows.begin() + 25);
             return t;
           })}};
}

std::vector<Log> logs_of(const Tables& tables, const Machine& machine) {
  std::vector<Log> out;
  for (const Table& t : tables) out.push_back(log_from_text(t.name, t.text(), machine));
  return out;
}

/// Effects that a copy gives, and the errors on the logs left out, as lines.
struct CopyResult {
  std::string set, text;
};

CopyResult result_of(const Tables& tables, const Machine& machine, const std::string& name,
                     const std::vector<Log>& tests, const ExtendOptions& options) {
  const ExtendLogs logs{logs_of(tables, machine), {}, {}};
  const ExtendResult r = improve(fit(machine, logs.suspects).model, logs, options);
  std::vector<std::string> keys;
  for (const AppliedEffect& e : r.model.effects) keys.push_back(e.key(machine));
  std::sort(keys.begin(), keys.end());
  CopyResult out;
  out.set = fmt::format("{}", fmt::join(keys, " "));
  out.text = fmt::format("{:28}{:6.0f} s  {}\n", name, r.seconds, out.set);
  if (tests.empty()) return out;
  const CompareResult errors = compare(r.model, tests);
  for (const StageScore& s : errors.scores)
    out.text += fmt::format("{:30}{:9} {:18}{:9.4g} {}\n", "", s.stage, s.at + " " + s.regime,
                            s.rmse / s.unit.si, s.unit.name);
  for (const EnergyScore& e : errors.energy)
    out.text +=
        fmt::format("{:30}energy    {:18}{:+9.2f} %\n", "", e.pump, 100.0 * e.relative_error);
  return out;
}

struct Arguments {
  std::string machine, only;
  int folds = ExtendOptions().folds;
  std::vector<std::string> logs, left_out;
};

int run(const Arguments& a, Journal& journal) {
  const Machine machine = load_machine(a.machine);
  Tables as_is, apart;
  for (const std::string& f : a.logs) as_is.push_back(read_table(f));
  for (const std::string& f : a.left_out) apart.push_back(read_table(f));
  const std::vector<Log> tests = logs_of(apart, machine);
  ExtendOptions options;
  options.folds = a.folds;
  std::map<std::string, int> sets;
  int count = 0;
  for (const auto& copy : copies(as_is)) {
    const std::string& name = copy.first;
    if (name.find(a.only) == std::string::npos) continue;
    const Tables& tables = copy.second;
    const std::string bytes = journal.kept(name, [&] {
      const CopyResult r = result_of(tables, machine, name, tests, options);
      return Journal::Part{Packer().text(r.set).text(r.text).bytes(), true};
    });
    Unpacker u(bytes);
    ++sets[u.text()];
    ++count;
    fmt::print("{}", u.text());
    std::fflush(stdout);
  }
  if (count == 0) throw UsageError("--only: no copy has \"" + a.only + "\" in its name");
  const auto most = std::max_element(
      sets.begin(), sets.end(), [](const auto& x, const auto& y) { return x.second < y.second; });
  fmt::print("same set in {} of {} copies: {}\n", most->second, count, most->first);
  journal.remove();
  return 0;
}

int run_with(int argc, char** argv) {
  Arguments a;
  ProgramOptions app("effects that improve finds on copies of the same logs");
  app.add("-m,--machine", a.machine, "machine file").required();
  app.add("-l,--log", a.logs, "logs to learn from (CSV)").required();
  app.add("-t,--test", a.left_out, "logs that take no part");
  app.add("--folds", a.folds, "of the cross-validation by which effects are judged");
  app.add("--only", a.only, "copies alone that have this in their name");
  app.add_journal();
  if (const auto code = app.parse(argc, argv)) return *code;
  std::vector<std::string> files = a.logs;
  files.insert(files.end(), a.left_out.begin(), a.left_out.end());
  files.push_back(a.machine);
  const std::unique_ptr<Journal> journal = app.journal(files, {});
  return run(a, *journal);
}

}  // namespace
}  // namespace sparflow::bench

int main(int argc, char** argv) {
  return sparflow::bench::run_program("improve_copies", sparflow::bench::run_with, argc, argv);
}
