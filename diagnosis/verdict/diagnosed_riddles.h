#pragma once
/// What nothing in the catalogue explains, and what that leaves open about the effects found. Used by diagnose.cpp only.
#include <vector>

#include "diagnosis/residual/unexplained.h"
#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// What the catalogue explained of a channel and what a flexible model explains beyond it, as variances.
double leftover_share(const Diagnosis& d, const Leftover& left);

/// Whether riddles leave open that the effect is what it is called: one in its own channel, or a larger one in a
/// channel that shows it too, of which the effect may be the smaller half. A sensor's error is one and the same
/// wherever its reading goes: for it a riddle in one place is one in all.
bool is_doubtful(const Evidence& evidence, const DiagnosedEffect& e,
                 const std::vector<Leftover>& riddles);

/// Share of the squared error beyond the sensors' noise that all that was found explains where the effect shows best;
/// one where what is left is not far above that noise.
double explained_share(const Diagnosis& d, const DiagnosedEffect& e);

/// Whether a large error stays that the effect hardly touches: what makes it is not known, and some of it looks like
/// the effect. True effects leave no errors of that size where they show best (docs/diagnose.md, section 7).
bool is_a_trifle(const Diagnosis& d, const DiagnosedEffect& e);

/// An error without a name and without signals: how large it is and where.
Unexplained describe_trifle(const Evidence& evidence, const DiagnosedEffect& e);

Unexplained describe_leftover(const Evidence& evidence, const Leftover& left);

/// Evidence that only an implausible effect would fit: place and size, without a name.
Unexplained describe_unnamed(const Diagnosis& d);

/// What happened once and that an effect would explain, though it proves none.
Unexplained describe_incident(const Diagnosis& d);

}  // namespace sparflow
