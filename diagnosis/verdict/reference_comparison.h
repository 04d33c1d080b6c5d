#pragma once
/// What suspect and reference logs show alike is no change: effects that the model lacks in both, and structure that stays
/// unexplained in both. Used by diagnose.cpp and its parts only.
#include <optional>

#include "diagnosis/residual/residual_model.h"
#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// The diagnosis of signals without faulty channels, where effects act in the suspect logs alone (diagnose.cpp).
Diagnosis diagnose_sound(const CraneModel& model, const DiagnosisSignals& signals,
                         const DiagnoseOptions& options, const SearchProgress& progress);

/// RMS of a channel's final residual in the reference logs [SI]; NaN where they do not have the channel.
double reference_rms(const Diagnosis& d, std::size_t channel);

/// Probability, by Bonferroni's bound over the channels, that a channel's final residual is so much larger in the suspect logs
/// than in the references by chance, on the logarithms of the blocks' mean squares: Welch's (1947) test of their means, and
/// Student's prediction for the largest one, because a deviation in one stretch of motion hardly moves the mean. Nothing
/// where there are no references, or too few motions of one kind.
std::optional<double> chance_beyond_references(const Diagnosis& d, std::size_t channel);
/// Whether that is significant; true where there is nothing to compare with.
bool exceeds_references(const Diagnosis& d, std::size_t channel);
/// The channel in which it is most significant, among those whose residual is a multiple of that in the references; nothing
/// where it is in none, or without references.
std::optional<std::size_t> channel_beyond_references(const Diagnosis& d);

/// For each structure in the suspect logs' final residual, whether it is no change: the references have as large a structure in
/// the same channel by the same residual models, or leave about as much beyond the sensors' noise there, and the residual of the
/// suspect logs is not larger (exceeds_references).
std::vector<bool> shared_structure(const Diagnosis& d, const std::vector<ResidualStructure>& left,
                                   const DiagnoseOptions& options);

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

/// Diagnosis of suspect logs against references, in three steps: what the model lacks in the references alone; the
/// difference of the suspect logs, with those effects estimated in all logs; and again, where an effect that was found
/// as a difference is seen in the references as well.
Diagnosis diagnose_against_references(const CraneModel& model, const DiagnosisSignals& signals,
                                      const DiagnoseOptions& options,
                                      const SearchProgress& progress);

}  // namespace sparflow
