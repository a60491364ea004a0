/** The digests of a task's data. Each is the BLAKE2b-256 of a canonical byte string, so the order of columns, white
space and the spelling of numbers do not change it.

The string is a sequence of items, all little-endian. A text is its length and its bytes; a count or length has 8 bytes;
a number is the 8 bytes of the double, with 0 for -0. Each string begins with a text that names its kind. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "forereach/certify/problem.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/grounds.h"

namespace forereach {

class CanonicalBytes final {
 public:
  explicit CanonicalBytes(std::string_view kind) { Text(kind); }

  void Text(std::string_view text);
  void Texts(const std::vector<std::string>& texts);
  void Count(std::int64_t count);
  void Number(double value);
  /** Rows, columns, and the entries row by row. */
  void Numbers(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

  [[nodiscard]] Digest digest() const { return DigestOf(std::string_view(bytes_)); }

 private:
  std::string bytes_;
};

/** Of the bytes of a task file, and those of the model file that it includes; without one, `model` is empty. */
[[nodiscard]] Digest TaskDigest(std::string_view task, std::string_view model);

/** Of the model's description and its coordinates' names. */
[[nodiscard]] Digest ModelDigest(const NominalModel& model);

/** Of the coordinates' names, L and sigma. */
[[nodiscard]] Digest DeclarationDigest(const NominalModel& model, const Declaration& declaration);

/** Of the coordinates' names and the transitions in their order, which a decision's witness refers to. */
[[nodiscard]] Digest ObservationsDigest(const NominalModel& model, const Transitions& transitions);

/** Of the obstacles with their names, which a decision's sentence has, in their order, which its witness refers to. */
[[nodiscard]] Digest ObstaclesDigest(const std::vector<Obstacle>& obstacles);

/** Of a task with these, before anything is heard or learned. `config` is its TaskDigest. */
[[nodiscard]] Grounds GroundsOf(const Digest& config, const Problem& problem, const std::vector<Obstacle>& obstacles);

}  // namespace forereach
