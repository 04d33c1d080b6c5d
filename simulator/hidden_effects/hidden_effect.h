#pragma once
/// Measurement logs of a crane with a hidden effect, to judge a diagnosis by. Shares the machine's geometry with
/// models/ and no law: forces come from bodies (body_forces.h), pressures, valves, pump and effects from laws of
/// their own (crane_laws.h, laws_*.cpp), most of them unlike the catalogue's text-book forms.
///
/// One case is one crane: its margins, return line, counterbalance valves and valve gains are drawn from
/// `crane_seed` and are the same in the reference log (no effect), the training and the test log.
#include <cstdint>
#include <string>
#include <vector>

#include "models/machine/machine.h"

namespace sparflow::simulator {

struct HiddenEffect {
  std::string id;  ///< of the catalogue, or one of outside_ids()
  std::string
      at;  ///< joint, cylinder, pump or channel; empty = drawn among the places where it can sit
  double size = 1.0;  ///< 1 = clear, 1/3 = small; multiplies the drawn strength
  int law = -1;       ///< variant, -1 = drawn
};

/// A true value, in the catalogue's meaning.
struct HiddenParameter {
  std::string name;
  double value = 0.0;  ///< [SI] parameter of the law that was used
  std::string unit;    ///< SI
  /// [SI] of the text-book law that comes nearest to what this effect did in this log (least squares over its moving
  /// samples); equal to `value` when the law used is the text-book one or no such law is near.
  double equivalent = 0.0;
};

struct HiddenTruth {
  std::string id, at;
  double size = 1.0;
  int law = 0;
  std::string law_name;  ///< "LuGre bristles" ...
  bool in_catalogue = true;
  std::vector<HiddenParameter> parameters;
};

/// Which columns the log has.
struct LogChannels {
  bool commands = true;
  bool pressure_b = true;  ///< rod side chambers
  bool pumps = true;
  bool payload = true;
  bool oil = true;
  bool strokes = false;  ///< x_<cylinder>_m in place of q_<joint>
};

struct LogRequest {
  Machine machine;
  std::vector<HiddenEffect> effects;
  /// Ids of effects the crane's base laws make room for without having them (a counterbalance valve that is absent,
  /// a laminar share in the return lines): set for the reference of a case.
  std::vector<HiddenEffect> absent;
  std::uint64_t crane_seed = 1;   ///< base laws and the effects' strengths
  std::uint64_t motion_seed = 1;  ///< motions, payloads and noise
  double seconds = 240.0;
  double rate = 50.0;         ///< [Hz] 5..200
  double noise_factor = 1.0;  ///< 1 = 0.8 bar, 0.3 mrad, 1 mm
  bool warm = false;          ///< oil already warm, one payload: a test log
  LogChannels channels;
};

struct GeneratedLog {
  std::vector<std::string> names;            ///< of the CSV's columns
  std::vector<int> decimals;                 ///< each column is rounded to
  std::vector<std::vector<double>> columns;  ///< as named: t_s, bar ... (file units), rounded
  std::vector<HiddenTruth> truth;

  std::size_t rows() const { return columns.empty() ? 0 : columns.front().size(); }
  /// nullptr when the log has no such column.
  const std::vector<double>* find(const std::string& name) const;
};

/// Deterministic in the request. @throws InputError for an unknown id or a place the machine does not have, or where
/// the effect cannot sit
GeneratedLog generate(const LogRequest& request);

std::string csv_text(const GeneratedLog& log);
void write_csv(const GeneratedLog& log, const std::string& path);

struct EffectDescription {
  std::string id;
  std::string place;  ///< "joint", "cylinder", "pump", "machine" or "channel"
  bool in_catalogue = true;
  std::vector<std::string> laws;  ///< one line each
  std::string parameters;         ///< names and meaning
};
const std::vector<EffectDescription>& effect_descriptions();
std::vector<std::string> catalogue_ids();
std::vector<std::string> outside_ids();
/// Names of the places on this machine where an effect can sit; {""} for the whole machine; empty = it cannot.
std::vector<std::string> places_of(const std::string& id, const Machine& machine);

/// A case folder: reference.csv, train.csv, test.csv, machine.yaml, truth.json.
struct CaseRequest {
  LogRequest log;  ///< seeds, machine, effects; `warm` and `motion_seed` are set by log kind
  double test_seconds = 120.0;
};
struct GeneratedCase {
  GeneratedLog reference, train, test;
};
/// The three logs of a case: the effects' own motions, others with warm oil, and others without the effects.
struct CaseLogs {
  LogRequest train, test, reference;
};
CaseLogs case_logs(const CaseRequest& request);
GeneratedCase generate_case(const CaseRequest& request);
/// @param folder is made when absent
void write_case(const CaseRequest& request, const GeneratedCase& logs, const std::string& folder);

}  // namespace sparflow::simulator
