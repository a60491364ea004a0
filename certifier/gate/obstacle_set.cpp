#include "certifier/gate/obstacle_set.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "task/most_obstacles.h"

namespace forereach {
namespace {

void RequireWithin(const char* what, int value, int least, int most) {
  if (value < least || value > most)
    throw std::invalid_argument(fmt::format("{}: {}, must be {} to {}", what, value, least, most));
}

void RequirePart(const obstacles_t& message) {
  // Sizes first: the parts are allocated by what a message claims.
  RequireWithin("set_size", message.set_size, kMaxObstacles + 1, kMostObstacles);
  RequireWithin("first", message.first, 0, message.set_size - 1);
  if (message.first % kMaxObstacles != 0)
    throw std::invalid_argument(fmt::format("first: {}, must be a multiple of {}", message.first, kMaxObstacles));
  const int expected = std::min(kMaxObstacles, message.set_size - message.first);
  RequireWithin("obstacles", message.num_obstacles, expected, expected);
}

}  // namespace

ObstaclePart::ObstaclePart(std::span<const obstacle_t> all) : obstacles(all.begin(), all.end()) {
  static const int size = obstacle_t{}._getEncodedSizeNoHash();
  std::vector<std::uint8_t> bytes(ToSize(size) * obstacles.size());
  int at = 0;
  for (const obstacle_t& obstacle : obstacles)
    at += obstacle._encodeNoHash(bytes.data(), at, static_cast<int>(bytes.size()) - at);
  digest = DigestOf(Bytes(bytes));
}

Digest SetDigestOf(std::span<const Digest> parts) {
  std::vector<std::uint8_t> bytes;
  for (const Digest& part : parts) bytes.insert(bytes.end(), part.begin(), part.end());
  return DigestOf(Bytes(bytes));
}

ObstacleSet::Known ObstacleSet::Take(const obstacles_t& message) {
  RequireWithin("obstacles", message.num_obstacles, 0, kMaxObstacles);
  if (message.set_size != 0) return TakePart(message);
  RequireWithin("first", message.first, 0, 0);
  *this = {};
  parts_ = {std::make_shared<const ObstaclePart>(std::span(message.obstacle, ToSize(message.num_obstacles)))};
  return Known::kNew;
}

ObstacleSet::Known ObstacleSet::TakePart(const obstacles_t& message) {
  RequirePart(message);
  // Parts of another size are of another set. No mixture of both is ever complete, for the digest is of all parts.
  if (message.set_size != std::exchange(size_, message.set_size)) {
    const int count = (size_ + kMaxObstacles - 1) / kMaxObstacles;
    parts_.assign(ToSize(count), nullptr);
    complete_.reset();
  }
  auto& part = parts_[ToSize(message.first / kMaxObstacles)];
  ObstaclePart heard(std::span(message.obstacle, ToSize(message.num_obstacles)));
  if (!part || part->digest != heard.digest) part = std::make_shared<const ObstaclePart>(std::move(heard));
  std::vector<Digest> digests;
  for (const auto& each : parts_)
    if (each) digests.push_back(each->digest);
  const Digest digest = SetDigestOf(digests);
  // The sender's digest of the whole set: parts of two versions never make a set, whatever is lost between them.
  is_partial_ = digests.size() < parts_.size() || digest != GetDigest(message.set_digest);
  if (is_partial_) return Known::kPart;
  return std::exchange(complete_, digest) == digest ? Known::kSame : Known::kNew;
}

std::vector<obstacle_t> ObstacleSet::obstacles() const {
  std::vector<obstacle_t> all;
  for (const auto& part : parts_) all.insert(all.end(), part->obstacles.begin(), part->obstacles.end());
  return all;
}

std::string ObstacleSet::WhyPartial() const {
  if (!is_partial_) return {};
  const auto heard = std::ranges::count_if(parts_, [](const auto& part) { return part != nullptr; });
  if (heard == std::ssize(parts_))
    return fmt::format("not all parts of their set of {} have been heard since it changed", size_);
  return fmt::format("{} of the {} parts of their set of {} have been heard", heard, parts_.size(), size_);
}

}  // namespace forereach
