/** Reads a decision's JSON document. The reader is strict: the document has exactly the keys of
docs/decision.md. */
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "task/config.h"
#include "verifier/verifier.h"

namespace forereach {

/** A mismatch between a recorded and the required value. */
struct Mismatch {
  std::string what, expected, found;
};

/** The possible beginnings of Mismatch::what. */
inline constexpr const char* kAltered = "the record was altered after it was made: ";
inline constexpr const char* kOtherInput = "another input than the certificate was made of: ";

struct RecordedCertificate {
  std::string name;                  ///< Identifies the certificate to people.
  std::vector<Mismatch> mismatches;  ///< Digests that do not match: the record or its inputs were altered.
  std::string missing;               ///< The reason why the certificate cannot be derived; empty if it can.
  verifier::Certificate certificate;

  void Compare(const std::string& what, const std::string& expected, const std::string& found) {
    if (expected != found) mismatches.push_back({what, expected, found});
  }
};

/** The areas to stay in of a task, for the verifier. */
[[nodiscard]] std::vector<verifier::StayIn> StayInOf(const Config& config);

/** The distances to be kept that a certifier may name for an obstacle in unit t of a plan (certify/safety.h), metres:
that of each part of the body, then that of the whole body. @pre the certifier accepts the problem. */
[[nodiscard]] std::vector<double> ThresholdsOf(const Problem& problem, const Obstacle& obstacle,
                                               const Schedule& schedule, int t);

/** The task file that a document names: its absolute path if that file exists, otherwise the path as it was given.
@throws ConfigError with file and field. */
[[nodiscard]] std::string TaskOf(const std::string& path, const nlohmann::json& document);

/** Whether a document's outcome is `certified`. @throws ConfigError with file and field for an unknown outcome. */
[[nodiscard]] bool IsCertificate(const std::string& path, const nlohmann::json& document);

/** Reads the certificate in a document. @pre IsCertificate. @throws ConfigError with file and field if a field is
missing, unknown, or has the wrong type or size. */
[[nodiscard]] RecordedCertificate ReadCertificate(const std::string& path, const nlohmann::json& document,
                                                  const Config& config);

}  // namespace forereach
