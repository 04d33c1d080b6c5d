#pragma once
/// Simulated logs of a crane with a hidden effect, by which a diagnosis is judged. The simulator shares the machine's
/// geometry with models/ and no law: forces come from bodies (body_forces.h), pressures, valves, pump and effects from
/// laws of its own (crane_laws.h, laws/), most of them of another form than the catalogue's text-book laws.
///
/// A case is one crane: its margins, return line, counterbalance valves and valve gains are drawn from `crane_seed`
/// and are the same in the reference log (without effect), the training log and the test log.
#include <cstdint>
#include <string>
#include <vector>

#include "models/machine/machine.h"

namespace sparflow::simulator {

struct HiddenEffect {
  std::string id;     ///< id in the catalogue, or one of outside_ids()
  std::string at;     ///< joint, cylinder, pump or channel; empty = drawn among places_of()
  double size = 1.0;  ///< [-] 1 = clear, 1/3 = small; multiplies the drawn strength
  int law = -1;       ///< variant of the law, -1 = drawn
};

/// A true parameter with the catalogue's meaning.
struct HiddenParameter {
  std::string name;
  double value = 0.0;  ///< [SI] parameter of the law that was simulated
  std::string unit;    ///< SI
  /// [SI] parameter of the text-book law that fits the effect's action in this log best (least squares over moving
  /// samples); equal to `value` when the simulated law is the text-book one or no text-book law is similar.
  double equivalent = 0.0;
};

/// An effect as it was simulated.
struct HiddenTruth {
  std::string id, at;
  double size = 1.0;
  int law = 0;
  std::string law_name;  ///< "LuGre bristles" ...
  bool in_catalogue = true;
  std::vector<HiddenParameter> parameters;
};

/// The columns that the log has.
struct LogChannels {
  bool commands = true;
  bool pressure_b = true;  ///< rod-side chambers
  bool pumps = true;
  bool payload = true;
  bool oil = true;
  bool strokes = false;  ///< x_<cylinder>_m in place of q_<joint>
};

struct LogRequest {
  Machine machine;
  std::vector<HiddenEffect> effects;
  /// Effects to which the crane's base laws are adapted without having them (no counterbalance valve of its own, a
  /// laminar share in the return lines); set for the reference log of a case.
  std::vector<HiddenEffect> absent;
  std::uint64_t crane_seed = 1;   ///< base laws and the effects' strengths
  std::uint64_t motion_seed = 1;  ///< motions, payloads and noise
  double seconds = 240.0;
  double rate = 50.0;         ///< [Hz] 5..200
  double noise_factor = 1.0;  ///< [-] 1 = standard deviations of 0.8 bar, 0.3 mrad, 1 mm
  bool warm = false;  ///< oil is warm from the start and the payload constant, as in a test log
  LogChannels channels;
};

struct GeneratedLog {
  std::vector<std::string> names;            ///< of the CSV's columns
  std::vector<int> decimals;                 ///< to which each column is rounded
  std::vector<std::vector<double>> columns;  ///< values in the units of their names, rounded
  std::vector<HiddenTruth> truth;

  std::size_t rows() const { return columns.empty() ? 0 : columns.front().size(); }
  /// Returns the column, nullptr when the log has none of that name.
  const std::vector<double>* find(const std::string& name) const;
};

/// Simulates one log; the same request gives the same log. @throws InputError for an unknown id, and for a place that
/// the machine does not have or that the effect cannot have
GeneratedLog generate(const LogRequest& request);

std::string csv_text(const GeneratedLog& log);
void write_csv(const GeneratedLog& log, const std::string& path);

struct EffectDescription {
  std::string id;
  std::string place;  ///< "joint", "cylinder", "pump", "machine" or "channel"
  bool in_catalogue = true;
  std::vector<std::string> laws;  ///< one line each
  std::string parameters;         ///< names, units and meaning
};
const std::vector<EffectDescription>& effect_descriptions();
std::vector<std::string> catalogue_ids();
std::vector<std::string> outside_ids();
/// Returns the names of the places that an effect can have on this machine: {""} for the whole machine, empty = none.
std::vector<std::string> places_of(const std::string& id, const Machine& machine);

/// A case: the files reference.csv, train.csv, test.csv, machine.yaml and truth.json in one folder.
struct CaseRequest {
  LogRequest
      log;  ///< seeds, machine, effects; case_logs() sets `warm` and `motion_seed` of each log
  double test_seconds = 120.0;
};
struct GeneratedCase {
  GeneratedLog reference, train, test;
};
/// Requests of the three logs of a case, each with other motions: training, test (warm oil), reference (no effects).
struct CaseLogs {
  LogRequest train, test, reference;
};
CaseLogs case_logs(const CaseRequest& request);
GeneratedCase generate_case(const CaseRequest& request);
/// Writes the files of a case. @param folder is created when absent
void write_case(const CaseRequest& request, const GeneratedCase& logs, const std::string& folder);

}  // namespace sparflow::simulator
