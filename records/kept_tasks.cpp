#include "records/kept_tasks.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include "bus/descriptor.h"
#include "records/event_log.h"
#include "task/config.h"
#include "task/files.h"

namespace forereach {
namespace {

namespace fs = std::filesystem;

constexpr const char *kTasks = "tasks", *kTask = "task.yaml", *kModel = "model.yaml";
constexpr std::string_view kTransitions = "transitions-", kTransitionsEnding = ".csv", kPolicy = "policy-";
constexpr std::int64_t kLargestFile = 256 * kMegabyte;

bool IsDigest(std::string_view text) {
  return text.size() == kHexDigits && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

std::string BytesOf(const std::string& path) { return ReadWhole(path, kLargestFile); }

[[noreturn]] void FailToWrite(const std::string& path) {
  throw ConfigError("{}: cannot be written: {}", path, std::strerror(errno));
}

void Confirm(const std::string& directory) {
  if (!ConfirmDirectory(directory)) FailToWrite(directory);
}

// The name of the temporary file next to `path`, before it is renamed.
class Part final {
 public:
  Part(const std::string& path, const std::string& bytes) : path_(path), part_(path + ".part") {
    ::unlink(part_.c_str());  // of a logger that was killed
    const Descriptor file(::open(part_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644));
    if (file.get() < 0 || !WriteAt(file.get(), bytes, 0) || ::fsync(file.get()) != 0) FailToWrite(part_);
  }
  ~Part() { ::unlink(part_.c_str()); }
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  [[nodiscard]] const std::string& path() const { return part_; }
  void Finish() const {
    if (::rename(part_.c_str(), path_.c_str()) != 0) FailToWrite(path_);
  }

 private:
  std::string path_, part_;
};

// The digests in the names of the files that begin and end so; sorted.
std::vector<std::string> DigestsOfNames(const std::string& directory, std::string_view beginning,
                                        std::string_view ending) {
  std::vector<std::string> digests;
  std::error_code error;
  for (fs::directory_iterator file(directory, error), end; !error && file != end; file.increment(error)) {
    const std::string name = file->path().filename().string();
    if (name.size() != beginning.size() + kHexDigits + ending.size() || !name.starts_with(beginning) ||
        !name.ends_with(ending))
      continue;
    if (const std::string digest = name.substr(beginning.size(), kHexDigits); IsDigest(digest))
      digests.push_back(digest);
  }
  std::ranges::sort(digests);
  return digests;
}

std::string TransitionsFileOf(const std::string& directory, const std::string& digest) {
  return directory + "/" + std::string(kTransitions) + digest + std::string(kTransitionsEnding);
}

std::string PolicyFileOf(const std::string& directory, const std::string& digest) {
  return directory + "/" + std::string(kPolicy) + digest;
}

}  // namespace

TaskCopy CopyTask(const Config& config) {
  TaskCopy copy{
      config.grounds.config, config.grounds.observations, config.problem->model, BytesOf(config.path), {}, {}, {}};
  const NamedFiles named = FilesNamedBy(config.path);
  if (!named.model.empty()) copy.model_file = BytesOf(named.model);
  // The files are read a second time here: what changed since would be kept under a digest that is not its own.
  if (TaskDigest(copy.task, copy.model_file) != config.grounds.config)
    throw ConfigError("{}: has changed since it was read{}", config.path,
                      named.model.empty() ? "" : fmt::format(", or {} has", named.model));
  copy.transitions = BytesOf(named.transitions);
  if (!named.policy.empty()) copy.policy = BytesOf(named.policy);
  return copy;
}

KeptTasks::KeptTasks(const std::string& log_directory) : path_((fs::path(log_directory) / kTasks).string()) {}

KeptTasks KeptTasks::Beside(const std::string& log) { return KeptTasks(fs::path(log).parent_path().string()); }

std::string KeptTasks::PathOf(const Digest& digest) const { return path_ + "/" + ToHex(digest); }

void KeptTasks::Keep(const TaskCopy& copy) const {
  const std::string directory = PathOf(copy.digest), task = directory + "/" + kTask;
  const std::string transitions = TransitionsFileOf(directory, ToHex(copy.observations_digest));
  const std::string policy = copy.policy.empty() ? "" : PolicyFileOf(directory, ToHex(DigestOf(copy.policy)));
  if (fs::exists(task) && fs::exists(transitions) && (policy.empty() || fs::exists(policy))) return;
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) throw ConfigError("{}: cannot be made: {}", directory, error.message());
  const Part data(transitions, copy.transitions);
  if (ObservationsDigest(*copy.model, LoadTransitions(data.path(), *copy.model)) != copy.observations_digest)
    throw ConfigError("the transitions of the task have changed since they were read");
  data.Finish();
  if (!policy.empty()) Part(policy, copy.policy).Finish();
  if (!copy.model_file.empty()) Part(directory + "/" + kModel, copy.model_file).Finish();
  Part(task, copy.task).Finish();  // last: with it the task is there
  Confirm(directory);
  Confirm(path_);
}

bool KeptTasks::HasAny() const {
  std::error_code no_path;
  return fs::is_directory(path_, no_path);
}

std::optional<Config> KeptTasks::Find(const Digest& digest,
                                      const std::function<std::set<Digest>()>& observations) const {
  const std::string directory = PathOf(digest), task = directory + "/" + kTask;
  std::error_code no_path;
  if (!fs::exists(task, no_path)) return std::nullopt;
  std::vector<std::string> versions = DigestsOfNames(directory, kTransitions, kTransitionsEnding);
  if (versions.empty()) throw ConfigError("{}: its transitions are not kept next to it", task);
  // A task file may stay while its transitions change between runs: the log says which of them it knew.
  if (versions.size() > 1)
    std::erase_if(versions, [seen = observations()](const std::string& version) {
      return std::ranges::none_of(seen, [&](const Digest& named) { return ToHex(named) == version; });
    });
  if (versions.size() != 1)
    throw ConfigError(
        "{}: of the versions of its transitions beside it the log names {}; copy the right one to where "
        "the task file has it, and name the task with --config",
        task, versions.empty() ? "none" : "several");
  return Load(ToHex(digest), versions.front());
}

Config KeptTasks::Load(const std::string& digest, const std::string& version) const {
  const std::string directory = path_ + "/" + digest, task = directory + "/" + kTask;
  const std::string transitions = TransitionsFileOf(directory, version);
  const std::string model = directory + "/" + kModel;
  NamedFiles instead{transitions, {}, fs::exists(model) ? model : ""};
  for (const std::string& policy : DigestsOfNames(directory, kPolicy, "")) {
    instead.policy = PolicyFileOf(directory, policy);
    if (ToHex(DigestOf(BytesOf(instead.policy))) != policy)
      throw ConfigError("{}: is damaged: its digest is not its name's", instead.policy);
  }
  Config config = LoadConfig(task, instead);
  if (ToHex(config.grounds.config) != digest)
    throw ConfigError("{}: is damaged: its digest is {}, not its directory's", task, ToHex(config.grounds.config));
  if (ToHex(config.grounds.observations) != version)
    throw ConfigError("{}: is damaged: its digest is {}, not its name's", transitions,
                      ToHex(config.grounds.observations));
  return config;
}

std::vector<std::string> KeptTasks::FindDamage(const std::string& digest) const {
  const std::string directory = path_ + "/" + digest, task = directory + "/" + kTask;
  std::error_code no_path;
  if (!IsDigest(digest) || !fs::exists(task, no_path)) return {};
  const std::vector<std::string> versions = DigestsOfNames(directory, kTransitions, kTransitionsEnding);
  if (versions.empty()) return {fmt::format("{}: its transitions are not kept next to it", task)};
  std::vector<std::string> damage;
  for (const std::string& version : versions) try {
      static_cast<void>(Load(digest, version));
    } catch (const BadInput& error) {
      damage.emplace_back(error.what());
    }
  return damage;
}

void KeptTasks::Remove(const std::string& digest) const {
  if (!IsDigest(digest)) return;
  const std::string directory = path_ + "/" + digest;
  std::error_code ignored;
  for (const char* name : {kTask, kModel}) fs::remove(directory + "/" + name, ignored);
  for (const std::string& version : DigestsOfNames(directory, kTransitions, kTransitionsEnding))
    fs::remove(TransitionsFileOf(directory, version), ignored);
  for (const std::string& version : DigestsOfNames(directory, kPolicy, ""))
    fs::remove(PolicyFileOf(directory, version), ignored);
  fs::remove(directory, ignored);
}

}  // namespace forereach
