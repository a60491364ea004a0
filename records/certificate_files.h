/** Reads certificates with all inputs that the verifier needs, from a decision's JSON document, event logs or a
decision database. It compares digests with the inputs; the verifier checks the mathematics. */
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "records/decision_record.h"
#include "records/log_tasks.h"
#include "records/log_trust.h"
#include "records/run_logs.h"
#include "task/config.h"

namespace forereach {

struct CertificateFile {
  Config config;
  std::vector<RecordedCertificate> certificates;
  bool of_decision = false;          ///< Read from a decision's document, not from logs.
  std::size_t not_certificates = 0;  ///< Abstentions and rejections: nothing to verify.
  PassedOver passed_over;            ///< In logs.
};

/** Reads a document, a log, a database or a directory (RunsNamedBy); the first bytes determine which. Certificates of a
run are grouped by their tasks.
@param config_path the task file. It may be empty for a decision, which names its task, and for logs beside which the
logger kept the task (records/log_tasks.h).
@param key for logs: with a key, only authentic messages count.
@return at least one.
@throws BadInput if the file is none of the three, no task is found, or the file or the key cannot be read. */
[[nodiscard]] std::vector<CertificateFile> ReadAllCertificates(const std::string& path, const std::string& config_path,
                                                               const LogKey& key = {});

/** The same for one of several runs: nothing if nothing was decided in it. Rows of its database have to say what the
logs say. @param is_many whether events are named with their log, and a run without decisions is none to speak of.
@throws BadInput as above. */
[[nodiscard]] std::vector<CertificateFile> ReadRun(const RunLogs& run, const RunTasks& tasks, bool is_many);

/** The same for consecutive event logs, the files of one run. @throws BadInput as above. */
[[nodiscard]] std::vector<CertificateFile> ReadAllLogs(const std::vector<std::string>& logs,
                                                       const std::string& config_path, const LogKey& key = {});

}  // namespace forereach
