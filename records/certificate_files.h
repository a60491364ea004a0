/** Reads certificates with all inputs that the verifier needs, from a decision's JSON document, event logs or a
decision database. It compares digests with the inputs; the verifier checks the mathematics. */
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
  bool of_decision = false;          ///< Read from a decision's document, not from logs.
  std::size_t not_certificates = 0;  ///< Abstentions and rejections: nothing to verify.
  PassedOver passed_over;            ///< In logs.
};

/** Reads a document, a log or a database; the first bytes determine which. For a directory it reads the database in it.
Certificates of logs and databases are grouped by their tasks.
@param config_path the task file. It may be empty for a decision, which names its task, and for logs beside which the
logger kept the task (records/log_tasks.h).
@param key for logs: with a key, only authentic messages count.
@return at least one.
@throws BadInput if the file is none of the three, no task is found, or the file or the key cannot be read. */
[[nodiscard]] std::vector<CertificateFile> ReadAllCertificates(const std::string& path, const std::string& config_path,
                                                               const LogKey& key = {});

/** The same for consecutive event logs, the files of one run. @throws BadInput as above. */
[[nodiscard]] std::vector<CertificateFile> ReadAllLogs(const std::vector<std::string>& logs,
                                                       const std::string& config_path, const LogKey& key = {});

}  // namespace forereach
