#include "certifier/process/latch_file.h"

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include "forereach/numerics/limits.h"
#include "forereach/residual/declaration.h"
#include "lcmtypes/bad_input.h"
#include "task/files.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

constexpr const char* kFormat = "forereach latch";
constexpr int kVersion = 1;
constexpr const char* kNewName = "latch.json.new";

bool IsSameFile(const struct stat& a, const struct stat& b) { return a.st_dev == b.st_dev && a.st_ino == b.st_ino; }

// ---- The content as JSON. Strings may hold any bytes; numbers come back to the last bit.

Json ToJson(const Eigen::MatrixXd& rows) {
  Json lists = Json::array();
  for (const auto row : rows.rowwise()) lists.push_back(std::vector<double>(row.begin(), row.end()));
  return lists;
}

Json ToJson(const LatchFile::Content& content) {
  Json json{{"fault", nullptr}, {"contradictions", Json::array()}};
  if (content.fault) json["fault"] = {{"message", content.why}, {"fault_t", Encode(*content.fault)}};
  for (const LatchFile::Contradiction& found : content.contradictions)
    json["contradictions"].push_back({{"model", found.model},
                                      {"z", ToJson(found.rows.z)},
                                      {"next", ToJson(found.rows.x_next)},
                                      {"longer", ToJson(found.rows.longer)},
                                      {"learned", found.rows.num_learned}});
  return json;
}

Eigen::MatrixXd RowsFrom(const Json& lists, std::size_t most) {
  const auto rows = lists.get<std::vector<std::vector<double>>>();
  if (rows.empty() || rows.size() > AffineRows::kMaxColumns + 3 || rows[0].empty() || rows[0].size() > most ||
      rows[0].size() != rows.back().size())
    throw Json::other_error::create(501, "has rows that do not fit", nullptr);
  Eigen::MatrixXd matrix(std::ssize(rows), static_cast<Eigen::Index>(rows[0].size()));
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    for (Eigen::Index k = 0; k < matrix.cols(); ++k)
      matrix(i, k) = rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)];
  return matrix;
}

LatchFile::Content ContentFrom(const Json& json) {
  LatchFile::Content content;
  if (const Json& fault = json.at("fault"); !fault.is_null()) {
    content.fault = Decoded<fault_t>(fault.at("fault_t").get<std::vector<std::uint8_t>>());
    if (!content.fault) throw Json::other_error::create(501, "has a fault_t that cannot be decoded", nullptr);
    content.why = fault.at("message").get<std::string>();
  }
  for (const Json& entry : json.at("contradictions")) {
    LatchFile::Contradiction found{entry.at("model").get<Digest>(), {}};
    found.rows.z = RowsFrom(entry.at("z"), kMaxVariables);
    found.rows.x_next = RowsFrom(entry.at("next"), kMaxStates);
    found.rows.longer = RowsFrom(entry.at("longer"), 1);
    found.rows.num_learned = entry.at("learned").get<int>();
    if (found.rows.x_next.rows() != found.rows.size() || found.rows.longer.size() != found.rows.size() ||
        found.rows.num_learned < 0 || found.rows.num_learned > found.rows.size())
      throw Json::other_error::create(501, "has rows that do not fit", nullptr);
    content.contradictions.push_back(std::move(found));
  }
  return content;
}

// Text of exactly the file's size.
std::string TextOf(const LatchFile::Content& content) {
  const Json inner = ToJson(content);
  std::string text = JsonText(
      {{"format", kFormat}, {"version", kVersion}, {"content", inner}, {"digest", ToHex(DigestOf(JsonText(inner)))}});
  if (text.size() < LatchFile::kBytes) text.resize(LatchFile::kBytes - 1, ' '), text += '\n';
  return text;
}

// @throws Json::exception with the error.
LatchFile::Content ContentOf(const std::string& text) {
  const Json json = ParseJson(text);
  if (json.at("format") != kFormat) throw Json::other_error::create(501, "has another format", nullptr);
  if (json.at("version") != kVersion)
    throw Json::other_error::create(
        501, fmt::format("has version {}, this certifier knows {}", JsonText(json["version"]), kVersion), nullptr);
  if (json.at("digest") != ToHex(DigestOf(JsonText(json.at("content")))))
    throw Json::other_error::create(501, "has another digest than its content", nullptr);
  return ContentFrom(json["content"]);
}

}  // namespace

LatchFile::LatchFile(std::string directory) : directory_(std::move(directory)) { static_cast<void>(OpenDirectory()); }

LatchFile::~LatchFile() {
  CloseFile();
  if (lock_ >= 0) ::close(lock_);
}

void LatchFile::CloseFile() {
  if (file_ >= 0) ::close(std::exchange(file_, -1));
}

bool LatchFile::Fail(const std::string& why) {
  ready_ = false;
  why_ = why;
  return false;
}

bool LatchFile::FailedTo(const std::string& what) {
  return Fail(fmt::format("{}: cannot be {}: {}", path(), what, std::generic_category().message(errno)));
}

bool LatchFile::OpenDirectory() {
  std::error_code error;
  std::filesystem::create_directories(directory_, error);
  const int directory = ::open(directory_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (directory < 0) {
    if (error) errno = error.value();
    return Fail(fmt::format("{}: cannot be made or opened: {}", directory_, std::generic_category().message(errno)));
  }
  if (::flock(directory, LOCK_EX | LOCK_NB) != 0) {
    const int cause = errno;
    ::close(directory);
    if (cause == EWOULDBLOCK)
      throw BadInput(
          fmt::format("gate.state: {}: another certifier keeps its state there; each robot and each standby certifier "
                      "needs its own directory (--state)",
                      directory_));
    return Fail(fmt::format("{}: cannot be locked: {}", directory_, std::generic_category().message(cause)));
  }
  if (lock_ >= 0) ::close(lock_);
  lock_ = directory;
  struct stat its {};
  if (::fstat(lock_, &its) != 0) return FailedTo("looked at");
  if ((its.st_mode & S_IWOTH) != 0 && (its.st_mode & S_ISVTX) == 0)
    return Fail(fmt::format("{}: anybody may write there: chmod o-w it", directory_));
  return true;
}

std::optional<LatchFile::Content> LatchFile::Read() {
  CloseFile();
  may_write_ = ready_ = false;
  struct stat locked {
  }, named{};
  // A lock on a directory that was moved away keeps nobody from the one in its place.
  const bool is_locked = lock_ >= 0 && ::fstat(lock_, &locked) == 0 && ::stat(directory_.c_str(), &named) == 0 &&
                         IsSameFile(locked, named);
  try {
    if (!is_locked && !OpenDirectory()) return std::nullopt;
  } catch (const BadInput& error) {
    return Fail(error.what()), std::nullopt;
  }
  // Opening does not wait for the other end of a pipe, and follows no link.
  const int file = ::openat(lock_, kName, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file < 0 && errno == ENOENT) {
    may_write_ = true;
    return Content();
  }
  if (file < 0) return FailedTo(errno == ELOOP ? "read, it is a symbolic link" : "read"), std::nullopt;
  std::optional<Content> content = ReadFrom(file);
  struct stat read {
  }, written{};
  static_cast<void>(::fstat(file, &read));
  ::close(file);
  if (!content) return std::nullopt;
  holds_fault_ = content->fault.has_value();
  file_ = ::openat(lock_, kName, O_WRONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file_ < 0) {
    FailedTo("written");
  } else if (::fstat(file_, &written) != 0 || !IsSameFile(read, written)) {
    CloseFile();
    Fail(fmt::format("{}: was replaced while it was read", path()));
  } else {
    may_write_ = true;
  }
  return content;
}

std::optional<LatchFile::Content> LatchFile::ReadFrom(int file) {
  const std::string advice = "; it is unknown whether a fault was latched. Find the cause, then delete the file";
  struct stat its {};
  if (::fstat(file, &its) != 0) return FailedTo("looked at"), std::nullopt;
  // This process itself has emptied it, and holds what it could not store.
  if (emptied_ && its.st_size == 0) return Content();
  if (!S_ISREG(its.st_mode)) return Fail(fmt::format("{}: is no regular file{}", path(), advice)), std::nullopt;
  // Whoever may write this file may clear a fault.
  if (its.st_uid != ::geteuid() && its.st_uid != 0)
    return Fail(fmt::format("{}: belongs to user {}, has to belong to user {} or 0{}", path(), its.st_uid, ::geteuid(),
                            advice)),
           std::nullopt;
  if ((its.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    return Fail(fmt::format("{}: others than its owner may write it{}", path(), advice)), std::nullopt;
  if (its.st_size != static_cast<off_t>(kBytes))
    return Fail(fmt::format("{}: has {} bytes, has to have {}{}", path(), its.st_size, kBytes, advice)), std::nullopt;
  std::string text(kBytes, '\0');
  std::size_t taken = 0;
  while (taken < text.size()) {
    const ssize_t result = ::pread(file, text.data() + taken, text.size() - taken, static_cast<off_t>(taken));
    if (result < 0 && errno == EINTR) continue;
    if (result < 0) return FailedTo("read"), std::nullopt;
    if (result == 0) break;
    taken += static_cast<std::size_t>(result);
  }
  text.resize(taken);
  try {
    return ContentOf(text);
  } catch (const Json::exception& error) {
    return Fail(fmt::format("{}: is damaged: it {}{}", path(), DescribeJsonError(error), advice)), std::nullopt;
  }
}

bool LatchFile::Create(const std::string& text) {
  ::unlinkat(lock_, kNewName, 0);
  // Under another name first, then renamed: a reader finds no file, or a whole one.
  const int made = ::openat(lock_, kNewName, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (made < 0) return FailedTo("made");
  file_ = made;
  if (WriteAt(made, text, 0) && ::fsync(made) == 0 && ::renameat(lock_, kNewName, lock_, kName) == 0 &&
      ::fsync(lock_) == 0)
    return true;
  FailedTo("made");
  CloseFile();
  ::unlinkat(lock_, kNewName, 0);
  return false;
}

bool LatchFile::Put(const Content& content) {
  if (!may_write_) return false;
  const std::string text = TextOf(content);
  if (content.contradictions.size() > kMostContradictions || text.size() != kBytes) {
    // A fault that cannot be stored must not look like "no fault" at the next start.
    if (file_ >= 0 && !holds_fault_) emptied_ = ::ftruncate(file_, 0) == 0;
    return Fail(fmt::format("{}: holds at most {} contradictions; once a declaration is true, delete the file", path(),
                            kMostContradictions));
  }
  if (file_ < 0 ? Create(text) : WriteAt(file_, text, 0)) {
    holds_fault_ = content.fault.has_value();
    emptied_ = false;
    return true;
  }
  if (file_ < 0) return false;
  FailedTo("written");
  // What was written in part must not read as the content before it, which says that there is no fault.
  if (content.fault && !holds_fault_) emptied_ = ::ftruncate(file_, 0) == 0;
  return false;
}

bool LatchFile::Flush() {
  if (file_ < 0) return false;
  if (::fdatasync(file_) != 0) return FailedTo("written to the disk");
  Look();
  return ready_;
}

void LatchFile::Look() {
  struct stat its {
  }, found{}, locked{}, named{};
  struct statvfs disk {};
  ready_ = false;
  if (file_ < 0 || ::fstat(file_, &its) != 0 || ::fstat(lock_, &locked) != 0)
    return static_cast<void>(FailedTo("looked at"));
  // Writes into a file that has no name any more succeed, and no restart reads them.
  if (::stat(directory_.c_str(), &named) != 0 || !IsSameFile(locked, named) ||
      ::fstatat(lock_, kName, &found, AT_SYMLINK_NOFOLLOW) != 0 || !IsSameFile(its, found))
    return static_cast<void>(Fail(fmt::format("{}: was deleted or replaced", path())));
  if (::fstatvfs(file_, &disk) != 0) return static_cast<void>(FailedTo("looked at"));
  if ((disk.f_flag & ST_RDONLY) != 0)
    return static_cast<void>(Fail(fmt::format("{}: cannot be written: its disk is read-only", path())));
  ready_ = true;
  why_.clear();
}

}  // namespace forereach
