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

/** All certificates of a file of one task, and the task with what was learned. */
struct CertificateFile : BesideCertificates {
  Config config;
  std::vector<RecordedCertificate> certificates;
};

struct CertificateCollector final : CertificateUser {
  void OnCertificate(RecordedCertificate&& recorded, const Basis* basis) override {
    file.certificates.push_back(std::move(recorded));
    if (!basis) return;
    file.config = *basis->task;
    if (basis->learned)
      file.config.problem = WithLearned(basis->task->problem, *basis->learned, basis->learned->size());
  }
  CertificateFile file;
};

inline CertificateFile ReadCertificates(const std::string& path, const std::string& config_path,
                                        const LogKey& key = {}) {
  CertificateCollector collector;
  static_cast<BesideCertificates&>(collector.file) = ReadCertificates(path, config_path, key, collector);
  return std::move(collector.file);
}
/** Of one run. */
inline CertificateFile ReadLogs(const std::vector<std::string>& logs, const std::string& config_path) {
  CertificateCollector collector;
  static_cast<BesideCertificates&>(collector.file) = ReadRun({.robot = "", .logs = logs, .database = "", .missing = {}},
                                                             RunTasks(config_path, {}, false), false, collector);
  return std::move(collector.file);
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
