#pragma once
/// The pictures that prove a diagnosis: measured against the model with and without an effect, and what is left
/// against the signal that tells.
#include <string>
#include <vector>

#include "apps/report/page/page.h"
#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// One evidence channel's rows with everything that was found, and without one effect. SI.
struct ChannelPicture {
  const EvidenceChannel* channel = nullptr;
  Eigen::VectorXd measured;  ///< [rows] filtered as the evidence is
  Eigen::VectorXd with;      ///< [rows] residual with all effects found
  Eigen::VectorXd without;   ///< [rows] the same without the one
};

/// @param effect index into diagnosis.effects, -1: `without` has none of them
/// @param channel index into diagnosis.evidence.channels
ChannelPicture channel_picture(const Diagnosis& diagnosis, int effect, std::size_t channel);

/// A signal a residual may depend on, at the rows of a channel, in the unit beside it.
struct TellingSignal {
  std::string id;  ///< "speed", "load", "angle" ...: what kind of signal
  std::string words, unit;
  Eigen::VectorXd values;  ///< [rows]
};
std::vector<TellingSignal> telling_signals(const Evidence& evidence,
                                           const EvidenceChannel& channel);

/// Curves over a well-chosen stretch of time, and residuals against the telling signal.
void add_effect_pictures(Page& page, const Diagnosis& diagnosis, std::size_t effect);

/// What is left at a place against the two signals that explain most of it.
/// @param swings it goes with the time: drawn over it, and against signals only where these tell something
void add_left_over(Page& page, const Diagnosis& diagnosis, const std::string& stage,
                   const std::string& at, bool swings);

/// Where nothing is missing: how large each quantity's error is beside its sensors' noise, and pictures of those that a
/// signal explains most of, for eyes to find nothing.
void add_noise(Page& page, const Diagnosis& diagnosis);

/// A bad channel over time as logged, where it is bad shaded.
LineChart bad_channel_chart(const BadChannel& bad);

/// Gains of the candidates, and what chance would reach.
void add_ranking(Page& page, const Diagnosis& diagnosis);

}  // namespace sparflow
