/** The latched fault as a message, and its storage.

Watch decides which fault is latched. This class keeps the fault_t that was announced for it, says when it has to be
sent again (a datagram may be lost), and stores it with the contradictions in the latch file, if there is one. While no
fault could be stored it sets Watch::Need::kLatch, so that nothing is certified. No bus, no clock. */
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "certifier/gate/watch.h"
#include "certifier/process/contradictions.h"
#include "certifier/process/latch_file.h"
#include "forereach/fault_t.hpp"

namespace forereach {

class FaultLatch final {
 public:
  static constexpr std::int64_t kRepeatUs = 500'000;

  /** Reads the file: a fault that it holds is latched in `watch`, its contradictions are added. Then writes it back.
  @param watch, contradictions outlive this object. @param file may be null: then nothing is stored. */
  FaultLatch(Watch& watch, Contradictions& contradictions, std::unique_ptr<LatchFile> file);

  /** The fault that `watch` has latched now, complete. Hands it to the kernel, from where it survives the end of this
  process. Flush waits until it is on the disk: call it once the fault has been sent. */
  void Put(const fault_t& fault);
  void Flush();

  /** Puts and flushes what is known, with the fault or without. */
  void Store();
  /** Looks whether the file can still be trusted, and reads it again where not. To be called with every heartbeat. */
  void Check();
  /** Stores that no fault is latched; `watch` is to be reset next. False, and nothing has changed, if a fault is
  latched and this cannot be stored. */
  [[nodiscard]] bool Forget();

  /** True if a fault could be stored now, or nothing has to be. */
  [[nodiscard]] bool ready() const { return !file_ || file_->ready(); }
  /** One sentence; empty if ready. */
  [[nodiscard]] std::string why_not() const { return file_ ? file_->why_not() : ""; }
  /** certifier_status_t's `latch`. */
  [[nodiscard]] std::int16_t status() const;

  /** What was put last. */
  [[nodiscard]] const fault_t& fault() const { return fault_; }
  /** True if a fault is latched and was not sent for kRepeatUs. @param steady_us time of a monotonic clock. */
  [[nodiscard]] bool IsDue(std::int64_t steady_us) const { return watch_.fault() && steady_us >= next_us_; }
  /** It is sent now. */
  void Sent(std::int64_t steady_us) { next_us_ = steady_us + kRepeatUs; }

 private:
  [[nodiscard]] LatchFile::Content Content() const;
  void Open();
  void TakeOver(const LatchFile::Content& stored);
  void TellWatch();

  Watch& watch_;
  Contradictions& contradictions_;
  const std::unique_ptr<LatchFile> file_;
  fault_t fault_{};
  bool is_put_ = false;  // the last Put succeeded
  std::int64_t next_us_ = 0;
};

}  // namespace forereach
