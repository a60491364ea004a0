/** What tests of recorded certificates share. */
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "forereach/certified_plan_t.hpp"
#include "lcmtypes/codec.h"
#include "records/certificate_files.h"
#include "records/event_log.h"

namespace forereach {

/** The certificates of the first task. */
inline CertificateFile ReadCertificates(const std::string& path, const std::string& config_path,
                                        const LogKey& key = {}) {
  return std::move(ReadAllCertificates(path, config_path, key).front());
}
inline CertificateFile ReadLogs(const std::vector<std::string>& logs, const std::string& config_path,
                                const LogKey& key = {}) {
  return std::move(ReadAllLogs(logs, config_path, key).front());
}

/** The first candidate of an unsigned log that was certified; zeros if none was. */
inline candidate_plan_t FirstCertified(const std::string& log) {
  EventLogReader reader(log);
  LogEvent event;
  while (reader.Next(event) == LogStatus::kEvent)
    if (const auto certified = Decoded<certified_plan_t>(event.data)) return certified->plan;
  return {};
}

}  // namespace forereach
