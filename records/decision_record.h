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

/** How the name of a mismatch begins. */
inline constexpr const char* kAltered = "the record was altered after it was made: ";
inline constexpr const char* kOtherInput = "another input than the certificate was made of: ";

struct RecordedCertificate {
  std::string name;                  ///< Which one, for a person.
  std::vector<Mismatch> mismatches;  ///< Digests and the like that are wrong; the record was altered, or its inputs.
  std::string missing;               ///< Why there is nothing to derive, or empty.
  verifier::Certificate certificate;

  void Compare(const std::string& what, const std::string& expected, const std::string& found) {
    if (expected != found) mismatches.push_back({what, expected, found});
  }
};

/** The task file that a document names: its absolute path where there is such a file, else the path as it was given.
@throws ConfigError naming file and field. */
[[nodiscard]] std::string TaskOf(const std::string& path, const nlohmann::json& document);

/** @throws ConfigError naming file and field unless the outcome is one there is. */
[[nodiscard]] bool IsCertificate(const std::string& path, const nlohmann::json& document);

/** @pre IsCertificate. @throws ConfigError naming file and field if one is missing, unknown, or not of its type or
size. */
[[nodiscard]] RecordedCertificate ReadCertificate(const std::string& path, const nlohmann::json& document,
                                                  const Config& config);

}  // namespace forereach
