#include "certifier/gate/obstacles_in_force.h"

#include <stdexcept>
#include <utility>

#include "certifier/gate/obstacle_message.h"
#include "certifier/gate/stamp.h"
#include "certifier/task/canonical.h"
#include "forereach/obstacles_t.hpp"

namespace forereach {

ObstaclesInForce::ObstaclesInForce(const Config& config)
    : options_(config.gate), dim_(static_cast<int>(config.problem->projection.rows())) {
  Put(config.obstacles);
}

std::string ObstaclesInForce::Update(Bytes bytes, std::int64_t now_us) {
  const auto message = Decoded<obstacles_t>(bytes);
  if (!message) return "not an obstacles_t of " + std::to_string(EncodedSize<obstacles_t>()) + " bytes";
  if (std::string fault = Judge(message->utime, now_us, options_).fault; !fault.empty()) return fault;
  if (heard_ && message->sequence <= heard_->sequence && IsNotAfter(message->utime, heard_->utime, now_us, options_))
    return "sequence " + std::to_string(message->sequence) + " does not exceed the last, " +
           std::to_string(heard_->sequence) + ", nor does its stamp the last one's";
  try {
    heard_ = Heard{message->sequence, message->utime, FromMessage(*message, dim_)};
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  Put(heard_->obstacles);
  return {};
}

void ObstaclesInForce::Inherit(const ObstaclesInForce& before) {
  if (!before.heard_) return;
  heard_ = before.heard_;
  std::vector<Obstacle> both = all_;
  both.insert(both.end(), heard_->obstacles.begin(), heard_->obstacles.end());
  Put(std::move(both));
}

void ObstaclesInForce::Put(std::vector<Obstacle> all) {
  all_ = std::move(all);
  digest_ = ObstaclesDigest(all_);
}

}  // namespace forereach
