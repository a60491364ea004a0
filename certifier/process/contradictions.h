/** What is known to contradict declarations, and survives what a reload or a reset forgets.

It holds two kinds of evidence:
 - transitions of one model, which this certifier has learned or found in its latch file. They are kept as they were
   recorded, and observed anew under each task (residual/observations.h), whose errors of states, inputs and durations
   say what they show. Two contradict every declaration that allows less than their residuals differ
   (residual/consistency.h), each one every smaller bound on the rates that it shows (certify/rates.h). Under a task
   that would not have learned them they say nothing;
 - digests of declarations that the certifier in charge has reported as contradicted while this one stood by. Its
   heartbeat does not carry the observations.

The declaration in force is the one that was passed to Follow last. No clock, no bus, no file. */
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "certifier/process/latch_file.h"
#include "task/config.h"

namespace forereach {

class Contradictions final {
 public:
  using Evidence = LatchFile::Contradiction;
  static constexpr std::size_t kMostReported = 16;  ///< Of more reported declarations the oldest is forgotten.

  explicit Contradictions(const Config& config) { Follow(config); }

  /** Puts this task's declaration in force. */
  void Follow(const Config& config);

  /** Adds evidence. What is known already is not added again. Cost: two evaluations of the
  model. */
  void Add(Evidence one);
  void AddReported(const Digest& model, const Digest& declaration);

  /** Whether any evidence contradicts the declaration of this task, or that in force. */
  [[nodiscard]] bool Contradict(const Config& config) const;
  [[nodiscard]] bool ContradictInForce() const { return contradict_in_force_; }
  /** Whether the declaration of this task was reported as contradicted. */
  [[nodiscard]] bool WasReported(const Config& config) const;

  [[nodiscard]] const std::vector<Evidence>& evidence() const { return evidence_; }

 private:
  std::vector<Evidence> evidence_;                   // at most one for each version of the task
  std::vector<std::pair<Digest, Digest>> reported_;  // model, declaration
  Digest model_{}, declaration_digest_{};            // in force
  std::shared_ptr<const Problem> problem_;           // in force
  bool is_any_ = false;                              // as for CountedDuration, in force
  bool contradict_in_force_ = false;
};

}  // namespace forereach
