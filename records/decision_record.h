/** Reads a decision's JSON document. The reader is strict: the document has exactly the keys of docs/decision.md.
 */
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "certifier/task/config.h"
#include "verifier/verifier.h"

namespace forereach {

/** A mismatch between a recorded and the required value. */
struct Mismatch {
  std::string what, expected, found;
};

/** A certificate as a document has it: what the verifier derives anew, and where the document contradicts itself or its
task. */
struct DecisionRecord {
  verifier::Certificate certificate;
  std::vector<Mismatch> mismatches;
};

/** The task file that a document names: its absolute path where there is such a file, else the path as it was given.
@throws ConfigError naming file and field. */
[[nodiscard]] std::string TaskOf(const std::string& path, const nlohmann::json& document);

/** @throws ConfigError naming file and field unless the outcome is one there is. */
[[nodiscard]] bool IsCertificate(const std::string& path, const nlohmann::json& document);

/** @pre IsCertificate. @throws ConfigError naming file and field if one is missing, unknown, or not of its type or
size. */
[[nodiscard]] DecisionRecord ReadCertificate(const std::string& path, const nlohmann::json& document,
                                             const Config& config);

}  // namespace forereach
