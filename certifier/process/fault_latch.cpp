#include "certifier/process/fault_latch.h"

#include <utility>

#include <fmt/core.h>

#include "bus/log.h"
#include "forereach/certifier_status_t.hpp"
#include "lcmtypes/names.h"

namespace forereach {

FaultLatch::FaultLatch(Watch& watch, Contradictions& contradictions, std::unique_ptr<LatchFile> file)
    : watch_(watch), contradictions_(contradictions), file_(std::move(file)) {
  if (file_) Open();
}

void FaultLatch::Put(const fault_t& fault) {
  fault_ = fault;
  is_put_ = file_ && file_->Put(Content());
}

void FaultLatch::Flush() {
  if (is_put_) file_->Flush();
  TellWatch();
}

LatchFile::Content FaultLatch::Content() const {
  LatchFile::Content content{std::nullopt, "", contradictions_.evidence()};
  if (watch_.fault()) content.fault = fault_, content.why = watch_.fault()->why;
  return content;
}

void FaultLatch::Open() {
  if (const auto stored = file_->Read()) TakeOver(*stored);
  Store();
}

void FaultLatch::Store() {
  if (file_ && file_->Put(Content())) file_->Flush();
  TellWatch();
}

void FaultLatch::TellWatch() {
  if (!file_) return;
  const bool could = watch_.Lacks(Watch::Need::kLatch).empty();
  watch_.Set(Watch::Need::kLatch, file_->ready() ? "" : fmt::format("no fault could be stored: {}", file_->why_not()));
  if (could && !file_->ready()) logging::Error("nothing is certified: no fault could be stored: {}", file_->why_not());
  if (!could && file_->ready()) logging::Info("{} can be written", file_->path());
}

void FaultLatch::TakeOver(const LatchFile::Content& stored) {
  for (const LatchFile::Contradiction& one : stored.contradictions) contradictions_.Add(one);
  if (contradictions_.ContradictInForce())
    logging::Error("a transition from before this start contradicts the declaration: every candidate is F");
  if (!stored.fault || !watch_.Latch({stored.fault->cause, stored.fault->utime, stored.why})) return;
  fault_ = *stored.fault;
  // Sent with the first heartbeat, for the robot that has heard nothing of it from this process.
  next_us_ = 0;
  logging::Error("fault {} from before this start: {}; nothing is certified. What to do: {}",
                 FaultName(stored.fault->cause), stored.why, FaultAdvice(stored.fault->cause));
}

void FaultLatch::Check() {
  if (!file_) return;
  if (file_->ready()) file_->Look();
  if (!file_->ready()) Open();
  TellWatch();
}

bool FaultLatch::Forget() {
  if (!file_ || !watch_.fault()) return true;
  if (!file_->ready()) Open();
  // On the disk before the watch forgets it: a fault that an operator has not cleared comes back after a restart.
  const bool is_forgotten =
      file_->ready() && file_->Put({std::nullopt, "", contradictions_.evidence()}) && file_->Flush();
  TellWatch();
  return is_forgotten;
}

std::int16_t FaultLatch::status() const {
  if (!ready()) return certifier_status_t::LATCH_UNWRITABLE;
  return file_ && watch_.fault() ? certifier_status_t::LATCH_WRITTEN : certifier_status_t::LATCH_NONE;
}

}  // namespace forereach
