#pragma once
/// The cheapest cycle: a sequence of stops with changes of the payload as one optimisation. Each leg is first optimised on its
/// own, one after the other, in a share of the time; their phases joined are the start of one NLP in which the payload is a
/// constant of each phase, the time is split freely among the legs, and the postures at the stops are free.
#include <functional>
#include <string>
#include <vector>

#include "optimizer/solve/optimize.h"

namespace sparflow {

/// Seed motions of a leg; an empty answer with a reason is an answer.
struct LegSeeds {
  std::vector<SeedMotion> motions;
  std::string message;  ///< why there is none
};
using SeedsOfLeg = std::function<LegSeeds(const MotionProblem& leg)>;

/// @param seeds_of where a leg's first paths come from; empty: from the joint grid
/// @throws InputError when the model lacks a pressure model that the machine needs
OptimizeResult optimize_cycle(const CraneModel& model, const MotionProblem& problem,
                              const SeedsOfLeg& seeds_of, const OptimizeOptions& options = {});

/// A leg's share of a cycle's result.
struct LegEnergy {
  std::string to;                 ///< name of the stop in which it ends
  double payload = 0.0;           ///< [kg]
  double begin = 0.0, end = 0.0;  ///< [s]
  double energy = 0.0;            ///< [J] by the exact law
};
std::vector<LegEnergy> leg_energies(const CraneModel& model, const MotionProblem& problem,
                                    const Trajectory& motion, int refine = 16);

}  // namespace sparflow
