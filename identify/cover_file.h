/** The file in which `forereach declare --cover` leaves the proof of its bounds. JSON: `residual` (its name, the range
of each parameter, definitions, and what it adds to each state), `entries` (row, column, bound, cover), `digests`
(residual, cover). A cover is a tree: a leaf is a number, the bound over its box, or null where that lies outside the
domain; else it is [name, at, below, above], the argument that is cut, where, and the two parts. */
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "task/config.h"
#include "verifier/cover_check.h"

namespace forereach {

/** The residual as `forereach declare` shows it. @pre the config has one. */
[[nodiscard]] nlohmann::json ResidualJson(const Config& config);

/** Of all that the bounds depend on: the coordinates' names, the domain, the residual.
@pre the config has a residual. */
[[nodiscard]] Digest ResidualDigest(const Config& config);

/** Of the bounds and every node of their covers. */
[[nodiscard]] Digest CoverDigest(const std::vector<verifier::SlopeClaim>& claims);

/** @throws ConfigError if the file cannot be written. */
void SaveCover(const std::string& path, const Config& config, const std::vector<verifier::SlopeClaim>& claims);

struct CoverFile {
  std::vector<verifier::SlopeClaim> claims;
  std::string residual_digest, cover_digest;  ///< As recorded, in hexadecimal.
};

/** A part that is missing becomes a node that is not there, for the check to find.
@throws ConfigError unless the file is a cover over the coordinates and parameters of this task. */
[[nodiscard]] CoverFile LoadCover(const std::string& path, const Config& config);

/** The names of w = (z, theta). @pre the config has a residual. */
[[nodiscard]] std::vector<std::string> ArgumentNames(const Config& config);

}  // namespace forereach
