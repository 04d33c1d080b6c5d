#pragma once
/// The loop of trust: a model learned from simulated logs, improved, and its optima tracked on the dynamic plant that wrote the
/// logs. What `demo`, its page, Python and the study share.
#include <limits>
#include <string>
#include <vector>

#include "apps/report/page/page.h"
#include "diagnosis/extension/extend.h"
#include "identification/learning/fit.h"

namespace sparflow {

/// A motion on the dynamic plant, beside what a model predicts of it.
struct TrackedMotion {
  double predicted = std::numeric_limits<double>::quiet_NaN();  ///< [J] of the planned motion
  double measured = std::numeric_limits<double>::quiet_NaN();  ///< [J] true: pumps' pressure x flow
  double tip_error = std::numeric_limits<double>::quiet_NaN();  ///< [m] at the end
  std::string failure;  ///< why there is none of these, one sentence; empty: it was done
  bool done() const { return failure.empty(); }
  /// Predicted over true energy, less one.
  double error() const { return predicted / measured - 1.0; }
};

/// One move: its optimum by either model, tracked, and the same work as operators and joint control do it.
struct TrustedMove {
  std::string name;
  double payload = 0.0;   ///< [kg]
  double duration = 0.0;  ///< [s]
  TrackedMotion before, after;
  TrackedMotion sequential;  ///< operator, one lever after another; nothing is predicted
  TrackedMotion joint_pi;    ///< straight joint line
  /// True energy of the tracked optimum of the improved model below that of the sequential operator, over the latter.
  double saving() const { return 1.0 - after.measured / sequential.measured; }
};

struct TrustLoop {
  std::string machine;
  std::uint64_t seed = 1;
  std::vector<std::string> effects;                ///< of the plant, as they were asked for
  double train_seconds = 0.0, test_seconds = 0.0;  ///< [s] of the simulated logs
  FitResult fitted;
  ExtendResult improved;
  CompareResult test_before, test_after;  ///< on the held-out simulated log
  std::vector<TrustedMove> moves;
  double seconds = 0.0;  ///< [s] that the loop took
  bool interrupted = false;

  const CraneModel& before() const { return fitted.model; }
  const CraneModel& after() const { return improved.model; }
};

/// Medians over the moves that were done; NaN without any.
struct TrustSums {
  int moves = 0;  ///< whose optima by both models were tracked to the end
  double error_before = std::numeric_limits<double>::quiet_NaN();  ///< of |predicted / true - 1|
  double error_after = std::numeric_limits<double>::quiet_NaN();
  double bias_before = std::numeric_limits<double>::quiet_NaN();  ///< of predicted / true - 1
  double bias_after = std::numeric_limits<double>::quiet_NaN();
  double saving = std::numeric_limits<double>::quiet_NaN();  ///< of TrustedMove::saving
};
TrustSums sums_of(const TrustLoop& loop);
/// The same over the moves of several loops.
TrustSums sums_of(const std::vector<TrustedMove>& moves);

/// One sentence without full stop.
std::string trust_headline(const TrustLoop& loop);
/// What was found missing and what it did to the errors on the held-out log, whole sentences.
std::string trust_story(const TrustLoop& loop);
/// One row a move: predicted and true energy before and after, and the saving.
std::string trust_table(const TrustLoop& loop);
std::string trust_json(const TrustLoop& loop);

/// Appends sections: the held-out log measured and predicted before and after, energies of the tracked motions.
void add_trust(Page& page, const TrustLoop& loop, const std::string& heading_prefix = "");
/// Makes a page of add_trust() with a verdict.
Page trust_page(const TrustLoop& loop);

}  // namespace sparflow
