/** The output of `forereach report` for a recorded run: its numbers, and a picture with recomputed tubes. */
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "records/picture.h"
#include "records/summary.h"
#include "task/config.h"

namespace forereach {

/** A picture of a log, and the number of plans that are not in it. */
struct LogPicture {
  Picture picture;
  /** Plans whose recomputed outcome or step differs from the recorded one. Their tubes are not drawn. */
  int disagreements = 0;
  /** Tubes of certificates, and of abstentions, that are not drawn since so many of their kind follow, or too many
  obstacles (kept_obstacles.h). */
  static constexpr std::size_t kMostTubes = 750;
  std::int64_t earlier = 0;
};

/** Certifies the candidates of consecutive logs again, under the obstacles of their decisions. The picture has the
tubes of the last certified plans and abstentions S, the measured path, stops, goal, and the obstacles at the end; it
has no title and no key numbers. Cost: one certify call for each plan that is drawn.
@param task decisions of any config digest count as its.
@throws LogError if a log cannot be read, PictureError if the task's safety coordinates are not planar. */
[[nodiscard]] LogPicture PictureFromLogs(const std::vector<std::string>& logs, const Config& task);

struct ReportOptions {
  std::vector<std::string> logs;  ///< Logs, a database or a directory of one run (RunsNamedBy).
  std::string config;             ///< Task file. If empty, the tasks that were kept beside the logs.
  std::string picture;            ///< A name for PictureFiles; no picture if empty.
  bool json = false;
  LogKey key = {};  ///< With a key only authentic messages count.
};

/** Prints the summary of logs to `out`, as text or as one JSON document, and writes the picture: under the tasks and
the obstacles of their decisions. Plans of other tasks are not drawn, but counted. Cost: the logs are read once.
@return whether all of the logs could be read. @throws BadInput, before anything is printed. */
[[nodiscard]] bool Report(const ReportOptions& options, std::ostream& out);

}  // namespace forereach
