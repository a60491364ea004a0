#include "records/record_reader.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "forereach/decision_t.hpp"
#include "lcmtypes/candidate_batch.h"
#include "records/message_json.h"

namespace forereach {

RecordReader::RecordReader(const BusOptions& channels, RecordUser& user, std::function<void(std::int64_t)> on_bytes)
    : channels_(channels),
      user_(user),
      on_bytes_(std::move(on_bytes)),
      authenticator_(channels_, PublicKeysOf(channels_)) {}

void RecordReader::Read(const std::vector<std::string>& logs) {
  for (const std::string& log : logs) {
    const std::string log_file = std::filesystem::path(log).filename().string();
    if (interpreter_)
      interpreter_->Continue(log_file);
    else
      interpreter_.emplace(channels_, log_file);
    EventLogReader reader(log);
    ForEachEvent(reader, [&](const LogEvent& event) {
      Take(event, log_file);
      if (on_bytes_) on_bytes_(RecordBytes(event));
    });
    damage_ += reader.damage();
  }
}

void RecordReader::Take(const LogEvent& event, const std::string& log_file) {
  if (!authenticator_.IsAuthentic(event)) return;
  has_messages_ = has_messages_ || Summarize(event.message());
  user_.OnMessage(event);
  const auto reference = [&] { return LogReference{log_file, event.number, ToHex(DigestOf(event))}; };
  if (event.channel == channels_.candidate) {
    candidates_.Add(KeyOfCandidates(event.message()), {event.message().begin(), event.message().end()});
  } else if (event.channel == channels_.certified) {
    if (const auto certified = Decoded<certified_plan_t>(event.message()))
      user_.OnCertified(*certified, reference());
    else
      ++undecodable_;
  } else if (event.channel == channels_.withdrawn) {
    TakeWithdrawal(event, log_file);
  }
  Rows rows;
  interpreter_->Observe(event, rows);
  for (const GapRow& gap : rows.gaps) user_.OnGap(gap);
  for (const EventRow& execution : rows.events) user_.OnExecution(execution);
  if (rows.decisions.empty()) return;
  const auto decision = Decoded<decision_t>(event.message());
  const PlanKeys keys(*decision);
  const auto message = candidates_.Take(keys);
  const auto candidate = message ? Decoded<candidate_plan_t>(CandidateIn(*message, keys.plan)) : std::nullopt;
  user_.OnDecision(rows.decisions.front(), candidate ? &*candidate : nullptr);
}

void RecordReader::TakeWithdrawal(const LogEvent& event, const std::string& log_file) {
  const auto withdrawal = Decoded<withdrawal_t>(event.message());
  if (!withdrawal || !withdrawals_.IsFirst(*withdrawal)) return;
  user_.OnWithdrawn(*withdrawal, {log_file, event.number, ToHex(DigestOf(event))});
}

}  // namespace forereach
