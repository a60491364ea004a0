#include "records/log_trust.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace forereach {

void LogKey::Override(BusOptions& options) const {
  if (none || !file.empty()) options.key = file;
}

void LogKey::Override(Config& task, const std::string& given) const {
  if (!task.bus.key.empty() && task.path != given && file.empty() && !none)
    throw ConfigError(
        "{}: the task has a key, bus.key, and keys are not kept: name it with --key FILE, or believe every "
        "message with --no-key",
        task.path);
  Override(task.bus);
}

std::string DescribePassedOver(const PassedOver& passed_over) {
  const std::string refused = DescribeRefusals(passed_over.not_authentic);
  std::string text;
  if (!refused.empty()) text += fmt::format("; not authentic and passed over: {}", refused);
  if (passed_over.undecodable > 0)
    text += fmt::format("; no certified plan and passed over: {}", passed_over.undecodable);
  return text;
}

nlohmann::json ToJson(const Refusals& refused) {
  return {{"unsigned", refused.unsigned_ones}, {"forged", refused.forged},
          {"replayed", refused.replayed},      {"signed_before_the_start", refused.old},
          {"signed_ahead", refused.ahead},     {"of_another_bus", refused.foreign}};
}

nlohmann::json ToJson(const PassedOver& passed_over) {
  return {{"not_authentic", ToJson(passed_over.not_authentic)}, {"undecodable", passed_over.undecodable}};
}

bool LogAuthenticator::IsAuthentic(const LogEvent& event) {
  if (!keys_ || !speakers_.contains(event.channel)) return true;
  if (!authenticator_)
    authenticator_.emplace(*keys_, channels_.name.empty() ? std::nullopt : std::optional(channels_.name), speakers_,
                           std::nullopt);
  return authenticator_->Check(event.channel, event.data, event.utime).first == Authenticity::kAuthentic;
}

}  // namespace forereach
