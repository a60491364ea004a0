/** The certificates in a decision's JSON document, an event log or a decision database, with what they were made of:
all that the verifier needs. Digests are held against the inputs here; the mathematics is the verifier's. */
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "certifier/task/config.h"
#include "records/decision_record.h"
#include "records/log_trust.h"

namespace forereach {

struct CertificateFile {
  Config config;
  std::vector<RecordedCertificate> certificates;
  bool of_decision = false;          ///< Of one decision's document, not of logs.
  std::size_t not_certificates = 0;  ///< Abstentions and rejections: nothing to verify.
  PassedOver passed_over;            ///< In logs.
};

/** Reads any of the three; which one it is, is told from its first bytes. A directory stands for the decision database
in it. Certificates of a log or a database are grouped by the task they were made with.
@param config_path the task; may be empty for a decision, which names its own, and for logs beside which the logger kept
it (records/log_tasks.h).
@param key for logs, of which only authentic messages count where there is one.
@return at least one.
@throws BadInput if the file is none of the three, no task is found, or if it or the key cannot be read. */
[[nodiscard]] std::vector<CertificateFile> ReadAllCertificates(const std::string& path, const std::string& config_path,
                                                               const LogKey& key = {});

/** Of event logs that follow one another, as the files of one run do. @throws BadInput likewise. */
[[nodiscard]] std::vector<CertificateFile> ReadAllLogs(const std::vector<std::string>& logs,
                                                       const std::string& config_path, const LogKey& key = {});

}  // namespace forereach
