/** The state that survives the end of a certifier: the latched fault, and the transitions that contradict a
declaration.

One file, latch.json, in a directory that belongs to one robot, locked while a certifier lives. The file always has the
same size and is rewritten in place, so a disk that is full later still takes a fault. It is JSON with a digest of its
content, so an interrupted write and any other damage is noticed. Content that is not known to be "no fault" is not
taken for it. Then, and where the file cannot be written, ready() is false and the certifier does not certify.

A file that does not exist holds nothing: a person may delete it. No other damage is mended by this class. */
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "forereach/fault_t.hpp"
#include "forereach/residual/transitions.h"
#include "lcmtypes/codec.h"

namespace forereach {

class LatchFile final {
 public:
  static constexpr const char* kName = "latch.json";
  static constexpr std::size_t kBytes = 65536;
  static constexpr std::size_t kMostContradictions = 16;  ///< As many fit, with the largest model.

  /** Two transitions that contradict a declaration of that model, or one that contradicts a declared rate, as they were
  recorded (Certifier::Contradiction): what they show depends on what is declared of their errors. */
  struct Contradiction {
    Digest model;
    Transitions rows;
  };
  struct Content {
    std::optional<fault_t> fault;
    std::string why;  ///< The fault's sentence, which its message may have cut.
    std::vector<Contradiction> contradictions;
  };

  /** Makes the directory if it does not exist, and locks it. why_not() reports every other error.
  @throws BadInput if another process holds the lock. */
  explicit LatchFile(std::string directory);
  ~LatchFile();
  LatchFile(const LatchFile&) = delete;
  LatchFile& operator=(const LatchFile&) = delete;

  /** Opens and reads the file. Nothing, and why_not() says why, if it exists and cannot be trusted. What was read
  counts even if it cannot be written. Not ready until Put and Flush have succeeded after it. */
  [[nodiscard]] std::optional<Content> Read();

  /** Hands the content to the kernel, from where it survives the end of the process; makes the file where there is
  none. Flush waits until it is on the disk. False, and why_not() says why, if that failed or Read has not succeeded. If
  a fault cannot be written over "no fault", the file is emptied, where that is possible: an empty file counts as
  damaged. */
  bool Put(const Content& content);
  bool Flush();

  /** Looks whether the file is still the one in the directory, and on a disk that may be written. Costs three system
  calls. */
  void Look();

  /** True from the last Flush that succeeded until something fails. */
  [[nodiscard]] bool ready() const { return ready_; }
  /** One sentence; empty if ready. */
  [[nodiscard]] const std::string& why_not() const { return why_; }
  [[nodiscard]] std::string path() const { return directory_ + "/" + kName; }

 private:
  [[nodiscard]] bool OpenDirectory();
  [[nodiscard]] std::optional<Content> ReadFrom(int file);
  [[nodiscard]] bool Create(const std::string& text);
  bool Fail(const std::string& why);       // false
  bool FailedTo(const std::string& what);  // the same; errno says why
  void CloseFile();

  const std::string directory_;
  int lock_ = -1, file_ = -1;  // the directory, and the file in it
  bool may_write_ = false;     // Read has found nothing that has to be kept
  bool ready_ = false;
  bool holds_fault_ = false;  // as far as is known
  bool emptied_ = false;      // by Put
  std::string why_;
};

}  // namespace forereach
