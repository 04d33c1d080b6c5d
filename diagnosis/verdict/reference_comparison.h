#pragma once
/// What suspect and reference logs show alike is no change: effects that the model lacks in both, and structure that stays
/// unexplained in both. Used by diagnose.cpp and its parts only.
#include <optional>
#include <vector>

#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// The diagnosis of signals without faulty channels, where effects act in the suspect logs alone (diagnose.cpp).
Diagnosis diagnose_sound(const CraneModel& model, const DiagnosisSignals& signals,
                         const DiagnoseOptions& options, const SearchProgress& progress);

/// How a found effect appears in the references. Its size is compared by a random-effects model (size_by_logs.h): a law that
/// is not exact has another size in every motion, and only a difference beyond that is a change.
enum class InReferences {
  kNot,    ///< not there, or the references cannot tell
  kOther,  ///< there with another size
  kAlike,  ///< not significantly different, or within the model-form error of its law
  kVaries  ///< its size in the suspect logs is not even significant beside its variation from motion to motion
};
/// Other effects found have sizes of their own in the references meanwhile.
InReferences in_references(const Diagnosis& d, std::size_t found, const SearchOptions& options);

struct ComparedWithReferences {
  InReferences there = InReferences::kAlike;
  /// Where one law explains both groups of logs: the effect with that law.
  std::optional<FoundEffect> law;
};

/// The same for all effects found. Residuals of both groups are comparable only once what both have acts in both, so that
/// differences of size which the residuals must prove are left as they are while another effect joins the references.
/// @param last whether no further turn follows
std::vector<ComparedWithReferences> all_in_references(const Diagnosis& d,
                                                      const SearchOptions& options, bool last);

/// Whether a law of several parameters that the references' own diagnosis has left out, estimated from them alone, has the values
/// that it has in the suspect logs. The size there of the law with the suspect logs' nonlinear parameters does not tell, because each
/// log prefers parameters, and a variant, of its own.
/// @param alone as for the references' own diagnosis; its candidates and what both logs have are not used
/// @param found index into the effects found in `d`
bool found_in_references(const CraneModel& model, const DiagnosisSignals& signals,
                         DiagnoseOptions alone, const Diagnosis& d, std::size_t found);

/// Diagnosis of suspect logs against references, in three steps: what the model lacks in the references alone; the
/// difference of the suspect logs, with those effects estimated in all logs; and again, where an effect that was found
/// as a difference is seen in the references as well.
Diagnosis diagnose_against_references(const CraneModel& model, const DiagnosisSignals& signals,
                                      const DiagnoseOptions& options,
                                      const SearchProgress& progress);

}  // namespace sparflow
