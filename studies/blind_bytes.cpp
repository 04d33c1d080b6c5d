/// Packs a run of the blind test for a journal. Its fields are bound by name, so that a field which is added and not packed
/// does not compile.
#include "optimizer/solve/child_processes.h"
#include "studies/blind_case.h"

namespace sparflow::bench {
namespace {

/// Calls `visit` with each field of a run but `asked`.
template <class Run, class Visit>
void each_field(Run& run, const Visit& visit) {
  auto& [asked, machine, truth, answer, verdict, left_out, details, top, in_set, broken_found,
         all_found, exact, set_size, seconds, rows, named, errors, covered, parameters, rms_ratio,
         energy_before, energy_after, changed, made_worse, worse_by, absorbed] = run;
  (void)asked;
  visit(machine, truth, answer, verdict, left_out, details, top, in_set, broken_found, all_found,
        exact, set_size, seconds, rows, named, errors, covered, parameters, rms_ratio,
        energy_before, energy_after, changed, made_worse, worse_by, absorbed);
}

void put(Packer& p, double v) { p.number(v); }
void put(Packer& p, bool v) { p.number(v ? 1.0 : 0.0); }
void put(Packer& p, const std::string& v) { p.text(v); }
void put(Packer& p, const NamedEffect& e) {
  p.text(e.key).number(e.size).number(e.over_form).number(e.gain);
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
