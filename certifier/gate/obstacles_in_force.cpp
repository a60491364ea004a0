#include "certifier/gate/obstacles_in_force.h"

#include <stdexcept>
#include <utility>

#include "certifier/gate/obstacle_message.h"
#include "certifier/task/canonical.h"

namespace forereach {

ObstaclesInForce::ObstaclesInForce(std::vector<Obstacle> of_task, int dim) : dim_(dim) { Put(std::move(of_task)); }

std::string ObstaclesInForce::Update(const obstacles_t& message) {
  if (message.sequence <= sequence_ && message.utime <= utime_)
    return "sequence " + std::to_string(message.sequence) + " does not exceed the last, " + std::to_string(sequence_) +
           ", nor does its stamp the last one's";
  try {
    heard_ = FromMessage(message, dim_);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  Put(heard_);
  has_heard_ = true;
  sequence_ = message.sequence;
  utime_ = message.utime;
  return {};
}

void ObstaclesInForce::Inherit(const ObstaclesInForce& before) {
  if (!before.has_heard_) return;
  heard_ = before.heard_;
  has_heard_ = true;
  sequence_ = before.sequence_;
  utime_ = before.utime_;
  std::vector<Obstacle> both = all_;
  both.insert(both.end(), heard_.begin(), heard_.end());
  Put(std::move(both));
}

void ObstaclesInForce::Put(std::vector<Obstacle> all) {
  all_ = std::move(all);
  digest_ = ObstaclesDigest(all_);
}

}  // namespace forereach
