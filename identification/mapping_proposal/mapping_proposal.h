#pragma once
/// Proposes which channel of a log is which stroke, pressure, command or pump of a machine, by names, units and physics, with a
/// confidence and what speaks for it. docs/mapping_proposal.md says how, and how often it is right. Nothing uses it unasked.
#include <functional>
#include <string>
#include <vector>

#include "identification/mapping_proposal/assignment.h"
#include "identification/mapping_proposal/evidence/force_evidence.h"
#include "identification/mapping_proposal/evidence/position_evidence.h"

namespace sparflow {

/// Confidence of a meaning by its margin: the loss of the best other assignment of all channels [nat].
struct ConfidenceOptions {
  /// Log-odds at margin zero, of a meaning that the names say nothing about.
  /// @threshold [nat] -5..5; chosen: real logs hold more than the simulator, so that the confidence stays below the share that is right
  double at_zero = -1.0;
  /// Growth of the log-odds with the margin.
  /// @threshold [1] 0.1..3; chosen: ten nats make a meaning sure, three do not
  double by_margin = 0.9;
  /// Below it a meaning stands in the written mapping as a comment only.
  /// @threshold [1] 0.5..0.99; chosen: a mapping with twenty columns should rarely hold a wrong one
  double unsure_below = 0.7;
  /// Log-odds by which the forces must speak for the other side of a cylinder before names and forces contradict each other.
  /// @threshold [nat] 1..20; chosen: odds of e^4, with which a name is not doubted by chance
  double decisive = 4.0;
  /// Largest confidence of a meaning whose joint rests throughout, where the name says nothing, and of pressures of a cylinder
  /// whose names and forces contradict each other.
  /// @threshold [1] 0..0.7; chosen: nothing but range and unit speaks for it
  double resting = 0.5;
  /// Largest confidence that is told.
  /// @threshold [1] 0.9..0.9999; chosen: no log proves what a channel is
  double most = 0.99;
};

struct ProposalOptions {
  WordOptions words;
  ChannelEvidenceOptions evidence;
  PositionOptions positions;
  PressureOptions pressures;
  ConfidenceOptions confidence;
  /// Sets of positions that are judged by physics.
  /// @threshold [1] 1..2000; chosen: the right one is among them on the bundled machines, and the search takes seconds
  int position_sets = 120;
  /// Of these, sets that are kept to find the best other assignment.
  /// @threshold [1] 1..100; chosen: swapped joints and readings
  int kept_sets = 12;
  /// Joints times sets that the search can afford.
  /// @threshold [1] 100..1e6; numerical: the static force of a chain grows with the square of its joints
  int affordable_sets = 1200;
  PairSearchOptions pair_search;
  /// Called several times a second; may throw Interruption to end the search. May be empty.
  std::function<void()> progress;
};

/// One meaning of the machine's log, and the channel that fits best.
struct MeaningProposal {
  Meaning meaning;
  std::string
      column;  ///< the program's name, unit included: "pA_boom_bar"; "" for speeds, which the program computes
  int channel = -1;  ///< in the recording; -1 = none fits
  std::string channel_name;
  std::string expression;   ///< over the file's own columns
  double factor = 1.0;      ///< SI of one unit of the channel (of a command: see the expression)
  double confidence = 0.0;  ///< 0..1
  double margin = 0.0;      ///< [nat] loss of the best other assignment
  std::vector<std::string> reasons;
  std::string other;      ///< the channel that would take its place, "" = none
  bool required = false;  ///< a log cannot be read without it
};

struct MappingProposal {
  std::vector<MeaningProposal> meanings;
  std::vector<std::string> left_over;   ///< channels without a meaning
  std::string clock, clock_expression;  ///< "" where channels have clocks of their own
  std::vector<std::string> notes;       ///< whole sentences
  double unsure_below = 0.0;
  bool sure(const MeaningProposal& m) const {
    return m.channel >= 0 && m.confidence >= unsure_below;
  }
};

MappingProposal propose_mapping(const TimedChannels& file, const Machine& machine,
                                const ProposalOptions& options = {});

/// Mapping file (docs/log_format.md) with what is sure; the rest stands in it as comments.
std::string mapping_yaml(const MappingProposal& proposal, const Machine& machine);
/// A table with one line for each meaning, and what speaks for it below.
std::string proposal_table(const MappingProposal& proposal, const Machine& machine);

/// Without a machine: what each channel looks like by name, unit and whether it is another's derivative. One sentence for each.
std::vector<std::string> channel_guesses(const TimedChannels& file);

}  // namespace sparflow
