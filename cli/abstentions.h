/** Recorded abstentions with everything that they were judged by, for `forereach advise`. */
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "advise/case.h"
#include "certifier/task/config.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "records/log_trust.h"

namespace forereach {

struct RecordedAbstention {
  std::string name;                     ///< Identifies it to people.
  std::string message;                  ///< The recorded sentence.
  std::int16_t outcome = 0, cause = 0;  ///< As in decision_t.
  const Config* task = nullptr;
  /** What it was judged by. No problem: it was answered without a judgement. */
  Case judged;
  std::string missing;  ///< Why it cannot be judged again; empty if it can, or was never judged.
  /** How many candidates of the log waited when it was answered, with itself. */
  std::size_t waiting = 0;
  /** The last message on the channel of obstacles before the answer, and when it arrived; null if there was none. */
  std::shared_ptr<const std::pair<std::vector<std::uint8_t>, std::int64_t>> last_obstacles;
  decision_t decision{};         ///< Zeros if it was read from a decision's document.
  candidate_plan_t candidate{};  ///< Zeros likewise.
};

struct Abstentions {
  std::vector<std::shared_ptr<const Config>> tasks;
  std::vector<RecordedAbstention> all;  ///< Abstentions and rejections, in the order of the log.
  std::int64_t certified = 0;
  PassedOver passed_over{};
  std::vector<std::string> missing{};  ///< Logs and runs that could not be read, with the reason.
};

/** Reads a decision's document, or the runs that the files name (RunsNamedBy), with the robot's name in the name of
each abstention if there are several.
@param config the task file; empty: the one that the document names, or that the logger kept next to the logs.
@throws BadInput as ReadAllCertificates does; ConfigError with file and field for a document that is no decision. */
[[nodiscard]] Abstentions ReadAbstentions(const std::vector<std::string>& files, const std::string& config,
                                          const LogKey& key, unsigned jobs);

}  // namespace forereach
