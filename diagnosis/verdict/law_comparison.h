#pragma once
/// Two values of one law that replaces itself when it changes, compared by what they leave. Used by reference_comparison.cpp only.
#include <vector>

#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// Whether one law leaves no more of either group of logs than the law that this group has by itself: of the references that which acts
/// in all logs so far, of the suspect logs the one found. Each group has an optimum of its own in parameters that its motions hardly
/// show (the command from which a valve asks for pressure, where no lever rests near it), and sizes of the one optimum, measured from
/// the other one, then differ by far.
/// Tests of Vuong (1989, Econometrica 57, 307) and Clarke (2007, Political Analysis 15, 347) for laws of which neither contains the other,
/// on the log-likelihoods of the stretches of motion, by the noise of the group's own law.
/// @param found index into the effects found  @param law with the same effect at the same place
/// @return false for an effect that adds to the law before, and where the logs have no such law so far
bool as_good_as_own_laws(const Diagnosis& d, std::size_t found, const FoundEffect& law);

/// The smaller of both tests' probabilities of such gains of the own law without any advantage: of their mean by Student's distribution, and
/// of the number of stretches that gain. Where a law gains much in a few stretches and little in all others the mean is not certain.
/// @param stretches log-likelihood of each stretch of motion by its own law less that by the other one [nats]
/// @return 0 for fewer than two stretches
double chance_of_gains_in(const std::vector<double>& stretches);

}  // namespace sparflow
