/** Reads certificates with all inputs that the verifier needs, from a decision's JSON document or event logs. It
compares digests with the inputs; the verifier checks the mathematics. */
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "records/decision_record.h"
#include "records/log_tasks.h"
#include "records/log_trust.h"
#include "records/run_logs.h"
#include "records/timeline.h"

namespace forereach {

/** Is handed certificates one by one, in the order of the log. */
class CertificateUser {
 public:
  CertificateUser() = default;
  virtual ~CertificateUser() = default;
  CertificateUser(const CertificateUser&) = delete;
  CertificateUser& operator=(const CertificateUser&) = delete;

  /** @param basis what the certificate rests on; null if it cannot be derived (RecordedCertificate::missing). Of what
  it has learned, Certificate::known are places behind the task's own transitions. Its task is that of this run: hold
  the problem, not the task. */
  virtual void OnCertificate(RecordedCertificate&& recorded, const Basis* basis) = 0;
};

/** What a source of certificates has beside them. */
struct BesideCertificates {
  std::int64_t not_certificates = 0;  ///< Abstentions and rejections: nothing to verify.
  PassedOver passed_over;             ///< In logs.
};

/** Reads a decision's document or a log; the first bytes determine which.
@param config_path the task file. It may be empty for a decision, which names its task, and for logs beside which the
logger kept the task (records/log_tasks.h).
@param key for logs: with a key, only authentic messages count.
@throws BadInput if the file is neither, no task is found, or the file or the key cannot be read. */
BesideCertificates ReadCertificates(const std::string& path, const std::string& config_path, const LogKey& key,
                                    CertificateUser& user);

/** The same for one of several runs: nothing if nothing was decided in it. Rows of its database have to say what the
logs say. Memory: that of kPlansTogether plans, the run's learned transitions, and 350 bytes a certificate if there is a
database.
@param is_many whether events are named with their log, and a run without decisions is none to speak of.
@param on_bytes is told of the bytes of each event; may be empty. @throws BadInput as above. */
BesideCertificates ReadRun(const RunLogs& run, const RunTasks& tasks, bool is_many, CertificateUser& user,
                           const std::function<void(std::int64_t)>& on_bytes = {});

/** A decision and its certified plan are found to belong together if no more than so many plans lie between them. */
inline constexpr std::size_t kPlansTogether = 256;

}  // namespace forereach
