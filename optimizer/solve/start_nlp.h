#pragma once
/// The NLP of one solve of a start: variables' bounds, conditions at the ends and at stops, phases, and the load's coordinates
/// where its sway is limited.
#include <functional>
#include <memory>
#include <vector>

#include "optimizer/crane/crane_knot_model.h"
#include "optimizer/phases/phases.h"
#include "optimizer/phases/tightening.h"
#include "optimizer/solve/optimize.h"
#include "optimizer/transcription/transcription.h"

namespace sparflow {

/// What an NLP is made of.
struct StartParts {
  const CraneModel& model;
  const MotionProblem& problem;
  const TimeWindow& time;
  const PhaseMesh& mesh;
  const PhasePlan& plan;  ///< phases of the mesh; read only where the problem has stops
  const Tightening& tightening;
};

/// A view: all parts must outlive it.
class StartNlp {
 public:
  using KnotWrapper = std::function<std::shared_ptr<KnotModel>(const CraneKnotOptions&,
                                                               std::shared_ptr<KnotModel>)>;

  explicit StartNlp(const StartParts& parts)
      : model_(parts.model),
        problem_(parts.problem),
        time_(parts.time),
        mesh_(parts.mesh),
        plan_(parts.plan),
        tightening_(parts.tightening) {}

  /// @param knot smoothing and postures that decide the clearance rows; the rest is set here
  /// @param wrapper replaces the knot model; may be empty
  TranscriptionSpec spec(CraneKnotOptions knot, const KnotWrapper& wrapper) const;
  /// Makes the load's coordinates further joints of the transcription.
  void add_load(const Trajectory& from, TranscriptionSpec& spec) const;
  /// [s] lower bound of a phase's duration, below the time in which a valve opens and closes
  double shortest_phase() const;

 private:
  void set_bounds(TranscriptionSpec& spec) const;
  /// The constraint of a place in which the machine rests: rows of the tip, or (null) bounds of the posture at that knot.
  std::shared_ptr<TerminalModel> reach(const Goal& place, int knot,
                                       TranscriptionBounds& bounds) const;
  /// Velocities at the start and at the goal, where they are not rest.
  void set_end_velocities(TranscriptionBounds& bounds) const;
  /// Number of the leg to which a phase belongs, or that follows the stop in which it rests.
  std::size_t leg_of_phase(int phase) const;
  /// Payload of every interval; empty where it does not change.
  std::vector<double> payloads() const;
  /// Whether the machine rests at a stop in this phase, as long as the stop asks for.
  bool dwells(int phase) const;
  /// Gives the phases at rest the times that the stops ask for.
  void hold_dwells(PhaseTimes& phases) const;
  /// Rest at the stops and while the machine dwells there, and where they are.
  void set_stops(TranscriptionSpec& spec) const;

  const CraneModel& model_;
  const MotionProblem& problem_;
  const TimeWindow& time_;
  const PhaseMesh& mesh_;
  const PhasePlan& plan_;
  const Tightening& tightening_;
};

}  // namespace sparflow
