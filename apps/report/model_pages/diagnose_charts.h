#pragma once
/// The figures of a diagnosis: measurement beside the model with and without an effect, and residuals against the
/// signals that explain most of them.
#include <string>
#include <vector>

#include "apps/report/page/page.h"
#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// Rows of one evidence channel with all effects found, and without one of them. SI.
struct ChannelPicture {
  const EvidenceChannel* channel = nullptr;
  Eigen::VectorXd measured;  ///< [rows] measured quantity, from Evidence::series
  Eigen::VectorXd with;      ///< [rows] residual with all effects found
  Eigen::VectorXd without;   ///< [rows] residual without that effect
};

/// @param effect index into diagnosis.effects, -1: `without` has none of them
/// @param channel index into diagnosis.evidence.channels
ChannelPicture channel_picture(const Diagnosis& diagnosis, int effect, std::size_t channel);

/// A signal that a residual may depend on, at the rows of a channel, in the unit named here.
struct ExplainingSignal {
  std::string id;  ///< kind of the signal: "speed", "load", "angle" ...
  std::string words, unit;
  Eigen::VectorXd values;  ///< [rows]
};
/// Lists the signals of the channel's place that the logs measure.
std::vector<ExplainingSignal> explaining_signals(const Evidence& evidence,
                                                 const EvidenceChannel& channel);

/// Appends curves over the stretch of time in which the effect shows most, and residuals against the signal that
/// explains them.
void add_effect_pictures(Page& page, const Diagnosis& diagnosis, std::size_t effect);

/// Appends the residual at a place against the two signals that explain most of it.
/// @param swings the residual oscillates: it is also drawn over time, and against signals only where these explain some
void add_unexplained_residual(Page& page, const Diagnosis& diagnosis, const std::string& stage,
                              const std::string& at, bool swings);

/// Appends, for a diagnosis without missing effects, each quantity's residual beside its sensors' noise, and charts of
/// the residuals of which a signal explains most, so that the reader can check that no structure is left.
void add_remaining_residuals(Page& page, const Diagnosis& diagnosis);

/// Draws a bad channel over time as logged; the stretches where it is bad are shaded.
LineChart bad_channel_chart(const BadChannel& bad);

/// Appends the gains of the candidates beside the gain that chance alone reaches.
void add_ranking(Page& page, const Diagnosis& diagnosis);

}  // namespace sparflow
