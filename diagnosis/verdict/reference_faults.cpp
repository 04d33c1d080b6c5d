#include "diagnosis/verdict/reference_faults.h"

#include <fmt/format.h>

#include <algorithm>

#include "diagnosis/verdict/diagnosed_effect.h"
#include "diagnosis/verdict/residual_levels.h"
#include "identification/comparison/report_numbers.h"

namespace sparflow {

std::string ReferenceFault::sentence() const {
  return fmt::format(
      "in the {} they differ from the model by {} {} (RMS), the log by {} {} only; so the "
      "references are what is off here, or what was off has been mended since.",
      text, plain_number(in_references / unit.si, 3), unit.name, plain_number(in_log / unit.si, 3),
      unit.name);
}

std::vector<ReferenceFault> reference_faults(const CraneModel& model,
                                             const DiagnosisSignals& signals,
                                             const DiagnoseOptions& options) {
  std::vector<ReferenceFault> faults;
  if (signals.references.empty()) return faults;
  const std::vector<AppliedEffect> in_references = effects_in_references(model, signals.references);
  EvidenceOptions plain = options.evidence;
  plain.shared.clear();
  Diagnosis d;
  d.thresholds = options.verdict;
  d.evidence = references_first(
      collect_evidence(model, signals.suspects, signals.references, &in_references, plain));
  FitControl control;
  control.keep_residuals = true;
  d.search.final = fit_effects(d.evidence, {}, nullptr, control);
  for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
    const EvidenceChannel& channel = d.evidence.channels[c];
    const double there = suspect_rms(d.evidence, c, d.search.final.residual[c]);
    const double here = reference_rms(d, c);
    if (!(there > d.thresholds.least_excess_ratio * expected_rms(d, c))) continue;
    const std::optional<double> chance = chance_beyond_references(d, c);
    if (!chance || *chance >= d.thresholds.structure_false_alarm) continue;
    faults.push_back({channel.text, channel.unit, there, here});
  }
  std::sort(faults.begin(), faults.end(), [](const ReferenceFault& a, const ReferenceFault& b) {
    return a.in_references * b.in_log > b.in_references * a.in_log;
  });
  return faults;
}

}  // namespace sparflow
