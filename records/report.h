/** The output of `forereach report` for a recorded run: its numbers, and a picture with recomputed tubes. */
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "certifier/task/config.h"
#include "records/picture.h"
#include "records/summary.h"

namespace forereach {

/** A picture of a log, and how far the tubes in it can be trusted. */
struct LogPicture {
  Picture picture;
  /** Plans whose outcome or step under `config` is not the recorded one; their tubes are left out. */
  int disagreements = 0;
};

/** Certifies the candidates of logs that follow one another again, under the task and the obstacles in force when each
was decided, and collects what there is to draw: the tubes of certified plans and of abstentions S, the measured path,
stops, goal, obstacles at the end. Without title and key numbers. Plans under other tasks are left out and counted.
Cost: one certify call a plan.
@param tasks at least one; path, goal and obstacles are those of the last. With one alone, decisions of any config
digest count as its own. @throws LogError if a log cannot be read, PictureError if a task's safety coordinates are not
planar.
*/
[[nodiscard]] LogPicture PictureFromLogs(const std::vector<std::string>& logs, const std::vector<Config>& tasks);

struct ReportOptions {
  std::vector<std::string> logs;  ///< Files of one run, in their order.
  std::string config;             ///< Task file; empty: the tasks that were kept beside the logs.
  std::string picture;            ///< As PictureFiles takes it; none if empty.
  bool json = false;
  int width = 1200, height = 800;  ///< Pixels.
  LogKey key = {};                 ///< With a key only authentic messages count.
};

/** Prints the summary of logs to `out`, as text or as one JSON document, and writes its picture.
@throws BadInput; nothing has been printed then. */
void Report(const ReportOptions& options, std::ostream& out);

}  // namespace forereach
