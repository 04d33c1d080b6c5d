#pragma once
/// Parts of the look at what is left (unexplained.h): what swings in time. Used by unexplained.cpp only.
#include "diagnosis/residual/unexplained.h"

namespace sparflow {

/// Rows of suspect logs only.
std::vector<Eigen::Index> suspect_rows(const Evidence& evidence, const EvidenceChannel& channel);

/// An oscillation whose frequency wanders draws no line: the deepest dip of the autocorrelation between a twentieth
/// and one second of what is faster than a second. White noise has none, a step decays without one.
struct Swing {
  double dip = 0.0;        // autocorrelation there, of what exceeds white noise
  double frequency = 0.0;  // [Hz] half a period to the dip
  double rms = 0.0, noise = 0.0;
};
Swing strongest_swing(const Evidence& evidence, const EvidenceChannel& channel);

struct Line {
  double frequency = 0.0;  ///< [Hz]
  double share = 0.0;      ///< of the residual's squares
};

/// Strongest line of the residual, in time; zero share when none stands out.
Line strongest_line(const Evidence& evidence, const EvidenceChannel& channel,
                    const Eigen::VectorXd& residual);

/// A residual that is far larger in one place than it is everywhere else: something happened there that other motions
/// do not show, and that no law learned from them can explain.
struct Event {
  double times = 0.0;  ///< its RMS over that of the usual second, at least the sensors' noise
  double rms = 0.0;    ///< [SI] over the whole log, of its own rows
  double rest = 0.0;   ///< [SI] RMS of all other rows
  double from = 0.0, to = 0.0;  ///< [s] in its log
  std::size_t log = 0;
};

/// The stretch of a motion (a second and what goes on beside it) in which the residual is largest; times = 0: none of two
/// seconds, or too few to know what is usual.
Event strongest_event(const Evidence& evidence, const EvidenceChannel& channel,
                      const Eigen::VectorXd& residual);

}  // namespace sparflow
